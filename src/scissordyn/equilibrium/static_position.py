"""Position at rest of a mechanism: stiffness, and the motions that the constraints allow."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from scissordyn.components.place import GROUND
from scissordyn.integrate.integration import Samples
from scissordyn.kernel import Handle
from scissordyn.kinematics.assembly import Start, natural_state
from scissordyn.mechanics import functions
from scissordyn.mechanics.constraint_part import part_curvature
from scissordyn.mechanics.outputs import record
from scissordyn.mechanics.sample import Record
from scissordyn.mechanics.system import System
from scissordyn.plan.plan import Plan
from scissordyn.tolerance import DATA_TOL, ROUND_OFF_TOL


class StaticPosition(NamedTuple):
    """Mechanism at rest in a position, with its plan and its system of equations."""

    plan: Plan
    system: Handle
    state: np.ndarray

    @property
    def natural(self) -> np.ndarray:
        """Natural coordinates of the position."""
        n = self.plan.coordinates.free
        return natural_state(self.plan, self.system.content, Start(self.state[:n], 0.0 * self.state[:n]))[0]

    @property
    def turned(self) -> dict[str, float]:
        """Angle by which each body has turned since its placement, by name [rad]."""
        return turns(self.plan, self.system.content)

    def record(self) -> Record:
        """Return the outputs of the mechanism at the position."""
        state = self.system.content.state
        rows = (part[None].copy() for part in (state.mode, state.memory, state.mass, state.reference))
        return record(self.plan.maps, self.system, Samples(np.zeros(1), self.state[None], np.zeros((1, 0)), *rows))


def stiffness(at: StaticPosition) -> tuple[np.ndarray, np.ndarray]:
    """Return the stiffness in the free coordinates, shape (n, n), and a basis of the motions that constraints allow, (n, m).

    The matrix is not symmetric if a load has no potential, for example a force that turns with its body.
    """
    matrix, curved, allowed = stiffness_parts(at)
    return matrix + curved, allowed


def stiffness_parts(at: StaticPosition) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the stiffness of forces and that of constraint forces, shape (n, n) each, and the basis of `stiffness`."""
    matrix = force_slopes(at)
    gradients, curved = constraint_slopes(at, at.system.content.work.multiplier)
    return matrix, curved, free_directions(gradients)


def has_potential(matrix: np.ndarray) -> bool:
    """Return True if a stiffness matrix is symmetric up to round-off, so that its forces have a potential."""
    return bool(np.max(np.abs(matrix - matrix.T), initial=0.0) <= ROUND_OFF_TOL * np.max(np.abs(matrix), initial=0.0))


def small_motions(at: StaticPosition) -> tuple[np.ndarray, np.ndarray]:
    """Return squared angular frequencies [1/s^2], shape (m,), ascending, and motions of free coordinates, shape (n, m)."""
    return motions_of(*stiffness(at))


def motions_of(matrix: np.ndarray, allowed: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the results of `small_motions` from those of `stiffness`.

    A negative square is minus the square of a growth rate. A pair of oscillations that grow and decay (flutter) has the
    growth rate of the former twice, and as motions those of two instants a quarter of a period apart.
    """
    reduced = allowed.T @ matrix @ allowed
    if has_potential(reduced):
        squares, vectors = np.linalg.eigh(0.5 * (reduced + reduced.T))
        return squares, allowed @ vectors
    values, vectors = np.linalg.eig(reduced)
    # two equal frequencies differ by the square root of round-off, also by an imaginary part
    flutter = np.abs(values.imag) > DATA_TOL * np.abs(values)
    growth = np.sqrt(values.astype(complex)).imag
    squares = np.where(flutter, -(growth**2), values.real)
    motions = np.where(values.imag >= 0.0, vectors.real, vectors.imag)
    order = np.argsort(squares, kind="stable")
    return squares[order], allowed @ motions[:, order]


def free_directions(gradients: np.ndarray) -> np.ndarray:
    """Return an orthonormal basis, in columns, of the null space of constraint gradients given in rows."""
    _, sizes, basis = np.linalg.svd(gradients)
    rank = int(np.sum(sizes > 1e-9 * max(sizes.max(initial=0.0), 1.0)))  # smaller singular values are zero
    return basis[rank:].T


def force_slopes(at: StaticPosition, time: float = 0.0) -> np.ndarray:
    """Return the stiffness of the forces, -df/dx by the free coordinates, shape (n, n), without that of the constraints."""
    content = at.system.content
    n, contacts = content.model.n, content.parameters.contact.size
    y = at.state.copy()
    y[n : 2 * n] = 0.0
    rate, by_time = np.zeros(y.size), np.zeros(y.size)
    functions.activate(at.system.address)
    functions.linearise(time, y, at.system.address, rate, by_time)
    matrix = np.zeros((n, n))
    for e in range(content.model.element_start.size - 1):
        if e < contacts and content.state.mode[e] != 1:
            continue
        columns, block = element_block(content, e)
        free = columns < n
        matrix[np.ix_(columns[free], columns[free])] -= block[np.ix_(free, free)]
    return matrix


def element_block(content: System, e: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the coordinate indices of force element e, and the derivatives of its forces by these coordinates.

    Elements are the contacts, followed by the components.
    """
    model, start = content.model, content.model.block_start[e]
    columns = model.element_column[model.element_start[e] : model.element_start[e + 1]]
    return columns, content.work.block_x[start : start + columns.size**2].reshape(columns.size, columns.size)


def component_maps(content: System, i: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the vector (u, a, b) of component i, shape (6,), and its derivatives by the free coordinates, shape (6, n).

    The vector u connects the ends; a and b are the directions of both bodies.
    """
    model, X = content.model, content.work.X
    e = content.parameters.contact.size + i
    first, last = model.element_start[e], model.element_start[e + 1]
    rows = np.zeros((6, X.size))
    rows[:, model.element_column[first:last]] = model.element_row[:, first:last]
    return rows @ X, rows[:, : model.n]


def constraint_slopes(at: StaticPosition, multiplier: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the constraint gradients at an evaluated position, and the stiffness of constraint forces with `multiplier`."""
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


def turns(plan: Plan, system: System) -> dict[str, float]:
    """Return the angle by which each body has turned since its placement, full turns included, by name [rad]."""
    maps, placed = plan.maps, plan.angles
    change = np.append(system.state.reference - placed, 0.0)[: len(plan.coordinates.families)]
    angles = dict.fromkeys((GROUND, *(body.name for body in plan.bodies)), 0.0)
    for b, body in enumerate(plan.bodies):
        if maps.rotation[b] >= 0:
            angles[body.name] = float(maps.sense[b] * change[maps.rotation[b]])
    return angles


def count_turns(plan: Plan, system: System, turned: Mapping[str, float]) -> None:
    """Set a system's count of full turns for bodies that have turned by the angles `turned` [rad].

    Positions determine angles only up to full turns, but the torque of a spring depends on the number of turns.
    """
    state, model = system.state, system.model
    state.reference[:] = plan.angles
    for k, family in enumerate(plan.coordinates.families):
        state.reference[k] += turned[family.bodies[0]]
    for i, component in enumerate(plan.acting):
        if model.reference_of[i] >= 0:
            (body, _), (base, _) = component.declaration.port.ends(component)
            state.reference[model.reference_of[i]] += turned[body] - turned[base]
    turning = [body for constraint in plan.coordinates.constraints for body, _ in constraint.turning]
    for k, body in enumerate(turning, state.reference.size - len(turning)):
        state.reference[k] += turned.get(body, 0.0)
