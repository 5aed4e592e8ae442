"""Engines that compute tasks: a number of threads, or any executor of `concurrent.futures`."""

from __future__ import annotations

import gc
import os
import pickle
import signal
import sys
import threading
import time
import warnings
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
from scissordyn.processor import limit_library_threads, processors
from scissordyn.run.advance.interrupt import check_interrupt, interrupted_by
from scissordyn.run.advance.loop import CALL_SECONDS

Task = TypeVar("Task")
Value = TypeVar("Value")

TASKS_PER_WORKER = 2  # number of tasks submitted per worker: one in work, and one waiting, so that a worker is never idle
STOP_SECONDS = 0.5  # [s] longest wait, after Ctrl-C, until a worker thread or process ends by itself
RECOUNT_SECONDS = 1.0  # [s] interval between two counts of the workers of an executor
STATUSES = ("pending", "complete", "failed")  # names of the statuses of a case; a study's file contains their indices

NO_TASK_LEFT: Any = object()  # returned by `next` when all tasks have been submitted

# message if a worker process cannot start: each process imports the script again
START_FAILURE = "a worker process could not start; a script that uses processes needs 'if __name__ == \"__main__\":'"

Engine = Executor | int | None  # an int is a number of threads; None means one thread per processor

# accepted values of the option `engine`, for error messages
ENGINES = "a number of threads, sd.Processes(8), or an executor of concurrent.futures"


class EngineError(ScissordynError):
    """Failure of an engine: its workers died, cannot be started or cannot be reached."""


@dataclass(frozen=True)
class Outcome(Generic[Task, Value]):
    """Result of a task: a value or an error."""

    task: Task
    value: Value | None
    error: Exception | None = None

    @property
    def cause(self) -> str:
        return "" if self.error is None else error_text(self.error)


def error_text(error: Exception) -> str:
    """Return the text of an error in one line; the type is included for errors of other packages."""
    if type(error).__name__ == "KilledWorker":
        return "the processes that computed it died"
    text = " ".join(str(error).split())
    return text if isinstance(error, ScissordynError) and text else f"{type(error).__name__}: {text}".rstrip(": ")


def workers_of(engine: Engine) -> int:
    """Return the number of tasks that an engine computes at the same time."""
    if engine is None:
        return processors()
    if isinstance(engine, int):
        return whole_number("threads", engine)
    if not isinstance(engine, Executor):
        raise InputError(f"engine = {engine!r:.60}", ENGINES, "engine=4")
    client = getattr(engine, "_client", None)  # workers of dask come and go
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
    in_process: bool = False,
) -> Iterator[Outcome[Task, Value]]:
    """Yield the outcomes of tasks in the order in which they finish; with one thread, tasks run in the caller's thread.

    With several threads, duplicates of this process take their place where the system makes them (`Duplicates`), unless the
    tasks must run `in_process` because they change objects of this process. Progress is called after each task, once its
    outcome has been used, with the number of finished tasks and the total. Ctrl-C interrupts running tasks. `EngineError` is
    raised if a user's executor loses a worker.
    """
    workers = workers_of(engine)
    results: Generator[Outcome[Task, Value], None, None]
    if isinstance(engine, Executor):
        results = _compute_on(engine, function, tasks)
    elif workers == 1:
        results = (_compute_task(function, task) for task in tasks)
    elif not in_process and (duplicates := Duplicates.begun(workers, function)):
        results = _compute_on(duplicates, function, tasks)
    else:
        results = _compute_in_threads(workers, function, tasks)
    try:
        for done, outcome in enumerate(results, 1):
            yield outcome
            if progress is not None:
                progress(done, total)
    finally:
        results.close()  # running tasks stop at once, even if an error keeps this frame alive


def _compute_in_threads(
    workers: int, function: Callable[[Task], Value], tasks: Iterable[Task]
) -> Generator[Outcome[Task, Value], None, None]:
    pool = ThreadPoolExecutor(workers, thread_name_prefix="task")
    try:
        yield from _compute_on(pool, function, tasks)
    finally:  # threads without a waiting caller end with their task
        ending = threading.Thread(target=pool.shutdown, daemon=True)
        ending.start()
        ending.join(STOP_SECONDS)


