"""Processes of this machine, joined to this one by pipes: nothing listens, so that no other user can reach them."""

from __future__ import annotations

import os
import pickle
import queue
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from multiprocessing import get_context
from multiprocessing.connection import Connection
from typing import Any, TypeVar

from cloudpickle import dumps

from scissordyn.errors import ScissordynError, whole_number
from scissordyn.run.engine import QUICKLY, Begun, EngineError, Outcome, in_threads
from scissordyn.study.engine import ATTEMPTS, signals_blocked

Task = TypeVar("Task")
Value = TypeVar("Value")

PATIENCE = 10.0
"""How long a process may take to end when there is no more work [s]."""

READY = b"ready"
"""First message of a process."""

BEGINNING = threading.Lock()
"""Held while a process is started: what it inherits is changed meanwhile."""

LIBRARIES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
"""Libraries of linear algebra start a thread for each processor, in each process, unless these say otherwise."""


class _DiedError(Exception):
    """A process ended in the middle of a task."""


class Processes(Begun):
    """Other processes of this machine, each of which does one task at a time.

    They end with the context in which they are used, and also with this process if that is killed.

    Parameters
    ----------
    workers : int
        How many.

    Raises
    ------
    InputError
        If that is not a whole number >= 1.
    """

    def __init__(self, workers: int) -> None:
        self.workers = whole_number("workers", workers)
        self._all = [_Worker() for _ in range(workers)]
        self._idle: queue.SimpleQueue[_Worker] = queue.SimpleQueue()
        for worker in self._all:
            self._idle.put(worker)

    @contextmanager
    def _running(self) -> Iterator[None]:
        try:
            for worker in self._all:
                worker.start()
            yield
        except BaseException:
            self._kill()
            raise
        for worker in self._all:
            worker.pipe.close()
        for worker in self._all:
            worker.process.join(PATIENCE)
            worker.kill()

    def _kill(self) -> None:
        for worker in self._all:
            worker.kill()

    def each(self, function: Callable[[Task], Value], tasks: Iterable[Task]) -> Iterator[Outcome[Task, Value]]:
        """Results in the order in which they come; the task of a process that died is done again.

        Parameters
        ----------
        function : callable
            Of a task.
        tasks : iterable

        Yields
        ------
        Outcome

        Raises
        ------
        EngineError
            If processes cannot be started.
        """
        stopped = threading.Event()

        def elsewhere(task: Task) -> Outcome[Task, Value]:
            content = dumps((function, task))
            for _ in range(ATTEMPTS):
                worker = self._idle.get()
                try:
                    value, error = pickle.loads(worker.ask(content, stopped))
                except _DiedError:
                    continue
                finally:
                    self._idle.put(worker)
                return Outcome(task, value, error)
            return Outcome(task, None, ScissordynError("the processes that computed it died"))

        def stop() -> None:
            stopped.set()
            self._kill()

        yield from in_threads(elsewhere, tasks, self.workers, stop)


class _Worker:
    """A process and the pipe to it; started when it is first needed, and again after its death."""

    process: Any
    pipe: Connection

    def __init__(self) -> None:
        self._runs = self._ready = False

    def start(self) -> None:
        """Start the process; whether that succeeds is seen at the first task."""
        context = get_context("spawn")
        self.pipe, theirs = context.Pipe()
        # daemons end with this process, were it not for any of the other ways in which they do
        self.process = context.Process(target=_work, args=(theirs,), name="scissordyn worker", daemon=True)
        try:
            with BEGINNING, signals_blocked(), _one_thread_each():
                self.process.start()
        except OSError as error:
            self.pipe.close()
            raise EngineError(f"no process can be started: {error.strerror or error}; what is complete is kept") from error
        finally:
            theirs.close()
        self._runs, self._ready = True, False

    def ask(self, content: bytes, stopped: threading.Event) -> bytes:
        """The answer to a task."""
        if not self._runs and not stopped.is_set():
            self.start()
        if stopped.is_set():  # whoever sets it kills what runs, and may have come before the process that is started here
            self.kill()
            raise _DiedError
        try:
            if not self._ready:
                self._ready = self.pipe.recv_bytes() == READY
            self.pipe.send_bytes(content)
            return self.pipe.recv_bytes()
        except (EOFError, OSError):
            self.process.join(QUICKLY)
            code = self.process.exitcode or 0
            self.kill()
            if not self._ready and code > 0:  # not by a signal: Python said why on stderr
                raise EngineError(
                    "a worker process could not begin; a script that starts some needs 'if __name__ == \"__main__\":'"
                ) from None
            raise _DiedError from None

    def kill(self) -> None:
        """End the process in the middle of whatever it does; the pipe is closed when a new one takes its place."""
        if self._runs:
            self._runs = False
            self.process.kill()
            self.process.join(QUICKLY)


@contextmanager
def _one_thread_each() -> Iterator[None]:
    """Processes that are started meanwhile use one thread for linear algebra, unless the user has said otherwise."""
    added = {name: "1" for name in LIBRARIES if name not in os.environ}
    os.environ.update(added)
    try:
        yield
    finally:
        for name in added:
            os.environ.pop(name, None)


# --- in the other process -----------------------------------------------------------------------------------------------


def _work(pipe: Connection) -> None:
    """Answer one task after the other, until the other end of the pipe is closed."""
    tasks: queue.SimpleQueue[bytes | None] = queue.SimpleQueue()
    threading.Thread(target=_receive, args=(pipe, tasks), daemon=True).start()
    with suppress(OSError):
        pipe.send_bytes(READY)
        while (content := tasks.get()) is not None:
            pipe.send_bytes(_answer(content))


def _receive(pipe: Connection, tasks: queue.SimpleQueue[bytes | None]) -> None:
    """Hand tasks on; end the process when the one that started it is gone, also in the middle of a task."""
    try:
        while True:
            tasks.put(pipe.recv_bytes())
    except (EOFError, OSError):
        tasks.put(None)
        time.sleep(QUICKLY)
        os._exit(0)


def _answer(content: bytes) -> bytes:
    try:
        return bytes(dumps((_done(content), None)))
    except Exception as error:
        with suppress(Exception):
            answer = bytes(dumps((None, error)))
            pickle.loads(answer)  # not every error can be sent
            return answer
        return bytes(dumps((None, RuntimeError(f"{type(error).__name__}: {error}"))))


def _done(content: bytes) -> Any:
    function, task = pickle.loads(content)
    return function(task)
