"""Why a run broke off or cannot say what it should: singular positions, latches that cannot lock, joints that cannot move."""

from __future__ import annotations

import math

import numpy as np

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
"""A position is near a singular one if a combination of the conditions' gradients, each of length one, is shorter than this."""

SHARE = 0.1
"""Conditions with more than this share of the largest in that combination are named."""

STILL = 1e-9
"""A journal cannot move if the conditions leave less than this of its gradient."""

NO_LENGTH = 1e-12
"""A spring shorter than this [m] has no direction."""

MOST = 2000
"""Beyond so many coordinates nobody looks whether a loose joint can move: it would take longer than the run."""


def singular_position(layout: Layout, system: Handle, state: np.ndarray, time: float) -> str:
    """The bodies that a singular position is made of, in words; empty if the position is not near a singular one.

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
    unit = matrix / np.where(scale > 0.0, scale, 1.0)[:, None]
    left, values, _ = np.linalg.svd(unit, full_matrices=len(holding) > layout.free)
    smallest = float(values[-1]) if values.size == len(holding) else 0.0
    if smallest > NEAR:
        return ""
    share = np.abs(left[:, -1])
    named = [holding[k].subject for k in np.argsort(-share, kind="stable") if share[k] > SHARE * np.max(share)]
    verb = "are aligned, or as far as they reach" if len(named) > 1 or "bodies" in named[0] else "is as far as it reaches"
    return f"singular position: {in_words(named)} {verb}"


def _gradients(
    layout: Layout, system: System, state: np.ndarray, time: float, conditions: list[Condition]
) -> tuple[np.ndarray, np.ndarray]:
    prescribe(time, system.motion, system.motion_start, system.basis, system.angle)
    _, matrix, scale = Gradients(layout, conditions)(np.append(state[: layout.free], system.basis[0]))
    return matrix.toarray(), scale


def failed_latch(layout: Layout, system: Handle) -> str:
    """The latch that could not lock, in words; empty if there is none."""
    first = len(layout.mechanism.loose)
    for k, latch in enumerate(layout.mechanism.latches):
        if math.isnan(system.content.approach[first + k]):
            return f"latch '{latch.name}' cannot lock: joints, links or drives keep body '{latch.body}' turning there"
    return ""


def check_springs(layout: Layout, system: System, state: np.ndarray) -> None:
    """Raise `InputError` for a spring that pushes but has no direction at the start."""
    prescribe(0.0, system.motion, system.motion_start, system.basis, system.angle)
    full = np.append(state[: layout.free], system.basis[0])
    for spring in layout.mechanism.elements:
        if not isinstance(spring, Spring) or not spring.stiffness * spring.free_length > 0.0:
            continue
        end, start = layout.place(spring.end), layout.place(spring.start)
        if math.hypot(*(end.rows @ full[end.columns] - start.rows @ full[start.columns])) < NO_LENGTH:
            raise InputError(
                f"spring '{spring.name}' starts with no length, so that the direction in which it pushes is not defined",
                "ends that are apart at the start, or a free length of 0",
            )


def immovable_joints(layout: Layout, system: System, state: np.ndarray) -> list[str]:
    """Loose joints that cannot move at all because everything else is rigid there.

    A journal moves against its bearing by E x', with D x' = 0 for the gradients D of the conditions: it cannot move if E
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
    loose, n = layout.mechanism.loose, layout.free
    holding = [condition for condition in layout.conditions if not condition.latch]
    if not loose or n > MOST:
        return []
    matrix = _gradients(layout, system, state, 0.0, holding)[0] if holding else np.zeros((0, n))
    found = []
    for j, joint in enumerate(loose):
        part = slice(system.link_start[j], system.link_start[j + 1])
        columns, rows = system.link_column[part], system.link_row[:2, part]
        moving = np.zeros((n, 2))
        moving[columns[columns < n]] = rows[:, columns < n].T
        size = float(np.linalg.norm(moving))
        if holding and size > 0.0:
            moving = moving - matrix.T @ np.linalg.lstsq(matrix.T, moving, rcond=1e-10)[0]
        if not float(np.linalg.norm(moving)) > STILL * size:
            found.append(joint.name)
    return found
