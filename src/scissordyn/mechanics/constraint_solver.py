"""Quadratic constraints during a run: values, gradients, multipliers and projection.

With d = rows X the maps of a constraint, its value is sum(w |d|^2/2), its gradient Phi = sum(w d^T rows).
"""

from __future__ import annotations

import math

from scissordyn.kernel import kernel
from scissordyn.mechanics import band
from scissordyn.mechanics.constraint_part import part_slope, part_value
from scissordyn.mechanics.time_function import motion_at, piece_time, prescribe
from scissordyn.tolerance import CONSTRAINT_TOL, DIFFERENCE_FRACTION

MONITORED_RATIO_MAX = 0.1
"""Largest pivot ratio of the constraints at which the time until a singular position is estimated.

The ratio is the square root of the smallest pivot of Phi Phi^T over its largest value so far.
"""


@kernel
def expand(t, y, S):
    """Write b(t), X, V and the values of timed constraints."""
    M, W = S.model, S.work
    n = M.n
    move_drives(t, S)
    for i in range(n):
        W.X[i] = y[i]
        W.V[i] = y[n + i]
    for i in range(M.nb):
        W.X[n + i] = W.basis[0, i]
        W.V[n + i] = W.basis[1, i]


@kernel
def move_drives(t, S):
    """Write b(t) and the values of timed constraints, unless they are already those of time t."""
    M, P, W = S.model, S.parameters, S.work
    if t == W.instant[0]:
        return
    W.instant[0] = t
    prescribe(t, piece_time(t, W.segment), P.motion, P.motion_start, W.basis, W.function_value)
    for i in range(M.timed.size):
        k, which = M.timed[i], M.timed_function[i]
        motion_at(t, which, S)
        unit, f = M.timed_unit[i], W.function_value
        l, v, a, j = unit * f[0], unit * f[1], unit * f[2], unit * f[3]
        if M.timed_linear[i] == 1:
            W.value[0, k], W.value[1, k], W.value[2, k], W.value[3, k] = l, v, a, j
            continue
        # a distance l(t): value l^2/2 and its time derivatives
        W.value[0, k], W.value[1, k] = 0.5 * l * l, l * v
        W.value[2, k], W.value[3, k] = v * v + l * a, 3.0 * v * a + l * j


@kernel
def expand_element(t, y, element, S):
    """Write those entries of b(t), X and V that the maps of one force element read."""
    M, W = S.model, S.work
    n = M.n
    move_drives(t, S)
    for k in range(M.element_start[element], M.element_start[element + 1]):
        column = M.element_column[k]
        if column < n:
            W.X[column], W.V[column] = y[column], y[n + column]
        else:
            W.X[column], W.V[column] = W.basis[0, column - n], W.basis[1, column - n]


@kernel
def expand_track(t, y, track, S):
    """Write those entries of b(t) and X that the map of one tracked point reads."""
    M, W = S.model, S.work
    move_drives(t, S)
    for k in range(M.track_start[track], M.track_start[track + 1]):
        column = M.track_column[k]
        W.X[column] = y[column] if column < M.n else W.basis[0, column - M.n]


@kernel
def map_directions(S, source, target):
    """Apply the maps of all constraints to a vector of columns."""
    M = S.model
    for p in range(M.part_constraint.size):
        dx = dy = 0.0
        for i in range(M.part_start[p], M.part_start[p + 1]):
            value = source[M.constraint_column[i]]
            dx += M.constraint_row[0, i] * value
            dy += M.constraint_row[1, i] * value
        target[p, 0] = dx
        target[p, 1] = dy


@kernel
def scatter_row(k, S):
    """Write the gradient of constraint k as a full row to Work.gram_row, which must contain zeros."""
    M, W = S.model, S.work
    for i in range(M.constraint_start[k], M.constraint_start[k + 1]):
        if M.constraint_column[i] < M.n:
            W.gram_row[M.constraint_column[i]] += W.gradient[i]


@kernel
def clear_row(k, S):
    """Reset the entries of Work.gram_row that `scatter_row` has written for constraint k to zero."""
    M, W = S.model, S.work
    for i in range(M.constraint_start[k], M.constraint_start[k + 1]):
        if M.constraint_column[i] < M.n:
            W.gram_row[M.constraint_column[i]] = 0.0


