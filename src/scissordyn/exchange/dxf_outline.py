"""Find the parts in a DXF by their closed outlines: holes are pins, and masses follow from areas."""

from __future__ import annotations

import itertools
from collections import defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from scissordyn.errors import InputError
from scissordyn.exchange.drawing import DrawnBar
from scissordyn.exchange.dxf_entity import Shape, curve_points
from scissordyn.exchange.source import POINTS_MAX, listed
from scissordyn.tolerance import REPORTED_FRACTION, ROUND_OFF_TOL


@dataclass(frozen=True, eq=False)
class Contour:
    """Closed line of straight sides and arcs, or a point."""

    shape: Shape  # Its first entity
    corners: np.ndarray  # Complex positions [m]
    bulges: np.ndarray  # Tangents of a quarter of each side's arc angle; positive if the arc turns counter-clockwise
    centre: complex | None  # Centre of a circle, or a point [m]; None for other contours
    polygon: np.ndarray  # x and y of positions along it [m]; the first one is repeated at the end

    @property
    def round(self) -> tuple[complex, float]:
        """Centre and radius of a circle or point [m]."""
        assert self.centre is not None
        return self.centre, abs(self.corners[0] - self.centre)

    def moments(self, about: complex) -> np.ndarray:
        """Return the integrals of 1, z and |z|^2 over its area, where z is the position from `about` (Green's theorem)."""
        nodes, weights = np.polynomial.legendre.leggauss(20)  # enough for a full turn, to round-off
        z, slope = curve_points(self.corners, self.bulges, 0.5 * (nodes + 1.0))
        z, line = z - about, weights * slope / 4j
        integrals = [np.sum(line * f) for f in (z.conj(), abs(z) ** 2, 0.5 * abs(z) ** 2 * z.conj())]
        return np.array(integrals) if integrals[0].real > 0.0 else -np.array(integrals)


class _Nest:
    """Outlines, and which of them are around a contour."""

    def __init__(self, outlines: list[Contour]) -> None:
        self.outlines = outlines
        ends = [(outline.polygon.min(axis=0), outline.polygon.max(axis=0)) for outline in outlines]
        self.low, self.high = np.array(ends).reshape(-1, 2, 2).transpose(1, 0, 2)

    def around(self, contour: Contour) -> list[Contour]:
        """Return the outlines that hold a contour, or its centre if it is a circle."""
        z = contour.corners if contour.centre is None else np.array([contour.centre])
        xy = np.column_stack([z.real, z.imag])
        whole = contour.polygon if len(contour.polygon) else xy
        near = np.all((self.low <= whole.min(axis=0)) & (whole.max(axis=0) <= self.high), axis=1)
        candidates = (self.outlines[k] for k in np.flatnonzero(near))
        return [outline for outline in candidates if outline is not contour and inside(xy, outline.polygon).all()]

    def owners(self, contour: Contour) -> list[Contour]:
        """Return the outlines around a contour: those of its block or else its layer if there are any, otherwise all."""
        around = self.around(contour)
        same_block = [outline for outline in around if outline.shape.insert == contour.shape.insert] or around
        return [outline for outline in same_block if outline.shape.layer == contour.shape.layer] or same_block


class Outlines(NamedTuple):
    """Parts in a drawing, and what else is drawn."""

    parts: list[tuple[Shape, DrawnBar, list[Contour]]]  # First entity of each outline, the part, and its holes
    marks: list[Shape]  # Points, and centres of circles
    lines: list[Shape]  # Lines that are not closed


