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

from scissordyn.errors import InputError, ScissordynError
from scissordyn.model.address import number
from scissordyn.run.batch import Perturbed, simulate_cases
from scissordyn.run.interrupt import look, pass_on
from scissordyn.run.measure import MEASURES, Ended, Measure
from scissordyn.run.simulate import simulate
from scissordyn.study.description import Cases, OwnMeasure, Study
from scissordyn.study.store import COMPLETE, FAILED, PENDING, Store, column, program_digest
from scissordyn.study.variant import by_variant, made


class ProgramError(ScissordynError):
    """A worker whose program gives other numbers than the one that hands out the blocks."""


@dataclass(frozen=True)
class Block:
    """What a worker needs to do a block."""

    study: Study
    store: str  # Its address
    number: int
    again: bool = False  # Whether cases that failed are done again
    points: np.ndarray | None = None  # Of an adaptive design
    # Of the study in the process that hands out the blocks; a worker that finds another one computes nothing
    fingerprint: Mapping[str, str] | None = None


@dataclass(frozen=True)
class BlockResult:
    """What became of a block."""

    number: int
    status: np.ndarray  # Of all its cases
    seconds: float = 0.0  # From its begin to the last byte [s]; 0 if it was complete already
    integration_seconds: float = 0.0


def run_block(block: Block) -> BlockResult:
    """Do what is missing of a block."""
    began = time.perf_counter()
    store = Store(block.store)
    here = _same_program(block, store)
    cases, status = store.cases_of(block.number)
    missing = (status == PENDING) | (block.again & (status == FAILED))
    missing &= cases < block.study.cases
    if not missing.any():  # a worker was lost after it had written everything
        return BlockResult(block.number, status)
    todo = cases[missing]
    numbers = block.study.numbers(todo, block.points)
    found = _simulated(block.study, numbers)
    states = np.where(found["status"].values == "complete", COMPLETE, FAILED).astype(np.int8)
    columns: dict[str, Any] = {column(address): values for address, values in numbers.values.items()}
    columns |= {name: found[name].values for name in block.study.measure_names}
    columns |= {name: found[name].values.astype(object) for name in ("cause", "warnings")}
    integration = float(found.attrs["integration_seconds"])
    store.write(todo, columns, states, (time.perf_counter() - began, integration, float(todo.size)), program_digest(here))
    status[missing] = states
    return BlockResult(block.number, status, time.perf_counter() - began, integration)


def _same_program(block: Block, store: Store) -> Mapping[str, str]:
    """The fingerprint of the study here, which is that of the store and of whoever handed out the block."""
    here = block.study.fingerprint()
    differs = [name for name, digest in here.items() if block.fingerprint and block.fingerprint.get(name) != digest]
    differs = differs or store.differs(here)
    if differs:
        raise ProgramError(
            f"the worker at '{platform.node()}' with '{Path(__file__).parents[1]}' would compute other numbers (differs in "
            f"{', '.join(differs)}); allowed: the same sources, libraries and files of yours for all workers"
        )
    return here


def give_up(block: Block, cause: str) -> BlockResult:
    """Mark the missing cases of a block as failed."""
    store = Store(block.store)
    cases, status = store.cases_of(block.number)
    missing = (status == PENDING) & (cases < block.study.cases)
    if missing.any():
        numbers = block.study.numbers(cases[missing], block.points)
        columns: dict[str, Any] = {column(address): values for address, values in numbers.values.items()}
        columns["cause"] = np.full(int(missing.sum()), cause, dtype=object)
        store.write(cases[missing], columns, np.full(int(missing.sum()), FAILED, np.int8), (0.0, 0.0, 0.0))
        status[missing] = FAILED
    return BlockResult(block.number, status)


def pilot(study: Study, cases: np.ndarray, points: np.ndarray | None = None) -> xr.Dataset:
    """Some cases of a study, here and not stored: for dimensions, units and the time that a case takes."""
    return _simulated(study, study.numbers(cases, points))


