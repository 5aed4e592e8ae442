"""Batches: many runs of one mechanism with other parameter values, in parallel threads, reduced to measures."""

from __future__ import annotations

import math
import queue
import time as clocks
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from scissordyn.casefile.configuration import write_configuration
from scissordyn.errors import InputError, ScissordynError, did_you_mean
from scissordyn.kinematics.closure import check_tables
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.options import EventKind, Options, StartKind
from scissordyn.model.parameter_path import changed_all, find, number
from scissordyn.plan.plan import Plan, plan
from scissordyn.plan.system import make_system, put_numbers
from scissordyn.record.ideal_path import IdealPath
from scissordyn.record.transmitted import COARSE_SAMPLES
from scissordyn.record.warn import Extremes
from scissordyn.run.advance.driver import FIRST_STEPS, Driver
from scissordyn.run.advance.loop import CALL_SECONDS, SLICE_STEPS_MAX, UNFINISHED, advance_together
from scissordyn.run.engine import outcomes, workers_of
from scissordyn.run.ideal_path import ideal_path, make_stages
from scissordyn.run.measure import LOAD_UNIT, MEASURES, Ended, Measure, check_measures, load_units, parts_of
from scissordyn.run.trajectory import RECORDED_STEPS_MAX, advance_to, describe_stop, make_driver, model_failure
from scissordyn.run.trajectory_warnings import ignored_roots, stepping_warnings
from scissordyn.tolerance import DATA_TOL

TITLE = "scissordyn batch"  # Title of the data set

GROUP_CASES_MAX = 16
"""Largest number of cases that a thread prepares before it advances them.

Preparing a single case between two calls of the loop takes three to ten times as long, since the loop leaves nothing in the
processor's caches.
"""


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
    atol: float = Options.atol,
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
        Number of threads; by default one per processor.
    progress : callable, optional
        Called after each group of cases with the number of finished cases and the number of all cases.

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
    columns, chosen, spread = _broadcast_values(mechanism, over), _find_measures(measures), workers_of(threads)
    check_measures(mechanism, chosen)
    batch, began = _Batch(mechanism, columns, options, chosen, perturbed), clocks.perf_counter()
    interrupted = batch.run(spread, progress)
    return batch.dataset(clocks.perf_counter() - began, interrupted=interrupted)


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
    for name in measures:
        if name not in MEASURES:
            raise InputError(f"measure '{name}'{did_you_mean(name, MEASURES)}", ", ".join(MEASURES))
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


class Row(NamedTuple):
    case: int
    ended: Ended | None  # end of a complete run; valid until the worker starts the next group
    cause: str = ""  # reason why the run is not complete
    seconds: float = math.nan
    warned: tuple[str, ...] = ()  # warnings of the start and of the counters


