"""Latches: how far one is from its angle, and which of their conditions hold."""

from __future__ import annotations

import math

from scissordyn.jit import kernel

__all__ = ["engage", "latch_gap"]


@kernel(inline=True)
def latch_gap(latch, S):
    """Angle past a latch and its rate; a locked one never opens."""
    if S.mode[S.radius.shape[0] + latch] == 1:
        return 1.0, 0.0
    p = S.latch[latch, 1]
    # the parts are w + g and w - g, w the body's direction turned back by the angle of the latch, g the base's turned left
    wx = wy = gx = gy = ux = uy = hx = hy = 0.0
    for part in range(p, p + 2):
        sign = 0.5 if part == p else -0.5
        for i in range(S.part_start[part], S.part_start[part + 1]):
            x, v = S.X[S.length_column[i]], S.V[S.length_column[i]]
            rx, ry = S.length_row[0, i], S.length_row[1, i]
            wx += 0.5 * rx * x
            wy += 0.5 * ry * x
            ux += 0.5 * rx * v
            uy += 0.5 * ry * v
            gx += sign * rx * x
            gy += sign * ry * x
            hx += sign * rx * v
            hy += sign * ry * v
    angle = math.atan2(wx * gx + wy * gy, wx * gy - wy * gx)
    spin = (wx * uy - wy * ux) - (gx * hy - gy * hx)
    return S.latch_side[latch] * angle, S.latch_side[latch] * spin


@kernel(inline=True)
def engage(S):
    """Let the conditions of latches hold, or not, as their modes say."""
    for latch in range(S.latch_side.size):
        locked = float(S.mode[S.radius.shape[0] + latch])
        k, p = S.latch[latch, 0], S.latch[latch, 1]
        S.idle[k] = 1.0 - locked
        S.part_weight[p] = locked * S.part_full[p]
        S.part_weight[p + 1] = locked * S.part_full[p + 1]
