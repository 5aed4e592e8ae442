"""The matrix of a linearly implicit step, W = 1/hg - d y' / d y, banded by the order of unknowns in `Model.permutation`."""

from __future__ import annotations

from scissordyn.jit import kernel
from scissordyn.mechanics import band

__all__ = ["acts", "factorize", "solve"]

_band_factorize, _band_solve = band.factorize, band.solve


@kernel(inline=True)
def acts(element, S):
    """Whether a force element exerts forces: a contact that is closed, or a component."""
    return element >= S.parameters.contact.size or S.state.mode[element] == 1


@kernel(inline=True)
def factorize(hg, S):
    """Factorize W = 1/hg - d y' / d y for `solve`; returns a singular row or -1.

    Positions are eliminated (k_x = hg (k_v + r_x)) and the multipliers' changes are kept as unknowns, so a chain stays banded.
    """
    M, W = S.model, S.work
    n, m = M.n, W.multiplier.size
    matrix, lower = W.band, M.band_limits[0]
    place = M.permutation
    matrix[:, :] = 0.0
    W.gamma[0] = hg
    for i in range(n):
        matrix[place[i], lower] = 1.0 / hg
    for k in range(m):
        matrix[place[n + k], lower] = W.inactive[k]
    for p in range(M.part_constraint.size):
        start, stop, k, weight = M.part_start[p], M.part_start[p + 1], M.part_constraint[p], W.part_weight[p]
        value = hg * W.frozen_multiplier[k] * weight
        wx = weight * (W.frozen_direction[p, 0] + hg * (2.0 * W.frozen_rate[p, 0] + hg * W.direction_acceleration[p, 0]))
        wy = weight * (W.frozen_direction[p, 1] + hg * (2.0 * W.frozen_rate[p, 1] + hg * W.direction_acceleration[p, 1]))
        constraint = place[n + k]
        for i in range(start, stop):
            if M.constraint_column[i] >= n:
                continue
            row = place[M.constraint_column[i]]
            rx, ry = M.constraint_row[0, i], M.constraint_row[1, i]
            matrix[row, constraint - row + lower] += W.frozen_gradient[i]
            matrix[constraint, row - constraint + lower] += wx * rx + wy * ry
            for j in range(start, stop):
                if M.constraint_column[j] < n:
                    column = place[M.constraint_column[j]]
                    matrix[row, column - row + lower] += value * (rx * M.constraint_row[0, j] + ry * M.constraint_row[1, j])
    for j in range(M.element_start.size - 1):
        first_state, last_state = M.state_start[j], M.state_start[j + 1]
        states = last_state - first_state
        for s in range(states):
            matrix[place[n + m + first_state + s], lower] += 1.0 / hg
        if not acts(j, S):
            continue
        first, count = M.element_start[j], M.element_start[j + 1] - M.element_start[j]
        for a in range(count):
            if M.element_column[first + a] >= n:
                continue
            row = place[M.element_column[first + a]]
            for b in range(count):
                if M.element_column[first + b] < n:
                    at = M.block_start[j] + a * count + b
                    column = place[M.element_column[first + b]]
                    matrix[row, column - row + lower] -= W.block_v[at] + hg * W.block_x[at]
            for s in range(states):
                at = M.force_state_start[j] + a * states + s
                state = place[n + m + first_state + s]
                matrix[row, state - row + lower] -= W.force_by_state[at]
                matrix[state, row - state + lower] -= W.rate_by_v[at] + hg * W.rate_by_x[at]
        for s in range(states):
            row = place[n + m + first_state + s]
            for k in range(states):
                column = place[n + m + first_state + k]
                matrix[row, column - row + lower] -= W.rate_by_state[M.state_state_start[j] + s * states + k]
    return _band_factorize(matrix, lower, M.band_limits[1], W.pivots)


@kernel(inline=True)
def solve(r, S):
    """Overwrite r with W^-1 r."""
    M, W = S.model, S.work
    n, m, nz = M.n, W.multiplier.size, M.state_start[-1]
    hg, work, place = W.gamma[0], W.work, M.permutation
    for i in range(n):
        work[place[i]] = r[n + i]
    for s in range(nz):
        work[place[n + m + s]] = r[2 * n + s]
    for k in range(m):
        work[place[n + k]] = 0.0
    for p in range(M.part_constraint.size):
        k, weight = M.part_constraint[p], W.part_weight[p]
        along = dx = dy = 0.0
        for i in range(M.part_start[p], M.part_start[p + 1]):
            column = M.constraint_column[i]
            if column < n:
                along += W.frozen_gradient[i] * r[n + column]
                dx += M.constraint_row[0, i] * r[column]
                dy += M.constraint_row[1, i] * r[column]
        value = hg * W.frozen_multiplier[k] * weight
        for i in range(M.part_start[p], M.part_start[p + 1]):
            column = M.constraint_column[i]
            if column < n:
                work[place[column]] -= value * (M.constraint_row[0, i] * dx + M.constraint_row[1, i] * dy)
        bend = weight * (dx * W.direction_acceleration[p, 0] + dy * W.direction_acceleration[p, 1])
        work[place[n + k]] += hg * (along - hg * bend)
    for j in range(M.element_start.size - 1):
        if not acts(j, S):
            continue
        first, count = M.element_start[j], M.element_start[j + 1] - M.element_start[j]
        first_state, states = M.state_start[j], M.state_start[j + 1] - M.state_start[j]
        for b in range(count):
            if M.element_column[first + b] >= n:
                continue
            value = hg * r[M.element_column[first + b]]
            for a in range(count):
                if M.element_column[first + a] < n:
                    work[place[M.element_column[first + a]]] += W.block_x[M.block_start[j] + a * count + b] * value
            for s in range(states):
                at = M.force_state_start[j] + b * states + s
                work[place[n + m + first_state + s]] += W.rate_by_x[at] * value
    _band_solve(W.band, M.band_limits[0], M.band_limits[1], W.pivots, work)
    for i in range(n):
        value = work[place[i]]
        r[n + i] = value
        r[i] = hg * (value + r[i])
    for s in range(nz):
        r[2 * n + s] = work[place[n + m + s]]
