"""Mass matrix and tables of flexible bars and beam elements."""

from __future__ import annotations

import math
from collections import defaultdict
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from scissordyn.components.beam import Beam
from scissordyn.components.elastic import node_inertia
from scissordyn.components.flexible_bar import FlexibleBar
from scissordyn.components.place import GROUND
from scissordyn.components.port.declaration import ends_of
from scissordyn.errors import InputError
from scissordyn.mechanics.lanes import padded
from scissordyn.model.disjoint_sets import DisjointSets
from scissordyn.model.mechanism import Mechanism
from scissordyn.plan.acting import acting
from scissordyn.plan.coordinates import Constraint, Coordinates, Natural, PointMap, combined
from scissordyn.plan.flexible import Axis, flexible_bars

if TYPE_CHECKING:
    from scipy.sparse import csr_array

HERMITE_MASS = np.array(
    [[156.0, 22.0, 54.0, -13.0], [22.0, 4.0, 13.0, -3.0], [54.0, 13.0, 156.0, -22.0], [-13.0, -3.0, -22.0, 4.0]]
)
"""Consistent mass matrix of a beam element with cubic Hermite shapes S_i, divided by its mass/420: 420 int S_i S_j dxi.

Its coordinates are (r_1, l r'_1, r_2, l r'_2): positions and slopes of both ends.
"""


def beams_of(mechanism: Mechanism) -> tuple[Beam, ...]:
    return tuple(part for part in mechanism.components if isinstance(part, Beam))


def bends(mechanism: Mechanism) -> bool:
    """Return whether a mechanism has beam elements or flexible bars."""
    return any(isinstance(part, Beam | FlexibleBar) for part in mechanism.components)


def whole_masses(mechanism: Mechanism) -> np.ndarray:
    """Return the reduced mass of the bodies of each contact, then of each component that the kernels read [kg].

    It is 0 for components without a gap, and if none of the bodies is part of a bar that bends. All sections of a bar count
    together, and the ground has an infinite mass.
    """
    contacts, components = mechanism.contacts, acting(mechanism)
    if not bends(mechanism):
        return np.zeros(len(contacts) + len(components))
    bars, mass, masses = DisjointSets(), defaultdict[str, float](float), list[float]()
    chains = [(beam.start[0], beam.end[0]) for beam in beams_of(mechanism)]
    for chain in (*chains, *(bar.sections for bar in flexible_bars(mechanism))):
        for pair in pairwise(chain):
            bars.join(*pair)
    for body in mechanism.bodies:
        mass[bars.find(body.name)] += body.mass
    guarded = (() if part.declaration.gap is None else ends_of(part) for part in components)
    for ends in (*(contact.ends for contact in contacts), *guarded):
        bodies = [name for name, _ in ends if name != GROUND]
        inverse = sum(1.0 / mass[whole] for whole in {bars.find(name) for name in bodies})
        masses.append(1.0 / inverse if any(name in bars for name in bodies) else 0.0)
    return np.array(masses)


def beam_mass(mechanism: Mechanism, natural: Natural) -> csr_array:
    """Return the consistent mass matrix of beam elements and flexible bars, less masses and inertias of their bodies.

    Shapes: returns (nZ, nZ).
    """
    from scipy.sparse import csr_array  # imported here: mechanisms of rigid bodies do not need it

    entries: list[tuple[int, int, float]] = []
    for beam in beams_of(mechanism):
        if beam.mass_per_length == 0.0:
            continue
        m, l = beam.mass_per_length, beam.length
        unit = np.array([1.0, l, 1.0, l])
        block = m * l / 420.0 * HERMITE_MASS * np.outer(unit, unit)
        block -= np.diag([0.5 * m * l, node_inertia(m, l)] * 2)
        first, second = (_offset(natural, beam, body, point) for body, point in (beam.start, beam.end))
        places = first, first + 2, second, second + 2
        entries += [
            (places[i] + axis, places[j] + axis, float(block[i, j])) for i in range(4) for j in range(4) for axis in (0, 1)
        ]
    for axis in natural.axes:
        entries += _axis_mass(axis)
    if not entries:
        return csr_array((natural.total, natural.total))
    rows, columns, values = zip(*entries, strict=True)
    return csr_array((values, (rows, columns)), shape=(natural.total, natural.total))


