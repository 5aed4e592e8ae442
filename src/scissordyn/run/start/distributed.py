"""The distributed mass of beam elements in the balances of the bodies at their ends."""

from __future__ import annotations

import numpy as np

from scissordyn.mechanics.outputs import Record
from scissordyn.plan.bending import beam_mass, bends
from scissordyn.plan.plan import Plan
from scissordyn.plan.rail import shapes_beyond
from scissordyn.run.answer.bars import bar_motions, couple_forces, shape_forces


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
        if coordinates.natural.rotates(body.name):
            cos, sin = record.direction[:, b].T
            load[:, b, 2] -= cos * inertia[:, p + 3] - sin * inertia[:, p + 2]
    return record._replace(load=load)
