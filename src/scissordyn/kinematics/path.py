"""Path of a mechanism with ideal joints: positions, singular positions, the inertia at its drive."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any

import numpy as np

from scissordyn.kinematics.closure import Closure
from scissordyn.kinematics.continuation import AtPlace, Meeting, extrapolated, meeting_between, walk
from scissordyn.kinematics.singular import (
    CHANGE_KIND,
    LOCKING_KIND,
    NEAR_KIND,
    SingularPosition,
    locate,
    measure,
    moving_parts,
    smallest,
    suspected_samples,
)
from scissordyn.mechanics.time_function import breaks_of
from scissordyn.numeral import finite_or_none
from scissordyn.plan.plan import Plan
from scissordyn.tolerance import DATA_TOL, REPORTED_FRACTION

INPUT_SAMPLES = 4001  # Number of instants at which the prescribed inputs are evaluated to find their range


@dataclass(frozen=True)
class Path:
    """Positions of the ideal mechanism along its stroke."""

    closure: Closure
    parameter: str  # Path parameter: the only input, or time with several inputs
    place: np.ndarray  # (points,) Values of the path parameter [rad, m or s], increasing
    z: np.ndarray  # (points, nZ) Natural coordinates
    singular: tuple[SingularPosition, ...]

    @cached_property
    def angle(self) -> np.ndarray:
        """Angles of all bodies, continuous along the path, shape (points, bodies) [rad]."""
        angles = np.empty((self.place.size, len(self.closure.plan.bodies)))
        for k, body in enumerate(self.closure.plan.bodies):
            p = self.closure.first[body.name]
            turns = self.closure.natural.rotates(body.name)
            angles[:, k] = np.unwrap(np.arctan2(self.z[:, p + 3], self.z[:, p + 2])) if turns else body.placed_angle
        return angles

    @cached_property
    def position(self) -> np.ndarray:
        """Mass centres, shape (points, bodies, axes) [m]."""
        positions = np.empty((self.place.size, len(self.closure.plan.bodies), 2))
        for (k, body), turn in zip(enumerate(self.closure.plan.bodies), self.angle.T, strict=True):
            p, (x, y) = self.closure.first[body.name], body.centre
            cos, sin = np.cos(turn), np.sin(turn)
            positions[:, k, 0] = self.closure.size * self.z[:, p] + cos * x - sin * y
            positions[:, k, 1] = self.closure.size * self.z[:, p + 1] + sin * x + cos * y
        return positions


def start_of(closure: Closure) -> np.ndarray | None:
    """Return the closed position at t = 0 and drop dependent constraints; None if the mechanism does not close."""
    inputs = closure.inputs.at(0.0)
    start = closure.close(closure.placed(), inputs, most_steps=50)
    if start is None:
        return None
    near = start
    # the start may be singular, for example folded flat: look for dependent constraints at a position nearby
    for shift in (0.03, -0.03):
        moved = closure.close(start, inputs + shift * np.where(np.array(closure.inputs.units) == "rad", 1.0, 0.1))
        if moved is not None:
            near = moved
            break
    closure.choose(near)
    return start


def path_of(plan: Plan, until: float, closure: Closure | None = None) -> Path | None:
    """Return the positions that a mechanism passes until a time [s] as a path; None if its inputs do not determine the motion.

    The path parameter is the value of the only input, or the time if there are several inputs.
    """
    closure = Closure(plan) if closure is None else closure
    inputs = closure.inputs
    start = start_of(closure)
    if start is None or not inputs.count or closure.mobility != 0:
        return None
    if inputs.count > 1:
        return follow(closure, "time", inputs.at, start, 0.0, 0.0, until)
    values = inputs.over(grid(closure.plan, until))[:, 0]
    first, low, high = float(values[0]), float(values.min()), float(values.max())
    turns = inputs.units[0] == "rad"
    if turns:
        most = 2.0 * math.pi * 2  # positions repeat after two revolutions: one on each branch
        low, high = max(low, first - most), min(high, first + most)
    kind = "angle" if turns else "length"
    return follow(closure, kind, lambda value: np.array([value]), start, first, low, high)


def grid(plan: Plan, until: float) -> np.ndarray:
    """Return the instants at which the range of the inputs is sampled [s]."""
    breaks = [t for _, motion in plan.motions for t in breaks_of(motion) if 0.0 < t < until]
    return np.unique(np.concatenate([np.linspace(0.0, until, INPUT_SAMPLES), breaks]))


def follow(closure: Closure, parameter: str, inputs: AtPlace, start: np.ndarray, first: float, low: float, high: float) -> Path:
    """Follow the positions of a mechanism from `start` (nZ,) on its path to both ends."""
    forth, back = (walk(closure, inputs, start, first, end) for end in (high, low))
    points = back.points[:0:-1] + forth.points
    place, z = np.array([s for s, _ in points]), np.array([position for _, position in points])
    ends = [back.end, forth.end]
    path = Path(closure, parameter, place, z, ())
    typical = _typical(path)
    met = _meetings(path, inputs, [*back.met, *forth.met], typical, ends)
    passed = []
    for point in met:
        # a near change point beyond a limit of the input is not on the path
        # clearances and tolerances let the real structure pass from a branch to one that it misses by little
        if not point.miss or (point.miss <= REPORTED_FRACTION and place[0] <= point.place <= place[-1]):
            kind = NEAR_KIND if point.miss else CHANGE_KIND
            at = float(np.clip(point.place, place[0], place[-1]))
            passed.append(SingularPosition(kind, at, *moving_parts(closure, point.z, typical), point.miss))
    for end, last in zip(ends, (z[0], z[-1]), strict=True):
        if end is not None:
            passed.append(SingularPosition(LOCKING_KIND, end, *moving_parts(closure, last, typical)))
    return Path(closure, parameter, place, z, tuple(sorted(passed, key=lambda position: position.place)))


def _typical(path: Path) -> float:
    """Return the median, along a path, of the smallest singular value of the gradients."""
    chosen = np.linspace(0, path.place.size - 1, min(path.place.size, 9)).astype(int)
    return max(float(np.median([smallest(path.closure, path.z[k]) for k in chosen])), 1e-6)


def _meetings(path: Path, inputs: AtPlace, traced: list[Meeting], typical: float, ends: list[float | None]) -> list[Meeting]:
    """Return the positions at which branches meet or nearly meet: the `traced` ones, and those found between samples."""
    closure, meetings = path.closure, list(traced)
    last, longest = path.place.size - 1, float(np.max(np.diff(path.place), initial=0.0))
    for k in suspected_samples(measure(closure, path.z)):
        low, high = float(path.place[max(0, k - 1)]), float(path.place[min(last, k + 1)])
        margin = DATA_TOL * (high - low)
        if any(low - margin <= other.place <= high + margin for other in meetings) or any(
            end is not None and low <= end <= high for end in ends
        ):
            continue
        here = float(path.place[k]), path.z[k]
        if k in (0, last) and smallest(closure, here[1]) < 1e-5 * typical:  # known to the root of round-off only
            meetings.append(Meeting(*here, 0.0))
            continue
        if not longest:  # the drives do not move
            continue
        aside = 0.1 * longest  # the nearest approach may be this far from the sample with the smallest measure
        low, high = min(low, here[0] - aside), max(high, here[0] + aside)
        meeting = meeting_between(closure, inputs, here, low, high, longest)
        meeting = _meeting_of_several(path, inputs, k, typical) if meeting is None else meeting
        if meeting is not None:
            meetings.append(meeting)
    return meetings


def _meeting_of_several(path: Path, inputs: AtPlace, k: int, typical: float) -> Meeting | None:
    """Return the change point near sample k of a path if the unfolding does not find it.

    That is so if several singular values are small there, or if one falls to zero quadratically. `typical` is the usual
    smallest singular value of the path.
    """
    closure, last = path.closure, path.place.size - 1
    chosen = range(max(0, k - 2), min(last, k + 2) + 1)
    points = [(float(path.place[i]), path.z[i]) for i in chosen]

    def position(place: float) -> np.ndarray:
        guess = extrapolated(points, place)
        closed = closure.close(guess, inputs(place))
        # Newton's method may fail at the change point itself; interpolated positions are good to 1e-7
        return guess if closed is None else closed

    low, middle, high = (float(path.place[i]) for i in (max(0, k - 1), k, min(last, k + 1)))
    place = locate(closure, position, (low, middle, high), typical)
    return None if place is None else Meeting(place, position(place), 0.0)


def instants(path: Path, until: float, place: float) -> list[float]:
    """Return the instants at which the drives pass a point of the path [s]."""
    if path.parameter == "time":
        return [place]
    from scipy.optimize import brentq  # imported here: it takes a tenth of a second, and most runs do not need it

    inputs = path.closure.inputs
    times = grid(path.closure.plan, until)
    error = inputs.over(times)[:, 0] - place
    close = 1e-9 * max(1.0, abs(place))
    there = np.abs(error) <= close
    passed = (error[:-1] * error[1:] < 0.0) & ~there[:-1] & ~there[1:]
    moments = []
    for k in np.flatnonzero(there[:-1] | passed).tolist():
        if there[k]:
            moments.append(float(times[k]))
        else:
            moments.append(float(brentq(lambda t: inputs.at(t)[0] - place, times[k], times[k + 1], xtol=1e-15)))
    if there[-1]:
        moments.append(float(times[-1]))
    return moments


@dataclass(frozen=True)
class DriveInertia:
    """Inertia that the drive of a body has to accelerate."""

    drive: str  # The driven body
    start: float  # Inertia at the start of the motion [kg m^2]
    end: float  # Inertia at the end [kg m^2]; infinite if the drive meets a locking position
    largest: float  # Largest inertia of the motion [kg m^2]
    locked: float | None = None  # Angle of the drive at its first locking position [rad], if it meets one

    def plain(self) -> dict[str, Any]:
        """Return the fields by name, for a JSON text; None if an inertia is infinite or not determined."""
        return {name: finite_or_none(value) for name, value in asdict(self).items()}

    def __str__(self) -> str:
        start, end, largest = (
            f"{value:.4g} kg m^2" if math.isfinite(value) else "not determined"
            for value in (self.start, self.end, self.largest)
        )
        if self.locked is not None:
            return f"{start} at the start, without bound towards the locking position at {math.degrees(self.locked):.6g} deg"
        return f"{start} at the start, {end} at the end, at most {largest}"


def drive_inertia(path: Path) -> np.ndarray:
    """Return the inertia of a mechanism with ideal joints about its only drive, at each point of a path.

    A servo has to accelerate this inertia J. With the feedback gains ``k_p = J w**2`` and ``k_d = 2 z J w`` the error of its
    angle decays with the natural frequency w and the damping ratio z.

    Shapes: returns (points,) [kg m^2].

    References
    ----------
    Astrom and Hagglund 1995, PID Controllers, ISBN 1-55617-516-7
    """
    mass = path.closure.plan.coordinates.mass
    inertia = np.full(path.place.size, np.nan)
    for k in range(path.place.size):
        rate = drive_rate(path, k)
        inertia[k] = rate @ (mass @ rate)
    return inertia


def drive_rate(path: Path, k: int) -> np.ndarray:
    """Return the derivative (nZ,) of the natural coordinates by the only drive at a point of a path [m]."""
    closure, z, place = path.closure, path.z[k], path.place[k]
    inputs = np.array([place])
    turned = np.array([0.0, -np.sin(place), np.cos(place)]) if closure.inputs.bodies else np.zeros(1)
    driven = closure.prescribed @ turned
    wanted = np.zeros(closure.chosen.size)
    if not closure.inputs.bodies:
        step = 1e-6 * (place or 1.0)  # values are linear or quadratic: a central difference is exact
        wanted = (closure.right_sides(inputs + step) - closure.right_sides(inputs - step)) / (2.0 * step)
    try:
        free = np.linalg.solve(closure.jacobian(z), wanted - closure.derivative(z, driven))
    except np.linalg.LinAlgError:
        return np.full(closure.natural.total, np.nan)
    rate = driven + closure.free @ free
    rate[closure.origins] *= closure.size
    return np.asarray(rate[: closure.natural.total])


def has_kink(values: np.ndarray, k: int) -> bool:
    """Report whether a curve jumps or has a kink near sample `k`, so that no parabola describes it there.

    The curvature at a sample beside it then differs by over three quarters. Curves with five samples per period or more have
    none.

    Shapes: `values` (nt,) or (nt, components); fewer than five samples do not show a kink.
    """
    if len(values) < 5:
        return False
    middle = min(max(k, 2), len(values) - 3)
    before, here, after = np.diff(values[middle - 2 : middle + 3], 2, axis=0)
    change = max(np.linalg.norm(before - here), np.linalg.norm(after - here))
    return bool(change > 0.75 * np.linalg.norm(here))


def smooth_peak(time: np.ndarray, values: np.ndarray) -> tuple[float, float]:
    """Return value and time of the vertex of the parabola through the largest sample and its two neighbours.

    Use it for a curve without impacts, such as a reaction of the ideal mechanism. Peaks of impacts are located by the
    integrator. With 500 samples per period the error is below 1e-7 of the value. At a kink it is the largest sample.

    Shapes: `time` (nt,) [s], `values` (nt,).
    """
    if not np.isfinite(values).any():
        return math.nan, math.nan
    k = int(np.nanargmax(values))
    if not 0 < k < values.size - 1 or not np.isfinite(values[k - 1 : k + 2]).all():
        return float(values[k]), float(time[k])
    before, here, after = values[k - 1 : k + 2].tolist()
    bend = before - 2.0 * here + after
    if not bend < 0.0 or has_kink(values, k):
        return here, float(time[k])
    shift = 0.5 * (before - after) / bend
    return here - 0.25 * (before - after) * shift, float(time[k] + shift * (time[k + 1] - time[k]))