def _axis_mass(axis: Axis) -> list[tuple[int, int, float]]:
    """Return the mass matrix entries of a flexible bar; amplitudes of modes are not coupled with anything."""
    per_length, spans, shape_mass = axis.bar.mass_per_length, np.diff(axis.shapes.places), np.zeros(axis.shapes.count)
    for k in range(len(axis.bar.sections)):
        shape_mass[k] = 0.5 * per_length * float(np.sum(spans[max(0, k - 1) : k + 1]))
    for row, k in enumerate(axis.shapes.clamped, len(axis.bar.sections)):
        if k in axis.directed:
            shape_mass[row] = sum(node_inertia(per_length, span) for span in spans[max(0, k - 1) : k + 1].tolist())
    mass = per_length * axis.shapes.mass - np.diag(shape_mass)
    entries = []
    for i, p, first in axis.terms:
        for j, q, second in axis.terms:
            if mass[i, j] == 0.0:
                continue
            along, across = mass[i, j] * math.cos(second - first), mass[i, j] * math.sin(second - first)
            entries += [(p, q, along), (p + 1, q + 1, along)]
            if across != 0.0:
                entries += [(p, q + 1, -across), (p + 1, q, across)]
    return entries


def flexible_maps(coordinates: Coordinates) -> list[tuple[np.ndarray, list[PointMap]]]:
    """Return, for each flexible bar, the indices of the coordinates that move it, and its shape vectors as maps of these."""
    shape_maps = []
    for axis in coordinates.natural.axes:
        maps = [coordinates.vector(*axis.expression(unit)) for unit in np.eye(axis.shapes.count)]
        shape_maps.append((np.unique(np.concatenate([vector.columns for vector in maps])), maps))
    return shape_maps


def mode_columns(axis: Axis, maps: list[PointMap]) -> tuple[int, int, float]:
    """Return the number of static shapes, the first column of the modes and their common factor.

    Each mode has two columns of its own, in order. A bar without modes has column 0 and factor 0.
    """
    fixed, count = axis.shapes.interface_count, axis.shapes.count
    if fixed == count:
        return fixed, 0, 0.0
    first, scale = int(maps[fixed].columns[0]), float(maps[fixed].rows[0, 0])
    for k, vector in enumerate(maps[fixed:count]):
        assert vector.columns.tolist() == [first + 2 * k, first + 2 * k + 1]
        assert np.array_equal(vector.rows, scale * np.eye(2))
    return fixed, first, scale


def bar_table(axis: Axis) -> np.ndarray:
    """Return the table of a flexible bar that the kernels read (`system.Model.bar_table`); it depends on lengths only."""
    shapes = axis.shapes
    points, weights = shapes.quadrature
    slopes, at_ends = shapes.at(points, 1), shapes.at(np.array([0.0, shapes.places[-1]]), 1)
    tables = slopes.T, at_ends.T, axis.stretching, np.vstack([shapes.bending, slopes, shapes.at(points, 2)])
    return np.concatenate([weights, *(_padded(table).ravel() for table in tables)])


def _padded(table: np.ndarray) -> np.ndarray:
    """Pad the rows of a table with zeros to a multiple of the width of vector instructions."""
    return np.pad(table, ((0, 0), (0, padded(table.shape[1]) - table.shape[1])))


def held_table(maps: list[PointMap]) -> tuple[np.ndarray, np.ndarray]:
    """Return the coordinates that `maps` depend on, and the coefficients of all maps as a table in two layouts.

    The first layout has a row per coordinate, with x and y of one shape after the other; the second one is its transpose.
    """
    columns = np.unique(np.concatenate([vector.columns for vector in maps]))
    table = np.zeros((columns.size, 2 * len(maps)))
    for k, vector in enumerate(maps):
        table[np.searchsorted(columns, vector.columns), 2 * k : 2 * k + 2] = vector.rows.T
    return columns, np.concatenate([_padded(table).ravel(), _padded(table.T).ravel()])


