"""Batches: many runs of one mechanism with other parameter values, in parallel threads, reduced to measures."""

from __future__ import annotations

import time as clocks
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from scissordyn.casefile.configuration import write_configuration
from scissordyn.errors import InputError, did_you_mean
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.options import EventKind, Options, StartKind
from scissordyn.model.parameter_path import changed_all, find, number
from scissordyn.plan.plan import plan
from scissordyn.run.engine import workers_of
from scissordyn.run.measure import LOAD_UNIT, MEASURES, Measure, check_measures, load_units, parts_of
from scissordyn.run.rows import COLUMNS, GROUP_CASES_MAX, Case, Worker, empty_columns, rows, store_row
from scissordyn.tolerance import DATA_TOL

TITLE = "scissordyn batch"  # Attribute `title` of the Dataset of a batch of runs


def simulate_many(
    mechanism: Mechanism,
    over: Mapping[str, ArrayLike],
    *,
    until: float,
    measures: Sequence[str] | Mapping[str, Measure] | None = None,
    members: ArrayLike = 0,
    perturbation: float = 1e-14,
    seed: int = 0,
    start: StartKind = Options.start,
    rtol: float = Options.rtol,
    atol: float | None = None,
    method: str = Options.method,
    most_steps: int = Options.most_steps,
    events: EventKind = Options.events,
    step: float | None = Options.step,
    threads: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> xr.Dataset:
    """Simulate a mechanism for many values of its parameters.

    Each case is the run that `simulate` makes, bit for bit, for any number of threads.

    Parameters
    ----------
    mechanism : Mechanism
    over : mapping of str to array_like
        Values in SI units by parameter path ("A.clearance", "drive.speed"); arrays of one length, or single numbers. For a
        grid, use ``numpy.meshgrid`` and ``ravel``.
    until : float
        End of the simulated time [s].
    measures : sequence of str, or mapping of str to Measure, optional
        Names from `run.measure.MEASURES`, or user-defined measures by name. The default is "peak_force" for compliant contacts,
        "peak_force_estimate" for hard contacts, "peak_drive_torque", "contact_count" and "contact_fraction".
    members : array_like of int
        One member index for all cases, or one for each case. Member 0 starts as `simulate` does. Member k starts with every
        entry y of its state perturbed to y (1 + p g); the normal random numbers g depend only on k and `seed`.
    perturbation : float
        p, from 0 to 1e-6.
    seed : int
    start, rtol, atol, method, most_steps, events, step
        As for `simulate`.
    threads : int, optional
        Number of threads; by default one per processor. On Linux, duplicates of a process that has no other threads take their
        place for 64 cases or more, unless measures are user-defined.
    progress : callable, optional
        Called after each case with the number of finished cases and the number of all cases.

    Returns
    -------
    Dataset
        Variables along `case`: the parameter values, the measures, `status` ("complete", "failed", or "pending" after Ctrl-C),
        `cause` and `warnings`. Warnings report laws used outside their range, friction beyond its limit and controllers at
        their limit. A failed case has NaN and its cause; the other cases continue.

    Raises
    ------
    InputError
        If a parameter path, a measure or an option is wrong.
    """
    if not isinstance(over, Mapping) or not over:
        shown = "no numbers to vary" if isinstance(over, Mapping) else f"over = {over!r:.60}"
        raise InputError(shown, "a mapping of parameter paths to values", "{'A.clearance': [1e-4, 2e-4]}")
    options = Options(until, start, Options.samples, rtol, atol, method, most_steps, events, step=step)
    perturbed = Perturbed(members, perturbation, seed)
    measures = default_measures(mechanism) if measures is None else measures
    return simulate_cases(mechanism, over, options, measures, perturbed, threads=threads, progress=progress)


def default_measures(mechanism: Mechanism) -> tuple[str, ...]:
    """Return the default measures of a batch: largest contact forces, drive torques, contact count and contact fraction."""
    clearances = (*(joint.clearance for joint in mechanism.joints), *(guide.clearance for guide in mechanism.guides))
    kinds = {clearance.contact for clearance in clearances if clearance is not None} or {"compliant"}
    forces = {"compliant": "peak_force", "hard": "peak_force_estimate"}
    return (*(name for kind, name in forces.items() if kind in kinds), "peak_drive_torque", "contact_count", "contact_fraction")


def simulate_cases(
    mechanism: Mechanism,
    over: Mapping[str, ArrayLike],
    options: Options,
    measures: Sequence[str] | Mapping[str, Measure],
    perturbed: Perturbed,
    *,
    threads: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> xr.Dataset:
    """Simulate many cases with given `Options` and perturbed starts; `over` may be empty."""
    columns, chosen, began = _broadcast_values(mechanism, over), _find_measures(measures), clocks.perf_counter()
    check_measures(mechanism, chosen)
    cases = len(next(iter(columns.values()))) if columns else np.size(perturbed.members)
    members, places = perturbed.member_of_each(cases), {parameter: find(mechanism, parameter) for parameter in columns}

    def case(at: int) -> Case:
        changes = {parameter: float(column[at]) for parameter, column in columns.items()}
        return Case(changed_all(mechanism, changes, places), partial(perturbed.start, int(members[at])))

    batch, base = _empty_batch(mechanism, columns, chosen, cases), plan(mechanism)
    table, seconds, status = {str(name): batch[name].values for name in batch.data_vars}, 0.0, "complete"
    workers = [Worker(base, options, chosen) for _ in range(min(workers_of(threads), cases))]
    # functions of the user may change objects of this process; duplicates of it take longer to start than a few short cases
    in_process = isinstance(measures, Mapping) or cases < 4 * GROUP_CASES_MAX
    try:
        for done, row in enumerate(rows(workers, case, cases, in_process=in_process), 1):
            store_row(table, row.case, row.values)
            seconds += np.nan_to_num(row.seconds)
            if progress is not None:
                progress(done, cases)
    except KeyboardInterrupt:
        status = "interrupted"
    batch.attrs = {
        "title": TITLE,
        "status": status,
        "failed_cases": int(np.sum(table["status"] == "failed")),
        "seconds": clocks.perf_counter() - began,
        "integration_seconds": float(seconds),
        "configuration": write_configuration(mechanism, options),
    }
    return batch.assign({name: batch[name].astype(str) for name in COLUMNS})


def _broadcast_values(mechanism: Mechanism, over: Mapping[str, ArrayLike]) -> dict[str, np.ndarray]:
    """Return the values by parameter, broadcast to one length."""
    columns = {parameter: np.atleast_1d(np.asarray(values, float)) for parameter, values in over.items()}
    for parameter, column in columns.items():
        number(mechanism, parameter)
        if column.ndim > 1 or not column.size:
            raise InputError(
                f"'{parameter}': values of shape {column.shape}", "a number or a one-dimensional array", "values.ravel()"
            )
    sizes = {column.size for column in columns.values()} - {1}
    if len(sizes) > 1:
        raise InputError(
            f"the parameters have {' and '.join(map(str, sorted(sizes)))} values", "arrays of one length, or single numbers"
        )
    cases = max(sizes, default=1)
    return {parameter: np.broadcast_to(column, cases) for parameter, column in columns.items()}


def _find_measures(measures: Sequence[str] | Mapping[str, Measure]) -> dict[str, Measure]:
    if isinstance(measures, Mapping):
        return dict(measures)
    if isinstance(measures, str):
        raise InputError(f"measures = '{measures}'", "a sequence of names", f"measures=['{measures}']")
    for name in measures:
        if name not in MEASURES:
            raise InputError(f"unknown measure '{name}'{did_you_mean(name, MEASURES)}", ", ".join(MEASURES))
    return {name: MEASURES[name] for name in measures}


@dataclass(frozen=True)
class Perturbed:
    """Perturbations of the starts on the scale of round-off, as described in `simulate_many`."""

    members: ArrayLike
    perturbation: float
    seed: int = 0

    def __post_init__(self) -> None:
        if not 0.0 <= self.perturbation <= DATA_TOL:
            raise InputError(f"perturbation = {self.perturbation!r}", f"a number from 0 to {DATA_TOL:g}")

    def member_of_each(self, cases: int) -> np.ndarray:
        members = np.asarray(self.members)
        if members.dtype.kind not in "iu" or members.ndim > 1 or members.size not in (1, cases) or np.any(members < 0):
            raise InputError(f"members of shape {members.shape} for {cases} cases", "a whole number >= 0, or one for each case")
        return np.broadcast_to(members.ravel(), cases)

    def start(self, member: int, y: np.ndarray) -> np.ndarray:
        """Return the perturbed start of a member, shape (ny,); the driver projects the state onto the constraints."""
        if not member:
            return y
        numbers = np.random.Generator(np.random.Philox(key=[self.seed, member]))
        return np.asarray(y * (1.0 + self.perturbation * numbers.standard_normal(y.size)))


def _empty_batch(
    mechanism: Mechanism, columns: Mapping[str, np.ndarray], measures: Mapping[str, Measure], cases: int
) -> xr.Dataset:
    """Return the Dataset of a batch without the values of its measures."""
    loads, parts = load_units(mechanism), parts_of(mechanism)
    variables: dict[str, Any] = {}
    for name, measure in measures.items():
        units = measure.units
        if units == LOAD_UNIT:
            units = " or ".join(dict.fromkeys(loads[measure.dims[0]].values())) or "1"
        empty = np.full((cases, *(len(parts[dim]) for dim in measure.dims)), np.nan)
        about = {"units": units, "long_name": measure.long_name, **measure.attributes}
        variables[name] = (("case", *measure.dims), empty, about)
    coordinates: dict[str, Any] = {}
    for parameter, column in columns.items():
        quantity = number(mechanism, parameter).quantity
        assert quantity is not None
        coordinates[parameter] = ("case", column, {"units": quantity.unit, "long_name": quantity.help or parameter})
    used = {dim for measure in measures.values() for dim in measure.dims}
    coordinates |= {dim: parts[dim] for dim in sorted(used)}
    for dim in used & loads.keys():
        coordinates[f"{dim}_unit"] = (dim, np.array(list(loads[dim].values()), dtype=str))
    return xr.Dataset(variables | empty_columns(COLUMNS, "case", cases), coords=coordinates)
