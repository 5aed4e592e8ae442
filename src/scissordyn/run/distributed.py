"""The distributed mass of beam elements in the balances of the bodies at their ends."""

from __future__ import annotations

import numpy as np

from scissordyn.component.beam import Beam
from scissordyn.mechanics.outputs import Record
from scissordyn.plan.bending import beam_mass
from scissordyn.plan.plan import Plan

__all__ = ["with_distributed_mass"]


def with_distributed_mass(plan: Plan, found: Record) -> Record:
    """The record with what the consistent mass of the beam elements adds to the loads of their bodies.

    A body at the end of an element has half of its mass at its origin; the rest of the mass matrix times the acceleration less
    gravity is a load. What acts along a unit direction is no moment.
    """
    if not any(isinstance(part, Beam) for part in plan.components):
        return found
    coordinates = plan.coordinates
    natural = np.asarray((coordinates.matrix @ found.A.T).T)
    for p in coordinates.natural.offsets.values():
        natural[:, p : p + 2] -= plan.gravity_vector
    inertia = np.asarray((beam_mass(plan.mechanism, coordinates.natural) @ natural.T).T)
    load = found.load.copy()
    for b, body in enumerate(plan.bodies):
        p = coordinates.natural.offsets[body.name]
        load[:, b, :2] -= inertia[:, p : p + 2]
        if body.rotates:
            cos, sin = found.direction[:, b].T
            load[:, b, 2] -= cos * inertia[:, p + 3] - sin * inertia[:, p + 2]
    return found._replace(load=load)