class Worker:
    """Arrays of one thread, reused for all its cases; the thread prepares a group of cases and then advances each of them."""

    def __init__(
        self,
        base: Plan,
        options: Options,
        *,
        compares: bool = False,
        sampled: bool = False,
        still: bool = False,
        records: bool = False,
    ) -> None:
        self.base, self.options, self.records = base, options, records
        self.compares, self.sampled, self.still = compares, sampled, still
        self.slots: list[_Slot] = []
        self.path: IdealPath | None = None
        self.seconds, self.slice = 0.0, FIRST_STEPS

    def size(self, cases: int, threads: int) -> int:
        """Return the number of cases in the next group, from the time that the last group took."""
        if not self.seconds:
            return 1
        return max(1, min(GROUP_CASES_MAX, int(CALL_SECONDS / self.seconds), cases // (8 * threads)))

    def rows(
        self,
        group: Sequence[int],
        mechanism: Callable[[int], Mechanism],
        perturb: Callable[[int, np.ndarray], np.ndarray] = lambda case, y: y,
    ) -> Iterator[Row]:
        """Simulate the cases with the given indices and yield their rows; `perturb` changes the initial state of a case."""
        began = clocks.perf_counter()
        self.slots += [_Slot(self.base) for _ in range(len(group) - len(self.slots))]
        ready, rows = list[tuple[int, _Slot, Driver]](), list[Row]()
        for case, slot in zip(group, self.slots, strict=False):
            try:
                driver = slot.begin_case(mechanism(case), self.options, partial(perturb, case))
                slot.path = self._compare(driver) if self.compares else None
                if self.sampled or self.records:
                    count = self.options.count if self.sampled else COARSE_SAMPLES
                    driver.sample_at(np.linspace(0.0, self.options.until, count))
                if self.records:
                    driver.record_steps(inside=True, most=RECORDED_STEPS_MAX)
                ready.append((case, slot, driver))
            except ScissordynError as error:
                rows.append(Row(case, None, str(error)))
        if self.still:
            yield from rows + [Row(case, Ended(driver, None, self.options), warned=slot.warned) for case, slot, driver in ready]
            return
        statuses, seconds = self._together([driver for _, _, driver in ready])
        for (case, slot, driver), status in zip(ready, statuses, strict=True):
            cause, taken = self._advance(driver, status)
            ended = None if cause else Ended(driver, slot.path, self.options)
            rows.append(
                Row(case, ended, cause, seconds + taken, () if cause else (*slot.warned, *self._counter_warnings(driver)))
            )
        yield from rows
        self.seconds = (clocks.perf_counter() - began) / len(group)

    def _together(self, drivers: Sequence[Driver]) -> tuple[list[int], float]:
        """Advance all drivers for about `CALL_SECONDS`; return their statuses and the mean time per driver [s]."""
        if not drivers:
            return [], 0.0
        began = clocks.perf_counter()
        steps = min(max(1, self.slice // len(drivers)), self.options.most_steps)
        statuses = advance_together(drivers, self.options.until, steps)
        seconds = clocks.perf_counter() - began
        self.slice = min(
            int(sum(driver.steps_tried for driver in drivers) * CALL_SECONDS / max(seconds, 1e-9)), SLICE_STEPS_MAX
        )
        return statuses, seconds / len(drivers)

    def _advance(self, driver: Driver, status: int) -> tuple[str, float]:
        """Advance a driver that `_together` has started to the end of its run.

        Return the cause of a failure, "" if there is none, and the computing time [s].
        """
        began, options = clocks.perf_counter(), self.options
        try:
            cause = (
                advance_to(driver, options.until, options.most_steps) if status in UNFINISHED else describe_stop(status, driver)
            )
            cause = f"stopped at t = {driver.time:.9g} s of {options.until:g} s: {cause}" if cause else model_failure(driver)
        except ScissordynError as error:
            cause = str(error)
        return cause, clocks.perf_counter() - began

    def _compare(self, driver: Driver) -> IdealPath:
        """Attach the commanded path to the driver, for comparison; compute the path only if it has changed."""
        chosen = make_stages(driver.plan.mechanism)
        if self.path is None or self.path.stages[0] != chosen[0]:
            self.path = ideal_path(driver.plan, self.options)
        path = replace(self.path, stages=chosen)
        if path.warnings:
            raise ScissordynError(path.warnings[0])
        driver.compare_with(path.table, path.step)
        return path

    def _counter_warnings(self, driver: Driver) -> list[str]:
        """Return warnings from the counters of a run: roots ignored with fixed steps, impulses that are not solved."""
        if driver.stepping is None:
            return list(map(str, ignored_roots(driver.plan, self.options)))
        return list(map(str, stepping_warnings(driver.plan, driver.system, driver.stepping.statistics(driver.time))))


class _Slot:
    """Arrays of one case of a group, reused in the next groups."""

    def __init__(self, plan: Plan) -> None:
        self.plan, self.system = plan, make_system(plan)
        self.driver: Driver | None = None
        self.warned: tuple[str, ...] = ()
        self.path: IdealPath | None = None

    def begin_case(self, mechanism: Mechanism, options: Options, perturb: Callable[[np.ndarray], np.ndarray]) -> Driver:
        """Return a driver at the start of a case, in the arrays of the previous case if these fit."""
        fits = self.plan.fits(mechanism)
        self.plan = self.plan.case(mechanism) if fits else plan(mechanism)
        check_tables(self.plan, options.until)
        if not (fits and put_numbers(self.system, self.plan)):
            self.system, self.driver = make_system(self.plan), None
        self.driver, prepared, _ = make_driver(self.plan, options, self.system, self.driver, perturb)
        self.warned = prepared.warnings
        return self.driver


class _Batch:
    """Values, statuses and causes of all cases; each thread writes the entries of its own cases."""

    def __init__(
        self,
        mechanism: Mechanism,
        columns: Mapping[str, np.ndarray],
        options: Options,
        measures: Mapping[str, Measure],
        perturbed: Perturbed,
    ) -> None:
        self.base, self.columns, self.options, self.measures, self.perturbed = mechanism, columns, options, measures, perturbed
        self.places = {parameter: find(mechanism, parameter) for parameter in columns}
        cases = len(next(iter(columns.values()))) if columns else np.size(perturbed.members)
        self.members = perturbed.member_of_each(cases)
        self.sizes = parts_of(mechanism)
        self.values = {
            name: np.full((cases, *(len(self.sizes[dim]) for dim in measure.dims)), np.nan)
            for name, measure in measures.items()
        }
        self.status = np.full(cases, "pending", dtype="U8")
        self.cause, self.warnings = np.full((2, cases), "", dtype=object)
        self.seconds = np.full(cases, np.nan)

    def mechanism(self, case: int) -> Mechanism:
        changes = {parameter: float(column[case]) for parameter, column in self.columns.items()}
        return changed_all(self.base, changes, self.places)

    def start(self, case: int, y: np.ndarray) -> np.ndarray:
        """Return the perturbed initial state of a case, given the unperturbed state."""
        return self.perturbed.start(int(self.members[case]), y)

    def enter(self, row: Row) -> None:
        """Store the measures and warnings of a case, or the cause of its failure."""
        case, ended, cause = row.case, row.ended, row.cause
        try:
            values = {} if ended is None else {name: measure.value(ended) for name, measure in self.measures.items()}
        except ScissordynError as error:  # error in a user-defined measure
            ended, cause = None, str(error)
        if ended is None:
            self.cause[case], self.status[case] = cause, "failed"
            return
        for name, value in values.items():
            place = self.values[name][case, ...]
            # contacts come first; a measure of contacts alone has no value for the ideal joints
            if self.measures[name].dims == ("joint",) and np.ndim(value):
                place = place[: np.size(value)]
            place[...] = value
        self.warnings[case] = "\n".join([*row.warned, *Extremes(ended.plan).add(ended.path).texts()])
        self.seconds[case] = row.seconds
        self.status[case] = "complete"

    def run(self, threads: int, progress: Callable[[int, int], None] | None) -> bool:
        """Run all cases; return True if the user interrupted them."""
        base, cases, chosen = plan(self.base), self.status.size, self.measures.values()
        compares = any(measure.compares for measure in chosen) and bool(self.base.tracks)
        sampled = any(measure.sampled for measure in chosen)
        free: queue.SimpleQueue[Worker] = queue.SimpleQueue()
        kinds = {"compares": compares, "sampled": sampled, "still": bool(chosen) and all(measure.static for measure in chosen)}
        kinds["records"] = any(measure.recorded for measure in chosen)
        workers = [Worker(base, self.options, **kinds) for _ in range(min(threads, cases))]
        for worker in workers:
            free.put(worker)

        def groups() -> Iterator[range]:
            first = 0
            while first < cases:
                last = min(first + min(worker.size(cases, len(workers)) for worker in workers), cases)
                yield range(first, last)
                first = last

        def compute(group: range) -> None:
            worker = free.get()
            try:
                for row in worker.rows(group, self.mechanism, self.start):
                    self.enter(row)
            finally:
                free.put(worker)

        try:
            for outcome in outcomes(len(workers), compute, groups()):
                if outcome.error is not None:
                    raise outcome.error
                if progress is not None:
                    progress(int(np.sum(self.status != "pending")), cases)
        except KeyboardInterrupt:
            return True
        return False

    def dataset(self, seconds: float, *, interrupted: bool) -> xr.Dataset:
        loads = load_units(self.base)
        variables: dict[str, Any] = {}
        for name, measure in self.measures.items():
            units = measure.units
            if units == LOAD_UNIT:
                units = " or ".join(dict.fromkeys(loads[measure.dims[0]].values())) or "1"
            about = {"units": units, "long_name": measure.long_name}
            variables[name] = (("case", *measure.dims), self.values[name], about)
        variables["status"] = ("case", self.status.astype(str), {"long_name": "complete, failed or pending"})
        variables["cause"] = ("case", self.cause.astype(str), {"long_name": "why a case failed"})
        variables["warnings"] = ("case", self.warnings.astype(str), {"long_name": "warnings of a complete case, one a line"})
        coordinates: dict[str, Any] = {}
        for parameter, column in self.columns.items():
            quantity = number(self.base, parameter).quantity
            assert quantity is not None
            coordinates[parameter] = ("case", column, {"units": quantity.unit, "long_name": quantity.help or parameter})
        used = {dim for measure in self.measures.values() for dim in measure.dims}
        coordinates |= {dim: self.sizes[dim] for dim in sorted(used)}
        for dim in used & loads.keys():
            coordinates[f"{dim}_unit"] = (dim, np.array(list(loads[dim].values()), dtype=str))
        attributes = {
            "title": TITLE,
            "status": "interrupted" if interrupted else "complete",
            "failed_cases": int(np.sum(self.status == "failed")),
            "seconds": seconds,
            "integration_seconds": float(np.nansum(self.seconds)),
            "configuration": write_configuration(self.base, self.options),
        }
        return xr.Dataset(variables, coords=coordinates, attrs=attributes)
