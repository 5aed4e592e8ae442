"""Matrix of a linearly implicit step, W = 1/hg - d y' / d y, banded in the order of `Model.permutation`.

In larger mechanisms two kinds of unknowns are eliminated before the factorization (`plan.ordering`):

* the state z of a force element with a single state: its row contains only z and the element's coordinates;
* the multiplier of a constraint on two coordinates that no other constraint uses, together with one of both coordinates. The
  constraint's row is w . k = s and its column g. The coordinates are k = a u + b s/|w|, with b = w/|w| and a normal to w. The
  multiplier vanishes from the sum of both rows in a direction normal to g. Entries for s, `Workspace.aside`, go to the
  right-hand side.
"""

from __future__ import annotations

import math

from scissordyn.kernel import kernel
from scissordyn.mechanics import band
from scissordyn.mechanics.constraint_part import part_bend, part_curvature, part_slope

PIVOT_MIN = 0.1
"""[-] smallest pivot of an internal state that is eliminated from an implicit step, times step size times gamma.

Below it, the step is repeated with a shorter size.
"""


@kernel
def acts(element, S):
    """Return whether a force element exerts forces: a closed contact, or a component."""
    return element >= S.parameters.contact.size or S.state.mode[element] == 1


@kernel
def factorize(hg, S):
    """Factorize W = 1/hg - d y' / d y for `solve`; return a singular row, or -1.

    Positions are eliminated (k_x = hg (k_v + r_x)) and changes of multipliers remain unknowns, so a chain stays banded.
    """
    M, W = S.model, S.work
    n, lower, paired = M.n, M.band_limits[0], M.pair.shape[0] > 0
    W.band[:, :] = 0.0
    W.aside[:, :] = 0.0
    W.gamma[0] = hg
    singular = orient_pairs(hg, S)
    if singular >= 0:
        return singular
    # 1/hg on the diagonal of the rates, in the frames of the pairs
    for i in range(n):
        row, factor = M.permutation[i], W.row_factor[i] * (1.0 / hg)
        W.band[row, lower] += W.unknown_factor[i] * factor
        if paired:
            W.aside[row, lower] += W.prescribed_factor[i] * factor
    add_constraints(hg, S)
    singular = add_elements(hg, S)
    if singular >= 0:
        return singular
    return band.factorize(W.band, lower, M.band_limits[1], W.pivots)


@kernel
def constraint_row(p, hg, S):
    """Return the derivatives of a constraint's second time derivative by the acceleration of the map of part p.

    In a linearly implicit step the changes of rate and position are hg and hg^2 times that of the acceleration.
    """
    W, kind = S.work, S.model.part_reference[p]
    dx, dy, ux, uy = W.frozen_direction[p, 0], W.frozen_direction[p, 1], W.frozen_rate[p, 0], W.frozen_rate[p, 1]
    sx, sy = part_slope(kind, dx, dy)
    hx, hy = part_curvature(kind, dx, dy, ux, uy)
    bx, by = part_bend(kind, dx, dy, ux, uy, W.direction_acceleration[p, 0], W.direction_acceleration[p, 1])
    # (R4) twice differentiated: accelerations change by 1, rates by hg, positions by hg^2
    weight = W.part_weight[p]
    return weight * (sx + hg * (2.0 * hx + hg * bx)), weight * (sy + hg * (2.0 * hy + hg * by))


