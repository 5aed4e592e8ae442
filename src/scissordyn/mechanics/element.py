"""Springs, dampers, loads, motors and actuators in the equations of motion.

An element acts through up to three forms: u, a vector between two points or a point; a and b, the unit directions of its body
and its base. Columns of `System.element`: the element's numbers, then what it was last found to do.
"""

from __future__ import annotations

import math

import numpy as np

from scissordyn.control.signal import SIGNALS
from scissordyn.jit import kernel
from scissordyn.mechanics.actuator import actuator_torque, linearise_actuator
from scissordyn.mechanics.layout import Form, Layout, join_forms
from scissordyn.mechanics.link import link_forms, push_turns
from scissordyn.mechanics.motion import course_at, motion_rows
from scissordyn.model.body import GROUND
from scissordyn.model.drive import ConstantSpeed
from scissordyn.model.element import (
    Actuator,
    AngleStop,
    Element,
    Force,
    Motor,
    Spring,
    Torque,
    TorsionSpring,
    TravelStop,
    stop_damping,
)

__all__ = [
    "ELEMENT_NUMBERS",
    "add_element_forces",
    "courses",
    "element_form",
    "element_numbers",
    "linearise_element",
    "start_angle",
    "stop_gap",
    "stop_guards",
]

TURN = 2.0 * math.pi

SPRING, TORSION, FORCE, FOLLOWING, TORQUE, MOTOR, ACTUATOR, ANGLE_STOP, TRAVEL_STOP = range(9)

ELEMENT_NUMBERS = 12
"""Width of the table: kind, four numbers, energy stored [J], power given to the mechanism and power lost in dampers [W],
force on u [N] and torque on the body [N m], a fifth number."""


def element_numbers(element: Element, angle: float) -> tuple[float, ...]:
    """Kind and numbers of an element; `angle` is that of its body against its base at the start [rad]."""
    match element:
        case Spring():
            return SPRING, element.stiffness, element.free_length, element.damping
        case TorsionSpring():
            return TORSION, element.stiffness, element.free_angle, element.damping, angle
        case Force():
            return FOLLOWING if element.follows else FORCE, *element.force
        case Torque():
            return TORQUE, element.torque
        case Motor():
            limit = math.inf if element.limit is None else element.limit
            return MOTOR, element.stall_torque, element.no_load_speed, limit
        case AngleStop():
            law = element.stiffness, element.exponent, stop_damping(element)
            return ANGLE_STOP, *law, element.angle, *(6 * [0.0]), angle
        case TravelStop():
            law = element.stiffness, element.exponent, stop_damping(element)
            return TRAVEL_STOP, *law, element.limit, *(6 * [0.0]), element.direction
        case Actuator():
            controller = element.controller
            recorded = SIGNALS.index(controller.recorded) if controller.recorded else 0
            return ACTUATOR, controller.kernel_kind, controller.delay, recorded, controller.recursion_gain


def element_form(layout: Layout, element: Element) -> Form:
    """The six rows of an element on the union of their columns."""
    match element:
        case Spring():
            return join_forms([(layout.place(element.end), 0, 1.0), (layout.place(element.start), 0, -1.0)])
        case Force():
            return join_forms([(layout.place(element.point), 0, 1.0), (layout.direction(element.point[0]), 2, 1.0)])
        case TravelStop():
            return join_forms([(layout.place(element.point), 0, 1.0)])
        case _:
            base = layout.fixed_direction if element.base == GROUND else layout.direction(element.base)
            parts = [(layout.direction(element.body), 2, 1.0), (base, 4, 1.0)]
            if isinstance(element, Actuator) and element.sensor is not None:
                parts.append((layout.place(element.sensor), 0, 1.0))
                if element.sensor_origin is not None:
                    parts.append((layout.place(element.sensor_origin), 0, -1.0))
            return join_forms(parts)


@kernel(inline=True)
def relative_angle(start, ax, ay, bx, by):
    """Angle of a against b, within half a turn of its value at the start."""
    turned = math.atan2(bx * ay - by * ax, bx * ax + by * ay) - start
    return start + turned - TURN * math.floor(turned / TURN + 0.5)


