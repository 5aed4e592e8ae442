"""Compute the pending cases of a study, block by block: the cases of a block are one batch, whose rows go to the store."""

from __future__ import annotations

import inspect
import os
import platform
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any, TypedDict, Unpack

import numpy as np
import xarray as xr

from scissordyn.analysis.motor import MotorCurve
from scissordyn.errors import InputError, ScissordynError, whole_number
from scissordyn.lifetime.response import WearLife
from scissordyn.model.parameter_path import number
from scissordyn.run.advance.interrupt import raise_if_interrupted
from scissordyn.run.batch import Perturbed, simulate_cases
from scissordyn.run.engine import Engine, outcomes, workers_of
from scissordyn.run.measure import MEASURES, Ended, Measure
from scissordyn.run.simulate import simulate
from scissordyn.studies.ask.description import OwnMeasure, Study
from scissordyn.studies.compute.slopes import with_slopes
from scissordyn.studies.compute.store import COMPLETE, FAILED, PENDING, BlockResult, Store
from scissordyn.studies.compute.table import CHUNK_CASES_MAX, SLOPES, column

# [s] target computing time of a block of cases: far above the cost of a task, and little work lost in a crash
BLOCK_SECONDS = 3.0

TASK_SECONDS = 1e-2
"""Processor time of the scheduler and the coordinator for each task [s]: measured, docs/decisions/measured/studies.md.

It has a margin for slow or busy machines.
"""

BUSY_FRACTION_MAX = 0.5  # [-] largest fraction of the time that a scheduler may be busy; for many workers, blocks become longer
WORKER_BLOCKS_MIN = 4  # Smallest number of blocks of cases per worker, so that no worker waits long for the last block
TIMED_CASES = 8  # Number of cases that are timed to choose the number of cases in a block


@dataclass(frozen=True)
class Progress:
    """Progress of a study."""

    complete: int
    failed: int
    cases: int
    seconds: float  # Time since the start of this computation [s]
    done_here: int  # Cases of this computation
    generation: int = 0  # Generation of an optimisation, from 1

    @property
    def rate(self) -> float:
        """Cases per second."""
        return self.done_here / self.seconds if self.seconds > 0.0 else 0.0

    @property
    def left(self) -> float:
        """Time that the pending cases take at this rate [s]."""
        return (self.cases - self.complete - self.failed) / self.rate if self.rate > 0.0 else float("inf")


class How(TypedDict, total=False):
    """Options for the computation of cases."""

    engine: Engine
    block: int | None  # Cases of a block of a new store
    retry: bool  # Repeat failed cases
    progress: Callable[[Progress], None] | None
    generation: int  # Generation of an optimisation, from 1


