"""Constraints of couplings and of prescribed coordinates."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from scissordyn.components.place import GROUND
from scissordyn.errors import InputError
from scissordyn.mechanics.constraint_part import ANGLE, HALF_SQUARE, LENGTH
from scissordyn.mechanics.time_function import function_start
from scissordyn.model.coupling import Coordinate, CoordinateDrive, Distance, RelativeAngle, Slide
from scissordyn.model.mechanism import Mechanism
from scissordyn.plan.coordinates import Constraint, Coordinates, PointMap, combined
from scissordyn.plan.quadratic_constraints import product
from scissordyn.plan.redundancy import assembled_near_placed, basis_of
from scissordyn.plan.transmission import LineAngle, Terms, Thrust, centres_move, check_placed, flank_terms, placed_terms


def coupling_constraints(mechanism: Mechanism, coordinates: Coordinates, angles: np.ndarray) -> list[Constraint]:
    """Return the constraints of couplings and coordinate drives, given all other coordinates and the drives' angles."""
    if not mechanism.coupling_parts:
        return []
    start = _Start(mechanism, coordinates, angles)
    return [start.constraint(part) for part in mechanism.coupling_parts]


class _Start:
    """Angles and positions of the bodies at the start, as given or as assembled without couplings."""

    def __init__(self, mechanism: Mechanism, coordinates: Coordinates, angles: np.ndarray) -> None:
        self.mechanism, self.coordinates = mechanism, coordinates
        self.driven = {drive.body: angle for drive, angle in zip(mechanism.drives, angles.tolist(), strict=True)}
        natural, placed = coordinates.natural, coordinates.placed[0].copy()
        if any(body.position is None or (body.rotates and body.angle is None) for body in mechanism.bodies):
            assembled = assembled_near_placed(coordinates, angles)
            if assembled is not None:
                for body in mechanism.bodies:
                    name, p = body.name, natural.offsets[body.name]
                    if body.position is None:
                        placed[p : p + 2] = assembled[p : p + 2]
                    if natural.rotates(name) and body.angle is None:
                        placed[p + 2 : p + 4] = assembled[p + 2 : p + 4]
        b = basis_of(angles)
        for name, angle in self.driven.items():
            if natural.rotates(name):
                p = natural.offsets[name]
                placed[p + 2 : p + 4] = math.cos(angle), math.sin(angle)
        self.natural, self.full = placed, np.append(coordinates.nearest(b, placed), b)

    def angle(self, body: str) -> float:
        """Return the angle of a body at the start [rad], on the turn nearest to its placed angle or its drive's first one."""
        if body == GROUND:
            return 0.0
        near = self.driven.get(body, self.mechanism.body(body).placed_angle)
        return float(near) + math.remainder(self.coordinates.natural.angle_of(body, self.natural) - near, math.tau)

    def value(self, coordinate: Coordinate | LineAngle | Thrust) -> float:
        """Return the value of a coordinate [rad or m]."""
        if isinstance(coordinate, LineAngle):
            x, y = _span(self.coordinates, coordinate).at(self.full)
            near = self.angle(coordinate.near)
            return near + math.remainder(math.atan2(y, x) - near, math.tau)
        if isinstance(coordinate, RelativeAngle):
            return self.angle(coordinate.body) - self.angle(coordinate.base)
        if isinstance(coordinate, Slide):
            way, along = _slide(self.coordinates, coordinate)
            return float(way.at(self.full) @ along.at(self.full))
        assert isinstance(coordinate, Distance)  # a thrust is not part of a constraint
        return float(np.hypot(*_span(self.coordinates, coordinate).at(self.full)))

    def constraint(self, part: Any) -> Constraint:
        """Return the constraint of a coupling or coordinate drive."""
        drive, terms, moving = isinstance(part, CoordinateDrive), part.terms, False
        acting = terms
        if not drive and part.transmission is not None:
            moving = centres_move(self.mechanism, self.coordinates, part, self.full)
            check_placed(self.mechanism, self.coordinates, part, self.full, moving=moving)
            acting = placed_terms(self.mechanism, part)
            if moving:
                terms = acting = (*acting, *flank_terms(self.mechanism, self.coordinates, part, self.full))
        bare = coupling_parts(self.coordinates, terms, part.name)
        subject, scale = f"{'drive' if drive else 'coupling'} '{part.name}'", bare.scale
        bodies = tuple(dict.fromkeys(body for _, coordinate in part.terms for body in coordinate.bodies))
        moves = any(np.any(point_map.rows[:, point_map.columns < self.coordinates.free]) for _, point_map in bare.parts)
        # a coupling between drives that the ideal mechanism does not need is left out as redundant
        if not moves and (drive or not self.mechanism.clearances_closed):
            raise InputError(
                f"{subject}: the {'coordinate' if drive else 'coordinates'} cannot move, or drives prescribe "
                f"{'it' if drive else 'them'} already",
                "bodies that can move relative to each other",
            )
        for _, coordinate in () if drive else part.terms:
            if not _can_move(self.coordinates, coordinate):
                raise InputError(
                    f"{subject}: one coordinate cannot move, so that it holds the other one", "two coordinates that can move"
                )
        references = {body: self.angle(body) for body, _ in bare.turning}
        references |= {line.near: self.value(line) for _, line in terms if isinstance(line, LineAngle)}
        here = sum(factor * self.value(coordinate) for factor, coordinate in terms)
        value = here
        if drive:
            value = function_start(part.motion, here)
            if references:  # a motion may start some turns away from the placed angle
                references[part.coordinate.body] += math.tau * round((value - here) / math.tau)
        elif part.offset is not None:
            # with moving centres the constant of the relation is not that of the coordinates
            relation_value = sum(factor * self.value(coordinate) for factor, coordinate in part.terms)
            value = here + part.offset - relation_value if moving else part.offset
        return replace(
            bare,
            value=value / scale,
            motion=part.motion if drive else None,
            start=here,
            turning=tuple(references.items()),
            subject=subject,
            bodies=bodies,
            acting=acting,
            moving=moving,
        )