@kernel(inline=True)
def motor_torque(E, i, spin):
    """Torque of a motor and its slope against the speed."""
    stall, top, limit = E[i, 1], E[i, 2], E[i, 3]
    slope = -abs(stall) / top
    torque = stall + slope * spin
    if torque > limit:
        return limit, 0.0
    if torque < -limit:
        return -limit, 0.0
    return torque, slope


@kernel(inline=True)
def stop_motion(E, i, ux, uy, vx, vy, ax, ay, bx, by, spin):
    """How far an end stop is passed, how fast, and the sense or the direction of travel towards it."""
    if int(E[i, 0]) == 7:
        side = 1.0 if E[i, 4] > E[i, 11] else -1.0
        return side * (relative_angle(E[i, 11], ax, ay, bx, by) - E[i, 4]), side * spin, side, 0.0
    nx, ny = math.cos(E[i, 11]), math.sin(E[i, 11])
    return nx * ux + ny * uy - E[i, 4], nx * vx + ny * vy, nx, ny


@kernel(inline=True)
def stop_force(E, i, delta, rate, approach):
    """Force or torque of an end stop, its derivatives by depth and rate, and its elastic energy."""
    if delta <= 0.0:
        return 0.0, 0.0, 0.0, 0.0
    n, damping = E[i, 2], E[i, 3] / approach
    elastic = E[i, 1] * delta**n
    energy = elastic * delta / (n + 1.0)
    factor = 1.0 + damping * rate
    if factor <= 0.0:
        return 0.0, 0.0, 0.0, energy
    return elastic * factor, n * elastic / delta * factor, elastic * damping, energy


@kernel(inline=True)
def stop_gap(i, S):
    """How far end stop i is passed, and how fast; negative before it is reached."""
    ux, uy, ax, ay, bx, by, vx, vy, px, py, qx, qy = link_forms(S.radius.shape[0] + i, S)
    spin = (ax * py - ay * px) - (bx * qy - by * qx)
    delta, rate, _, _ = stop_motion(S.element, i, ux, uy, vx, vy, ax, ay, bx, by, spin)
    return delta, rate


@kernel(inline=True)
def course_of(t, i, S):
    """Factor of element i at time t, and its rate."""
    first = S.course[i]
    if first < 0:
        return 1.0, 0.0
    course_at(t, S.motion[S.motion_start[first] : S.motion_start[first + 1]], S.angle)
    return S.angle[0], S.angle[1]


@kernel(inline=True)
def add_element_forces(t, i, S, z, dz):
    """Add element i to S.force, write its energy and powers into S.element and the rates of its hidden states into dz."""
    link = S.radius.shape[0] + i
    E = S.element
    forms = link_forms(link, S)
    ux, uy, ax, ay, bx, by, vx, vy, px, py, qx, qy = forms
    kind = int(E[i, 0])
    fx = fy = torque = energy = given = lost = 0.0
    spin = (ax * py - ay * px) - (bx * qy - by * qx)
    if kind == 0:
        length = math.sqrt(ux * ux + uy * uy)
        if length > 0.0:
            rate, stretch = (ux * vx + uy * vy) / length, length - E[i, 2]
            pull = E[i, 1] * stretch + E[i, 3] * rate
            fx, fy = -pull * ux / length, -pull * uy / length
            energy, lost = 0.5 * E[i, 1] * stretch * stretch, E[i, 3] * rate * rate
    elif kind == 1:
        stretch = relative_angle(E[i, 4], ax, ay, bx, by) - E[i, 2]
        torque = -E[i, 1] * stretch - E[i, 3] * spin
        energy, lost = 0.5 * E[i, 1] * stretch * stretch, E[i, 3] * spin * spin
    elif kind == 5:
        torque, _ = motor_torque(E, i, spin)
        given = torque * spin
    elif kind == 6:
        torque = actuator_torque(t, i, S, forms, z, dz)
        given = torque * spin
    elif kind >= 7:
        if S.mode[S.guard[i]] == 1:
            delta, rate, fx, fy = stop_motion(E, i, ux, uy, vx, vy, ax, ay, bx, by, spin)
            push, _, _, energy = stop_force(E, i, delta, rate, S.approach[S.guard[i]])
            lost = (push - E[i, 1] * max(delta, 0.0) ** E[i, 2]) * rate
            if kind == 7:
                torque, fx = -push * fx, 0.0
            else:
                fx, fy = -push * fx, -push * fy
    else:
        factor, _ = course_of(t, i, S)
        if kind == 4:
            torque = factor * E[i, 1]
            given = torque * spin
        else:
            fx, fy = factor * E[i, 1], factor * E[i, 2]
            if kind == 3:
                fx, fy = fx * ax - fy * ay, fx * ay + fy * ax
            given = fx * vx + fy * vy
    E[i, 5], E[i, 6], E[i, 7] = energy, given, lost
    E[i, 8], E[i, 9], E[i, 10] = fx, fy, torque
    push_turns(link, S, fx, fy, torque, -torque, ax, ay, bx, by, S.force, 0, S.n + S.nb)


