"""Other codes on the slider-crank: scipy and numbalsoda on the equations derived by hand, Exudyn with bodies and a contact.

Each returns seconds and the eccentricities at the same instants, which are computed outside of the time that is measured.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from numba import njit
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicHermiteSpline

from validation.slider_crank.equations import (
    CLEARANCE,
    CRANK,
    JOURNAL,
    LOSS,
    ROD,
    ROD_INERTIA,
    ROD_MASS,
    SAMPLES,
    SLIDER_MASS,
    SPEED,
    STIFFNESS,
    TIMES,
    UNTIL,
    eccentricity,
    gap_rate,
    rates,
    start,
)

__all__ = ["Found", "exudyns", "numbalsodas", "numbalsodas_located", "scipys"]

Found = tuple[float, np.ndarray]
"""Seconds, and eccentricities (samples, 2)."""

AHEAD = 20
"""Samples that numbalsoda computes at a time: the fastest of 4, 10, 20, 40 and 200."""

ROUND_OFF = 1e-12
"""Gap, in clearances, at which a contact begins or ends."""


def orbit(states: np.ndarray) -> np.ndarray:
    """Eccentricities of states (samples, 4)."""
    return np.array([eccentricity(when, *state)[:2] for when, state in zip(TIMES, states, strict=True)])


def scipys(method: str, tolerance: float) -> Found:
    """Scipy on the compiled equations, from contact to contact; short steps, which it needs to find all contacts."""
    began = time.perf_counter()
    states, y = np.empty((SAMPLES, 4)), start()
    t, done, touching, approach = 0.0, 0, False, 1.0
    atol = tolerance * np.array([CLEARANCE, CLEARANCE, 100.0, 10.0])

    def slope(when: float, state: np.ndarray, *contact: float) -> np.ndarray:
        return np.array(rates(when, *state, *contact))

    def gap(when: float, state: np.ndarray, *_: float) -> float:
        return float(gap_rate(when, *state)[0])

    gap.terminal = True  # type: ignore[attr-defined]
    while t < UNTIL:
        gap.direction = -1.0 if touching else 1.0  # type: ignore[attr-defined]
        found = solve_ivp(
            slope,
            (t, UNTIL),
            y,
            method=method,
            t_eval=TIMES[done:],
            args=(touching, approach),
            events=gap,
            rtol=tolerance,
            atol=atol,
            max_step=UNTIL / 400.0,
        )
        if not found.success:
            raise RuntimeError(found.message)
        states[done : done + found.t.size] = found.y.T
        done += found.t.size
        if not found.t_events[0].size:
            break
        t, y = float(found.t_events[0][0]), found.y_events[0][0]
        touching = not touching
        if touching:
            approach = gap_rate(t, *y)[1]
    return time.perf_counter() - began, orbit(states)


@cache
def _remembering() -> Any:
    """The equations in the form of numbalsoda: without events, so the approach speed is stored."""
    from numba import carray, cfunc
    from numbalsoda import lsoda_sig

    @cfunc(lsoda_sig)
    def remembering(t, u, du, p):
        y, memory = carray(u, (4,)), carray(p, (2,))
        gap, rate = gap_rate(t, y[0], y[1], y[2], y[3])
        if gap <= 0.0:
            memory[0] = 0.0
        elif memory[0] == 0.0:
            memory[0], memory[1] = 1.0, max(rate, 1e-6)
        du[0], du[1], du[2], du[3] = rates(t, y[0], y[1], y[2], y[3], memory[0] == 1.0, memory[1])

    return remembering


def numbalsodas(tolerance: float) -> Found:
    """Numbalsoda's DOP853 as it is called at first: all samples at once, contacts found by the step control alone."""
    from numbalsoda import dop853

    equations = _remembering()
    began = time.perf_counter()
    states, success = dop853(
        equations.address, start(), TIMES, data=np.array([0.0, 1.0]), rtol=tolerance, atol=tolerance * 1e-3
    )
    seconds = time.perf_counter() - began
    if not success:
        raise RuntimeError("numbalsoda's dop853 failed")
    return seconds, orbit(states)


def _scales(unit: float) -> tuple[float, float, float, float]:
    """Units of the four unknowns: lengths in clearances, times in `unit` [s]."""
    return CLEARANCE / ROD, CLEARANCE, CLEARANCE / ROD / unit, CLEARANCE / unit


@cache
def _scaled(unit: float) -> Any:
    """The equations in scaled unknowns in the form of numbalsoda, told whether there is a contact and its approach speed."""
    from numba import carray, cfunc
    from numbalsoda import lsoda_sig

    of_angle, of_place, of_spin, of_speed = _scales(unit)

    @cfunc(lsoda_sig)
    def scaled(t, u, du, p):
        y, contact = carray(u, (4,)), carray(p, (2,))
        spin, speed, angular, linear = rates(
            t * unit, y[0] * of_angle, y[1] * of_place, y[2] * of_spin, y[3] * of_speed, contact[0] == 1.0, contact[1]
        )
        du[0], du[1] = spin * unit / of_angle, speed * unit / of_place
        du[2], du[3] = angular * unit / of_spin, linear * unit / of_speed

    return scaled


