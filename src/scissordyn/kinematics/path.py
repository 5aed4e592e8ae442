"""A mechanism with ideal joints along its stroke: positions, singular positions, the inertia that a drive feels."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from scissordyn.kinematics.closure import Closure
from scissordyn.kinematics.continuation import MARGIN, AtPlace, Meeting, extrapolated, meeting_between, walk
from scissordyn.kinematics.singular import (
    CHANGE,
    LOCKING,
    NEAR,
    SingularPosition,
    concerned,
    locate,
    measure,
    smallest,
    suspects,
)
from scissordyn.mechanics.time_function import breaks_of
from scissordyn.plan.plan import Plan

MOST_TURNS = 2  # Revolutions of a drive after which positions are taken to repeat: one on each branch
GRID = 4001  # Instants at which inputs are looked at for their range

ON_END = 1e-5
"""A singular position at an end of the stroke: fraction of the typical smallest singular value; positions there are
known to the root of round-off only."""


ASIDE = 0.1  # Of the longest step: so far from the sample with the least measure branches may be nearest to each other

NEARLY = 1e-3
"""Branches that miss each other by less, in lengths as a fraction of the size, are reported: clearances and tolerances let the
real structure pass from one to the other."""


@dataclass(frozen=True)
class Path:
    """Positions of the ideal mechanism along its stroke."""

    closure: Closure
    parameter: str  # What the path is a function of: the only input, or time with several
    place: np.ndarray  # (points,) Its values [rad, m or s], increasing
    z: np.ndarray  # (points, nZ) Natural coordinates
    singular: tuple[SingularPosition, ...]

    @property
    def angle(self) -> np.ndarray:
        """Angles of all bodies, continuous along the path, shape (points, bodies) [rad]."""
        angles = np.empty((self.place.size, len(self.closure.plan.bodies)))
        for k, body in enumerate(self.closure.plan.bodies):
            p = self.closure.first[body.name]
            turns = self.closure.natural.rotates(body.name)
            angles[:, k] = np.unwrap(np.arctan2(self.z[:, p + 3], self.z[:, p + 2])) if turns else body.placed_angle
        return angles

    @property
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
    """The closed position at t = 0, with the constraints chosen that are independent; None if there is none."""
    inputs = closure.inputs.at(0.0)
    start = closure.close(closure.placed(), inputs, most_steps=50)
    if start is None:
        return None
    near = start
    # where only the start is special, such as folded flat, nothing may be left out: ask a little further on
    for shift in (0.03, -0.03):
        moved = closure.close(start, inputs + shift * np.where(np.array(closure.inputs.units) == "rad", 1.0, 0.1))
        if moved is not None:
            near = moved
            break
    closure.choose(near)
    return start


def path_of(plan: Plan, until: float, closure: Closure | None = None) -> Path | None:
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
        most = 2.0 * math.pi * MOST_TURNS
        low, high = max(low, first - most), min(high, first + most)
    kind = "angle" if turns else "length"
    return follow(closure, kind, lambda value: np.array([value]), start, first, low, high)


def grid(plan: Plan, until: float) -> np.ndarray:
    """Instants at which the inputs are looked at."""
    breaks = [t for _, motion in plan.motions for t in breaks_of(motion) if 0.0 < t < until]
    return np.unique(np.concatenate([np.linspace(0.0, until, GRID), breaks]))


def follow(
    closure: Closure,
    parameter: str,
    inputs: AtPlace,
    start: np.ndarray,
    first: float,
    low: float,
    high: float,
) -> Path:
    """Follow the positions of a mechanism from a place on its path to both ends.

    Shapes: `start` (nZ,).
    """
    forth, back = (walk(closure, inputs, start, first, end) for end in (high, low))
    points = back.points[:0:-1] + forth.points
    place, z = np.array([s for s, _ in points]), np.array([position for _, position in points])
    ends = [back.end, forth.end]
    path = Path(closure, parameter, place, z, ())
    typical = _typical(path)
    met = _met(path, inputs, [*back.met, *forth.met], typical, ends)
    passed = []
    for point in met:
        if not point.miss or (point.miss <= NEARLY and place[0] <= point.place <= place[-1]):  # not what lies beyond a limit
            kind = NEAR if point.miss else CHANGE
            at = float(np.clip(point.place, place[0], place[-1]))
            passed.append(SingularPosition(kind, at, *concerned(closure, point.z, typical), point.miss))
    for end, last in zip(ends, (z[0], z[-1]), strict=True):
        if end is not None:
            passed.append(SingularPosition(LOCKING, end, *concerned(closure, last, typical)))
    return Path(closure, parameter, place, z, tuple(sorted(passed, key=lambda each: each.place)))


def _typical(path: Path) -> float:
    """The smallest singular value at a position that is nothing special."""
    chosen = np.linspace(0, path.place.size - 1, min(path.place.size, 9)).astype(int)
    return max(float(np.median([smallest(path.closure, path.z[k]) for k in chosen])), 1e-6)


def _met(path: Path, inputs: AtPlace, known: list[Meeting], typical: float, ends: list[float | None]) -> list[Meeting]:
    """Where branches of the assembly meet or nearly meet on a path: known from its legs, or between samples."""
    closure, meetings = path.closure, list(known)
    last, longest = path.place.size - 1, float(np.max(np.diff(path.place), initial=0.0))
    for k in suspects(measure(closure, path.z)):
        low, high = float(path.place[max(0, k - 1)]), float(path.place[min(last, k + 1)])
        margin = MARGIN * (high - low)
        if any(low - margin <= other.place <= high + margin for other in meetings) or any(
            end is not None and low <= end <= high for end in ends
        ):
            continue
        here = float(path.place[k]), path.z[k]
        if k in (0, last) and smallest(closure, here[1]) < ON_END * typical:
            meetings.append(Meeting(*here, 0.0))
            continue
        if not longest:  # the drives stand still
            continue
        low, high = min(low, here[0] - ASIDE * longest), max(high, here[0] + ASIDE * longest)
        meeting = meeting_between(closure, inputs, here, low, high, longest)
        meeting = _together(path, inputs, k, typical) if meeting is None else meeting
        if meeting is not None:
            meetings.append(meeting)
    return meetings


def _together(path: Path, inputs: AtPlace, k: int, typical: float) -> Meeting | None:
    """Where branches meet next to a sample with several small singular values, or one that falls to zero with its square."""
    closure, last = path.closure, path.place.size - 1
    chosen = range(max(0, k - 2), min(last, k + 2) + 1)
    points = [(float(path.place[i]), path.z[i]) for i in chosen]

    def position(place: float) -> np.ndarray:
        guess = extrapolated(points, place)
        closed = closure.close(guess, inputs(place))
        # Newton's method may not converge at the change point itself; interpolated positions are good to 1e-7
        return guess if closed is None else closed

    low, middle, high = (float(path.place[i]) for i in (max(0, k - 1), k, min(last, k + 1)))
    place = locate(closure, position, (low, middle, high), typical)
    return None if place is None else Meeting(place, position(place), 0.0)


def instants(path: Path, until: float, place: float) -> list[float]:
    """The instants at which the drives pass a place on the path [s]."""
    if path.parameter == "time":
        return [place]
    from scipy.optimize import brentq  # a tenth of a second that most runs need not wait for

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
    """What the drive of a body has to accelerate."""

    drive: str  # The driven body
    start: float  # At both ends of its motion, and the largest on the way [kg m^2]
    end: float
    largest: float

    def plain(self) -> dict[str, Any]:
        """Its numbers."""
        return asdict(self)

    def __str__(self) -> str:
        start, end, largest = (f"{value:.4g} kg m^2" for value in (self.start, self.end, self.largest))
        return f"{start} at the start, {end} at the end, at most {largest}"


def drive_inertia(path: Path) -> np.ndarray:
    """Inertia of a mechanism with ideal joints about its only drive, at each point of a path.

    It is what a servo has to accelerate: with the feedback gains ``k_p = J w**2`` and ``k_d = 2 z J w`` the error of its angle
    decays with the natural frequency w and the damping ratio z.

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
    """Derivative of the natural coordinates by the only drive at a point of a path.

    Shapes: returns (nZ,) [m].
    """
    closure, z, place = path.closure, path.z[k], path.place[k]
    inputs = np.array([place])
    turned = np.array([0.0, -np.sin(place), np.cos(place)]) if closure.inputs.bodies else np.zeros(1)
    driven = closure.prescribed @ turned
    wanted = np.zeros(closure.chosen.size)
    if not closure.inputs.bodies:
        step = 1e-6 * (place or 1.0)  # the values are linear or quadratic: a central difference has no error
        wanted = (closure.values_at(inputs + step) - closure.values_at(inputs - step)) / (2.0 * step)
    try:
        free = np.linalg.solve(closure.jacobian(z), wanted - closure.product(z, driven))
    except np.linalg.LinAlgError:
        return np.full(closure.natural.total, np.nan)
    rate = driven + closure.free @ free
    rate[closure.origins] *= closure.size
    return np.asarray(rate[: closure.natural.total])


def smooth_peak(time: np.ndarray, values: np.ndarray) -> tuple[float, float]:
    """The vertex of the parabola through the largest sample and its two neighbours.

    Of a curve without impacts, such as a reaction of the ideal mechanism; what impacts make peaks of is located by the
    integrator. With 500 samples a period the error is below 1e-7 of the value.

    Shapes: `time` (nt,) [s], `values` (nt,).
    """
    if not np.isfinite(values).any():
        return math.nan, math.nan
    k = int(np.nanargmax(values))
    if not 0 < k < values.size - 1 or not np.isfinite(values[k - 1 : k + 2]).all():
        return float(values[k]), float(time[k])
    before, here, after = values[k - 1 : k + 2].tolist()
    bend = before - 2.0 * here + after
    if not bend < 0.0:
        return here, float(time[k])
    shift = 0.5 * (before - after) / bend
    return here - 0.25 * (before - after) * shift, float(time[k] + shift * (time[k + 1] - time[k]))
