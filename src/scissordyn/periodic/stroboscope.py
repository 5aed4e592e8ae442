"""The loop over cycles: from one period of a drive to the next, in plain arrays."""

from __future__ import annotations

import math
import time as clocks
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from scissordyn.component.time_function import ConstantSpeed, Harmonic
from scissordyn.errors import InputError, whole_number
from scissordyn.integrate.integration import RISE, Samples
from scissordyn.kernel import Handle
from scissordyn.kinematics.closure import check_tables
from scissordyn.mechanics.monitored import JOINT_FORCE, companions, oiled_contacts
from scissordyn.model.mechanism import Mechanism
from scissordyn.plan.plan import Plan, plan
from scissordyn.run.advance.driver import Driver, Snapshot, counted
from scissordyn.run.advance.trajectory import make_driver, reach, reached
from scissordyn.run.answer.events import ACCOUNTS, accounts
from scissordyn.run.answer.warn import Extremes
from scissordyn.run.options import Options, StartKind
from scissordyn.run.start.demand import check_cycles
from scissordyn.run.start.method import Choice


@dataclass(frozen=True)
class Cycles:
    """The result of a periodic run: one sample and one row of statistics per complete cycle."""

    plan: Plan
    system: Handle  # Of the mechanics' `System`
    first: int  # Number of the first cycle; cycle k lasts from k to k + 1 periods
    samples: Samples  # One row per cycle, at its start plus the phase
    impacts: np.ndarray  # (cycles, nj) Contacts that started
    contact_fraction: np.ndarray  # (cycles, nj) Fraction of the cycle spent in contact
    peak_force: np.ndarray  # (cycles, nj) Largest force of a joint [N]
    work: np.ndarray  # (cycles, accounts) Increment of each of `events.ACCOUNTS` [J]
    steps: np.ndarray  # (cycles,)
    end: Snapshot  # After the last whole cycle
    status: str  # "complete", "interrupted" or "failed"
    cause: str  # Cause if it is not complete
    # Method, steps, rejected, rates, jacobians, events, seconds of integration, cycles per second
    statistics: dict[str, str | int | float]
    warnings: tuple[str, ...]  # Of the start, and of the cycles that are kept


def drive_period(mechanism: Mechanism) -> float:
    """The period of a mechanism's only periodic drive."""
    # a drive at constant speed is periodic, a growing distance is not
    driving: tuple[Any, ...] = (*mechanism.drives, *mechanism.coordinate_drives)
    turning = (drive.motion for drive in driving if isinstance(drive.motion, ConstantSpeed))
    periods = {2.0 * math.pi / abs(motion.speed) for motion in turning if motion.speed != 0.0}
    every = [part.motion for part in (*driving, *mechanism.rods)]
    periods |= {2.0 * math.pi / motion.angular_frequency for motion in every if isinstance(motion, Harmonic)}
    if len(periods) != 1:
        raise InputError(
            f"{len(periods) or 'no'} periods among the drives of the mechanism",
            "the period [s]",
            "period=0.25, or a harmonic drive",
        )
    return periods.pop()


def start_state(mechanism: Mechanism, start: StartKind = "concentric", *, rtol: float = 1e-6, atol: float = 1e-6) -> Snapshot:
    driver, _, _ = make_driver(plan(mechanism), Options(1.0, start, 2, rtol, atol))
    return driver.snapshot()


def run_cycles(
    mechanism: Mechanism,
    options: Options,
    *,
    cycles: int,
    keep: int | None = None,
    phase: float = 0.0,
    start: StartKind | Snapshot = "concentric",
    progress: Callable[[float], None] | None = None,
) -> Cycles:
    """The cycles as plain arrays; see `cycle` for the parameters."""
    whole_number("cycles", cycles)
    keep = whole_number("keep", cycles if keep is None else keep)
    check_cycles(len(mechanism.contacts), cycles)
    if not 0.0 <= phase < 1.0:
        raise InputError(f"phase = {phase!r}", "a fraction of the period, at least 0 and below 1")
    period = options.until
    driver, prepared, choice = make_driver(
        plan(mechanism), replace(options, start=start) if isinstance(start, str) else options
    )
    if isinstance(start, Snapshot):
        driver.restore(start)
    warned = prepared.warnings if isinstance(start, str) else ()
    first = round(driver.time / period)
    check_tables(driver.plan, (first + cycles) * period)
    run = _cycled(driver, options, choice, range(first, first + cycles), keep, phase, progress)
    return replace(run, warnings=(*warned, *run.warnings))


