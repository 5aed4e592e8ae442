"""What one thread of a batch does: it prepares some cases, advances them one after another and hands over their measures."""

from __future__ import annotations

import time as clocks
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Protocol

import numpy as np

from scissordyn.errors import ScissordynError
from scissordyn.kinematics.time_functions import check_tables
from scissordyn.model.mechanism import Mechanism
from scissordyn.plan.plan import Plan, plan
from scissordyn.run.advance.driver import FIRST, SLICE, UNFINISHED, Driver, advance_together
from scissordyn.run.advance.system import make_system, put_numbers
from scissordyn.run.advance.trajectory import broken_off, crosses, model_failure, reach
from scissordyn.run.answer.hard_contact import ignored_roots, stepping_warnings
from scissordyn.run.answer.measure import Ended
from scissordyn.run.options import Options
from scissordyn.run.start.ideal_path import IdealPath, ideal_path, stages
from scissordyn.run.start.method import choose_method
from scissordyn.run.start.start import prepare_start
from scissordyn.run.start.tolerance import error_weights

MOST_TOGETHER = 16
"""Cases that are prepared one after the other. Between two runs of the loop, which leave nothing in the processor's caches,
preparing one case takes three to ten times as long as after another."""

GROUP_SECONDS = 0.1
"""Time that a group should take, so that threads end together and Ctrl-C is noticed."""


class Cases(Protocol):
    """The cases of a batch, by number, and where their results go."""

    compares: bool
    """Whether tracked points are compared with the ideal mechanism."""

    sampled: bool
    """Whether measures need equally spaced samples."""

    def mechanism(self, case: int) -> Mechanism:
        """The mechanism with the numbers of a case."""

    def start(self, case: int, y: np.ndarray) -> np.ndarray:
        """The state that a case starts from, given that of its mechanism."""

    def failed(self, case: int, cause: str) -> None:
        """Note why a case has no measures."""

    def take(self, case: int, ended: Ended, seconds: float, warned: Sequence[str]) -> None:
        """Write the measures of a case that is complete, and its warnings, some of which are known from its start."""


class Worker:
    """One thread's arrays, which it keeps from case to case."""

    def __init__(self, base: Plan, options: Options, cases: Cases) -> None:
        self.base, self.options, self.cases = base, options, cases
        self.slots: list[_Slot] = []
        self.path: IdealPath | None = None
        self.seconds, self.slice = 0.0, FIRST

    def size(self, cases: int, threads: int) -> int:
        """How many cases to do together, by how long the last ones took."""
        if not self.seconds:
            return 1
        return max(1, min(MOST_TOGETHER, int(GROUP_SECONDS / self.seconds), cases // (8 * threads)))

    def run(self, group: Sequence[int]) -> None:
        """Simulate some cases, given by their numbers, and hand over their results; see `interrupt.stopped_by`."""
        began = clocks.perf_counter()
        while len(self.slots) < len(group):
            self.slots.append(_Slot(self.base))
        started = [(case, slot, self._started(case, slot)) for case, slot in zip(group, self.slots, strict=False)]
        ready = [(case, slot, driver) for case, slot, driver in started if driver is not None]
        statuses, seconds = self._together([driver for _, _, driver in ready])
        ended = [
            (case, slot, driver, self._advance(case, driver, status, seconds))
            for (case, slot, driver), status in zip(ready, statuses, strict=True)
        ]
        for case, slot, driver, taken in ended:
            try:
                if taken is not None:
                    self.cases.take(
                        case, Ended(driver, slot.path, self.options), taken, [*slot.warned, *_warned(driver, self.options)]
                    )
            except ScissordynError as error:  # of a measure of the user's
                self.cases.failed(case, str(error))
        self.seconds = (clocks.perf_counter() - began) / len(group)

    def _started(self, case: int, slot: _Slot) -> Driver | None:
        """The driver at the start of a case; None if there is no such start."""
        try:
            driver = slot.started(self.cases.mechanism(case), self.options, partial(self.cases.start, case))
            if self.cases.compares:
                slot.path = self._compare(driver)
            if self.cases.sampled:
                driver.sample_at(np.linspace(0.0, self.options.until, self.options.count))
        except ScissordynError as error:
            self.cases.failed(case, str(error))
            return None
        return driver

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

    def _advance(self, case: int, driver: Driver, status: int, seconds: float) -> float | None:
        """Advance to the end from where `_together` got; returns the time of both, None if it did not get there."""
        began, options = clocks.perf_counter(), self.options
        try:
            cause = reach(driver, options.until, options.most_steps) if status in UNFINISHED else broken_off(status, driver)
        except ScissordynError as error:
            self.cases.failed(case, str(error))
            return None
        if cause:
            cause = f"stopped at t = {driver.time:.9g} s of {options.until:g} s: {cause}"
        cause = cause or model_failure(driver)
        if cause:
            self.cases.failed(case, cause)
            return None
        return seconds + clocks.perf_counter() - began

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


def _warned(driver: Driver, options: Options) -> list[str]:
    """What the counters of a run warn of."""
    if driver.stepping is None:
        return list(map(str, ignored_roots(driver.plan, options)))
    return list(map(str, stepping_warnings(driver.plan, driver.system, driver.stepping.statistics(driver.time))))


class _Slot:
    """A driver and the arrays that it works on, for one case after another."""

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
        prepared = prepare_start(self.plan, self.system, options.start)
        self.warned = prepared.warnings
        y = perturb(prepared.y)
        tolerances = error_weights(self.plan, self.system, y, rtol=options.rtol, atol=options.atol)
        choice = choose_method(self.plan, self.system, y, options, tolerances)
        driver, across = self.driver, crosses(self.plan, options)
        if driver is not None and driver.method == choice.method:
            driver.restart(self.plan, y, tolerances, crosses=across, initial_events=prepared.initial_events, choice=choice)
            return driver
        driver = Driver(
            self.plan,
            self.system,
            y,
            method=choice,
            tolerances=tolerances,
            crosses=across,
            initial_events=prepared.initial_events,
        )
        self.driver = driver
        return driver
