"""Rows of measures from cases: each case is one run to the same end, on threads that reuse their arrays; and tables of rows."""

from __future__ import annotations

import math
import queue
import time as clocks
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from scissordyn.errors import ScissordynError
from scissordyn.kinematics.closure import check_tables
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.options import Options
from scissordyn.plan.plan import Plan, plan
from scissordyn.plan.system import make_system, put_numbers
from scissordyn.record.ideal_path import IdealPath
from scissordyn.record.transmitted import coarse_count
from scissordyn.record.warn import Extremes
from scissordyn.run.advance.driver import FIRST_STEPS, Driver
from scissordyn.run.advance.loop import CALL_SECONDS, SLICE_STEPS_MAX, UNFINISHED, advance_together
from scissordyn.run.engine import STATUSES, outcomes
from scissordyn.run.ideal_path import ideal_path, make_stages
from scissordyn.run.measure import Ended, Measure
from scissordyn.run.trajectory import RECORDED_STEPS_MAX, advance_to, describe_stop, make_driver, model_failure
from scissordyn.run.trajectory_warnings import ignored_roots, stepping_warnings

GROUP_CASES_MAX = 16
"""Largest number of cases that a thread prepares before it advances them.

If only one case is prepared between two calls of the loop, it takes three to ten times as long, since the loop leaves
nothing in the processor's caches.
"""


PENDING, COMPLETE, FAILED = STATUSES

COLUMNS: dict[str, tuple[str | int | float, dict[str, str]]] = {
    "status": (PENDING, {"long_name": "complete, failed or pending"}),
    "cause": ("", {"long_name": "why a case failed"}),
    "warnings": ("", {"long_name": "warnings of a complete case, one a line"}),
}
"""Columns of every table of cases, in addition to measures: value for a case that is not computed, and attributes."""


def empty_columns(
    columns: Mapping[str, tuple[str | int | float, dict[str, str]]], along: str, cases: int
) -> dict[str, tuple[str, np.ndarray, dict[str, str]]]:
    """Return variables of a Dataset without values, from those of a case that is not computed."""
    kinds = {str: object, int: np.int64, float: float}
    return {name: (along, np.full(cases, blank, kinds[type(blank)]), about) for name, (blank, about) in columns.items()}


def store_row(table: Mapping[str, np.ndarray], case: int, values: Mapping[str, Any]) -> None:
    """Store the values of a case in the columns of a table; what a short value leaves out stays NaN."""
    for name, value in values.items():
        place = table[name][case, ...]
        if np.ndim(value):
            place = place[: np.shape(value)[0]]
        place[...] = value


def failed_row(cause: str) -> dict[str, Any]:
    return {"status": FAILED, "cause": cause}


class Case(NamedTuple):
    mechanism: Mechanism
    perturb: Callable[[np.ndarray], np.ndarray] = lambda y: y  # changes the initial state


class Row(NamedTuple):
    case: int
    values: Mapping[str, Any]  # measures by name, and the values of `COLUMNS`
    seconds: float = math.nan  # computing time of the run [s]


def rows(workers: Sequence[Worker], case: Callable[[int], Case], cases: int, *, in_process: bool = False) -> Iterator[Row]:
    """Simulate cases on one thread, or in one duplicate of this process, for each worker; yield their rows as they finish."""
    free: queue.SimpleQueue[Worker] = queue.SimpleQueue()
    for worker in workers:
        free.put(worker)

    seconds = 0.0

    def groups() -> Iterator[range]:
        first = 0
        while first < cases:
            last = min(first + _group_size(seconds, cases, len(workers)), cases)
            yield range(first, last)
            first = last

    def compute(group: range) -> tuple[list[Row], float]:
        worker, began = free.get(), clocks.thread_time()  # other threads and processes do not make groups smaller
        try:
            return worker.rows(group, case), (clocks.thread_time() - began) / len(group)
        finally:
            free.put(worker)

    for outcome in outcomes(len(workers), compute, groups(), in_process=in_process):
        if isinstance(outcome.error, ScissordynError):  # the duplicates that computed the group died
            yield from (Row(case_index, failed_row(str(outcome.error))) for case_index in outcome.task)
            continue
        if outcome.value is None:
            assert outcome.error is not None
            raise outcome.error
        found, seconds = outcome.value
        yield from found


