"""Where bodies are, and forces on them."""

from __future__ import annotations

import math
from typing import NamedTuple

from scissordyn.kernel import F1, F2, F3, I1, I2, kernel


class BodyMaps(NamedTuple):
    """Where the bodies are, and where force elements, rods and latches act on them."""

    start: I1  # Maps of the mass centre (rows 0 and 1) and of the x axis (rows 2 and 3) of each body
    column: I1
    row: F2
    rotation: I1  # (bodies,) Family of parallel bodies; -1 for a body that does not rotate
    sense: F1  # (bodies,) Its angle is sense times that of the family plus offset [rad]
    offset: F1  # (bodies,)
    body: I2  # (acting + rods, 2) On which bodies force elements act, then rods; -1 for the ground
    arm: F3  # (acting + rods, 2, 2) Points of application from the mass centres, in the frames of the bodies [m]
    rod: I1  # (rods,) Their constraints
    rod_scale: F1  # (rods,) Lengths that their maps are divided by [m]
    # (terms, 4) Of the coordinates of couplings and coordinate drives: constraint, kind of `COORDINATES`, body and base, -1 for
    # the ground
    coupling: I2
    coupling_factor: F1  # (terms,) Force on the coordinate for a multiplier of one
    # (terms, 2, 2) Points of application on body and base, from the mass centres or in the fixed frame [m]; of a slide the
    # second is its direction in the frame of the base
    coupling_arm: F3


COORDINATES = ANGLE, SLIDE, DISTANCE = range(3)


@kernel
def mapped(B, body, x):
    """Mass centre and x axis of a body from the columns, or their accelerations from those of the columns."""
    cx = cy = ux = uy = 0.0
    for i in range(B.start[body], B.start[body + 1]):
        column = x[B.column[i]]
        cx += B.row[0, i] * column
        cy += B.row[1, i] * column
        ux += B.row[2, i] * column
        uy += B.row[3, i] * column
    return cx, cy, ux, uy


@kernel
def push(at, body, arm_x, arm_y, fx, fy, torque, R):
    """Add a force at a point of a body, and a torque, to its load."""
    if body < 0:
        return
    cos, sin = R.direction[at, body, 0], R.direction[at, body, 1]
    ax, ay = cos * arm_x - sin * arm_y, sin * arm_x + cos * arm_y
    R.load[at, body, 0] += fx
    R.load[at, body, 1] += fy
    R.load[at, body, 2] += ax * fy - ay * fx + torque


@kernel
def at_point(at, body, x, y, R):
    """A point of a body, from its mass centre, in the fixed frame."""
    if body < 0:
        return x, y
    cos, sin = R.direction[at, body, 0], R.direction[at, body, 1]
    return R.position[at, body, 0] + cos * x - sin * y, R.position[at, body, 1] + sin * x + cos * y


@kernel
def push_at(at, body, x, y, fx, fy, R):
    """Add a force at a place of the fixed frame to the load of a body."""
    if body >= 0:
        R.load[at, body, 0] += fx
        R.load[at, body, 1] += fy
        R.load[at, body, 2] += (x - R.position[at, body, 0]) * fy - (y - R.position[at, body, 1]) * fx


@kernel
def load_couplings(at, multiplier, B, R):
    """Add what couplings and coordinate drives exert on bodies and bases to their loads."""
    for e in range(B.coupling.shape[0]):
        kind, body, base = B.coupling[e, 1], B.coupling[e, 2], B.coupling[e, 3]
        force, arm = B.coupling_factor[e] * multiplier[B.coupling[e, 0]], B.coupling_arm[e]
        if kind == ANGLE:
            push(at, body, 0.0, 0.0, 0.0, 0.0, force, R)
            push(at, base, 0.0, 0.0, 0.0, 0.0, -force, R)
            continue
        x, y = at_point(at, body, arm[0, 0], arm[0, 1], R)
        other_x, other_y, ux, uy = x, y, arm[1, 0], arm[1, 1]
        if kind == DISTANCE:
            other_x, other_y = at_point(at, base, arm[1, 0], arm[1, 1], R)
            length = math.hypot(x - other_x, y - other_y)
            ux, uy = (x - other_x) / length, (y - other_y) / length
        elif base >= 0:
            cos, sin = R.direction[at, base, 0], R.direction[at, base, 1]
            ux, uy = cos * arm[1, 0] - sin * arm[1, 1], sin * arm[1, 0] + cos * arm[1, 1]
        push_at(at, body, x, y, force * ux, force * uy, R)
        push_at(at, base, other_x, other_y, -force * ux, -force * uy, R)
