"""Where bodies are, and forces on them."""

from __future__ import annotations

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