def _group_size(seconds: float, cases: int, threads: int) -> int:
    """Return the number of cases in the next group, from the time of a case in the last one, 0 for the first group."""
    return max(1, min(GROUP_CASES_MAX, int(CALL_SECONDS / seconds), cases // (8 * threads))) if seconds else 1


class Worker:
    """Arrays of one thread, reused for all its cases; the thread prepares a group of cases and then advances each of them."""

    def __init__(self, base: Plan, options: Options, measures: Mapping[str, Measure]) -> None:
        self.base, self.options, self.measures = base, options, measures
        chosen = measures.values()
        self.compares = any(measure.compares for measure in chosen) and bool(base.mechanism.tracks)
        self.sampled = any(measure.sampled for measure in chosen)
        self.records = any(measure.recorded for measure in chosen)
        self.still = bool(chosen) and all(measure.static for measure in chosen)
        self.slots: list[_Slot] = []
        self.path: IdealPath | None = None
        self.slice = FIRST_STEPS

    def rows(self, group: Sequence[int], case: Callable[[int], Case]) -> list[Row]:
        """Simulate the cases with the given indices and return their rows."""
        self.slots += [_Slot(self.base) for _ in range(len(group) - len(self.slots))]
        ready, rows = list[tuple[int, _Slot, Driver]](), list[Row]()
        for case_index, slot in zip(group, self.slots, strict=False):
            try:
                driver = slot.begin_case(case(case_index), self.options)
                slot.path = self._compare(driver) if self.compares else None
                if self.sampled or self.records:
                    count = self.options.count if self.sampled else coarse_count(self.base)
                    driver.sample_at(np.linspace(0.0, self.options.until, count))
                if self.records:
                    driver.record_steps(inside=True, most=RECORDED_STEPS_MAX)
                ready.append((case_index, slot, driver))
            except ScissordynError as error:
                rows.append(Row(case_index, failed_row(str(error))))
        if self.still:
            return rows + [
                self._row(case_index, slot, Ended(driver, slot.path, self.options)) for case_index, slot, driver in ready
            ]
        statuses, seconds = self._together([driver for _, _, driver in ready])
        complete = list[tuple[int, _Slot, Ended, float]]()
        for (case_index, slot, driver), status in zip(ready, statuses, strict=True):
            cause, advance_seconds = self._advance(driver, status)
            if cause:
                rows.append(Row(case_index, failed_row(cause)))
            else:
                complete.append((case_index, slot, Ended(driver, slot.path, self.options), seconds + advance_seconds))
        together = [ended for _, _, ended, _ in complete]
        for case_index, slot, ended, advance_seconds in complete:
            ended.together = together
            rows.append(self._row(case_index, slot, ended, advance_seconds))
        return rows

    def _row(self, case: int, slot: _Slot, ended: Ended, seconds: float = math.nan) -> Row:
        """Return the measures and warnings of a complete case; without `seconds`, it has only measures that need no run."""
        try:
            values = {name: measure.value(ended) for name, measure in self.measures.items()}
        except ScissordynError as error:  # error in a user-defined measure
            return Row(case, failed_row(str(error)))
        counted = () if self.still else self._counter_warnings(ended.driver)
        compared = () if slot.path is None else slot.path.warnings
        texts = "\n".join([*slot.warned, *counted, *Extremes(ended.plan).add(ended.path).texts(), *ended.warnings, *compared])
        return Row(case, {**values, "status": COMPLETE, "warnings": texts}, seconds)

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
        if path.end < self.options.until * (1.0 - 1e-9):
            raise ScissordynError(path.warnings[0])  # the deviations are unknown
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

    def begin_case(self, case: Case, options: Options) -> Driver:
        """Return a driver at the start of a case, in the arrays of the previous case if these fit."""
        mechanism = case.mechanism
        fits = self.plan.fits(mechanism)
        self.plan = self.plan.case(mechanism) if fits else plan(mechanism)
        check_tables(self.plan, options.until)
        if not (fits and put_numbers(self.system, self.plan)):
            self.system, self.driver = make_system(self.plan), None
        self.driver, prepared, _ = make_driver(self.plan, options, self.system, self.driver, case.perturb)
        self.warned = prepared.warnings
        return self.driver
