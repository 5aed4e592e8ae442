"""A command as a process: signals, and a standard output that is full, closed or of another encoding.

The first Ctrl-C or SIGTERM ends a command soon and keeps what is done, the second ends it at once.
"""

import os
import select
import signal
import subprocess
import sys
import time
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest
from tests.process import Duplicate, run_program

import scissordyn as sd
from scissordyn.cli import entry
from scissordyn.cli import main as main_module
from scissordyn.cli import run as run_module
from scissordyn.cli.main import install_signal_handlers
from scissordyn.periodic import bifurcation

EXAMPLES = Path(__file__).parents[2] / "examples"  # Folder of the package's example cases
# Options of a run that takes much longer than a test
LONG = ("--set", "run.until=2000 s", "--set", "run.most_steps=1000000000", "--set", "run.samples=2000")


@contextmanager
def started(*command):
    """Start a process that leads its own group, as a command of a shell does, and kill the group at the end.

    A command that begins with a function is a duplicate of this process.
    """
    if callable(command[0]):
        process = Duplicate(*command)
    else:
        pipe = subprocess.PIPE
        process = subprocess.Popen(command, stdout=pipe, stderr=pipe, text=True, start_new_session=True)
    try:
        yield process
    finally:
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.communicate()


def ended(process):
    """Return the output and the errors of a process that should end now."""
    return process.communicate(timeout=100)


def members(group):
    """Return the processes of a group, without those that have ended and wait for their parent."""
    found = []
    for path in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError):  # it has ended meanwhile
            name, _, rest = path.read_text().rpartition(")")
            state, _, of_group, *_ = rest.split()
            found += [name] if of_group == str(group) and state != "Z" else []
    return found


def living(group):
    """Return the processes of a group that have not ended after a while."""
    for _ in range(200):
        if not (found := members(group)):
            break
        time.sleep(0.01)
    return found


def wait_for(condition, process, seconds=300.0):
    """Wait until a condition holds, while a process runs."""
    assert callable(condition)
    until = time.monotonic() + seconds
    while not condition():
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < until
        time.sleep(0.05)


def says(process, text):
    """Wait for a line of a process."""
    assert process.stdout is not None
    assert select.select([process.stdout], [], [], 300.0)[0]
    assert process.stdout.readline() == text


def run_and_announce(*words):
    """Run the program, and print a line when an integration begins."""

    @contextmanager
    def announcing(until):
        said = []
        yield lambda time: said or said.append(print("computing", flush=True)) or said.append(time)

    run_module.progress_bar = announcing
    run_program(*words)