def dissected(graph: csr_array) -> np.ndarray:
    """Return an order of connected coordinates with little fill-in: nested dissection (George 1973).

    The middle level of a breadth-first search from one end separates two parts and comes after both.
    """
    if graph.shape[0] <= 6:  # small parts are not divided further
        return np.arange(graph.shape[0])
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import connected_components

    level = _levels(graph, int(np.argmax(_levels(graph, 0))))
    counts = np.bincount(level)
    middle = int(np.searchsorted(np.cumsum(counts), 0.5 * level.size))
    parts = [np.flatnonzero(level < middle), np.flatnonzero(level > middle)]
    ordered = []
    for part in parts:
        inside = csr_array(graph[part][:, part])
        count, label = connected_components(inside, directed=False)
        for k in range(count):
            members = np.flatnonzero(label == k)
            ordered.append(part[members[dissected(csr_array(inside[members][:, members]))]])
    return np.concatenate([*ordered, np.flatnonzero(level == middle)])


def _levels(graph: csr_array, first: int) -> np.ndarray:
    """Return the distance of each coordinate from the coordinate `first`: the smallest number of couplings in between."""
    from scipy.sparse.csgraph import breadth_first_order

    order, before = breadth_first_order(graph, first, directed=False)
    level = np.zeros(graph.shape[0], int)
    for further in order[1:]:
        level[further] = level[before[further]] + 1
    return level


def _offset(natural: Natural, beam: Beam, body: str, point: str) -> int:
    """Return the first natural coordinate of the body at an end of a beam; raise `InputError` if the end is not its origin."""
    if body == GROUND or not natural.rotates(body) or natural.bodies[body].points[point] != (0.0, 0.0):
        raise InputError(
            f"beam '{beam.name}' has a mass and ends at '{body}.{point}'",
            "ends at the origins of two bodies that rotate",
            "mass_per_length = 0 for an element without mass",
        )
    return natural.offsets[body]


def straight_maps(beam: Beam, u: PointMap, first: PointMap, second: PointMap) -> tuple[tuple[PointMap, float], ...]:
    """Return two vectors that vanish if a beam element is straight and unstretched, each with the length it is divided by [m].

    The first is the displacement of the end from its undeformed place, divided by the length of the element. The second is the
    difference of the unit tangents at both ends.
    """
    return (combined((u, 1.0), (first, -beam.length)), beam.length), (combined((second, 1.0), (first, -1.0)), 1.0)


def is_straight(axis: Axis, natural: np.ndarray) -> bool:
    """Return whether the points of a flexible bar lie on a line at their undeformed distances, within 1e-6 of its length."""
    points = axis.vectors(natural)[: len(axis.bar.sections)]
    along = (points[-1] - points[0]) / axis.bar.length
    straight = points[0] + np.outer(axis.shapes.places, along)
    deviations = float(np.max(np.abs(points - straight))), abs(math.hypot(*along) - 1.0) * axis.bar.length
    return max(deviations) <= 1e-6 * axis.bar.length


def straight_bar(coordinates: Coordinates, axis: Axis) -> tuple[list[tuple[PointMap, float]], Constraint]:
    """Return vectors with scales [m] that vanish if a bar is straight and evenly stretched, and a constraint of its length."""
    shapes, length, sections = axis.shapes, axis.bar.length, len(axis.bar.sections)
    identity = np.eye(shapes.count)
    chord = (identity[sections - 1] - identity[0]) / length
    rows = [(identity[k] - identity[0] - shapes.places[k] * chord, length) for k in range(1, sections - 1)]
    rows += [(identity[k] - chord, 1.0) for k in range(sections, shapes.interface_count)]
    rows += [
        (identity[shapes.interface_count + k] - np.append(mean, np.zeros(shapes.modes)), length**1.5)
        for k, mean in enumerate(shapes.mean)
    ]
    vectors = [(coordinates.vector(*axis.expression(row)), scale) for row, scale in rows]
    along = coordinates.vector(*axis.expression(chord))
    return vectors, Constraint(((1.0, along),), 0.5, subject=f"bar '{axis.bar.name}'", bodies=axis.bar.sections)
