"""Positions of a mechanism with ideal joints along the stroke of its drives, and the singular positions on the way."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from scissordyn.mechanics.time_function import breaks_of
from scissordyn.model.mechanism import Mechanism
from scissordyn.simulation.closure import Closure, closure_of
from scissordyn.simulation.singular import (
    CHANGE,
    LOCKING,
    SingularPosition,
    concerned,
    locate,
    measure,
    smallest,
    suspects,
)
from scissordyn.simulation.time_functions import prescribed

__all__ = ["Path", "follow", "instants", "path_of", "start_of"]

STEP = 0.06
"""Longest step of an angle [rad], or of a length as a fraction of it; steps that divide a right angle would end in one."""

TURNED = 0.15
"""Largest rotation of a body in a step [rad]."""

CORRECTED = 0.3
"""A correction larger than this fraction of the step may have led to another branch."""

SHORTEST = 1e-9
"""Fraction of the stroke at which the path has come to its end."""

MOST_TURNS = 2
"""Revolutions of a drive after which positions are taken to repeat: one on each branch."""

GRID = 4001
"""Instants at which inputs are looked at for their range."""

ON_END = 1e-5
"""A singular position at an end of the stroke: fraction of the typical smallest singular value; positions there are
known to the root of round-off only."""


AtPlace = Callable[[float], np.ndarray]
"""Inputs or natural coordinates at a place on the path."""


@dataclass(frozen=True)
class Path:
    """Positions of the ideal mechanism along its stroke.

    Parameters
    ----------
    closure : Closure
    parameter : {"angle", "length", "time"}
        What the path is a function of: the only input, or time with several.
    place : ndarray, shape (points,)
        Its values [rad, m or s], increasing.
    z : ndarray, shape (points, nZ)
        Natural coordinates.
    singular : tuple of SingularPosition
    """

    closure: Closure
    parameter: str
    place: np.ndarray
    z: np.ndarray
    singular: tuple[SingularPosition, ...]

    @property
    def angle(self) -> np.ndarray:
        """Angles of all bodies, continuous along the path, shape (points, bodies) [rad]."""
        found = np.empty((self.place.size, len(self.closure.mechanism.bodies)))
        for k, body in enumerate(self.closure.mechanism.bodies):
            p = self.closure.first[body.name]
            found[:, k] = np.unwrap(np.arctan2(self.z[:, p + 3], self.z[:, p + 2])) if body.rotates else body.angle
        return found

    @property
    def position(self) -> np.ndarray:
        """Mass centres, shape (points, bodies, axes) [m]."""
        found = np.empty((self.place.size, len(self.closure.mechanism.bodies), 2))
        for (k, body), turn in zip(enumerate(self.closure.mechanism.bodies), self.angle.T, strict=True):
            p, (x, y) = self.closure.first[body.name], body.centre
            cos, sin = np.cos(turn), np.sin(turn)
            found[:, k, 0] = self.closure.size * self.z[:, p] + cos * x - sin * y
            found[:, k, 1] = self.closure.size * self.z[:, p + 1] + sin * x + cos * y
        return found


def start_of(closure: Closure) -> np.ndarray | None:
    """The closed position at t = 0, with the constraints chosen that are independent; None if there is none."""
    inputs = closure.inputs.at(0.0)
    start = closure.close(closure.placed(), inputs, most_steps=50)
    if start is None:
        return None
    near = start
    # where only the start is special, such as folded flat, nothing may be left out: ask a little further on
    for shift in (0.03, -0.03):
        moved = closure.close(start, inputs + shift * np.where(np.arange(inputs.size) < len(closure.inputs.bodies), 1.0, 0.1))
        if moved is not None:
            near = moved
            break
    closure.choose(near)
    return start


def path_of(mechanism: Mechanism, until: float, closure: Closure | None = None) -> Path | None:
    """The path of a driven mechanism with ideal joints.

    Parameters
    ----------
    mechanism : Mechanism
    until : float
        End of the time of the drives [s].
    closure : Closure, optional
        Of the mechanism, with its constraints chosen.

    Returns
    -------
    Path or None
        None if the drives alone do not determine the motion, or the mechanism cannot be closed with ideal joints.
    """
    closure = closure_of(mechanism) if closure is None else closure
    inputs = closure.inputs
    start = start_of(closure)
    if start is None or not inputs.count or closure.mobility != 0:
        return None
    if inputs.count > 1:
        return follow(closure, "time", inputs.at, start, 0.0, 0.0, until)
    values = inputs.over(grid(mechanism, until))[:, 0]
    first, low, high = float(values[0]), float(values.min()), float(values.max())
    if inputs.bodies:
        most = 2.0 * math.pi * MOST_TURNS
        low, high = max(low, first - most), min(high, first + most)
    kind = "angle" if inputs.bodies else "length"
    return follow(closure, kind, lambda value: np.array([value]), start, first, low, high)


def grid(mechanism: Mechanism, until: float) -> np.ndarray:
    """Instants at which the inputs are looked at."""
    breaks = [t for _, motion in prescribed(mechanism) for t in breaks_of(motion) if 0.0 < t < until]
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

    Parameters
    ----------
    closure : Closure
    parameter : {"angle", "length", "time"}
    inputs : callable
        Values of the inputs at a place.
    start : ndarray, shape (nZ,)
        Natural coordinates at the first place.
    first, low, high : float
        The place of the start, and the ends.

    Returns
    -------
    Path
    """
    forth, end_forth = _leg(closure, inputs, start, first, high)
    back, end_back = _leg(closure, inputs, start, first, low)
    points = back[:0:-1] + forth
    place, z = np.array([s for s, _ in points]), np.array([each for _, each in points])
    path = Path(closure, parameter, place, z, ())
    found = _singular(path, inputs)
    typical = _typical(path)
    for end, at in ((end_back, points[0]), (end_forth, points[-1])):
        if end is not None:
            found.append(SingularPosition(LOCKING, end, *concerned(closure, at[1], typical)))
    return Path(closure, parameter, place, z, tuple(sorted(found, key=lambda each: each.place)))