def _simulated(study: Study, numbers: Cases) -> xr.Dataset:
    """The cases as one batch on one thread, or a batch of each mechanism: engines run several blocks beside each other."""
    measures = {name: MEASURES[name] for name in study.measures}
    measures |= {own.name: _accumulated(own) for own in study.own_measures if own.of == "accumulators"}
    found, order = [], []
    for mechanism, cases in by_variant(study, numbers.values):
        perturbed = Perturbed(numbers.members[cases], study.perturbation)
        applied = {address: values[cases] for address, values in study.applied(numbers.values).items()}
        found.append(pass_on(simulate_cases(mechanism, applied, study.options, measures, perturbed, threads=1)))
        order.append(cases)
    seconds = sum(each.attrs["integration_seconds"] for each in found)
    every = found[0] if len(found) == 1 else _in_order(found, np.concatenate(order))
    every = every.assign({name: ("case", numbers.values[name], about) for name, about in _described(study).items()})
    own = [each for each in study.own_measures if each.of == "dataset"]
    return (_of_datasets(study, numbers, every, own) if own else every).assign_attrs(integration_seconds=seconds)


def _in_order(found: list[xr.Dataset], order: np.ndarray) -> xr.Dataset:
    """Batches as one, whose cases stand at these places."""
    together = xr.concat(found, "case", coords="minimal", compat="override", combine_attrs="override")
    return together.isel(case=np.argsort(order))


def _described(study: Study) -> dict[str, dict[str, Any]]:
    """Attributes of what makes other mechanisms, of deviations, and of chosen values from which single places deviate."""
    found: dict[str, dict[str, Any]] = {each.name: {"units": each.si or "1", **each.shown} for each in study.apart}
    for factor in study.uncertain:
        if factor.of:
            quantity = number(study.mechanism, factor.of).quantity
            unit = "1" if quantity is None else quantity.unit
            found[factor.of] = {"units": unit}
            found[factor.name] = {"units": "1" if factor.relative else unit, "long_name": f"deviation of {factor.address}"}
    return found


def _accumulated(own: OwnMeasure) -> Measure:
    function = own.callable()

    def value(ended: Ended) -> float:
        try:
            return float(function(ended))
        except Exception as error:
            raise ScissordynError(f"measure '{own.name}': {type(error).__name__}: {error}") from error

    return Measure(own.units, _meaning(own.name, function), (), value)


def _of_datasets(study: Study, numbers: Cases, found: xr.Dataset, own: Sequence[OwnMeasure]) -> xr.Dataset:
    """Measures of the user's that want the Dataset of each case, which is simulated once for all of them."""
    functions = {each.name: each.callable() for each in own}
    values = {name: np.full(found.sizes["case"], np.nan) for name in functions}
    status, cause = found["status"].values.astype(object), found["cause"].values.astype(object)
    options = {**study.options.keywords, "trust": False}
    for case in np.flatnonzero(status == "complete"):
        look()
        name = ""
        try:
            mechanism = made(study, {address: float(column[case]) for address, column in numbers.values.items()})
            run = pass_on(simulate(mechanism, **options))
            for name, function in functions.items():
                values[name][case] = float(function(run))
        except Exception as error:
            of_run = isinstance(error, InputError) and not name
            said = str(error) if of_run else f"{type(error).__name__}: {error}"
            status[case], cause[case] = "failed", f"measure '{name}': {said}" if name else said
    measured = {
        each.name: ("case", values[each.name], {"units": each.units, "long_name": _meaning(each.name, functions[each.name])})
        for each in own
    }
    return found.assign({**measured, "status": ("case", status.astype(str)), "cause": ("case", cause.astype(str))})


def _meaning(name: str, function: Callable[..., float]) -> str:
    """What a measure of the user's is: the first line of what its function says of itself."""
    return (inspect.getdoc(function) or f"measure '{name}' of the user").partition("\n")[0]
