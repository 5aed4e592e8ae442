"""The distributed mass of bars that bend: what beam elements couple between the cross-sections at their ends."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from scissordyn.component.beam import Beam, node_inertia
from scissordyn.component.place import GROUND
from scissordyn.errors import InputError
from scissordyn.model.mechanism import Mechanism
from scissordyn.plan.coordinates import Natural, PointMap, combined

__all__ = ["beam_mass", "beams_of", "straight_maps"]

HERMITE = np.array([[156.0, 22.0, 54.0, -13.0], [22.0, 4.0, 13.0, -3.0], [54.0, 13.0, 156.0, -22.0], [-13.0, -3.0, -22.0, 4.0]])
"""420 int S_i S_j dxi for the cubic Hermite shapes of (r_1, l r'_1, r_2, l r'_2)."""


def beams_of(mechanism: Mechanism) -> tuple[Beam, ...]:
    """The beam elements of a mechanism."""
    return tuple(part for part in mechanism.components if isinstance(part, Beam))


def beam_mass(mechanism: Mechanism, natural: Natural) -> sp.csr_array:
    """The consistent mass matrix of the beam elements less the masses and inertias that their bodies have for them.

    Returns
    -------
    sparse matrix, shape (nZ, nZ)
        Of the natural coordinates.
    """
    entries: list[tuple[int, int, float]] = []
    for beam in beams_of(mechanism):
        if beam.mass_per_length == 0.0:
            continue
        m, l = beam.mass_per_length, beam.length
        unit = np.array([1.0, l, 1.0, l])
        block = m * l / 420.0 * HERMITE * np.outer(unit, unit)
        block -= np.diag([0.5 * m * l, node_inertia(m, l)] * 2)
        first, second = (_offset(natural, beam, body, point) for body, point in (beam.start, beam.end))
        places = first, first + 2, second, second + 2
        entries += [
            (places[i] + axis, places[j] + axis, float(block[i, j])) for i in range(4) for j in range(4) for axis in (0, 1)
        ]
    if not entries:
        return sp.csr_array((natural.total, natural.total))
    rows, columns, values = zip(*entries, strict=True)
    return sp.csr_array((values, (rows, columns)), shape=(natural.total, natural.total))


def _offset(natural: Natural, beam: Beam, body: str, point: str) -> int:
    if body == GROUND or not natural.rotates(body) or natural.bodies[body].points[point] != (0.0, 0.0):
        raise InputError(
            f"beam '{beam.name}' with a mass ends at '{body}.{point}'",
            "the origins of two bodies that rotate",
            "mass_per_length = 0 for an element without mass",
        )
    return natural.offsets[body]


def straight_maps(beam: Beam, u: PointMap, first: PointMap, second: PointMap) -> tuple[tuple[PointMap, float], ...]:
    """Vectors that vanish where an element is not strained, with the lengths that they are compared with [m]."""
    return (combined((u, 1.0), (first, -beam.length)), beam.length), (combined((second, 1.0), (first, -1.0)), 1.0)
