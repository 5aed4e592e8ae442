"""Actuators in the equations of motion: signals, controller torque, and their derivatives.

The three maps of an actuator are s, the vector of its sensor, and a and b, the unit vectors along its body and its base.
`Parameters.controller` has the address of its controller, `control` the controller's parameters, `actuator` the delay, the
index of the recorded signal and the recursion gain.
"""

from __future__ import annotations

from scissordyn.control.signal import DELAYED, ERROR, FEED_FORWARD, REFERENCE, SENSOR, SIGNALS, SPEED, control_torque
from scissordyn.kernel import kernel
from scissordyn.mechanics.force_element import add_torques, map_values
from scissordyn.mechanics.rotation import relative_angle
from scissordyn.mechanics.time_function import motion_at

SIGNAL_COUNT = len(SIGNALS)  # Number of measured signals that a controller can use

DELAY, RECORDED, GAIN = range(3)
"""Columns of `Parameters.actuator`: delay [s], index of the recorded signal, recursion gain R [1]."""


@kernel
def past_signal(when, column, S):
    """Return a recorded signal and its rate at an earlier instant; before t = 0 the signal is constant."""
    C = S.state
    rows, count = C.history, C.history_length[0]
    if count == 0 or when <= rows[0, 0]:
        return C.initial_history[column], 0.0
    low, high = 0, count - 1
    while low < high:  # the last step that begins at or before `when`
        middle = (low + high + 1) // 2
        if rows[middle, 0] <= when:
            low = middle
        else:
            high = middle - 1
    degree = (rows.shape[1] - 2) // C.initial_history.size
    first = 2 + column * degree
    s = 2.0 * (when - rows[low, 0]) / rows[low, 1] - 1.0
    value = slope = 0.0
    for k in range(degree - 1, -1, -1):
        slope = slope * s + value
        value = value * s + rows[low, first + k]
    return value, 2.0 * slope / rows[low, 1]


@kernel
def sense(t, i, S, maps):
    """Write the controller's signals of actuator i into Work.signal, their partial time derivatives into Work.signal_rate."""
    M, P, W = S.model, S.parameters, S.work
    ux, uy, ax, ay, bx, by, vx, vy, px, py, qx, qy = maps
    q, rate = W.signal, W.signal_rate
    motion_at(t, M.function[i], S)
    for order in range(3):
        q[REFERENCE + order], rate[REFERENCE + order] = W.function_value[order], W.function_value[order + 1]
    q[ERROR], rate[ERROR] = W.function_value[0] - relative_angle(i, S, ax, ay, bx, by), W.function_value[1]
    q[SPEED], rate[SPEED] = (ax * py - ay * px) - (bx * qy - by * qx), 0.0
    q[SENSOR], q[SENSOR + 1], q[SENSOR + 2], q[SENSOR + 3] = ux, uy, vx, vy
    for k in range(SENSOR, SENSOR + 4):
        rate[k] = 0.0
    q[DELAYED] = rate[DELAYED] = q[FEED_FORWARD] = rate[FEED_FORWARD] = 0.0
    if M.recorder[i] >= 0:
        q[DELAYED], rate[DELAYED] = past_signal(t - P.actuator[i, DELAY], M.recorder[i], S)
    if M.feed_forward[i] >= 0:
        motion_at(t, M.feed_forward[i], S)
        q[FEED_FORWARD], rate[FEED_FORWARD] = W.function_value[0], W.function_value[1]


@kernel
def torque_at(t, i, S, z, dz):
    """Return the torque [N m] of actuator i for the signals in Work.signal; write its controller's state rates to dz."""
    P, q = S.parameters, S.work.signal
    return control_torque(P.controller[i], t, q[int(P.actuator[i, RECORDED])], q, z, dz, P.control[i])


@kernel
def actuator_torque(t, i, S, maps, z, dz):
    """Return the torque [N m] of actuator i; write its angle error, recorded signal and its controller's state rates."""
    P, W = S.parameters, S.work
    sense(t, i, S, maps)
    W.observed[i, 0] = W.signal[ERROR]
    W.observed[i, 1] = W.signal[int(P.actuator[i, RECORDED])] + P.actuator[i, GAIN] * W.signal[DELAYED]
    return torque_at(t, i, S, z, dz)


