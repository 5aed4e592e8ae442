"""The matrix of a linearly implicit step, W = 1/hg - d y' / d y, banded by the order of unknowns in `System.place`."""

from __future__ import annotations

from scissordyn.jit import kernel
from scissordyn.mechanics import band

__all__ = ["acts", "factorize", "solve"]

_band_factorize, _band_solve = band.factorize, band.solve


@kernel(inline=True)
def acts(link, S):
    """Whether a link exerts forces: a loose joint in contact, or an element."""
    return link >= S.radius.shape[0] or S.mode[link] == 1


@kernel(inline=True)
def factorize(hg, S):
    """Factorize W = 1/hg - d y' / d y for `solve`; returns a singular row or -1.

    Positions are eliminated (k_x = hg (k_v + r_x)) and the multipliers' changes are kept as unknowns, so a chain stays banded.
    """
    n, m = S.n, S.multiplier.size
    matrix, lower = S.band, S.band_limits[0]
    place = S.place
    matrix[:, :] = 0.0
    S.gamma[0] = hg
    for i in range(n):
        matrix[place[i], lower] = 1.0 / hg
    for k in range(m):
        matrix[place[n + k], lower] = S.idle[k]
    for p in range(S.part_weight.size):
        start, stop, k, weight = S.part_start[p], S.part_start[p + 1], S.part_condition[p], S.part_weight[p]
        value = hg * S.frozen_multiplier[k] * weight
        wx = weight * (S.frozen_direction[p, 0] + hg * (2.0 * S.frozen_rate[p, 0] + hg * S.direction_acceleration[p, 0]))
        wy = weight * (S.frozen_direction[p, 1] + hg * (2.0 * S.frozen_rate[p, 1] + hg * S.direction_acceleration[p, 1]))
        condition = place[n + k]
        for i in range(start, stop):
            if S.length_column[i] >= n:
                continue
            row = place[S.length_column[i]]
            rx, ry = S.length_row[0, i], S.length_row[1, i]
            matrix[row, condition - row + lower] += S.frozen_gradient[i]
            matrix[condition, row - condition + lower] += wx * rx + wy * ry
            for j in range(start, stop):
                if S.length_column[j] < n:
                    column = place[S.length_column[j]]
                    matrix[row, column - row + lower] += value * (rx * S.length_row[0, j] + ry * S.length_row[1, j])
    for j in range(S.link_start.size - 1):
        first_state, last_state = S.state_start[j], S.state_start[j + 1]
        states = last_state - first_state
        for s in range(states):
            matrix[place[n + m + first_state + s], lower] += 1.0 / hg
        if not acts(j, S):
            continue
        first, count = S.link_start[j], S.link_start[j + 1] - S.link_start[j]
        for a in range(count):
            if S.link_column[first + a] >= n:
                continue
            row = place[S.link_column[first + a]]
            for b in range(count):
                if S.link_column[first + b] < n:
                    at = S.block_start[j] + a * count + b
                    column = place[S.link_column[first + b]]
                    matrix[row, column - row + lower] -= S.block_v[at] + hg * S.block_x[at]
            for s in range(states):
                at = S.force_state_start[j] + a * states + s
                state = place[n + m + first_state + s]
                matrix[row, state - row + lower] -= S.force_by_state[at]
                matrix[state, row - state + lower] -= S.rate_by_v[at] + hg * S.rate_by_x[at]
        for s in range(states):
            row = place[n + m + first_state + s]
            for k in range(states):
                column = place[n + m + first_state + k]
                matrix[row, column - row + lower] -= S.rate_by_state[S.state_state_start[j] + s * states + k]
    return _band_factorize(matrix, lower, S.band_limits[1], S.pivots)


@kernel(inline=True)
def solve(r, S):
    """Overwrite r with W^-1 r."""
    n, m, nz = S.n, S.multiplier.size, S.state_start[-1]
    hg, work, place = S.gamma[0], S.work, S.place
    for i in range(n):
        work[place[i]] = r[n + i]
    for s in range(nz):
        work[place[n + m + s]] = r[2 * n + s]
    for k in range(m):
        work[place[n + k]] = 0.0
    for p in range(S.part_weight.size):
        k, weight = S.part_condition[p], S.part_weight[p]
        along = dx = dy = 0.0
        for i in range(S.part_start[p], S.part_start[p + 1]):
            column = S.length_column[i]
            if column < n:
                along += S.frozen_gradient[i] * r[n + column]
                dx += S.length_row[0, i] * r[column]
                dy += S.length_row[1, i] * r[column]
        value = hg * S.frozen_multiplier[k] * weight
        for i in range(S.part_start[p], S.part_start[p + 1]):
            column = S.length_column[i]
            if column < n:
                work[place[column]] -= value * (S.length_row[0, i] * dx + S.length_row[1, i] * dy)
        bend = weight * (dx * S.direction_acceleration[p, 0] + dy * S.direction_acceleration[p, 1])
        work[place[n + k]] += hg * (along - hg * bend)
    for j in range(S.link_start.size - 1):
        if not acts(j, S):
            continue
        first, count = S.link_start[j], S.link_start[j + 1] - S.link_start[j]
        first_state, states = S.state_start[j], S.state_start[j + 1] - S.state_start[j]
        for b in range(count):
            if S.link_column[first + b] >= n:
                continue
            value = hg * r[S.link_column[first + b]]
            for a in range(count):
                if S.link_column[first + a] < n:
                    work[place[S.link_column[first + a]]] += S.block_x[S.block_start[j] + a * count + b] * value
            for s in range(states):
                at = S.force_state_start[j] + b * states + s
                work[place[n + m + first_state + s]] += S.rate_by_x[at] * value
    _band_solve(S.band, S.band_limits[0], S.band_limits[1], S.pivots, work)
    for i in range(n):
        value = work[place[i]]
        r[n + i] = value
        r[i] = hg * (value + r[i])
    for s in range(nz):
        r[2 * n + s] = work[place[n + m + s]]
