"""Equations of motion in natural coordinates with unit mass matrix.

With d = rows X the forms of the quadratic conditions sum(w |d|^2/2) = level, X = (x, b(t)), Phi = sum(w d^T rows):

    x'' + Phi^T lambda = f - M_xb b'',    sum(w (d . d'' + |d'|^2)) = level''.

State y = (x, x', hidden states of the friction laws). Everything here reads and writes the arrays of `System` S.
"""

from __future__ import annotations

import math

from scissordyn.jit import kernel
from scissordyn.mechanics import band
from scissordyn.mechanics.actuator import recorded_signal
from scissordyn.mechanics.element import add_element_forces, linearise_element, stop_gap
from scissordyn.mechanics.joint import contact_forces, gap, linearise_contact, switch
from scissordyn.mechanics.latch import engage, latch_gap
from scissordyn.mechanics.motion import course_at, prescribe
from scissordyn.mechanics.step_matrix import acts
from scissordyn.mechanics.system import APPROACH_FLOOR

__all__ = [
    "accelerate",
    "guards",
    "linearise",
    "powers",
    "project",
    "record_signals",
    "reset",
]

_band_factorize, _band_solve = band.factorize, band.solve

DRIFT = 1e-13
"""Lengths and their rates are projected back beyond this relative error."""

LOCKED = 1e-9
"""A latch has locked when the rates of all conditions vanish within this share of the fastest rate."""


@kernel(inline=True)
def spread(t, y, S):
    """Write b(t), X and V."""
    n = S.n
    prescribe(t, S.motion, S.motion_start, S.basis, S.angle)
    for i in range(n):
        S.X[i] = y[i]
        S.V[i] = y[n + i]
    for i in range(S.nb):
        S.X[n + i] = S.basis[0, i]
        S.V[n + i] = S.basis[1, i]
    for i in range(S.timed.size):
        k, course = S.timed[i], S.timed_course[i]
        course_at(t, S.motion[S.motion_start[course] : S.motion_start[course + 1]], S.angle)
        l, v, a, j = S.angle[0], S.angle[1], S.angle[2], S.angle[3]
        S.level[0, k], S.level[1, k] = 0.5 * l * l, l * v
        S.level[2, k], S.level[3, k] = v * v + l * a, 3.0 * v * a + l * j


@kernel(inline=True)
def directions(S, source, target):
    """Write the forms of all conditions applied to a vector of columns."""
    for p in range(S.part_weight.size):
        dx = dy = 0.0
        for i in range(S.part_start[p], S.part_start[p + 1]):
            value = source[S.length_column[i]]
            dx += S.length_row[0, i] * value
            dy += S.length_row[1, i] * value
        target[p, 0] = dx
        target[p, 1] = dy


@kernel(inline=True)
def prepare_lengths(S):
    """Write the gradients of the conditions and factorize Phi Phi^T; returns a singular row or -1."""
    for p in range(S.part_weight.size):
        dx, dy = S.part_weight[p] * S.direction[p, 0], S.part_weight[p] * S.direction[p, 1]
        for i in range(S.part_start[p], S.part_start[p + 1]):
            S.gradient[i] = dx * S.length_row[0, i] + dy * S.length_row[1, i]
    lower, upper = S.band_limits[2], S.band_limits[3]
    if S.gram.shape[0] == 1:
        total = 0.0
        for i in range(S.match.shape[0]):
            total += S.gradient[S.match[i, 0]] * S.gradient[S.match[i, 1]]
        S.gram[0, 0] = total + S.idle[0]
        return -1 if S.gram[0, 0] > 0.0 else 0
    S.gram[:, :] = 0.0
    for p in range(S.overlap.shape[0] - 1):
        k, l = S.overlap[p, 0], S.overlap[p, 1]
        total = 0.0
        for i in range(S.overlap[p, 2], S.overlap[p + 1, 2]):
            total += S.gradient[S.match[i, 0]] * S.gradient[S.match[i, 1]]
        S.gram[k, l - k + lower] = total
        S.gram[l, k - l + lower] = total
    for k in range(S.idle.size):
        S.gram[k, lower] += S.idle[k]
    return _band_factorize(S.gram, lower, upper, S.gram_pivots)


@kernel(inline=True)
def solve_lengths(S, values):
    """Overwrite `values` with (Phi Phi^T)^-1 values."""
    if values.size == 1:
        values[0] /= S.gram[0, 0]
    elif values.size > 1:
        _band_solve(S.gram, S.band_limits[2], S.band_limits[3], S.gram_pivots, values)


