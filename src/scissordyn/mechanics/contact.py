"""Contacts: where two surfaces are, what forces they exert, and how these change.

Here are journals in their bearings; contact points of a block at the surfaces of its guide are in `plane_contact`.

Letters: e journal against bearing centre, n = e/|e|, t = n turned left, delta = |e| - c, v slip speed of the surfaces,
w angular velocity, d unit direction of a body. The maps of a joint give e, d of the journal's body, d of the bearing's body.
"""

from __future__ import annotations

import math

from scissordyn.kernel import kernel
from scissordyn.laws.evaluate import elastic_force, friction_force, friction_states, normal_force
from scissordyn.mechanics.constraint_solver import expand_element
from scissordyn.mechanics.force_element import add_torques, map_values, write_wrench
from scissordyn.mechanics.plane_contact import plane_forces, plane_gap, plane_kinematics
from scissordyn.mechanics.system import APPROACH_FLOOR


@kernel
def gap(j, S):
    """|e| - c and its rate; negative in free flight."""
    maps = map_values(j, S)
    if S.parameters.contact[j].plane == 1:
        return plane_gap(j, S, maps)
    ex, ey, _, _, _, _, ux, uy, _, _, _, _ = maps
    e = math.sqrt(ex * ex + ey * ey)
    # at e = 0 the normal is undefined; whichever way the journal leaves, it moves outward
    rate = (ex * ux + ey * uy) / e if e > 0.0 else math.sqrt(ux * ux + uy * uy)
    return e - S.parameters.contact[j].clearance, rate


@kernel
def kinematics(j, S):
    """Write delta, delta', slip speed, n and |e| of contact j into Work.contact; returns the maps and their rates."""
    maps = map_values(j, S)
    p, contact = S.parameters.contact[j], S.work.contact[j]
    if p.plane == 1:
        plane_kinematics(j, S, maps)
        return maps
    ex, ey, ax, ay, bx, by, ux, uy, px, py, qx, qy = maps
    e = math.sqrt(ex * ex + ey * ey)
    nx, ny = (ex / e, ey / e) if e > 0.0 else (1.0, 0.0)
    contact.depth = e - p.clearance
    contact.rate = ux * nx + uy * ny
    # v_t = e'.t + w_J R_J - w_B (R_J + e), t = (-n_y, n_x): both bodies at the same point, so that their moments balance
    across = uy * nx - ux * ny
    contact.slip = across + (ax * py - ay * px) * p.radius - (bx * qy - by * qx) * (p.radius + e)
    if p.spinless == 1:  # v_t = e'.t + R_J n'.t - R_B n'.t with n'.t = e'.t/|e|
        contact.slip = across * contact.depth / e
    contact.nx = nx
    contact.ny = ny
    contact.distance = e
    return maps


@kernel
def contact_laws(j, S, z, dz):
    """Evaluate the laws of contact j into Work.contact, write the rates of its states into dz; returns the maps."""
    P, W = S.parameters, S.work
    maps = kinematics(j, S)
    law, contact = P.law[j], W.contact[j]
    elastic = normal = 0.0
    if law.stiffness == 0:  # a hard contact: its mean forces over a step
        contact.elastic = 0.0
        contact.normal = S.state.memory[j]
        contact.tangential = z[0]
        dz[:] = 0.0
        return maps
    if contact.depth > 0.0:
        elastic = elastic_force(law.stiffness, contact.depth, P.elastic[j])
        normal = normal_force(law.damping, elastic, contact.depth, contact.rate, S.state.memory[j], P.damping[j])
    tangential = friction_force(law.friction, contact.slip, normal, z, dz, P.friction[j])
    contact.elastic = elastic
    contact.normal = normal
    contact.tangential = tangential
    return maps


@kernel
def contact_forces(j, S, z, dz):
    """Evaluate the laws of contact j, add its forces to Work.force, write the rates of its states into dz."""
    maps = contact_laws(j, S, z, dz)
    W = S.work
    p, contact = S.parameters.contact[j], W.contact[j]
    normal, tangential = contact.normal, contact.tangential
    if p.plane == 1:
        plane_forces(j, S, maps, normal, tangential)
        return
    _, _, ax, ay, bx, by, _, _, _, _, _, _ = maps
    nx, ny = contact.nx, contact.ny
    fx, fy = -normal * nx + tangential * ny, -normal * ny - tangential * nx
    moment_j, moment_b = -p.radius * tangential, (p.radius + contact.distance) * tangential
    write_wrench(j, S, fx, fy, moment_j, moment_b)
    add_torques(j, S, fx, fy, moment_j, moment_b, ax, ay, bx, by, W.force, 0, W.force.size)


@kernel
def contact_at(t, y, j, S):
    """Evaluate contact j alone into Work.contact."""
    M = S.model
    expand_element(t, y, j, S)
    start, stop = 2 * M.n + M.state_start[j], 2 * M.n + M.state_start[j + 1]
    contact_laws(j, S, y[start:stop], S.work.state_work[0])


@kernel
def no_forces(j, S):
    """Forget the forces of the last evaluation of contact j."""
    contact = S.work.contact[j]
    contact.elastic = 0.0
    contact.normal = 0.0
    contact.tangential = 0.0
    write_wrench(j, S, 0.0, 0.0, 0.0, 0.0)


@kernel
def begin_contact(y, j, S, data, resting):
    """Start the contact of j with its states; `data` gets delta' and the angle of n; returns whether it started.

    One that does not approach does not start, except where it rests in contact at the beginning of a run.
    """
    M, C = S.model, S.state
    no_forces(j, S)
    kinematics(j, S)
    contact = S.work.contact[j]
    if not (contact.rate > 0.0 or resting):
        return False
    C.mode[j] = 1
    C.memory[j] = max(contact.rate, APPROACH_FLOOR)
    data[0] = C.memory[j] if resting else contact.rate
    data[1] = math.atan2(contact.ny, contact.nx)
    start, stop = 2 * M.n + M.state_start[j], 2 * M.n + M.state_start[j + 1]
    friction_states(S.parameters.law[j].start, contact.slip, y[start:stop], S.parameters.friction[j])
    return True


@kernel
def end_contact(j, S, data):
    """End the contact of j; `data` gets delta' and the angle of n."""
    no_forces(j, S)
    kinematics(j, S)
    contact = S.work.contact[j]
    data[0] = contact.rate
    data[1] = math.atan2(contact.ny, contact.nx)
    S.state.mode[j] = 0
    return True