def coupling_parts(coordinates: Coordinates, terms: Terms, name: str) -> Constraint:
    """Return maps and weights of a coupling or coordinate drive, scaled to a largest weight of one; value not set."""
    size = coordinates.size
    scale = max(abs(factor) * (1.0 if coordinate.unit == "rad" else size) for factor, coordinate in terms)
    turning: dict[str, float] = {}
    lines = list[tuple[float, LineAngle]]()
    lengths, squares = list[tuple[float, PointMap]](), list[tuple[float, PointMap]]()
    for factor, coordinate in terms:
        weight = factor * (1.0 if coordinate.unit == "rad" else size) / scale
        if isinstance(coordinate, LineAngle):
            lines.append((weight, coordinate))
        elif isinstance(coordinate, RelativeAngle):
            for body, sign in zip(coordinate.bodies, (1.0, -1.0), strict=True):
                turning[body] = turning.get(body, 0.0) + sign * weight
        elif isinstance(coordinate, Slide):
            way, along = _slide(coordinates, coordinate)
            squares += [(weight * part, square) for part, square in product(combined((way, 1.0 / size)), along)]
        elif isinstance(coordinate, Distance):
            lengths.append((weight, combined((_span(coordinates, coordinate), 1.0 / size))))
    turning = {
        body: weight
        for body, weight in turning.items()
        if weight and body != GROUND and coordinates.natural.bodies[body].rotates
    }
    turns = [(weight, coordinates.direction(body)) for body, weight in turning.items()]
    turns += [(weight, combined((_span(coordinates, line), 1.0 / size))) for weight, line in lines]
    return Constraint(
        (*turns, *lengths, *squares),
        0.0,
        scale=scale,
        name=name,
        kinds=(ANGLE,) * len(turns) + (LENGTH,) * len(lengths) + (HALF_SQUARE,) * len(squares),
        turning=tuple((body, 0.0) for body in (*turning, *(line.near for _, line in lines))),
    )


def _can_move(coordinates: Coordinates, coordinate: Coordinate) -> bool:
    """Return whether a coordinate depends on free coordinates or drives."""
    if isinstance(coordinate, RelativeAngle):
        maps = [coordinates.frame(body) for body in coordinate.bodies]
    else:
        maps = [*_slide(coordinates, coordinate)] if isinstance(coordinate, Slide) else [_span(coordinates, coordinate)]
    return any(bool(np.any(point_map.rows[:, point_map.columns != coordinates.free])) for point_map in maps)


def _slide(coordinates: Coordinates, slide: Slide) -> tuple[PointMap, PointMap]:
    """Return the vector from the origin of a slide's base to its point [m], and the direction of the slide."""
    along = coordinates.frame(slide.base).turned(math.cos(slide.direction), math.sin(slide.direction))
    point = coordinates.place(slide.point)
    if slide.base == GROUND:
        return point, along
    return combined((point, 1.0), (coordinates.origin(slide.base), -1.0)), along


def _span(coordinates: Coordinates, distance: Distance | LineAngle) -> PointMap:
    """Return the vector from start to end [m]."""
    return combined((coordinates.place(distance.end), 1.0), (coordinates.place(distance.start), -1.0))