@kernel(inline=True)
def linearise_element(t, i, S, z, dt, first_state):
    """Write the derivatives of element i's generalized forces into S.block_x and S.block_v.

    What time alone changes is added to dt[n:], and to dt[first_state:] for the rates of the hidden states z.
    """
    link = S.radius.shape[0] + i
    E, K, D = S.element, S.element_x, S.element_v
    ux, uy, ax, ay, bx, by, vx, vy, px, py, qx, qy = link_forms(link, S)
    kind = int(E[i, 0])
    K[:, :] = 0.0
    D[:, :] = 0.0
    spin = (ax * py - ay * px) - (bx * qy - by * qx)
    torque = by_angle = by_spin = 0.0
    if kind == 0:
        length = math.sqrt(ux * ux + uy * uy)
        if length > 0.0:
            nx, ny = ux / length, uy / length
            along = nx * vx + ny * vy
            pull = E[i, 1] * (length - E[i, 2]) + E[i, 3] * along
            # rate of the length against u: the part of u' across the spring, over its length
            wx, wy = (vx - along * nx) / length, (vy - along * ny) / length
            gx, gy = E[i, 1] * nx + E[i, 3] * wx, E[i, 1] * ny + E[i, 3] * wy
            across = pull / length
            K[0, 0] = -nx * gx - across * (1.0 - nx * nx)
            K[0, 1] = -nx * gy + across * nx * ny
            K[1, 0] = -ny * gx + across * nx * ny
            K[1, 1] = -ny * gy - across * (1.0 - ny * ny)
            D[0, 0], D[0, 1] = -E[i, 3] * nx * nx, -E[i, 3] * nx * ny
            D[1, 0], D[1, 1] = -E[i, 3] * ny * nx, -E[i, 3] * ny * ny
    elif kind == 1:
        torque = -E[i, 1] * (relative_angle(E[i, 4], ax, ay, bx, by) - E[i, 2]) - E[i, 3] * spin
        by_angle, by_spin = -E[i, 1], -E[i, 3]
    elif kind == 5:
        torque, by_spin = motor_torque(E, i, spin)
    elif kind == 6:
        torque = linearise_actuator(t, i, S, z, dt, first_state)
    elif kind >= 7:
        if S.mode[S.guard[i]] == 1:
            delta, rate, nx, ny = stop_motion(E, i, ux, uy, vx, vy, ax, ay, bx, by, spin)
            push, by_delta, by_rate, _ = stop_force(E, i, delta, rate, S.approach[S.guard[i]])
            if kind == 7:
                torque, by_angle, by_spin = -push * nx, -by_delta, -by_rate
            else:
                K[0, 0], K[0, 1], K[1, 0], K[1, 1] = (
                    -by_delta * nx * nx,
                    -by_delta * nx * ny,
                    -by_delta * nx * ny,
                    -by_delta * ny * ny,
                )
                D[0, 0], D[0, 1], D[1, 0], D[1, 1] = (
                    -by_rate * nx * nx,
                    -by_rate * nx * ny,
                    -by_rate * nx * ny,
                    -by_rate * ny * ny,
                )
    else:
        factor, rate = course_of(t, i, S)
        fx, fy = E[i, 1], E[i, 2]
        if kind == 4:
            torque = factor * E[i, 1]
            push_turns(link, S, 0.0, 0.0, rate * E[i, 1], -rate * E[i, 1], ax, ay, bx, by, dt, S.n, S.n)
        elif kind == 2:
            push_turns(link, S, rate * fx, rate * fy, 0.0, 0.0, ax, ay, bx, by, dt, S.n, S.n)
        else:
            gx, gy = fx * ax - fy * ay, fx * ay + fy * ax
            push_turns(link, S, rate * gx, rate * gy, 0.0, 0.0, ax, ay, bx, by, dt, S.n, S.n)
            K[0, 2], K[0, 3] = factor * fx, -factor * fy
            K[1, 2], K[1, 3] = factor * fy, factor * fx
    if kind == 1 or 4 <= kind <= 7:
        # torque on a as force (-a_y, a_x), on b the opposite; d angle = (J a) da - (J b) db
        arm = (-ay, ax, by, -bx)
        turn = (-ay, ax, by, -bx)
        rate_of_turn = (py, -px, -qy, qx)
        for r in range(4):
            for c in range(4):
                K[2 + r, 2 + c] += arm[r] * (by_angle * turn[c] + by_spin * rate_of_turn[c])
                D[2 + r, 2 + c] += arm[r] * by_spin * turn[c]
        K[2, 3] -= torque
        K[3, 2] += torque
        K[4, 5] += torque
        K[5, 4] -= torque
    row, start, count = S.link_row, S.link_start[link], S.link_start[link + 1] - S.link_start[link]
    block = S.block_start[link]
    for a in range(count):
        for b in range(count):
            x = v = 0.0
            for r in range(6):
                for c in range(6):
                    weight = row[r, start + a] * row[c, start + b]
                    x += weight * K[r, c]
                    v += weight * D[r, c]
            S.block_x[block + a * count + b] = x
            S.block_v[block + a * count + b] = v


