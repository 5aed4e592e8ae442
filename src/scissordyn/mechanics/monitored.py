"""Powers for the energy balance, and monitored quantities of the time loop."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from scissordyn.kernel import kernel
from scissordyn.laws.evaluate import friction_limit
from scissordyn.mechanics.constraint_solver import expand_track
from scissordyn.mechanics.contact import contact_at
from scissordyn.mechanics.equations import accelerate
from scissordyn.mechanics.system import COMPONENT_RESULTS_MAX
from scissordyn.mechanics.worn_contact import add_loads

if TYPE_CHECKING:
    from scissordyn.mechanics.system import Model

POWERS = ("drive_work", "damping_loss", "friction_loss", "load_work", "damper_loss", "motor_work")
"""Integrals of the energy balance [J], in the order of the powers that `monitor` writes."""

DRIVES, DAMPING, FRICTION, LOADS, DAMPERS, MOTORS = range(len(POWERS))  # Indices of the powers in `POWERS`
BALANCED = len(POWERS)  # number of powers in the energy balance; loads on worn bearings follow them (`worn_contact.add_loads`)

(
    DRIVE_TORQUE,
    COMPONENT_FORCE,
    PRESSURE_VELOCITY,
    INDENTATION,
    FRICTION_RATIO,
    TRACK_DEVIATION,
    COMPONENT_OUTPUT,
    JOINT_FORCE,
    CONTACT_FORCE,
    COUPLING_FORCE,
) = range(10)
"""Kinds of monitored quantities; `Model.monitor` contains kind and index.

The index of a component's output is the component times `COMPONENT_RESULTS_MAX` plus the column among the results. The index of
an oiled joint's force is the contact times the number of components plus the film's component. `CONTACT_FORCE` combines normal
force and friction of a contact; `COUPLING_FORCE` is the multiplier of a constraint.
"""

# Kinds of monitored values that depend on one contact only
CONTACT_KINDS = PRESSURE_VELOCITY, INDENTATION, FRICTION_RATIO, CONTACT_FORCE

FRICTION_RATIO_MAX = 1.05  # [-] largest ratio of friction force to its static limit without a warning


def monitored_rows(model: Model, kind: int) -> np.ndarray:
    """Return the rows of one kind of quantity, counted over guards and monitored quantities."""
    return np.asarray(model.guard_component.size + np.flatnonzero(model.monitor[:, 0] == kind))


def companions(model: Model) -> np.ndarray:
    """Return for each guard the row of its contact's force including friction; -1 if that is the normal force."""
    rows = np.full(model.guard_component.size, -1)
    rows[model.monitor[model.monitor[:, 0] == CONTACT_FORCE, 1]] = monitored_rows(model, CONTACT_FORCE)
    return rows


