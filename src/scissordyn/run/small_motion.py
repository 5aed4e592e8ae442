"""Small motions about a position: where it is, the stiffness there, and the motions that the constraints allow."""

from __future__ import annotations

import dataclasses
from typing import Any, Literal, NamedTuple

import numpy as np

from scissordyn.component.torque import Torque
from scissordyn.kernel import Handle
from scissordyn.kinematics.assembly import Start, natural_state
from scissordyn.mechanics import functions
from scissordyn.plan.plan import Plan, plan
from scissordyn.run.driver import make_system
from scissordyn.run.rest import count_turns, equilibrium, touch_closed, turns
from scissordyn.run.start import assembled_near, prepare_start, rest_with_clearances

__all__ = ["At", "Place", "Position", "constraint_slopes", "force_slopes", "placed", "released", "stiffness"]

INDEPENDENT = 1e-9
"""Singular values of the constraints' gradients below this part of the largest count as zero."""

Position = Literal["static", "concentric"]


class Place(NamedTuple):
    """A position of the ideal mechanism: natural coordinates, and by how much each body has turned."""

    natural: np.ndarray
    turned: dict[str, float]


class At(NamedTuple):
    """A mechanism at rest at a position, evaluated there."""

    plan: Plan
    system: Handle
    state: np.ndarray

    @property
    def natural(self) -> np.ndarray:
        """Natural coordinates."""
        n = self.plan.coordinates.free
        return natural_state(self.plan, self.system.content, Start(self.state[:n], 0.0 * self.state[:n]))[0]


def placed(still: Plan, position: Position, before: Place | None) -> tuple[At, Place]:
    """A mechanism whose drives stand still, from the place before if there is one; with clearances, resting in contact.

    Parameters
    ----------
    still : Plan
        See `Plan.at_rest`.
    position : {"static", "concentric"}
    before : Place, optional

    Returns
    -------
    at : At
    place : Place
        Of the ideal mechanism.
    """
    ideal = still.ideal
    system, n = make_system(ideal), ideal.coordinates.free
    if before is None:
        y = prepare_start(ideal, system, position).y
    else:
        count_turns(ideal, system.content, before.turned)
        found = assembled_near(ideal, system.content, before.natural, straight=position == "concentric").position
        if position == "static":
            found = equilibrium(ideal, system, found)[0]
        y = np.zeros(2 * n + int(system.content.model.state_start[-1]))
        y[:n] = found
    functions.accept(0.0, y, system.address, np.zeros(2))
    at = At(ideal, system, y)
    place = Place(at.natural, turns(ideal, system.content))
    if still.contacts:
        handle, rest = rest_with_clearances(still, system, y[:n])
        state = np.concatenate([rest, np.zeros(rest.size + int(handle.content.model.state_start[-1]))])
        functions.accept(0.0, state, handle.address, np.zeros(2))
        at = At(still, handle, state)
    return at, place


def released(at: At) -> At:
    """The same position with the drives replaced by the constant torques that hold it.

    Parameters
    ----------
    at : At

    Returns
    -------
    At
    """
    mechanism = at.plan.mechanism
    holding: tuple[Any, ...] = tuple(
        Torque(f"torque that holds '{drive.body}'", drive.body, torque=1.0) for drive in mechanism.drives
    )
    first = len(mechanism.components)
    free = plan(dataclasses.replace(mechanism, drives=(), components=(*mechanism.components, *holding)))
    system = make_system(free)
    count_turns(free, system.content, turns(at.plan, at.system.content))
    start = assembled_near(free, system.content, at.natural, straight=False)
    state = np.concatenate([start.position, start.velocity, np.zeros(int(system.content.model.state_start[-1]))])
    functions.accept(0.0, state, system.address, np.zeros(2))
    touch_closed(system, state)
    torque, n = system.content.parameters.component[first : first + len(holding), 0], free.coordinates.free

    def acceleration() -> np.ndarray:
        rate = np.zeros(state.size)
        functions.activate(system.address)
        functions.rate(0.0, state, system.address, rate)
        return rate[n : 2 * n]

    torque[:] = 0.0
    without, by_torque = acceleration(), []
    for k in range(len(holding)):
        torque[k] = 1.0
        by_torque.append(acceleration() - without)
        torque[k] = 0.0
    torque[:] = np.linalg.lstsq(np.array(by_torque).T, -without)[0]
    return At(free, system, state)


def stiffness(at: At) -> tuple[np.ndarray, np.ndarray]:
    """Stiffness in the free coordinates, and an orthonormal basis of the motions that the constraints allow.

    Parameters
    ----------
    at : At

    Returns
    -------
    stiffness : ndarray, shape (n, n)
    allowed : ndarray, shape (n, n - rank of the constraints)
    """
    found = force_slopes(at)
    gradients, curved = constraint_slopes(at, at.system.content.work.multiplier)
    found += curved
    _, sizes, basis = np.linalg.svd(gradients)
    rank = int(np.sum(sizes > INDEPENDENT * max(sizes.max(initial=0.0), 1.0)))
    return 0.5 * (found + found.T), basis[rank:].T


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
    found = np.zeros((n, n))
    for e in range(model.element_start.size - 1):
        if e < contacts and content.state.mode[e] != 1:
            continue
        first, last = model.element_start[e], model.element_start[e + 1]
        columns = model.element_column[first:last]
        block = work.block_x[model.block_start[e] : model.block_start[e + 1]].reshape(last - first, last - first)
        free = columns < n
        found[np.ix_(columns[free], columns[free])] -= block[np.ix_(free, free)]
    return found


def constraint_slopes(at: At, multiplier: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Gradients of the constraints at a position that has been evaluated, and the stiffness of some multipliers of theirs."""
    model, work, n = at.system.content.model, at.system.content.work, at.system.content.model.n
    gradients, curved = np.zeros((multiplier.size, n)), np.zeros((n, n))
    for p in range(model.part_constraint.size):
        first, last = model.part_start[p], model.part_start[p + 1]
        k, columns = model.part_constraint[p], model.constraint_column[first:last]
        free = columns < n
        rows = model.constraint_row[:, first:last][:, free]
        curved[np.ix_(columns[free], columns[free])] += multiplier[k] * work.part_weight[p] * rows.T @ rows
        gradients[k, columns[free]] += work.gradient[first:last][free]
    return gradients, curved
