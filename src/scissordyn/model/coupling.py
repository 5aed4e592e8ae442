"""Coordinates of a mechanism, linear relations between them, and drives that prescribe them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Literal, get_args

from scissordyn.annotation import shown
from scissordyn.components.place import GROUND, BodyPoint, Name
from scissordyn.components.time_function import ConstantSpeed, TimeFunction
from scissordyn.errors import InputError
from scissordyn.units import Meaning, Quantity, check_quantities, documented


@documented
@dataclass(frozen=True)
class RelativeAngle:
    """Angle of a body relative to another body or the ground, including full turns [rad]."""

    body: str
    base: str = GROUND

    def __post_init__(self) -> None:
        check_quantities(self, f"the angle of '{self.body}'")
        if self.body == self.base:
            raise InputError(f"the angle of '{self.body}' relative to itself", "two bodies, or a body and the ground")

    unit = "rad"

    @property
    def bodies(self) -> tuple[str, str]:
        """Body and base."""
        return self.body, self.base


@documented
@dataclass(frozen=True)
class Slide:
    """Displacement of a point along a direction, from the origin of the base [m]."""

    point: BodyPoint
    direction: Annotated[float, Quantity("rad", help="direction of the slide in the frame of its base")] = 0.0
    base: str = GROUND

    def __post_init__(self) -> None:
        named = isinstance(self.point, tuple) and all(isinstance(name, str) for name in self.point)
        check_quantities(self, f"the slide of '{'.'.join(self.point) if named else shown(self.point)}'")
        if self.point[0] == self.base:
            raise InputError(f"the slide of a point of '{self.base}' relative to its own body", "a point of another body")

    unit = "m"

    @property
    def bodies(self) -> tuple[str, str]:
        """Body of the point, and base."""
        return self.point[0], self.base


@documented
@dataclass(frozen=True)
class Distance:
    """Distance between two points, such as the length of a cylinder [m]."""

    start: BodyPoint
    end: BodyPoint

    def __post_init__(self) -> None:
        check_quantities(self, "a distance")
        if self.start[0] == self.end[0]:
            raise InputError(f"the distance between two points of body '{self.start[0]}'", "points of two bodies")

    unit = "m"

    @property
    def bodies(self) -> tuple[str, str]:
        """Bodies of the end and of the start."""
        return self.end[0], self.start[0]


Coordinate = RelativeAngle | Slide | Distance


# Help text of the parameters `output_centre` and `input_centre` of teeth
CENTRE_MEANING = Meaning("point of the wheel's body at its centre; by default that of its bearing")

# [rad] largest operating pressure angle of gear teeth; usual gears have less than half of it
PRESSURE_ANGLE_MAX = math.radians(60.0)
STANDARD_PRESSURE_ANGLE = math.radians(20.0)  # [rad] default pressure angle of gear teeth, that of ISO 53:1998


Flank = Literal["", "forward", "backward"]


@documented
@dataclass(frozen=True)
class Teeth:
    """Teeth of two gears, or of a pinion and a rack; the force acts at the pitch point, along the pressure line.

    The pitch radii follow from the ratio and the distance of the centres; that of a pinion on a rack follows from the ratio.
    The force has the component T/r along the path of the teeth, and T/r tan(a) across it, which presses external gears apart
    on either flank. If the centres can move, because a bearing has clearance or a bar bends, the force across the path also
    turns the wheels. The loaded flank must then be given.
    """

    pressure_angle: Annotated[
        float, Quantity("rad", minimum=0.0, maximum=PRESSURE_ANGLE_MAX, help="operating pressure angle")
    ] = STANDARD_PRESSURE_ANGLE
    radius: Annotated[
        float | None, Quantity("m", above=0.0, help="pitch radius of the output's wheel, checked against the centres")
    ] = None
    flank: Annotated[Flank, Meaning("loaded flank: sense in which it pushes the output")] = ""
    output_centre: Annotated[str, CENTRE_MEANING] = ""
    input_centre: Annotated[str, CENTRE_MEANING] = ""

    def __post_init__(self) -> None:
        check_quantities(self, "teeth")
        if self.flank not in get_args(Flank):
            raise InputError(f"teeth: flank = {self.flank!r}", '"forward" or "backward"', 'flank="forward"')

    @property
    def sense(self) -> float:
        """1 if the loaded flank pushes the output forward, -1 if backward, 0 if no flank is given."""
        return {"forward": 1.0, "backward": -1.0}.get(self.flank, 0.0)


@documented
@dataclass(frozen=True)
class Belt:
    """Belt or chain over two pulleys; the tight span pulls by T/r more than the slack one.

    The belt is open for a positive ratio and crossed for a negative one. A span that would push is slack.
    """

    radius: Annotated[float, Quantity("m", above=0.0, help="pitch radius of the output's pulley")]
    pretension: Annotated[float, Quantity("N", minimum=0.0, help="tension of each span at zero torque")] = 0.0
    output_centre: Annotated[str, CENTRE_MEANING] = ""
    input_centre: Annotated[str, CENTRE_MEANING] = ""

    def __post_init__(self) -> None:
        check_quantities(self, "a belt")


@documented
@dataclass(frozen=True)
class Screw:
    """Screw: the thrust on the nut acts back on the turning body at its thrust bearing, not on the base."""

    centre: Annotated[str, Meaning("point of the turning body at its thrust bearing; by default that of its bearing")] = ""


Transmission = Teeth | Belt | Screw


@documented
@dataclass(frozen=True)
class FurtherInput:
    """Further input of a coupling, such as the length of the next span of a tendon, with its ratio."""

    coordinate: Annotated[Coordinate, Meaning("a coordinate", 'Distance(("ground", "P"), ("block", "pulley"))')]
    ratio: Annotated[float, Quantity("1", help="ratio of output over this input, in SI units")]

    def __post_init__(self) -> None:
        check_quantities(self, "a further input")
        if self.ratio == 0.0:
            raise InputError("a further input with ratio = 0", "a ratio that is not zero", "ratio = -1")


@documented
@dataclass(frozen=True)
class Coupling:
    """Relation output = ratio * input + offset between two coordinates: gears, belts, racks, screws, synchronised units.

    Products of further inputs and their ratios add to the output, as the spans of a tendon over pulleys of negligible radius,
    or its joint angles. The relation holds both ways: a tendon may also push.

    It acts on both coordinates with forces or torques that do no work together. Its `transmission` determines where the force
    acts. Without one, the coupling relates coordinates only, and bearings carry only its torques.
    """

    name: Name
    output: Annotated[Coordinate, Meaning("a coordinate", 'RelativeAngle("wheel")')]
    input: Annotated[Coordinate, Meaning("a coordinate", 'RelativeAngle("wheel")')]
    ratio: Annotated[float, Quantity("1", help="ratio of output over input, in SI units")]
    offset: Annotated[float | None, Quantity("1", help="output at zero input, in SI units")] = None
    transmission: Annotated[
        Transmission | None, Meaning("teeth, a belt or a screw that transmit the force", "Teeth(degrees(20))")
    ] = None
    further: Annotated[
        tuple[FurtherInput, ...], Meaning("further inputs with their ratios", 'FurtherInput(RelativeAngle("wheel"), -1.0)')
    ] = ()

    def __post_init__(self) -> None:
        check_quantities(self, f"coupling '{self.name}'")
        if self.ratio == 0.0:
            raise InputError(f"coupling '{self.name}': ratio = 0", "a ratio that is not zero", "ratio = -0.5")
        coordinates = [coordinate for _, coordinate in self.terms]
        if any(coordinate in coordinates[:k] for k, coordinate in enumerate(coordinates)):
            raise InputError(f"coupling '{self.name}' relates a coordinate to itself", "different coordinates")
        if self.further and self.transmission is not None:
            what = f"coupling '{self.name}': further inputs of teeth, a belt or a screw"
            raise InputError(what, "one input, or no teeth, belt and screw")
        self._check_transmission()

    def _check_transmission(self) -> None:
        """Raise `InputError` for teeth, a belt or a screw between coordinates that they cannot connect."""
        if self.transmission is None:
            return
        ends = self.output, self.input
        angles, distances = ([isinstance(end, kind) for end in ends] for kind in (RelativeAngle, Distance))
        fits, allowed = {
            Teeth: (any(angles) and not any(distances), "two angles, or an angle and a slide"),
            Belt: (all(angles), "two angles"),
            Screw: (any(angles) and not all(angles), "an angle, and a slide or a distance"),
        }[type(self.transmission)]
        label = f"coupling '{self.name}': {type(self.transmission).__name__.lower()}"
        if not fits:
            raise InputError(f"{label} cannot connect these coordinates", allowed)
        bases = {end.base for end in ends if not isinstance(end, Distance)}
        if len(bases) > 1:
            raise InputError(f"{label} connects coordinates with the bases {' and '.join(sorted(bases))}", "one base")
        if all(angles) and self.ratio == 1.0 and isinstance(self.transmission, Teeth):
            raise InputError(f"{label} with ratio = 1", "a negative ratio, or a belt")

    @property
    def terms(self) -> tuple[tuple[float, Coordinate], ...]:
        """Factors and coordinates whose weighted sum is constant."""
        return (1.0, self.output), (-self.ratio, self.input), *((-part.ratio, part.coordinate) for part in self.further)


@documented
@dataclass(frozen=True)
class CoordinateDrive:
    """Prescribed motion of a coordinate; the required force or torque follows."""

    name: Name
    coordinate: Annotated[Coordinate, Meaning("a coordinate", 'RelativeAngle("forearm", "arm")')]
    motion: Annotated[TimeFunction, Meaning("the coordinate over time", "ConstantSpeed(rpm(150))")]

    def __post_init__(self) -> None:
        check_quantities(self, f"drive '{self.name}'")
        if isinstance(self.motion, ConstantSpeed) and self.coordinate.unit == "m":
            raise InputError(
                f"drive '{self.name}': a ConstantSpeed is an angular velocity and cannot prescribe a length",
                "another time function",
                "Polynomial((0.5, 0.1))",
            )

    @property
    def terms(self) -> tuple[tuple[float, Coordinate], ...]:
        """Driven coordinate with a factor of one, as `Coupling.terms` of the two coordinates of a coupling."""
        return ((1.0, self.coordinate),)


@documented
@dataclass(frozen=True)
class Drive:
    """Prescribed angle of a body; the driving torque follows from the motion."""

    body: Annotated[str, Meaning("the driven body")]
    motion: Annotated[TimeFunction, Meaning("the prescribed angle", "ConstantSpeed(rpm(150))")]

    def __post_init__(self) -> None:
        check_quantities(self, f"drive of '{self.body}'")
