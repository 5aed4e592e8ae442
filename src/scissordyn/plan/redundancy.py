"""Quadratic constraints that follow from the others, found at a position that is nothing special, and left out."""

from __future__ import annotations

import math

import numpy as np
import scipy.sparse as sp

from scissordyn.errors import InputError
from scissordyn.plan.coordinates import Coordinates
from scissordyn.plan.gradients import Gradients, least_change
from scissordyn.plan.quadratic_constraints import order_constraints

__all__ = ["independent"]

CLOSED = 1e-11
"""Constraints that hold within this are met."""

DEPENDENT = 1e-7
"""Gradients are dependent when their smallest singular value, each of length one, is below this."""

FOLLOWS = 1e-8
"""A constraint that still holds within this after a move that only the others guided follows from them."""

MOVE = 0.1
"""Size of that move, in maps of the order of one."""

BEYOND_DOUBT = 1e-3
"""Gradients, each of length one, with a smallest singular value above this are independent."""

LARGE = 60
"""More constraints than this are looked at by a sparse factorization first."""


def independent(coordinates: Coordinates, angles: np.ndarray) -> Coordinates:
    """Coordinates without the constraints that follow from the others wherever the mechanism goes.

    At a position near the start, after a small random move of the drives too, the rank of the gradients tells which might
    follow; they are left out if they still hold after another such move that only the others guided. Where only the start is
    special, such as folded flat, all constraints stay.

    Parameters
    ----------
    coordinates : Coordinates
    angles : ndarray, shape (drives,)
        Of the drives at t = 0 [rad].

    Returns
    -------
    Coordinates

    Raises
    ------
    InputError
        If a rod follows from the other parts: its force is not determined.
    """
    holding = [constraint for constraint in coordinates.constraints if not constraint.latch]
    if len(holding) < 2:
        return coordinates
    gradients = Gradients(coordinates.free, coordinates.basis, holding)
    b = _basis(angles)
    x = coordinates.nearest(b, coordinates.placed[0])
    if _beyond_doubt(gradients, np.append(x, b)):
        return coordinates
    everything = np.arange(len(holding))
    random = np.random.default_rng(0)
    x_start = _close(gradients, everything, x, b)
    moved = None if x_start is None else _move(gradients, everything, x_start, angles, random)
    if moved is None:
        return coordinates  # the assembly says why
    x_near, b_near = moved
    unit = gradients.unit(np.append(x_near, b_near))
    # rods first: what is left out had better be a length, whose multiplier nobody asks for
    order = np.argsort([not constraint.name for constraint in holding], kind="stable")
    kept, left = _pivots(unit if isinstance(unit, np.ndarray) else unit.toarray(), order)
    if not left:
        return coordinates
    again = _move(gradients, np.array(kept), x_near, angles, random)
    if again is None or np.max(np.abs(gradients.residual(np.append(*again))[left])) > FOLLOWS:
        return coordinates
    for k in left:
        if holding[k].name:
            raise InputError(f"{holding[k].subject} keeps a distance that other parts keep already", "leave it out")
    names = tuple(holding[k].subject for k in left)
    stay = [holding[k] for k in sorted(kept)] + [constraint for constraint in coordinates.constraints if constraint.latch]
    return coordinates.with_constraints(order_constraints(coordinates.free, stay), names)


def _basis(angles: np.ndarray) -> np.ndarray:
    return np.concatenate([[1.0], np.stack([np.cos(angles), np.sin(angles)], axis=1).ravel()])


def _beyond_doubt(gradients: Gradients, full: np.ndarray) -> bool:
    """Whether the constraints hold and are plainly independent where the bodies are placed."""
    if np.max(np.abs(gradients.residual(full))) > CLOSED or not np.min(gradients.scale(full)) > 0.0:
        return False
    unit = gradients.unit(full)
    if isinstance(unit, np.ndarray) and gradients.count <= LARGE:
        return bool(np.linalg.eigvalsh(unit @ unit.T)[0] > BEYOND_DOUBT**2)
    from scipy.sparse.linalg import splu  # takes a tenth of a second to import

    rows = sp.csr_array(unit)
    try:
        pivots = splu(sp.csc_array(rows @ rows.T), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0).U.diagonal()
    except RuntimeError:  # exactly singular
        return False
    # a small pivot is a bound from above only, so that more of a margin is asked for
    return bool(np.min(pivots) > 10.0 * BEYOND_DOUBT**2)


def _close(gradients: Gradients, chosen: np.ndarray, x: np.ndarray, b: np.ndarray) -> np.ndarray | None:
    """Free coordinates near x at which some of the constraints hold, or nothing."""
    for _ in range(50):
        full = np.append(x, b)
        residual = gradients.residual(full)[chosen]
        if np.max(np.abs(residual)) < CLOSED:
            return x
        x = x - least_change(gradients.jacobian(full)[chosen][:, : x.size], residual)
    return None


def _move(
    gradients: Gradients, chosen: np.ndarray, x: np.ndarray, angles: np.ndarray, random: np.random.Generator
) -> tuple[np.ndarray, np.ndarray] | None:
    """A position some way off at which some of the constraints hold, drives and timed rods moved a little too, with its b."""
    b = _basis(angles + MOVE * random.uniform(-1.0, 1.0, angles.size))
    gradients.value[gradients.timed] *= 1.0 + MOVE * random.uniform(-1.0, 1.0, int(np.sum(gradients.timed)))
    rows = gradients.jacobian(np.append(x, b))[chosen][:, : x.size]
    step = random.standard_normal(x.size)
    step -= least_change(rows, rows @ step)
    longest = np.max(np.hypot(*np.asarray(gradients.maps[:, : x.size] @ step).reshape(-1, 2).T), initial=0.0)
    step *= MOVE / longest if longest > 1e-9 * math.sqrt(x.size) else 0.0
    near = _close(gradients, chosen, x + step, b)
    return None if near is None else (near, b)


def _pivots(rows: np.ndarray, order: np.ndarray) -> tuple[list[int], list[int]]:
    """Which rows are independent and which are combinations of them, the first in `order` kept where there is a choice."""
    kept: list[int] = []
    left: list[int] = []
    basis = np.zeros(rows.shape)
    for k in order.tolist():
        found = basis[: len(kept)]
        rest = rows[k] - found.T @ (found @ rows[k])
        rest -= found.T @ (found @ rest)
        size = float(np.linalg.norm(rest))
        if size > DEPENDENT:
            basis[len(kept)] = rest / size
            kept.append(k)
        else:
            left.append(k)
    return kept, left
