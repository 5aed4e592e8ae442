"""One block of a study: its cases simulated as one batch and written to the store."""

from __future__ import annotations

import inspect
import platform
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from scissordyn.analysis.motor import MotorCurve
from scissordyn.errors import InputError, ScissordynError
from scissordyn.model.parameter_path import number
from scissordyn.run.advance.interrupt import look, pass_on
from scissordyn.run.answer.measure import MEASURES, Ended, Measure
from scissordyn.run.batch import Perturbed, simulate_cases
from scissordyn.run.simulate import simulate
from scissordyn.study.ask.description import Cases, OwnMeasure, Study
from scissordyn.study.ask.variant import by_variant, mechanism_of
from scissordyn.study.compute.store import COMPLETE, FAILED
from scissordyn.study.compute.table import column


class ProgramError(ScissordynError):
    """A worker whose program gives other numbers than the one that hands out the blocks."""


@dataclass(frozen=True)
class Block:
    """What a worker needs to compute cases of a block.

    The fingerprint is that of the study in the process that hands out the blocks: a worker that finds another one computes
    nothing. Points are those of an adaptive design.
    """

    study: Study
    number: int
    cases: np.ndarray
    points: np.ndarray | None = None
    fingerprint: Mapping[str, str] | None = None


@dataclass(frozen=True)
class BlockResult:
    """The rows of a block: values by array, status, cause and warnings of each case; seconds, and those of integration."""

    cases: np.ndarray
    values: dict[str, np.ndarray]
    status: np.ndarray
    texts: list[tuple[str, str]]
    seconds: float = 0.0
    integration_seconds: float = 0.0


def run_block(block: Block) -> BlockResult:
    """Compute the cases of a block.

    Raises `ProgramError` if the program here is another one than where the block was handed out, and `KeyboardInterrupt` if
    the user stopped it.
    """
    began = time.perf_counter()
    _check_program(block)
    numbers = block.study.numbers(block.cases, block.points)
    runs = _simulated(block.study, numbers)
    status = np.where(runs["status"].values == "complete", COMPLETE, FAILED).astype(np.int8)
    values = {column(parameter): column_values for parameter, column_values in numbers.values.items()}
    values |= {name: runs[name].values for name in block.study.measure_names}
    texts = [(str(cause), str(warned)) for cause, warned in zip(runs["cause"].values, runs["warnings"].values, strict=True)]
    integration = float(runs.attrs["integration_seconds"])
    return BlockResult(block.cases, values, status, texts, time.perf_counter() - began, integration)


def _check_program(block: Block) -> None:
    """Raise `ProgramError` unless the fingerprint of the study here is that of whoever handed out the block."""
    expected = block.fingerprint or {}
    differs = [name for name, digest in block.study.fingerprint().items() if expected.get(name, digest) != digest]
    if differs:
        raise ProgramError(
            f"the worker at '{platform.node()}' with '{Path(__file__).parents[2]}' would compute other numbers (differs in "
            f"{', '.join(differs)}); allowed: the same sources, libraries and files of yours for all workers"
        )


def failed(block: Block, cause: str) -> BlockResult:
    """The rows of a block that could not be computed."""
    numbers, count = block.study.numbers(block.cases, block.points), block.cases.size
    values = {column(parameter): column_values for parameter, column_values in numbers.values.items()}
    return BlockResult(block.cases, values, np.full(count, FAILED, np.int8), [(cause, "")] * count)


def pilot(study: Study, cases: np.ndarray, points: np.ndarray | None = None) -> xr.Dataset:
    """Some cases of a study, here and not stored: for dimensions, units and the time that a case takes."""
    return _simulated(study, study.numbers(cases, points))


