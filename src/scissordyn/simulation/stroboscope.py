"""The loop over cycles: from one period of a drive to the next, in plain arrays."""

from __future__ import annotations

import math
import time as clocks
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from scissordyn.errors import InputError
from scissordyn.integrate import advance as loop
from scissordyn.integrate.problem import Samples, Work, make_samples
from scissordyn.integrate.tableau import tableau
from scissordyn.jit import Handle
from scissordyn.mechanics.layout import Layout, lay_out
from scissordyn.mechanics.system import System, build_system
from scissordyn.model.drive import ConstantSpeed, Harmonic
from scissordyn.model.element import Actuator
from scissordyn.model.mechanism import Mechanism
from scissordyn.simulation.courses import check_tables, prescribed
from scissordyn.simulation.options import Options, StartKind
from scissordyn.simulation.slice import FIRST, next_slice
from scissordyn.simulation.start import prepare_start
from scissordyn.simulation.trajectory import automatic_method, broken_off, counts_of, mechanics_problem, work_arrays

__all__ = ["CycleState", "Cycles", "drive_period", "run_cycles", "start_state"]

SLICE = 20_000
"""Steps between two looks at the keyboard."""

PEAK = 3 + loop.RECORD
"""Column of the event log that holds the largest normal force of the contact that ended."""

QUADRATURES = 5
"""Work of the drives, losses to contact damping and friction, work of loads, losses to dampers."""


@dataclass(frozen=True)
class CycleState:
    """Where a periodic run stands between two cycles: all that the next one depends on.

    Parameters
    ----------
    cycle : int
        Cycles done; the time is that times the period.
    state : ndarray, shape (ny,)
        Free coordinates, their rates, hidden states of friction laws.
    mode : ndarray of int, shape (guards,)
        1 for a loose joint in contact, then for an end stop that is reached.
    approach : ndarray, shape (guards,)
        Approach speed of the present contact [m/s].
    force : ndarray, shape (guards,)
        Normal force at this instant [N].
    total : ndarray, shape (5,)
        Work of the drives, losses to contact damping and friction, work of loads, losses to dampers so far [J].
    stepping : ndarray, shape (8,)
        Step size to try, step sizes that worked after a rise and after a fall [s], the kind of the last event if the next
        step is the first after it, else -1, and what `Work` calls touching, trend and reach. Empty at a start.
    """

    cycle: int
    state: np.ndarray
    mode: np.ndarray
    approach: np.ndarray
    force: np.ndarray
    total: np.ndarray
    stepping: np.ndarray


@dataclass(frozen=True)
class Cycles:
    """What a periodic run leaves: one sample and one row of statistics per whole cycle.

    Parameters
    ----------
    layout : Layout
    system : Handle
        Of the mechanics' `System`.
    first : int
        Number of the first cycle; cycle k lasts from k to k + 1 periods.
    samples : Samples
        One row per cycle, at its start plus the phase.
    impacts : ndarray of int, shape (cycles, nj)
        Contacts that started.
    contact_share : ndarray, shape (cycles, nj)
        Share of the cycle spent in contact.
    peak_force : ndarray, shape (cycles, nj)
        Largest normal force [N].
    work : ndarray, shape (cycles, 5)
        What each of `CycleState.total` gained [J].
    steps : ndarray of int, shape (cycles,)
    end : CycleState
        After the last whole cycle.
    status : str
        "complete", "interrupted" or "failed".
    cause : str
        Why it is not complete.
    statistics : dict
        Method, steps, rejected, rates, jacobians, events, seconds of integration, cycles per second.
    """

    layout: Layout
    system: Handle
    first: int
    samples: Samples
    impacts: np.ndarray
    contact_share: np.ndarray
    peak_force: np.ndarray
    work: np.ndarray
    steps: np.ndarray
    end: CycleState
    status: str
    cause: str
    statistics: dict[str, str | int | float]


