"""Force elements: contacts and components, which act between bodies through six rows of maps.

The maps give u, a point or the vector between two points, and a and b, the unit directions of two bodies.
"""

from __future__ import annotations

from scissordyn.kernel import kernel


@kernel
def map_values(element, S):
    """Return the six values of the maps of a force element and their rates, at the current X and V."""
    M, W = S.model, S.work
    ux = uy = ax = ay = bx = by = 0.0
    vx = vy = px = py = qx = qy = 0.0
    row = M.element_row
    for k in range(M.element_start[element], M.element_start[element + 1]):
        column = M.element_column[k]
        x, v = W.X[column], W.V[column]
        ux += row[0, k] * x
        uy += row[1, k] * x
        ax += row[2, k] * x
        ay += row[3, k] * x
        bx += row[4, k] * x
        by += row[5, k] * x
        vx += row[0, k] * v
        vy += row[1, k] * v
        px += row[2, k] * v
        py += row[3, k] * v
        qx += row[4, k] * v
        qy += row[5, k] * v
    return ux, uy, ax, ay, bx, by, vx, vy, px, py, qx, qy


@kernel
def add_forces(element, S, fx, fy, gx, gy, hx, hy, target, first, limit):
    """Add forces on the three maps of an element to target[first + column] for columns below `limit`."""
    M = S.model
    row = M.element_row
    for k in range(M.element_start[element], M.element_start[element + 1]):
        if M.element_column[k] < limit:
            target[first + M.element_column[k]] += (
                row[0, k] * fx + row[1, k] * fy + row[2, k] * gx + row[3, k] * gy + row[4, k] * hx + row[5, k] * hy
            )


@kernel
def add_torques(element, S, fx, fy, torque_a, torque_b, ax, ay, bx, by, target, first, limit):
    """Add a force on the first map, and torques on the unit directions a and b of two bodies, to `target`.

    A torque T on a direction d is applied as the force T J d on d; J turns a vector by 90 degrees.
    """
    add_forces(element, S, fx, fy, -torque_a * ay, torque_a * ax, -torque_b * by, torque_b * bx, target, first, limit)


@kernel
def write_wrench(element, S, fx, fy, torque_a, torque_b):
    """Store the force on the point of the first body, and the torques on both bodies."""
    wrench = S.work.wrench
    wrench[element, 0], wrench[element, 1], wrench[element, 2], wrench[element, 3] = fx, fy, torque_a, torque_b
