"""Quadratic conditions that follow from the others, found at a position that is nothing special, and left out."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from scissordyn.errors import InputError
from scissordyn.mechanics.conditions import order_conditions
from scissordyn.mechanics.form import Condition, Layout, placed
from scissordyn.mechanics.motion import course_start

__all__ = ["Gradients", "independent", "start_basis"]

CLOSED = 1e-11
"""Conditions that hold within this are met."""

DEPENDENT = 1e-7
"""Gradients are dependent when their smallest singular value, each of length one, is below this."""

FOLLOWS = 1e-8
"""A condition that still holds within this after a move that only the others guided follows from them."""

MOVE = 0.1
"""Size of that move, in coordinates that are unit directions."""

BEYOND_DOUBT = 1e-3
"""Gradients, each of length one, with a smallest singular value above this are independent."""

LARGE = 60
"""More conditions than this are looked at by a sparse factorization first."""


class Gradients:
    """The conditions of a layout as functions of [x; b], with their gradients by x.

    Parameters
    ----------
    layout : Layout
    conditions : list of Condition
    """

    def __init__(self, layout: Layout, conditions: list[Condition]) -> None:
        self.free, self.count = layout.free, len(conditions)
        parts = [(k, weight, form) for k, condition in enumerate(conditions) for weight, form in condition.parts]
        self.owner = np.array([k for k, _, _ in parts], int)
        self.weight = np.array([weight for _, weight, _ in parts], float)
        self.level = np.array([condition.level for condition in conditions], float)
        self.timed = np.array([condition.motion is not None for condition in conditions], bool)
        rows = np.concatenate([np.repeat([2 * p, 2 * p + 1], form.columns.size) for p, (_, _, form) in enumerate(parts)])
        columns = np.concatenate([np.tile(form.columns, 2) for _, _, form in parts])
        values = np.concatenate([form.rows.ravel() for _, _, form in parts])
        shape = (2 * len(parts), layout.free + layout.basis)
        self.forms = sp.csr_array((values, (rows, columns)), shape=shape)
        moving = sp.csr_array(self.forms[:, : layout.free])
        self.size = np.sqrt(np.asarray(moving.multiply(moving).sum(axis=1))).reshape(-1, 2)

    def __call__(self, full: np.ndarray) -> tuple[np.ndarray, sp.csr_array, np.ndarray]:
        """Residuals, gradients by x, and how long each gradient could be, at [x; b]."""
        d = (self.forms @ full).reshape(-1, 2)
        residual = np.zeros(self.count)
        np.add.at(residual, self.owner, 0.5 * self.weight * np.sum(d * d, axis=1))
        parts = np.arange(self.owner.size)
        pairing = sp.csr_array(
            ((self.weight[:, None] * d).ravel(), (np.repeat(self.owner, 2), np.stack([2 * parts, 2 * parts + 1], 1).ravel())),
            shape=(self.count, 2 * parts.size),
        )
        scale = np.zeros(self.count)
        # a link that shrinks to nothing loses its gradient: what it was at the start counts
        size = np.maximum(np.hypot(*d.T), np.sqrt(2.0 * np.abs(self.level[self.owner])))
        np.add.at(scale, self.owner, np.abs(self.weight) * size * np.hypot(*self.size.T))
        return residual - self.level, sp.csr_array((pairing @ self.forms)[:, : self.free]), scale


def start_basis(layout: Layout) -> np.ndarray:
    """Angles of the drives at t = 0 [rad]."""
    return np.array(
        [course_start(drive.motion, layout.mechanism.body(drive.body).angle) for drive in layout.mechanism.drives], float
    )


def independent(layout: Layout) -> Layout:
    """A layout without the conditions that follow from the others wherever the mechanism goes.

    At a position near the start, after a small random move of the drives too, the rank of the gradients tells which might
    follow; they are left out if they still hold after another such move that only the others guided. Where only the start is
    special, such as folded flat, all conditions stay.

    Parameters
    ----------
    layout : Layout

    Returns
    -------
    Layout

    Raises
    ------
    InputError
        If a massless link follows from the other parts: its force is not determined.
    """
    holding = [condition for condition in layout.conditions if not condition.latch]
    if len(holding) < 2:
        return layout
    angles = start_basis(layout)
    gradients = Gradients(layout, holding)
    position, _ = placed(layout)
    b = _basis(angles)
    known = layout.coordinates[:, layout.free :] @ b
    x = sp.csr_array(layout.coordinates[:, : layout.free].T @ layout.mass) @ (position - known)
    if _beyond_doubt(gradients, np.append(x, b)):
        return layout
    everything = np.arange(len(holding))
    random = np.random.default_rng(0)
    x_start = _close(gradients, everything, x, b)
    moved = None if x_start is None else _move(gradients, everything, x_start, angles, random)
    if moved is None:
        return layout  # the assembly says why
    x_near, b_near = moved
    _, matrix, scale = gradients(np.append(x_near, b_near))
    scaled = matrix.toarray() / np.where(scale > 0.0, scale, 1.0)[:, None]
    # links first: what is left out had better be a length, whose multiplier nobody asks for
    order = np.argsort([not condition.name for condition in holding], kind="stable")
    kept, left = _pivots(scaled, order)
    if not left:
        return layout
    again = _move(gradients, np.array(kept), x_near, angles, random)
    if again is None or np.max(np.abs(gradients(np.append(*again))[0][left])) > FOLLOWS:
        return layout
    for k in left:
        if holding[k].name:
            raise InputError(f"{holding[k].subject} keeps a distance that other parts keep already", "leave it out")
    names = tuple(holding[k].subject for k in left)
    stay = [holding[k] for k in sorted(kept)] + [condition for condition in layout.conditions if condition.latch]
    return dataclasses.replace(layout, conditions=order_conditions(layout, stay), redundant=names)


def _basis(angles: np.ndarray) -> np.ndarray:
    return np.concatenate([[1.0], np.stack([np.cos(angles), np.sin(angles)], axis=1).ravel()])


def _beyond_doubt(gradients: Gradients, full: np.ndarray) -> bool:
    """Whether the conditions hold and are plainly independent where the bodies are placed."""
    residual, matrix, scale = gradients(full)
    if np.max(np.abs(residual)) > CLOSED or not np.min(scale) > 0.0:
        return False
    if gradients.count <= LARGE:
        unit = matrix.toarray() / scale[:, None]
        return bool(np.linalg.eigvalsh(unit @ unit.T)[0] > BEYOND_DOUBT**2)
    spread = sp.diags_array(1.0 / scale) @ matrix
    try:
        pivots = splu(sp.csc_array(spread @ spread.T), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0).U.diagonal()
    except RuntimeError:  # exactly singular
        return False
    # a small pivot is a bound from above only, so that more of a margin is asked for
    return bool(np.min(pivots) > 10.0 * BEYOND_DOUBT**2)


def _close(gradients: Gradients, chosen: np.ndarray, x: np.ndarray, b: np.ndarray) -> np.ndarray | None:
    """Free coordinates near x at which some of the conditions hold, or nothing."""
    for _ in range(50):
        residual, matrix, _ = gradients(np.append(x, b))
        if np.max(np.abs(residual[chosen])) < CLOSED:
            return x
        x = x - np.linalg.lstsq(matrix.toarray()[chosen], residual[chosen], rcond=1e-10)[0]
    return None


def _move(
    gradients: Gradients, chosen: np.ndarray, x: np.ndarray, angles: np.ndarray, random: np.random.Generator
) -> tuple[np.ndarray, np.ndarray] | None:
    """A position some way off at which some of the conditions hold, drives and timed links moved a little too, with its b."""
    b = _basis(angles + MOVE * random.uniform(-1.0, 1.0, angles.size))
    gradients.level[gradients.timed] *= 1.0 + MOVE * random.uniform(-1.0, 1.0, int(np.sum(gradients.timed)))
    matrix = gradients(np.append(x, b))[1]
    rows = matrix.toarray()[chosen]
    step = random.standard_normal(x.size)
    step -= np.linalg.lstsq(rows, rows @ step, rcond=1e-10)[0]
    longest = np.max(np.hypot(*(gradients.forms[:, : x.size] @ step).reshape(-1, 2).T), initial=0.0)
    step *= MOVE / longest if longest > 1e-9 * math.sqrt(x.size) else 0.0
    near = _close(gradients, chosen, x + step, b)
    return None if near is None else (near, b)


def _pivots(rows: np.ndarray, order: np.ndarray) -> tuple[list[int], list[int]]:
    """Which rows are independent and which are combinations of them, the first in `order` kept where there is a choice."""
    kept: list[int] = []
    left: list[int] = []
    basis = np.zeros((0, rows.shape[1]))
    for k in order.tolist():
        rest = rows[k] - basis.T @ (basis @ rows[k])
        rest -= basis.T @ (basis @ rest)
        size = float(np.linalg.norm(rest))
        if size > DEPENDENT:
            kept.append(k)
            basis = np.vstack([basis, rest / size])
        else:
            left.append(k)
    return kept, left