@kernel
def recorded_signal(t, i, S):
    """Return the signal that actuator i records: S(t) = y(t) + R S(t - T), with the recursion gain R and the delay T."""
    P, W = S.parameters, S.work
    sense(t, i, S, map_values(P.contact.size + i, S))
    return W.signal[int(P.actuator[i, RECORDED])] + P.actuator[i, GAIN] * W.signal[DELAYED]


@kernel
def controller_slopes(t, i, S, z):
    """Write the derivatives of torque and state rates into Work.slope, by central differences.

    Rows are the torque and the rates of the states. Columns are signals, states and time.
    """
    P, W, first = S.parameters, S.work, S.model.state_start[S.parameters.contact.size + i]
    states, q = z.size, W.signal
    up, down = W.control_work[0, :states], W.control_work[1, :states]
    for k in range(SIGNAL_COUNT + states + 1):
        ahead = behind = t
        if k == SIGNAL_COUNT + states:
            h = 1e-7 * (1.0 + abs(t))
            ahead, behind = t + h, t - h
            high = torque_at(ahead, i, S, z, up)
            low = torque_at(behind, i, S, z, down)
        elif k < SIGNAL_COUNT:
            here = q[k]
            h = 1e-6 * abs(here) + 1e-9
            q[k] = here + h
            high = torque_at(t, i, S, z, up)
            q[k] = here - h
            low = torque_at(t, i, S, z, down)
            q[k] = here
        else:
            here = z[k - SIGNAL_COUNT]
            h = 1e-6 * abs(here) + 1e-9 * P.state_scale[first + k - SIGNAL_COUNT]
            z[k - SIGNAL_COUNT] = here + h
            high = torque_at(t, i, S, z, up)
            z[k - SIGNAL_COUNT] = here - h
            low = torque_at(t, i, S, z, down)
            z[k - SIGNAL_COUNT] = here
        W.slope[0, k] = (high - low) / (2.0 * h)
        for s in range(states):
            W.slope[1 + s, k] = (up[s] - down[s]) / (2.0 * h)


@kernel
def linearise_actuator(t, i, S, z, dt, first_state):
    """Write the derivatives of actuator i's forces by its map values and their rates into Work.by_map and Work.by_map_rate.

    The derivatives of its states are written, too. Those by time are added to dt[n:] and dt[first_state:]. Return the torque.
    """
    M, P, W = S.model, S.parameters, S.work
    element, states = P.contact.size + i, z.size
    maps = map_values(element, S)
    _, _, ax, ay, bx, by, _, _, px, py, qx, qy = maps
    sense(t, i, S, maps)
    torque = torque_at(t, i, S, z, W.control_work[0, :states])
    controller_slopes(t, i, S, z)
    slope, K, D = W.slope, W.by_map, W.by_map_rate
    row, start, count = M.element_row, M.element_start[element], M.element_start[element + 1] - M.element_start[element]
    arm = (-ay, ax, by, -bx)
    rate_of_turn = (py, -px, -qy, qx)
    for output in range(1 + states):
        by_time = slope[output, SIGNAL_COUNT + states]
        for k in range(SIGNAL_COUNT):
            by_time += slope[output, k] * W.signal_rate[k]
        # the error decreases as the angle grows; d angle = arm . d(a, b), d spin = rate_of_turn . d(a, b) + arm . d(a', b')
        by_angle, by_spin = -slope[output, ERROR], slope[output, SPEED]
        if output == 0:
            add_torques(element, S, 0.0, 0.0, by_time, -by_time, ax, ay, bx, by, dt, M.n, M.n)
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
            at = M.force_state_start[element] + b * states + s
            W.rate_by_x[at], W.rate_by_v[at] = x, v
        for k in range(states):
            W.rate_by_state[M.state_state_start[element] + s * states + k] = slope[output, SIGNAL_COUNT + k]
    for b in range(count):
        lever = 0.0
        for c in range(4):
            lever += row[2 + c, start + b] * arm[c]
        for s in range(states):
            W.force_by_state[M.force_state_start[element] + b * states + s] = lever * slope[0, SIGNAL_COUNT + s]
    return torque