def find_parts(shapes: Iterable[Shape], area_density: float, tolerance: float, notes: list[str]) -> Outlines:
    """Return the parts among the shapes of a drawing.

    `area_density` is their mass per area [kg/m^2]. `tolerance` is the largest distance of joined ends [m]. The
    parts have no names and pins yet.
    """
    groups = defaultdict[tuple[int, str], list[Shape]](list)
    for shape in shapes:
        groups[shape.insert, shape.layer].append(shape)
    lines = list[Shape]()
    contours = [contour for group in groups.values() for contour in _closed(group, tolerance, lines)]
    if len(contours) > POINTS_MAX:
        raise InputError(f"a DXF with more than {POINTS_MAX} closed contours", "a drawing with only the linkage")
    circles = [contour for contour in contours if contour.centre is not None]
    discs = _find_discs(circles, _Nest([contour for contour in contours if contour.centre is None]), tolerance)
    nest = _Nest([contour for contour in contours if contour.centre is None or contour in discs])
    holes, cutouts = defaultdict[Contour, list[Contour]](list), defaultdict[Contour, list[Contour]](list)
    for circle in circles:
        for outline in () if circle in discs else nest.owners(circle):
            holes[outline].append(circle)
    outer = [outline for outline in nest.outlines if outline in holes or not nest.around(outline)]
    kept, part_nest = set(outer), _Nest(outer)
    for contour in (outline for outline in nest.outlines if outline not in kept):
        cutouts[min(part_nest.owners(contour), key=lambda outline: outline.moments(0.0)[0].real)].append(contour)
    parts = []
    for outline in (outline for outline in outer if outline in holes):
        parts.append((outline.shape, _part(outline, holes[outline], cutouts[outline], area_density), holes[outline]))
        for first, second in itertools.combinations_with_replacement((outline, *holes[outline], *cutouts[outline]), 2):
            if (place := crossing(first.polygon, second.polygon)) is not None:
                what = "itself" if second is first else second.shape.label
                notes.append(
                    f"{first.shape.label} crosses {what} at x = {place[0]:.4g} m, y = {place[1]:.4g} m: check the mass"
                )
        if cutouts[outline]:
            notes.append(f"{len(cutouts[outline])} cutouts of {outline.shape.label} are not round and have no pins")
    if empty := [outline.shape.label for outline in outer if outline not in holes]:
        notes.append(f"{listed(empty)} left out: no hole, so no pin")
    marks = [
        circle.shape._replace(places=((circle.round[0].real, circle.round[0].imag),), bulges=())
        for circle in circles
        if circle not in discs
    ]
    return Outlines(parts, marks, lines)


def _find_discs(circles: list[Contour], nest: _Nest, tolerance: float) -> set[Contour]:
    """Return the circles that are parts: other circles are inside them, and have other centres if an outline is around."""
    centres, radii = np.array([circle.round for circle in circles]).reshape(-1, 2).T
    discs = set()
    for circle, centre, radius in zip(circles, centres, radii.real, strict=True):
        gaps = abs(centres - centre)
        inner = gaps + radii.real < radius - tolerance
        if inner.any() and (gaps[inner].max() > tolerance or not nest.around(circle)):
            discs.add(circle)
    return discs


def _part(outline: Contour, holes: list[Contour], cutouts: list[Contour], area_density: float) -> DrawnBar:
    """Return a part without name and pins; a hole or cutout inside another one is not removed again."""
    about = complex(outline.corners.mean())
    area, first, polar = outline.moments(about)
    removed, gaps = list[Contour](), [(c.moments(about), c) for c in (*holes, *cutouts) if len(c.polygon)]
    for moments, gap in sorted(gaps, key=lambda pair: -pair[0][0].real):
        if not _Nest(removed).around(gap):
            removed.append(gap)
            area, first, polar = np.array([area, first, polar]) - moments
    if not area.real > 0.0:
        raise InputError(f"the holes of {outline.shape.label} are larger than its outline", "holes inside the outline")
    centre, mass = about + first / area, area_density * area.real
    return DrawnBar("", (), mass, area_density * polar.real - mass * abs(first / area) ** 2, (centre.real, centre.imag))