def _compute_on(
    executor: Executor, function: Callable[[Task], Value], tasks: Iterable[Task]
) -> Generator[Outcome[Task, Value], None, None]:
    """Yield the outcomes of tasks that the workers of an executor compute.

    If a process of `Processes` dies, every submitted task is repeated, one at a time. The task whose process dies again has
    failed. An executor may have a method `watch`. It is called often with the number of finished tasks, and raises
    `EngineError` if no worker is left for the others.
    """
    watch, finished = getattr(executor, "watch", None), 0
    stop, here = threading.Event(), isinstance(executor, ThreadPoolExecutor)
    handed, waiting = dict[Future[Any], Task](), iter(tasks)
    suspects, alone = list[Task](), False
    room, counted = 0, 0.0
    try:
        while True:
            if time.monotonic() > counted:
                room, counted = TASKS_PER_WORKER * workers_of(executor), time.monotonic() + RECOUNT_SECONDS
            while len(handed) < (1 if suspects or alone else room):
                if suspects:
                    alone = True
                    task = suspects.pop()
                elif (task := next(waiting, NO_TASK_LEFT)) is NO_TASK_LEFT:
                    break
                handed[_submit(executor, here, stop, function, task)] = task
            if not handed:
                break
            while not (done := wait(handed, CALL_SECONDS, FIRST_COMPLETED).done):
                check_interrupt()
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
                    raise EngineError(f"a worker died ({outcome.error}); completed tasks are kept") from outcome.error
                elif alone:
                    yield Outcome(outcome.task, None, ScissordynError("the processes that computed it died"))
                else:
                    suspects.append(outcome.task)
            alone = alone and bool(handed)
        if isinstance(executor, Processes):
            executor.shutdown_unless_kept()
    except BaseException:
        stop.set()
        for future in handed:
            future.cancel()
        if isinstance(executor, Processes):
            executor.kill()
        wait(handed, STOP_SECONDS)  # stopped runs end with their slice; other parts of a task may take seconds
        raise


def _submit(
    executor: Executor, here: bool, stop: threading.Event, function: Callable[[Task], Value], task: Task
) -> Future[Any]:
    if here:
        return executor.submit(_compute_stoppable, stop, function, task)
    try:
        if isinstance(executor, Duplicates):
            return executor.submit(_compute_duplicated, dumps(task))
        return executor.submit(_compute_pickled, dumps((function, task)))
    except (BrokenExecutor, RuntimeError, OSError) as error:
        raise EngineError(f"no task can be submitted ({error}); completed tasks are kept") from error


def _outcome(future: Future[Any], task: Task, here: bool) -> Outcome[Task, Any]:
    try:
        if here:
            return Outcome(task, *future.result())
        return Outcome(task, *pickle.loads(future.result()))
    except (CancelledError, OSError) as error:  # a lost connection; errors of a task are in its outcome
        raise EngineError("the connection to the workers was lost; completed tasks are kept") from error
    except Exception as error:  # an error of the executor itself, for example a dead dask worker
        return Outcome(task, None, error)


def _compute_task(function: Callable[[Task], Value], task: Task) -> Outcome[Task, Value]:
    try:
        return Outcome(task, function(task))
    except Exception as error:
        return Outcome(task, None, error)


def _compute_stoppable(
    stop: threading.Event, function: Callable[[Task], Value], task: Task
) -> tuple[Value | None, Exception | None]:
    with interrupted_by(stop):
        outcome = _compute_task(function, task)
    return outcome.value, outcome.error


def _compute_pickled(content: bytes) -> bytes:
    """Run a pickled task in another process."""
    return _pickled(_compute_task(*pickle.loads(content)))


def _compute_duplicated(content: bytes) -> bytes:
    """Run a pickled task in a duplicate of the process that has its function."""
    return _pickled(_compute_task(Duplicates.function, pickle.loads(content)))


def _pickled(outcome: Outcome[Any, Any]) -> bytes:
    """Pickle the value and the error of a task; an error that cannot be pickled is replaced by its text."""
    try:
        answer = bytes(dumps((outcome.value, outcome.error)))
        pickle.loads(answer)
    except Exception:
        error = outcome.error
        answer = bytes(
            dumps((None, RuntimeError(f"{type(error).__name__}: {error}" if error else "its result cannot be sent")))
        )
    return answer


@contextmanager
def block_signals() -> Iterator[None]:
    """Block Ctrl-C in this thread; processes and threads started meanwhile never receive it.

    A process that is still starting would otherwise end with a traceback.
    """
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    resource_tracker.ensure_running()  # the standard library unblocks the signal when it starts this tracker
    with _block_signals_here():
        yield


@contextmanager
def _block_signals_here() -> Iterator[None]:
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


