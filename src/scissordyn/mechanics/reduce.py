"""From a mechanism to its reduced model: linear constraints are eliminated, the mass matrix becomes the identity.

Each body is its origin p and, if it rotates, the unit vector d along its x axis; every point of it is p + x d + y J d,
linear in both. Pins, guides and prescribed directions are linear constraints, and so is the parallelism of opposite bars in a
parallelogram of ideal joints. What remains: coordinates = T [x; b(t)], with T constant, x the free coordinates scaled so
that their mass matrix is the identity, b = (1, cos th_1, sin th_1, ...) the prescribed directions, and quadratic
constraints: |d|^2 = 1 per family of parallel bars, and one for each guide on a moving body, rod and latch.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from scissordyn.component.actuator import Actuator
from scissordyn.component.motor import Motor
from scissordyn.component.place import GROUND
from scissordyn.errors import InputError
from scissordyn.kept import kept
from scissordyn.mechanics.elimination import Elimination, add, scaled
from scissordyn.mechanics.parallelogram import parallel_bodies
from scissordyn.mechanics.quadratic_constraints import find_constraints
from scissordyn.mechanics.reduced_model import ReducedModel, point_expression
from scissordyn.mechanics.redundancy import independent
from scissordyn.model.body import Body
from scissordyn.model.connection import Weld
from scissordyn.model.mechanism import Mechanism

__all__ = ["body_inertia", "reduce_mechanism"]

SMALL = 200
"""Up to so many natural coordinates full matrices are quicker to handle than sparse ones."""


@kept
def reduce_mechanism(mechanism: Mechanism) -> ReducedModel:
    """Eliminate all linear constraints of a mechanism.

    Parameters
    ----------
    mechanism : Mechanism

    Returns
    -------
    ReducedModel

    Raises
    ------
    InputError
        If the joints and drives contradict each other.
    """
    offsets: dict[str, int] = {}
    preferred: list[bool] = []
    for body in mechanism.bodies:
        offsets[body.name] = len(preferred)
        # origins are eliminated before directions: lengths then stay short expressions
        preferred += [True, True, False, False] if body.rotates else [True, True]
    total, basis, size = len(preferred), 1 + 2 * len(mechanism.drives), mechanism.size
    elimination = Elimination(preferred, basis)
    impose_all(mechanism, offsets, total, size, elimination)
    start, columns, values = elimination.rows()

    is_free = elimination.solved_at[:total] < 0
    free = int(np.sum(is_free))
    position = np.concatenate([np.cumsum(is_free) - 1, free + np.arange(basis)])
    # origins are in units of the mechanism's size
    unit = np.where(np.concatenate([[True, True, False, False][: 4 if b.rotates else 2] for b in mechanism.bodies]), size, 1.0)
    data = values * np.repeat(unit, np.diff(start))
    coordinates: Any = sp.csr_array((data, position[columns], start), shape=(total, free + basis))
    mass: Any = _mass(mechanism, offsets, total)
    if total <= SMALL:
        coordinates, mass = coordinates.toarray(), mass.toarray()
    try:
        coordinates = _normalized(coordinates, mass, free)
    except np.linalg.LinAlgError:
        raise _lost_inertia(mechanism) from None
    bare = ReducedModel(mechanism, free, basis, coordinates, mass, offsets, size)
    return independent(bare.with_constraints(find_constraints(bare, elimination)))


def _lost_inertia(mechanism: Mechanism) -> InputError:
    """The error for a mass matrix that is not positive definite in floating point."""

    def fraction(body: Body) -> float:
        x, y = body.centre
        return body_inertia(mechanism, body) / (body.mass * (x * x + y * y) or 1.0) if body.rotates else math.inf

    body = min(mechanism.bodies, key=fraction)
    return InputError(
        f"body '{body.name}': inertia = {body.inertia!r} kg m^2 is lost in rounding beside mass {body.mass:g} kg times the "
        f"square of its mass centre's distance {math.hypot(*body.centre):g} m from its origin",
        "an origin near the mass centre, or a larger inertia",
    )


def _between(one: str, other: str) -> str:
    """Two bodies in words, one of which may be the ground."""
    names = [f"'{name}'" for name in (one, other) if name != GROUND]
    return f"bodies {names[0]} and {names[1]}" if len(names) == 2 else f"body {names[0]} and the ground"


def impose_all(mechanism: Mechanism, offsets: dict[str, int], ones: int, size: float, elimination: Elimination) -> None:
    """Impose all linear constraints of a mechanism, origins and lengths in units of `size`."""
    for index, drive in enumerate(mechanism.drives):
        d = offsets[drive.body] + 2
        for axis in (0, 1):
            elimination.impose({d + axis: 1.0, ones + 1 + 2 * index + axis: -1.0}, f"the drive of body '{drive.body}'")
    for one, other, angle in parallel_bodies(mechanism):
        _impose_angle(offsets, ones, elimination, one, other, angle, f"the parallelogram of {_between(one, other)}")
    for weld in mechanism.welds:
        _impose_weld(mechanism, offsets, ones, size, elimination, weld)
    for joint in mechanism.ideal_joints:
        here = point_expression(mechanism, offsets, joint.journal, ones, size)
        there = point_expression(mechanism, offsets, joint.bearing, ones, size)
        name = f"joint '{joint.name}' of {_between(*joint.bodies)}"
        for axis in (0, 1):
            elimination.impose(add(here[axis], scaled(-1.0, there[axis])), name)
    for guide in mechanism.ideal_guides:
        if guide.aligned:
            follower = mechanism.body(guide.follower[0])
            base = 0.0 if guide.body == GROUND else mechanism.body(guide.body).angle
            name = f"guide '{guide.name}'"
            _impose_angle(offsets, ones, elimination, guide.body, follower.name, follower.angle - base, name)
        if guide.body != GROUND:
            continue
        x, y = point_expression(mechanism, offsets, guide.follower, ones, size)
        across = -math.sin(guide.direction), math.cos(guide.direction)
        level = (across[0] * guide.through[0] + across[1] * guide.through[1]) / size
        name = f"guide '{guide.name}' of body '{guide.follower[0]}'"
        elimination.impose(add(scaled(across[0], x), scaled(across[1], y), {ones: -level}), name)


def _impose_weld(
    mechanism: Mechanism, offsets: dict[str, int], ones: int, size: float, elimination: Elimination, weld: Weld
) -> None:
    name = f"weld '{weld.name}' of {_between(weld.start[0], weld.end[0])}"
    here, there = (point_expression(mechanism, offsets, point, ones, size) for point in (weld.start, weld.end))
    rotating = [body for body, _ in (weld.start, weld.end) if body != GROUND and mechanism.body(body).rotates]
    angles = {body: mechanism.body(body).angle for body in rotating}
    if len(rotating) == 2:
        first, second = rotating
        _impose_angle(offsets, ones, elimination, first, second, angles[second] - angles[first], name)
    elif rotating:
        _impose_angle(offsets, ones, elimination, GROUND, rotating[0], angles[rotating[0]], name)
    for axis in (0, 1):
        elimination.impose(add(here[axis], scaled(-1.0, there[axis])), name)


def _impose_angle(
    offsets: dict[str, int], ones: int, elimination: Elimination, one: str, other: str, angle: float, name: str
) -> None:
    """Keep the direction of a body at a constant angle from that of another, or of the ground."""
    b, cos, sin = offsets[other] + 2, math.cos(angle), math.sin(angle)
    if one == GROUND:
        elimination.impose({b: 1.0, ones: -cos}, name)
        elimination.impose({b + 1: 1.0, ones: -sin}, name)
        return
    a = offsets[one] + 2
    elimination.impose({b: 1.0, a: -cos, a + 1: sin}, name)
    elimination.impose({b + 1: 1.0, a: -sin, a + 1: -cos}, name)


def body_inertia(mechanism: Mechanism, body: Body) -> float:
    """Moment of inertia of a body about its mass centre with the rotors of its motors and actuators [kg m^2]."""
    rotors = (part.inertia for part in mechanism.components if isinstance(part, Motor | Actuator) and part.body == body.name)
    return (body.inertia or 0.0) + sum(rotors)


def _mass(mechanism: Mechanism, offsets: dict[str, int], total: int) -> sp.csr_array:
    entries: list[tuple[int, int, float]] = []
    for body in mechanism.bodies:
        p, m, (x, y) = offsets[body.name], body.mass, body.centre
        entries += [(p, p, m), (p + 1, p + 1, m)]
        if body.inertia is None:
            continue
        about_origin = body_inertia(mechanism, body) + m * (x * x + y * y)
        entries += [(p + 2, p + 2, about_origin), (p + 3, p + 3, about_origin)]
        for row, column, value in ((p, p + 2, m * x), (p, p + 3, -m * y), (p + 1, p + 2, m * y), (p + 1, p + 3, m * x)):
            if value != 0.0:
                entries += [(row, column, value), (column, row, value)]
    rows, columns, values = zip(*entries, strict=True)
    return sp.csr_array((values, (rows, columns)), shape=(total, total))


def _normalized(coordinates: Any, mass: Any, free: int) -> Any:
    """Scale and mix the free coordinates, block by block, so that their mass matrix is the identity."""
    moving = coordinates[:, :free]
    if isinstance(coordinates, np.ndarray):
        lower = np.linalg.cholesky(moving.T @ mass @ moving)
        coordinates[:, :free] = moving @ np.linalg.inv(lower).T
        return coordinates
    reduced = sp.csr_array(moving.T @ mass @ moving)
    count, label = connected_components(reduced, directed=False)
    order = np.argsort(label, kind="stable")
    sizes = np.bincount(label, minlength=count)
    blocks, first = [], 0
    for size in sizes.tolist():
        members = order[first : first + size]
        lower = np.linalg.cholesky(reduced[members][:, members].toarray())
        blocks.append(np.linalg.inv(lower).T)
        first += size
    back = np.argsort(order)
    mixing = sp.csr_array(sp.block_diag(blocks, format="csr"))[back][:, back]
    result = sp.csr_array(sp.hstack([moving @ mixing, coordinates[:, free:]]))
    result.eliminate_zeros()
    result.sort_indices()
    return result
