"""Positions of bodies, and forces on them."""

from __future__ import annotations

import math
from typing import NamedTuple

from scissordyn.kernel import F1, F2, F3, I1, I2, kernel


class BodyMaps(NamedTuple):
    """Maps from the columns to mass centres and x axes of the bodies, and points at which other parts act on the bodies."""

    start: I1  # Maps of the mass centre (rows 0 and 1) and of the x axis (rows 2 and 3) of each body
    column: I1
    row: F2
    rotation: I1  # (bodies,) Family of parallel bodies; -1 for a body that does not rotate
    sense: F1  # (bodies,) Sense: the body's angle is sense times that of the family plus offset [rad]
    offset: F1  # (bodies,)
    body: I2  # (acting + rods, 2) Bodies of force elements, then of rods; -1 for the ground
    arm: F3  # (acting + rods, 2, 2) Points of application from the mass centres, in the frames of the bodies [m]
    rod: I1  # (rods,) Constraint of each rod
    rod_scale: F1  # (rods,) Lengths by which their maps are divided [m]
    # (terms, 5) Coordinates of couplings and drives: constraint, kind of `COORDINATES`, body, base (-1 for the ground),
    # and the body that bears the reaction of a slide
    coupling: I2
    coupling_factor: F1  # (terms,) Force on the coordinate per unit multiplier
    # (terms, 2, 2) Points of application on body and base, relative to mass centres or in the fixed frame [m]; the second
    # of a slide is its direction in the frame of the base
    coupling_arm: F3
    # (p, 4) Workless forces of teeth and belts: constraint, kind of `PRESSURES`, first and second body
    pressure: I2
    pressure_factor: F1  # (p,) Force per unit multiplier (`pressure_size`)
    pressure_number: F2  # (p, 2)
    # (p, 2, 2) Centres of both wheels, relative to mass centres or in the fixed frame [m]; the second of a rack is its normal
    pressure_arm: F3


# Kinds of coordinates of couplings and drives; LINE: line of centres of two wheels
COORDINATES = ANGLE, SLIDE, DISTANCE, LINE = range(4)
PRESSURES = GEARS, BELT, RACK = range(3)  # Kinds of constraint forces without work: of gears, a belt, or a rack and its pinion


@kernel
def mapped(B, body, x):
    """Return mass centre and x axis of a body for the columns x, or their accelerations for accelerations of the columns."""
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
    """Add a force at a point of a body, and a torque, to the body's load."""
    if body < 0:
        return
    cos, sin = R.direction[at, body, 0], R.direction[at, body, 1]
    ax, ay = cos * arm_x - sin * arm_y, sin * arm_x + cos * arm_y
    R.load[at, body, 0] += fx
    R.load[at, body, 1] += fy
    R.load[at, body, 2] += ax * fy - ay * fx + torque


@kernel
def at_point(at, body, x, y, R):
    """Return a point, given relative to a body's mass centre, in the fixed frame."""
    if body < 0:
        return x, y
    cos, sin = R.direction[at, body, 0], R.direction[at, body, 1]
    return R.position[at, body, 0] + cos * x - sin * y, R.position[at, body, 1] + sin * x + cos * y


@kernel
def push_at(at, body, x, y, fx, fy, R):
    """Add a force at a point of the fixed frame to the load of a body."""
    if body >= 0:
        R.load[at, body, 0] += fx
        R.load[at, body, 1] += fy
        R.load[at, body, 2] += (x - R.position[at, body, 0]) * fy - (y - R.position[at, body, 1]) * fx


@kernel
def load_couplings(at, multiplier, B, R):
    """Add the forces of couplings and coordinate drives to the loads of bodies and bases."""
    for e in range(B.coupling.shape[0]):
        kind, body, base = B.coupling[e, 1], B.coupling[e, 2], B.coupling[e, 3]
        back, force, arm = B.coupling[e, 4], B.coupling_factor[e] * multiplier[B.coupling[e, 0]], B.coupling_arm[e]
        if kind == ANGLE:
            push(at, body, 0.0, 0.0, 0.0, 0.0, force, R)
            push(at, base, 0.0, 0.0, 0.0, 0.0, -force, R)
            continue
        x, y = at_point(at, body, arm[0, 0], arm[0, 1], R)
        other_x, other_y, ux, uy = x, y, arm[1, 0], arm[1, 1]
        if kind in (DISTANCE, LINE):
            other_x, other_y = at_point(at, base, arm[1, 0], arm[1, 1], R)
            length = math.hypot(x - other_x, y - other_y)
            ux, uy = (x - other_x) / length, (y - other_y) / length
            if kind == LINE:  # a torque on the line is a pair of forces across it
                ux, uy = -uy / length, ux / length
        elif base >= 0:
            cos, sin = R.direction[at, base, 0], R.direction[at, base, 1]
            ux, uy = cos * arm[1, 0] - sin * arm[1, 1], sin * arm[1, 0] + cos * arm[1, 1]
        push_at(at, body, x, y, force * ux, force * uy, R)
        push_at(at, back, other_x, other_y, -force * ux, -force * uy, R)


@kernel
def pressure_size(at, e, multiplier, B, R):
    """Return the workless force e of teeth or a belt, positive if it pushes apart, and its derivative by the multiplier.

    For teeth it is T/r tan(a). For a belt it is the sum of its tensions, at least the pretension, times the cosine of its
    spans.
    """
    kind, value = B.pressure[e, 1], multiplier
    size, slope = B.pressure_factor[e] * abs(value), B.pressure_factor[e] * (1.0 if value >= 0.0 else -1.0)
    if kind == RACK:
        return size, slope
    x, y = at_point(at, B.pressure[e, 2], B.pressure_arm[e, 0, 0], B.pressure_arm[e, 0, 1], R)
    other_x, other_y = at_point(at, B.pressure[e, 3], B.pressure_arm[e, 1, 0], B.pressure_arm[e, 1, 1], R)
    length = math.hypot(x - other_x, y - other_y)
    if kind == GEARS:
        return size / length, slope / length
    sine = B.pressure_number[e, 1] / length
    cosine = math.sqrt(1.0 - sine * sine)
    if size < B.pressure_number[e, 0]:
        return -cosine * B.pressure_number[e, 0], 0.0
    return -cosine * size, -cosine * slope


@kernel
def push_apart(at, e, size, B, R):
    """Add the workless force e of teeth or a belt, with a given size, to the loads of both bodies."""
    first, second, arm = B.pressure[e, 2], B.pressure[e, 3], B.pressure_arm[e]
    x, y = at_point(at, first, arm[0, 0], arm[0, 1], R)
    other_x, other_y, ux, uy = x, y, arm[1, 0], arm[1, 1]
    if B.pressure[e, 1] == RACK:
        if second >= 0:
            cos, sin = R.direction[at, second, 0], R.direction[at, second, 1]
            ux, uy = cos * arm[1, 0] - sin * arm[1, 1], sin * arm[1, 0] + cos * arm[1, 1]
    else:
        other_x, other_y = at_point(at, second, arm[1, 0], arm[1, 1], R)
        length = math.hypot(x - other_x, y - other_y)
        ux, uy = (x - other_x) / length, (y - other_y) / length
    push_at(at, first, x, y, size * ux, size * uy, R)
    push_at(at, second, other_x, other_y, -size * ux, -size * uy, R)