class Processes(Executor):
    """Engine of several processes on this machine, connected by pipes, which no other user can reach.

    The processes start and end with each computation. A block ``with sd.Processes(8) as engine:`` keeps them for several
    computations. They also end if this process is killed. A process that dies is replaced.

    Parameters
    ----------
    workers : int
        Number of processes, at least 1.

    Raises
    ------
    InputError
        If `workers` is not a whole number >= 1.

    Examples
    --------
    >>> import scissordyn as sd
    >>> engine = sd.Processes(2)
    """

    def __init__(self, workers: int) -> None:
        self._max_workers = whole_number("workers", workers)
        self._pool: ProcessPoolExecutor | None = None
        self._kept = False

    def __enter__(self) -> Self:
        self._kept = True
        return self

    def shutdown_unless_kept(self) -> None:
        """End the processes, unless a `with` block keeps them for another computation."""
        if not self._kept:
            self.shutdown()

    def submit(self, function: Callable[..., Any], /, *arguments: Any, **named: Any) -> Future[Any]:
        """Submit a task; raise `EngineError` if no process can be started."""
        try:
            with self._shield():
                for _ in range(2):
                    pool = self._pool = self._pool or self._begun()
                    try:
                        return pool.submit(function, *arguments, **named)
                    except BrokenExecutor:  # a process died
                        self._pool = None
        except OSError as error:
            raise EngineError(f"no process can be started: {error.strerror or error}; completed tasks are kept") from error
        raise EngineError("the processes die as soon as they are started; completed tasks are kept")

    @contextmanager
    def _shield(self) -> Iterator[None]:
        """Shield new processes from Ctrl-C and give them one thread for linear algebra, unless the user has set another."""
        added = limit_library_threads()
        try:
            with block_signals():
                yield
        finally:
            for name in added:
                os.environ.pop(name, None)

    def _begun(self) -> ProcessPoolExecutor:
        """Start a pool of processes and wait until one process has started."""
        pool = ProcessPoolExecutor(self._max_workers, get_context("spawn"), initializer=_watch_parent)
        try:
            pool.submit(int).result()
        except BrokenExecutor:  # Python has printed the reason on stderr
            raise EngineError(START_FAILURE) from None
        return pool

    def kill(self) -> None:
        """Kill the processes at once; new ones start with the next task."""
        pool, self._pool = self._pool, None
        if pool is not None:
            for process in list((getattr(pool, "_processes", None) or {}).values()):
                process.kill()
            pool.shutdown(wait=True, cancel_futures=True)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End the processes after all submitted tasks are done."""
        pool, self._pool = self._pool, None
        if pool is not None:
            pool.shutdown(wait, cancel_futures=cancel_futures)


class Duplicates(Processes):
    """Engine of duplicates of this process, made by `fork`, for tasks of one function.

    Their Python code runs at the same time, and they have all imported modules and prepared objects from the start. A duplicate
    has only the thread that makes it, so that this process must have a single one. Results are sent back; what a task changes
    otherwise is lost.
    """

    function: Callable[[Any], Any]  # function of a duplicate

    def __init__(self, workers: int, function: Callable[[Any], Any]) -> None:
        super().__init__(workers)
        self._function = function

    @staticmethod
    def possible() -> bool:
        """Return True in a process with one thread, on Linux; a worker of `multiprocessing` may not have its own processes."""
        return sys.platform == "linux" and threading.active_count() == 1 and parent_process() is None

    @classmethod
    def begun(cls, workers: int, function: Callable[[Any], Any]) -> Self | None:
        """Return the duplicates, or None where the system does not make them."""
        if not cls.possible():
            return None
        duplicates = cls(workers, function)
        try:
            with duplicates._shield():
                duplicates._pool = duplicates._begun()
        except OSError:  # no memory or no process is left
            return None
        return duplicates

    _shield = staticmethod(_block_signals_here)

    def _begun(self) -> ProcessPoolExecutor:
        pool = ProcessPoolExecutor(
            self._max_workers, get_context("fork"), initializer=_begin_duplicate, initargs=(self._function,)
        )
        with warnings.catch_warnings():  # Python 3.12 warns of threads of libraries too; they wait for work
            warnings.simplefilter("ignore", DeprecationWarning)
            pool.submit(int)  # makes all processes
        return pool


def _begin_duplicate(function: Callable[[Any], Any]) -> None:
    """Give a new duplicate its function; the collector of garbage does not visit, and so copy, the objects of its parent."""
    gc.freeze()
    Duplicates.function = staticmethod(function)
    _watch_parent()


def _watch_parent() -> None:
    """Make a new process end with its parent, even in the middle of a task."""
    parent = parent_process()
    assert parent is not None

    def watch() -> None:
        connection.wait([parent.sentinel])
        os._exit(0)

    threading.Thread(target=watch, daemon=True).start()
