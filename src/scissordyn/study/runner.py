"""Map a function over cases, here or on several processes; no case is ever lost."""

from __future__ import annotations

import multiprocessing
import os
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from typing import Generic, TypeVar

from scissordyn.cache.folder import shared_folder
from scissordyn.errors import InputError
from scissordyn.study.worker import begin, kill, signals_blocked

__all__ = ["CaseResult", "each_case", "run_cases", "worker_count"]

Case = TypeVar("Case")
Value = TypeVar("Value")

AHEAD = 2
"""Cases queued per worker, so that no worker waits."""

DIED = "the process that computed it died (a script calls this with several workers under: if __name__ == '__main__')"
"""A script without it starts itself anew in every process, which then breaks off."""


@dataclass(frozen=True)
class CaseResult(Generic[Value]):
    """The result of one case.

    Parameters
    ----------
    index : int
        Its place among the cases.
    value
        What the function returned; None if it failed.
    error : str
        Empty, or the kind of the exception and its text.
    seconds : float
        How long the function took [s].
    """

    index: int
    value: Value | None
    error: str
    seconds: float


def worker_count(workers: int | None) -> int:
    """Number of processes: as asked for, or one per processor that this process may use.

    Parameters
    ----------
    workers : int or None

    Returns
    -------
    int
    """
    if workers is None:
        return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else (os.cpu_count() or 1)
    if isinstance(workers, bool) or not isinstance(workers, int) or workers < 1:
        raise InputError(f"workers = {workers!r}", "a whole number >= 1")
    return workers


def run_cases(
    function: Callable[[Case], Value],
    cases: Sequence[Case],
    *,
    workers: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> list[CaseResult[Value]]:
    """Call a function with every case.

    Parameters
    ----------
    function : callable
        Of one case. With several workers it and the cases are sent to other processes: it must be defined at the top of a
        module, or be a `functools.partial` of such a one.
    cases : sequence
    workers : int, optional
        Processes; 1 computes here, one by one. As many as there are processors if not given.
    progress : callable, optional
        Called after each case with how many are done and how many there are.

    Returns
    -------
    list of CaseResult
        In the order of the cases, whatever the number of workers. An exception in a case, and the death of its process,
        is an error in its result.
    """
    results = []
    for result in each_case(function, cases, workers=workers):
        results.append(result)
        if progress is not None:
            progress(len(results), len(cases))
    return sorted(results, key=lambda result: result.index)


def each_case(
    function: Callable[[Case], Value], cases: Sequence[Case], *, workers: int | None = None
) -> Iterator[CaseResult[Value]]:
    """As `run_cases`, one result after the other as they come.

    Parameters
    ----------
    function : callable
    cases : sequence
    workers : int, optional

    Yields
    ------
    CaseResult
    """
    count = min(worker_count(workers), len(cases))
    if count <= 1:
        for index, case in enumerate(cases):
            yield _guarded(function, index, case)
        return
    waiting = list(range(len(cases)))
    while waiting:
        suspects: list[int] = []
        yield from _pooled(function, cases, waiting, count, suspects)
        # when a process dies all that were handed out are reported broken; each then gets a process of its own
        for index in suspects:
            broken: list[int] = []
            yield from _pooled(function, cases, [index], 1, broken)
            if broken:
                yield CaseResult(index, None, DIED, 0.0)


def _pooled(
    function: Callable[[Case], Value], cases: Sequence[Case], waiting: list[int], count: int, suspects: list[int]
) -> Iterator[CaseResult[Value]]:
    """Work off `waiting` on a pool; if a process dies, what was handed out goes to `suspects` and the rest stays."""
    # a forked process would inherit threads and locks in any state
    context = multiprocessing.get_context("spawn")
    theirs, ours = context.Pipe(duplex=False)
    pool = ProcessPoolExecutor(count, mp_context=context, initializer=begin, initargs=(theirs, shared_folder()))
    handed: dict[Future[CaseResult[Value]], int] = {}
    try:
        while waiting or handed:
            while waiting and len(handed) < AHEAD * count:
                index = waiting.pop(0)
                try:
                    with signals_blocked():  # the first call starts the processes, which inherit this
                        handed[pool.submit(_guarded, function, index, cases[index])] = index
                except BrokenProcessPool:
                    suspects.append(index)
                    suspects.extend(handed.values())
                    return
            done, _ = wait(handed, return_when=FIRST_COMPLETED)
            for future in done:
                index = handed.pop(future)
                try:
                    yield future.result()
                except BrokenProcessPool:
                    suspects.append(index)
                except Exception as error:  # what could not be sent there, or back
                    yield CaseResult(index, None, _text(error), 0.0)
            if suspects:
                suspects.extend(handed.values())
                return
    except BaseException:
        # Ctrl-C, or a reader who has had enough: do not wait for minutes of work that nobody wants
        kill(pool)
        raise
    finally:
        pool.shutdown(wait=True, cancel_futures=True)
        theirs.close()
        ours.close()


def _guarded(function: Callable[[Case], Value], index: int, case: Case) -> CaseResult[Value]:
    began = time.perf_counter()
    try:
        value = function(case)
    except Exception as error:
        return CaseResult(index, None, _text(error), time.perf_counter() - began)
    return CaseResult(index, value, "", time.perf_counter() - began)


def _text(error: BaseException) -> str:
    text = " ".join(str(error).split())
    return text if isinstance(error, InputError) and text else f"{type(error).__name__}: {text}".rstrip(": ")
