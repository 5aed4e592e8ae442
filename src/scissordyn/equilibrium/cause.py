"""Why a run broke off or cannot be computed: singular positions, latches that cannot lock, joints that cannot move."""

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

NEAR = 1e-3  # A position is near a singular one if a combination of the constraints' unit gradients is shorter than this
FRACTION = 0.1  # Constraints with more than this fraction of the largest in that combination are named

IMMOBILE = 1e-11
"""A journal cannot move if the constraints leave less than this fraction of the square of its gradient: some roundings."""

PLAIN = 1e-8  # Pivots of the gradients' Gram matrix above this are far from singular
NO_LENGTH = 1e-12  # A spring shorter than this fraction of the mechanism's size has no direction


def full_coordinates(plan: Plan, system: System, state: np.ndarray, time: float) -> np.ndarray:
    """[x; b(t)] of a state, shape (n + nb,)."""
    numbers, work = system.parameters, system.work
    basis = np.empty_like(work.basis)
    prescribe(time, time, numbers.motion, numbers.motion_start, basis, work.function_value)
    return np.append(state[: plan.coordinates.free], basis[0])


def jam(plan: Plan, system: Handle) -> str:
    """Why no reactions with friction were found at last, in words; empty if they were."""
    friction = system.content.friction
    if friction.fault[0] == 0:
        return ""
    names = in_words([f"'{plan.acting[i].name}'" for i in friction.component.tolist()])
    if friction.fault[0] == UNDETERMINED:
        return f"the reactions that friction {names} follows are not determined: redundant joints, or a singular position"
    bent = any(axis.shapes.modes > 1 for axis in plan.coordinates.natural.axes)
    why = "; pins of a bar that bends jam from a friction circle of some hundredths of its length on, later with modes = 1"
    return f"the mechanism jams: no reactions are in balance with friction {names}{why if bent else ''}"


def singular_position(plan: Plan, system: Handle, state: np.ndarray, time: float) -> str:
    """The bodies that a singular position is made of, in words; empty if the position is not near a singular one."""
    content: System = system.content
    inactive = content.work.inactive.tolist()
    active = [constraint for constraint, off in zip(plan.coordinates.constraints, inactive, strict=True) if off == 0.0]
    if not active or not np.all(np.isfinite(state)):
        return ""
    unit = Gradients(plan.coordinates.free, plan.coordinates.basis, active).unit(full_coordinates(plan, content, state, time))
    rows = unit if isinstance(unit, np.ndarray) else unit.toarray()
    left, values, _ = np.linalg.svd(rows, full_matrices=len(active) > plan.coordinates.free)
    smallest = float(values[-1]) if values.size == len(active) else 0.0
    if smallest > NEAR:
        return ""
    part = np.abs(left[:, -1])
    named = [active[k].subject for k in np.argsort(-part, kind="stable") if part[k] > FRACTION * np.max(part)]
    verb = "are aligned, or as far as they reach" if len(named) > 1 or "bodies" in named[0] else "is as far as it reaches"
    return f"singular position: {in_words(named)} {verb}"


def failed_latch(plan: Plan, system: Handle) -> str:
    """The latch that could not lock, in words; empty if there is none."""
    content: System = system.content
    for (_, _, component), latch in zip(content.model.latch.tolist(), plan.mechanism.latches, strict=True):
        if math.isnan(content.state.memory[content.model.component_guard[component]]):
            return f"latch '{latch.name}' cannot lock: joints, rods, drives or other latches hold body '{latch.body}' there"
    return ""


def check_springs(plan: Plan, full: np.ndarray) -> None:
    """Raise `InputError` for a component that acts along a line without direction at the start, where [x; b] is `full`."""
    components: tuple[Any, ...] = plan.components
    for part in components:
        if part.declaration.port is not LINE:
            continue
        span = plan.coordinates.place(part.end).at(full) - plan.coordinates.place(part.start).at(full)
        if math.hypot(*span) < NO_LENGTH * plan.coordinates.size and at_rest(part, (0.0,))[0] != 0.0:
            raise InputError(
                f"{part.declaration.label} '{part.name}' starts with zero length, so that the direction of its force is not "
                "defined",
                "ends that are apart at the start, or a free length of 0",
            )


def immobile_joints(plan: Plan, full: np.ndarray) -> list[str]:
    """Clearance joints that cannot move at all because everything else is rigid there.

    A journal moves against its bearing by E x', with D x' = 0 for the gradients D of the constraints: it cannot move if E
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
    return [joint.name for joint, rest, whole in zip(joints, left, size, strict=True) if not rest > IMMOBILE * whole]


def _held_fraction(matrix: Any, moves: Any) -> np.ndarray:
    """Squared lengths of the parts of some rows that lie in the row space of a matrix."""
    if not isinstance(matrix, np.ndarray):
        import scipy.sparse as sp
        from scipy.sparse.linalg import splu  # takes a tenth of a second to import

        moves = moves if not isinstance(moves, np.ndarray) else sp.csr_array(moves)
        common = np.asarray((matrix @ moves.T).toarray())
        try:
            factors = splu(sp.csc_array(matrix @ matrix.T), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0)
            if np.min(factors.U.diagonal()) > PLAIN:
                return np.asarray(np.sum(common * factors.solve(common), axis=0))
        except RuntimeError:  # exactly singular
            pass
        matrix, moves = matrix.toarray(), moves.toarray()
    moves = moves if isinstance(moves, np.ndarray) else moves.toarray()
    _, values, right = np.linalg.svd(matrix, full_matrices=False)
    across = right[values > NEAR * values[0]] @ moves.T
    return np.asarray(np.sum(across * across, axis=0))
