"""Engines: where tasks are done. An engine is a number of threads, or any executor of `concurrent.futures`."""

from __future__ import annotations

import os
import pickle
import signal
import threading
import time
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    CancelledError,
    Executor,
    Future,
    ProcessPoolExecutor,
    ThreadPoolExecutor,
    wait,
)
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import connection, get_context, parent_process, resource_tracker
from typing import Any, Generic, Self, TypeVar

from cloudpickle import dumps

from scissordyn.errors import InputError, ScissordynError, whole_number
from scissordyn.run.advance.interrupt import look, stopped_by

Task = TypeVar("Task")
Value = TypeVar("Value")

AHEAD = 2  # Tasks handed out per worker: one in work and one that waits, so that no worker waits for this process
QUICKLY = 0.5  # How long a worker, thread or process, may take to end by itself after Ctrl-C [s]
LOOK = 0.2  # How often a thread that waits for others looks whether it is to stop itself [s]
RECOUNT = 1.0  # How often the workers of an executor are counted [s]
STATES = ("pending", "complete", "failed")  # Of a case; a store has their numbers

LIBRARIES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
"""Libraries of linear algebra start a thread for each processor, in each process, unless these say otherwise."""

END: Any = object()  # Of tasks

UNGUARDED = "a worker process could not begin; a script that starts some needs 'if __name__ == \"__main__\":'"

Engine = Executor | int | None  # A number is one of threads, None one thread for each processor
ENGINES = "a number of threads, sd.Processes(8), or an executor of concurrent.futures"  # What may be given as an engine


class EngineError(ScissordynError):
    """Workers that could be reached before and cannot now."""


def processors() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else (os.cpu_count() or 1)


@dataclass(frozen=True)
class Outcome(Generic[Task, Value]):
    """What became of a task: a value, or an error."""

    task: Task
    value: Value | None
    error: Exception | None = None


def error_text(error: Exception) -> str:
    """An error of a task in one line: the text of an error of this package, the kind and the text of any other."""
    if type(error).__name__ == "KilledWorker":
        return "the processes that computed it died"
    text = " ".join(str(error).split())
    return text if isinstance(error, ScissordynError) and text else f"{type(error).__name__}: {text}".rstrip(": ")


def workers_of(engine: Engine) -> int:
    """Tasks that an engine does at the same time."""
    if engine is None:
        return processors()
    if isinstance(engine, int):
        return whole_number("threads", engine)
    if not isinstance(engine, Executor):
        raise InputError(f"engine = {engine!r:.60}", ENGINES, "engine=4")
    client = getattr(engine, "_client", None)  # of dask's executor, whose workers come and go
    if client is not None:
        return max(1, int(sum(client.nthreads().values())))
    return int(getattr(engine, "_max_workers", 0)) or processors()


def outcomes(
    engine: Engine,
    function: Callable[[Task], Value],
    tasks: Iterable[Task],
    *,
    total: int = 0,
    progress: Callable[[int, int], None] | None = None,
) -> Iterator[Outcome[Task, Value]]:
    """Outcomes of tasks in the order in which they come; with one thread they are done on that of the caller.

    Progress is called after each task, when its outcome has been used, with the number done and the total. Ctrl-C interrupts
    the runs in work; a lost worker of an executor of the user's raises `EngineError`.
    """
    workers = workers_of(engine)
    results: Generator[Outcome[Task, Value], None, None]
    if isinstance(engine, Executor):
        results = _spread(engine, function, tasks)
    elif workers == 1:
        results = (_done(function, task) for task in tasks)
    else:
        results = _in_threads(workers, function, tasks)
    try:
        for done, outcome in enumerate(results, 1):
            yield outcome
            if progress is not None:
                progress(done, total)
    finally:
        results.close()  # what is in work stops at once, also where an error keeps this frame


def _in_threads(
    workers: int, function: Callable[[Task], Value], tasks: Iterable[Task]
) -> Generator[Outcome[Task, Value], None, None]:
    pool = ThreadPoolExecutor(workers, thread_name_prefix="task")
    try:
        yield from _spread(pool, function, tasks)
    finally:  # threads that nobody waits for any more end with their task
        ending = threading.Thread(target=pool.shutdown, daemon=True)
        ending.start()
        ending.join(QUICKLY)


def _spread(
    executor: Executor, function: Callable[[Task], Value], tasks: Iterable[Task]
) -> Generator[Outcome[Task, Value], None, None]:
    """Tasks on the workers of an executor.

    When a process of `Processes` dies, every task that was handed out is done again, one at a time: the one whose process dies
    again has failed. An executor may have a method `watch`, which is called often with the number of tasks that are done, and
    raises `EngineError` if nobody is left to do the others.
    """
    watch, finished = getattr(executor, "watch", None), 0
    stop, here = threading.Event(), isinstance(executor, ThreadPoolExecutor)
    handed, waiting = dict[Future[Any], Task](), iter(tasks)
    suspects, alone = list[Task](), False
    room, counted = 0, 0.0
    try:
        while True:
            if time.monotonic() > counted:
                room, counted = AHEAD * workers_of(executor), time.monotonic() + RECOUNT
            while len(handed) < (1 if suspects or alone else room):
                if suspects:
                    alone = True
                    task = suspects.pop()
                elif (task := next(waiting, END)) is END:
                    break
                handed[_submit(executor, here, stop, function, task)] = task
            if not handed:
                break
            while not (done := wait(handed, LOOK, FIRST_COMPLETED).done):
                look()
                if watch is not None:
                    watch(finished)
            finished += len(done)
            if watch is not None:
                watch(finished)
            for future in done:
                outcome = _outcome(future, handed.pop(future), here)
                if not isinstance(outcome.error, BrokenExecutor):
                    yield outcome
                elif not isinstance(executor, Processes):
                    raise EngineError(f"a worker died ({outcome.error}); what is complete is kept") from outcome.error
                elif alone:
                    yield Outcome(outcome.task, None, ScissordynError("the processes that computed it died"))
                else:
                    suspects.append(outcome.task)
            alone = alone and bool(handed)
        if isinstance(executor, Processes):
            executor.rest()
    except BaseException:
        stop.set()
        for future in handed:
            future.cancel()
        if isinstance(executor, Processes):
            executor.kill()
        wait(handed, QUICKLY)  # after a stop runs end with their slice; what a task computes besides may take seconds
        raise