def _begin(study: Study, store: Store, block: int | None, workers: int, points: np.ndarray | None) -> None:
    """Create the store of a study, with a suitable number of cases per block."""
    store.check_writable()
    if block is not None:
        whole_number("block", block)
    if any(measure.of == "dataset" for measure in study.own_measures) and study.members > 1:
        raise InputError(
            "a measure of the dataset with several members", "a measure of 'accumulators', or members = 1", "members = 1"
        )
    first = simulated(study, np.array([0]), points)
    chosen = block or min(_block_size(study, workers, points), -(-study.cases // (WORKER_BLOCKS_MIN * workers)))
    store.create(study, first, min(chosen, study.cases))


def block_seconds(workers: int) -> float:
    """Return the computing time of a block [s] that suits a number of workers."""
    return max(BLOCK_SECONDS, TASK_SECONDS * workers / BUSY_FRACTION_MAX)


def _block_size(study: Study, workers: int, points: np.ndarray | None) -> int:
    """Return the number of cases that take a few seconds, measured after compilation."""

    def seconds_of(cases: np.ndarray) -> float:
        began = time.perf_counter()
        simulated(study, cases, points)
        return (time.perf_counter() - began) / cases.size

    seconds = seconds_of(np.array([0]))
    if TIMED_CASES * seconds < BLOCK_SECONDS:
        seconds = seconds_of(np.unique(np.linspace(0, study.cases - 1, TIMED_CASES).astype(int)))
    size = int(np.clip(block_seconds(workers) / max(seconds, 1e-6), 1, CHUNK_CASES_MAX))
    whole = study.per_point * max(1, size // study.per_point)
    return whole if whole <= 2 * size else size


def execute(study: Study, path: str | os.PathLike[str], points: np.ndarray | None = None, **how: Unpack[How]) -> Store:
    """Compute the cases of a study that its store does not have yet; `points` (points, factors) are those of a search."""
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
        _compute_missing(study, store, points, how)
    return store


def _compute_missing(study: Study, store: Store, points: np.ndarray | None, how: How) -> None:
    status, progress, fingerprint = store.status()[: study.cases], how.get("progress"), study.fingerprint()
    missing = (status == PENDING) | (how.get("retry", False) & (status == FAILED))
    cases = np.flatnonzero(missing)
    _, first = np.unique(cases // store.block, return_index=True)
    parts = np.split(cases, first[1:]) if cases.size else ()
    blocks = (Block(study, part, points, fingerprint) for part in parts)
    began, now, done_here = time.perf_counter(), np.where(missing, PENDING, status), 0
    in_process = any(measure.changes_objects for measure in study.own_measures)
    for outcome in outcomes(how.get("engine"), run_block, blocks, in_process=in_process):
        if isinstance(outcome.error, ProgramError):
            raise outcome.error
        result = outcome.value if outcome.error is None else _failed(outcome.task, outcome.cause)
        assert result is not None
        store.write(result)
        now[result.cases] = result.status
        done_here += result.cases.size
        if progress is not None:
            complete, failures = int(np.sum(now == COMPLETE)), int(np.sum(now == FAILED))
            seconds, generation = time.perf_counter() - began, how.get("generation", 0)
            progress(Progress(complete, failures, now.size, seconds, done_here, generation))


def extend(study: Study, path: str | os.PathLike[str], points: int, **how: Unpack[How]) -> Store:
    """Add points to a random, Sobol or Saltelli design, and compute them."""
    if not study.design.extendable:
        raise InputError(f"more points of a {study.design.kind} design", "a random, sobol or saltelli design")
    if points < study.design.points:
        raise InputError(
            f"{points} points of a study that has {study.design.points}",
            f"more than {study.design.points} points",
            f"--points {2 * study.design.points}",
        )
    if study.uncertain and not study.sampling.common and study.sampling.kind == "latin-hypercube":
        raise InputError("more points of a study with a Latin hypercube for each", "common random numbers")
    larger = replace(study, design=replace(study.design, points=points))
    store = Store(path)
    store.check(study)
    store.extend(larger)
    return execute(larger, path, **how)


class ProgramError(ScissordynError):
    """Error of a worker whose program differs from the program that sends the blocks."""


@dataclass(frozen=True)
class Block:
    """Inputs of a worker that computes the cases of a block.

    The fingerprint is that of the study in the process that sends the blocks: a worker that finds another one computes
    nothing. `points` has the points of an adaptive design.
    """

    study: Study
    cases: np.ndarray
    points: np.ndarray | None = None
    fingerprint: Mapping[str, str] | None = None


def run_block(block: Block) -> BlockResult:
    """Compute the cases of a block.

    Raises `ProgramError` if this worker's program differs from the program that sent the block, and `KeyboardInterrupt` if
    the user stopped it.
    """
    began = time.perf_counter()
    _check_program(block)
    runs = simulated(block.study, block.cases, block.points)
    status = np.where(runs["status"].values == "complete", COMPLETE, FAILED).astype(np.int8)
    values = _numbers(block) | {name: runs[name].values for name in block.study.measure_names}
    values |= {SLOPES: runs[SLOPES].values} if SLOPES in runs else {}
    texts = [(str(cause), str(warned)) for cause, warned in zip(runs["cause"].values, runs["warnings"].values, strict=True)]
    times = time.perf_counter() - began, float(runs.attrs["integration_seconds"]), float(block.cases.size)
    return BlockResult(block.cases, values, status, texts, times)


def _numbers(block: Block) -> dict[str, np.ndarray]:
    """Return the values of the varied parameters in the cases of a block, by name of their stored variable."""
    return {column(parameter): values for parameter, values in block.study.numbers(block.cases, block.points).items()}


def _check_program(block: Block) -> None:
    """Raise `ProgramError` unless this worker has the fingerprint of the process that sent the block."""
    expected = block.fingerprint or {}
    differs = [name for name, digest in block.study.fingerprint().items() if expected.get(name, digest) != digest]
    if differs:
        raise ProgramError(
            f"the worker at '{platform.node()}' with '{Path(__file__).parents[2]}' would compute other numbers (differs in "
            f"{', '.join(differs)}); expected the same sources, libraries and user files for all workers"
        )


def _failed(block: Block, cause: str) -> BlockResult:
    """Return the rows of a block that could not be computed."""
    count = block.cases.size
    return BlockResult(block.cases, _numbers(block), np.full(count, FAILED, np.int8), [(cause, "")] * count)


def simulated(study: Study, cases: np.ndarray, points: np.ndarray | None = None) -> xr.Dataset:
    """Compute cases as one batch on one thread, or one batch for each mechanism; engines compute several blocks in parallel."""
    numbers = study.numbers(cases, points)
    measures = {name: MEASURES[name] for name in study.measures} | _own_measures(study)
    batches, order = [], []
    for mechanism, places in study.by_variant(numbers):
        perturbed = Perturbed(cases[places] % study.members, study.perturbation)
        applied = {parameter: values[places] for parameter, values in study.applied(numbers).items()}
        batches.append(raise_if_interrupted(simulate_cases(mechanism, applied, study.options, measures, perturbed, threads=1)))
        order.append(places)
    runs = xr.concat(batches, "case", coords="minimal", compat="override", combine_attrs="override")
    runs = runs.isel(case=np.argsort(np.concatenate(order)))
    runs = runs.assign({name: ("case", numbers[name], about) for name, about in _described(study).items()})
    runs.attrs["integration_seconds"] = sum(batch.attrs["integration_seconds"] for batch in batches)
    return with_slopes(study, runs) if study.gradients else runs


def _described(study: Study) -> dict[str, dict[str, Any]]:
    """Return units and labels of the factors that a batch does not describe: `variant_factors`, deviations, chosen values."""
    attributes: dict[str, dict[str, Any]] = {
        varied.name: {"units": varied.si or "1", **varied.shown} for varied in study.variant_factors
    }
    for factor in study.uncertain:
        if factor.of:
            quantity = number(study.mechanism, factor.of).quantity
            unit = "1" if quantity is None else quantity.unit
            attributes[factor.of] = {"units": unit}
            attributes[factor.name] = {"units": "1" if factor.relative else unit, "long_name": f"deviation of {factor.path}"}
    return attributes


def _own_measures(study: Study) -> dict[str, Measure]:
    """Return the user-defined measures of a study; those of the Dataset share one more run of a case."""
    functions = [measure.callable() for measure in study.own_measures]
    of_run = [fun for fun, measure in zip(functions, study.own_measures, strict=True) if measure.of == "dataset"]
    # the largest torque is located between samples: a motor's curve needs no further ones, which take a second run
    only_motors = all(isinstance(function, MotorCurve | WearLife) for function in of_run)
    options = {**(study.options.equally_spaced if only_motors else study.options).keywords, "trust": False}

    @lru_cache(1)
    def run_of(ended: Ended) -> xr.Dataset:
        return raise_if_interrupted(simulate(ended.mechanism, **options))

    def defined(measure: OwnMeasure, function: Callable[..., Any]) -> Measure:
        life = isinstance(function, WearLife)

        def value(ended: Ended) -> float:
            about = run_of(ended) if measure.of == "dataset" and not life else ended
            try:
                if not life:
                    return float(function(about))
                cycles, texts = function(ended.mechanism, study.options)
            except Exception as error:
                kind = "" if life else f"{type(error).__name__}: "
                raise ScissordynError(f"measure '{measure.name}': {kind}{error}") from error
            ended.warnings.extend(texts)
            return float(cycles)

        attributes = function.attributes if isinstance(function, WearLife) else {}
        return Measure(measure.units, _meaning(measure.name, function), (), value, attributes=attributes)

    return {measure.name: defined(measure, fun) for measure, fun in zip(study.own_measures, functions, strict=True)}


def _meaning(name: str, function: Callable[..., float]) -> str:
    """Return the first line of the docstring of a user-defined measure."""
    return (inspect.getdoc(function) or f"measure '{name}' of the user").partition("\n")[0].rstrip(".")
