"""Many runs of one mechanism with other numbers: threads without the interpreter's lock, measures in place of histories."""

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
from scissordyn.record.transmitted import FEWEST
from scissordyn.record.warn import Extremes
from scissordyn.run.advance.driver import FIRST_STEPS, Driver
from scissordyn.run.advance.loop import SLICE, UNFINISHED, advance_together
from scissordyn.run.engine import outcomes, workers_of
from scissordyn.run.ideal_path import ideal_path, stages
from scissordyn.run.measure import COMPONENT_UNIT, MEASURES, Ended, Measure, check_measures, component_units, parts_of
from scissordyn.run.trajectory import MOST_RECORDED, broken_off, make_driver, model_failure, reach
from scissordyn.run.trajectory_warnings import ignored_roots, stepping_warnings

TITLE = "scissordyn batch"

MOST_TOGETHER = 16
"""Cases that are prepared one after the other. Between two runs of the loop, which leave nothing in the processor's caches,
preparing one case takes three to ten times as long as after another."""

GROUP_SECONDS = 0.1  # Time that a group should take, so that threads end together and Ctrl-C is noticed
LARGEST_PERTURBATION = 1e-6  # What is larger is another start, not round-off


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
    """Simulate a mechanism for many values of some of its numbers.

    Each case is the run that `simulate` makes, step by step and bit for bit, whatever the number of threads.

    Parameters
    ----------
    mechanism : Mechanism
    over : mapping of str to array_like
        Values in SI by parameter path ("A.clearance", "drive.speed"); arrays of one length, or single numbers.
        For a grid, ``numpy.meshgrid`` and ``ravel``.
    until : float
        End of the simulated time [s].
    measures : sequence of str, or mapping of str to Measure, optional
        Names from `run.measure.MEASURES`, or measures of your own by name. If not given: "peak_force", or "peak_force_estimate"
        where contacts are hard (both where there are both), "peak_drive_torque", "contact_count" and "contact_fraction".
    members : array_like of int
        One number for all cases or one for each: with 0 a case starts as `simulate` does; member k starts with every entry y of
        its state perturbed to y (1 + p g), g normal random numbers that depend on k and `seed` only.
    perturbation : float
        p, from 0 to 1e-6.
    seed : int
    start, rtol, atol, method, most_steps, events, step
        As for `simulate`.
    threads : int, optional
        One per processor if not given.
    progress : callable, optional
        Called after each group of cases with the cases done and their number.

    Returns
    -------
    Dataset
        Along `case`: the values, the measures, `status` ("complete", "failed", or "pending" after Ctrl-C), `cause`, and
        `warnings`: laws outside their range, friction beyond its limit, controllers at theirs. A case that fails has NaN and
        its cause; the others go on.

    Raises
    ------
    InputError
        If a parameter path, a measure or an option is wrong.
    """
    if not isinstance(over, Mapping) or not over:
        shown = "no numbers to vary" if isinstance(over, Mapping) else f"over = {over!r:.60}"
        raise InputError(shown, "parameters and their values", "{'A.clearance': [1e-4, 2e-4]}")
    options = Options(until, start, Options.samples, rtol, atol, method, most_steps, events, step=step)
    perturbed = Perturbed(members, perturbation, seed)
    measures = usual_measures(mechanism) if measures is None else measures
    return simulate_cases(mechanism, over, options, measures, perturbed, threads=threads, progress=progress)


def usual_measures(mechanism: Mechanism) -> tuple[str, ...]:
    """The measures of a batch that names none: largest forces as its kinds of contact have them, torques, and contacts."""
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
    """The same with the options of `simulate` together, and the perturbations of the starts; nothing has to vary."""
    columns, chosen, spread = _columns(mechanism, over), _chosen(measures), workers_of(threads)
    check_measures(mechanism, chosen)
    batch, began = _Batch(mechanism, columns, options, chosen, perturbed), clocks.perf_counter()
    interrupted = batch.run(spread, progress)
    return batch.dataset(clocks.perf_counter() - began, interrupted=interrupted)