def _submit(
    executor: Executor, here: bool, stop: threading.Event, function: Callable[[Task], Value], task: Task
) -> Future[Any]:
    if here:
        return executor.submit(_stoppable, stop, function, task)
    try:
        return executor.submit(_elsewhere, dumps((function, task)))
    except (BrokenExecutor, RuntimeError, OSError) as error:
        raise EngineError(f"no task can be handed out ({error}); what is complete is kept") from error


def _outcome(future: Future[Any], task: Task, here: bool) -> Outcome[Task, Any]:
    try:
        if here:
            return Outcome(task, *future.result())
        return Outcome(task, *pickle.loads(future.result()))
    except (CancelledError, OSError) as error:  # of the connection: errors of a task are in its outcome
        raise EngineError("the connection to the workers was lost; what is complete is kept") from error
    except Exception as error:  # of the executor itself, such as a worker of dask that died
        return Outcome(task, None, error)


def _done(function: Callable[[Task], Value], task: Task) -> Outcome[Task, Value]:
    try:
        return Outcome(task, function(task))
    except Exception as error:
        return Outcome(task, None, error)


def _stoppable(stop: threading.Event, function: Callable[[Task], Value], task: Task) -> tuple[Value | None, Exception | None]:
    with stopped_by(stop):
        outcome = _done(function, task)
    return outcome.value, outcome.error


def _elsewhere(content: bytes) -> bytes:
    """Do a task in another process; not every error can be sent."""
    outcome = _done(*pickle.loads(content))
    try:
        answer = bytes(dumps((outcome.value, outcome.error)))
        pickle.loads(answer)
    except Exception:
        error = outcome.error
        answer = bytes(
            dumps((None, RuntimeError(f"{type(error).__name__}: {error}" if error else "its result cannot be sent")))
        )
    return answer


class Processes(Executor):
    """Processes of this machine, joined to this one by pipes: nothing listens, so that no other user can reach them.

    They begin and end with each computation; ``with sd.Processes(8) as engine:`` around several of them keeps them. They
    also end with this process if that is killed. A process that dies is replaced.

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
        self._max_workers = whole_number("workers", workers)
        self._pool: ProcessPoolExecutor | None = None
        self._kept = False

    def __enter__(self) -> Self:
        self._kept = True
        return self

    def rest(self) -> None:
        """End the processes, unless the caller keeps them for another computation."""
        if not self._kept:
            self.shutdown()

    def submit(self, function: Callable[..., Any], /, *arguments: Any, **named: Any) -> Future[Any]:
        """Hand out a task; `EngineError` if no process can be started."""
        try:
            with _starting():
                for _ in range(2):
                    pool = self._pool = self._pool or self._begun()
                    try:
                        return pool.submit(function, *arguments, **named)
                    except BrokenExecutor:  # a process died
                        self._pool = None
        except OSError as error:
            raise EngineError(f"no process can be started: {error.strerror or error}; what is complete is kept") from error
        raise EngineError("the processes die as soon as they are started; what is complete is kept")

    def _begun(self) -> ProcessPoolExecutor:
        """Processes, of which one has begun."""
        pool = ProcessPoolExecutor(self._max_workers, get_context("spawn"), initializer=_begin)
        try:
            pool.submit(int).result()
        except BrokenExecutor:  # Python said why on stderr
            raise EngineError(UNGUARDED) from None
        return pool

    def kill(self) -> None:
        """End the processes in the middle of whatever they do; new ones are started for the next task."""
        pool, self._pool = self._pool, None
        if pool is not None:
            for process in list((getattr(pool, "_processes", None) or {}).values()):
                process.kill()
            pool.shutdown(wait=True, cancel_futures=True)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End the processes, once what is handed out is done."""
        pool, self._pool = self._pool, None
        if pool is not None:
            pool.shutdown(wait, cancel_futures=cancel_futures)


def _begin() -> None:
    """In a process that begins: end with the one that started it, also in the middle of a task."""
    parent = parent_process()
    assert parent is not None

    def watch() -> None:
        connection.wait([parent.sentinel])
        os._exit(0)

    threading.Thread(target=watch, daemon=True).start()


@contextmanager
def _starting() -> Iterator[None]:
    """Processes that are started meanwhile never get Ctrl-C, and use one thread for linear algebra if nothing else is set."""
    added = {name: "1" for name in LIBRARIES if name not in os.environ}
    os.environ.update(added)
    try:
        with signals_blocked():
            yield
    finally:
        for name in added:
            os.environ.pop(name, None)


@contextmanager
def signals_blocked() -> Iterator[None]:
    """Hold back Ctrl-C in this thread; processes and threads started meanwhile never get it.

    A process that is still starting would otherwise die of a Ctrl-C with a traceback.
    """
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    resource_tracker.ensure_running()  # the library unblocks the signal where it starts this
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