def start_angle(layout: Layout, element: Element) -> float:
    """Angle of an element's body against its base as placed [rad]; zero for elements without bodies' angles."""
    if isinstance(element, Spring | Force | TravelStop):
        return 0.0
    base = 0.0 if element.base == GROUND else layout.mechanism.body(element.base).angle
    return layout.mechanism.body(element.body).angle - base


def courses(layout: Layout, first: int) -> tuple[np.ndarray, np.ndarray, list[np.ndarray]]:
    """For each element the index of its course in the motion table, from `first` on, or -1, and of its feed-forward torque.

    Then the pieces of these courses.
    """
    index, feed = np.full((2, len(layout.mechanism.elements)), -1, np.int64)
    pieces: list[np.ndarray] = []
    for i, element in enumerate(layout.mechanism.elements):
        if isinstance(element, Actuator):
            index[i] = first + len(pieces)
            pieces.append(motion_rows(element.reference or ConstantSpeed(0.0), start_angle(layout, element)))
            if element.feed_forward is not None:
                feed[i] = first + len(pieces)
                pieces.append(motion_rows(element.feed_forward, 0.0))
        elif isinstance(element, Force | Torque) and element.time_function is not None:
            index[i] = first + len(pieces)
            pieces.append(motion_rows(element.time_function, 0.0))
    return index, feed, pieces


def stop_guards(elements: tuple[Element, ...], first: int) -> np.ndarray:
    """The guard of each end stop, from `first` on; -1 for other elements."""
    stops = np.array([isinstance(element, AngleStop | TravelStop) for element in elements], bool)
    return np.where(stops, first + np.cumsum(stops) - 1, -1).astype(np.int64)