@kernel
def factorize_constraints(S):
    """Write the gradients of the constraints and factorize Phi Phi^T; return a singular row, or -1."""
    M, W = S.model, S.work
    # gradients: Phi = sum w d^T rows (R4), or with the slopes of other functions of d
    for p in range(M.part_constraint.size):
        sx, sy = part_slope(M.part_reference[p], W.direction[p, 0], W.direction[p, 1])
        dx, dy = W.part_weight[p] * sx, W.part_weight[p] * sy
        for i in range(M.part_start[p], M.part_start[p + 1]):
            W.gradient[i] = dx * M.constraint_row[0, i] + dy * M.constraint_row[1, i]
    # Phi Phi^T, over the pairs of constraints that share columns
    lower, upper = M.band_limits[2], M.band_limits[3]
    W.gram[:, :] = 0.0
    row = -1
    for p in range(M.overlap.shape[0]):
        k, l = M.overlap[p, 0], M.overlap[p, 1]
        if k != row:
            if row >= 0:
                clear_row(row, S)
            scatter_row(k, S)
            row = k
        total = 0.0
        for i in range(M.constraint_start[l], M.constraint_start[l + 1]):
            if M.constraint_column[i] < M.n:
                total += W.gradient[i] * W.gram_row[M.constraint_column[i]]
        W.gram[k, l - k + lower] = total
        W.gram[l, k - l + lower] = total
    if row >= 0:
        clear_row(row, S)
    # an inactive latch has a gradient of zero: a unit diagonal makes its multiplier zero
    for k in range(W.inactive.size):
        W.gram[k, lower] += W.inactive[k]
    if W.gram.shape[0] == 1:
        return -1 if W.gram[0, 0] > 0.0 else 0
    return band.factorize(W.gram, lower, upper, W.gram_pivots)


@kernel
def solve_constraints(S, values):
    """Overwrite `values` with (Phi Phi^T)^-1 values."""
    M, W = S.model, S.work
    if values.size == 1:
        values[0] /= W.gram[0, 0]
    elif values.size > 1:
        band.solve(W.gram, M.band_limits[2], W.gram_pivots, values)


@kernel
def subtract_gradients(S, values, target, first):
    """Subtract Phi^T values from target[first : first + n]."""
    M, W = S.model, S.work
    for k in range(M.constraint_start.size - 1):
        value = values[k]
        for i in range(M.constraint_start[k], M.constraint_start[k + 1]):
            column = M.constraint_column[i]
            if column < M.n:
                target[first + column] -= W.gradient[i] * value


@kernel
def rod_force(k, scale, multiplier, S):
    """Return the force -lambda d on the end of a rod with constraint k, where d is the map of its only part."""
    M, direction, part = S.model, S.work.direction, 0
    while M.part_start[part] != M.constraint_start[k]:
        part += 1
    factor = -multiplier[k] / scale
    return factor * direction[part, 0], factor * direction[part, 1]


@kernel
def value_errors(S):
    """Write the errors of the constraints into Work.work; return the largest error."""
    M, W, worst = S.model, S.work, 0.0
    for k in range(W.multiplier.size):
        W.work[k] = -W.value[0, k]
    for p in range(M.part_constraint.size):
        W.work[M.part_constraint[p]] += W.part_weight[p] * part_value(p, S)
    for k in range(W.multiplier.size):
        worst = max(worst, abs(W.work[k]))
    return worst


@kernel
def velocity_errors(S):
    """Write the errors of the constraint rates into Work.work; return the largest rate of a map."""
    M, W = S.model, S.work
    map_directions(S, W.V, W.direction_rate)
    fastest = 0.0
    for k in range(W.multiplier.size):
        W.work[k] = -W.value[1, k]
    # rate of (R4): sum w d . d' minus the rate of the value
    for p in range(M.part_constraint.size):
        ux, uy = W.direction_rate[p, 0], W.direction_rate[p, 1]
        sx, sy = part_slope(M.part_reference[p], W.direction[p, 0], W.direction[p, 1])
        W.work[M.part_constraint[p]] += W.part_weight[p] * (sx * ux + sy * uy)
        fastest = max(fastest, abs(ux) + abs(uy))
    return fastest


