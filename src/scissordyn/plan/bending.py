"""The distributed mass of bars that bend: what beam elements couple between the cross-sections at their ends."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import breadth_first_order, connected_components

from scissordyn.component.beam import Beam, node_inertia
from scissordyn.component.place import GROUND
from scissordyn.errors import InputError
from scissordyn.model.mechanism import Mechanism
from scissordyn.plan.coordinates import Natural, PointMap, combined

__all__ = ["beam_mass", "beams_of", "dissected", "straight_maps"]

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


FEW = 6
"""Coordinates that are not divided further."""


def dissected(graph: sp.csr_array) -> np.ndarray:
    """An order of connected coordinates in which few come after each that depend on it: nested dissection.

    The middle of a breadth-first search from one end divides what is left, and comes after both parts
    (George 1973).
    """
    if graph.shape[0] <= FEW:
        return np.arange(graph.shape[0])
    level = _levels(graph, int(np.argmax(_levels(graph, 0))))
    counts = np.bincount(level)
    middle = int(np.searchsorted(np.cumsum(counts), 0.5 * level.size))
    parts = [np.flatnonzero(level < middle), np.flatnonzero(level > middle)]
    ordered = []
    for part in parts:
        inside = sp.csr_array(graph[part][:, part])
        count, label = connected_components(inside, directed=False)
        for k in range(count):
            members = np.flatnonzero(label == k)
            ordered.append(part[members[dissected(sp.csr_array(inside[members][:, members]))]])
    return np.concatenate([*ordered, np.flatnonzero(level == middle)])


def _levels(graph: sp.csr_array, first: int) -> np.ndarray:
    """Distance of each coordinate from one of them, in couplings."""
    order, before = breadth_first_order(graph, first, directed=False)
    level = np.zeros(graph.shape[0], int)
    for each in order[1:]:
        level[each] = level[before[each]] + 1
    return level


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