@kernel
def orient_pairs(hg, S):
    """Turn both coordinates of each pair into a known and an unknown change, and their equations into one without multiplier.

    A pair is the two coordinates of a constraint that no other constraint reads: it fixes their change along its row, and its
    multiplier is eliminated.
    Returns the row of a pair whose constraint or gradient vanishes, or -1.
    """
    M, W = S.model, S.work
    for q in range(M.pair.shape[0]):
        p, a, b = M.pair[q, 0], M.pair[q, 1], M.pair[q, 2]
        wx, wy = constraint_row(p, hg, S)
        wa = wb = ga = gb = 0.0
        for i in range(M.part_start[p], M.part_start[p + 1]):
            value = wx * M.constraint_row[0, i] + wy * M.constraint_row[1, i]
            if M.constraint_column[i] == a:
                wa, ga = value, W.frozen_gradient[i]
            elif M.constraint_column[i] == b:
                wb, gb = value, W.frozen_gradient[i]
        # the change along the row is known, that across it unknown; the sum normal to the gradient has no multiplier
        size, steepness = math.hypot(wa, wb), math.hypot(ga, gb)
        if not (size > 0.0 and steepness > 0.0):  # NaN counts as zero
            return M.permutation[a]
        W.pair_size[q] = size
        W.prescribed_factor[a], W.prescribed_factor[b] = wa / size, wb / size
        W.unknown_factor[a], W.unknown_factor[b] = -wb / size, wa / size
        W.row_factor[a], W.row_factor[b] = -gb / steepness, ga / steepness
    return -1


@kernel
def add_constraints(hg, S):
    """Add the rows and columns of constraints, and the effect of their changing gradients."""
    M, W = S.model, S.work
    n, lower, place, matrix = M.n, M.band_limits[0], M.permutation, W.band
    paired = M.pair.shape[0] > 0
    for k in range(W.multiplier.size):
        if place[n + k] >= 0:
            matrix[place[n + k], lower] = W.inactive[k]
    for p in range(M.part_constraint.size):
        start, stop, k = M.part_start[p], M.part_start[p + 1], M.part_constraint[p]
        # lambda dPhi^T/dx: symmetric, depends on the maps only
        value = hg * W.frozen_multiplier[k] * W.part_weight[p]
        wx, wy = constraint_row(p, hg, S)
        constraint = place[n + k]
        for i in range(start, stop):
            a = M.constraint_column[i]
            if a >= n:
                continue
            row, rx, ry = place[a], M.constraint_row[0, i], M.constraint_row[1, i]
            hx, hy = part_curvature(M.part_reference[p], W.frozen_direction[p, 0], W.frozen_direction[p, 1], rx, ry)
            if constraint >= 0:
                matrix[row, constraint - row + lower] += W.row_factor[a] * W.frozen_gradient[i]
                matrix[constraint, row - constraint + lower] += (wx * rx + wy * ry) * W.unknown_factor[a]
            for j in range(start, stop):
                b = M.constraint_column[j]
                if b < n:
                    at = place[b] - row + lower
                    change = W.row_factor[a] * (value * (hx * M.constraint_row[0, j] + hy * M.constraint_row[1, j]))
                    matrix[row, at] += change * W.unknown_factor[b]
                    if paired:
                        W.aside[row, at] += change * W.prescribed_factor[b]


@kernel
def add_elements(hg, S):
    """Add the force elements; return -1, or the index of a state that cannot be eliminated."""
    M, W = S.model, S.work
    n, lower, place, matrix = M.n, M.band_limits[0], M.permutation, W.band
    paired = M.pair.shape[0] > 0
    first_row = n + W.multiplier.size
    for j in range(M.element_start.size - 1):
        first_state, last_state = M.state_start[j], M.state_start[j + 1]
        states, condensed = last_state - first_state, False
        for s in range(states):
            if place[first_row + first_state + s] >= 0:
                matrix[place[first_row + first_state + s], lower] += 1.0 / hg
            else:
                condensed = True
        if not acts(j, S):
            if condensed:
                W.state_inverse[first_state] = hg
            continue
        inverse, at_state = 0.0, M.force_state_start[j]
        if condensed:
            pivot = 1.0 / hg - W.rate_by_state[M.state_state_start[j]]
            if not hg * pivot > PIVOT_MIN:
                return first_state
            inverse = 1.0 / pivot
            W.state_inverse[first_state] = inverse
        first, count = M.element_start[j], M.element_start[j + 1] - M.element_start[j]
        for a in range(count):
            here = M.element_column[first + a]
            if here >= n:
                continue
            row, factor, start = place[here], W.row_factor[here], M.block_start[j] + a * count
            by_state = W.force_by_state[at_state + a] * inverse if condensed else 0.0
            for b in range(count):
                there = M.element_column[first + b]
                if there < n:
                    value = W.block_v[start + b] + hg * W.block_x[start + b]
                    if condensed:
                        value += by_state * (W.rate_by_v[at_state + b] + hg * W.rate_by_x[at_state + b])
                    value *= factor
                    at = place[there] - row + lower
                    matrix[row, at] -= value * W.unknown_factor[there]
                    if paired:
                        W.aside[row, at] -= value * W.prescribed_factor[there]
            if not condensed:
                for s in range(states):
                    at = at_state + a * states + s
                    state = place[first_row + first_state + s]
                    matrix[row, state - row + lower] -= factor * W.force_by_state[at]
                    value = W.rate_by_v[at] + hg * W.rate_by_x[at]
                    matrix[state, row - state + lower] -= value * W.unknown_factor[here]
                    if paired:
                        W.aside[state, row - state + lower] -= value * W.prescribed_factor[here]
        if not condensed:
            for s in range(states):
                row = place[first_row + first_state + s]
                for k in range(states):
                    column = place[first_row + first_state + k]
                    matrix[row, column - row + lower] -= W.rate_by_state[M.state_state_start[j] + s * states + k]
    return -1


