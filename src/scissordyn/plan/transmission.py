"""Points of action of coupling forces: pitch points of teeth, pulleys of a belt, nut and bearing of a screw.

With c_1, c_2 the centres of two wheels and psi the angle of the line between them, angles relative to the body that carries
both centres obey theta_2 = i theta_1, so theta_2 - i theta_1 - (1 - i) psi is constant. As a constraint of wheels and centres
it gives the same motion. Its force on the centres is that of teeth along their path, or of the difference of a belt's tensions
across the line of centres. The forces of teeth across their path, and of a belt along that line, do no work.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from scissordyn.components.place import GROUND, BodyPoint, Point
from scissordyn.errors import InputError, did_you_mean
from scissordyn.mechanics.body_maps import BELT, GEARS, RACK
from scissordyn.model.coupling import Belt, Coordinate, CoordinateDrive, Coupling, Distance, RelativeAngle, Screw, Slide, Teeth
from scissordyn.model.mechanism import Mechanism
from scissordyn.plan.coordinates import Coordinates, PointMap, combined
from scissordyn.tolerance import ASSEMBLY_TOL


@dataclass(frozen=True)
class LineAngle:
    """Angle of the line from one centre to another [rad]."""

    start: BodyPoint
    end: BodyPoint
    near: str  # Body that turns with the line, exactly or approximately

    unit = "rad"

    @property
    def bodies(self) -> tuple[str, str]:
        """Bodies of the two centres that the line joins, that of its end first."""
        return self.end[0], self.start[0]


@dataclass(frozen=True)
class Thrust:
    """Displacement of a nut along a direction of its base [m]; its force reacts on the body of a thrust bearing."""

    point: BodyPoint
    direction: float
    base: str
    bearing: BodyPoint

    unit = "m"

    @property
    def bodies(self) -> tuple[str, str]:
        """Body of the nut and its base."""
        return self.point[0], self.base


Terms = tuple[tuple[float, Coordinate | LineAngle | Thrust], ...]  # Factors and coordinates of a linear relation


def wheel_centre(mechanism: Mechanism, part: Coupling, end: str) -> BodyPoint:
    """Return the centre of the output's or the input's wheel: as given, or where a pin holds it on its base."""
    angle = getattr(part, end)
    key = "centre" if isinstance(part.transmission, Screw) else f"{end}_centre"
    centre = getattr(part.transmission, key)
    points = dict(mechanism.ground) if angle.body == GROUND else mechanism.body(angle.body).points
    if centre:
        if centre not in points:
            raise InputError(
                f"coupling '{part.name}': {key} = '{centre}'{did_you_mean(centre, points)}", f"a point of '{angle.body}'"
            )
        return angle.body, centre
    pins = [
        (here, there[0])
        for joint in mechanism.joints
        for here, there in ((joint.journal, joint.bearing), (joint.bearing, joint.journal))
        if here[0] == angle.body
    ]
    near = [here for here, other in pins if other == angle.base] or [here for here, _ in pins]
    places = {points[point]: (body, point) for body, point in near}
    if len(places) != 1:
        raise InputError(
            f"coupling '{part.name}': {'no pin' if not places else 'several pins'} on '{angle.body}' can be its centre",
            f"{key}, one of its points",
        )
    return next(iter(places.values()))


def placed_terms(mechanism: Mechanism, part: Coupling | CoordinateDrive) -> Terms:
    """Return the factors and coordinates on which the force of a coupling acts; by default those of its relation."""
    transmission = getattr(part, "transmission", None)
    if not isinstance(part, Coupling) or transmission is None:
        return part.terms
    if isinstance(transmission, Screw):
        return _screw(mechanism, part)
    slide = next((end for end in (part.output, part.input) if isinstance(end, Slide)), None)
    if slide is not None:
        return _rack(mechanism, part, slide)
    output, input = part.output, part.input
    assert isinstance(output, RelativeAngle)
    assert isinstance(input, RelativeAngle)
    line = LineAngle(wheel_centre(mechanism, part, "input"), wheel_centre(mechanism, part, "output"), output.base)
    wheels = ((1.0, output.body), (-part.ratio, input.body))
    return (*((factor, RelativeAngle(body)) for factor, body in wheels if body != GROUND), (part.ratio - 1.0, line))


def flank_terms(mechanism: Mechanism, coordinates: Coordinates, part: Coupling, full: np.ndarray) -> Terms:
    """Return the terms that a given tooth flank adds if the centres move: their distance, or that of a pinion to its rack.

    The flank opens by tan(a) times the change of distance, measured along the path of the teeth; its force then acts along the
    pressure line.
    """
    pressure, transmission = separating_force_of(mechanism, part), part.transmission
    if pressure is None or not isinstance(transmission, Teeth):
        return ()
    factor = transmission.sense * pressure.per_force
    if pressure.kind == RACK:
        rack, along = pressure.second[0], math.atan2(pressure.normal[1], pressure.normal[0])
        return ((factor, Slide(pressure.first, along, rack)),)
    line = np.subtract(coordinates.place(pressure.first).at(full), coordinates.place(pressure.second).at(full))
    return ((factor / float(np.hypot(*line)), Distance(pressure.second, pressure.first)),)


def _rack(mechanism: Mechanism, part: Coupling, slide: Slide) -> Terms:
    """Return the terms of a pinion on a rack: the pinion's angle, and the displacement of its centre along the rack."""
    terms = list[tuple[float, Any]]()
    for end, (factor, coordinate) in zip(("output", "input"), part.terms, strict=True):
        if coordinate is slide:
            pinion = wheel_centre(mechanism, part, "input" if end == "output" else "output")
            terms.append((-factor, Slide(pinion, direction_on(mechanism, slide), slide.point[0])))
        else:
            assert isinstance(coordinate, RelativeAngle)
            terms.append((factor, RelativeAngle(coordinate.body, slide.point[0])))
    return tuple(terms)


