"""Redundant quadratic constraints: found at a generic (not singular) position and dropped."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from scissordyn.errors import InputError
from scissordyn.plan.coordinates import Constraint, Coordinates
from scissordyn.plan.elimination import CLOSING_DISPLACEMENT_MAX, CLOSING_RATIO_MAX, in_words
from scissordyn.plan.gradients import Gradients, guesses, least_change
from scissordyn.plan.quadratic_constraints import order_constraints
from scissordyn.tolerance import ASSEMBLY_TOL, ROUND_OFF_TOL, SINGULAR_VALUE_MIN

EXACT_TOLS = 1e-7, 1e-8
"""Tolerances for exact lengths: remainder of a dependent gradient, residual of a redundant constraint.

A unit gradient is dependent if its remainder after projection on the others is below the first value. The constraint is
redundant if its residual stays below the second one after a move guided only by the others.
"""

ROUNDED_TOLS = (1e-2, 1e-4), (1e-2, 3e-3)
"""Tolerances as in `EXACT_TOLS` for rounded lengths, which contradict each other: pairs in the order tried."""

# [rad, relative] Largest change of drives, rod lengths and directions in the random move of the redundancy test
MOVE_SIZE = 0.1


def independent(coordinates: Coordinates, angles: np.ndarray, *, lenient: bool = False) -> Coordinates:
    """Return the coordinates without the constraints that follow from the others at all positions.

    The rank of the gradients after a small random move, drives included, shows which constraints may be redundant. They are
    dropped if they still hold after a second move guided only by the others. If only the start is singular, for example folded
    flat, all constraints stay. A redundant coupling is an error, unless `lenient` is set because clearances make it
    independent. A coupling of prescribed coordinates is an error if they do not meet it.

    Shapes: `angles` (drives,) [rad].
    """
    holding = [constraint for constraint in coordinates.constraints if not constraint.latch]
    if len(holding) < 2 and not (lenient and any(constraint.linear for constraint in holding)):
        return coordinates
    gradients = Gradients(coordinates.free, coordinates.basis, holding)
    b = basis_of(angles)
    x = coordinates.nearest(b, coordinates.placed[0])
    if _is_clearly_independent(gradients, np.append(x, b)):
        _check_motion(coordinates, holding, lenient)
        return coordinates
    # drop rods first, because the multiplier of a length is not reported; couplings last
    classes = np.array([2 if constraint.linear else int(not constraint.name) for constraint in holding])
    values, left = gradients.value.copy(), dict[int, float]()
    for dependent, follows, near in ((*EXACT_TOLS, True), *((*level, False) for level in ROUNDED_TOLS), (*EXACT_TOLS, False)):
        gradients.value[:] = values  # reset the drives to the start
        left = _redundant(gradients, x, angles, classes, dependent, follows, near=near)
        if left:
            break
    moves = np.bincount(gradients.owner, np.hypot(*gradients.size.T), gradients.count) > 0.0
    for k in np.flatnonzero(gradients.linear & ~moves).tolist():
        if k not in left:
            raise InputError(
                f"{gradients.subjects[k]} contradicts the drives and joints that prescribe its coordinates", "another ratio"
            )
    if not left:
        if not lenient:
            _check_gradients(gradients, np.append(x, b), classes)
        _check_motion(coordinates, holding, lenient)
        return coordinates
    for k in left:
        if holding[k].linear and not lenient:
            raise InputError(
                f"{holding[k].subject} is redundant: it follows from other couplings and parts", "a mechanism without it"
            )
        if holding[k].name and not holding[k].linear:
            raise InputError(
                f"{holding[k].subject} is redundant: other parts already keep its distance", "a mechanism without it"
            )
    names = tuple(holding[k].subject for k in left)
    stay = [constraint for k, constraint in enumerate(holding) if k not in left]
    stay += [constraint for constraint in coordinates.constraints if constraint.latch]
    return coordinates.with_constraints(order_constraints(coordinates.free, stay), names, max(left.values()))


def _check_motion(coordinates: Coordinates, holding: list[Constraint], lenient: bool) -> None:
    """Raise `InputError` if couplings prevent any motion and no motion is prescribed."""
    couplings = [constraint.subject for constraint in holding if constraint.linear]
    prescribed = coordinates.basis > 1 or any(constraint.motion for constraint in holding)
    if couplings and not lenient and not prescribed and coordinates.free <= len(holding):
        raise InputError(f"{in_words(couplings)} leave{'s' if len(couplings) == 1 else ''} no motion", "one coupling fewer")


def _check_gradients(gradients: Gradients, full: np.ndarray, classes: np.ndarray) -> None:
    """Raise `InputError` for a coupling or drive whose gradient depends on those of other constraints at all positions."""
    if not np.any(gradients.linear):
        return
    random, aside = np.random.default_rng(1), full.copy()
    step = random.standard_normal(gradients.free)
    largest = np.max(np.abs(gradients.maps[:, : gradients.free] @ step), initial=ASSEMBLY_TOL)
    aside[: gradients.free] += MOVE_SIZE * step / largest
    _, left = _pivots(gradients.unit(aside), classes, EXACT_TOLS[0])
    for k in left:
        if gradients.linear[k]:
            raise InputError(
                f"{gradients.subjects[k]} contradicts other couplings, drives and joints: no motion remains",
                "one of them fewer",
            )


def _redundant(
    gradients: Gradients,
    x: np.ndarray,
    angles: np.ndarray,
    classes: np.ndarray,
    dependent: float,
    follows: float,
    *,
    near: bool,
) -> dict[int, float]:
    """Return the indices of redundant constraints and their residuals after a move, by the method of `independent`.

    `dependent` and `follows` are the tolerances in `EXACT_TOLS`. Constraints of lower `classes` are kept first. If `near`,
    return none if the constraints are met only far from x.
    """
    everything, random, b = np.arange(gradients.count), np.random.default_rng(0), basis_of(angles)
    closing_tol = ROUND_OFF_TOL if dependent == EXACT_TOLS[0] else follows
    x_start = _close(gradients, everything, x, b, closing_tol)
    if x_start is None:
        return {}  # the assembly reports the reason
    far = float(np.max(np.abs(gradients.maps[:, : x.size] @ (x_start - x)), initial=0.0))
    if near and far > max(
        CLOSING_DISPLACEMENT_MAX, CLOSING_RATIO_MAX * float(np.max(np.abs(gradients.residual(np.append(x, b)))))
    ):
        return {}
    moved = _move(gradients, everything, x_start, angles, random, closing_tol)
    if moved is None:
        return {}
    independent, dependent_rows = _pivots(gradients.unit(np.append(*moved)), classes, dependent)
    if not dependent_rows:
        return {}
    moved_again = _move(gradients, np.array(independent, int), moved[0], angles, random, ROUND_OFF_TOL)
    if moved_again is None:
        return {}
    errors = np.abs(gradients.residual(np.append(*moved_again))[dependent_rows])
    return dict(zip(dependent_rows, errors.tolist(), strict=True)) if np.max(errors) <= follows else {}


def assembled_near_placed(coordinates: Coordinates, angles: np.ndarray) -> np.ndarray | None:
    """Return natural coordinates near the placed bodies at which the constraints hold, for given angles of the drives."""
    holding = [constraint for constraint in coordinates.constraints if not constraint.latch]
    gradients, b = Gradients(coordinates.free, coordinates.basis, holding), basis_of(angles)
    for first in guesses(coordinates, b, coordinates.nearest(b, coordinates.placed[0])):
        x = _close(gradients, np.arange(len(holding)), first, b)
        if x is not None:
            return np.asarray(coordinates.matrix @ np.append(x, b))
    return None


def basis_of(angles: np.ndarray) -> np.ndarray:
    """Return (1, cos th_1, sin th_1, ...) for the angles of the drives."""
    return np.concatenate([[1.0], np.stack([np.cos(angles), np.sin(angles)], axis=1).ravel()])


def _is_clearly_independent(gradients: Gradients, full: np.ndarray) -> bool:
    """Return whether the constraints hold and are clearly independent at the placed position."""
    if np.max(np.abs(gradients.residual(full))) > ROUND_OFF_TOL or not np.min(gradients.scale(full)) > 0.0:
        return False
    unit = gradients.unit(full)
    if isinstance(unit, np.ndarray) and gradients.count <= 60:  # larger ones are factorized as sparse matrices
        return bool(np.linalg.eigvalsh(unit @ unit.T)[0] > SINGULAR_VALUE_MIN**2)
    import scipy.sparse as sp
    from scipy.sparse.linalg import splu  # imported here: it takes a tenth of a second

    rows = sp.csr_array(unit)
    try:
        pivots = splu(sp.csc_array(rows @ rows.T), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0).U.diagonal()
    except RuntimeError:  # exactly singular
        return False
    # a pivot is only an upper bound, so a larger margin is needed
    return bool(np.min(pivots) > 10.0 * SINGULAR_VALUE_MIN**2)


def _close(
    gradients: Gradients, chosen: np.ndarray, x: np.ndarray, b: np.ndarray, tolerance: float = ROUND_OFF_TOL
) -> np.ndarray | None:
    """Return free coordinates near x at which the chosen constraints hold within `tolerance`; None if none are found."""
    for _ in range(50):
        full = np.append(x, b)
        residual = gradients.residual(full)[chosen]
        if np.max(np.abs(residual), initial=0.0) < tolerance:
            return x
        # contradictions of rounded numbers must not cause large changes
        cut = ASSEMBLY_TOL if tolerance == ROUND_OFF_TOL else ROUNDED_TOLS[0][0]
        x = x - least_change(gradients.jacobian(full)[chosen][:, : x.size], residual, cut)
    return None


def _move(
    gradients: Gradients, chosen: np.ndarray, x: np.ndarray, angles: np.ndarray, random: np.random.Generator, near: float
) -> tuple[np.ndarray, np.ndarray] | None:
    """Return a position and its b after a random move that keeps the chosen constraints, drives and timed rods included."""
    b = basis_of(angles + MOVE_SIZE * random.uniform(-1.0, 1.0, angles.size))
    change = MOVE_SIZE * random.uniform(-1.0, 1.0, int(np.sum(gradients.timed)))
    values, linear = gradients.value[gradients.timed], gradients.linear[gradients.timed]
    gradients.value[gradients.timed] = np.where(linear, values + change, values * (1.0 + change))
    rows = gradients.jacobian(np.append(x, b))[chosen][:, : x.size]
    step = random.standard_normal(x.size)
    step -= least_change(rows, rows @ step)
    longest = np.max(np.hypot(*np.asarray(gradients.maps[:, : x.size] @ step).reshape(-1, 2).T), initial=0.0)
    step *= MOVE_SIZE / longest if longest > 1e-9 * math.sqrt(x.size) else 0.0
    closed = _close(gradients, chosen, x + step, b, near)
    return None if closed is None else (closed, b)


def _pivots(unit: Any, classes: np.ndarray, dependent: float) -> tuple[list[int], list[int]]:
    """Split rows of length 1 into independent rows and linear combinations of these.

    Rows of lower classes are kept first; within a class those with the longest remainder, so that the kept rows are far from
    dependent. `dependent` is the length of a remainder below which a row counts as a combination of the kept ones.
    """
    from scipy.linalg import qr  # imported here: most mechanisms have no redundant constraints

    rows = unit if isinstance(unit, np.ndarray) else unit.toarray()
    independent: list[int] = []
    basis = np.zeros((rows.shape[1], 0))
    for group in (np.flatnonzero(classes == level) for level in np.unique(classes)):
        rest = rows[group].T
        for _ in range(2):  # the second time removes the round-off of the first
            rest = rest - basis @ (basis.T @ rest)
        # weights prefer earlier rows among equally long ones, so that round-off does not choose
        weights = np.linspace(1.0, 0.5, group.size)
        directions, factors, chosen = qr(rest * weights, mode="economic", pivoting=True)
        short = np.abs(np.diag(factors)) <= dependent * weights[chosen[: factors.shape[0]]]
        rank = int(np.argmax(short)) if np.any(short) else short.size
        independent += group[chosen[:rank]].tolist()
        basis = np.hstack([basis, directions[:, :rank]])
    return sorted(independent), sorted(set(range(len(rows))).difference(independent))