def drive_period(mechanism: Mechanism) -> float:
    """The period of a mechanism's only periodic drive.

    Parameters
    ----------
    mechanism : Mechanism

    Returns
    -------
    float
        2 pi / W of a harmonic drive, 2 pi / |w| of one at constant speed [s].

    Raises
    ------
    InputError
        If there is none, or if several differ.
    """
    # a drive that turns at constant speed repeats itself, a distance that grows does not
    turning = (drive.motion for drive in mechanism.drives if isinstance(drive.motion, ConstantSpeed))
    found = {2.0 * math.pi / abs(motion.speed) for motion in turning if motion.speed != 0.0}
    found |= {2.0 * math.pi / motion.frequency for _, motion in prescribed(mechanism) if isinstance(motion, Harmonic)}
    if len(found) != 1:
        raise InputError(
            f"{len(found) or 'no'} periods among the drives of the mechanism",
            "the period [s]",
            "period=0.25, or a harmonic drive",
        )
    return found.pop()


def start_state(mechanism: Mechanism, start: StartKind = "concentric") -> CycleState:
    """The state in which a mechanism starts.

    Parameters
    ----------
    mechanism : Mechanism
    start : {"concentric", "in-contact", "static"}

    Returns
    -------
    CycleState
    """
    layout = lay_out(mechanism)
    system = build_system(layout)
    return _from_start(layout, system, Options(1.0, start))


def _from_start(layout: Layout, system: System, options: Options) -> CycleState:
    state, _ = prepare_start(layout, system, options)
    nothing = np.zeros(system.mode.size)
    return CycleState(0, state, system.mode.copy(), system.approach.copy(), nothing, np.zeros(QUADRATURES), np.zeros(0))


def run_cycles(
    mechanism: Mechanism,
    options: Options,
    *,
    cycles: int,
    phase: float = 0.0,
    start: StartKind | CycleState = "concentric",
    progress: Callable[[float], None] | None = None,
) -> Cycles:
    """The cycles themselves, as plain arrays; `cycle` says what the parameters mean.

    Parameters
    ----------
    mechanism : Mechanism
    options : Options
        `until` is the period, `most_steps` the most for one cycle; `start` only where the method is to be chosen.
    cycles : int
    phase : float
    start : {"concentric", "in-contact", "static"} or CycleState
    progress : callable, optional

    Returns
    -------
    Cycles
    """
    if isinstance(cycles, bool) or not isinstance(cycles, int) or cycles < 1:
        raise InputError(f"cycles = {cycles!r}", "a whole number >= 1")
    if not 0.0 <= phase < 1.0:
        raise InputError(f"phase = {phase!r}", "a share of the period, at least 0 and below 1")
    if mechanism.latches:
        raise InputError("cycles of a mechanism with latches, which lock once and for all", "no latches, or simulate()")
    if any(isinstance(element, Actuator) and element.controller.delay > 0.0 for element in mechanism.elements):
        raise InputError("cycles of a mechanism with delayed feedback, whose past is not part of its state", "simulate()")
    period = options.until
    layout = lay_out(mechanism)
    system = build_system(layout)
    if isinstance(start, str):
        begin = _from_start(layout, system, replace(options, start=start))
    else:
        begin = start
        system.mode[:], system.approach[:] = begin.mode, begin.approach
    check_tables(mechanism, (begin.cycle + cycles) * period)
    method = options.method if options.method != "auto" else automatic_method(mechanism, options)
    coefficients = tableau(method)
    work = work_arrays(layout, system, begin.state, coefficients, options)
    clock = _resume(work, begin, period)
    handle = Handle(system)
    nj = len(mechanism.contacts)
    whole = make_samples((begin.cycle + np.arange(cycles) + phase) * period, work)
    impacts, steps = np.zeros((cycles, nj), np.int64), np.zeros(cycles, np.int64)
    share, peak, gained = np.zeros((cycles, nj)), np.zeros((cycles, nj)), np.zeros((cycles, QUADRATURES))
    log = np.zeros((256, loop.LOG_COLUMNS))
    counts = np.zeros(8, np.int64)
    done, status, cause, end, events, pace = 0, loop.ADVANCING, "", begin, 0, FIRST
    began = clocks.perf_counter()
    try:
        while done < cycles:
            count = np.zeros(8, np.int64)
            sample = Samples(*(part[done : done + 1] for part in whole))
            mode, total = system.mode.copy(), work.total.copy()
            clock[loop.END] = (begin.cycle + done + 1) * period
            # peaks are those of the cycle; a contact that lasts across its start is watched from there on
            work.peak[:] = 0.0
            work.peak[:, 1] = clock[loop.TIME]
            status = loop.ADVANCING
            while status == loop.ADVANCING:
                taken, called = count[loop.STEPS] + count[loop.REJECTED], clocks.perf_counter()
                slice_ = int(min(pace, options.most_steps - taken))
                if slice_ <= 0:
                    cause = f"{options.most_steps} steps did not suffice for a cycle"
                    break
                status = loop.advance(
                    mechanics_problem(), coefficients, handle.address, clock, count, work, sample, log, slice_
                )
                taken = count[loop.STEPS] + count[loop.REJECTED] - taken
                pace = next_slice(int(taken), clocks.perf_counter() - called, SLICE)
                if status == loop.LOG_FULL:
                    log = np.vstack([log, np.zeros_like(log)])
                    status = loop.ADVANCING
            counts += count
            if status != loop.FINISHED:
                break
            events = int(count[loop.EVENTS])
            _summarise(log[:events], mode[:nj], clock[loop.END] - period, period, impacts[done], share[done])
            highest = np.where(system.mode == 1, work.peak[:, 0], 0.0)
            np.maximum.at(highest, log[:events, 1].astype(np.int64), log[:events, PEAK])
            peak[done] = highest[:nj]
            gained[done], steps[done] = work.total - total, count[loop.STEPS]
            end = _freeze(work, system.mode, system.approach, clock, begin.cycle + done + 1)
            done += 1
            if progress is not None:
                progress(float(clock[loop.TIME]))
    except KeyboardInterrupt:
        cause = "interrupted"
    seconds = clocks.perf_counter() - began
    cause = cause or broken_off(status, layout, handle, work, float(clock[loop.TIME]))
    ended = "complete" if done == cycles else ("interrupted" if cause == "interrupted" else "failed")
    if ended != "complete":
        number = begin.cycle + done
        cause = f"stopped in cycle {number} at t = {clock[loop.TIME]:.9g} s, {clock[loop.TIME] / period:.6g} periods: {cause}"
    return Cycles(
        layout=layout,
        system=handle,
        first=begin.cycle,
        samples=Samples(*(part[:done] for part in whole)),
        impacts=impacts[:done],
        contact_share=share[:done],
        peak_force=peak[:done],
        work=gained[:done],
        steps=steps[:done],
        end=end,
        status=ended,
        cause=cause,
        statistics={
            "method": method,
            **counts_of(counts),
            "seconds": seconds,
            "cycles_per_second": done / seconds if seconds > 0.0 else math.nan,
        },
    )