def direction_on(mechanism: Mechanism, slide: Slide) -> float:
    """Return the direction of a slide in the frame of the body whose point slides [rad]."""
    turned = [0.0 if name == GROUND else mechanism.body(name).placed_angle for name in (slide.base, slide.point[0])]
    return slide.direction + turned[0] - turned[1]


def _screw(mechanism: Mechanism, part: Coupling) -> Terms:
    """Return the terms of a screw, with the force on its nut acting back on its bearing."""
    ends = ("output", "input") if isinstance(part.output, RelativeAngle) else ("input", "output")
    centre = wheel_centre(mechanism, part, ends[0])
    terms = list[tuple[float, Any]]()
    for factor, coordinate in part.terms:
        if isinstance(coordinate, Slide):
            terms.append((factor, Thrust(coordinate.point, coordinate.direction, coordinate.base, centre)))
        elif isinstance(coordinate, Distance):
            terms.append((factor, _from_bearing(mechanism, part, coordinate, centre)))
        else:
            terms.append((factor, coordinate))
    return tuple(terms)


def _from_bearing(mechanism: Mechanism, part: Coupling, distance: Distance, centre: BodyPoint) -> Distance:
    """Return a distance whose end at the thrust bearing is on the rotating body."""
    place = mechanism.place(centre)
    distances = [math.dist(mechanism.place(end), place) for end in (distance.start, distance.end)]
    if min(distances) > ASSEMBLY_TOL * mechanism.size:
        raise InputError(
            f"coupling '{part.name}': both ends of its distance are {min(distances):.4g} m or more from the screw's thrust "
            "bearing",
            "a distance with one end at the thrust bearing",
        )
    return Distance(centre, distance.end) if distances[0] <= distances[1] else Distance(distance.start, centre)


def centres_move(mechanism: Mechanism, coordinates: Coordinates, part: Coupling, full: np.ndarray) -> bool:
    """Return whether wheel centres can move relative to the base: a bearing has clearance, or the base bends."""
    bases = [end.base for end in (part.output, part.input) if not isinstance(end, Distance)]
    base = bases[0]
    for _, coordinate in placed_terms(mechanism, part):
        if isinstance(coordinate, LineAngle):
            span = combined((coordinates.place(coordinate.end), 1.0), (coordinates.place(coordinate.start), -1.0))
            if not turns_with(coordinates, base, span, full):
                return True
        elif isinstance(coordinate, Slide):  # centre of a pinion on its rack
            rack, (x, y) = coordinate.base, (math.cos(coordinate.direction), math.sin(coordinate.direction))
            arm = coordinates.place(coordinate.point)
            if base != GROUND:
                arm = combined((arm, 1.0), (coordinates.origin(base), -1.0))
            if not turns_with(coordinates, base, arm, full):
                return True
            if not turns_with(coordinates, base, coordinates.frame(rack).turned(x, y), full):
                return True
            if not _is_led(mechanism, coordinates, part):
                return True
        elif isinstance(coordinate, Thrust):
            if not turns_with(coordinates, base, _between(coordinates, base, coordinate.bearing), full):
                return True
        elif isinstance(coordinate, Distance):
            return False  # the distance ends at the points on which its force acts
    return False


