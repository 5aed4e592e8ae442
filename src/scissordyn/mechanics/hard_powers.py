"""Powers and monitored quantities of a step with hard contacts, for the energy balance."""

from __future__ import annotations

import math

from scissordyn.kernel import kernel
from scissordyn.mechanics.force_element import map_values
from scissordyn.mechanics.hard_result import FRICTION_LOSS, IMPULSE, RESTITUTION_LOSS
from scissordyn.mechanics.hard_rows import along
from scissordyn.mechanics.monitored import BALANCED, DAMPERS, DAMPING, DRIVE_TORQUE, FRICTION, LOADS, MOTORS, monitor
from scissordyn.mechanics.worn_contact import add_contact_loads


@kernel
def hard_monitor(t, h, y, S, H, power, rows):
    """Write powers and monitored quantities as means over the last step; NaN if an impact makes them infinite."""
    M, guards = S.model, S.state.mode.size
    monitor(t, y, S, power, rows)
    for i in range(H.model.which.size):
        if H.model.compliant[i] == 1:
            continue
        j, out = H.model.which[i], H.work.result[i]
        if H.state.stuck[i] == 1:
            H.state.stick[i] += h
        power[DAMPING] += out[RESTITUTION_LOSS] / h - rows[j, 1]
        power[FRICTION] += out[FRICTION_LOSS] / h - rows[j, 2]
        rows[j, 0], rows[j, 1], rows[j, 2] = out[IMPULSE] / h, out[RESTITUTION_LOSS] / h, out[FRICTION_LOSS] / h
    correct_powers(h, y, S, H, power)
    if power.size > BALANCED:
        add_hard_loads(h, 1.0 / h, S, H, power)
    if H.work.impact[0] == 1:
        for row in range(M.monitor.shape[0]):
            if M.monitor[row, 0] == DRIVE_TORQUE:
                rows[guards + row, 0] = math.nan


@kernel
def add_hard_loads(h, scale, S, H, power):
    """Add the loads that wear hard contacts, by the impulses of the last step, times a factor, to the powers.

    The slip speed is the mean of those before and after the impulse, as in the friction loss. The force is the mean over h.
    """
    m = S.work.multiplier.size
    for i in range(H.model.which.size):
        impulse = H.work.result[i, IMPULSE]
        if H.model.compliant[i] == 0 and impulse > 0.0:
            b = H.model.place[m + 2 * i + 1]
            slip = 0.5 * abs(H.work.velocity[b] + H.work.before[b])
            add_contact_loads(H.model.which[i], S, scale * impulse * slip, impulse / h, power, BALANCED)


@kernel
def correct_powers(h, y, S, H, power):
    """Correct the powers of components: use the mean of the velocities before and after the step, not the middle one."""
    M, W = S.model, S.work
    n, contacts = M.n, S.parameters.contact.size
    for i in range(M.component_port.size):
        if M.component_passive[i] == 1:
            continue
        e = contacts + i
        _, _, ax, ay, bx, by, _, _, _, _, _, _ = map_values(e, S)
        more = 0.0
        for k in range(M.element_start[e], M.element_start[e + 1]):
            column = M.element_column[k]
            if column < n:
                force = W.wrench[e, 0] * M.element_row[0, k] + W.wrench[e, 1] * M.element_row[1, k]
                force += W.wrench[e, 2] * (ax * M.element_row[3, k] - ay * M.element_row[2, k])
                force += W.wrench[e, 3] * (bx * M.element_row[5, k] - by * M.element_row[4, k])
                more += force * (y[n + column] + 0.5 * h * W.A[column] - W.V[column])
        power[MOTORS if M.component_motor[i] == 1 else LOADS] += more
    first = W.multiplier.size + 2 * H.model.which.size
    for c in range(H.model.damped.size):
        if H.work.damping[c] == 0:
            continue
        at, middle = H.model.place[first + c], along(first + c, W.V, S, H)
        mean = middle - H.work.impulse[at] / h  # mean of U before and after
        if M.component_motor[H.model.damped[c]] == 1:
            power[MOTORS] += H.work.impulse[at] * mean / h
        elif M.component_passive[H.model.damped[c]] == 1:
            power[DAMPERS] += mean * mean - middle * middle
        else:
            power[LOADS] += H.work.impulse[at] * mean / h
