"""Actuators in the equations of motion: what they sense, the torque that their controllers give, and how both change.

An actuator's three forms are s, the vector of its sensor, and a, b, the unit directions of its body and its base. Its row of
`System.element` holds: kind, tag of the controller, delay, place of the recorded signal and its memory R.
"""

from __future__ import annotations

import math

import numpy as np

from scissordyn.control.controller import PARAMETERS
from scissordyn.control.dispatch import control_torque
from scissordyn.control.signal import DELAYED, ERROR, FEED_FORWARD, REFERENCE, SENSOR, SIGNALS, SPEED
from scissordyn.jit import kernel
from scissordyn.mechanics.link import link_forms, push_turns
from scissordyn.mechanics.motion import course_at
from scissordyn.model.element import Actuator, Element

__all__ = ["actuator_torque", "controller_tables", "linearise_actuator", "recorded_signal"]

TURN = 2.0 * math.pi
SIGNAL_COUNT = len(SIGNALS)


def controller_tables(elements: tuple[Element, ...]) -> tuple[np.ndarray, np.ndarray]:
    """For each element the numbers of its controller, and which column of the history it records, or -1.

    Parameters
    ----------
    elements : tuple of Element

    Returns
    -------
    parameters : ndarray, shape (elements, PARAMETERS)
    recorder : ndarray of int, shape (elements,)
    """
    parameters, recorder = np.zeros((len(elements), PARAMETERS)), np.full(len(elements), -1, np.int64)
    for i, element in enumerate(elements):
        if isinstance(element, Actuator):
            numbers = element.controller.parameters()
            parameters[i, : len(numbers)] = numbers
            if element.controller.delay > 0.0:
                recorder[i] = np.max(recorder, initial=-1) + 1
    return parameters, recorder


@kernel(inline=True)
def past_signal(when, column, S):
    """A recorded signal at an earlier instant, and its rate; before the start it is constant."""
    rows, count = S.history, S.kept[0]
    if count == 0 or when <= rows[0, 0]:
        return S.past[column], 0.0
    low, high = 0, count - 1
    while low < high:  # the last step that begins at or before `when`
        middle = (low + high + 1) // 2
        if rows[middle, 0] <= when:
            low = middle
        else:
            high = middle - 1
    degree = (rows.shape[1] - 2) // S.past.size
    first = 2 + column * degree
    s = 2.0 * (when - rows[low, 0]) / rows[low, 1] - 1.0
    value = slope = 0.0
    for k in range(degree - 1, -1, -1):
        slope = slope * s + value
        value = value * s + rows[low, first + k]
    return value, 2.0 * slope / rows[low, 1]


@kernel(inline=True)
def sense(t, i, S, forms):
    """Write the signals of element i into S.signal, and their rates at a fixed state into S.signal_rate."""
    ux, uy, ax, ay, bx, by, vx, vy, px, py, qx, qy = forms
    q, rate = S.signal, S.signal_rate
    course_at(t, S.motion[S.motion_start[S.course[i]] : S.motion_start[S.course[i] + 1]], S.angle)
    for order in range(3):
        q[REFERENCE + order], rate[REFERENCE + order] = S.angle[order], S.angle[order + 1]
    error = S.angle[0] - math.atan2(bx * ay - by * ax, bx * ax + by * ay)
    # into (-pi, pi]
    q[ERROR], rate[ERROR] = error - TURN * math.ceil(error / TURN - 0.5), S.angle[1]
    q[SPEED], rate[SPEED] = (ax * py - ay * px) - (bx * qy - by * qx), 0.0
    q[SENSOR], q[SENSOR + 1], q[SENSOR + 2], q[SENSOR + 3] = ux, uy, vx, vy
    for k in range(SENSOR, SENSOR + 4):
        rate[k] = 0.0
    q[DELAYED] = rate[DELAYED] = q[FEED_FORWARD] = rate[FEED_FORWARD] = 0.0
    if S.recorder[i] >= 0:
        q[DELAYED], rate[DELAYED] = past_signal(t - S.element[i, 2], S.recorder[i], S)
    if S.feed[i] >= 0:
        course_at(t, S.motion[S.motion_start[S.feed[i]] : S.motion_start[S.feed[i] + 1]], S.angle)
        q[FEED_FORWARD], rate[FEED_FORWARD] = S.angle[0], S.angle[1]


@kernel(inline=True)
def actuator_torque(t, i, S, forms, z, dz):
    """Torque of element i [N m]; writes the rates of its controller's states into dz, and what it observed."""
    sense(t, i, S, forms)
    S.observed[i, 0] = S.signal[ERROR]
    S.observed[i, 1] = S.signal[int(S.element[i, 3])] + S.element[i, 4] * S.signal[DELAYED]
    return control_torque(int(S.element[i, 1]), t, S.signal, z, dz, S.control[i])


