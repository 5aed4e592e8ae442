"""Largest Lyapunov exponent of a mechanism, by two independent methods for the same equations of motion."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
import xarray as xr

from scissordyn.analysis.lyapunov import exponent_from_growth
from scissordyn.casefile.configuration import write_configuration
from scissordyn.errors import InputError, whole_number
from scissordyn.kernel import Handle
from scissordyn.kinematics.closure import check_tables
from scissordyn.laws.damping.none import NoDamping
from scissordyn.laws.friction.none import NoFriction
from scissordyn.mechanics import functions
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.options import Options, StartKind
from scissordyn.periodic.stroboscope import make_consistent
from scissordyn.plan.plan import plan
from scissordyn.plan.system import make_system
from scissordyn.record.trajectory import Trajectory
from scissordyn.run.advance.driver import Driver, Snapshot
from scissordyn.run.stops import drive_period, stops
from scissordyn.run.trajectory import compute, make_driver
from scissordyn.units import checked


@checked
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
    atol: float | None = None,
    method: str = "auto",
    seed: int = 0,
    progress: Callable[[int, int], None] | None = None,
) -> xr.Dataset:
    """Compute the largest Lyapunov exponent from two trajectories whose distance is repeatedly rescaled.

    After each of the `intervals` of a cycle the distance d between the trajectories is measured and ln(d/d0) is recorded. The
    companion trajectory is then moved to the distance d0 in the same direction (Benettin et al. 1980, doi:10.1007/BF02128236)
    and projected onto the length constraints. For joints in contact in both trajectories, the differences of internal states
    and approach speeds are scaled by the same factor. A joint in contact in one trajectory only keeps the companion's values.
    The method is valid for any law.

    The distance is d^2 = ``|dx'|^2 + (2 pi/T)^2 |dx|^2`` in free coordinates, whose mass matrix is the identity. Internal
    states are not measured, since they follow the motion within microseconds.

    Parameters
    ----------
    mechanism : Mechanism
    cycles : int
        Number of whole periods.
    period : float, optional
        T [s]; by default the period of the drive.
    intervals : int
        Number of intervals of a cycle; the difference must stay small in each.
    skip : int
        Number of cycles at the start that are left out.
    distance : float
        d0, as a fraction of (2 pi/T) times the smallest clearance (of 1 kg^0.5 m if no joint has clearance).
    start : {"concentric", "in-contact", "static"}
    rtol, atol : float
        Tolerances as in `simulate`; errors in a step must be small compared with d0.
    method : str
    seed : int
        Seed of the direction of the first difference.
    progress : callable, optional
        Called after each cycle with the number of finished cycles and the total.

    Returns
    -------
    Dataset
        `exponent` [1/s], `standard_error` and `running` as from `analysis.lyapunov.exponent_from_growth`, and `log_growth` of
        every interval. Attributes: status, cause, and `apart`, the fraction of interval ends at which the trajectories have
        different contact modes.

    Raises
    ------
    InputError
        If an option cannot be used.
    """
    period = drive_period(mechanism) if period is None else period
    _check_counts(cycles=cycles, intervals=intervals)
    part, pulse, tables = period / intervals, 2.0 * math.pi / period, plan(mechanism)
    check_tables(tables, cycles * period)
    least = min((joint.clearance.clearance for joint in mechanism.contacts if joint.clearance), default=1.0)
    first, n, system = distance * least * pulse, tables.coordinates.free, make_system(tables)
    drivers = [make_driver(tables, Options(part, start, 2, rtol, atol, method))[0] for _ in range(2)]
    for driver in drivers:
        driver.monitor(False)
    reference = drivers[0].snapshot()
    difference = _first_tangent(system, reference.y, n, pulse, seed)
    companion = _place_companion(system, reference, reference, difference, first)
    drivers[1].restore(companion)
    growth: list[float] = []
    together, status, cause = 0, "complete", ""
    times = part * np.arange(1, cycles * intervals + 1)
    try:
        for pair in zip(*(stops(driver, times.tolist(), Options.most_steps) for driver in drivers), strict=True):
            if cause := pair[0].cause or pair[1].cause:
                status = "failed"
                break
            apart, same = _rescale(system, drivers, n, pulse, first)
            growth.append(math.log(apart / first))
            together += same
            if progress is not None and (pair[0].number + 1) % intervals == 0:
                progress((pair[0].number + 1) // intervals, cycles)
    except KeyboardInterrupt:
        status, cause = "interrupted", "interrupted"
    result = _make_result(mechanism, growth, part, skip * intervals, "two trajectories", status, cause)
    result.attrs |= {"apart": 1.0 - together / max(1, len(growth)), "period": period, "distance": distance}
    return result


@checked
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
    atol: float | None = None,
    method: str = "auto",
    seed: int = 0,
    progress: Callable[[int, int], None] | None = None,
) -> xr.Dataset:
    """Compute the largest Lyapunov exponent from a tangent vector along one trajectory.

    The variational equation u' = J(t) u is integrated by the implicit midpoint rule u <- (1 - hJ/2)^-1 (1 + hJ/2) u. J is the
    linearisation of the mechanics at the middle of each substep; the error is of second order in h. The contact force is
    continuous at delta = 0, and so is its derivative for every law stiffer than linear. u is therefore continuous at the start
    of a contact.

    Damping laws divide by the approach speed of the contact, which depends on the trajectory and not on the state. Friction
    states restart with each contact. The variational equation is not defined for these laws; use `separation_exponent`.

    Parameters
    ----------
    mechanism : Mechanism
        Mechanism whose clearance joints have no friction and damping "none".
    cycles, period, intervals, skip
        As in `separation_exponent`.
    substeps : int
        Number of substeps in an interval; each must be short compared with the oscillation of a contact.
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
    _check_continuous(mechanism)
    check_tables(plan(mechanism), cycles * period)
    pulse, part = 2.0 * math.pi / period, period / intervals
    # samples at the ends and the middles of all substeps
    rows = 2 * cycles * intervals * substeps + 1
    path = compute(plan(mechanism), Options(cycles * period, start, rows, rtol, atol, method), monitor=False)
    tangent = _first_tangent(path.system, path.samples.state[0], path.plan.coordinates.free, pulse, seed)
    growth = []
    for interval in range((path.samples.time.size - 1) // (2 * substeps)):
        tangent = _propagate_tangent(path, tangent, 2 * interval * substeps, substeps, part / substeps)
        length = _norm(tangent, path.plan.coordinates.free, pulse)
        growth.append(math.log(length))
        tangent /= length
        if progress is not None and (interval + 1) % intervals == 0:
            progress((interval + 1) // intervals, cycles)
    result = _make_result(mechanism, growth, part, skip * intervals, "variational", path.status, path.cause)
    result.attrs |= {"substeps": substeps, "period": period}
    return result


def _check_continuous(mechanism: Mechanism) -> None:
    """Raise `InputError` for laws, end stops or latches with which the variational equation is undefined or discontinuous."""
    for joint in mechanism.contacts:
        laws = joint.clearance
        if laws is not None and not (isinstance(laws.damping, NoDamping) and isinstance(laws.friction, NoFriction)):
            raise InputError(
                f"joint '{joint.name}' has damping '{laws.damping.name}' and friction '{laws.friction.name}'; the variational "
                "equation is not defined for them",
                "damping 'none' and friction 'none'",
                "separation_exponent(...)",
            )
    if any(part.declaration.gap is not None for part in mechanism.components) or mechanism.latches:
        raise InputError(
            "the variational equation is discontinuous at end stops and latches", "a mechanism without end stops or latches"
        )


def _propagate_tangent(path: Trajectory, tangent: np.ndarray, first: int, substeps: int, h: float) -> np.ndarray:
    """Integrate the variational equation over `substeps` of length h [s]; return the tangent at their end.

    The tangent starts at the sample `first` of the trajectory, which has a sample at the end and middle of each substep.
    """
    samples, live, address = path.samples, path.system.content.state, path.system.address
    slope, slope_t, answer = np.zeros(samples.state.shape[1]), np.zeros(samples.state.shape[1]), np.zeros(2)
    last = first + 2 * substeps
    for at in range(first + 1, last, 2):
        live.mode[:], live.memory[:], live.mass[:] = samples.mode[at], samples.memory[at], samples.mass[at]
        live.reference[:] = samples.reference[at]
        functions.accept(samples.time[at], samples.state[at], address, answer)
        functions.linearise(samples.time[at], samples.state[at], address, slope, slope_t)
        if functions.factorize(0.5 * h, address) >= 0:
            raise ArithmeticError(f"singular step matrix of the variational equation at t = {samples.time[at]:g} s")
        before = tangent.copy()
        functions.solve(tangent, address)
        tangent *= 4.0 / h
        tangent -= before
    return _project_tangent(path.system, samples.time[last], samples.state[last], tangent)


def _check_counts(**counts: int) -> None:
    for name, count in counts.items():
        whole_number(name, count)


def _rescale(system: Handle, drivers: Sequence[Driver], n: int, pulse: float, first: float) -> tuple[float, bool]:
    """Rescale the companion to the distance `first`; return its distance before, and whether both have the same contacts."""
    reference, companion = (driver.snapshot() for driver in drivers)
    difference = companion.y - reference.y
    apart = _norm(difference, n, pulse)
    drivers[1].restore(_place_companion(system, reference, companion, difference, first / apart))
    return apart, bool(np.array_equal(reference.mode, companion.mode))


def _norm(difference: np.ndarray, n: int, pulse: float) -> float:
    """Return the norm of a difference of states: speeds, and positions times the angular frequency `pulse`."""
    return float(np.sqrt(np.sum(difference[n : 2 * n] ** 2) + pulse**2 * np.sum(difference[:n] ** 2)))


def _first_tangent(system: Handle, state: np.ndarray, n: int, pulse: float, seed: int) -> np.ndarray:
    """Return a random tangent of unit norm that satisfies the constraints."""
    tangent = np.zeros(state.size)
    tangent[: 2 * n] = np.random.default_rng(seed).standard_normal(2 * n)
    tangent[:n] /= pulse
    tangent = _project_tangent(system, 0.0, state, tangent)
    length = _norm(tangent, n, pulse)
    # The error of the projection is about 1e-7; a direction of free motion has a norm of about 1.
    if not length > 1e-4:
        raise InputError(
            "Lyapunov exponent: the drives prescribe the whole motion of the mechanism",
            "a mechanism with a degree of freedom that no drive prescribes",
            "mechanism.with_clearance(...)",
        )
    return tangent / length


def _project_tangent(system: Handle, time: float, state: np.ndarray, tangent: np.ndarray) -> np.ndarray:
    """Project a tangent onto the length constraints, by the central difference of two projected states."""
    base, answer = state.copy(), np.zeros(2)
    functions.accept(time, base, system.address, answer)
    size = 1e-7 * max(1.0, float(np.max(np.abs(base)))) / float(np.max(np.abs(tangent)))
    ends = [base + size * tangent, base - size * tangent]
    for end in ends:
        functions.accept(time, end, system.address, answer)
    return np.asarray((ends[0] - ends[1]) / (2.0 * size))


def _place_companion(
    system: Handle, reference: Snapshot, companion: Snapshot, difference: np.ndarray, factor: float
) -> Snapshot:
    """Return the companion with its difference from the reference scaled by `factor`, projected onto the constraints."""
    model, contacts = system.content.model, system.content.parameters.contact.size
    full = reference.y + factor * difference
    both = (reference.mode == 1) & (companion.mode == 1)
    onset = {}  # approach speed and effective mass of each contact, constant from its onset to its release
    for name in ("memory", "mass"):
        first, second = reference.arrays[name], companion.arrays[name]
        onset[name] = np.where(both, first + factor * (second - first), second)
    for j in range(contacts):
        internal = slice(2 * model.n + int(model.state_start[j]), 2 * model.n + int(model.state_start[j + 1]))
        if not both[j]:
            full[internal] = companion.y[internal]
    put = make_consistent(system, companion.changed(y=full, **onset))
    clock = companion.arrays["clock"].copy()
    clock["longest"], clock["prepared"] = put.arrays["clock"]["longest"], 0
    return put.changed(clock=clock)


def _make_result(
    mechanism: Mechanism, growth: list[float], part: float, skip: int, algorithm: str, status: str, cause: str
) -> xr.Dataset:
    if len(growth) <= skip:
        if status == "interrupted":
            raise KeyboardInterrupt
        raise InputError(f"no interval left to average over: {cause or 'all are skipped'}", "a run longer than skip")
    counted = np.array(growth[skip:])
    result = exponent_from_growth(counted, part)
    result["log_growth"] = ("interval", counted, {"units": "1", "long_name": "logarithm of the growth in an interval"})
    result.attrs |= {
        "title": "scissordyn exponent",
        "algorithm": algorithm,
        "status": status,
        "cause": cause,
        "configuration": write_configuration(mechanism),
    }
    return result
