"""From a mechanism to constant matrices: natural coordinates with all linear joints eliminated.

Each body is its origin p and, if it rotates, the unit vector d along its x axis; every point of it is p + x d + y J d,
linear in both. Pins, guides and prescribed directions are linear conditions, and so is the parallelism of opposite bars in a
parallelogram of ideal joints. What is left: coordinates = T [x; b(t)], with T constant, x the free coordinates scaled so
that their mass matrix is the identity, b = (1, cos th_1, sin th_1, ...) the prescribed directions, and quadratic
conditions: |d|^2 = 1 per family of parallel bars, and one for each guide on a moving body, massless link and latch.
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from scissordyn.errors import InputError
from scissordyn.mechanics.conditions import find_conditions
from scissordyn.mechanics.elimination import Elimination, add, scaled
from scissordyn.mechanics.form import Condition, Form, Layout, join_forms, point_expression
from scissordyn.mechanics.parallelogram import parallel_bodies
from scissordyn.mechanics.redundancy import independent
from scissordyn.model.body import GROUND, Body
from scissordyn.model.connection import Weld
from scissordyn.model.element import Actuator, Motor
from scissordyn.model.mechanism import Mechanism

__all__ = ["Condition", "Form", "Layout", "join_forms", "lay_out", "turning_inertia"]


SMALL = 200
"""Up to so many natural coordinates full matrices are quicker to handle than sparse ones."""


def lay_out(mechanism: Mechanism) -> Layout:
    """Eliminate all linear conditions of a mechanism.

    Parameters
    ----------
    mechanism : Mechanism

    Returns
    -------
    Layout

    Raises
    ------
    InputError
        If the joints and drives contradict each other.
    """
    offsets, total = {}, 0
    preferred: list[bool] = []
    for body in mechanism.bodies:
        offsets[body.name] = total
        # origins are eliminated before directions: lengths then stay short expressions
        preferred += [True, True, False, False] if body.rotates else [True, True]
        total = len(preferred)
    elimination = Elimination(preferred)
    _impose(mechanism, offsets, total, elimination)

    free = [column for column in range(total) if column not in elimination.solved]
    basis = 1 + 2 * len(mechanism.drives)
    position = {column: index for index, column in enumerate(free)}
    position.update({total + index: len(free) + index for index in range(basis)})
    entries = [
        (row, position[column], value)
        for row in range(total)
        for column, value in (elimination.resolve({row: 1.0}) if row in elimination.solved else {row: 1.0}).items()
    ]
    table = np.array(entries, float).reshape(-1, 3)
    shape = (total, len(free) + basis)
    coordinates = sp.csr_array((table[:, 2], (table[:, 0].astype(int), table[:, 1].astype(int))), shape=shape)
    mass, weight = _mass(mechanism, offsets, total), _weight(mechanism, offsets, total)
    try:
        coordinates = _normalize(coordinates, mass, len(free))
    except np.linalg.LinAlgError:
        raise _lost_inertia(mechanism) from None
    bare = Layout(mechanism, len(free), basis, coordinates, mass, offsets, weight, ())
    full = dataclasses.replace(bare, conditions=find_conditions(bare, elimination))
    return independent(full)


def _lost_inertia(mechanism: Mechanism) -> InputError:
    """The error for a mass matrix that is not positive definite in floating point."""

    def share(body: Body) -> float:
        x, y = body.centre
        return turning_inertia(mechanism, body) / (body.mass * (x * x + y * y) or 1.0) if body.rotates else math.inf

    body = min(mechanism.bodies, key=share)
    return InputError(
        f"body '{body.name}': inertia = {body.inertia!r} kg m^2 is lost in rounding beside mass {body.mass:g} kg times the "
        f"square of its mass centre's distance {math.hypot(*body.centre):g} m from its origin",
        "an origin near the mass centre, or a larger inertia",
    )


def _between(one: str, other: str) -> str:
    """Two bodies in words, one of which may be the ground."""
    names = [f"'{name}'" for name in (one, other) if name != GROUND]
    return f"bodies {names[0]} and {names[1]}" if len(names) == 2 else f"body {names[0]} and the ground"


def _impose(mechanism: Mechanism, offsets: dict[str, int], ones: int, elimination: Elimination) -> None:
    for index, drive in enumerate(mechanism.drives):
        d = offsets[drive.body] + 2
        for axis in (0, 1):
            elimination.impose({d + axis: 1.0, ones + 1 + 2 * index + axis: -1.0}, f"the drive of body '{drive.body}'")
    for one, other, turn in parallel_bodies(mechanism):
        name = f"the parallelogram of {_between(one, other)}"
        _impose_turn(offsets, ones, elimination, one, other, turn, name)
    for weld in mechanism.welds:
        _impose_weld(mechanism, offsets, ones, elimination, weld)
    for joint in mechanism.ideal_joints:
        here = point_expression(mechanism, offsets, joint.journal, ones)
        there = point_expression(mechanism, offsets, joint.bearing, ones)
        name = f"joint '{joint.name}' of {_between(*joint.bodies)}"
        for axis in (0, 1):
            elimination.impose(add(here[axis], scaled(-1.0, there[axis])), name)
    for guide in mechanism.guides:
        if guide.clearance is not None:
            continue
        if guide.aligned:
            follower = mechanism.body(guide.follower[0])
            base = 0.0 if guide.body == GROUND else mechanism.body(guide.body).angle
            _impose_turn(offsets, ones, elimination, guide.body, follower.name, follower.angle - base, f"guide '{guide.name}'")
        if guide.body != GROUND:
            continue
        x, y = point_expression(mechanism, offsets, guide.follower, ones)
        across = -math.sin(guide.direction), math.cos(guide.direction)
        level = across[0] * guide.through[0] + across[1] * guide.through[1]
        name = f"guide '{guide.name}' of body '{guide.follower[0]}'"
        elimination.impose(add(scaled(across[0], x), scaled(across[1], y), {ones: -level}), name)


def _impose_weld(mechanism: Mechanism, offsets: dict[str, int], ones: int, elimination: Elimination, weld: Weld) -> None:
    name = f"weld '{weld.name}' of {_between(weld.start[0], weld.end[0])}"
    here, there = (point_expression(mechanism, offsets, point, ones) for point in (weld.start, weld.end))
    turning = [body for body, _ in (weld.start, weld.end) if body != GROUND and mechanism.body(body).rotates]
    angles = {body: mechanism.body(body).angle for body in turning}
    if len(turning) == 2:
        first, second = turning
        _impose_turn(offsets, ones, elimination, first, second, angles[second] - angles[first], name)
    elif turning:
        _impose_turn(offsets, ones, elimination, GROUND, turning[0], angles[turning[0]], name)
    for axis in (0, 1):
        elimination.impose(add(here[axis], scaled(-1.0, there[axis])), name)


def _impose_turn(
    offsets: dict[str, int], ones: int, elimination: Elimination, one: str, other: str, turn: float, name: str
) -> None:
    """Keep the direction of a body at a constant angle from that of another, or of the ground."""
    b, cos, sin = offsets[other] + 2, math.cos(turn), math.sin(turn)
    if one == GROUND:
        elimination.impose({b: 1.0, ones: -cos}, name)
        elimination.impose({b + 1: 1.0, ones: -sin}, name)
        return
    a = offsets[one] + 2
    elimination.impose({b: 1.0, a: -cos, a + 1: sin}, name)
    elimination.impose({b + 1: 1.0, a: -sin, a + 1: -cos}, name)


def turning_inertia(mechanism: Mechanism, body: Body) -> float:
    """Moment of inertia of a body about its mass centre with the rotors of its motors and actuators [kg m^2]."""
    motors = (element for element in mechanism.elements if isinstance(element, Motor | Actuator))
    rotors = (motor.inertia for motor in motors if motor.body == body.name)
    return (body.inertia or 0.0) + sum(rotors)


def _mass(mechanism: Mechanism, offsets: dict[str, int], total: int) -> sp.csr_array:
    rows, columns, values = [], [], []

    def enter(row: int, column: int, value: float) -> None:
        rows.append(row)
        columns.append(column)
        values.append(value)

    for body in mechanism.bodies:
        p, m, (x, y) = offsets[body.name], body.mass, body.centre
        enter(p, p, m)
        enter(p + 1, p + 1, m)
        if body.inertia is None:
            continue
        about_origin = turning_inertia(mechanism, body) + m * (x * x + y * y)
        enter(p + 2, p + 2, about_origin)
        enter(p + 3, p + 3, about_origin)
        for row, column, value in ((p, p + 2, m * x), (p, p + 3, -m * y), (p + 1, p + 2, m * y), (p + 1, p + 3, m * x)):
            enter(row, column, value)
            enter(column, row, value)
    return sp.csr_array((values, (rows, columns)), shape=(total, total))


def _weight(mechanism: Mechanism, offsets: dict[str, int], total: int) -> np.ndarray:
    weight = np.zeros(total)
    gx = mechanism.gravity * math.cos(mechanism.gravity_direction)
    gy = mechanism.gravity * math.sin(mechanism.gravity_direction)
    for body in mechanism.bodies:
        p, m, (x, y) = offsets[body.name], body.mass, body.centre
        weight[p : p + 2] = m * gx, m * gy
        if body.rotates:
            weight[p + 2 : p + 4] = m * (x * gx + y * gy), m * (x * gy - y * gx)
    return weight


def _normalize(coordinates: sp.csr_array, mass: sp.csr_array, free: int) -> sp.csr_array:
    """Scale and mix the free coordinates, block by block, so that their mass matrix is the identity."""
    if coordinates.shape[0] <= SMALL:
        dense = coordinates.toarray()
        moving = dense[:, :free]
        lower = np.linalg.cholesky(moving.T @ mass.toarray() @ moving)
        dense[:, :free] = moving @ np.linalg.inv(lower).T
        return sp.csr_array(dense)
    reduced = sp.csr_array(coordinates[:, :free].T @ mass @ coordinates[:, :free])
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
    mixed = coordinates[:, :free] @ mixing
    result = sp.csr_array(sp.hstack([mixed, coordinates[:, free:]]))
    result.eliminate_zeros()
    result.sort_indices()
    return result