@kernel(inline=True)
def recorded_signal(t, i, S):
    """What element i records: S(t) = y(t) + R S(t - T)."""
    sense(t, i, S, link_forms(S.radius.shape[0] + i, S))
    return S.signal[int(S.element[i, 3])] + S.element[i, 4] * S.signal[DELAYED]


@kernel(inline=True)
def controller_slopes(t, i, S, z):
    """Write the derivatives of torque and state rates by signals, states and time into S.slope, by central differences.

    Rows: the torque, then the states' rates. Columns: signals, states, time.
    """
    states, q, p, tag = z.size, S.signal, S.control[i], int(S.element[i, 1])
    up, down = S.control_work[0, :states], S.control_work[1, :states]
    for k in range(SIGNAL_COUNT + states + 1):
        ahead = behind = t
        if k == SIGNAL_COUNT + states:
            h = 1e-7 * (1.0 + abs(t))
            ahead, behind = t + h, t - h
            high = control_torque(tag, ahead, q, z, up, p)
            low = control_torque(tag, behind, q, z, down, p)
        elif k < SIGNAL_COUNT:
            here = q[k]
            h = 1e-6 * abs(here) + 1e-9
            q[k] = here + h
            high = control_torque(tag, t, q, z, up, p)
            q[k] = here - h
            low = control_torque(tag, t, q, z, down, p)
            q[k] = here
        else:
            here = z[k - SIGNAL_COUNT]
            h = 1e-6 * abs(here) + 1e-9
            z[k - SIGNAL_COUNT] = here + h
            high = control_torque(tag, t, q, z, up, p)
            z[k - SIGNAL_COUNT] = here - h
            low = control_torque(tag, t, q, z, down, p)
            z[k - SIGNAL_COUNT] = here
        S.slope[0, k] = (high - low) / (2.0 * h)
        for s in range(states):
            S.slope[1 + s, k] = (up[s] - down[s]) / (2.0 * h)


@kernel(inline=True)
def linearise_actuator(t, i, S, z, dt, first_state):
    """Write the derivatives of element i's forms' forces into S.element_x and S.element_v, and those of its states.

    Adds what time alone changes to dt[n:] and dt[first_state:]; returns the torque.
    """
    link, states = S.radius.shape[0] + i, z.size
    forms = link_forms(link, S)
    _, _, ax, ay, bx, by, _, _, px, py, qx, qy = forms
    sense(t, i, S, forms)
    torque = control_torque(int(S.element[i, 1]), t, S.signal, z, S.control_work[0, :states], S.control[i])
    controller_slopes(t, i, S, z)
    slope, K, D = S.slope, S.element_x, S.element_v
    row, start, count = S.link_row, S.link_start[link], S.link_start[link + 1] - S.link_start[link]
    arm = (-ay, ax, by, -bx)
    rate_of_turn = (py, -px, -qy, qx)
    for output in range(1 + states):
        by_time = slope[output, SIGNAL_COUNT + states]
        for k in range(SIGNAL_COUNT):
            by_time += slope[output, k] * S.signal_rate[k]
        # the error falls as the angle grows; d angle = arm . d(a, b), d spin = rate_of_turn . d(a, b) + arm . d(a', b')
        by_angle, by_spin = -slope[output, ERROR], slope[output, SPEED]
        if output == 0:
            push_turns(link, S, 0.0, 0.0, by_time, -by_time, ax, ay, bx, by, dt, S.n, S.n)
            for r in range(4):
                for c in range(2):
                    K[2 + r, c] = arm[r] * slope[0, SENSOR + c]
                    D[2 + r, c] = arm[r] * slope[0, SENSOR + 2 + c]
                for c in range(4):
                    K[2 + r, 2 + c] = arm[r] * (by_angle * arm[c] + by_spin * rate_of_turn[c])
                    D[2 + r, 2 + c] = arm[r] * by_spin * arm[c]
            continue
        s = output - 1
        dt[first_state + s] += by_time
        for b in range(count):
            k = start + b
            x = row[0, k] * slope[output, SENSOR] + row[1, k] * slope[output, SENSOR + 1]
            v = row[0, k] * slope[output, SENSOR + 2] + row[1, k] * slope[output, SENSOR + 3]
            for c in range(4):
                x += row[2 + c, k] * (by_angle * arm[c] + by_spin * rate_of_turn[c])
                v += row[2 + c, k] * by_spin * arm[c]
            at = S.force_state_start[link] + b * states + s
            S.rate_by_x[at], S.rate_by_v[at] = x, v
        for k in range(states):
            S.rate_by_state[S.state_state_start[link] + s * states + k] = slope[output, SIGNAL_COUNT + k]
    for b in range(count):
        lever = 0.0
        for c in range(4):
            lever += row[2 + c, start + b] * arm[c]
        for s in range(states):
            S.force_by_state[S.force_state_start[link] + b * states + s] = lever * slope[0, SIGNAL_COUNT + s]
    return torque