def _resume(work: Work, begin: CycleState, period: float) -> np.ndarray:
    """The clock of a run that goes on from a state, whose step control and quadratures are put into `work`."""
    now = begin.cycle * period
    work.total[:] = begin.total
    work.watched[0, :, 0] = begin.force
    if not begin.stepping.size:
        return np.array([now, 1e-4 * period, now, period, period])
    step, after_rise, after_fall, first, touching, size, error, reach = begin.stepping.tolist()
    work.first[0], work.touching[0], work.reach[0] = int(first), int(touching), reach
    work.trend[:] = size, error
    return np.array([now, step, now, after_rise, after_fall])


def _freeze(work: Work, mode: np.ndarray, approach: np.ndarray, clock: np.ndarray, number: int) -> CycleState:
    step, after_rise, after_fall = clock[[loop.STEP, loop.AFTER_RISE, loop.AFTER_FALL]].tolist()
    return CycleState(
        cycle=number,
        state=work.y.copy(),
        mode=mode.copy(),
        approach=approach.copy(),
        force=np.where(mode == 1, work.watched[0, :, 0], 0.0),
        total=work.total.copy(),
        stepping=np.array([step, after_rise, after_fall, work.first[0], work.touching[0], *work.trend, work.reach[0]], float),
    )


def _summarise(log: np.ndarray, mode: np.ndarray, begin: float, period: float, impacts: np.ndarray, share: np.ndarray) -> None:
    """Count the contacts that started in a cycle and add up the time in contact; `mode` is that at its start."""
    for j in range(mode.size):
        own = log[log[:, 1] == j]
        time, rises = own[:, 0], own[:, 2] == 1.0
        impacts[j] = int(np.sum(rises))
        lasted = float(np.sum(time[~rises]) - np.sum(time[rises]))
        if mode[j] == 1:
            lasted -= begin
        if (own[-1, 2] if own.shape[0] else mode[j]) == 1:
            lasted += begin + period
        share[j] = min(1.0, max(0.0, lasted / period))