def _columns(mechanism: Mechanism, over: Mapping[str, ArrayLike]) -> dict[str, np.ndarray]:
    """Values by parameter, all of one length."""
    columns = {parameter: np.atleast_1d(np.asarray(values, float)) for parameter, values in over.items()}
    for parameter, column in columns.items():
        number(mechanism, parameter)
        if column.ndim > 1 or not column.size:
            raise InputError(f"'{parameter}': values of shape {column.shape}", "one dimension; ravel a grid")
    sizes = {column.size for column in columns.values()} - {1}
    if len(sizes) > 1:
        raise InputError(f"columns of {', '.join(map(str, sorted(sizes)))} values", "columns of one length, or single numbers")
    cases = max(sizes, default=1)
    return {parameter: np.broadcast_to(column, cases) for parameter, column in columns.items()}


def _chosen(measures: Sequence[str] | Mapping[str, Measure]) -> dict[str, Measure]:
    if isinstance(measures, Mapping):
        return dict(measures)
    for name in measures:
        if name not in MEASURES:
            raise InputError(f"measure '{name}'{did_you_mean(name, MEASURES)}", ", ".join(MEASURES))
    return {name: MEASURES[name] for name in measures}


@dataclass(frozen=True)
class Perturbed:
    """Perturbations of the starts on the scale of round-off; see `simulate_many`."""

    members: ArrayLike
    perturbation: float
    seed: int = 0

    def __post_init__(self) -> None:
        if not 0.0 <= self.perturbation <= LARGEST_PERTURBATION:
            raise InputError(f"perturbation = {self.perturbation!r}", f"a number from 0 to {LARGEST_PERTURBATION:g}")

    def member_of_each(self, cases: int) -> np.ndarray:
        members = np.asarray(self.members)
        if members.dtype.kind not in "iu" or members.ndim > 1 or members.size not in (1, cases) or np.any(members < 0):
            raise InputError(f"members of shape {members.shape} for {cases} cases", "a whole number >= 0, or one for each case")
        return np.broadcast_to(members.ravel(), cases)

    def start(self, member: int, y: np.ndarray) -> np.ndarray:
        """The state of a member at its start; the driver projects it onto the constraints."""
        if not member:
            return y
        numbers = np.random.Generator(np.random.Philox(key=[self.seed, member]))
        return np.asarray(y * (1.0 + self.perturbation * numbers.standard_normal(y.size)))


class Row(NamedTuple):
    case: int
    ended: Ended | None  # Of a run that is complete; valid until the worker goes on
    cause: str = ""  # Why it is not
    seconds: float = math.nan
    warned: tuple[str, ...] = ()  # By its start and its counters