@cache
def _scaled_gap(unit: float) -> Any:
    """The compiled gap and its rate in scaled unknowns."""
    of_angle, of_place, of_spin, of_speed = _scales(unit)

    @njit
    def gap(t, y):
        found, rate = gap_rate(t * unit, y[0] * of_angle, y[1] * of_place, y[2] * of_spin, y[3] * of_speed)
        return found / CLEARANCE, rate * unit / CLEARANCE

    return gap


@cache
def _crossing(unit: float) -> Any:
    """A compiled search for the instant at which the gap changes its sign."""
    from numbalsoda import dop853

    address, gap = _scaled(unit).address, _scaled_gap(unit)

    @njit
    def crossing(t, y, end, beyond, side, contact, relative, absolute):
        """Newton's method between (t, y) and end; each value is an integration from the last state before the root."""
        low, high = t, end
        here, there = side * gap(t, y)[0], side * gap(end, beyond)[0]
        root = low + (high - low) * here / (here - there) if here > 1e-9 else 0.5 * (low + high)
        state, good = beyond, True
        for _ in range(60):
            ends, good = dop853(address, y.copy(), np.array([low, root]), contact, relative, absolute)
            state = ends[1].copy()
            value, rate = gap(root, state)
            if not good or abs(value) < ROUND_OFF or high - low < 1e-13 * high:
                break
            if side * value > 0.0:
                low, y = root, state
            else:
                high = root
            newton = root - value / rate
            root = newton if low < newton < high else 0.5 * (low + high)
        return root, state, good

    return crossing


@cache
def _locating(unit: float) -> Callable[..., tuple[np.ndarray, bool]]:
    """A compiled loop around numbalsoda's DOP853: it ends where the gap changes its sign and goes on from there.

    Lengths are in clearances and times in a unit near that of a contact, so that one absolute tolerance, all that numbalsoda
    has, is right for all unknowns.

    Parameters
    ----------
    unit : float
        Of time [s].
    """
    from numbalsoda import dop853

    address, gap, crossing, scales = _scaled(unit).address, _scaled_gap(unit), _crossing(unit), np.array(_scales(unit))

    @njit
    def march(times, y, relative, absolute):
        states = np.empty((times.size, 4))
        states[0] = y
        contact = np.array([0.0, 1.0])  # whether there is one, and its approach speed [m/s]
        t, done, good = times[0], 1, True
        while done < times.size and good:
            grid = np.empty(min(AHEAD, times.size - done) + 1)
            grid[0], grid[1:] = t, times[done : done + grid.size - 1]
            found, good = dop853(address, y.copy(), grid, contact, relative, absolute)
            side = 1.0 if contact[0] == 1.0 else -1.0
            k = 1
            while k < grid.size and side * gap(grid[k], found[k])[0] > 0.0:
                states[done] = found[k]
                done += 1
                k += 1
            if k == grid.size:
                t, y = grid[-1], found[-1].copy()
                continue
            last = found[k - 1].copy()
            t, y, good = crossing(grid[k - 1], last, grid[k], found[k].copy(), side, contact, relative, absolute)
            contact[0] = 1.0 - contact[0]
            contact[1] = max(gap(t, y)[1] * CLEARANCE / unit, 1e-6)
        for k in range(times.size):
            states[k] *= scales
        return states, good

    return march


def numbalsodas_located(tolerance: float, unit: float) -> Found:
    """Numbalsoda's DOP853 from contact to contact, with the loop around it that it lacks."""
    march = _locating(unit)
    began = time.perf_counter()
    states, success = march(TIMES / unit, start() / np.array(_scales(unit)), 1e-3 * tolerance, tolerance)
    seconds = time.perf_counter() - began
    if not success:
        raise RuntimeError("numbalsoda's dop853 failed")
    return seconds, orbit(states)