@kernel
def project(t, y, S):
    """Project the state to the constraints and their rates; return whether y changed."""
    M, W = S.model, S.work
    n, m = M.n, W.multiplier.size
    expand(t, y, S)
    if m == 0:
        return False
    changed = False
    # positions by Newton's method, the first of (R7)
    for _ in range(3):  # Newton steps; drift within a step needs one
        map_directions(S, W.X, W.direction)
        if not value_errors(S) > CONSTRAINT_TOL or factorize_constraints(S) >= 0:
            break
        solve_constraints(S, W.work[:m])
        subtract_gradients(S, W.work, y, 0)
        for i in range(n):
            W.X[i] = y[i]
        changed = True
    # rates by one linear solution, the second of (R7)
    fastest, worst = velocity_errors(S), 0.0
    for k in range(m):
        worst = max(worst, abs(W.work[k]))
    if worst > CONSTRAINT_TOL * fastest and factorize_constraints(S) < 0:
        solve_constraints(S, W.work[:m])
        subtract_gradients(S, W.work, y, n)
        for i in range(n):
            W.V[i] = y[n + i]
        changed = True
    return changed


@kernel
def velocity_residual(t, y, S):
    """Return the largest error of a constraint rate; NaN if one is NaN."""
    W = S.work
    expand(t, y, S)
    map_directions(S, W.X, W.direction)
    velocity_errors(S)
    worst = 0.0
    for k in range(W.multiplier.size):
        if not abs(W.work[k]) <= worst:
            worst = abs(W.work[k])
    return worst


@kernel
def dependence(S):
    """Return the square root of the smallest pivot of the last Phi Phi^T; it is linear in the distance from a singularity."""
    M, W = S.model, S.work
    least, lower = abs(W.gram[0, M.band_limits[2]]), M.band_limits[2]
    for k in range(1, W.gram.shape[0]):
        least = min(least, abs(W.gram[k, lower]))
    return math.sqrt(least)


@kernel
def singular_ahead(fastest, S):
    """Return the time until the constraint gradients become dependent at the present rate; infinite if not near.

    `project` must have written X and V. Work.near[1] receives the square root of the smallest pivot, relative to the largest so
    far.
    """
    M, W = S.model, S.work
    if W.multiplier.size == 0 or not fastest > 0.0:
        return math.inf
    measure = dependence(S)
    W.near[0] = max(W.near[0], measure)
    if measure > MONITORED_RATIO_MAX * W.near[0]:
        return math.inf
    # suspected from the last factorization: factorize at this position
    map_directions(S, W.X, W.direction)
    if factorize_constraints(S) >= 0:
        return math.inf
    measure = dependence(S)
    W.near[0] = max(W.near[0], measure)
    W.near[1] = measure / W.near[0]
    if measure > MONITORED_RATIO_MAX * W.near[0]:
        return math.inf
    # near the singular position the root is linear: extrapolate it along the motion
    step = DIFFERENCE_FRACTION / fastest
    for i in range(M.n + M.nb):
        W.A[i] = W.X[i] + step * W.V[i]
    map_directions(S, W.A, W.direction)
    rate = 0.0
    if factorize_constraints(S) < 0:
        rate = (dependence(S) - measure) / step
    map_directions(S, W.X, W.direction)
    factorize_constraints(S)
    return -measure / rate if rate < 0.0 else math.inf


@kernel
def engage(S):
    """Activate or deactivate the constraints of latches according to their modes."""
    M, W = S.model, S.work
    for latch in range(M.latch.shape[0]):
        k, p, component = M.latch[latch, 0], M.latch[latch, 1], M.latch[latch, 2]
        locked = float(S.state.mode[M.component_guard[component]])
        W.inactive[k] = 1.0 - locked
        W.part_weight[p] = locked * M.part_full[p]
        W.part_weight[p + 1] = locked * M.part_full[p + 1]
