"""Largest Lyapunov exponent of a mechanism, by two roads that share nothing but the equations of motion."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable

import numpy as np
import xarray as xr

from scissordyn.analysis.lyapunov import exponent_from_growth
from scissordyn.errors import InputError
from scissordyn.jit import Handle
from scissordyn.laws.damping.none import NoDamping
from scissordyn.laws.friction.none import NoFriction
from scissordyn.mechanics import functions
from scissordyn.mechanics.layout import lay_out
from scissordyn.mechanics.system import build_system
from scissordyn.model.element import AngleStop, TravelStop
from scissordyn.model.mechanism import Mechanism
from scissordyn.simulation.configuration import write_configuration
from scissordyn.simulation.options import Options, StartKind
from scissordyn.simulation.stroboscope import CycleState, drive_period, run_cycles, start_state
from scissordyn.simulation.trajectory import compute
from scissordyn.study.follow import consistent

__all__ = ["separation_exponent", "variational_exponent"]

NUDGE = 1e-7
"""Length of the difference by which a tangent is projected onto the length conditions, as a fraction of the state."""


def separation_exponent(
    mechanism: Mechanism,
    *,
    cycles: int,
    period: float | None = None,
    intervals: int = 16,
    skip: int = 0,
    distance: float = 1e-5,
    start: StartKind = "concentric",
    rtol: float = 1e-10,
    atol: float = 1e-10,
    method: str = "auto",
    seed: int = 0,
    progress: Callable[[int, int], None] | None = None,
) -> xr.Dataset:
    """Largest Lyapunov exponent from two trajectories, brought together again and again.

    After each of the `intervals` of a cycle the distance d between the trajectories is measured, ln(d/d0) noted, and the
    companion put back to the distance d0 in the same direction (Benettin et al. 1980, doi:10.1007/BF02128236). It is put
    onto the length conditions; hidden states and approach speeds of joints that touch in both are brought together by the same
    factor, and a joint in which only one touches keeps the companion's own. So it holds for any law. Distance:
    d^2 = |dx'|^2 + (2 pi/T)^2 |dx|^2 in free coordinates, whose mass matrix is the identity; hidden states are carried but
    not measured, since they relax to the motion within microseconds.

    Parameters
    ----------
    mechanism : Mechanism
    cycles : int
        Whole periods.
    period : float, optional
        T [s]; that of the drive if not given.
    intervals : int
        Into which a cycle is divided: the difference must stay small in each.
    skip : int
        First cycles that do not count.
    distance : float
        d0, as a fraction of (2 pi/T) times the smallest clearance (of 1 kg^0.5 m if no joint is loose).
    start : {"concentric", "in-contact", "static"}
    rtol, atol : float
        Errors in a step must be small against d0.
    method : str
    seed : int
        Of the direction of the first difference.
    progress : callable, optional
        Called after each cycle with how many are done and how many there are.

    Returns
    -------
    Dataset
        `exponent` [1/s], `standard_error` and `running` as from `analysis.lyapunov.exponent_from_growth`, and `log_growth` of
        every interval. Attributes: status, cause, and `apart`, the share of interval ends at which one trajectory touched
        where the other did not.

    Raises
    ------
    InputError
        For an option that cannot be used.
    """
    period = drive_period(mechanism) if period is None else period
    _check_counts(cycles=cycles, intervals=intervals)
    pulse, part = 2.0 * math.pi / period, period / intervals
    options = Options(part, start, 2, rtol, atol, method)
    layout = lay_out(mechanism)
    n, system = layout.free, build_system(layout)
    handle = Handle(system)
    least = min((joint.clearance.clearance for joint in mechanism.contacts if joint.clearance), default=1.0)
    d0 = distance * pulse * least
    reference = start_state(mechanism, start)
    difference = _first_tangent(handle, reference.state, n, pulse, seed)
    companion = _companion(handle, reference, reference, difference, d0, part)
    growth, together, status, cause = [], 0, "complete", ""
    for interval in range(cycles * intervals):
        runs = [run_cycles(mechanism, options, cycles=1, start=state) for state in (reference, companion)]
        broken = next((run for run in runs if run.status != "complete"), None)
        if broken is not None:
            status, cause = broken.status, broken.cause
            break
        reference, companion = runs[0].end, runs[1].end
        difference = companion.state - reference.state
        apart = _length(difference, n, pulse)
        growth.append(math.log(apart / d0))
        together += int(np.array_equal(reference.mode, companion.mode))
        companion = _companion(handle, reference, companion, difference, d0 / apart, part)
        if progress is not None and (interval + 1) % intervals == 0:
            progress((interval + 1) // intervals, cycles)
    result = _concluded(mechanism, growth, part, skip * intervals, "two trajectories", status, cause)
    result.attrs |= {"apart": 1.0 - together / max(1, len(growth)), "period": period, "distance": distance}
    return result


def variational_exponent(
    mechanism: Mechanism,
    *,
    cycles: int,
    period: float | None = None,
    intervals: int = 16,
    skip: int = 0,
    substeps: int = 1500,
    start: StartKind = "concentric",
    rtol: float = 1e-10,
    atol: float = 1e-10,
    method: str = "auto",
    seed: int = 0,
    progress: Callable[[int, int], None] | None = None,
) -> xr.Dataset:
    """Largest Lyapunov exponent from a tangent vector carried along one trajectory.

    The variational equation u' = J(t) u is integrated by the implicit midpoint rule u <- (1 - hJ/2)^-1 (1 + hJ/2) u, with J the
    mechanics' own linearisation at the middle of each substep; its error falls with h^2. The contact force is continuous at
    delta = 0, and so is its derivative for every law stiffer than linear, so that u does not jump when a joint touches. The
    damping laws divide by the approach speed of the contact, a number that depends on the trajectory and not on the state,
    and friction starts anew with each contact: for these there is no such equation, and `separation_exponent` has to do.

    Parameters
    ----------
    mechanism : Mechanism
        Loose joints without friction and with damping "none".
    cycles, period, intervals, skip
        As in `separation_exponent`.
    substeps : int
        In an interval; each must be short against the oscillation of a contact.
    start, rtol, atol, method, seed, progress
        As in `separation_exponent`; the same seed gives the same first tangent.

    Returns
    -------
    Dataset
        As from `separation_exponent`.

    Raises
    ------
    InputError
        If a joint has friction or damping.
    """
    period = drive_period(mechanism) if period is None else period
    _check_counts(cycles=cycles, intervals=intervals, substeps=substeps)
    for joint in mechanism.contacts:
        laws = joint.clearance
        if laws is not None and not (isinstance(laws.damping, NoDamping) and isinstance(laws.friction, NoFriction)):
            raise InputError(
                f"joint '{joint.name}' with damping '{laws.damping.name}' and friction '{laws.friction.name}', for which the "
                "variational equation is not defined",
                "damping 'none' and friction 'none'",
                "separation_exponent(...)",
            )
    if any(isinstance(element, AngleStop | TravelStop) for element in mechanism.elements) or mechanism.latches:
        raise InputError(
            "the variational equation of a mechanism with end stops or latches, at which it jumps", "a mechanism without"
        )
    pulse, part = 2.0 * math.pi / period, period / intervals
    # samples at the ends and the middles of all substeps
    rows = 2 * cycles * intervals * substeps + 1
    path = compute(mechanism, Options(cycles * period, start, rows, rtol, atol, method))
    samples, n = path.samples, path.layout.free
    content, address = path.system.content, path.system.address
    h = part / substeps
    slope, slope_t = np.zeros(samples.state.shape[1]), np.zeros(samples.state.shape[1])
    tangent = _first_tangent(path.system, samples.state[0], n, pulse, seed)
    growth = []
    whole = (samples.time.size - 1) // (2 * substeps)
    for interval in range(whole):
        for at in range(2 * interval * substeps + 1, 2 * (interval + 1) * substeps, 2):
            content.mode[:], content.approach[:] = samples.mode[at], samples.memory[at]
            functions.project(samples.time[at], samples.state[at], address)
            functions.linearise(samples.time[at], samples.state[at], address, slope, slope_t)
            if functions.factorize(0.5 * h, address) >= 0:
                raise ArithmeticError(f"singular step matrix of the variational equation at t = {samples.time[at]:g} s")
            before = tangent.copy()
            functions.solve(tangent, address)
            tangent *= 4.0 / h
            tangent -= before
        end = 2 * (interval + 1) * substeps
        tangent = _on_conditions(path.system, samples.time[end], samples.state[end], tangent)
        length = _length(tangent, n, pulse)
        growth.append(math.log(length))
        tangent /= length
        if progress is not None and (interval + 1) % intervals == 0:
            progress((interval + 1) // intervals, cycles)
    result = _concluded(mechanism, growth, part, skip * intervals, "variational", path.status, path.cause)
    result.attrs |= {"substeps": substeps, "period": period}
    return result


def _check_counts(**counts: int) -> None:
    for name, count in counts.items():
        if isinstance(count, bool) or not isinstance(count, int) or count < 1:
            raise InputError(f"{name} = {count!r}", "a whole number >= 1")


def _length(difference: np.ndarray, n: int, pulse: float) -> float:
    """Size of a difference of states: that of its speeds, positions counting as much as in a vibration at `pulse`."""
    return float(np.sqrt(np.sum(difference[n : 2 * n] ** 2) + pulse**2 * np.sum(difference[:n] ** 2)))


def _first_tangent(system: Handle, state: np.ndarray, n: int, pulse: float, seed: int) -> np.ndarray:
    """A direction of unit length in which the mechanism can move."""
    tangent = np.zeros(state.size)
    tangent[: 2 * n] = np.random.default_rng(seed).standard_normal(2 * n)
    tangent[:n] /= pulse
    tangent = _on_conditions(system, 0.0, state, tangent)
    return tangent / _length(tangent, n, pulse)


def _on_conditions(system: Handle, time: float, state: np.ndarray, tangent: np.ndarray) -> np.ndarray:
    """The part of a tangent that keeps the lengths, to first order: the difference between two projected states."""
    base = state.copy()
    functions.project(time, base, system.address)
    size = NUDGE * max(1.0, float(np.max(np.abs(base)))) / float(np.max(np.abs(tangent)))
    ends = [base + size * tangent, base - size * tangent]
    for end in ends:
        functions.project(time, end, system.address)
    return np.asarray((ends[0] - ends[1]) / (2.0 * size))


def _companion(
    system: Handle, reference: CycleState, companion: CycleState, difference: np.ndarray, factor: float, part: float
) -> CycleState:
    """The companion at `factor` times its difference from the reference, consistent again."""
    content = system.content
    full = reference.state + factor * difference
    both = (reference.mode == 1) & (companion.mode == 1)
    content.mode[:] = companion.mode
    content.approach[:] = np.where(
        both, reference.approach + factor * (companion.approach - reference.approach), companion.approach
    )
    for j in range(content.radius.shape[0]):
        hidden = slice(2 * content.n + int(content.state_start[j]), 2 * content.n + int(content.state_start[j + 1]))
        if not both[j]:
            full[hidden] = companion.state[hidden]
    put = consistent(system, full, cycle=reference.cycle, period=part)
    return dataclasses.replace(put, force=companion.force, total=companion.total, stepping=companion.stepping)


def _concluded(
    mechanism: Mechanism, growth: list[float], part: float, skip: int, road: str, status: str, cause: str
) -> xr.Dataset:
    if len(growth) <= skip:
        raise InputError(f"no interval left to average over: {cause or 'all are skipped'}", "a run longer than skip")
    counted = np.array(growth[skip:])
    result = exponent_from_growth(counted, part)
    result["log_growth"] = ("interval", counted, {"units": "1", "long_name": "logarithm of the growth in an interval"})
    result.attrs |= {
        "title": "scissordyn exponent",
        "road": road,
        "status": status,
        "cause": cause,
        "configuration": write_configuration(mechanism),
    }
    return result