def _cycled(
    driver: Driver,
    options: Options,
    choice: Choice,
    numbers: range,
    keep: int,
    phase: float,
    progress: Callable[[float], None] | None,
) -> Cycles:
    period, state, first, cycles = options.until, driver.state, numbers.start, len(numbers)
    contacts = len(driver.plan.contacts)
    driver.sample_at((first + np.arange(cycles) + phase) * period)
    impacts, steps = np.zeros((cycles, contacts), np.int64), np.zeros(cycles, np.int64)
    fraction, peak, gained = np.zeros((cycles, contacts)), np.zeros((cycles, contacts)), np.zeros((cycles, len(ACCOUNTS)))
    extremes, model = Extremes(driver.plan), driver.system.content.model
    companion, oiled = companions(model), oiled_contacts(model)
    last = np.where(companion >= 0, companion, np.arange(companion.size))
    done, events, cause, end = 0, 0, "", driver.snapshot()
    began, before = clocks.perf_counter(), counted(state)
    try:
        for number in numbers:
            mode, taken = state.mode.copy(), int(state.counts["steps"][0])
            driver.clear_log()
            wanted = number >= numbers.stop - keep
            driver.monitor(wanted)
            # energies and peaks are those of the cycle; a contact that lasts across its start is monitored from there on
            state.total[:] = state.peak[:] = 0.0
            driver.peak["largest_time"] = driver.time
            cause = reach(driver, (number + 1) * period, options.most_steps, since=driver.tried)
            state = driver.state
            if wanted:
                extremes.add(reached(driver))
            if cause:
                break
            log, begin = driver.log, number * period
            summarise(log, mode[:contacts], begin, period, impacts[done], fraction[done])
            highest = np.where(state.mode == 1, driver.peak["largest"][last], 0.0)
            guard = log["guard"].astype(np.int64)
            np.maximum.at(highest, guard, np.where(companion[guard] >= 0, log["whole"], log["largest"]))
            peak[done] = highest[:contacts]
            peak[done, oiled] = driver.peak["largest"][driver.rows(JOINT_FORCE)]
            gained[done] = accounts(driver.plan, state.total[None], log, np.array([math.inf]))[0]
            steps[done] = int(state.counts["steps"][0]) - taken
            end = driver.snapshot()
            done, events = done + 1, events + log.shape[0]
            if progress is not None:
                progress(driver.time)
    except KeyboardInterrupt:
        cause = "interrupted"
    seconds = clocks.perf_counter() - began
    ended = "complete" if done == cycles else ("interrupted" if cause == "interrupted" else "failed")
    if ended != "complete":
        cause = f"stopped in cycle {first + done} at t = {driver.time:.9g} s, {driver.time / period:.6g} periods: {cause}"
    after = counted(driver.state)
    return Cycles(
        plan=driver.plan,
        system=driver.system,
        first=first,
        samples=Samples(*(part[:done] for part in driver.samples)),
        impacts=impacts[:done],
        contact_fraction=fraction[:done],
        peak_force=peak[:done],
        work=gained[:done],
        steps=steps[:done],
        end=end,
        status=ended,
        cause=cause,
        statistics={
            "method": choice.method,
            "reason": choice.reason,
            **{name: after[name] - before[name] for name in after},
            "events": events,
            "seconds": seconds,
            "cycles_per_second": done / seconds if seconds > 0.0 else math.nan,
        },
        warnings=tuple(extremes.texts()),
    )


def summarise(
    log: np.ndarray, mode: np.ndarray, begin: float, period: float, impacts: np.ndarray, fraction: np.ndarray
) -> None:
    """Count the contacts that started in a cycle and add up the time in contact; `mode` is that at its start."""
    for j in range(mode.size):
        contacts = log[log["guard"] == j]
        time, rises = contacts["time"], contacts["mode"] == RISE
        impacts[j] = int(np.sum(rises))
        lasted = float(np.sum(time[~rises]) - np.sum(time[rises]))
        if mode[j] == 1:
            lasted -= begin
        if (contacts["mode"][-1] if contacts.size else mode[j]) == 1:
            lasted += begin + period
        fraction[j] = min(1.0, max(0.0, lasted / period))
