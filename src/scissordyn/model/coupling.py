"""Coordinates of a mechanism: linear relations between them, and drives, which prescribe them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from scissordyn.components.place import GROUND, BodyPoint, Name
from scissordyn.components.time_function import ConstantSpeed, TimeFunction
from scissordyn.errors import InputError
from scissordyn.units import Meaning, Quantity, check_quantities, documented


@documented
@dataclass(frozen=True)
class RelativeAngle:
    """The angle of a body against another one or the ground, counted with its turns [rad]."""

    body: str
    base: str = GROUND

    def __post_init__(self) -> None:
        check_quantities(self, f"the angle of '{self.body}'")
        if self.body == self.base:
            raise InputError(f"the angle of '{self.body}' against itself", "two bodies, or a body and the ground")

    unit = "rad"

    @property
    def bodies(self) -> tuple[str, str]:
        """Body and base."""
        return self.body, self.base


@documented
@dataclass(frozen=True)
class Slide:
    """How far a point is displaced along a direction, from the origin of the base [m]."""

    point: BodyPoint
    direction: Annotated[float, Quantity("rad", help="direction of the slide in the frame of its base")] = 0.0
    base: str = GROUND

    def __post_init__(self) -> None:
        check_quantities(self, f"the slide of '{'.'.join(self.point)}'")
        if self.point[0] == self.base:
            raise InputError(f"the slide of a point of '{self.base}' against itself", "a point of another body")

    unit = "m"

    @property
    def bodies(self) -> tuple[str, str]:
        """Body of the point, and base."""
        return self.point[0], self.base


@documented
@dataclass(frozen=True)
class Distance:
    """The distance of two points, such as the length of a cylinder [m]."""

    start: BodyPoint
    end: BodyPoint

    def __post_init__(self) -> None:
        check_quantities(self, "a distance")
        if self.start[0] == self.end[0]:
            raise InputError(f"the distance of two points of '{self.start[0]}'", "points of two bodies")

    unit = "m"

    @property
    def bodies(self) -> tuple[str, str]:
        """Bodies of the end and of the start."""
        return self.end[0], self.start[0]


Coordinate = RelativeAngle | Slide | Distance


@documented
@dataclass(frozen=True)
class Coupling:
    """Keeps output = ratio * input + offset: gears, belts, racks, screws, synchronised units.

    It acts on both coordinates with forces or torques that do no work together. What a mesh or a belt presses on bearings
    beside its torque is not part of it.
    """

    name: Name
    output: Annotated[Coordinate, Meaning("a coordinate", 'RelativeAngle("wheel")')]
    input: Annotated[Coordinate, Meaning("a coordinate", 'RelativeAngle("wheel")')]
    ratio: Annotated[float, Quantity("1", help="ratio of output over input, in SI units")]
    offset: Annotated[float | None, Quantity("1", help="output where the input is zero, in SI units")] = None

    def __post_init__(self) -> None:
        check_quantities(self, f"coupling '{self.name}'")
        if self.ratio == 0.0:
            raise InputError(f"coupling '{self.name}' with ratio = 0", "a ratio that is not zero", "ratio = -0.5")
        if self.output == self.input:
            raise InputError(f"coupling '{self.name}' of a coordinate with itself", "two different coordinates")

    @property
    def terms(self) -> tuple[tuple[float, Coordinate], ...]:
        """Factors and coordinates whose sum it keeps."""
        return (1.0, self.output), (-self.ratio, self.input)


@documented
@dataclass(frozen=True)
class CoordinateDrive:
    """Prescribes a coordinate over time; the force or torque that does it follows."""

    name: Name
    coordinate: Annotated[Coordinate, Meaning("a coordinate", 'RelativeAngle("forearm", "arm")')]
    motion: Annotated[TimeFunction, Meaning("the coordinate over time", "ConstantSpeed(rpm(150))")]

    def __post_init__(self) -> None:
        check_quantities(self, f"drive '{self.name}'")
        if isinstance(self.motion, ConstantSpeed) and self.coordinate.unit == "m":
            raise InputError(
                f"drive '{self.name}': a ConstantSpeed of a distance", "another time function", "Polynomial((0.5, 0.1))"
            )

    @property
    def terms(self) -> tuple[tuple[float, Coordinate], ...]:
        """Factor and coordinate."""
        return ((1.0, self.coordinate),)


@documented
@dataclass(frozen=True)
class Drive:
    """A prescribed angle of a body; the driving torque follows from the motion."""

    body: Annotated[str, Meaning("the driven body")]
    motion: Annotated[TimeFunction, Meaning("the prescribed angle", "ConstantSpeed(rpm(150))")]

    def __post_init__(self) -> None:
        check_quantities(self, f"drive of '{self.body}'")
