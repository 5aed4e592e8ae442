"""Engines: what becomes of tasks, and of those in work when nobody wants their results."""

from __future__ import annotations

import threading
import time

import pytest

import scissordyn as sd
from scissordyn.run.interrupt import look, stopped_by
from scissordyn.study.engine import Engine, Outcome, Threads, error_text

LONG = 2000.0
"""Simulated time that takes minutes [s]."""


def divided(task: object) -> float:
    """Some of the ways in which a task may end."""
    if task == "refuse":
        raise sd.InputError("what came", "what is allowed")
    return 1.0 / task  # type: ignore[operator]


@pytest.mark.parametrize("threads", [1, 2])
def test_every_task_has_its_outcome(threads: int) -> None:
    """Contract: a value, or the error that was raised; with one thread in the order of the tasks."""
    tasks = [4.0, 0.0, "refuse", "text", 8.0]
    found = list(Threads(threads).each(divided, tasks))
    assert sorted(tasks.index(one.task) for one in found) == [0, 1, 2, 3, 4]
    by_task = {one.task: one for one in found}
    assert (by_task[4.0], by_task[8.0]) == (Outcome(4.0, 0.25), Outcome(8.0, 0.125))
    said = [error_text(by_task[task].error) for task in tasks[1:4]]
    assert said[:2] == ["ZeroDivisionError: float division by zero", "what came; allowed: what is allowed"]
    assert said[2].startswith("TypeError: ")
    assert threads > 1 or [one.task for one in found] == tasks
    assert list(Threads(threads).each(divided, [])) == []


def simulated(task: int) -> int:
    """The number at once for the first task, after minutes for others."""
    if task:
        sd.simulate(sd.four_bar().driven(speed=1.0), until=LONG, samples=2, most_steps=10**9)
    return task


def test_leaving_interrupts_what_is_in_work() -> None:
    """Contract: threads that simulate end after the slice that they are in, and no task is begun any more."""
    sd.simulate(sd.four_bar().driven(speed=1.0), until=0.1)  # with all kernels loaded
    begun = threading.active_count()
    results = Threads(2).each(simulated, [0, 1, 2, 3])
    assert next(results).value == 0
    began = time.monotonic()
    results.close()
    assert time.monotonic() - began < 4.0  # two seconds, on a machine that has other things to do
    assert threading.active_count() == begun


def test_a_thread_looks_at_its_own_event() -> None:
    """Contract: only where it was asked to, and only once the event is set."""
    stop = threading.Event()
    with stopped_by(stop):
        look()
        stop.set()
        with pytest.raises(KeyboardInterrupt):
            look()
    look()


@pytest.mark.parametrize("threads", [0, -1, True, 1.5])
def test_bad_numbers_of_threads(threads: int) -> None:
    """Contract: one line."""
    with pytest.raises(sd.InputError, match=f"threads = {threads}"):
        Threads(threads)
    assert isinstance(Threads(), Engine)
