"""Angles with full turns, counted from step to step.

The directions of bodies give an angle up to full turns. `State.reference` contains the angles at the end of the last step: of
each family of parallel bodies, of each component that depends on an angle, and of each angle in a constraint. Within a step
an angle is the one nearest to its reference.
"""

from __future__ import annotations

import math

from scissordyn.kernel import kernel
from scissordyn.mechanics.force_element import map_values


@kernel
def counted_angle(sine, cosine, reference):
    """Return the angle with given sine and cosine that is nearest to a reference."""
    beyond = math.atan2(sine, cosine) - reference
    return reference + beyond - math.tau * math.floor(beyond / math.tau + 0.5)


@kernel
def relative_angle(i, S, ax, ay, bx, by):
    """Return the angle of direction a relative to direction b at component i."""
    return counted_angle(bx * ay - by * ax, bx * ax + by * ay, S.state.reference[S.model.reference_of[i]])


@kernel
def rotation_direction(k, S):
    """Return the direction of a family of parallel bodies and its rate, at the current X and V."""
    M, W = S.model, S.work
    dx = dy = vx = vy = 0.0
    for i in range(M.rotation_start[k], M.rotation_start[k + 1]):
        column = M.rotation_column[i]
        dx += M.rotation_row[0, i] * W.X[column]
        dy += M.rotation_row[1, i] * W.X[column]
        vx += M.rotation_row[0, i] * W.V[column]
        vy += M.rotation_row[1, i] * W.V[column]
    return dx, dy, vx, vy


@kernel
def count_turns(S):
    """Set the references to the current angles; return the largest angular velocity."""
    M, reference = S.model, S.state.reference
    fastest = 0.0
    rotations = M.rotation_start.size - 1
    for k in range(rotations):
        dx, dy, vx, vy = rotation_direction(k, S)
        reference[k] = counted_angle(dy, dx, reference[k])
        fastest = max(fastest, abs(dx * vy - dy * vx))
    contacts = S.parameters.contact.size
    for i in range(M.reference_of.size):
        if M.reference_of[i] >= 0:
            _, _, ax, ay, bx, by, _, _, px, py, qx, qy = map_values(contacts + i, S)
            reference[M.reference_of[i]] = relative_angle(i, S, ax, ay, bx, by)
            fastest = max(fastest, abs((ax * py - ay * px) - (bx * qy - by * qx)))
    for p in range(M.part_reference.size):
        if M.part_reference[p] >= 0:
            dx = dy = 0.0
            for i in range(M.part_start[p], M.part_start[p + 1]):
                dx += M.constraint_row[0, i] * S.work.X[M.constraint_column[i]]
                dy += M.constraint_row[1, i] * S.work.X[M.constraint_column[i]]
            reference[M.part_reference[p]] = counted_angle(dy, dx, reference[M.part_reference[p]])
    return fastest
