"""Duplicates of the process of the tests: another process for a tenth of the time of a fresh interpreter.

They have all modules from the start. What a fresh interpreter loads, its environment and its end need one.
"""

import gc
import os
import signal
import sys
import threading
import traceback
import warnings
from contextlib import suppress
from tempfile import TemporaryFile

import pytest

from scissordyn.cli import entry


def run_program(*words):
    """Run the program with its arguments, and end the process."""
    sys.argv[1:] = map(str, words)
    entry.run()


class Duplicate:
    """Duplicate of this process that runs a function, and its output and errors; it leads its own group, as a command does.

    As in `subprocess.Popen`, `with` waits for its end, and `returncode` is minus the signal that killed it.
    """

    def __init__(self, function, *arguments):
        if sys.platform != "linux":
            pytest.skip("processes are duplicated on Linux only")
        reading, writing = os.pipe()
        self.returncode, self.said = None, ("", "")
        # a pipe could fill while only the output is read
        self.stdout, self.stderr = os.fdopen(reading), TemporaryFile("w+")  # noqa: SIM115
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)  # of Python 3.12 about waiting threads of the tests' runner
            self.pid = os.fork()
        if not self.pid:
            _run(function, arguments, (writing, self.stderr.fileno()))
        os.close(writing)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.communicate()

    def poll(self, options=os.WNOHANG):
        """Return the status of the process, and None while it runs."""
        if self.returncode is None:
            ended, status = os.waitpid(self.pid, options)
            self.returncode = os.waitstatus_to_exitcode(status) if ended else None
        return self.returncode

    def send_signal(self, number):
        """Send a signal to the process unless it has ended."""
        if self.poll() is None:
            os.kill(self.pid, number)

    def kill(self):
        """Kill the process unless it has ended."""
        self.send_signal(signal.SIGKILL)

    def communicate(self, timeout=100):
        """Wait for the end of the process, and return its output and its errors; after `timeout` [s] its group is killed."""
        if not self.stdout.closed:
            limit = threading.Timer(timeout, os.killpg, (self.pid, signal.SIGKILL))
            limit.start()
            with self.stdout, self.stderr:
                out = self.stdout.read()
                self.poll(options=0)
                self.stderr.seek(0)
                self.said = out, self.stderr.read()
            if limit.finished.is_set():
                raise TimeoutError(self.said)
            limit.cancel()
        return self.said


def _run(function, arguments, streams):
    """Run a function in a new process, and end the process."""
    status = 1
    try:
        os.setsid()
        for number, stream in enumerate(streams, 1):
            os.dup2(stream, number)
        sys.stdout, sys.stderr = (os.fdopen(number, "w", closefd=False) for number in (1, 2))
        signal.signal(signal.SIGINT, signal.default_int_handler)
        gc.freeze()
        function(*arguments)
        status = 0
    except SystemExit as end:
        status = end.code
    except BaseException:
        traceback.print_exc()
    finally:
        with suppress(OSError):
            sys.stdout.flush()
            sys.stderr.flush()
        os._exit(status)
