"""Engines: where tasks are done. An engine maps a function over tasks and knows nothing else; this one has threads."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from contextlib import AbstractContextManager, ExitStack, nullcontext
from dataclasses import dataclass
from types import TracebackType
from typing import Generic, Protocol, Self, TypeVar, cast, runtime_checkable

from scissordyn.errors import InputError, ScissordynError, whole_number
from scissordyn.run.interrupt import look, stopped_by

Task = TypeVar("Task")
Value = TypeVar("Value")

AHEAD = 2
"""Tasks handed out per worker: one in work and one that waits, so that no worker waits for this process."""

QUICKLY = 0.5
"""How long a worker, thread or process, may take to end by itself after Ctrl-C [s]."""

LOOK = 0.2
"""How often a thread that waits for others looks whether it is to stop itself [s]."""

STATES = ("pending", "complete", "failed")
"""Of a case; a store has their numbers."""


class EngineError(ScissordynError):
    """Workers that could be reached before and cannot now."""


def processors() -> int:
    """Processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else (os.cpu_count() or 1)


@dataclass(frozen=True)
class Outcome(Generic[Task, Value]):
    """What became of a task.

    Parameters
    ----------
    task
    value
        None if it failed.
    error : Exception or None
    """

    task: Task
    value: Value | None
    error: Exception | None = None


def error_text(error: Exception) -> str:
    """An error of a task in one line: the text of an error of this package, the kind and the text of any other."""
    if type(error).__name__ == "KilledWorker":
        return "the processes that computed it died"
    text = " ".join(str(error).split())
    return text if isinstance(error, ScissordynError) and text else f"{type(error).__name__}: {text}".rstrip(": ")


@runtime_checkable
class Engine(Protocol):
    """Whatever maps a function over tasks."""

    @property
    def workers(self) -> int:
        """Tasks in work at the same time."""

    def each(self, function: Callable[[Task], Value], tasks: Iterable[Task]) -> Iterator[Outcome[Task, Value]]:
        """Results in the order in which they come."""


ENGINES = "threads, processes, a cluster, or a number of threads"
"""What may be given as an engine."""


def opened(engine: Engine | int | None) -> AbstractContextManager[Engine]:
    """The engine that is meant, begun and ended with the context if it has to be and is not yet."""
    if engine is None or isinstance(engine, int):
        return nullcontext(Threads(engine))
    if isinstance(engine, Begun):
        return cast(AbstractContextManager[Engine], engine)
    if not isinstance(engine, Engine):
        raise InputError(f"engine = {engine!r:.60}", ENGINES, "engine=4")
    return nullcontext(engine)


def outcomes(
    engine: Engine | int | None,
    function: Callable[[Task], Value],
    tasks: Iterable[Task],
    *,
    total: int = 0,
    progress: Callable[[int, int], None] | None = None,
) -> Iterator[Outcome[Task, Value]]:
    """Outcomes of tasks in the order in which they come, wherever they are done."""
    with opened(engine) as chosen:
        for done, outcome in enumerate(chosen.each(function, tasks), 1):
            yield outcome
            if progress is not None:
                progress(done, total)


class Begun:
    """What is begun and ended: by a ``with`` of the user's around several computations, or by each that is given it."""

    _depth = 0

    def _running(self) -> AbstractContextManager[object]:
        """The workers, as long as the context lasts."""
        raise NotImplementedError

    def __enter__(self) -> Self:
        if not self._depth:
            self._stack = ExitStack()
            self._stack.enter_context(self._running())
        self._depth += 1
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> bool | None:
        self._depth -= 1
        return None if self._depth else self._stack.__exit__(kind, error, trace)


class Threads:
    """Threads of this process: kernels release the interpreter's lock.

    Parameters
    ----------
    workers : int, optional
        One per processor if not given; with 1, tasks are done on the thread that asks for them.
    """

    def __init__(self, workers: int | None = None) -> None:
        self.workers = processors() if workers is None else whole_number("threads", workers)

    def each(self, function: Callable[[Task], Value], tasks: Iterable[Task]) -> Iterator[Outcome[Task, Value]]:
        """Results in the order in which they come; Ctrl-C interrupts the runs in work.

        Parameters
        ----------
        function : callable
            Of a task.
        tasks : iterable

        Yields
        ------
        Outcome
        """
        if self.workers == 1:
            for task in tasks:
                yield _done(function, task)
            return
        stop = threading.Event()

        def stoppable(task: Task) -> Outcome[Task, Value]:
            with stopped_by(stop):
                return _done(function, task)

        yield from in_threads(stoppable, tasks, self.workers, stop.set)


def in_threads(
    outcome: Callable[[Task], Outcome[Task, Value]], tasks: Iterable[Task], threads: int, stop: Callable[[], None]
) -> Iterator[Outcome[Task, Value]]:
    """Outcomes of tasks in the order in which they come."""
    pool = ThreadPoolExecutor(threads, thread_name_prefix="task")
    handed: set[Future[Outcome[Task, Value]]] = set()
    waiting, stopped = iter(tasks), False
    try:
        while True:
            for task in waiting:
                handed.add(pool.submit(outcome, task))
                if len(handed) >= AHEAD * threads:
                    break
            if not handed:
                break
            while not (done := wait(handed, LOOK, FIRST_COMPLETED).done):
                look()
            for future in done:
                handed.remove(future)
                yield future.result()
    except BaseException:
        stopped = True
        stop()
        for future in handed:
            future.cancel()
        raise
    finally:
        # after a stop runs end with their slice; what a task computes besides may take seconds
        going = wait(handed, QUICKLY if stopped else None).not_done
        pool.shutdown(wait=not going)


def _done(function: Callable[[Task], Value], task: Task) -> Outcome[Task, Value]:
    try:
        return Outcome(task, function(task))
    except Exception as error:
        return Outcome(task, None, error)