@kernel(inline=True)
def subtract_gradients(S, values, target, first):
    """Subtract Phi^T values from target[first : first + n]."""
    for k in range(S.length_start.size - 1):
        value = values[k]
        for i in range(S.length_start[k], S.length_start[k + 1]):
            column = S.length_column[i]
            if column < S.n:
                target[first + column] -= S.gradient[i] * value


@kernel(inline=True)
def accelerate(t, y, S, dy):
    """Right-hand side: write y' into dy."""
    n, nb = S.n, S.nb
    spread(t, y, S)
    for i in range(n + nb):
        S.force[i] = S.weight[i]
    for j in range(S.radius.shape[0]):
        start, stop = S.state_start[j], S.state_start[j + 1]
        if S.mode[j] == 1:
            contact_forces(j, S, y[2 * n + start : 2 * n + stop], dy[2 * n + start : 2 * n + stop])
        else:
            for i in range(start, stop):
                dy[2 * n + i] = 0.0
    for i in range(S.element.shape[0]):
        start, stop = 2 * n + S.state_start[S.radius.shape[0] + i], 2 * n + S.state_start[S.radius.shape[0] + i + 1]
        add_element_forces(t, i, S, y[start:stop], dy[start:stop])
    for i in range(n):
        total = S.force[i]
        for k in range(1, nb):
            total -= S.inertia[i, k] * S.basis[2, k]
        dy[i] = S.V[i]
        dy[n + i] = total
    for i in range(nb):
        S.A[n + i] = S.basis[2, i]
    if S.multiplier.size > 0:
        directions(S, S.X, S.direction)
        directions(S, S.V, S.direction_rate)
        singular = prepare_lengths(S) >= 0
        for latch in range(S.latch_side.size):  # one that could not lock
            singular = singular or math.isnan(S.approach[S.radius.shape[0] + latch])
        for k in range(S.multiplier.size):
            S.multiplier[k] = math.nan if singular else -S.level[2, k]
        for p in range(S.part_weight.size):
            ux, uy = S.direction_rate[p, 0], S.direction_rate[p, 1]
            S.multiplier[S.part_condition[p]] += S.part_weight[p] * (ux * ux + uy * uy)
        for k in range(S.multiplier.size):
            total = S.multiplier[k]
            for i in range(S.length_start[k], S.length_start[k + 1]):
                column = S.length_column[i]
                total += S.gradient[i] * (dy[n + column] if column < n else S.A[column])
            S.multiplier[k] = total
        solve_lengths(S, S.multiplier)
        subtract_gradients(S, S.multiplier, dy, n)
    for i in range(n):
        S.A[i] = dy[n + i]


