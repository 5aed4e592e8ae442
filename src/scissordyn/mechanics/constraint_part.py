"""Parts of constraints: functions of one map d = rows X, namely |d|^2/2, the angle of d, or its length.

A constraint is a weighted sum of parts. `Model.part_reference` gives the kind: a code below, or for an angle the entry of
`State.reference` from which its turns are counted. With d and changes u as complex numbers the angle is Im log d, with the
derivatives Im(u/d), -Im(u u/d^2) and 2 Im(u u u/d^3). A linear form v -> Im(c v) has the components (Im c, Re c).
"""

from __future__ import annotations

import math

from scissordyn.kernel import kernel
from scissordyn.mechanics.rotation import counted_angle

ANGLE, HALF_SQUARE, LENGTH = 0, -1, -2  # Kinds of a part; any number from `ANGLE` on is the index of its reference


@kernel
def part_value(p, S):
    """Return the value of part p without its weight, for its map d in Work.direction."""
    dx, dy = S.work.direction[p, 0], S.work.direction[p, 1]
    kind = S.model.part_reference[p]
    if kind >= 0:
        return counted_angle(dy, dx, S.state.reference[kind])
    return math.sqrt(dx * dx + dy * dy) if kind == LENGTH else 0.5 * (dx * dx + dy * dy)


@kernel
def part_slope(kind, dx, dy):
    """Return f'(d), the gradient of a part's function f of its map d."""
    if kind == HALF_SQUARE:
        return dx, dy
    square = dx * dx + dy * dy
    if kind == LENGTH:
        r = math.sqrt(square)
        return dx / r, dy / r
    return -dy / square, dx / square


@kernel
def part_curvature(kind, dx, dy, ux, uy):
    """Return f''(d) u: the change of the gradient of a part's function f when its map d changes by u."""
    if kind == HALF_SQUARE:
        return ux, uy
    square = dx * dx + dy * dy
    if kind == LENGTH:
        # (u - e (e.u)) / r with e = d/r
        r = math.sqrt(square)
        ex, ey = dx / r, dy / r
        along = ex * ux + ey * uy
        return (ux - along * ex) / r, (uy - along * ey) / r
    # c = -u / d^2
    px, py = (dx * dx - dy * dy) / (square * square), -2.0 * dx * dy / (square * square)
    return -(ux * py + uy * px), -(ux * px - uy * py)


@kernel
def part_bend(kind, dx, dy, ux, uy, ax, ay):
    """Return the gradient by d of the second time derivative of f(d), where u = d' and a = d'': f'' a + (u . f'' u)'."""
    if kind == HALF_SQUARE:
        return ax, ay
    hx, hy = part_curvature(kind, dx, dy, ax, ay)
    square = dx * dx + dy * dy
    if kind == LENGTH:
        # derivative of (u.u - (e.u)^2) / r by d
        r = math.sqrt(square)
        ex, ey = dx / r, dy / r
        along = ex * ux + ey * uy
        nx, ny = ux - along * ex, uy - along * ey
        across = nx * nx + ny * ny
        return hx - (across * ex + 2.0 * along * nx) / square, hy - (across * ey + 2.0 * along * ny) / square
    # c = 2 u^2 / d^3
    vx, vy = (ux * ux - uy * uy) * 2.0, 4.0 * ux * uy
    cube = square * square * square
    qx, qy = (dx * dx * dx - 3.0 * dx * dy * dy) / cube, -(3.0 * dx * dx * dy - dy * dy * dy) / cube
    return hx + vx * qy + vy * qx, hy + vx * qx - vy * qy