def _closed(shapes: list[Shape], tolerance: float, lines: list[Shape]) -> Iterator[Contour]:
    """Yield the points and closed contours of entities that belong together; add those that remain open to `lines`."""
    from scipy.spatial import cKDTree

    pieces = list[Shape]()
    for shape in shapes:
        if shape.closed or len(shape.places) == 1:
            yield _contour([(shape, False)], tolerance)
        else:
            pieces.append(shape)
    ends = np.array([place for piece in pieces for place in (piece.places[0], piece.places[-1])]).reshape(-1, 2)
    neighbours = defaultdict[int, list[int]](list)
    for a, b in cKDTree(ends).query_pairs(tolerance) if pieces else ():
        neighbours[a].append(b)
        neighbours[b].append(a)
    remaining = dict.fromkeys(range(len(pieces)))
    while remaining:
        path = [2 * next(iter(remaining))]  # numbers of the ends at which the contour enters its pieces
        while True:
            del remaining[path[-1] // 2]
            following = neighbours[path[-1] ^ 1]
            if len(following) != 1 or following[0] // 2 not in remaining:
                break
            path.append(following[0])
        if following == path[:1]:
            yield _contour([(pieces[end // 2], bool(end % 2)) for end in path], tolerance)
        else:
            lines += [pieces[end // 2] for end in path]


def _contour(pieces: list[tuple[Shape, bool]], tolerance: float) -> Contour:
    """Return the contour of entities in their order; True means that an entity is passed from its end to its start."""
    corners, bulges = list[complex](), list[float]()
    for shape, backwards in pieces:
        places = [complex(*place) for place in shape.places]
        curves = list(shape.bulges) or [0.0] * (len(places) - (not shape.closed))
        corners += (places[::-1] if backwards else places)[: len(curves) or 1]
        bulges += [-bulge for bulge in reversed(curves)] if backwards else curves
    z, turns = np.array(corners), np.array(bulges)
    if not bulges:
        return Contour(pieces[0][0], z, np.zeros(1), z[0], np.empty((0, 2)))
    fine = curve_points(z, turns, np.linspace(0.0, 1.0, 9 if turns.any() else 2)[:-1])[0].ravel()
    closed = np.append(fine, fine[0])
    centre = _centre(z, fine, tolerance, arcs=bool(turns.all()))
    return Contour(pieces[0][0], z, turns, centre, np.column_stack([closed.real, closed.imag]))


def _centre(corners: np.ndarray, places: np.ndarray, tolerance: float, *, arcs: bool) -> complex | None:
    """Return the centre of a contour that is a circle, of arcs or drawn as a polygon; None for any other contour."""
    polygon_min = 12  # fewest corners of a polygon that draws a circle
    if not arcs and len(corners) < polygon_min:
        return None
    a, b, c = (complex(places[k * len(places) // 3]) for k in range(3))
    side = (c - a) / (b - a)
    through = a + (b - a) * (side - abs(side) ** 2) / (2j * side.imag) if side.imag else a  # centre of a circle through a, b, c
    centre = through if len(corners) > 2 else complex(corners.mean())
    gap = tolerance if arcs else REPORTED_FRACTION * abs(a - centre)
    return centre if np.ptp(abs(places - centre)) <= gap else None


def inside(xy: np.ndarray, outline: np.ndarray) -> np.ndarray:
    """Return True for each point inside a closed outline (even-odd rule)."""
    sides = np.column_stack([outline[:-1], outline[1:]])[np.diff(outline[:, 1]) != 0.0]

    def crosses(x: Any, y: Any, x0: Any, y0: Any, x1: Any, y1: Any) -> Any:
        return ((y >= y0) != (y >= y1)) & (x < x0 + (y - y0) * (x1 - x0) / (y1 - y0))

    if len(xy) < len(sides):
        return np.array([np.count_nonzero(crosses(*place, *sides.T)) % 2 == 1 for place in xy], bool)
    is_inside = np.zeros(len(xy), bool)
    for side in sides:
        is_inside ^= crosses(*xy.T, *side)
    return is_inside


def crossing(first: np.ndarray, second: np.ndarray) -> np.ndarray | None:
    """Return the x and y at which two closed polygons cross, or a polygon crosses itself; None if they do not."""

    def sides(start: np.ndarray, end: np.ndarray, places: np.ndarray) -> np.ndarray:
        """Return 1 or -1 for the side of a line on which each place is, 0 for those on the line but for round-off."""
        areas = (end[0] - start[0]) * (places[:, 1] - start[1]) - (end[1] - start[1]) * (places[:, 0] - start[0])
        least = ROUND_OFF_TOL * np.linalg.norm(end - start) * np.abs(places - start).max(axis=1)
        return np.where(np.abs(areas) > least, np.sign(areas), 0.0)

    if np.any(first.max(axis=0, initial=-np.inf) < second.min(axis=0, initial=np.inf)) or np.any(
        second.max(axis=0, initial=-np.inf) < first.min(axis=0, initial=np.inf)
    ):
        return None
    for start, end in itertools.pairwise(first):
        low, high = np.minimum(start, end), np.maximum(start, end)
        near = np.all((np.maximum(second[:-1], second[1:]) >= low) & (np.minimum(second[:-1], second[1:]) <= high), axis=1)
        for k in np.flatnonzero(near):
            a, b = second[k], second[k + 1]
            if np.prod(sides(start, end, second[k : k + 2])) < 0.0 and np.prod(sides(a, b, np.array([start, end]))) < 0.0:
                return np.asarray(a + np.linalg.solve(np.column_stack([b - a, start - end]), start - a)[0] * (b - a))
    return None
