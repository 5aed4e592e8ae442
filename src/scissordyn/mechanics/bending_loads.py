"""Loads of flexible bars on the bodies that are their cross-sections, and the distributed mass of these bodies.

A body at the end of an element has half of the element's mass at its origin. The rest of the mass matrix, times acceleration
minus gravity, is a load of the body. The axis of a flexible bar is r(s) = sum S_k(s) q_k with shapes S_k and plane vectors q_k,
the shape vectors. Forces on shape vectors load the points and directions of the bar. A force along a unit direction has no
moment.
"""

from __future__ import annotations

from typing import NamedTuple

from scissordyn.kernel import F1, F2, I1, I2, kernel
from scissordyn.mechanics.body_maps import push
from scissordyn.mechanics.force_element import map_values


class BendingLoads(NamedTuple):
    """Tables of the loads of flexible bars on bodies; all are empty if no bar bends."""

    start: I1  # (bodies + 1,) Sparse rows of the distributed mass: forces on origin and direction per acceleration of columns
    column: I1
    row: F2  # (4, entries)
    weight: F2  # (bodies, 4) Forces per acceleration of gravity
    origin: F2  # (bodies, 2) Position relative to the mass centre, in the frame of the body [m]
    shape: F2  # (vectors, 2) Forces on the shape vectors of all bars [N], written during the evaluation of bars and rollers
    vector: I2  # (k, 3) Shape vectors that belong to bodies: index of the vector, its body, and 1 for a direction
    turned: F2  # (k, 2) Cosine and sine of the angle from the body's direction to the vector
    # (c, 5) Torques on cross-sections without a direction of their own: force element, its side, first shape vector of the
    # bar, 1 for a film (which acts at the journal), first entry of `couple_weight`
    couple: I2
    couple_turned: F2  # (c, 2)
    couple_weight: F1  # (c counts,) Slopes of the shapes at the cross-section
    couple_shapes: I1  # (c,) Number of shapes of the bar


@kernel
def clear_shape_forces(S):
    """Set the forces on the shapes of bending bars to zero before a new evaluation."""
    S.friction.bending.shape[:, :] = 0.0


@kernel
def note_shape_forces(first, count, x, y, factor_x, factor_y, S):
    """Add the forces on a bar's shape vectors, which begin at index `first`, to those that determine the friction in joints."""
    shape = S.friction.bending.shape
    if shape.shape[0] == 0:
        return
    for k in range(count):
        shape[first + k, 0] += factor_x * x[k]
        shape[first + k, 1] += factor_y * y[k]


@kernel
def add_couples(S):
    """Add the torques M on cross-sections without a direction to the forces on shape vectors: M J r' acts on the slope r'."""
    B, wrench = S.friction.bending, S.work.wrench
    for c in range(B.couple.shape[0]):
        element, side, first = B.couple[c, 0], B.couple[c, 1], B.couple[c, 2]
        if element < S.parameters.contact.size and S.state.mode[element] == 0:
            continue
        ux, uy, ax, ay, bx, by, _, _, _, _, _, _ = map_values(element, S)
        dx, dy = (ax, ay) if side == 0 else (bx, by)
        cos, sin = B.couple_turned[c, 0], B.couple_turned[c, 1]
        sx, sy = cos * dx - sin * dy, sin * dx + cos * dy
        torque, along = wrench[element, 2 + side], 0.0
        if B.couple[c, 3] == 1:
            along = (wrench[element, 0] * ux + wrench[element, 1] * uy) / (sx * sx + sy * sy)
        fx, fy = along * sx - torque * sy, along * sy + torque * sx
        for k in range(B.couple_shapes[c]):
            B.shape[first + k, 0] += B.couple_weight[B.couple[c, 4] + k] * fx
            B.shape[first + k, 1] += B.couple_weight[B.couple[c, 4] + k] * fy


@kernel
def load_bending(lane, A, S):
    """Add the inertial loads of flexible bars at accelerations A of the natural coordinates to one right-hand side, `lane`.

    Elastic forces and weight are added to lane 0 only.
    """
    R = S.friction
    B = R.bending
    if B.start.size == 0:
        return
    for body in range(R.maps.rotation.size):
        fx = fy = gx = gy = 0.0
        for e in range(B.start[body], B.start[body + 1]):
            a = A[B.column[e]]
            fx -= B.row[0, e] * a
            fy -= B.row[1, e] * a
            gx -= B.row[2, e] * a
            gy -= B.row[3, e] * a
        if lane == 0:
            fx, fy = fx + B.weight[body, 0], fy + B.weight[body, 1]
            gx, gy = gx + B.weight[body, 2], gy + B.weight[body, 3]
        push_natural(lane, body, fx, fy, gx, gy, R)
    if lane > 0:
        return
    add_couples(S)
    for v in range(B.vector.shape[0]):
        x, y = B.shape[B.vector[v, 0], 0], B.shape[B.vector[v, 0], 1]
        if B.vector[v, 2] == 0:
            push_natural(lane, B.vector[v, 1], x, y, 0.0, 0.0, R)
        else:
            cos, sin = B.turned[v, 0], B.turned[v, 1]
            push_natural(lane, B.vector[v, 1], 0.0, 0.0, cos * x + sin * y, cos * y - sin * x, R)


@kernel
def push_natural(lane, body, fx, fy, gx, gy, R):
    """Add a force on the origin of a body and a force g on its unit direction d, equivalent to the torque d x g."""
    dx, dy = R.direction[lane, body, 0], R.direction[lane, body, 1]
    push(lane, body, R.bending.origin[body, 0], R.bending.origin[body, 1], fx, fy, dx * gy - dy * gx, R)