def _is_led(mechanism: Mechanism, coordinates: Coordinates, part: Coupling) -> bool:
    """Return whether a rack cannot move across its slide."""
    slide = part.output if isinstance(part.output, Slide) else part.input
    assert isinstance(slide, Slide)
    if slide.base == GROUND:
        place = coordinates.place(slide.point)
        across = np.array([-math.sin(slide.direction), math.cos(slide.direction)]) @ place.rows
        return bool(np.max(np.abs(across[place.columns < coordinates.free]), initial=0.0) <= ASSEMBLY_TOL * coordinates.size)
    return any(
        guide.follower[0] == slide.point[0]
        and guide.body == slide.base
        and abs(math.remainder(guide.direction - slide.direction, math.pi)) <= ASSEMBLY_TOL
        for guide in mechanism.ideal_guides
    )


def _between(coordinates: Coordinates, base: str, point: BodyPoint) -> PointMap:
    """Return the vector from the origin of a base to a point."""
    place = coordinates.place(point)
    return place if base == GROUND else combined((place, 1.0), (coordinates.origin(base), -1.0))


def turns_with(coordinates: Coordinates, base: str, vector: PointMap, full: np.ndarray) -> bool:
    """Return whether a vector is constant in the frame of a body or the ground."""
    frame = coordinates.frame(base)
    (x, y), (cos, sin) = vector.at(full), frame.at(full)
    length = math.hypot(x, y)
    along, across = x * cos + y * sin, y * cos - x * sin
    difference = combined((vector, 1.0), (frame.turned(along, across), -1.0))
    return bool(np.max(np.abs(difference.rows), initial=0.0) <= ASSEMBLY_TOL * max(length, coordinates.size))


def check_placed(mechanism: Mechanism, coordinates: Coordinates, part: Coupling, full: np.ndarray, *, moving: bool) -> None:
    """Raise `InputError` for wheels, pulleys or a nut at positions that do not fit their transmission."""
    label = f"coupling '{part.name}'"
    for _, coordinate in placed_terms(mechanism, part):
        if isinstance(coordinate, LineAngle):
            span = np.subtract(coordinates.place(coordinate.end).at(full), coordinates.place(coordinate.start).at(full))
            _check_centres(part, label, float(np.hypot(*span)), coordinates.size)
        if isinstance(coordinate, Thrust):
            place, bearing = (coordinates.place(point).at(full) for point in (coordinate.point, coordinate.bearing))
            x, y = (
                coordinates.frame(coordinate.base)
                .turned(math.cos(coordinate.direction), math.sin(coordinate.direction))
                .at(full)
            )
            beside = abs((place[0] - bearing[0]) * y - (place[1] - bearing[1]) * x)
            if beside > ASSEMBLY_TOL * coordinates.size:
                raise InputError(
                    f"{label}: the axis of the nut misses the thrust bearing of the screw by {beside:.4g} m",
                    "a nut and a bearing on one axis",
                )
    transmission = part.transmission
    if isinstance(transmission, Teeth) and transmission.radius is not None and _is_rack(part):
        radius = abs(part.ratio if isinstance(part.output, Slide) else 1.0 / part.ratio)
        _check_radius(label, transmission.radius, radius, "the ratio makes")
    if not moving:
        return
    if isinstance(transmission, Belt | Screw):
        what = "a belt" if isinstance(transmission, Belt) else "a screw"
        raise InputError(
            f"{label}: the bearings of {what} move relative to its base, by a clearance or because bars bend",
            "ideal bearings on a rigid base",
        )
    if isinstance(transmission, Teeth) and transmission.pressure_angle > 0.0 and not transmission.flank:
        raise InputError(
            f"{label}: teeth with movable centres (a bearing has clearance, or a bar bends) need the loaded flank",
            '"forward" if they push the output in its positive sense, else "backward"; or pressure_angle = 0',
            'flank = "forward"',
        )


