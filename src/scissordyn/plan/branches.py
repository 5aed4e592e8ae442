"""Closure equations of a mechanism with ideal joints, valid on all branches of its assembly.

The equations of motion assume that opposite bars of a parallelogram are parallel, which holds on one branch only. To detect a
meeting with another branch, the equations here do without this assumption. They are few and small.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from scissordyn.model.mechanism import Mechanism
from scissordyn.plan.coordinates import Constraint, Coordinates, Natural, natural_coordinates
from scissordyn.plan.coupling import coupling_parts
from scissordyn.plan.linear_constraints import eliminated, full, origins
from scissordyn.plan.quadratic_constraints import quadratic_constraints
from scissordyn.tolerance import ROUND_OFF_TOL


@dataclass(frozen=True, eq=False)
class Branches:
    """Natural coordinates z = N y + P b, with origins in units of the mechanism's size, and the quadratic constraints on z."""

    natural: Natural
    stays: np.ndarray  # (n,) Indices in z of the coordinates y
    free: np.ndarray  # (nZ, n) N
    prescribed: np.ndarray  # (nZ, 1 + 2 drives) P
    rows: np.ndarray  # (parts, 2, nZ) Maps of the quadratic constraints; parts of one constraint are consecutive
    constant: np.ndarray  # (parts, 2)
    weight: np.ndarray  # (parts,)
    moving: np.ndarray  # (parts, 2, n) Derivatives of the maps by y
    begin: np.ndarray  # (m,) First part of each constraint
    scale: np.ndarray  # (m,) Largest possible length of each constraint's gradient; 1 without a gradient
    varies: np.ndarray  # Indices of constraints with a gradient
    constraints: tuple[Constraint, ...]  # Unit lengths, moving guides, rods and couplings


def every_branch(mechanism: Mechanism, coordinates: Coordinates) -> Branches:
    """Return the closure equations for all branches; `coordinates` contain the values that couplings hold constant."""
    natural, basis = natural_coordinates(mechanism), 1 + 2 * len(mechanism.drives)
    elimination, (start, columns, values) = eliminated(mechanism, natural, [])
    total = natural.total
    expressed = full(np.repeat(np.arange(total), np.diff(start)), columns, values, (total, total + basis))
    stays = np.flatnonzero(elimination.solved_at[:total] < 0)
    # every natural coordinate is free here; the last column is the constant 1
    unit = np.zeros((total, total + 1))
    unit[:, :total] = np.diag(np.where(origins(natural), mechanism.size, 1.0))
    all_free = Coordinates(natural, total, 1, unit, None, mechanism.size)
    constraints = tuple(entry for entry in quadratic_constraints(mechanism, all_free) if not entry.latch)
    linear_constraints = {constraint.name: constraint for constraint in coordinates.constraints if constraint.linear}
    for coupling in mechanism.coupling_parts:
        if coupling.name in linear_constraints:
            terms = linear_constraints[coupling.name].acting if linear_constraints[coupling.name].moving else coupling.terms
            constraints += (
                replace(linear_constraints[coupling.name], parts=coupling_parts(all_free, terms, coupling.name).parts),
            )
    parts = [part for constraint in constraints for part in constraint.parts]
    rows = np.zeros((len(parts), 2, total + 1))
    for row, (_, entry) in zip(rows, parts, strict=True):
        row[:, entry.columns] = entry.rows
    free, maps, weight = expressed[:, stays], np.ascontiguousarray(rows[:, :, :total]), np.array([w for w, _ in parts], float)
    moving = maps @ free
    begin = np.cumsum([0, *(len(constraint.parts) for constraint in constraints)])[:-1]
    size = np.abs(weight) * np.sqrt(np.sum(moving * moving, axis=(1, 2)))
    scale = np.add.reduceat(size, begin) if begin.size else size
    return Branches(
        natural=natural,
        stays=stays,
        free=free,
        prescribed=expressed[:, total:],
        rows=maps,
        constant=rows[:, :, total].copy(),
        weight=weight,
        moving=moving,
        begin=begin,
        scale=np.where(scale > ROUND_OFF_TOL, scale, 1.0),
        varies=np.flatnonzero(scale > ROUND_OFF_TOL),
        constraints=constraints,
    )
