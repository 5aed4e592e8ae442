"""Causes of failed runs: singular positions, latches that cannot lock, joints that cannot move."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from scissordyn.components.declaration import at_rest
from scissordyn.components.port import LINE
from scissordyn.errors import InputError
from scissordyn.kernel import Handle
from scissordyn.mechanics.joint_friction import UNDETERMINED
from scissordyn.mechanics.system import System
from scissordyn.mechanics.time_function import prescribe
from scissordyn.plan.elimination import in_words
from scissordyn.plan.gradients import Gradients
from scissordyn.plan.plan import Plan
from scissordyn.tolerance import SINGULAR_VALUE_MIN


def full_coordinates(plan: Plan, system: System, state: np.ndarray, time: float) -> np.ndarray:
    """Return the vector [x; b(t)], shape (n + nb,): free coordinates of a state, then direction vectors of the drives."""
    numbers, work = system.parameters, system.work
    basis = np.empty_like(work.basis)
    prescribe(time, time, numbers.motion, numbers.motion_start, basis, work.function_value)
    return np.append(state[: plan.coordinates.free], basis[0])


def describe_jam(plan: Plan, system: Handle) -> str:
    """Return the reason why reactions with friction could not be computed; empty if they could."""
    friction = system.content.friction
    if friction.fault[0] == 0:
        return ""
    names = in_words([f"'{plan.acting[i].name}'" for i in friction.component.tolist()])
    if friction.fault[0] == UNDETERMINED:
        return f"the reactions of joints with friction {names} are not determined: redundant joints, or a singular position"
    bent = any(axis.shapes.modes > 1 for axis in plan.coordinates.natural.axes)
    why = "; pins of a flexible bar jam if the friction circle is some hundredths of its length, later with modes = 1"
    return f"the mechanism jams: no reactions are in balance with friction {names}{why if bent else ''}"


def describe_singular_position(plan: Plan, system: Handle, state: np.ndarray, time: float) -> str:
    """Return a text with the constraints that make a position singular; empty if the position is regular."""
    content: System = system.content
    inactive = content.work.inactive.tolist()
    active = [constraint for constraint, off in zip(plan.coordinates.constraints, inactive, strict=True) if off == 0.0]
    if not active or not np.all(np.isfinite(state)):
        return ""
    unit = Gradients(plan.coordinates.free, plan.coordinates.basis, active).unit(full_coordinates(plan, content, state, time))
    rows = unit if isinstance(unit, np.ndarray) else unit.toarray()
    left, values, _ = np.linalg.svd(rows, full_matrices=len(active) > plan.coordinates.free)
    smallest = float(values[-1]) if values.size == len(active) else 0.0
    if smallest > SINGULAR_VALUE_MIN:
        return ""
    part = np.abs(left[:, -1])
    named = [active[k].subject for k in np.argsort(-part, kind="stable") if part[k] > 0.1 * np.max(part)]
    verb = "are aligned or fully extended" if len(named) > 1 or "bodies" in named[0] else "is fully extended"
    return f"singular position: {in_words(named)} {verb}"


def describe_failed_latch(plan: Plan, system: Handle) -> str:
    """Return a text with the latch that could not lock; empty if there is none."""
    content: System = system.content
    for (_, _, component), latch in zip(content.model.latch.tolist(), plan.mechanism.latches, strict=True):
        if math.isnan(content.state.memory[content.model.component_guard[component]]):
            return f"latch '{latch.name}' cannot lock: joints, rods, drives or other latches hold body '{latch.body}'"
    return ""


def check_zero_lengths(plan: Plan, full: np.ndarray) -> None:
    """Raise `InputError` for a spring or other line component that has zero length at the start, at the coordinates `full`."""
    components: tuple[Any, ...] = plan.components
    for part in components:
        if part.declaration.port is not LINE:
            continue
        span = plan.coordinates.place(part.end).at(full) - plan.coordinates.place(part.start).at(full)
        if math.hypot(*span) < 1e-12 * plan.coordinates.size and at_rest(part, (0.0,))[0] != 0.0:
            raise InputError(
                f"{part.declaration.label} '{part.name}' has zero length at the start: its force has no direction",
                "end points at different positions, or a free length of 0",
            )


def immobile_joints(plan: Plan, full: np.ndarray) -> list[str]:
    """Return the names of clearance joints whose journal cannot move in its bearing because of the other joints.

    A journal moves relative to its bearing by E x', with D x' = 0 for the gradients D of the constraints. It cannot move if E
    vanishes on the null space of D.
    """
    joints, n = plan.mechanism.clearance_joints, plan.coordinates.free
    if not joints:
        return []
    holding = [constraint for constraint in plan.coordinates.constraints if not constraint.latch]
    gradients = Gradients(n, plan.coordinates.basis, holding, [plan.eccentricity(j) for j in range(len(joints))])
    moves = gradients.held[:, :n]
    square = moves * moves if isinstance(moves, np.ndarray) else moves.multiply(moves)
    size = np.asarray(square.sum(axis=1)).reshape(-1, 2).sum(axis=1)
    left = size
    if holding:
        left = size - _held_fraction(gradients.unit(full), moves).reshape(-1, 2).sum(axis=1)
    # what remains of the squared gradients is compared with their round-off
    return [joint.name for joint, rest, whole in zip(joints, left, size, strict=True) if not rest > 1e-11 * whole]


def _held_fraction(matrix: Any, moves: Any) -> np.ndarray:
    """Return the squared lengths of the rows of `moves`, each projected onto the row space of `matrix`."""
    if not isinstance(matrix, np.ndarray):
        import scipy.sparse as sp
        from scipy.sparse.linalg import splu  # imported here: it takes a tenth of a second

        moves = moves if not isinstance(moves, np.ndarray) else sp.csr_array(moves)
        common = np.asarray((matrix @ moves.T).toarray())
        try:
            factors = splu(sp.csc_array(matrix @ matrix.T), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0)
            if np.min(factors.U.diagonal()) > 1e-8:  # far from singular
                return np.asarray(np.sum(common * factors.solve(common), axis=0))
        except RuntimeError:  # exactly singular
            pass
        matrix, moves = matrix.toarray(), moves.toarray()
    moves = moves if isinstance(moves, np.ndarray) else moves.toarray()
    _, values, right = np.linalg.svd(matrix, full_matrices=False)
    across = right[values > SINGULAR_VALUE_MIN * values[0]] @ moves.T
    return np.asarray(np.sum(across * across, axis=0))