@kernel
def solve(r, S):
    """Overwrite r with W^-1 r."""
    M, W = S.model, S.work
    n, m, nz = M.n, W.multiplier.size, M.state_start[M.state_start.size - 1]
    hg, work, place = W.gamma[0], W.work, M.permutation
    for i in range(n):
        W.load[i] = r[n + i]
    for i in range(W.band.shape[0]):
        work[i] = 0.0
    load_constraints(r, S)
    load_elements(r, S)
    for i in range(n):
        work[place[i]] += W.row_factor[i] * W.load[i]
    for s in range(nz):
        if place[n + m + s] >= 0:
            work[place[n + m + s]] = r[2 * n + s]
    lower, upper, last = M.band_limits[0], M.band_limits[1], W.band.shape[0] - 1
    for q in range(M.pair.shape[0]):
        column, prescribed = place[M.pair[q, 1]], W.prescribed[M.pair[q, 1]]
        for row in range(max(0, column - upper), min(last, column + lower) + 1):
            work[row] -= W.aside[row, column - row + lower] * prescribed
    band.solve(W.band, lower, W.pivots, work[: last + 1])
    for i in range(n):
        value = W.unknown_factor[i] * work[place[i]] + W.prescribed_factor[i] * W.prescribed[i]
        r[n + i] = value
        r[i] = hg * (value + r[i])
    for s in range(nz):
        if place[n + m + s] >= 0:
            r[2 * n + s] = work[place[n + m + s]]
    eliminated_states(r, S)


@kernel
def load_constraints(r, S):
    """Add the constraints' share of r to the right-hand side; r has n entries of positions, then n of rates."""
    M, W = S.model, S.work
    n, hg, place = M.n, W.gamma[0], M.permutation
    for p in range(M.part_constraint.size):
        k, weight = M.part_constraint[p], W.part_weight[p]
        along = dx = dy = 0.0
        for i in range(M.part_start[p], M.part_start[p + 1]):
            column = M.constraint_column[i]
            if column < n:
                along += W.frozen_gradient[i] * r[n + column]
                dx += M.constraint_row[0, i] * r[column]
                dy += M.constraint_row[1, i] * r[column]
        # effect of r_x at fixed rates: Phi^T lambda, and the constraint differentiated twice
        value, kind, qx, qy = (
            hg * W.frozen_multiplier[k] * weight,
            M.part_reference[p],
            W.frozen_direction[p, 0],
            W.frozen_direction[p, 1],
        )
        hx, hy = part_curvature(kind, qx, qy, dx, dy)
        for i in range(M.part_start[p], M.part_start[p + 1]):
            column = M.constraint_column[i]
            if column < n:
                W.load[column] -= value * (M.constraint_row[0, i] * hx + M.constraint_row[1, i] * hy)
        ux, uy = W.frozen_rate[p, 0], W.frozen_rate[p, 1]
        bx, by = part_bend(kind, qx, qy, ux, uy, W.direction_acceleration[p, 0], W.direction_acceleration[p, 1])
        bend = weight * (dx * bx + dy * by)
        change = hg * (along - hg * bend)
        if place[n + k] >= 0:
            W.work[place[n + k]] += change
        else:
            q = M.pair_of[k]
            W.prescribed[M.pair[q, 1]] = W.prescribed[M.pair[q, 2]] = change / W.pair_size[q]


