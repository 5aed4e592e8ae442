"""Warnings about singular positions: change points, where branches of the assembly meet, and locking positions of drives.

The equations of motion pass a change point on the branch they arrived on. The real structure may leave it on the other branch.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from scissordyn.components.place import GROUND
from scissordyn.errors import InputError
from scissordyn.kinematics.closure import Closure
from scissordyn.kinematics.path import Path, instants, path_of, start_of
from scissordyn.kinematics.singular import (
    CHANGE_KIND,
    LOCKING_KIND,
    NEAR_KIND,
    SingularPosition,
    measure,
    moving_parts,
    smallest,
    suspected_samples,
)
from scissordyn.plan.plan import Plan

SAMPLE_ROTATION_MAX = 0.2
"""Largest rotation of a body between two samples of a run with which singular positions are searched in the samples [rad].

With a larger rotation, the path of the driven mechanism is computed instead.
"""


SEARCHED_EQUATIONS_MAX = 300
"""Largest number of closure equations with which singular positions are searched; the search then takes some seconds.

Its cost grows with the third power of the number.
"""


class PositionWarning(NamedTuple):
    """Warning about a singular position that the mechanism passes or reaches."""

    time: float
    """First time at which the drives reach the position [s]."""
    kind: str
    text: str


CHANCE = "which one the real structure takes is a matter of chance"  # Last words of each warning about a change point


def passing_warnings(plan: Plan, run: Any, until: float, least_samples: int = 9) -> list[str]:
    """Return warnings for the singular positions that a run passes; `run` is a Dataset or the `Record` of its samples.

    Recorded samples show cheaply where singular positions may be. Where the drives determine the motion, the path of the ideal
    mechanism then locates them; otherwise the samples do.

    `least_samples`: smallest number of samples between which singular positions are searched.
    """
    if _equations(plan) > SEARCHED_EQUATIONS_MAX:
        return [_size_warning(plan)]
    angle = run.variables["angle"].values
    rotation = np.max(np.abs(np.diff(angle, axis=0)), axis=1, initial=0.0)
    rotated = np.concatenate([[0.0], np.cumsum(rotation)])
    closure = _closure(plan)
    if closure is None or not closure.chosen.size or not len(angle):
        return []
    driven = bool(closure.inputs.count)
    if driven and (np.max(rotation, initial=0.0) > SAMPLE_ROTATION_MAX or len(angle) < least_samples):
        return _driven(closure, run, until)
    square = closure.chosen.size == closure.free.shape[1]
    if not square and start_of(closure) is None:
        return []
    count = max(least_samples, int(rotated[-1] / 0.05))  # samples about 0.05 rad apart
    wanted = np.linspace(0.0, rotated[-1], count) if rotated[-1] > 0.0 else np.zeros(1)
    chosen = np.unique(np.minimum(np.searchsorted(rotated, wanted), len(angle) - 1))
    position = run.variables["position"].values
    z = closure.coordinates_of_motion(position[chosen], angle[chosen])
    near = suspected_samples(measure(closure, z))
    if near and square:
        # one redundant constraint and one free coordinate give a square matrix that is singular at every position
        near = [] if start_of(closure) is None else suspected_samples(measure(closure, z))
    time, warnings = run.variables["time"].values, []
    if driven and closure.mobility == 0:
        if not near and not _has_deep_contact(plan, run):
            return []
        whole = not near and run.attrs["status"] == "complete"
        if whole and _stored_warnings(closure, until) is None and _closed_along(closure, time[chosen], z):
            _store_warnings(closure, until, ())
        return _driven(closure, run, until)
    for k in near:
        first, last = chosen[max(0, k - 1)], chosen[min(chosen.size - 1, k + 1)]
        part = slice(int(first), int(last) + 1)
        warnings += _passed(closure, time[part], closure.coordinates_of_motion(position[part], angle[part]), rotation[part])
    return [_describe_passed(closure, singular, z) for singular, z in warnings]


def _has_deep_contact(plan: Plan, run: Any) -> bool:
    """Return whether an indentation exceeds a tenth of its clearance, as happens beyond a locking position."""
    if not plan.contacts:
        return False
    at = plan.places(contact.name for contact in plan.contacts)
    names = ("peak_indentation", "clearance")
    depth, gap = (run.variables[name].values[at] for name in names)
    return bool(np.any(depth > 0.1 * gap))


def _closed_along(closure: Closure, time: np.ndarray, z: np.ndarray) -> bool:
    """Return whether the ideal mechanism closes near all samples of a run and is far from singular positions.

    The inputs may have an extreme between two samples: the mechanism has to close there as well.
    """
    count = 9  # instants around each sample with an extreme input
    inputs = closure.inputs.over(time)
    ends = np.unique(np.concatenate([np.argmin(inputs, axis=0), np.argmax(inputs, axis=0)]))
    around = np.concatenate([np.linspace(time[max(0, k - 1)], time[min(time.size - 1, k + 1)], count) for k in ends])
    guess = np.concatenate([z, np.repeat(z[ends], count, axis=0)])
    closed = closure.close_all(guess, np.concatenate([inputs, closure.inputs.over(around)]))
    if closed is None or np.max(np.abs(closed[: time.size] - z)) > 0.1:  # [mechanism sizes or rad] another position
        return False
    side = np.linalg.slogdet(closure.jacobian(closed))[0]
    return bool(np.all(side == side[0])) and not suspected_samples(measure(closure, closed[: time.size]))


def _driven(closure: Closure, run: Any, until: float) -> list[str]:
    """Return the warnings of a driven mechanism, with the force reached if clearances let it pass a locking position."""
    plan, sentences = closure.plan, _ideal_warnings(closure, until)
    texts = [text for _, _, text in sentences]
    lock = min((time for time, kind, _ in sentences if kind == LOCKING_KIND), default=math.inf)
    joints = plan.contacts
    if not joints or not run.variables["time"].values.size or not float(run.variables["time"].values[-1]) > lock:
        return texts
    at = plan.places(joint.name for joint in joints)
    force = run.variables["normal_force"].values[:, at]
    k, largest = (int(index) for index in np.unravel_index(np.argmax(force), force.shape))
    time = float(run.variables["time"].values[k])
    if time >= lock:
        texts.append(
            f"the drive is forced beyond its locking position of t = {lock:.6g} s: from then on it presses surfaces into each "
            f"other, which a real drive could not do; the largest force is {force[k, largest]:.3g} N at joint "
            f"'{joints[largest].name}' at t = {time:.6g} s"
        )
    return texts


def drive_warnings(plan: Plan, until: float) -> list[str]:
    """Return warnings for the singular positions to which the drives lead the ideal mechanism."""
    if not plan.motions:
        return []
    if _equations(plan) > SEARCHED_EQUATIONS_MAX:
        return [_size_warning(plan)]
    closure = _closure(plan)
    return [] if closure is None else [text for _, _, text in _ideal_warnings(closure, until)]


def locking_position(plan: Plan, until: float) -> PositionWarning | None:
    """Return the first locking position to which the drives lead the ideal mechanism; None if none is found."""
    closure = _closure(plan) if plan.motions and _equations(plan) <= SEARCHED_EQUATIONS_MAX else None
    found = [] if closure is None else _ideal_warnings(closure, until)
    return min((singular for singular in found if singular.kind == LOCKING_KIND), default=None)


def _ideal_warnings(closure: Closure, until: float) -> tuple[PositionWarning, ...]:
    """Return the warnings for the ideal mechanism; the last result of a plan is kept, as clearances do not matter."""
    statements = _stored_warnings(closure, until)
    if statements is None:
        path = path_of(closure.plan, until, closure)
        statements = () if path is None else tuple(_warnings_of_path(path, until))
        _store_warnings(closure, until, statements)
    return statements


def _stored_warnings(closure: Closure, until: float) -> tuple[PositionWarning, ...] | None:
    """Return the stored warnings for these drives and this duration; None if others are stored."""
    stored_until, statements = closure.plan.answers.get("singular", (None, ()))
    return statements if stored_until == (closure.plan.drives, until) else None


def _store_warnings(closure: Closure, until: float, warnings: tuple[PositionWarning, ...]) -> None:
    closure.plan.answers["singular"] = (closure.plan.drives, until), warnings


def _equations(plan: Plan) -> int:
    """Return an upper bound on the number of quadratic closure equations of the ideal mechanism."""
    rotating = sum(body.rotates for body in plan.bodies)
    others = (*plan.rods, *plan.mechanism.coupling_parts)
    return rotating + sum(guide.body != GROUND for guide in plan.mechanism.guides) + len(others)


def _size_warning(plan: Plan) -> str:
    """Return the warning that the mechanism is too large for the search."""
    count = _equations(plan)
    return f"singular positions were not searched: {count} closure equations exceed the limit of {SEARCHED_EQUATIONS_MAX}"


def _closure(plan: Plan) -> Closure | None:
    """Return the closure equations; None for a mechanism that closes only thanks to its clearances."""
    try:
        return Closure(plan)
    except InputError:
        return None


def path_warnings(path: Path, until: float) -> list[str]:
    """Return warnings for the singular positions of a path, in the order of time."""
    return [text for _, _, text in _warnings_of_path(path, until)]


def _warnings_of_path(path: Path, until: float) -> list[PositionWarning]:
    statements: list[PositionWarning] = []
    for singular in path.singular:
        times = instants(path, until, singular.place)
        if not times:  # a position beyond the last one by round-off
            continue
        when = f"at t = {times[0]:.6g} s" + (f", the first of {len(times)} times," if len(times) > 1 else "")
        where = f"{when}{_describe_input(path, singular.place)}"
        if singular.kind == CHANGE_KIND:
            text = f"change point {where}: {singular.subject} can continue on more than one branch of the assembly; {CHANCE}"
        elif singular.kind == NEAR_KIND:
            text = (
                f"near change point {where}: if lengths differ by {singular.miss:.2g} of the mechanism's size, "
                f"{singular.subject} can continue on another branch of the assembly"
            )
        else:
            verb = "hold" if len(singular.bodies) > 1 else "holds"
            text = f"locking position {where}: {singular.subject} {verb} it there; the drive cannot move further"
        statements.append(PositionWarning(times[0], singular.kind, text))
    return sorted(statements)


def _describe_input(path: Path, place: float) -> str:
    inputs = path.closure.inputs
    if path.parameter == "time":
        values = inputs.at(place)
        names = [*inputs.bodies, *inputs.timed]
        words = [
            f"'{name}' at {_format_input(value, unit)}" for name, value, unit in zip(names, values, inputs.units, strict=True)
        ]
        return f" ({', '.join(words)})"
    driven = {rod.name: "rod" for rod in path.closure.plan.rods}
    name = f"drive of '{inputs.bodies[0]}'" if inputs.bodies else f"{driven.get(inputs.timed[0], 'drive')} '{inputs.timed[0]}'"
    return f" ({name} at {_format_input(place, inputs.units[0])})"


def _format_input(value: float, unit: str) -> str:
    return f"{math.degrees(value):.6g} deg" if unit == "rad" else f"{1e3 * value:.6g} mm"


def _passed(
    closure: Closure, time: np.ndarray, z: np.ndarray, rotation: np.ndarray
) -> list[tuple[SingularPosition, np.ndarray]]:
    """Return the change point that a free motion passes between two samples, with its position; empty if there is none.

    Two samples are compared only if no body rotates by more than `SAMPLE_ROTATION_MAX` between them. The mean of two
    directions that are farther apart is much shorter than one, and the gradients of its length constraints vanish.
    """
    values = np.array([smallest(closure, point) for point in z])
    k = int(np.argmin(values))
    left, _, right = np.linalg.svd(closure.jacobian(z[k]), full_matrices=False)
    test = np.einsum("m,kmn,n->k", left[:, -1], closure.jacobian(z), right[-1])
    for i in (k - 1, k):
        if not 0 <= i < len(z) - 1 or rotation[i] > SAMPLE_ROTATION_MAX or test[i] * test[i + 1] > 0.0:
            continue
        fraction = float(test[i] / (test[i] - test[i + 1])) if test[i] != test[i + 1] else 0.0
        between = z[i] + fraction * (z[i + 1] - z[i])
        if smallest(closure, between) <= 0.1 * max(values[i], values[i + 1]):
            place = float(time[i] + fraction * (time[i + 1] - time[i]))
            return [(SingularPosition(CHANGE_KIND, place, *moving_parts(closure, between, float(np.median(values)))), between)]
    return []


def _describe_passed(closure: Closure, singular: SingularPosition, z: np.ndarray) -> str:
    """Return the warning for a change point of a free motion."""
    plan = closure.plan
    named = plan.mechanism.input_body or (singular.bodies[0] if singular.bodies else plan.bodies[0].name)
    angle = ""
    if plan.mechanism.body(named).rotates:
        p = closure.first[named]
        angle = f" ('{named}' at {math.degrees(math.atan2(z[p + 3], z[p + 2])):.4g} deg)"
    return (
        f"change point at t = {singular.place:.6g} s{angle}: {singular.subject} can continue on more than one branch of the "
        f"assembly; {CHANCE}"
    )