def _leg(
    closure: Closure, inputs: AtPlace, start: np.ndarray, first: float, last: float
) -> tuple[list[tuple[float, np.ndarray]], float | None]:
    """Points from a place to another, and where the path ends before it."""
    points = [(float(first), start)]
    span = abs(last - first)
    if span == 0.0:
        return points, None
    sign = math.copysign(1.0, last - first)
    step = longest = _longest(closure, inputs, first, last)
    while abs(points[-1][0] - last) > 1e-12 * span:
        here = points[-1][0]
        place = last if abs(last - here) <= 1.001 * step else here + sign * step
        guess = _predicted(closure, inputs, points, place)
        z = closure.close(guess, inputs(place))
        if z is not None:
            change, correction = _turns(closure, z - points[-1][1]), _turns(closure, z - guess)
            if change <= TURNED and correction <= CORRECTED * change + 1e-9:
                points.append((place, z))
                step = min(longest, 1.6 * step)
                continue
        step *= 0.5
        if step < SHORTEST * span:
            return points, points[-1][0]
    return points, None


def _longest(closure: Closure, inputs: AtPlace, first: float, last: float) -> float:
    """The longest step along a leg."""
    places = np.linspace(first, last, 201)
    values = np.array([inputs(s) for s in places])
    lengths = np.arange(values.shape[1]) >= len(closure.inputs.bodies)
    unit = np.where(lengths, np.max(np.abs(values), axis=0), 1.0)
    fastest = float(np.max(np.abs(np.diff(values, axis=0)) / unit)) / abs(places[1] - places[0])
    return min(abs(last - first) / 5.3, STEP / fastest if fastest > 0.0 else math.inf)


def _turns(closure: Closure, change: np.ndarray) -> float:
    """The largest rotation of a body, or displacement in units of the size where none rotates."""
    if closure.directions.size:
        change = change[np.concatenate([closure.directions, closure.directions + 1])]
    return float(np.max(np.abs(change), initial=0.0))


def _predicted(closure: Closure, inputs: AtPlace, points: list[tuple[float, np.ndarray]], place: float) -> np.ndarray:
    """Natural coordinates at a place by extrapolation of the last three points, at the first step along the tangent."""
    if len(points) == 1:
        here, z = points[0]
        small = 1e-3 * (place - here)
        near = closure.close(z, inputs(here + small))
        return z if near is None else z + (near - z) * ((place - here) / small)
    return _interpolated(points[-3:], place)


def _interpolated(points: list[tuple[float, np.ndarray]], place: float) -> np.ndarray:
    """The polynomial through some points (Lagrange)."""
    total = np.zeros_like(points[0][1])
    for k, (s, z) in enumerate(points):
        factor = 1.0
        for l, (other, _) in enumerate(points):
            if l != k:
                factor *= (place - other) / (s - other)
        total = total + factor * z
    return total


def _typical(path: Path) -> float:
    """The smallest singular value at a position that is nothing special."""
    chosen = np.linspace(0, path.place.size - 1, min(path.place.size, 9)).astype(int)
    return max(float(np.median([smallest(path.closure, path.z[k]) for k in chosen])), 1e-6)


def _singular(path: Path, inputs: AtPlace) -> list[SingularPosition]:
    """The change points on a path."""
    closure, found = path.closure, []
    candidates = suspects(measure(closure, path.z))
    if not candidates:
        return []
    typical = _typical(path)
    last = path.place.size - 1
    for k in candidates:
        if k in (0, last):
            if smallest(closure, path.z[k]) < ON_END * typical:
                found.append((float(path.place[k]), path.z[k]))
            continue

        def position(place: float, k: int = k) -> np.ndarray:
            chosen = range(max(0, k - 2), min(last, k + 2) + 1)
            guess = _interpolated([(float(path.place[i]), path.z[i]) for i in chosen], place)
            closed = closure.close(guess, inputs(place))
            # Newton's method may not converge at the change point itself; interpolated positions are good to 1e-7
            return guess if closed is None else closed

        low, middle, high = (float(each) for each in path.place[k - 1 : k + 2])
        place = locate(closure, position, (low, middle, high), typical)
        if place is not None:
            found.append((place, position(place)))
    return [SingularPosition(CHANGE, place, *concerned(closure, z, typical)) for place, z in found]


def instants(path: Path, mechanism: Mechanism, until: float, place: float) -> list[float]:
    """The instants at which the drives pass a place on the path [s].

    Parameters
    ----------
    path : Path
    mechanism : Mechanism
    until : float
        End of the time [s].
    place : float

    Returns
    -------
    list of float
    """
    if path.parameter == "time":
        return [place]
    from scipy.optimize import brentq  # a tenth of a second that most runs need not wait for

    inputs = path.closure.inputs
    times = grid(mechanism, until)
    error = inputs.over(times)[:, 0] - place
    close = 1e-9 * max(1.0, abs(place))
    there = np.abs(error) <= close
    passed = (error[:-1] * error[1:] < 0.0) & ~there[:-1] & ~there[1:]
    found = []
    for k in np.flatnonzero(there[:-1] | passed).tolist():
        if there[k]:
            found.append(float(times[k]))
        else:
            found.append(float(brentq(lambda t: inputs.at(t)[0] - place, times[k], times[k + 1], xtol=1e-15)))
    if there[-1]:
        found.append(float(times[-1]))
    return found