@kernel
def load_elements(r, S):
    """Add the effect of the positions' part of r through force elements, and that of their eliminated states."""
    M, W = S.model, S.work
    n, hg = M.n, W.gamma[0]
    first_row = n + W.multiplier.size
    for j in range(M.element_start.size - 1):
        if not acts(j, S):
            continue
        first, count = M.element_start[j], M.element_start[j + 1] - M.element_start[j]
        first_state, states = M.state_start[j], M.state_start[j + 1] - M.state_start[j]
        # d force/dx and d state rate/dx times hg r_x
        moved = W.local[0]
        for b in range(count):
            column = M.element_column[first + b]
            moved[b] = hg * r[column] if column < n else 0.0
        for s in range(states):
            total = r[2 * n + first_state + s]
            for b in range(count):
                total += W.rate_by_x[M.force_state_start[j] + b * states + s] * moved[b]
            r[2 * n + first_state + s] = total
        condensed = states == 1 and M.permutation[first_row + first_state] < 0
        state = W.state_inverse[first_state] * r[2 * n + first_state] if condensed else 0.0
        add_product(j, S)
        if condensed:
            for a in range(count):
                column = M.element_column[first + a]
                if column < n:
                    W.load[column] += W.force_by_state[M.force_state_start[j] + a] * state


@kernel
def add_product(j, S):
    """Add d force / d X of element j times the first row of Work.local to Work.load, four rows at a time."""
    M, W = S.model, S.work
    first, count, start, moved = M.element_start[j], M.element_start[j + 1] - M.element_start[j], M.block_start[j], W.local[0]
    whole = 4 * (count // 4)
    for a in range(0, whole, 4):
        k, l = M.element_column[first + a], M.element_column[first + a + 1]
        p, q = M.element_column[first + a + 2], M.element_column[first + a + 3]
        first_row, second_row = W.load[k] if k < M.n else 0.0, W.load[l] if l < M.n else 0.0
        third_row, fourth_row = W.load[p] if p < M.n else 0.0, W.load[q] if q < M.n else 0.0
        at = start + a * count
        for b in range(count):
            first_row += W.block_x[at + b] * moved[b]
            second_row += W.block_x[at + count + b] * moved[b]
            third_row += W.block_x[at + 2 * count + b] * moved[b]
            fourth_row += W.block_x[at + 3 * count + b] * moved[b]
        if k < M.n:
            W.load[k] = first_row
        if l < M.n:
            W.load[l] = second_row
        if p < M.n:
            W.load[p] = third_row
        if q < M.n:
            W.load[q] = fourth_row
    for a in range(whole, count):
        k = M.element_column[first + a]
        if k < M.n:
            total = W.load[k]
            for b in range(count):
                total += W.block_x[start + a * count + b] * moved[b]
            W.load[k] = total


@kernel
def eliminated_states(r, S):
    """Compute the changes of eliminated states from those of the coordinates in r."""
    M, W = S.model, S.work
    n, hg = M.n, W.gamma[0]
    first_row = n + W.multiplier.size
    for j in range(M.element_start.size - 1):
        first_state, states = M.state_start[j], M.state_start[j + 1] - M.state_start[j]
        if states != 1 or M.permutation[first_row + first_state] >= 0:
            continue
        total = r[2 * n + first_state]
        if acts(j, S):
            for b in range(M.element_start[j + 1] - M.element_start[j]):
                column = M.element_column[M.element_start[j] + b]
                if column < n:
                    at = M.force_state_start[j] + b
                    total += (W.rate_by_v[at] + hg * W.rate_by_x[at]) * r[n + column]
        r[2 * n + first_state] = W.state_inverse[first_state] * total
