"""Damping ratios and damped frequencies of the modes about a position, from the quadratic eigenvalue problem."""

from __future__ import annotations

import numpy as np
from scipy.linalg import eig
from scipy.optimize import linear_sum_assignment

from scissordyn.components.clutch import Clutch
from scissordyn.components.guide_friction import GuideFriction
from scissordyn.components.pin_friction import PinFriction
from scissordyn.equilibrium.static_position import StaticPosition, has_potential
from scissordyn.mechanics.system import System


def square_round_off(matrix: np.ndarray, curved: np.ndarray) -> float:
    """Return the round-off of squared angular frequencies [1/s^2] of two stiffnesses, whose sum may cancel."""
    return 1e-15 * len(matrix) * float(np.max(np.abs([matrix, curved]), initial=0.0))


def damped_modes(
    at: StaticPosition, matrix: np.ndarray, allowed: np.ndarray, squares: np.ndarray, motions: np.ndarray, round_off: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return damping ratio, damped angular frequency [1/s] and match of all undamped modes.

    `matrix` and `allowed` are those of `stiffness`, which has just evaluated the position, `squares` and `motions` those of
    `motions_of`. `round_off` is that of squared angular frequencies [1/s^2].

    Eigenvalues are those of the first-order form, with the internal states of controllers and components. Pairs that
    oscillate are assigned first, then two real eigenvalues to each mode that is left.
    """
    damping, by_state, rate_by_x, rate_by_v, rate_by_state = _velocity_and_state_slopes(at)
    m, states = squares.size, len(rate_by_state)
    reduced = allowed.T @ matrix @ allowed
    basis, reduced = (motions, np.diag(squares)) if has_potential(reduced) else (allowed, reduced)
    damping = basis.T @ damping @ basis
    if not damping.any() and states == 0:
        return np.where(squares > 0.0, 0.0, np.nan), np.sqrt(np.maximum(squares, 0.0)), np.ones(m)
    first = np.block(
        [
            [np.zeros((m, m)), np.eye(m), np.zeros((m, states))],
            [-reduced, -damping, basis.T @ by_state],
            [rate_by_x @ basis, rate_by_v @ basis, rate_by_state],
        ]
    )
    values, vectors = eig(first)
    values[np.abs(values) ** 2 < round_off] = 0.0
    match = _modal_assurance(basis.T @ motions, vectors[:m])
    ratio, angular, matched = np.full(m, np.nan), np.zeros(m), np.zeros(m)
    oscillating, real = np.flatnonzero(values.imag > 0.0), np.flatnonzero(values.imag == 0.0)
    modes, pairs = linear_sum_assignment(match[:, oscillating], maximize=True)
    pairs = oscillating[pairs]
    ratio[modes], angular[modes] = -values.real[pairs] / np.abs(values[pairs]), values.imag[pairs]
    matched[modes] = match[modes, pairs]
    left = np.setdiff1d(np.arange(m), modes)
    _, chosen = linear_sum_assignment(np.repeat(match[left][:, real], 2, axis=0), maximize=True)
    two = real[chosen].reshape(-1, 2)
    product = np.prod(values.real[two], axis=1)
    defined = product > 0.0
    ratio[left[defined]] = -0.5 * np.sum(values.real[two[defined]], axis=1) / np.sqrt(product[defined])
    matched[left] = np.min(match[left[:, None], two], axis=1, initial=1.0)
    return ratio, angular, matched


def _modal_assurance(undamped: np.ndarray, damped: np.ndarray) -> np.ndarray:
    """Return the modal assurance criterion of each undamped mode (rows) with each damped shape (columns)."""
    sizes = np.outer(np.sum(undamped**2, axis=0), np.sum(np.abs(damped) ** 2, axis=0))
    return np.asarray(np.abs(undamped.T @ damped) ** 2 / np.where(sizes > 0.0, sizes, 1.0))


def _velocity_and_state_slopes(at: StaticPosition) -> tuple[np.ndarray, ...]:
    """Return -df/dv, df/dz, dz'/dx, dz'/dv and dz'/dz at a position that `stiffness` has evaluated.

    Friction is left out, and so is the damping of contacts, which depends on the speed at their onset.
    """
    content: System = at.system.content
    model, work, n = content.model, content.work, content.model.n
    total, contacts = int(model.state_start[-1]), content.parameters.contact.size
    damping, by_state, by_x, by_v = np.zeros((n, n)), np.zeros((n, total)), np.zeros((total, n)), np.zeros((total, n))
    by_states, has_slopes = np.zeros((total, total)), np.zeros(total, bool)
    for i, part in enumerate(at.plan.acting):
        e, guard = contacts + i, model.component_guard[i]
        touching = part.declaration.contact or "approach_speed" in part.declaration.context
        if isinstance(part, PinFriction | GuideFriction | Clutch) or (
            touching and guard >= 0 and content.state.mode[guard] == 1
        ):
            continue
        columns = model.element_column[model.element_start[e] : model.element_start[e + 1]]
        free, start, place = columns < n, model.block_start[e], model.force_state_start[e]
        at_free, size = columns[free], columns.size
        block = work.block_v[start : start + size**2].reshape(size, size)
        damping[np.ix_(at_free, at_free)] -= block[np.ix_(free, free)]
        part_states = slice(model.state_start[e], model.state_start[e + 1])
        states = part_states.stop - part_states.start
        if states == 0:
            continue
        has_slopes[part_states] = True
        tables = (
            table[place : place + size * states].reshape(size, states)[free]
            for table in (work.force_by_state, work.rate_by_x, work.rate_by_v)
        )
        by_state[at_free, part_states], by_x.T[at_free, part_states], by_v.T[at_free, part_states] = tables
        square = work.rate_by_state[model.state_state_start[e] :][: states**2]
        by_states[part_states, part_states] = square.reshape(states, states)
    return damping, by_state[:, has_slopes], by_x[has_slopes], by_v[has_slopes], by_states[np.ix_(has_slopes, has_slopes)]
