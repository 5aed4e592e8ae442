"""Tables of components that run along flexible bars: the bars' shapes as polynomials, and their columns."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import legendre

from scissordyn.components.port import RAIL
from scissordyn.errors import InputError, did_you_mean
from scissordyn.plan.coordinates import Coordinates, PointMap
from scissordyn.plan.flexible import Axis


class Rails(NamedTuple):
    """Tables of rollers, the components that run along flexible bars."""

    maps: list[PointMap]  # Maps of the components; those on a rail include the columns of the bar
    bars: dict[int, int]  # Bar of each component on a rail
    rows: np.ndarray  # (components, 4) `system.Model.rail`
    table: np.ndarray  # `system.Model.rail_table`
    places: np.ndarray  # `system.Model.rail_place`


def axis_of(axes: Sequence[Axis], component: Any) -> int:
    """Return the index of the bar that a component runs along."""
    names = [axis.bar.name.removesuffix("/beam") for axis in axes]
    for k, axis in enumerate(axes):
        if component.rail in (names[k], axis.bar.name):
            return k
    raise InputError(
        f"{component.declaration.label} '{component.name}' runs along '{component.rail}', which is not a flexible bar"
        f"{did_you_mean(component.rail, names)}",
        ", ".join(names) or "a bar with a section and a material; a rigid bar carries a guide",
        "sd.with_bending(mechanism, ...)" if not names else "",
    )


def rail_axes(axes: Sequence[Axis], components: Sequence[Any]) -> dict[int, Axis]:
    """Return the bars along which components run, by component index."""
    return {i: axes[axis_of(axes, part)] for i, part in enumerate(components) if part.declaration.port is RAIL}


def shapes_beyond(axis: Axis, places: np.ndarray) -> np.ndarray:
    """Return the shapes of a bar at places along it, shape (places, count); beyond its ends the bar continues straight."""
    inside = np.clip(places, 0.0, axis.shapes.places[-1])
    return np.asarray(axis.shapes.at(inside) + (places - inside)[:, None] * axis.shapes.at(inside, 1))


def rail_tables(
    coordinates: Coordinates, components: Sequence[Any], bars: Sequence[tuple[np.ndarray, list[PointMap]]], maps: list[PointMap]
) -> Rails:
    """Return the maps and tables of components that run along bars."""
    axes, rows = coordinates.natural.axes, np.zeros((len(components), 4), np.int64)
    first_of: dict[int, int] = {}
    tables, places, element_maps = [np.zeros(0)], [np.zeros(0, np.int64)], list(maps)
    for i, component in enumerate(components):
        if component.declaration.port is not RAIL:
            continue
        first_of[i] = k = axis_of(axes, component)
        element_map, columns = element_maps[i], np.union1d(element_maps[i].columns, bars[k][0])
        read = np.zeros((6, columns.size))
        read[:, np.searchsorted(columns, element_map.columns)] = element_map.rows
        element_maps[i] = PointMap(columns, read)
        table, size = _polynomials(axes[k])
        rows[i] = sum(map(len, tables)), len(axes[k].bar.sections) - 1, size, sum(map(len, places))
        tables.append(table)
        places += [np.searchsorted(columns, vector.columns) for vector in bars[k][1]]
    return Rails(element_maps, first_of, rows, np.concatenate(tables), np.concatenate(places))


def _polynomials(axis: Axis) -> tuple[np.ndarray, int]:
    """Return one row with the places of the cross-sections and the Legendre coefficients of the bar's shapes.

    The coefficients are in the order (span, shape, coefficient). The second result is the number of coefficients per shape.
    """
    shapes = axis.shapes
    size = shapes.degree + 1
    points, weights = legendre.leggauss(size)
    project = legendre.legvander(points, shapes.degree).T * weights * (np.arange(size) + 0.5)[:, None]
    parts = [np.array(shapes.places)]
    for a, b in zip(shapes.places, shapes.places[1:], strict=False):
        parts.append((project @ shapes.at(a + 0.5 * (b - a) * (points + 1.0))).T.ravel())
    return np.concatenate(parts), size
