"""Do what is missing of a study."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import TypedDict, Unpack

import numpy as np

from scissordyn.errors import InputError, whole_number
from scissordyn.run.engine import Engine, error_text, outcomes, workers_of
from scissordyn.study.ask.description import Study
from scissordyn.study.compute.block import Block, BlockResult, ProgramError, failed, pilot, run_block
from scissordyn.study.compute.store import COMPLETE, FAILED, PENDING, Store

BLOCK_SECONDS = 3.0  # Work of a block [s]: much more than a task costs, and little to lose

TASK_SECONDS = 1e-2
"""Processor time of a task in the scheduler and the coordinator [s]: docs/decisions/measured/studies.md, with a margin for slow
or busy machines."""

BUSY = 0.5  # Fraction of the time that they may be busy, which makes blocks for very many workers longer
SHARES = 4  # At least as many blocks for each worker, so that none waits long for the last
LARGEST_BLOCK = 100_000  # Cases; what a worker holds in memory
TIMED = 8  # Cases whose time is taken to choose a block
QUICK = 0.1  # A case longer than that [s] is timed alone


@dataclass(frozen=True)
class Progress:
    """How far a study is."""

    complete: int
    failed: int
    cases: int
    seconds: float  # Since it was begun or taken up [s]
    done_here: int  # Cases since then
    generation: int = 0  # Of an optimisation, from 1

    @property
    def rate(self) -> float:
        """Cases per second."""
        return self.done_here / self.seconds if self.seconds > 0.0 else 0.0

    @property
    def left(self) -> float:
        """Seconds to go, at this rate."""
        return (self.cases - self.complete - self.failed) / self.rate if self.rate > 0.0 else float("inf")


class How(TypedDict, total=False):
    """How cases are computed."""

    engine: Engine
    block: int | None  # Cases of a block of a new store
    retry: bool  # Do cases that failed again
    progress: Callable[[Progress], None] | None


def _begin(study: Study, store: Store, block: int | None, workers: int, points: np.ndarray | None) -> None:
    """Make the store of a study."""
    store.check_place()
    if block is not None:
        whole_number("block", block)
    if any(measure.of == "dataset" for measure in study.own_measures) and study.members > 1:
        raise InputError(
            "a measure of the dataset with several members", "a measure of 'accumulators', or members = 1", "members = 1"
        )
    first = pilot(study, np.array([0]), points)
    chosen = block or min(_block_size(study, workers, points), -(-study.cases // (SHARES * workers)))
    store.create(study, first, min(chosen, study.cases))


def block_seconds(workers: int) -> float:
    """Work of a block [s], by the number of workers that ask for one."""
    return max(BLOCK_SECONDS, TASK_SECONDS * workers / BUSY)


def _block_size(study: Study, workers: int, points: np.ndarray | None) -> int:
    """Cases that take some seconds."""
    began = time.perf_counter()
    pilot(study, np.array([0]), points)  # everything is compiled by now
    seconds = time.perf_counter() - began
    if seconds < QUICK:
        cases = np.unique(np.linspace(0, study.cases - 1, TIMED).astype(int))
        began = time.perf_counter()
        pilot(study, cases, points)
        seconds = (time.perf_counter() - began) / cases.size
    size = int(np.clip(block_seconds(workers) / max(seconds, 1e-6), 1, LARGEST_BLOCK))
    whole = study.per_point * max(1, size // study.per_point)
    return whole if whole <= 2 * size else size


def execute(
    study: Study,
    path: str | os.PathLike[str],
    points: np.ndarray | None = None,
    **how: Unpack[How],
) -> Store:
    """Do the missing cases of a study; what is in the store already is kept.

    Shapes: `points` (points, factors).
    """
    store = Store(path)
    if store.exists():
        store.check(study)  # before workers are started for nothing
    else:
        _begin(study, store, how.get("block"), workers_of(how.get("engine")), points)
    with store.alone():
        if study.cases > store.cases or (study.cases < store.cases and points is None):
            raise InputError(
                f"'{store.path}' has {store.cases} cases and the study {study.cases}",
                "the same number of points",
                "scissordyn study extend, with --points",
            )
        _missing_blocks(study, store, points, how)
    return store


def _missing_blocks(study: Study, store: Store, points: np.ndarray | None, how: How) -> None:
    status, progress = store.status()[: study.cases], how.get("progress")
    fingerprint, size = study.fingerprint(), store.block
    missing = (status == PENDING) | (how.get("retry", False) & (status == FAILED))
    began, now, done_here = time.perf_counter(), np.where(missing, PENDING, status), 0
    for result in _computed(how.get("engine"), _blocks(study, missing, size, points, fingerprint)):
        times = result.seconds, result.integration_seconds, float(result.cases.size if result.seconds else 0)
        store.write(result.cases, result.values, result.status, result.texts, times)
        now[result.cases] = result.status
        done_here += result.cases.size
        if progress is not None:
            complete, failures = int(np.sum(now == COMPLETE)), int(np.sum(now == FAILED))
            progress(Progress(complete, failures, now.size, time.perf_counter() - began, done_here))


def _blocks(
    study: Study, missing: np.ndarray, size: int, points: np.ndarray | None, fingerprint: dict[str, str]
) -> Iterator[Block]:
    cases = np.flatnonzero(missing)
    numbers, first = np.unique(cases // size, return_index=True)
    for number, part in zip(numbers, np.split(cases, first[1:]), strict=False):  # of no cases there is one empty part
        yield Block(study, int(number), part, points, fingerprint)


def _computed(engine: Engine, blocks: Iterator[Block]) -> Iterator[BlockResult]:
    for outcome in outcomes(engine, run_block, blocks):
        if outcome.value is not None:
            yield outcome.value
        elif isinstance(outcome.error, ProgramError):
            raise outcome.error
        else:
            assert outcome.error is not None
            yield failed(outcome.task, error_text(outcome.error))


def extend(study: Study, path: str | os.PathLike[str], points: int, **how: Unpack[How]) -> Store:
    """Add points to a random, Sobol or Saltelli design, and do them."""
    if not study.design.extendable:
        raise InputError(f"more points of a {study.design.kind} design", "a random, sobol or saltelli design")
    if points < study.design.points:
        raise InputError(
            f"{points} points of a study that has {study.design.points}", "more", f"--points {2 * study.design.points}"
        )
    if study.uncertain and not study.sampling.common and study.sampling.kind == "latin-hypercube":
        raise InputError("more points of a study with a Latin hypercube for each", "common random numbers")
    larger = replace(study, design=replace(study.design, points=points))
    store = Store(path)
    store.check(study)
    with store.alone():
        store.extend(larger)
    return execute(larger, path, **how)
