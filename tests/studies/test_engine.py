"""Engines: outcomes of tasks, and tasks in work whose results are no longer needed."""

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

import numpy as np
import pytest

import scissordyn as sd
from scissordyn.run.advance.interrupt import check_interrupt, interrupted_by
from scissordyn.run.engine import Duplicates, EngineError, Outcome, error_text, outcomes, workers_of

LONG = 2000.0  # [s] end of a run that takes minutes


LINUX = pytest.mark.skipif(sys.platform != "linux", reason="processes are duplicated on Linux only")


def divided(task):
    """Return a value or raise an error, depending on the task."""
    if task == "refuse":
        raise sd.InputError("what came", "what is allowed")
    return 1.0 / task


@pytest.mark.parametrize("threads", [1, 2])
def test_every_task_has_its_outcome(threads):
    """Contract: each task has a value or its error; one thread keeps the order of the tasks."""
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


def simulated(task):
    """Return the first task at once, and others after minutes."""
    if task:
        sd.simulate(sd.four_bar().driven(speed=1.0), until=LONG, samples=2, most_steps=10**9)
    return task


@pytest.mark.parametrize("in_process", [True, False])
def test_closed_results_interrupt_running_tasks(in_process, request):
    """Contract: simulating threads end after their current slice, processes at once, and no other task begins."""
    if not in_process:
        request.getfixturevalue("duplicated")
    sd.simulate(sd.four_bar().driven(speed=1.0), until=0.1)  # with all kernels loaded
    begun = threading.active_count()
    results = outcomes(2, simulated, [0, 1, 2, 3], in_process=in_process)
    assert next(results).value == 0
    results.close()
    assert threading.active_count() == begun
    assert not multiprocessing.active_children()


def test_interrupt_of_one_thread():
    """Contract: a thread is interrupted only where it watches an event, and only once the event is set."""
    stop = threading.Event()
    with interrupted_by(stop):
        check_interrupt()
        stop.set()
        with pytest.raises(KeyboardInterrupt):
            check_interrupt()
    check_interrupt()


@pytest.mark.parametrize("threads", [0, -1, True, 1.5])
def test_bad_numbers_of_threads(threads):
    """Contract: a wrong number of threads is refused in one line."""
    with pytest.raises(sd.InputError, match=f"(threads|engine) = {threads}"):
        workers_of(threads)
    assert workers_of(None) >= 1


def test_any_executor_is_an_engine():
    """Contract: executors of the standard library are engines; other objects are refused."""
    with ThreadPoolExecutor(2) as pool:
        assert sorted(outcome.value for outcome in outcomes(pool, abs, [-1, -2, -3])) == [1, 2, 3]
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
        assert sorted(outcome.value for outcome in outcomes(pool, lambda task: task + 1, [1, 2])) == [2, 3]  # of no module
        with pytest.raises(EngineError, match=r"a worker died .*; completed tasks are kept"):
            list(outcomes(pool, fatal, [2]))
    with pytest.raises(sd.InputError, match="engine = 'two'"):
        list(outcomes("two", abs, []))


@pytest.mark.parametrize(("threads", "workers"), [({"one": 2, "two": 3}, 5), ({}, 1)])
def test_workers_of_a_cluster(threads, workers):
    """Contract: the number of tasks at once is that of all workers' threads, and at least one."""
    with ThreadPoolExecutor(1) as pool:
        pool._client = SimpleNamespace(nthreads=lambda: threads)
        assert workers_of(pool) == workers


def getpid(_):
    """Return the process of a task, after a delay."""
    time.sleep(0.2)
    return os.getpid()


def fatal(task):
    """Kill the process of the second task."""
    if task == 2:
        os.kill(os.getpid(), signal.SIGKILL)
    return task


def test_duplicates_take_the_place_of_threads(duplicated):
    """Contract: tasks run in as many other processes as threads, which have the function as it is and end after it."""
    numbers, lock = [3.0], threading.Lock()  # a lock cannot be sent

    def numbered(task):
        with lock:
            return numbers[0] + task, getpid(task)

    found = [outcome.value for outcome in outcomes(2, numbered, range(6))]
    assert sorted(number for number, _ in found) == [3.0, 4.0, 5.0, 6.0, 7.0, 8.0]
    processes = {process for _, process in found}
    assert len(processes - {os.getpid()}) == len(processes) == 2
    for process in processes:
        with pytest.raises(ProcessLookupError):
            os.kill(process, 0)


