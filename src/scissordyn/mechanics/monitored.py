"""Powers for the energy balance, and the quantities that are monitored in the loop."""

from __future__ import annotations

import math

from scissordyn.jit import kernel

__all__ = [
    "COMPONENT_FORCE",
    "DRIVE_TORQUE",
    "POWERS",
    "PRESSURE_VELOCITY",
    "constraint_forces",
    "drive_torque",
    "monitor",
]

POWERS = ("drive_work", "damping_loss", "friction_loss", "load_work", "damper_loss", "motor_work")
"""Integrals of the energy balance [J], in the order in which `monitor` writes their powers."""

DRIVES, DAMPING, FRICTION, LOADS, DAMPERS, MOTORS = range(len(POWERS))

DRIVE_TORQUE, COMPONENT_FORCE, PRESSURE_VELOCITY = range(3)
"""Kinds of quantities that are monitored throughout: `Model.monitor` holds kind and index."""


@kernel(inline=True)
def constraint_forces(S, target):
    """Write what the drives exert on each entry of b beyond the constant one into target[0:nb]."""
    M, W = S.model, S.work
    n, nb = M.n, M.nb
    for i in range(nb):
        total = -W.force[n + i]
        for k in range(n):
            total += M.inertia[k, i] * W.A[k]
        for k in range(nb):
            total += M.inertia_b[i, k] * W.basis[2, k]
        target[i] = total
    for k in range(W.multiplier.size):
        for i in range(M.constraint_start[k], M.constraint_start[k + 1]):
            column = M.constraint_column[i] - n
            if column >= 0:
                target[column] += W.gradient[i] * W.multiplier[k]


@kernel(inline=True)
def drive_torque(d, S):
    """Torque of drive d [N m], from `constraint_forces` in Work.work_b."""
    W = S.work
    i = 1 + 2 * d
    return W.work_b[i + 1] * W.basis[0, i] - W.work_b[i] * W.basis[0, i + 1]


@kernel(inline=True)
def component_size(i, S):
    """Size of the force or torque of component i."""
    out = S.work.result[i]
    if S.model.component_forces[i] == 1:
        return abs(out[0])
    return math.sqrt(out[0] * out[0] + out[1] * out[1])


@kernel(inline=True)
def monitor(t, y, S, power, rows):
    """Write the powers [W] of `POWERS`, and the monitored numbers of guards and of what is monitored throughout.

    A contact: normal force, powers of damping and friction; a component: its force; else the size of a quantity and its square.
    Everything stands in S since `accelerate` was called for the same instant and state.
    """
    M, W = S.model, S.work
    constraint_forces(S, W.work_b)
    total = 0.0
    for i in range(1, M.nb):
        total += W.work_b[i] * W.basis[1, i]
    for i in range(M.timed.size):
        total -= W.multiplier[M.timed[i]] * W.value[1, M.timed[i]]
    power[:] = 0.0
    power[DRIVES] = total
    for i in range(M.component_port.size):
        power[MOTORS if M.component_motor[i] == 1 else LOADS] += W.power_in[i]
        power[DAMPERS] += W.dissipation[i]
    rows[:, :] = 0.0
    contacts, guards = S.parameters.contact.size, S.state.mode.size
    for j in range(contacts):
        if S.state.mode[j] == 1:
            found, row = W.contact[j], rows[j]
            row[0] = found.normal
            row[1] = (found.normal - found.elastic) * found.rate
            row[2] = found.tangential * found.slip
            power[DAMPING] += row[1]
            power[FRICTION] += row[2]
    for guard in range(contacts, guards):
        if S.state.mode[guard] == 1:
            rows[guard, 0] = component_size(M.guard_component[guard], S)
    for k in range(M.monitor.shape[0]):
        kind, which, size = M.monitor[k, 0], M.monitor[k, 1], 0.0
        if kind == DRIVE_TORQUE:
            size = abs(drive_torque(which, S))
        elif kind == COMPONENT_FORCE:
            size = component_size(which, S)
        elif kind == PRESSURE_VELOCITY and S.state.mode[which] == 1:
            size = W.contact[which].normal * abs(W.contact[which].slip) / S.parameters.contact[which].area
        rows[guards + k, 0] = size
        rows[guards + k, 1] = size * size