class Worker:
    """One thread's arrays, which it keeps from case to case: it prepares some cases and advances them one after another."""

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
        """How many cases to do together, by how long the last ones took."""
        if not self.seconds:
            return 1
        return max(1, min(MOST_TOGETHER, int(GROUP_SECONDS / self.seconds), cases // (8 * threads)))

    def rows(
        self,
        group: Sequence[int],
        mechanism: Callable[[int], Mechanism],
        perturb: Callable[[int, np.ndarray], np.ndarray] = lambda case, y: y,
    ) -> Iterator[Row]:
        """Simulate some cases, given by their numbers; `perturb` changes the state that a case starts from."""
        began = clocks.perf_counter()
        self.slots += [_Slot(self.base) for _ in range(len(group) - len(self.slots))]
        ready, rows = list[tuple[int, _Slot, Driver]](), list[Row]()
        for case, slot in zip(group, self.slots, strict=False):
            try:
                driver = slot.started(mechanism(case), self.options, partial(perturb, case))
                slot.path = self._compare(driver) if self.compares else None
                if self.sampled or self.records:
                    count = self.options.count if self.sampled else FEWEST
                    driver.sample_at(np.linspace(0.0, self.options.until, count))
                if self.records:
                    driver.record_steps(inside=True, most=MOST_RECORDED)
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
            rows.append(Row(case, ended, cause, seconds + taken, () if cause else (*slot.warned, *self._warned(driver))))
        yield from rows
        self.seconds = (clocks.perf_counter() - began) / len(group)

    def _together(self, drivers: Sequence[Driver]) -> tuple[list[int], float]:
        """Advance for about `GROUP_SECONDS`; returns statuses, and the time that each took on the average [s]."""
        if not drivers:
            return [], 0.0
        began = clocks.perf_counter()
        steps = min(max(1, self.slice // len(drivers)), self.options.most_steps)
        statuses = advance_together(drivers, self.options.until, steps)
        seconds = clocks.perf_counter() - began
        self.slice = min(int(sum(driver.tried for driver in drivers) * GROUP_SECONDS / max(seconds, 1e-9)), SLICE)
        return statuses, seconds / len(drivers)

    def _advance(self, driver: Driver, status: int) -> tuple[str, float]:
        """Advance to the end from where `_together` got; returns why it did not get there, "" if it did, and the time taken."""
        began, options = clocks.perf_counter(), self.options
        try:
            cause = reach(driver, options.until, options.most_steps) if status in UNFINISHED else broken_off(status, driver)
            cause = f"stopped at t = {driver.time:.9g} s of {options.until:g} s: {cause}" if cause else model_failure(driver)
        except ScissordynError as error:
            cause = str(error)
        return cause, clocks.perf_counter() - began

    def _compare(self, driver: Driver) -> IdealPath:
        """Have the driver compare with the commanded path, which is computed anew only where it is another one."""
        chosen = stages(driver.plan.mechanism)
        if self.path is None or self.path.stages[0] != chosen[0]:
            self.path = ideal_path(driver.plan, self.options)
        path = replace(self.path, stages=chosen)
        if path.warnings:
            raise ScissordynError(path.warnings[0])
        driver.compare_with(path.table, path.step)
        return path

    def _warned(self, driver: Driver) -> list[str]:
        """What the counters of a run warn of."""
        if driver.stepping is None:
            return list(map(str, ignored_roots(driver.plan, self.options)))
        return list(map(str, stepping_warnings(driver.plan, driver.system, driver.stepping.statistics(driver.time))))


class _Slot:
    def __init__(self, plan: Plan) -> None:
        self.plan, self.system = plan, make_system(plan)
        self.driver: Driver | None = None
        self.warned: tuple[str, ...] = ()
        self.path: IdealPath | None = None

    def started(self, mechanism: Mechanism, options: Options, perturb: Callable[[np.ndarray], np.ndarray]) -> Driver:
        """A driver at the start of a case, in the arrays of the case before if they fit."""
        fits = self.plan.fits(mechanism)
        self.plan = self.plan.case(mechanism) if fits else plan(mechanism)
        check_tables(self.plan, options.until)
        if not (fits and put_numbers(self.system, self.plan)):
            self.system, self.driver = make_system(self.plan), None
        self.driver, prepared, _ = make_driver(self.plan, options, self.system, self.driver, perturb)
        self.warned = prepared.warnings
        return self.driver


class _Batch:
    """The cases, with their measures, status and cause; each is written by one thread, to its own place."""

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
        """The state that a case starts from, given that of its mechanism."""
        return self.perturbed.start(int(self.members[case]), y)

    def enter(self, row: Row) -> None:
        """Write the measures of a case and its warnings, or why it has none."""
        case, ended, cause = row.case, row.ended, row.cause
        try:
            values = {} if ended is None else {name: measure.value(ended) for name, measure in self.measures.items()}
        except ScissordynError as error:  # of a measure of the user's
            ended, cause = None, str(error)
        if ended is None:
            self.cause[case], self.status[case] = cause, "failed"
            return
        for name, value in values.items():
            place = self.values[name][case, ...]
            if self.measures[name].dims == ("joint",) and np.ndim(value):  # of contacts alone, but for the largest force
                place = place[: np.size(value)]
            place[...] = value
        self.warnings[case] = "\n".join([*row.warned, *Extremes(ended.plan).add(ended.path).texts()])
        self.seconds[case] = row.seconds
        self.status[case] = "complete"

    def run(self, threads: int, progress: Callable[[int, int], None] | None) -> bool:
        """Run all cases; returns whether the user stopped it."""
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
        exerted = component_units(self.base)
        every = " or ".join(dict.fromkeys(exerted.values())) or "1"
        variables: dict[str, Any] = {}
        for name, measure in self.measures.items():
            about = {"units": every if measure.dims == ("component",) else measure.units, "long_name": measure.long_name}
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
        if "component" in used:
            coordinates[COMPONENT_UNIT] = ("component", np.array(list(exerted.values()), dtype=str))
        attributes = {
            "title": TITLE,
            "status": "interrupted" if interrupted else "complete",
            "failed_cases": int(np.sum(self.status == "failed")),
            "seconds": seconds,
            "integration_seconds": float(np.nansum(self.seconds)),
            "configuration": write_configuration(self.base, self.options),
        }
        return xr.Dataset(variables, coords=coordinates, attrs=attributes)