@kernel(inline=True)
def linearise(t, y, S, dy, dt):
    """Write y' into dy, the partial derivative of y' by time into dt, and prepare `factorize`."""
    n, nb = S.n, S.nb
    accelerate(t, y, S, dy)
    directions(S, S.A, S.direction_acceleration)
    for i in range(2 * n):
        dt[i] = 0.0
    for i in range(n):
        for k in range(1, nb):
            dt[n + i] -= S.inertia[i, k] * S.basis[3, k]
    for j in range(S.link_start.size - 1):
        start, stop = S.state_start[j], S.state_start[j + 1]
        for i in range(start, stop):
            dt[2 * n + i] = 0.0
        if not acts(j, S):
            continue
        states = stop - start
        if j < S.radius.shape[0]:
            by_state = S.state_jacobian[: states + 3, :states]
            linearise_contact(j, S, y[2 * n + start : 2 * n + stop], by_state, S.state_work[0], S.state_work[1])
        else:
            linearise_element(t, j - S.radius.shape[0], S, y[2 * n + start : 2 * n + stop], dt, 2 * n + start)
        first, count = S.link_start[j], S.link_start[j + 1] - S.link_start[j]
        for b in range(count):
            column = S.link_column[first + b] - n
            if column <= 0:  # free, or the constant 1
                continue
            w, a = S.basis[1, column], S.basis[2, column]
            for i in range(count):
                row = S.link_column[first + i]
                if row < n:
                    at = S.block_start[j] + i * count + b
                    dt[n + row] += S.block_x[at] * w + S.block_v[at] * a
            for s in range(states):
                at = S.force_state_start[j] + b * states + s
                dt[2 * n + start + s] += S.rate_by_x[at] * w + S.rate_by_v[at] * a
    m = S.multiplier.size
    if m == 0:
        return
    # the stages of a step overwrite these
    for k in range(m):
        S.frozen_multiplier[k] = S.multiplier[k]
        S.work[k] = -S.level[3, k]
    for i in range(S.gradient.size):
        S.frozen_gradient[i] = S.gradient[i]
    for p in range(S.part_weight.size):  # d (Phi^T) / dt lambda, and what the conditions themselves gain
        for axis in range(2):
            S.frozen_direction[p, axis] = S.direction[p, axis]
            S.frozen_rate[p, axis] = S.direction_rate[p, axis]
        ex = ey = fx = fy = gx = gy = 0.0
        for i in range(S.part_start[p], S.part_start[p + 1]):
            column = S.length_column[i] - n
            if column > 0:
                rx, ry = S.length_row[0, i], S.length_row[1, i]
                ex += rx * S.basis[1, column]
                ey += ry * S.basis[1, column]
                fx += rx * S.basis[2, column]
                fy += ry * S.basis[2, column]
                gx += rx * S.basis[3, column]
                gy += ry * S.basis[3, column]
        k, weight = S.part_condition[p], S.part_weight[p]
        for i in range(S.part_start[p], S.part_start[p + 1]):
            column = S.length_column[i]
            if column < n:
                dt[n + column] -= S.multiplier[k] * weight * (S.length_row[0, i] * ex + S.length_row[1, i] * ey)
        S.work[k] += weight * (
            ex * S.direction_acceleration[p, 0]
            + ey * S.direction_acceleration[p, 1]
            + 2.0 * (S.direction_rate[p, 0] * fx + S.direction_rate[p, 1] * fy)
            + S.direction[p, 0] * gx
            + S.direction[p, 1] * gy
        )
    for k in range(m):
        for i in range(S.length_start[k], S.length_start[k + 1]):
            column = S.length_column[i]
            if column < n:
                S.work[k] += S.gradient[i] * dt[n + column]
    solve_lengths(S, S.work[:m])
    subtract_gradients(S, S.work, dt, n)


@kernel(inline=True)
def project(t, y, S):
    """Bring lengths and their rates back to their conditions; returns whether y changed."""
    n, m = S.n, S.multiplier.size
    changed = False
    if m == 0:
        return changed
    spread(t, y, S)
    for _ in range(3):
        directions(S, S.X, S.direction)
        worst = 0.0
        for k in range(m):
            S.work[k] = -S.level[0, k]
        for p in range(S.part_weight.size):
            dx, dy = S.direction[p, 0], S.direction[p, 1]
            S.work[S.part_condition[p]] += 0.5 * S.part_weight[p] * (dx * dx + dy * dy)
        for k in range(m):
            worst = max(worst, abs(S.work[k]))
        if not worst > DRIFT or prepare_lengths(S) >= 0:
            break
        solve_lengths(S, S.work[:m])
        subtract_gradients(S, S.work, y, 0)
        for i in range(n):
            S.X[i] = y[i]
        changed = True
    directions(S, S.V, S.direction_rate)
    worst = fastest = 0.0
    for k in range(m):
        S.work[k] = -S.level[1, k]
    for p in range(S.part_weight.size):
        ux, uy = S.direction_rate[p, 0], S.direction_rate[p, 1]
        S.work[S.part_condition[p]] += S.part_weight[p] * (S.direction[p, 0] * ux + S.direction[p, 1] * uy)
        fastest = max(fastest, abs(ux) + abs(uy))
    for k in range(m):
        worst = max(worst, abs(S.work[k]))
    if worst > DRIFT * fastest and prepare_lengths(S) < 0:
        solve_lengths(S, S.work[:m])
        subtract_gradients(S, S.work, y, n)
        changed = True
    return changed


@kernel(inline=True)
def guards(t, y, S, value, rate):
    """Write what must rise through zero, and its rate: |e| - c of loose joints, the angle past a latch, the way past a stop."""
    spread(t, y, S)
    joints = S.radius.shape[0]
    for j in range(joints):
        value[j], rate[j] = gap(j, S)
    if S.mode.size == joints:
        return
    for latch in range(S.latch_side.size):
        value[joints + latch], rate[joints + latch] = latch_gap(latch, S)
    for i in range(S.guard.size):
        if S.guard[i] >= 0:
            value[S.guard[i]], rate[S.guard[i]] = stop_gap(i, S)