@pytest.mark.parametrize(("number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_run_that_is_stopped_is_kept(tmp_path, number, status):
    """Contract: either signal ends a run, which is saved and marked, and the file is named."""
    target = tmp_path / "part.nc"
    with started(run_and_announce, "run", EXAMPLES / "paper.toml", "-o", target, *LONG) as process:
        says(process, "computing\n")
        process.send_signal(number)
        out, err = ended(process)
    assert process.returncode == status
    assert f"Saved to {target}, marked interrupted" in out
    assert err.startswith("scissordyn: stopped at t = ")
    assert err.count("\n") == 1
    assert 0.0 < sd.load(target).attrs["end"] < 2000.0
    assert list(tmp_path.iterdir()) == [target]


def run_and_save_often(*words):
    """Run the program, and save bifurcation diagrams every 0.1 s."""
    bifurcation.SAVE_SECONDS = 0.1
    run_program(*words)


# Options of a bifurcation diagram that takes longer than a test
SCAN = ("--over", "A.clearance", "--from", "0.1 mm", "--to", "0.2 mm", "--values", "200", "--cycles", "4", "--threads", "2")


@pytest.mark.parametrize(
    ("number", "whole_group"),
    [
        (signal.SIGINT, False),
        (signal.SIGTERM, True),
        pytest.param(signal.SIGINT, True, marks=pytest.mark.slow),
        pytest.param(signal.SIGTERM, False, marks=pytest.mark.slow),
    ],
)
def test_a_diagram_that_is_stopped_is_kept(tmp_path, number, whole_group):
    """Contract: a signal to the command or to its whole group ends it, and the file holds what was done."""
    target = tmp_path / "diagram.nc"
    with started(run_and_save_often, "bifurcation", EXAMPLES / "periodic.toml", *SCAN, "-o", target) as process:
        wait_for(target.exists, process)
        (os.killpg if whole_group else os.kill)(process.pid, number)
        out, err = ended(process)
        assert living(process.pid) == []
    assert process.returncode == 128 + number
    assert f"Saved to {target}, marked interrupted" in out
    assert err == "scissordyn: interrupted; the same command continues from the file\n"
    stored = sd.load(target)
    done = stored["status"].values.tolist().count("complete")
    assert 0 < done < 200
    assert list(tmp_path.iterdir()) == [target]


# Options that choose the threads or processes of a command
ENGINES = ("--threads", "1"), ("--threads", "2"), ("--workers", "2")
SIGNALS = signal.SIGINT, signal.SIGTERM, signal.SIGKILL  # Signals that end a command
QUICK_PAIRS = {(SIGNALS[1], ENGINES[1]), (SIGNALS[2], ENGINES[2])}
"""Pairs of signal and option in every test run: a signal that threads handle, and one that leaves worker processes behind."""


@pytest.mark.parametrize(
    ("number", "engine"),
    [
        pytest.param(number, engine, marks=() if (number, engine) in QUICK_PAIRS else pytest.mark.slow)
        for number in SIGNALS
        for engine in ENGINES
    ],
)
def test_the_paper_can_be_stopped(tmp_path, number, engine):
    """Contract: no process is left over, and what is done is kept and named."""
    with started(run_program, "paper", "-o", tmp_path, *engine) as process:
        if number == signal.SIGKILL and "--workers" in engine:
            wait_for(lambda: len(members(process.pid)) > 2, process)  # the workers have been started
        else:
            wait_for(lambda: list(tmp_path.glob("runs/*.nc")), process)
        if number == signal.SIGKILL:
            process.kill()
        else:
            os.killpg(process.pid, number)
        _, err = ended(process)
        assert living(process.pid) == []
    if number != signal.SIGKILL:
        assert process.returncode == 128 + number
        assert err == f"scissordyn: interrupted; completed runs are in {tmp_path}; the same command continues from there\n"
    for path in tmp_path.glob("runs/*.nc"):
        assert sd.load(path).attrs["status"] == "complete"


def swallow_signals():
    """Handle signals but catch the exception of each."""
    install_signal_handlers()
    while True:
        try:
            print("ready", flush=True)
            while True:
                time.sleep(0.01)
        except KeyboardInterrupt:
            print("noticed", flush=True)


@pytest.mark.parametrize(("first", "second"), [(signal.SIGINT, signal.SIGTERM), (signal.SIGTERM, signal.SIGINT)])
def test_a_second_signal_ends_at_once(first, second):
    """Contract: a command that is busy with the first signal, or has swallowed it, is ended by the second."""
    with started(swallow_signals) as process:
        says(process, "ready\n")
        process.send_signal(first)
        says(process, "noticed\n")
        process.send_signal(second)
        process.communicate(timeout=100)
    assert process.returncode == -second


class Callback:
    """Object that waits where Python drops exceptions."""

    def __del__(self):
        print("ready", flush=True)
        time.sleep(100)


def lose_an_exception():
    """Run a command in which Python loses the exception of a signal, because a callback raises it."""

    def command(_):
        callback = Callback()
        del callback
        time.sleep(100)

    main_module.status_of = command
    entry.run()


@pytest.mark.parametrize(("number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_signal_that_python_drops(number, status):
    """Contract: a signal ends the command even if it comes in `__del__` or a callback, where Python ignores exceptions."""
    with started(lose_an_exception) as process:
        says(process, "ready\n")
        process.send_signal(number)
        _, err = process.communicate(timeout=50)
    assert (process.returncode, err) == (status, "scissordyn: interrupted\n")


def test_a_signal_while_the_commands_are_loaded():
    """Contract: no traceback, at whatever moment of the start."""
    code = "import sys; from scissordyn.cli import entry; sys.argv[1:] = ['laws']; print('ready', flush=True); entry.run()"
    for wait in (0.02, 0.1, 0.2, 0.3, 0.4):
        with started(sys.executable, "-c", code) as process:
            says(process, "ready\n")
            time.sleep(wait)
            process.send_signal(signal.SIGINT)
            _, err = ended(process)
        assert err in ("", "scissordyn: interrupted\n")
        assert process.returncode in (-signal.SIGINT, 130, 0)


PROGRAM = f"{sys.executable} -m scissordyn"  # Shell command of `scissordyn`
# Environment variables of a terminal that shows ASCII characters only
ASCII = {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}


def shell(command, folder, **environment):
    """Run a command by bash and return its result; the status of a pipe is that of the program."""
    line = f"set -o pipefail; {command}"
    variables = {**os.environ, **environment}
    return subprocess.run(["bash", "-c", line], cwd=folder, env=variables, capture_output=True, timeout=300, check=False)


@pytest.mark.parametrize("command", ["laws", "--help", "--version"])
def test_a_full_disk(command, tmp_path):
    """Contract: what cannot be printed is an error of one line with status 2."""
    done = shell(f"{PROGRAM} {command} > /dev/full", tmp_path)
    assert done.returncode == 2
    assert done.stderr.decode().startswith("scissordyn: cannot write to standard output: No space left on device")
    assert done.stderr.count(b"\n") == 1


@pytest.mark.parametrize("command", ["laws | head -1", "--help | head -1", "laws >&-", "laws >&- 2>&-"])
def test_nobody_reads(command, tmp_path):
    """Contract: a pipe that is closed early and an output that is closed are no error."""
    done = shell(f"{PROGRAM} {command}", tmp_path)
    assert done.returncode == 0
    assert done.stderr == b""


@pytest.mark.parametrize("to", ["2> /dev/full", "2>&-"])
@pytest.mark.parametrize("unbuffered", ["", "1"])
def test_no_room_for_an_error(to, unbuffered, tmp_path):
    """Contract: the status tells of an error that cannot be written, whether Python buffers it or not."""
    assert shell(f"{PROGRAM} nonsense {to}", tmp_path, PYTHONUNBUFFERED=unbuffered).returncode == 2


@pytest.mark.parametrize("environment", [{"PYTHONIOENCODING": "ascii"}, ASCII])
def test_ascii_terminals(environment, tmp_path):
    """Contract: letters that the encoding lacks are written as their codes."""
    command = f"{PROGRAM} run {EXAMPLES / 'paper.toml'} --set 'run.until=0.1 ms' --samples 3 -o é.nc; {PROGRAM} laws lugre"
    done = shell(command, tmp_path, **environment)
    assert (done.returncode, done.stderr) == (0, b"")
    assert done.stdout.isascii()
    assert b"100 \\xb5s simulated" in done.stdout
    assert (tmp_path / "é.nc").exists()
