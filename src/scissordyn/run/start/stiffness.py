"""The stiffness of a mechanism at a position, and the motions that its constraints allow."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scissordyn.kernel import Handle
from scissordyn.kinematics.assembly import Start, natural_state
from scissordyn.mechanics import functions
from scissordyn.mechanics.constraint_part import part_curvature
from scissordyn.mechanics.system import System
from scissordyn.plan.plan import Plan

INDEPENDENT = 1e-9  # Singular values of the constraints' gradients below this part of the largest count as zero


class At(NamedTuple):
    """A mechanism at rest at a position, evaluated there."""

    plan: Plan
    system: Handle
    state: np.ndarray

    @property
    def natural(self) -> np.ndarray:
        n = self.plan.coordinates.free
        return natural_state(self.plan, self.system.content, Start(self.state[:n], 0.0 * self.state[:n]))[0]


def stiffness(at: At) -> tuple[np.ndarray, np.ndarray]:
    """Stiffness in the free coordinates, shape (n, n), and an orthonormal basis of the motions that the constraints allow."""
    matrix = force_slopes(at)
    gradients, curved = constraint_slopes(at, at.system.content.work.multiplier)
    matrix += curved
    return 0.5 * (matrix + matrix.T), free_directions(gradients)


def free_directions(gradients: np.ndarray) -> np.ndarray:
    """Orthonormal basis, in columns, of what constraints with these gradients, in rows, leave."""
    _, sizes, basis = np.linalg.svd(gradients)
    rank = int(np.sum(sizes > INDEPENDENT * max(sizes.max(initial=0.0), 1.0)))
    return basis[rank:].T


def force_slopes(at: At, time: float = 0.0) -> np.ndarray:
    """Minus the derivatives of the forces by the free coordinates; evaluates everything at the position."""
    content = at.system.content
    model, work, n = content.model, content.work, content.model.n
    contacts = content.parameters.contact.size
    y = at.state.copy()
    y[n : 2 * n] = 0.0
    rate, by_time = np.zeros(y.size), np.zeros(y.size)
    functions.activate(at.system.address)
    functions.linearise(time, y, at.system.address, rate, by_time)
    matrix = np.zeros((n, n))
    for e in range(model.element_start.size - 1):
        if e < contacts and content.state.mode[e] != 1:
            continue
        first, last = model.element_start[e], model.element_start[e + 1]
        columns = model.element_column[first:last]
        block = work.block_x[model.block_start[e] : model.block_start[e + 1]].reshape(last - first, last - first)
        free = columns < n
        matrix[np.ix_(columns[free], columns[free])] -= block[np.ix_(free, free)]
    return matrix


def component_maps(content: System, i: int) -> tuple[np.ndarray, np.ndarray]:
    """The maps of component i, shape (6,), and their derivatives by the free coordinates, shape (6, n)."""
    model, X = content.model, content.work.X
    e = content.parameters.contact.size + i
    first, last = model.element_start[e], model.element_start[e + 1]
    rows = np.zeros((6, X.size))
    rows[:, model.element_column[first:last]] = model.element_row[:, first:last]
    return rows @ X, rows[:, : model.n]


def constraint_slopes(at: At, multiplier: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Gradients of the constraints at a position that has been evaluated, and the stiffness of some multipliers of theirs."""
    model, work, n = at.system.content.model, at.system.content.work, at.system.content.model.n
    gradients, curved = np.zeros((multiplier.size, n)), np.zeros((n, n))
    for p in range(model.part_constraint.size):
        first, last = model.part_start[p], model.part_start[p + 1]
        k, columns = model.part_constraint[p], model.constraint_column[first:last]
        free = columns < n
        rows = model.constraint_row[:, first:last][:, free]
        bent = np.stack(part_curvature(model.part_reference[p], *work.direction[p], *rows))
        curved[np.ix_(columns[free], columns[free])] += multiplier[k] * work.part_weight[p] * rows.T @ bent
        gradients[k, columns[free]] += work.gradient[first:last][free]
    return gradients, curved
