"""Causes of failed runs and missing results: singular positions, latches that cannot lock, joints that cannot move."""

from __future__ import annotations

import math

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from scissordyn.errors import InputError
from scissordyn.jit import Handle
from scissordyn.mechanics.elimination import in_words
from scissordyn.mechanics.form import Condition, Layout
from scissordyn.mechanics.motion import prescribe
from scissordyn.mechanics.redundancy import Gradients
from scissordyn.mechanics.system import System
from scissordyn.model.element import Spring

__all__ = ["check_springs", "failed_latch", "immovable_joints", "singular_position"]

NEAR = 1e-3
"""A position is near a singular one if a combination of the constraint gradients, each of length one, is shorter than this."""

FRACTION = 0.1
"""Constraints with more than this fraction of the largest in that combination are named."""

IMMOBILE = 1e-11
"""A journal cannot move if the constraints leave less than this fraction of the square of its gradient: a few round-offs."""

PLAIN = 1e-8
"""Pivots of the gradients' Gram matrix above this are far from singular."""

NO_LENGTH = 1e-12
"""A spring shorter than this [m] has no direction."""


def singular_position(layout: Layout, system: Handle, state: np.ndarray, time: float) -> str:
    """The aligned bodies of a singular position, in words; empty if the position is not near a singular one.

    Parameters
    ----------
    layout : Layout
    system : Handle
        Of the `System`.
    state : ndarray, shape (ny,)
    time : float
        [s]

    Returns
    -------
    str
    """
    content: System = system.content
    holding = [condition for condition, idle in zip(layout.conditions, content.idle, strict=True) if idle == 0.0]
    if not holding or not np.all(np.isfinite(state)):
        return ""
    matrix, scale = _gradients(layout, content, state, time, holding)
    unit = matrix.toarray() / np.where(scale > 0.0, scale, 1.0)[:, None]
    left, values, _ = np.linalg.svd(unit, full_matrices=len(holding) > layout.free)
    smallest = float(values[-1]) if values.size == len(holding) else 0.0
    if smallest > NEAR:
        return ""
    fraction = np.abs(left[:, -1])
    named = [holding[k].subject for k in np.argsort(-fraction, kind="stable") if fraction[k] > FRACTION * np.max(fraction)]
    verb = "are aligned, or as far as they reach" if len(named) > 1 or "bodies" in named[0] else "is as far as it reaches"
    return f"singular position: {in_words(named)} {verb}"


def _gradients(
    layout: Layout, system: System, state: np.ndarray, time: float, conditions: list[Condition]
) -> tuple[sp.csr_array, np.ndarray]:
    """Gradients of constraints at a state, and the largest possible length of each."""
    prescribe(time, system.motion, system.motion_start, system.basis, system.angle)
    _, matrix, scale = Gradients(layout, conditions)(np.append(state[: layout.free], system.basis[0]))
    return matrix, scale


def failed_latch(layout: Layout, system: Handle) -> str:
    """The latch that could not lock, in words; empty if there is none."""
    first = len(layout.mechanism.contacts)
    for k, latch in enumerate(layout.mechanism.latches):
        if math.isnan(system.content.approach[first + k]):
            return f"latch '{latch.name}' cannot lock: joints, rods, drives or other latches hold body '{latch.body}' there"
    return ""


def check_springs(layout: Layout, system: System, state: np.ndarray) -> None:
    """Raise `InputError` for a spring with a force but without a direction at the start."""
    prescribe(0.0, system.motion, system.motion_start, system.basis, system.angle)
    full = np.append(state[: layout.free], system.basis[0])
    for spring in layout.mechanism.elements:
        if not isinstance(spring, Spring) or not spring.stiffness * spring.free_length > 0.0:
            continue
        end, start = layout.place(spring.end), layout.place(spring.start)
        if math.hypot(*(end.rows @ full[end.columns] - start.rows @ full[start.columns])) < NO_LENGTH:
            raise InputError(
                f"spring '{spring.name}' starts with length zero, so that the direction of its force is not defined",
                "ends that are apart at the start, or a free length of 0",
            )


def immovable_joints(layout: Layout, system: System, state: np.ndarray) -> list[str]:
    """Clearance joints that cannot move because the rest of the mechanism is rigid there.

    A journal moves against its bearing by E x', with D x' = 0 for the gradients D of the constraints: it cannot move if E
    vanishes on the null space of D.

    Parameters
    ----------
    layout : Layout
    system : System
    state : ndarray, shape (ny,)
        At the start.

    Returns
    -------
    list of str
        Names.
    """
    joints, n = layout.mechanism.clearance_joints, layout.free
    if not joints:
        return []
    last = int(system.link_start[len(joints)])
    columns, owner = system.link_column[:last], np.repeat(np.arange(len(joints)), np.diff(system.link_start[: len(joints) + 1]))
    free = columns < n
    rows = np.concatenate([2 * owner[free], 2 * owner[free] + 1])
    values = np.concatenate([system.link_row[0, :last][free], system.link_row[1, :last][free]])
    moves = sp.csr_array((values, (rows, np.tile(columns[free], 2))), shape=(2 * len(joints), n))
    size = np.asarray(moves.multiply(moves).sum(axis=1)).reshape(-1, 2).sum(axis=1)
    holding = [condition for condition in layout.conditions if not condition.latch]
    left = size
    if holding:
        matrix, scale = _gradients(layout, system, state, 0.0, holding)
        unit = sp.diags_array(1.0 / np.where(scale > 0.0, scale, 1.0)) @ matrix
        left = size - _fixed_fraction(sp.csr_array(unit), moves).reshape(-1, 2).sum(axis=1)
    return [joint.name for joint, rest, whole in zip(joints, left, size, strict=True) if not rest > IMMOBILE * whole]


def _fixed_fraction(matrix: sp.csr_array, moves: sp.csr_array) -> np.ndarray:
    """Squared lengths of the parts of some rows that lie in the row space of a matrix."""
    shared = (matrix @ moves.T).toarray()
    try:
        factors = splu(sp.csc_array(matrix @ matrix.T), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0)
        plain = bool(np.min(factors.U.diagonal()) > PLAIN)
    except RuntimeError:  # exactly singular
        plain = False
    if plain:
        return np.asarray(np.sum(shared * factors.solve(shared), axis=0))
    _, values, right = np.linalg.svd(matrix.toarray(), full_matrices=False)
    across = right[values > NEAR * values[0]] @ moves.T.toarray()
    return np.asarray(np.sum(across * across, axis=0))