@kernel(inline=True)
def reset(t, y, j, S, record):
    """Joint j has just touched or separated, a latch has locked, or an end stop was reached or left."""
    spread(t, y, S)
    joints = S.radius.shape[0]
    if j < joints:
        switch(t, y, j, S, record)
    elif j < joints + S.latch_side.size:
        lock(t, y, j, S, record)
    else:
        for i in range(S.guard.size):
            if S.guard[i] == j:
                record[0] = stop_gap(i, S)[1]
        record[1] = 0.0
        S.approach[j] = max(record[0], APPROACH_FLOOR)
        S.mode[j] = 1 - S.mode[j]


@kernel(inline=True)
def slackness(t, y, S):
    """Largest error in the rate of a condition."""
    spread(t, y, S)
    directions(S, S.X, S.direction)
    directions(S, S.V, S.direction_rate)
    for k in range(S.multiplier.size):
        S.work[k] = -S.level[1, k]
    for p in range(S.part_weight.size):
        dx, dy, ux, uy = S.direction[p, 0], S.direction[p, 1], S.direction_rate[p, 0], S.direction_rate[p, 1]
        S.work[S.part_condition[p]] += S.part_weight[p] * (dx * ux + dy * uy)
    worst = 0.0
    for k in range(S.multiplier.size):
        if not abs(S.work[k]) <= worst:  # NaN is the worst
            worst = abs(S.work[k])
    return worst


@kernel(inline=True)
def lock(t, y, guard, S, record):
    """A plastic impact onto a latch's condition; `record` gets the spin before and the energy lost.

    Where the other conditions forbid it, the state stays and the latch's memory is NaN: no step goes on from there.
    """
    n = S.n
    record[0] = latch_gap(guard - S.radius.shape[0], S)[1]
    before = 0.0
    for i in range(2 * n):
        S.scratch[i] = y[i]
    directions(S, S.V, S.direction_rate)
    fastest = 0.0
    for p in range(S.part_weight.size):
        fastest = max(fastest, abs(S.direction_rate[p, 0]) + abs(S.direction_rate[p, 1]))
    S.mode[guard] = 1
    engage(S)
    project(t, y, S)
    if not slackness(t, y, S) <= LOCKED * fastest:
        for i in range(2 * n):
            y[i] = S.scratch[i]
        S.approach[guard] = math.nan
        record[1] = 0.0
        return
    for i in range(n):
        old, new = S.scratch[n + i], y[n + i]
        before += 0.5 * (old - new) * (old + new)
        for k in range(1, S.nb):
            before += (old - new) * S.inertia[i, k] * S.basis[1, k]
    record[1] = before


@kernel(inline=True)
def record_signals(t, y, S, signals):
    """Write the signals that controllers look back at."""
    spread(t, y, S)
    for i in range(S.element.shape[0]):
        if S.recorder[i] >= 0:
            signals[S.recorder[i]] = recorded_signal(t, i, S)


@kernel(inline=True)
def constraint_forces(S, target):
    """Write what the drives exert on each entry of b beyond the constant one into target[0:nb]."""
    n, nb = S.n, S.nb
    for i in range(nb):
        total = -S.force[n + i]
        for k in range(n):
            total += S.inertia[k, i] * S.A[k]
        for k in range(nb):
            total += S.inertia_b[i, k] * S.basis[2, k]
        target[i] = total
    for k in range(S.multiplier.size):
        for i in range(S.length_start[k], S.length_start[k + 1]):
            column = S.length_column[i] - n
            if column >= 0:
                target[column] += S.gradient[i] * S.multiplier[k]


@kernel(inline=True)
def powers(t, y, S, power, watched):
    """Write the powers [W] of drives, contact damping, friction, loads and dampers.

    And per guard what `advance` watches: the force, and the powers of damping and friction. Everything stands in S since
    `accelerate` was called for the same instant and state.
    """
    constraint_forces(S, S.work_b)
    total = 0.0
    for i in range(1, S.nb):
        total += S.work_b[i] * S.basis[1, i]
    for i in range(S.timed.size):
        total -= S.multiplier[S.timed[i]] * S.level[1, S.timed[i]]
    power[0], power[1], power[2], power[3], power[4] = total, 0.0, 0.0, 0.0, 0.0
    for i in range(S.element.shape[0]):
        power[3] += S.element[i, 6]
        power[4] += S.element[i, 7]
    watched[:, :] = 0.0
    for j in range(S.radius.shape[0]):
        if S.mode[j] == 1:
            watched[j, 0] = S.joint[j, 4]
            watched[j, 1] = (S.joint[j, 4] - S.joint[j, 3]) * S.joint[j, 1]
            watched[j, 2] = S.joint[j, 5] * S.joint[j, 2]
            power[1] += watched[j, 1]
            power[2] += watched[j, 2]