def _is_rack(part: Coupling) -> bool:
    return isinstance(part.output, Slide) or isinstance(part.input, Slide)


def _check_centres(part: Coupling, label: str, distance: float, size: float) -> None:
    """Raise `InputError` if the distance of two centres does not fit their radius or belt."""
    transmission = part.transmission
    if distance <= ASSEMBLY_TOL * size:
        raise InputError(f"{label}: both wheels have one centre", "wheels whose centres are apart")
    if isinstance(transmission, Teeth) and transmission.radius is not None:
        _check_radius(label, transmission.radius, distance / abs(1.0 - part.ratio), f"centres {distance:.6g} m apart make")
    if isinstance(transmission, Belt) and abs(1.0 - part.ratio) * transmission.radius >= distance:
        kind = "open" if part.ratio > 0.0 else "crossed"
        raise InputError(
            f"{label}: no {kind} belt over radii {transmission.radius:.6g} and {abs(part.ratio) * transmission.radius:.6g} m "
            f"with centres {distance:.6g} m apart",
            "centres farther apart",
        )


def _check_radius(label: str, radius: float, expected: float, why: str) -> None:
    """Raise `InputError` for a pitch radius that differs from `radius`, which ratio and centres give, by more than rounding."""
    if abs(radius - expected) > 1e-3 * expected:
        raise InputError(f"{label}: radius = {radius:.6g} m, but {why} {expected:.6g} m", "that pitch radius, or none")


@dataclass(frozen=True)
class SeparatingForce:
    """Force that separates two wheels along the line of centres, or a pinion from its rack; it does no work.

    It is negative if it pulls them together, as a belt does; `mechanics.body_maps.pressure` defines the tables.
    """

    kind: int  # GEARS, BELT or RACK
    first: BodyPoint  # Centre of the output's wheel, or of the pinion on a rack
    second: BodyPoint  # Centre of the input's wheel, or body of the rack, without a point
    per_force: float  # Separating force per unit force, or torque, on the output
    numbers: tuple[float, float]  # Sum of a belt's tensions [N] and distance of its centres [m]; 0 for teeth
    normal: Point = (0.0, 0.0)  # Normal from the rack to the pinion, in the frame of the rack


def separating_force_of(mechanism: Mechanism, part: Any) -> SeparatingForce | None:
    """Return the separating force of teeth or of a belt; None for a coupling without this force."""
    transmission = getattr(part, "transmission", None)
    if isinstance(transmission, Belt):
        centres = wheel_centre(mechanism, part, "output"), wheel_centre(mechanism, part, "input")
        centre_distance = abs(1.0 - part.ratio) * transmission.radius
        return SeparatingForce(BELT, *centres, 1.0 / transmission.radius, (2.0 * transmission.pretension, centre_distance))
    if not isinstance(transmission, Teeth) or transmission.pressure_angle == 0.0:
        return None
    slope = math.tan(transmission.pressure_angle)
    if not _is_rack(part):
        centres = wheel_centre(mechanism, part, "output"), wheel_centre(mechanism, part, "input")
        sense = 1.0 if part.ratio < 0.0 else -1.0  # the wheels of an internal gear are pressed together
        return SeparatingForce(GEARS, *centres, slope * sense * abs(1.0 - part.ratio), (0.0, 0.0))
    slides = isinstance(part.output, Slide)
    slide = part.output if slides else part.input
    pinion = wheel_centre(mechanism, part, "input" if slides else "output")
    along = direction_on(mechanism, slide)
    # the pitch point is at -ratio times the left normal of the direction, from the pinion's centre
    side = math.copysign(1.0, part.ratio)
    normal = -side * math.sin(along), side * math.cos(along)
    return SeparatingForce(RACK, pinion, (slide.point[0], ""), slope * (1.0 if slides else abs(part.ratio)), (0.0, 0.0), normal)
