"""Reactions of the ideal mechanism at the start, and the distributed mass of bars that bend in the balances of bodies."""

from __future__ import annotations

import numpy as np

from scissordyn.integrate.integration import Samples
from scissordyn.kinematics.assembly import assemble_as_placed, whole_state
from scissordyn.mechanics.outputs import Record, record
from scissordyn.mechanics.reactions import solve_reactions
from scissordyn.plan.bending import beam_mass, bends
from scissordyn.plan.plan import Plan
from scissordyn.plan.rail import shapes_beyond
from scissordyn.run.advance.system import make_system
from scissordyn.run.answer.bars import bar_motions, couple_forces, shape_forces


def ideal_reactions(plan: Plan, position: np.ndarray | None = None, reference: np.ndarray | None = None) -> np.ndarray:
    """Forces on the journals of all revolute joints of a mechanism, taken as ideal, at t = 0, shape (joints, 2) [N]."""
    plan = plan.ideal
    system = make_system(plan)
    if position is None:
        start = assemble_as_placed(plan, system.content)
        y = whole_state(system.content, start.position, start.velocity)
    else:
        y = whole_state(system.content, position)
    state = system.content.state
    samples = Samples(
        time=np.zeros(1),
        state=y[None, :],
        total=np.zeros((1, 0)),
        mode=state.mode[None, :].copy(),
        memory=state.memory[None, :].copy(),
        reference=(state.reference if reference is None else reference)[None, :].copy(),
    )
    outputs = record(plan.maps, system, samples)
    joints, _, _ = solve_reactions(plan.balance, plan.gravity_vector, with_distributed_mass(plan, outputs, samples.time))
    return np.asarray(joints[0])


def with_distributed_mass(plan: Plan, record: Record, time: np.ndarray) -> Record:
    """The record with what the consistent mass of the beam elements adds to the loads of their bodies.

    A body at the end of an element has half of its mass at its origin; the rest of the mass matrix times the acceleration less
    gravity is a load, and so is what the stresses of a flexible bar exert, what runs along it or turns its cross-sections. What
    acts along a unit direction is no moment.
    """
    if not bends(plan.mechanism):
        return record
    coordinates = plan.coordinates
    natural = np.asarray((coordinates.matrix @ record.A.T).T) - coordinates.natural.uniform(plan.gravity_vector)
    inertia = np.asarray((beam_mass(plan.mechanism, coordinates.natural) @ natural.T).T)
    for axis, motion in zip(coordinates.natural.axes, bar_motions(plan, record, time), strict=True):
        axis.added(-shape_forces(axis, motion), inertia)
        for places, exerted in motion.running:
            axis.added(-shapes_beyond(axis, places)[..., None] * exerted[:, None], inertia)
        for weights, exerted in couple_forces(axis, motion):
            axis.added(-weights[:, None] * exerted[:, None], inertia)
    load = record.load.copy()
    for b, body in enumerate(plan.bodies):
        p = coordinates.natural.offsets[body.name]
        load[:, b, :2] -= inertia[:, p : p + 2]
        x, y = (coordinates.origin(body.name).at(record.X) - record.position[:, b]).T
        load[:, b, 2] -= x * inertia[:, p + 1] - y * inertia[:, p]
        if coordinates.natural.rotates(body.name):
            cos, sin = record.direction[:, b].T
            load[:, b, 2] -= cos * inertia[:, p + 3] - sin * inertia[:, p + 2]
    return record._replace(load=load)
