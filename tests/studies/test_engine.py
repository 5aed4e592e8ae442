"""Engines: what becomes of tasks, and of those in work when nobody wants their results."""

from __future__ import annotations

import multiprocessing
import os
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from pathlib import Path
from types import SimpleNamespace

import pytest

import scissordyn as sd
from scissordyn.run.advance.interrupt import check_interrupt, interrupted_by
from scissordyn.run.engine import EngineError, Outcome, error_text, outcomes, workers_of

LONG = 2000.0  # Simulated time that takes minutes [s]


def divided(task: object) -> float:
    """Some of the ways in which a task may end."""
    if task == "refuse":
        raise sd.InputError("what came", "what is allowed")
    return 1.0 / task  # type: ignore[operator]


@pytest.mark.parametrize("threads", [1, 2])
def test_every_task_has_its_outcome(threads: int) -> None:
    """Contract: a value, or the error that was raised; with one thread in the order of the tasks."""
    tasks = [4.0, 0.0, "refuse", "text", 8.0]
    found = list(outcomes(threads, divided, tasks))
    assert sorted(tasks.index(one.task) for one in found) == [0, 1, 2, 3, 4]
    by_task = {one.task: one for one in found}
    assert (by_task[4.0], by_task[8.0]) == (Outcome(4.0, 0.25), Outcome(8.0, 0.125))
    said = [error_text(by_task[task].error) for task in tasks[1:4]]
    assert said[:2] == ["ZeroDivisionError: float division by zero", "what came; expected what is allowed"]
    assert said[2].startswith("TypeError: ")
    assert threads > 1 or [one.task for one in found] == tasks
    assert list(outcomes(threads, divided, [])) == []


def simulated(task: int) -> int:
    """The number at once for the first task, after minutes for others."""
    if task:
        sd.simulate(sd.four_bar().driven(speed=1.0), until=LONG, samples=2, most_steps=10**9)
    return task


def test_leaving_interrupts_what_is_in_work() -> None:
    """Contract: threads that simulate end after the slice that they are in, and no task is begun any more."""
    sd.simulate(sd.four_bar().driven(speed=1.0), until=0.1)  # with all kernels loaded
    begun = threading.active_count()
    results = outcomes(2, simulated, [0, 1, 2, 3])
    assert next(results).value == 0
    results.close()
    assert threading.active_count() == begun


def test_a_thread_looks_at_its_own_event() -> None:
    """Contract: only where it was asked to, and only once the event is set."""
    stop = threading.Event()
    with interrupted_by(stop):
        check_interrupt()
        stop.set()
        with pytest.raises(KeyboardInterrupt):
            check_interrupt()
    check_interrupt()


@pytest.mark.parametrize("threads", [0, -1, True, 1.5])
def test_bad_numbers_of_threads(threads: int) -> None:
    """Contract: one line."""
    with pytest.raises(sd.InputError, match=f"(threads|engine) = {threads}"):
        workers_of(threads)
    assert workers_of(None) >= 1


def test_any_executor_is_an_engine() -> None:
    """Contract: threads and processes of the standard library that the caller has begun; others are refused."""
    with ThreadPoolExecutor(2) as pool:
        assert sorted(outcome.value for outcome in outcomes(pool, abs, [-1, -2, -3])) == [1, 2, 3]
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
        assert sorted(outcome.value for outcome in outcomes(pool, lambda task: task + 1, [1, 2])) == [2, 3]  # of no module
        with pytest.raises(EngineError, match=r"a worker died .*; completed tasks are kept"):
            list(outcomes(pool, fatal, [2]))
    with pytest.raises(sd.InputError, match="engine = 'two'"):
        list(outcomes("two", abs, []))  # type: ignore[arg-type]


@pytest.mark.parametrize(("threads", "workers"), [({"one": 2, "two": 3}, 5), ({}, 1)])
def test_workers_of_a_cluster(threads: dict[str, int], workers: int) -> None:
    """Contract: as many tasks at once as the workers of dask's executor have threads, and one while there is none."""
    with ThreadPoolExecutor(1) as pool:
        pool._client = SimpleNamespace(nthreads=lambda: threads)  # type: ignore[attr-defined]
        assert workers_of(pool) == workers


def getpid(_: int) -> int:
    """The process that does a task, some time after it was given it."""
    time.sleep(0.2)
    return os.getpid()


def fatal(task: int) -> int:
    """A task that ends its process, if it is the second."""
    if task == 2:
        os.kill(os.getpid(), signal.SIGKILL)
    return task


class UnsentError(Exception):
    """An error that cannot be made anew from its arguments."""

    def __init__(self, first: int, second: int) -> None:
        super().__init__(f"{first} {second}")


def failing(task: int) -> int:
    """Each task fails in its own way."""
    if task == 1:
        raise sd.InputError("a bar of 0 m", "more", "1 m")
    raise UnsentError(task, 3)


def test_what_becomes_of_tasks_in_processes() -> None:
    """Contract: values, errors, and a task whose process dies each time, which costs no other task its value."""
    with sd.Processes(2) as engine:
        died: list[Outcome[int, int]] = sorted(outcomes(engine, fatal, [1, 2, 3, 4]), key=lambda one: one.task)
        errors: list[Outcome[int, int]] = sorted(outcomes(engine, failing, [1, 2]), key=lambda one: one.task)
        results = outcomes(engine, getpid, range(50))  # left early
        assert isinstance(next(results).value, int)
        results.close()
        again = [outcome.value for outcome in outcomes(engine, abs, [-1, -2])]
    assert [outcome.value for outcome in died] == [1, None, 3, 4]
    assert died[1].error is not None
    assert error_text(died[1].error) == "the processes that computed it died"
    assert isinstance(errors[0].error, sd.InputError)
    assert str(errors[0].error) == "a bar of 0 m; expected more; for example 1 m"
    assert isinstance(errors[1].error, RuntimeError)
    assert str(errors[1].error) == "UnsentError: 2 3"
    assert sorted(map(int, again)) == [1, 2]


def test_processes_end_with_the_one_that_started_them(tmp_path: Path) -> None:
    """Contract: also where that is killed in the middle of a task."""
    script = tmp_path / "killed.py"
    script.write_text(KILLED)
    with subprocess.Popen([sys.executable, str(script)], stdout=subprocess.PIPE, text=True) as started:
        assert started.stdout is not None
        worker = int(started.stdout.readline())
        started.kill()
    deadline = time.monotonic() + 20.0
    while is_running(worker):
        assert time.monotonic() < deadline
        time.sleep(0.05)


def is_running(process: int) -> bool:
    """Whether a process is there and no zombie that nobody has waited for."""
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    status = Path(f"/proc/{process}/status")
    return not (status.exists() and "State:\tZ" in status.read_text())


KILLED = """
import os, sys, time
from scissordyn.run.engine import Processes, outcomes

if __name__ == "__main__":
    with Processes(1) as engine:
        for outcome in outcomes(engine, lambda task: os.getpid() if not task else time.sleep(600), [0, 1]):
            print(outcome.value, flush=True)
"""

UNGUARDED = """
from scissordyn.run.engine import Processes, outcomes
with Processes(1) as engine:
    list(outcomes(engine, abs, [1]))
"""


def test_a_script_without_a_guard(tmp_path: Path) -> None:
    """Contract: a script that its own processes would execute again ends with an error that says so, and starts no others."""
    script = tmp_path / "unguarded.py"
    script.write_text(UNGUARDED)
    done = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1].endswith("a script that starts some needs 'if __name__ == \"__main__\":'")
