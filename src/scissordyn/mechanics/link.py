"""Links: what acts between bodies through six form rows, be it a loose joint or an element."""

from __future__ import annotations

from scissordyn.jit import kernel

__all__ = ["link_forms", "push", "push_turns"]


@kernel(inline=True)
def link_forms(link, S):
    """The six forms of a link and their rates, from S.X and S.V."""
    ux = uy = ax = ay = bx = by = 0.0
    vx = vy = px = py = qx = qy = 0.0
    row = S.link_row
    for k in range(S.link_start[link], S.link_start[link + 1]):
        column = S.link_column[k]
        x, v = S.X[column], S.V[column]
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


@kernel(inline=True)
def push(link, S, fx, fy, gx, gy, hx, hy, target, first, limit):
    """Add forces on the three forms of a link to target[first + column] for columns below `limit`."""
    row = S.link_row
    for k in range(S.link_start[link], S.link_start[link + 1]):
        if S.link_column[k] < limit:
            target[first + S.link_column[k]] += (
                row[0, k] * fx + row[1, k] * fy + row[2, k] * gx + row[3, k] * gy + row[4, k] * hx + row[5, k] * hy
            )


@kernel(inline=True)
def push_turns(link, S, fx, fy, torque_a, torque_b, ax, ay, bx, by, target, first, limit):
    """The same for a force on the first form and torques on two unit directions: a torque is the force torque J d on d."""
    push(link, S, fx, fy, -torque_a * ay, torque_a * ax, -torque_b * by, torque_b * bx, target, first, limit)
