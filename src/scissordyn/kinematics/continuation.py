"""Path continuation: follow the positions of a mechanism until the input cannot go further.

The determinant of the gradients keeps its sign on a smooth piece of the path. A step that changes the sign has passed a change
point, or has jumped to another branch of the assembly that comes near. The function g of `unfolding` shows which of the two.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from scissordyn.kinematics.closure import Closure
from scissordyn.kinematics.unfolding import INPUT_STEP_FRACTION, Point, Unfolding
from scissordyn.tolerance import DATA_TOL, ROUND_OFF_TOL

TURN_MAX = 0.15  # [rad] Largest rotation of a body in one step along a path
CORRECTION_FRACTION = 0.3  # Largest Newton correction of a predicted position, relative to the step; a larger one may be a jump
AtPlace = Callable[[float], np.ndarray]  # Inputs or natural coordinates as a function of the path parameter


@dataclass(frozen=True)
class Meeting:
    """Position where branches of the assembly meet, or come near each other without meeting."""

    place: float  # Path parameter
    z: np.ndarray  # (nZ,) Natural coordinates
    miss: float  # Distance between the branches in mechanism sizes; 0 if they meet


@dataclass
class Leg:
    """Part of a path on one side of the start, towards larger or smaller values of the path parameter."""

    points: list[tuple[float, np.ndarray]]
    met: list[Meeting] = field(default_factory=list)  # Change points and near change points on the way
    end: float | None = None  # Parameter at which the input cannot go further


def walk(closure: Closure, inputs: AtPlace, start: np.ndarray, first: float, last: float) -> Leg:
    """Follow the positions from `start` (nZ,) at one value of the path parameter to another value."""
    leg = Leg([(float(first), start)])
    span = abs(last - first)
    if span <= ROUND_OFF_TOL * max(abs(first), abs(last)):
        return leg
    sign, side = math.copysign(1.0, last - first), _determinant_sign(closure, start)
    step = longest = _longest_step(closure, inputs, first, last)
    repeated = False
    while abs(leg.points[-1][0] - last) > 1e-12 * span:
        here = leg.points[-1][0]
        place = last if abs(last - here) <= 1.001 * step else here + sign * step
        guess = _predict(closure, inputs, leg.points, place, longest, repeated)
        z = closure.close(guess, inputs(place))
        if z is not None and not _is_smooth(closure, leg.points[-1][1], guess, z):
            z = None
        new = 0.0 if z is None else _determinant_sign(closure, z)
        if z is not None and (new * side >= 0.0 or _passes_change_point(closure, inputs, leg, (place, z), longest)):
            leg.points.append((place, z))
            side, step, repeated = new, min(longest, 1.6 * step), False
            continue
        if _reaches_limit(closure, inputs, leg, place, longest):
            return leg
        step, repeated = 0.5 * step, True
        if step < 1e-9 * span:  # the path ends here
            leg.end = leg.points[-1][0]
            return leg
    return leg


def _is_smooth(closure: Closure, before: np.ndarray, guess: np.ndarray, z: np.ndarray) -> bool:
    """Return whether a step turns no body too far, with a correction that is small relative to the step."""
    change, correction = largest_turn(closure, z - before), largest_turn(closure, z - guess)
    return change <= TURN_MAX and correction <= CORRECTION_FRACTION * change + 1e-9


def _determinant_sign(closure: Closure, z: np.ndarray) -> float:
    return float(np.linalg.slogdet(closure.jacobian(z))[0])


def _passes_change_point(closure: Closure, inputs: AtPlace, leg: Leg, new: tuple[float, np.ndarray], longest: float) -> bool:
    """Return whether a step passes a change point; False if it jumped to another branch.

    The step goes from the last point of `leg` to `new`; the determinant has changed its sign. `longest` is the longest step.
    """
    here, place = leg.points[-1], new[0]
    low, high = min(here[0], place) - DATA_TOL * longest, max(here[0], place) + DATA_TOL * longest
    meetings = [meeting_before for meeting_before in leg.met if low <= meeting_before.place <= high]
    if not meetings:
        near = _nearest_to_singular(closure, here, new)
        values = np.linalg.svd(closure.jacobian(near[1]), compute_uv=False)
        usual = np.linalg.svd(closure.jacobian(leg.points[len(leg.points) // 2][1]), compute_uv=False)
        # the last two singular values may vanish together: they are alike, or the last but one has become small
        if values.size > 1 and values[-2] <= max(5.0 * values[-1], 0.05 * usual[-2]):
            return True
        meeting = meeting_between(closure, inputs, near, low, high, longest)
        if meeting is None:
            return abs(place - here[0]) <= 1e-3 * longest  # a short step is accepted although its sign change is unexplained
        leg.met.append(meeting)
        meetings = [meeting]
    return any(meeting_before.miss == 0.0 for meeting_before in meetings)


def _nearest_to_singular(
    closure: Closure, first: tuple[float, np.ndarray], second: tuple[float, np.ndarray]
) -> tuple[float, np.ndarray]:
    """Return the one of two positions with the smaller singular value."""
    sizes = [np.linalg.svd(closure.jacobian(z), compute_uv=False)[-1] for _, z in (first, second)]
    return first if sizes[0] <= sizes[1] else second


def meeting_between(
    closure: Closure, inputs: AtPlace, near: tuple[float, np.ndarray], low: float, high: float, width: float
) -> Meeting | None:
    """Return the position between `low` and `high` where two branches meet or come near each other; None if there is none."""
    unfolded = Unfolding(closure, inputs, *near, width).meeting()
    if unfolded is None or not low <= unfolded.place <= high or not _is_saddle(closure, near[1], unfolded):
        return None
    # the size is known to 1e-12: a limit of the input is then within 1e-6 of the change point
    return Meeting(unfolded.place, unfolded.z, 0.0 if abs(unfolded.g) <= 1e-12 else abs(unfolded.g))


def _is_saddle(closure: Closure, z: np.ndarray, point: Point) -> bool:
    """Return whether a stationary point of the unfolding is a saddle with one small singular value, near a position."""
    values = np.linalg.svd(closure.jacobian(point.z), compute_uv=False)
    alone = values.size == 1 or values[-2] > 1e-4 * values[0]
    return bool(alone and point.saddle > 0.0 and largest_turn(closure, point.z - z) <= 2.0 * TURN_MAX)


def _reaches_limit(closure: Closure, inputs: AtPlace, leg: Leg, place: float, longest: float) -> bool:
    """Return whether the input reaches a limit within the next two steps; if so, extend the leg to the limit."""
    here, z = leg.points[-1]
    limit = Unfolding(closure, inputs, here, z, longest).limit()
    return limit is not None and _extend_to(closure, inputs, leg, limit, place)


def _extend_to(closure: Closure, inputs: AtPlace, leg: Leg, limit: Point, place: float) -> bool:
    """Extend a leg to a limit of the input; return whether the limit is on the same branch."""
    here, z = leg.points[-1]
    sign, ahead = math.copysign(1.0, place - here), limit.place - here
    if not 0.0 < sign * ahead <= 2.0 * abs(place - here) or not sign * limit.slope[1] * limit.curvature[0, 0] > 0.0:
        return False
    if largest_turn(closure, limit.z - z) > 2.0 * TURN_MAX:
        return False
    side, added = _determinant_sign(closure, z), list[tuple[float, np.ndarray]]()
    for k in range(1, 9):  # eight positions, each at a quarter of the distance of the one before it
        at, rest = limit.place - ahead * 0.25**k, z - limit.z
        guess = limit.z + 0.5 * rest
        closed = closure.close(guess, inputs(at))
        if closed is None or _determinant_sign(closure, closed) * side <= 0.0:
            return False
        if largest_turn(closure, closed - guess) > 0.5 * CORRECTION_FRACTION * largest_turn(closure, rest):
            return False
        z = closed
        added.append((at, z))
    leg.points += [*added, (limit.place, limit.z)]
    leg.end = limit.place
    return True


def _longest_step(closure: Closure, inputs: AtPlace, first: float, last: float) -> float:
    """Return the longest step of the path parameter.

    Inputs change by at most 0.06 rad, or 6 % of the largest length, in a step. A divisor of a right angle would end in one.
    """
    places = np.linspace(first, last, 201)
    values = np.array([inputs(s) for s in places])
    lengths = np.array(closure.inputs.units) == "m"
    unit = np.where(lengths, np.max(np.abs(values), axis=0), 1.0)
    fastest = float(np.max(np.abs(np.diff(values, axis=0)) / unit)) / abs(places[1] - places[0])
    return min(abs(last - first) / 5.3, 0.06 / fastest if fastest > 0.0 else math.inf)


def largest_turn(closure: Closure, change: np.ndarray) -> float:
    """Return the largest rotation of a body [rad]; if no body rotates, the largest displacement in mechanism sizes."""
    if closure.directions.size:
        change = change[np.concatenate([closure.directions, closure.directions + 1])]
    return float(np.max(np.abs(change), initial=0.0))


def _predict(
    closure: Closure, inputs: AtPlace, points: list[tuple[float, np.ndarray]], place: float, width: float, repeated: bool
) -> np.ndarray:
    """Predict natural coordinates by extrapolation of the last four points.

    The first step and a repeated step follow the tangent. Points further apart than the radius of curvature give a wrong slope,
    and a shorter step does not improve it.
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
    """Return the derivative of the natural coordinates by the path parameter at a place; None at a singular position.

    `width` is the step of the path; the inputs are differentiated over a small fraction of it.
    """
    h = INPUT_STEP_FRACTION * width
    rows = [inputs(place + k * h) for k in (-2, -1, 1, 2)]
    weights = np.array([1.0, -8.0, 8.0, -1.0]) / (12.0 * h)
    moved, value = (weights @ np.array([part(row) for row in rows]) for part in (closure.driven_part, closure.right_sides))
    left, sizes, right = np.linalg.svd(closure.jacobian(z))
    if sizes.size and not sizes[-1] > 1e-8 * sizes[0]:
        return None
    return np.asarray(moved + closure.free @ (right.T @ ((left.T @ (value - closure.derivative(z, moved))) / sizes)))


def extrapolated(points: list[tuple[float, np.ndarray]], place: float) -> np.ndarray:
    """Evaluate the Lagrange polynomial through some points."""
    total = np.zeros_like(points[0][1])
    for k, (s, z) in enumerate(points):
        factor = 1.0
        for l, (other, _) in enumerate(points):
            if l != k:
                factor *= (place - other) / (s - other)
        total = total + factor * z
    return total
