"""The closure equations of a mechanism with ideal joints, on every branch of its assembly.

The equations of motion use that opposite bars of a parallelogram stay parallel, which is true on one branch only. Whether
another branch meets it must be asked of the equations without that assumption. They are few and small.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from scissordyn.mechanics.point_map import Constraint
from scissordyn.model.mechanism import Mechanism
from scissordyn.plan.coordinates import Coordinates, Natural, natural_coordinates
from scissordyn.plan.linear_constraints import eliminated, origins
from scissordyn.plan.quadratic_constraints import quadratic_constraints

__all__ = ["Branches", "every_branch"]


@dataclass(frozen=True)
class Branches:
    """Natural coordinates z, origins in units of the size, as N y + P b, and the quadratic constraints on z.

    Parameters
    ----------
    natural : Natural
    stays : ndarray of int, shape (n,)
        Which of z are y.
    free : ndarray, shape (nZ, n)
        N.
    known : ndarray, shape (nZ, 1 + 2 drives)
        P.
    rows : ndarray, shape (parts, 2, nZ)
        Maps of the quadratic constraints: those of one follow each other.
    constant : ndarray, shape (parts, 2)
    weight : ndarray, shape (parts,)
    constraints : tuple of Constraint
        Unit lengths, moving guides and rods.
    """

    natural: Natural
    stays: np.ndarray
    free: np.ndarray
    known: np.ndarray
    rows: np.ndarray
    constant: np.ndarray
    weight: np.ndarray
    constraints: tuple[Constraint, ...]


def every_branch(mechanism: Mechanism) -> Branches:
    """The closure equations of a mechanism with ideal joints.

    Parameters
    ----------
    mechanism : Mechanism

    Returns
    -------
    Branches
    """
    natural, basis = natural_coordinates(mechanism), 1 + 2 * len(mechanism.drives)
    elimination, (start, columns, values) = eliminated(mechanism, natural, every_branch=True)
    total = natural.total
    expressed = sp.csr_array((values, columns, start), shape=(total, total + basis)).toarray()
    stays = np.flatnonzero(elimination.solved_at[:total] < 0)
    # every natural coordinate is free here, and the last column stands for 1
    unit = np.zeros((total, total + 1))
    unit[:, :total] = np.diag(np.where(origins(natural), mechanism.size, 1.0))
    every = Coordinates(natural, total, 1, unit, None, mechanism.size)
    constraints = tuple(each for each in quadratic_constraints(mechanism, every) if not each.latch)
    parts = [part for constraint in constraints for part in constraint.parts]
    rows = np.zeros((len(parts), 2, total + 1))
    for row, (_, each) in zip(rows, parts, strict=True):
        row[:, each.columns] = each.rows
    return Branches(
        natural,
        stays,
        expressed[:, stays],
        expressed[:, total:],
        np.ascontiguousarray(rows[:, :, :total]),
        rows[:, :, total].copy(),
        np.array([weight for weight, _ in parts], float),
        constraints,
    )