def _simulated(study: Study, numbers: Cases) -> xr.Dataset:
    """The cases as one batch on one thread, or a batch of each mechanism: engines run several blocks beside each other."""
    measures = {name: MEASURES[name] for name in study.measures}
    measures |= {measure.name: _accumulated(measure) for measure in study.own_measures if measure.of == "accumulators"}
    batches, order = [], []
    for mechanism, cases in by_variant(study, numbers.values):
        perturbed = Perturbed(numbers.members[cases], study.perturbation)
        applied = {parameter: values[cases] for parameter, values in study.applied(numbers.values).items()}
        batches.append(pass_on(simulate_cases(mechanism, applied, study.options, measures, perturbed, threads=1)))
        order.append(cases)
    seconds = sum(part.attrs["integration_seconds"] for part in batches)
    every = batches[0] if len(batches) == 1 else _in_order(batches, np.concatenate(order))
    every = every.assign({name: ("case", numbers.values[name], about) for name, about in _described(study).items()})
    of_dataset = [measure for measure in study.own_measures if measure.of == "dataset"]
    return (_of_datasets(study, numbers, every, of_dataset) if of_dataset else every).assign_attrs(integration_seconds=seconds)


def _in_order(batches: list[xr.Dataset], order: np.ndarray) -> xr.Dataset:
    """Batches as one, whose cases stand at these places."""
    together = xr.concat(batches, "case", coords="minimal", compat="override", combine_attrs="override")
    return together.isel(case=np.argsort(order))


def _described(study: Study) -> dict[str, dict[str, Any]]:
    """Attributes of what makes other mechanisms, of deviations, and of chosen values from which single places deviate."""
    attributes: dict[str, dict[str, Any]] = {varied.name: {"units": varied.si or "1", **varied.shown} for varied in study.apart}
    for factor in study.uncertain:
        if factor.of:
            quantity = number(study.mechanism, factor.of).quantity
            unit = "1" if quantity is None else quantity.unit
            attributes[factor.of] = {"units": unit}
            attributes[factor.name] = {"units": "1" if factor.relative else unit, "long_name": f"deviation of {factor.path}"}
    return attributes


def _accumulated(measure: OwnMeasure) -> Measure:
    function = measure.callable()

    def value(ended: Ended) -> float:
        try:
            return float(function(ended))
        except Exception as error:
            raise ScissordynError(f"measure '{measure.name}': {type(error).__name__}: {error}") from error

    return Measure(measure.units, _meaning(measure.name, function), (), value)


def _of_datasets(study: Study, numbers: Cases, runs: xr.Dataset, measures: Sequence[OwnMeasure]) -> xr.Dataset:
    """Measures of the user's that want the Dataset of each case, which is simulated once for all of them."""
    functions = {measure.name: measure.callable() for measure in measures}
    values = {name: np.full(runs.sizes["case"], np.nan) for name in functions}
    status, cause = runs["status"].values.astype(object), runs["cause"].values.astype(object)
    # the largest torque is located between samples: a motor's curve needs no further ones, which take a second run
    only_motors = all(isinstance(function, MotorCurve) for function in functions.values())
    options = {**(study.options.equally_spaced if only_motors else study.options).keywords, "trust": False}
    for case in np.flatnonzero(status == "complete"):
        look()
        name = ""
        try:
            mechanism = mechanism_of(study, {parameter: float(column[case]) for parameter, column in numbers.values.items()})
            run = pass_on(simulate(mechanism, **options))
            for name, function in functions.items():
                values[name][case] = float(function(run))
        except Exception as error:
            of_run = isinstance(error, InputError) and not name
            reason = str(error) if of_run else f"{type(error).__name__}: {error}"
            status[case], cause[case] = "failed", f"measure '{name}': {reason}" if name else reason
    measured = {
        measure.name: (
            "case",
            values[measure.name],
            {"units": measure.units, "long_name": _meaning(measure.name, functions[measure.name])},
        )
        for measure in measures
    }
    return runs.assign({**measured, "status": ("case", status.astype(str)), "cause": ("case", cause.astype(str))})


def _meaning(name: str, function: Callable[..., float]) -> str:
    """What a measure of the user's is: the first line of what its function says of itself."""
    return (inspect.getdoc(function) or f"measure '{name}' of the user").partition("\n")[0]
