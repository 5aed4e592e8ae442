"""Outputs at the samples: motions of bodies, contact quantities, torques, energies, loads."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from scissordyn.components.port import AXIS
from scissordyn.kernel import F1, F2, I1, Handle, entry, kernel
from scissordyn.laws.evaluate import elastic_energy
from scissordyn.mechanics.body_maps import BodyMaps, load_couplings, pressure_size, push, push_apart
from scissordyn.mechanics.constraint_solver import engage, project, rod_force, value_errors
from scissordyn.mechanics.contact import kinematics, no_forces
from scissordyn.mechanics.equations import accelerate
from scissordyn.mechanics.monitored import constraint_forces, drive_torque
from scissordyn.mechanics.rotation import counted_angle, rotation_direction
from scissordyn.mechanics.sample import Record, Sampled
from scissordyn.mechanics.system import (
    COMPONENT_RESULTS_MAX,
    CONTACT_RESULT,
    MechanismState,
    System,
    Workspace,
    open_system,
)
from scissordyn.mechanics.worn_contact import worn_energy


@kernel
def write_bodies(at, B, S, R, counted):
    """Write the motion of the bodies at a sample; `counted` contains the angles of the families."""
    W = S.work
    for body in range(B.rotation.size):
        cx = cy = ux = uy = vx = vy = px = py = ax = ay = qx = qy = 0.0
        for i in range(B.start[body], B.start[body + 1]):
            x, v, a = W.X[B.column[i]], W.V[B.column[i]], W.A[B.column[i]]
            to_x, to_y, along_x, along_y = B.row[0, i], B.row[1, i], B.row[2, i], B.row[3, i]
            cx, cy, ux, uy = cx + to_x * x, cy + to_y * x, ux + along_x * x, uy + along_y * x
            vx, vy, px, py = vx + to_x * v, vy + to_y * v, px + along_x * v, py + along_y * v
            ax, ay, qx, qy = ax + to_x * a, ay + to_y * a, qx + along_x * a, qy + along_y * a
        R.position[at, body, 0], R.position[at, body, 1] = cx, cy
        R.velocity[at, body, 0], R.velocity[at, body, 1] = vx, vy
        R.acceleration[at, body, 0], R.acceleration[at, body, 1] = ax, ay
        R.direction[at, body, 0], R.direction[at, body, 1] = ux, uy
        k = B.rotation[body]
        R.angle[at, body] = B.offset[body] + (B.sense[body] * counted[k] if k >= 0 else 0.0)
        R.angular_velocity[at, body] = ux * py - uy * px
        R.angular_acceleration[at, body] = ux * qy - uy * qx


@kernel
def write_loads(at, B, S, R):
    """Write the loads of contacts, components, rods, latches and couplings at a sample."""
    M, W = S.model, S.work
    acting_parts = W.wrench.shape[0]
    for e in range(B.body.shape[0]):
        wrench = R.wrench[at, e]
        if e < acting_parts:
            for q in range(4):
                wrench[q] = W.wrench[e, q]
        else:
            scale = B.rod_scale[e - acting_parts]
            wrench[0], wrench[1] = rod_force(B.rod[e - acting_parts], scale, W.multiplier, S)
            wrench[2] = wrench[3] = 0.0
    for latch in range(M.latch.shape[0]):
        e = S.parameters.contact.size + M.latch[latch, 2]
        locking = -W.multiplier[M.latch[latch, 0]] * (1.0 - W.inactive[M.latch[latch, 0]])
        R.wrench[at, e, 2], R.wrench[at, e, 3] = locking, -locking
    for e in range(B.body.shape[0]):
        w = R.wrench[at, e]
        push(at, B.body[e, 0], B.arm[e, 0, 0], B.arm[e, 0, 1], w[0], w[1], w[2], R)
        push(at, B.body[e, 1], B.arm[e, 1, 0], B.arm[e, 1, 1], -w[0], -w[1], w[3], R)
    load_couplings(at, W.multiplier, B, R)
    for e in range(B.pressure.shape[0]):
        size, _ = pressure_size(at, e, W.multiplier[B.pressure[e, 0]], B, R)
        push_apart(at, e, size, B, R)


@kernel
def write_energies(at, y, S, R):
    """Write the energies at a sample."""
    M, W = S.model, S.work
    n, nb = M.n, M.nb
    kinetic = potential = elastic = stored = 0.0
    for i in range(n + nb):
        potential -= S.parameters.weight[i] * W.X[i]
    for i in range(n):
        kinetic += 0.5 * W.V[i] * W.V[i]
        for k in range(nb):
            kinetic += W.V[i] * M.inertia[i, k] * W.basis[1, k]
    for i in range(nb):
        for k in range(nb):
            kinetic += 0.5 * W.basis[1, i] * M.inertia_b[i, k] * W.basis[1, k]
    for j in range(S.parameters.contact.size):
        law = S.parameters.law[j]
        if M.elastic_state[j] >= 0:
            elastic += y[M.elastic_state[j]]
        elif S.state.mode[j] == 1 and S.parameters.contact[j].cells > 0:
            elastic += worn_energy(j, S)
        elif S.state.mode[j] == 1:
            elastic += elastic_energy(law.energy, law.stiffness, W.contact[j].depth, S.parameters.elastic[j])
    for i in range(W.stored_energy.size):
        stored += W.stored_energy[i]
    R.kinetic[at], R.potential[at], R.elastic[at], R.stored[at] = kinetic, potential, elastic, stored


@kernel
def set_sample(at, samples, S):
    """Copy the modes, memories and masses of all guards and the reference angles of a sample into the state."""
    C = S.state
    for k in range(C.mode.size):
        C.mode[k] = samples.mode[at, k]
        C.memory[k] = samples.memory[at, k]
        C.mass[k] = samples.mass[at, k]
    for k in range(C.reference.size):
        C.reference[k] = samples.reference[at, k]
    engage(S)


@entry
def rates_without(samples: Sampled, which: I1, contact: int, address: int, rates: F2) -> None:
    """Compute the rates of the state at the samples `which` without the force of one contact, to find its effect."""
    S = open_system(address)
    for k in range(which.size):
        set_sample(which[k], samples, S)
        S.state.mode[contact] = 0
        accelerate(samples.time[which[k]], samples.state[which[k]], S, rates[k])


@entry
def fill(samples: Sampled, address: int, B: BodyMaps, R: Record, counted: F1) -> None:
    """Evaluate everything at each sample."""
    S = open_system(address)
    M, W, C = S.model, S.work, S.state
    W.with_energy[0] = 1
    for at in range(samples.time.size):
        set_sample(at, samples, S)
        # dense output keeps lengths only to its own accuracy
        project(samples.time[at], samples.state[at], S)
        accelerate(samples.time[at], samples.state[at], S, W.scratch)
        for i in range(M.n + M.nb):
            R.X[at, i], R.V[at, i], R.A[at, i] = W.X[i], W.V[i], W.A[i]
        for k in range(counted.size):
            dx, dy, _, _ = rotation_direction(k, S)
            counted[k] = counted_angle(dy, dx, C.reference[k])
        write_bodies(at, B, S, R, counted)
        for j in range(S.parameters.contact.size):
            if C.mode[j] == 0:
                no_forces(j, S)
                kinematics(j, S)
            R.contact[at, j] = W.contact[j]
        for i in range(M.component_port.size):
            if M.component_port[i] == AXIS.code:  # a flexible bar has no coordinates of a port and no results
                continue
            R.observed[at, i, 0], R.observed[at, i, 1] = W.observed[i, 0], W.observed[i, 1]
            for q in range(W.result.shape[1]):
                R.result[at, i, q] = W.result[i, q]
            for q in range(4):
                R.coordinate[at, i, q] = W.coordinates[i, q]
        constraint_forces(S, W.work_b)
        for d in range((M.nb - 1) // 2):
            R.torque[at, d] = drive_torque(d, S)
        for k in range(W.multiplier.size):
            R.multiplier[at, k] = W.multiplier[k]
        R.length_error[0] = max(R.length_error[0], value_errors(S))
        write_energies(at, samples.state[at], S, R)
        write_loads(at, B, S, R)
    W.with_energy[0] = 0


def sampled(samples: Any) -> Sampled:
    """Return the fields of samples that the kernels read."""
    return Sampled(*(getattr(samples, field) for field in Sampled._fields))


def empty_record(maps: BodyMaps, content: System, nt: int) -> Record:
    """Return a record of `nt` samples for `fill`."""
    columns, bodies = content.model.n + content.model.nb, maps.rotation.size
    contacts, components = content.parameters.contact.size, content.model.component_port.size
    shapes = {
        **dict.fromkeys(("X", "V", "A"), (columns,)),
        **dict.fromkeys(("position", "velocity", "acceleration", "direction"), (bodies, 2)),
        **dict.fromkeys(("angle", "angular_velocity", "angular_acceleration"), (bodies,)),
        "load": (bodies, 3),
        "wrench": (maps.body.shape[0], 4),
        "coordinate": (components, 4),
        "result": (components, COMPONENT_RESULTS_MAX),
        "observed": (components, 2),
        "torque": ((content.model.nb - 1) // 2,),
        "multiplier": (content.parameters.value.size,),
        **dict.fromkeys(("kinetic", "potential", "elastic", "stored"), ()),
    }
    return Record(
        contact=np.zeros((nt, contacts), CONTACT_RESULT),
        length_error=np.zeros(1),
        **{name: np.zeros((nt, *shape)) for name, shape in shapes.items()},
    )


def record(maps: BodyMaps, system: Handle, samples: Any) -> Record:
    """Evaluate everything at the samples."""
    return record_together(maps, [(system, samples)])


def record_in_halves(maps: BodyMaps, system: Handle, samples: Any) -> Record:
    """Evaluate everything at the samples, the first half on a second thread with its own state and scratch arrays.

    There must be no friction in ideal joints, whose workspace both threads would write to. Each sample determines its values
    alone, so that they are those of `record`, and the system is left as by `record`.
    """
    content: System = system.content
    state = MechanismState(*(array.copy() for array in content.state))
    other = Handle(content._replace(state=state, work=Workspace(*(array.copy() for array in content.work))))
    whole, middle = empty_record(maps, content, samples.time.size), samples.time.size // 2

    def evaluate(system: Handle, part: slice) -> float:
        rows = Record._make((*(array[part] for array in whole[:-1]), np.zeros(1)))
        part_samples = Sampled(*(array[part] for array in sampled(samples)))
        fill(part_samples, system.address, maps, rows, np.zeros(content.model.rotation_start.size - 1))
        return float(rows.length_error[0])

    from concurrent.futures import ThreadPoolExecutor

    with ThreadPoolExecutor(1) as pool:
        first_half = pool.submit(evaluate, other, slice(0, middle))
        whole.length_error[0] = max(evaluate(system, slice(middle, None)), first_half.result())
    return whole


def record_together(maps: BodyMaps, cases: Sequence[tuple[Handle, Any]]) -> Record:
    """Evaluate everything at the samples of several cases with the same tables, one after the other."""
    counts, first = [samples.time.size for _, samples in cases], 0
    whole, content = empty_record(maps, cases[0][0].content, sum(counts)), cases[0][0].content
    for (system, samples), count in zip(cases, counts, strict=True):
        part = whole
        if len(cases) > 1:
            part = Record._make((*(rows[first : first + count] for rows in whole[:-1]), whole.length_error))
        fill(sampled(samples), system.address, maps, part, np.zeros(content.model.rotation_start.size - 1))
        first += count
    return whole
