"""Warnings about singular positions: where another branch of the assembly meets the motion, and where a drive locks.

The equations of motion go through a change point on the branch on which they came. The real structure may go on on the other.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from scissordyn.components.place import GROUND
from scissordyn.errors import InputError
from scissordyn.kinematics.closure import Closure
from scissordyn.kinematics.path import Path, instants, path_of, start_of
from scissordyn.kinematics.singular import CHANGE, LOCKING, NEAR, SingularPosition, concerned, measure, smallest, suspects
from scissordyn.plan.plan import Plan

ROTATED = 0.05  # Samples are looked at that are about so far apart in the angles of the bodies [rad]
COARSE = (
    0.2  # Between samples farther apart nothing is interpolated; the ideal mechanism is used where drives determine it [rad]
)

FEWEST = 9

MOST_EQUATIONS = 300
"""Closure equations above which singular positions are not looked for: singular values of full matrices cost the cube of their
number, some seconds with so many."""

PASSED = 0.1
"""A free motion passes a singular position if the smallest singular value falls, between two samples, below this fraction of
what it is at them."""

PRESSED = 0.1
"""A journal pressed in by more than this fraction of its clearance may be forced by a drive beyond a locking position."""

BETWEEN = 9  # So many instants around the sample at which an input is farthest are looked at as well

APART = 0.1
"""A position of the ideal mechanism so far from a sample, in lengths as a fraction of the size or in rad, is not its own."""


class Said(NamedTuple):
    time: float
    """At which the drives are first there [s]."""
    kind: str
    text: str


CHANCE = "which one is taken there is a matter of chance in the real structure"


def passing_warnings(plan: Plan, run: Any, until: float) -> list[str]:
    """The singular positions that a run, a Dataset or what one is made of, passes, in words.

    Recorded samples say where one may be, at little cost. Where the drives determine the motion, the ideal mechanism then says
    where it is; otherwise the samples do.
    """
    if _equations(plan) > MOST_EQUATIONS:
        return [_not_looked_for(plan)]
    angle = run.variables["angle"].values
    rotation = np.max(np.abs(np.diff(angle, axis=0)), axis=1, initial=0.0)
    rotated = np.concatenate([[0.0], np.cumsum(rotation)])
    closure = _closure(plan)
    if closure is None or not closure.chosen.size or not len(angle):
        return []
    driven = bool(closure.inputs.count)
    if driven and (np.max(rotation, initial=0.0) > COARSE or len(angle) < FEWEST):
        return _driven(closure, run, until)
    square = closure.chosen.size == closure.free.shape[1]
    if not square and start_of(closure) is None:
        return []
    count = max(FEWEST, int(rotated[-1] / ROTATED))
    wanted = np.linspace(0.0, rotated[-1], count) if rotated[-1] > 0.0 else np.zeros(1)
    chosen = np.unique(np.minimum(np.searchsorted(rotated, wanted), len(angle) - 1))
    position = run.variables["position"].values
    z = closure.of_motion(position[chosen], angle[chosen])
    near = suspects(measure(closure, z))
    if near and square:
        # a redundant constraint and a free coordinate make as many equations as unknowns, dependent everywhere
        near = [] if start_of(closure) is None else suspects(measure(closure, z))
    time, warnings = run.variables["time"].values, []
    if driven and closure.mobility == 0:
        if not near and not _pressed(plan, run):
            return []
        whole = not near and run.attrs["status"] == "complete"
        if whole and _known(closure, until) is None and _closed_along(closure, time[chosen], z):
            _keep(closure, until, ())
        return _driven(closure, run, until)
    for k in near:
        first, last = chosen[max(0, k - 1)], chosen[min(chosen.size - 1, k + 1)]
        part = slice(int(first), int(last) + 1)
        warnings += _passed(closure, time[part], closure.of_motion(position[part], angle[part]), rotation[part])
    return [_passed_in_words(closure, singular, z) for singular, z in warnings]


def _pressed(plan: Plan, run: Any) -> bool:
    if not plan.contacts:
        return False
    at = plan.places(contact.name for contact in plan.contacts)
    names = ("peak_indentation", "clearance")
    depth, gap = (run.variables[name].values[at] for name in names)
    return bool(np.any(depth > PRESSED * gap))


def _closed_along(closure: Closure, time: np.ndarray, z: np.ndarray) -> bool:
    """Whether the ideal mechanism closes near the samples of a run, and is nowhere near a singular position.

    Between samples its drives may go farthest: it has to close there as well.
    """
    inputs = closure.inputs.over(time)
    ends = np.unique(np.concatenate([np.argmin(inputs, axis=0), np.argmax(inputs, axis=0)]))
    around = np.concatenate([np.linspace(time[max(0, k - 1)], time[min(time.size - 1, k + 1)], BETWEEN) for k in ends])
    guess = np.concatenate([z, np.repeat(z[ends], BETWEEN, axis=0)])
    closed = closure.close_all(guess, np.concatenate([inputs, closure.inputs.over(around)]))
    if closed is None or np.max(np.abs(closed[: time.size] - z)) > APART:
        return False
    side = np.linalg.slogdet(closure.jacobian(closed))[0]
    return bool(np.all(side == side[0])) and not suspects(measure(closure, closed[: time.size]))


def _driven(closure: Closure, run: Any, until: float) -> list[str]:
    """What the drives lead to, and how far clearances have let them go beyond a locking position."""
    plan, sentences = closure.plan, _said(closure, until)
    texts = [text for _, _, text in sentences]
    lock = min((time for time, kind, _ in sentences if kind == LOCKING), default=math.inf)
    joints = plan.contacts
    if not joints or not run.variables["time"].values.size or not float(run.variables["time"].values[-1]) > lock:
        return texts
    at = plan.places(joint.name for joint in joints)
    force = run.variables["normal_force"].values[:, at]
    k, largest = (int(index) for index in np.unravel_index(np.argmax(force), force.shape))
    time = float(run.variables["time"].values[k])
    if time >= lock:
        texts.append(
            f"the drive is forced beyond its locking position of t = {lock:.6g} s: forces from there on, up to "
            f"{force[k, largest]:.3g} N at joint '{joints[largest].name}' at t = {time:.6g} s, are those of "
            "surfaces that it presses into each other, which no real drive could"
        )
    return texts


def drive_warnings(plan: Plan, until: float) -> list[str]:
    """The singular positions that the drives of a mechanism lead its ideal counterpart to, in words."""
    if not plan.motions:
        return []
    if _equations(plan) > MOST_EQUATIONS:
        return [_not_looked_for(plan)]
    closure = _closure(plan)
    return [] if closure is None else [text for _, _, text in _said(closure, until)]


def _said(closure: Closure, until: float) -> tuple[Said, ...]:
    """The singular positions that the drives lead to; those asked for last are known, whatever the clearances."""
    statements = _known(closure, until)
    if statements is None:
        path = path_of(closure.plan, until, closure)
        statements = () if path is None else tuple(_of_path(path, until))
        _keep(closure, until, statements)
    return statements


def _known(closure: Closure, until: float) -> tuple[Said, ...] | None:
    stored_until, statements = closure.plan.answers.get("singular", (None, ()))
    return statements if stored_until == (closure.plan.drives, until) else None


def _keep(closure: Closure, until: float, said: tuple[Said, ...]) -> None:
    closure.plan.answers["singular"] = (closure.plan.drives, until), said


def _equations(plan: Plan) -> int:
    """Number of quadratic closure equations of the ideal mechanism at most."""
    rotating = sum(body.rotates for body in plan.bodies)
    others = (*plan.rods, *plan.mechanism.coupling_parts)
    return rotating + sum(guide.body != GROUND for guide in plan.mechanism.guides) + len(others)


def _not_looked_for(plan: Plan) -> str:
    count = _equations(plan)
    return f"singular positions were not looked for: {count} closure equations are more than {MOST_EQUATIONS}"


def _closure(plan: Plan) -> Closure | None:
    """The closure equations; None for a mechanism that only its clearances let close."""
    try:
        return Closure(plan)
    except InputError:
        return None


def path_warnings(path: Path, until: float) -> list[str]:
    """The singular positions of a path, in words, in the order of time."""
    return [text for _, _, text in _of_path(path, until)]


def _of_path(path: Path, until: float) -> list[Said]:
    statements: list[Said] = []
    for singular in path.singular:
        times = instants(path, until, singular.place)
        if not times:  # beyond the last position by round-off
            continue
        when = f"at t = {times[0]:.6g} s" + (f", the first of {len(times)} times," if len(times) > 1 else "")
        where = f"{when}{_input_in_words(path, singular.place)}"
        if singular.kind == CHANGE:
            text = f"change point {where}: {singular.subject} can go on on more than one branch of the assembly; {CHANCE}"
        elif singular.kind == NEAR:
            text = (
                f"near change point {where}: with lengths that differ by {singular.miss:.2g} of the mechanism's size "
                f"{singular.subject} could go on on another branch of the assembly"
            )
        else:
            text = f"locking position {where}: {singular.subject} hold{_s(singular)} it there; the drive cannot go on"
        statements.append(Said(times[0], singular.kind, text))
    return sorted(statements)


def _s(singular: SingularPosition) -> str:
    return "" if len(singular.bodies) > 1 else "s"


def _input_in_words(path: Path, place: float) -> str:
    inputs = path.closure.inputs
    if path.parameter == "time":
        values = inputs.at(place)
        names = [*inputs.bodies, *inputs.timed]
        words = [f"'{name}' at {_of_input(value, unit)}" for name, value, unit in zip(names, values, inputs.units, strict=True)]
        return f" ({', '.join(words)})"
    driven = {rod.name: "rod" for rod in path.closure.plan.rods}
    name = f"drive of '{inputs.bodies[0]}'" if inputs.bodies else f"{driven.get(inputs.timed[0], 'drive')} '{inputs.timed[0]}'"
    return f" ({name} at {_of_input(place, inputs.units[0])})"


def _of_input(value: float, unit: str) -> str:
    return f"{math.degrees(value):.6g} deg" if unit == "rad" else f"{1e3 * value:.6g} mm"


def _passed(
    closure: Closure, time: np.ndarray, z: np.ndarray, rotation: np.ndarray
) -> list[tuple[SingularPosition, np.ndarray]]:
    """Return the change point that consecutive samples of a free motion pass, and its position; nothing if they do not.

    Two samples are compared only if no body rotates by more than `COARSE` between them: the mean of two directions that are
    farther apart is much shorter than one, and the gradients of its length conditions vanish there.
    """
    values = np.array([smallest(closure, point) for point in z])
    k = int(np.argmin(values))
    left, _, right = np.linalg.svd(closure.jacobian(z[k]), full_matrices=False)
    test = np.einsum("m,kmn,n->k", left[:, -1], closure.jacobian(z), right[-1])
    for i in (k - 1, k):
        if not 0 <= i < len(z) - 1 or rotation[i] > COARSE or test[i] * test[i + 1] > 0.0:
            continue
        fraction = float(test[i] / (test[i] - test[i + 1])) if test[i] != test[i + 1] else 0.0
        between = z[i] + fraction * (z[i + 1] - z[i])
        if smallest(closure, between) <= PASSED * max(values[i], values[i + 1]):
            place = float(time[i] + fraction * (time[i + 1] - time[i]))
            return [(SingularPosition(CHANGE, place, *concerned(closure, between, float(np.median(values)))), between)]
    return []


def _passed_in_words(closure: Closure, singular: SingularPosition, z: np.ndarray) -> str:
    plan = closure.plan
    named = plan.mechanism.input_body or (singular.bodies[0] if singular.bodies else plan.bodies[0].name)
    angle = ""
    if plan.mechanism.body(named).rotates:
        p = closure.first[named]
        angle = f" ('{named}' at {math.degrees(math.atan2(z[p + 3], z[p + 2])):.4g} deg)"
    return (
        f"change point at t = {singular.place:.6g} s{angle}: {singular.subject} can go on on more than one branch of the "
        f"assembly; {CHANCE}"
    )