def exudyns(tolerance: float, longest: float = 1e-4, force_error: float = 10.0, fixed: bool = False) -> Found:
    """Exudyn: crank and rod as a kinematic tree, the pin as a sphere in a hollow sphere.

    The crank keeps its speed by an inertia of 1e10 kg m^2. Hunt and Crossley's 3/2 (1 - e) is Lankarani and Nikravesh's
    3/4 (1 - e^2) at another e. Places and velocities of all steps are stored and interpolated with cubics.

    Parameters
    ----------
    tolerance : float
        Relative; absolute in clearances.
    longest : float
        Longest step [s].
    force_error : float
        Error of a contact force beyond which a step is shortened to end where the contact begins [N].
    fixed : bool
        Whether all steps have that length, with RK44; DOPRI5 with step control otherwise.
    """
    import exudyn as exu
    from exudyn import itemInterface

    items = itemInterface

    mbs = exu.SystemContainer().AddSystem()
    journal, bearing = _mechanism(mbs)
    _pin(mbs, journal, bearing)
    sensors = [
        mbs.AddSensor(items.SensorMarker(markerNumber=marker, storeInternal=True, outputVariableType=kind))
        for kind in (exu.OutputVariableType.Position, exu.OutputVariableType.Velocity)
        for marker in (journal, bearing)
    ]
    mbs.Assemble()
    settings = exu.SimulationSettings()
    integration = settings.timeIntegration
    integration.endTime, integration.numberOfSteps = UNTIL, math.ceil(UNTIL / longest)
    integration.automaticStepSize = not fixed
    integration.absoluteTolerance = tolerance * CLEARANCE
    integration.relativeTolerance = tolerance
    integration.minimumStepSize = 1e-14
    integration.initialStepSize = 1e-7
    integration.discontinuous.useRecommendedStepSize = True
    integration.discontinuous.iterationTolerance = force_error
    integration.discontinuous.maxIterations = 5
    integration.verboseMode = 0
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = 0.0
    method = exu.DynamicSolverType.RK44 if fixed else exu.DynamicSolverType.DOPRI5
    began = time.perf_counter()
    mbs.SolveDynamic(settings, solverType=method, showHints=False, showCausingItems=False)
    seconds = time.perf_counter() - began
    first, second, first_rate, second_rate = (mbs.GetSensorStoredData(sensor) for sensor in sensors)
    kept = np.r_[True, np.diff(first[:, 0]) > 0.0]
    path = CubicHermiteSpline(first[kept, 0], (first - second)[kept, 1:3], (first_rate - second_rate)[kept, 1:3])
    return seconds, path(TIMES)


def _mechanism(mbs: Any) -> tuple[int, int]:
    """Crank, rod and slider; markers of journal and bearing."""
    import exudyn as exu
    from exudyn import itemInterface

    items = itemInterface

    mbs.AddObject(items.ObjectGround())
    tree = mbs.AddNode(
        items.NodeGenericODE2(
            referenceCoordinates=[0.0, 0.0],
            initialCoordinates=[0.0, 0.0],
            initialCoordinates_t=[SPEED, -CRANK * SPEED / ROD - SPEED],
            numberOfODE2Coordinates=2,
        )
    )
    offsets, centres = exu.Vector3DList(), exu.Vector3DList()
    inertias, rotations = exu.Matrix3DList(), exu.Matrix3DList()
    for offset, centre, inertia in ((0.0, 0.0, 1e10), (CRANK, 0.5 * ROD, ROD_INERTIA)):
        offsets.Append([offset, 0.0, 0.0])
        centres.Append([centre, 0.0, 0.0])
        inertias.Append(np.diag([1.0, 1.0, inertia]))
        rotations.Append(np.eye(3))
    links = mbs.AddObject(
        items.ObjectKinematicTree(
            nodeNumber=tree,
            jointTypes=[exu.JointType.RevoluteZ, exu.JointType.RevoluteZ],
            linkParents=[-1, 0],
            jointTransformations=rotations,
            jointOffsets=offsets,
            linkInertiasCOM=inertias,
            linkCOMs=centres,
            linkMasses=[1.0, ROD_MASS],
            gravity=[0.0, 0.0, 0.0],
        )
    )
    journal = mbs.AddMarker(items.MarkerKinematicTreeRigid(objectNumber=links, linkNumber=1, localPosition=[ROD, 0.0, 0.0]))
    place = mbs.AddNode(items.NodeRigidBody2D(referenceCoordinates=[CRANK + ROD, 0.0, 0.0]))
    slider = mbs.AddObject(items.ObjectRigidBody2D(mass=SLIDER_MASS, inertia=1.0, nodeNumber=place))
    bearing = mbs.AddMarker(items.MarkerBodyRigid(bodyNumber=slider))
    still = mbs.AddNode(items.NodePointGround())
    fixed = mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=still, coordinate=0))
    for coordinate in (1, 2):
        guide = mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=place, coordinate=coordinate))
        mbs.AddObject(items.CoordinateConstraint(markerNumbers=[fixed, guide]))
    return journal, bearing


def _pin(mbs: Any, journal: int, bearing: int) -> None:
    """The clearance joint."""
    from exudyn import itemInterface

    items = itemInterface

    data = mbs.AddNode(items.NodeGenericData(initialCoordinates=[CLEARANCE, 0.0, 0.0, 0.0], numberOfDataCoordinates=4))
    mbs.AddObject(
        items.ObjectContactSphereSphere(
            markerNumbers=[journal, bearing],
            nodeNumber=data,
            spheresRadii=[JOURNAL, JOURNAL + CLEARANCE],
            isHollowSphere1=True,
            contactStiffness=STIFFNESS,
            contactStiffnessExponent=1.5,
            restitutionCoefficient=1.0 - LOSS / 1.5,
            minimumImpactVelocity=1e-6,
            impactModel=1,
        )
    )
