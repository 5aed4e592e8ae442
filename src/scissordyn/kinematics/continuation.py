"""Follow the positions of a mechanism from one place of its path to another, and stop where the input can go no further.

On a smooth piece of a path the determinant of the gradients keeps its sign. Where a step changes it, the mechanism has passed a
change point, or the step has led from one branch of the assembly to another that comes near; the unfolding tells which.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from scissordyn.kinematics.closure import Closure
from scissordyn.kinematics.unfolding import DIFFERENCE, Point, Unfolding

STEP = 0.06
"""Longest step of an angle [rad], or of a length as a fraction of it; steps that divide a right angle would end in one."""

TURNED = 0.15  # Largest rotation of a body in a step [rad]
CORRECTED = 0.3  # A correction larger than this fraction of the step may have led to another branch
SHORTEST = 1e-9  # Fraction of the stroke at which the path has come to its end

MET = 1e-12
"""Branches that miss each other by less, in lengths as a fraction of the size, meet: lengths are rounded, and a limit of the
input is then within 1e-6 of the change point."""

ALONE = 1e-4  # Fraction of the largest singular value above which the last but one is not small
SEVERAL = 5.0  # If the last but one is not larger than this multiple of the smallest, both may vanish together
SMALL = 0.05  # Or not larger than this fraction of what it is half way before
UNEXPLAINED = 1e-3  # A change of sign for which no reason is found in a step of this fraction of the longest is accepted
MARGIN = 1e-6  # Of the longest step: a position so near a change point may be on either side by round-off
REGULAR = 1e-8  # Fraction of the largest singular value above which the smallest determines a tangent
APPROACHED = 8  # So many positions lead from the last step to a limit of the input, each a quarter as far from it
AtPlace = Callable[[float], np.ndarray]  # Inputs or natural coordinates at a place on the path


@dataclass(frozen=True)
class Meeting:
    """A place where branches of the assembly meet, or come near each other without meeting."""

    place: float
    z: np.ndarray  # (nZ,)
    miss: float  # By how much they miss each other, in lengths as a fraction of the mechanism's size; 0 if they meet


@dataclass
class Leg:
    points: list[tuple[float, np.ndarray]]
    met: list[Meeting] = field(default_factory=list)
    end: float | None = None  # Where the input can go no further


def walk(closure: Closure, inputs: AtPlace, start: np.ndarray, first: float, last: float) -> Leg:
    """Follow the positions from a place to another.

    Shapes: `start` (nZ,).
    """
    leg = Leg([(float(first), start)])
    span = abs(last - first)
    if span == 0.0:
        return leg
    sign, side = math.copysign(1.0, last - first), _side(closure, start)
    step = longest = _longest(closure, inputs, first, last)
    repeated = False
    while abs(leg.points[-1][0] - last) > 1e-12 * span:
        here = leg.points[-1][0]
        place = last if abs(last - here) <= 1.001 * step else here + sign * step
        guess = _predicted(closure, inputs, leg.points, place, longest, repeated)
        z = closure.close(guess, inputs(place))
        if z is not None and not _smooth(closure, leg.points[-1][1], guess, z):
            z = None
        new = 0.0 if z is None else _side(closure, z)
        if z is not None and (new * side >= 0.0 or _accepted(closure, inputs, leg, (place, z), longest)):
            leg.points.append((place, z))
            side, step, repeated = new, min(longest, 1.6 * step), False
            continue
        if _ends(closure, inputs, leg, place, longest):
            return leg
        step, repeated = 0.5 * step, True
        if step < SHORTEST * span:
            leg.end = leg.points[-1][0]
            return leg
    return leg


def _smooth(closure: Closure, before: np.ndarray, guess: np.ndarray, z: np.ndarray) -> bool:
    """Whether a position is where it was expected."""
    change, correction = largest_turn(closure, z - before), largest_turn(closure, z - guess)
    return change <= TURNED and correction <= CORRECTED * change + 1e-9


def _side(closure: Closure, z: np.ndarray) -> float:
    """The sign of the determinant of the gradients."""
    return float(np.linalg.slogdet(closure.jacobian(z))[0])


def _accepted(closure: Closure, inputs: AtPlace, leg: Leg, new: tuple[float, np.ndarray], longest: float) -> bool:
    """Whether a step that changes the sign of the determinant goes through a change point."""
    here, place = leg.points[-1], new[0]
    low, high = min(here[0], place) - MARGIN * longest, max(here[0], place) + MARGIN * longest
    meetings = [meeting_before for meeting_before in leg.met if low <= meeting_before.place <= high]
    if not meetings:
        near = _nearer(closure, here, new)
        values = np.linalg.svd(closure.jacobian(near[1]), compute_uv=False)
        usual = np.linalg.svd(closure.jacobian(leg.points[len(leg.points) // 2][1]), compute_uv=False)
        if values.size > 1 and values[-2] <= max(SEVERAL * values[-1], SMALL * usual[-2]):
            return True
        meeting = meeting_between(closure, inputs, near, low, high, longest)
        if meeting is None:
            return abs(place - here[0]) <= UNEXPLAINED * longest
        leg.met.append(meeting)
        meetings = [meeting]
    return any(meeting_before.miss == 0.0 for meeting_before in meetings)


def _nearer(closure: Closure, one: tuple[float, np.ndarray], other: tuple[float, np.ndarray]) -> tuple[float, np.ndarray]:
    """Which of two positions is nearer to a singular one."""
    sizes = [np.linalg.svd(closure.jacobian(z), compute_uv=False)[-1] for _, z in (one, other)]
    return one if sizes[0] <= sizes[1] else other


def meeting_between(
    closure: Closure, inputs: AtPlace, near: tuple[float, np.ndarray], low: float, high: float, width: float
) -> Meeting | None:
    """Where branches of the assembly meet or nearly meet between two places, with one small singular value; None if nowhere."""
    unfolded = Unfolding(closure, inputs, *near, width).meeting()
    if unfolded is None or not low <= unfolded.place <= high or not _counts(closure, near[1], unfolded):
        return None
    return Meeting(unfolded.place, unfolded.z, 0.0 if abs(unfolded.g) <= MET else abs(unfolded.g))


def _counts(closure: Closure, z: np.ndarray, found: Point) -> bool:
    """Whether a stationary point of the unfolding is a saddle with one small singular value, and next to a position."""
    values = np.linalg.svd(closure.jacobian(found.z), compute_uv=False)
    alone = values.size == 1 or values[-2] > ALONE * values[0]
    return bool(alone and found.saddle > 0.0 and largest_turn(closure, found.z - z) <= 2.0 * TURNED)


def _ends(closure: Closure, inputs: AtPlace, leg: Leg, place: float, longest: float) -> bool:
    """Whether the input is at a limit within the next step or two; if so, the leg is led there."""
    here, z = leg.points[-1]
    unfolding = Unfolding(closure, inputs, here, z, longest)
    sign = math.copysign(1.0, place - here)
    limits = [unfolding.limit()]
    meeting = unfolding.meeting()
    if meeting is not None and meeting.saddle > 0.0 and meeting.curvature[0, 0] * meeting.g > 0.0:
        bend, mixed = meeting.curvature[0]
        before = sign * math.sqrt(2.0 * bend * meeting.g / meeting.saddle)
        guess = unfolding.at(meeting.a + mixed * before / bend, meeting.place - before, meeting.z)
        limits.append(None if guess is None else unfolding.limit(guess))
    return any(_led(closure, inputs, leg, limit, place) for limit in limits if limit is not None)


def _led(closure: Closure, inputs: AtPlace, leg: Leg, limit: Point, place: float) -> bool:
    """Lead a leg to a limit of the input, if it is on the same branch."""
    here, z = leg.points[-1]
    sign, ahead = math.copysign(1.0, place - here), limit.place - here
    if not 0.0 < sign * ahead <= 2.0 * abs(place - here) or not sign * limit.slope[1] * limit.curvature[0, 0] > 0.0:
        return False
    if largest_turn(closure, limit.z - z) > 2.0 * TURNED:
        return False
    side, added = _side(closure, z), list[tuple[float, np.ndarray]]()
    for k in range(1, APPROACHED + 1):
        at, rest = limit.place - ahead * 0.25**k, z - limit.z
        guess = limit.z + 0.5 * rest
        closed = closure.close(guess, inputs(at))
        if closed is None or _side(closure, closed) * side <= 0.0:
            return False
        if largest_turn(closure, closed - guess) > 0.5 * CORRECTED * largest_turn(closure, rest):
            return False
        z = closed
        added.append((at, z))
    leg.points += [*added, (limit.place, limit.z)]
    leg.end = limit.place
    return True


def _longest(closure: Closure, inputs: AtPlace, first: float, last: float) -> float:
    places = np.linspace(first, last, 201)
    values = np.array([inputs(s) for s in places])
    lengths = np.array(closure.inputs.units) == "m"
    unit = np.where(lengths, np.max(np.abs(values), axis=0), 1.0)
    fastest = float(np.max(np.abs(np.diff(values, axis=0)) / unit)) / abs(places[1] - places[0])
    return min(abs(last - first) / 5.3, STEP / fastest if fastest > 0.0 else math.inf)


def largest_turn(closure: Closure, change: np.ndarray) -> float:
    """The largest rotation of a body, or displacement in units of the size where none rotates."""
    if closure.directions.size:
        change = change[np.concatenate([closure.directions, closure.directions + 1])]
    return float(np.max(np.abs(change), initial=0.0))


def _predicted(
    closure: Closure, inputs: AtPlace, points: list[tuple[float, np.ndarray]], place: float, width: float, repeated: bool
) -> np.ndarray:
    """Natural coordinates at a place by extrapolation of the last four points.

    At the first step, and where a step is repeated, it is along the tangent: the slope of a polynomial through points further
    apart than the path is curved does not improve with a shorter step.
    """
    if len(points) > 1 and not repeated:
        return extrapolated(points[-4:], place)
    here, z = points[-1]
    tangent = _tangent(closure, inputs, here, z, width)
    if tangent is not None:
        return z + tangent * (place - here)
    small = 1e-3 * (place - here)
    near = closure.close(z, inputs(here + small))
    return z if near is None else z + (near - z) * ((place - here) / small)


def _tangent(closure: Closure, inputs: AtPlace, place: float, z: np.ndarray, width: float) -> np.ndarray | None:
    """Derivative of the natural coordinates by the place; None at a singular position."""
    h = DIFFERENCE * width
    rows = [inputs(place + k * h) for k in (-2, -1, 1, 2)]
    weights = np.array([1.0, -8.0, 8.0, -1.0]) / (12.0 * h)
    moved, value = (weights @ np.array([part(row) for row in rows]) for part in (closure.known_at, closure.values_at))
    left, sizes, right = np.linalg.svd(closure.jacobian(z))
    if sizes.size and not sizes[-1] > REGULAR * sizes[0]:
        return None
    return np.asarray(moved + closure.free @ (right.T @ ((left.T @ (value - closure.product(z, moved))) / sizes)))


def extrapolated(points: list[tuple[float, np.ndarray]], place: float) -> np.ndarray:
    """The polynomial through some points (Lagrange)."""
    total = np.zeros_like(points[0][1])
    for k, (s, z) in enumerate(points):
        factor = 1.0
        for l, (other, _) in enumerate(points):
            if l != k:
                factor *= (place - other) / (s - other)
        total = total + factor * z
    return total