def oiled_contacts(model: Model) -> np.ndarray:
    """Return the contacts of the rows of `JOINT_FORCE`."""
    return np.asarray(model.monitor[model.monitor[:, 0] == JOINT_FORCE, 1] // max(model.component_port.size, 1))


def entries_read(model: Model, contacts: int) -> tuple[np.ndarray, np.ndarray]:
    """Return starts (rows + 1,) and indices of the entries of y that each row of guards and quantities needs; none for all."""

    def of_contact(j: int) -> list[int]:
        columns = [c for c in model.element_column[model.element_start[j] : model.element_start[j + 1]].tolist() if c < model.n]
        states = range(2 * model.n + int(model.state_start[j]), 2 * model.n + int(model.state_start[j + 1]))
        return [*columns, *(model.n + column for column in columns), *states]

    def of_row(row: int) -> list[int]:
        guards = model.guard_component.size
        kind, which = (-1, row) if row < guards else model.monitor[row - guards].tolist()
        if row < contacts or kind in CONTACT_KINDS:
            return of_contact(which)
        if kind == TRACK_DEVIATION:
            columns = model.track_column[model.track_start[which] : model.track_start[which + 1]].tolist()
            return [column for column in columns if column < model.n]
        return []

    entries_of_rows = [of_row(row) for row in range(model.guard_component.size + model.monitor.shape[0])]
    start = np.cumsum([0, *map(len, entries_of_rows)], dtype=np.int64)
    return start, np.array([entry for entries in entries_of_rows for entry in entries], np.int64)


@kernel
def constraint_forces(S, target):
    """Write the generalised force of the drives on each time-dependent entry b[i] to target[i]; b[0] = 1 is not driven."""
    M, W = S.model, S.work
    n, nb = M.n, M.nb
    for i in range(1, nb):
        total = -W.force[n + i]
        for row in range(M.coupled.size):
            total += M.inertia[M.coupled[row], i] * W.A[M.coupled[row]]
        for k in range(nb):
            total += M.inertia_b[i, k] * W.basis[2, k]
        target[i] = total
    for k in range(W.multiplier.size):
        for i in range(M.constraint_start[k], M.constraint_start[k + 1]):
            column = M.constraint_column[i] - n
            if column >= 0:
                target[column] += W.gradient[i] * W.multiplier[k]


@kernel
def drive_torque(d, S):
    """Return the torque of drive d [N m], from `constraint_forces` in Work.work_b."""
    W = S.work
    i = 1 + 2 * d
    return W.work_b[i + 1] * W.basis[0, i] - W.work_b[i] * W.basis[0, i + 1]


@kernel
def component_size(i, S):
    """Return the magnitude of the force or torque of component i."""
    out = S.work.result[i]
    if S.model.component_forces[i] == 1:
        return abs(out[0])
    return math.sqrt(out[0] * out[0] + out[1] * out[1])


@kernel
def joint_force(which, S):
    """Return the magnitude of an oiled joint's force: metallic contact and film together."""
    components, W = S.model.component_port.size, S.work
    j = which // components
    film = W.wrench[S.parameters.contact.size + which % components]
    fx, fy = film[0], film[1]
    if S.state.mode[j] == 1:
        fx += W.wrench[j, 0]
        fy += W.wrench[j, 1]
    return math.sqrt(fx * fx + fy * fy)


@kernel
def friction_ratio(j, S):
    """Return the friction of contact j divided by the largest that its law allows at rest plus viscosity."""
    contact, P = S.work.contact[j], S.parameters
    if not contact.normal > 0.0:
        return 0.0
    limit = friction_limit(P.law[j].limit, contact.slip, contact.normal, P.friction[j])
    return abs(contact.tangential) / limit if limit > 0.0 else 0.0


@kernel
def track_deviation(t, k, S):
    """Return the distance [m] of tracked point k from the ideal mechanism, by a quintic between nodes; 0 beyond them."""
    M, P, X = S.model, S.parameters, S.work.X
    last = P.ideal.shape[0] - 1
    if last < 1:
        return 0.0
    h = P.ideal_step[0]
    if t > (last + 1e-9) * h:
        return 0.0
    node = min(int(t / h), last - 1)
    u = t / h - node
    end = u * u * u * (10.0 + u * (6.0 * u - 15.0))
    slope, end_slope = u + u * u * u * (u * (8.0 - 3.0 * u) - 6.0), u * u * u * (u * (7.0 - 3.0 * u) - 4.0)
    bend, end_bend = 0.5 * u * u * (1.0 + u * (u * (3.0 - u) - 3.0)), 0.5 * u * u * u * (1.0 + u * (u - 2.0))
    square = 0.0
    for axis in range(2):
        place, c = 0.0, 6 * k + axis
        for i in range(M.track_start[k], M.track_start[k + 1]):
            place += M.track_row[axis, i] * X[M.track_column[i]]
        a, b = P.ideal[node], P.ideal[node + 1]
        ideal = (1.0 - end) * a[c] + end * b[c]
        ideal += h * (slope * a[c + 2] + end_slope * b[c + 2]) + h * h * (bend * a[c + 4] + end_bend * b[c + 4])
        square += (place - ideal) * (place - ideal)
    return math.sqrt(square)


@kernel
def write_row(t, row, S, out):
    """Write one row of monitored quantities from the current contents of S.

    A contact has normal force and powers of damping and friction; a component's guard has its force. Other rows have a
    magnitude and its square, or for a friction ratio whether the limit is exceeded.
    """
    M, W, mode = S.model, S.work, S.state.mode
    if row < S.parameters.contact.size:
        contact = W.contact[row]
        acts = mode[row] == 1
        out[0] = contact.normal if acts else 0.0
        out[1] = (contact.normal - contact.elastic) * contact.rate if acts else 0.0
        out[2] = contact.tangential * contact.slip if acts else 0.0
        return
    out[2] = 0.0
    if row < mode.size:
        out[0] = component_size(M.guard_component[row], S) if mode[row] == 1 else 0.0
        out[1] = 0.0
        return
    kind, which, size = M.monitor[row - mode.size, 0], M.monitor[row - mode.size, 1], 0.0
    if kind == DRIVE_TORQUE:
        size = abs(drive_torque(which, S))
    elif kind == COMPONENT_FORCE:
        size = component_size(which, S)
    elif kind == COUPLING_FORCE:
        size = abs(W.multiplier[which])
    elif kind == TRACK_DEVIATION:
        size = track_deviation(t, which, S)
    elif kind == COMPONENT_OUTPUT:
        size = W.result[which // COMPONENT_RESULTS_MAX, which % COMPONENT_RESULTS_MAX]
    elif kind == JOINT_FORCE:
        size = joint_force(which, S)
    elif mode[which] == 1:
        if kind == PRESSURE_VELOCITY:
            size = W.contact[which].normal * abs(W.contact[which].slip) / S.parameters.contact[which].area
        elif kind == INDENTATION:
            size = W.contact[which].depth
        elif kind == FRICTION_RATIO:
            size = friction_ratio(which, S)
        elif kind == CONTACT_FORCE:
            normal, tangential = W.contact[which].normal, W.contact[which].tangential
            size = math.sqrt(normal * normal + tangential * tangential)
    out[0] = size
    if kind == FRICTION_RATIO:
        out[1] = 1.0 if size > FRICTION_RATIO_MAX else 0.0
    else:
        out[1] = size * size


@kernel
def monitor(t, y, S, power, rows):
    """Write the powers [W] of `POWERS` and all monitored quantities.

    `accelerate` must have been called for the same instant and state.
    """
    M, W = S.model, S.work
    constraint_forces(S, W.work_b)
    total = 0.0
    for i in range(1, M.nb):
        total += W.work_b[i] * W.basis[1, i]
    for i in range(M.timed.size):
        total -= W.multiplier[M.timed[i]] * W.value[1, M.timed[i]]
    motors = loads = dampers = damping = friction = 0.0
    for i in range(M.component_port.size):
        if M.component_motor[i] == 1:
            motors += W.power_in[i]
        else:
            loads += W.power_in[i]
        dampers += W.dissipation[i]
    for row in range(rows.shape[0]):
        write_row(t, row, S, rows[row])
    for j in range(S.parameters.contact.size):
        damping += rows[j, 1]
        friction += rows[j, 2]
    power[DRIVES], power[MOTORS], power[LOADS] = total, motors, loads
    power[DAMPING], power[FRICTION], power[DAMPERS] = damping, friction, dampers
    if power.size > BALANCED:
        add_loads(S, power, BALANCED)


@kernel
def probe(t, y, row, S, dy, out):
    """Write one row of monitored quantities for an instant and a state; `entries_read` lists the entries of y it needs.

    Contacts and tracked points are evaluated separately, all others with the whole right-hand side.
    """
    M, guards = S.model, S.state.mode.size
    kind, which = -1, row
    if row >= guards:
        kind, which = M.monitor[row - guards, 0], M.monitor[row - guards, 1]
    if kind == TRACK_DEVIATION:
        expand_track(t, y, which, S)
    elif row < S.parameters.contact.size or kind in (PRESSURE_VELOCITY, INDENTATION, FRICTION_RATIO, CONTACT_FORCE):
        if S.state.mode[which] == 1:
            contact_at(t, y, which, S)
    else:
        accelerate(t, y, S, dy)
        constraint_forces(S, S.work.work_b)
    write_row(t, row, S, out)