@LINUX
@pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning")  # of Python 3.12 about threads of the tests' runner
def test_batch_in_a_worker_of_multiprocessing():
    """Contract: a daemonic worker, which may not have processes of its own, computes a batch on threads."""
    crank = sd.slider_crank().driven(speed=10.0)
    with multiprocessing.get_context("fork").Pool(1) as pool:
        found = pool.apply(sd.simulate_many, (crank, {"drive.speed": np.linspace(5.0, 9.0, 64)}), {"until": 1e-3, "threads": 2})
    assert set(found["status"].values) == {"complete"}


@LINUX
@pytest.mark.parametrize("why", ["in process", "another thread", "no memory"])
def test_threads_where_processes_are_not_duplicated(why, monkeypatch):
    """Contract: tasks run in this process if they change it, if it has other threads, or if the system makes no duplicate."""
    done, changed = threading.Event(), []
    if why != "another thread":
        monkeypatch.setattr(Duplicates, "possible", staticmethod(lambda: True))
    if why == "no memory":
        monkeypatch.setattr(os, "fork", lambda: (_ for _ in ()).throw(OSError(12, "Cannot allocate memory")))
    other = threading.Thread(target=done.wait)
    if why == "another thread":
        other.start()
    list(outcomes(2, changed.append, [1, 2, 3], in_process=why == "in process"))
    done.set()
    assert sorted(changed) == [1, 2, 3]


def test_a_dying_duplicate_loses_its_task_only(duplicated):
    """Contract: the task whose process dies twice has failed; the others have their values."""
    died = {outcome.task: outcome for outcome in outcomes(2, fatal, [1, 2, 3, 4])}
    assert [died[task].value for task in (1, 3, 4)] == [1, 3, 4]
    assert error_text(died[2].error) == "the processes that computed it died"


class UnsentError(Exception):
    """Error that cannot be pickled from its arguments."""

    def __init__(self, first, second):
        super().__init__(f"{first} {second}")


def failing(task):
    """Raise a different error for each task."""
    if task == 1:
        raise sd.InputError("a bar of 0 m", "more", "1 m")
    raise UnsentError(task, 3)


def test_outcomes_of_processes():
    """Contract: values, errors, and a task whose process always dies, without loss of the others."""
    with sd.Processes(2) as engine:
        died = sorted(outcomes(engine, fatal, [1, 2, 3, 4]), key=lambda one: one.task)
        errors = sorted(outcomes(engine, failing, [1, 2]), key=lambda one: one.task)
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


@pytest.mark.parametrize("begun", ["Processes(1)", pytest.param("Duplicates.begun(1, work)", marks=LINUX)])
def test_processes_end_with_the_one_that_started_them(begun, tmp_path):
    """Contract: worker processes end when their parent is killed."""
    script = tmp_path / "killed.py"
    script.write_text(KILLED.replace("ENGINE", begun))
    with subprocess.Popen([sys.executable, str(script)], stdout=subprocess.PIPE, text=True) as started:
        assert started.stdout is not None
        worker = int(started.stdout.readline())
        started.kill()
    deadline = time.monotonic() + 20.0
    while is_running(worker):
        assert time.monotonic() < deadline
        time.sleep(0.05)


def is_running(process):
    """Return whether a process exists and is not a zombie."""
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    status = Path(f"/proc/{process}/status")
    return not (status.exists() and "State:\tZ" in status.read_text())


# Program whose worker process kills itself
KILLED = """
import os, sys, time
from scissordyn.run.engine import Duplicates, Processes, outcomes

def work(task):
    return os.getpid() if not task else time.sleep(600)

if __name__ == "__main__":
    with ENGINE as engine:
        for outcome in outcomes(engine, work, [0, 1]):
            print(outcome.value, flush=True)
"""

# Program without `if __name__ == "__main__"`
UNGUARDED = """
from scissordyn.run.engine import Processes, outcomes
with Processes(1) as engine:
    list(outcomes(engine, abs, [1]))
"""


def test_script_without_a_guard(tmp_path):
    """Contract: a script that its processes would execute again ends with an error that explains it."""
    script = tmp_path / "unguarded.py"
    script.write_text(UNGUARDED)
    done = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1].endswith("a script that uses processes needs 'if __name__ == \"__main__\":'")
