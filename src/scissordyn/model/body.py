"""Rigid bodies, bars, point masses, and tracked points."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Annotated

from scissordyn.components.place import GROUND, Point
from scissordyn.errors import InputError
from scissordyn.units import Meaning, Quantity, check_quantities, checked, documented


def check_place(label: str, place: Point) -> None:
    """Raise `InputError` for a position that is not finite or is outside the bounds of `POSITION`."""
    if not all(POSITION.admits(x) for x in place):
        raise InputError(f"{label} = {place!r}", f"two numbers {POSITION.bounds}")


POSITION = Quantity("m")  # Unit and bounds of a coordinate of a position


@documented
@dataclass(frozen=True)
class Body:
    """Rigid body with named points in its own frame and an initial guess of its position.

    A body without inertia does not rotate: it is a point mass, or a block aligned by its guide. A position, angle or velocity
    of None follows from the other bodies; its initial guess is (0, 0), 0 and rest.
    """

    name: Annotated[str, Meaning("name, unique in the mechanism")]
    mass: Annotated[float, Quantity("kg", above=0.0, help="mass")]
    inertia: Annotated[float | None, Quantity("kg m^2", above=0.0, help="moment of inertia about the mass centre")]
    points: Annotated[Mapping[str, Point], Meaning("points that joints refer to")] = field(default_factory=dict, hash=False)
    centre: Annotated[Point, Quantity("m", help="mass centre in the body's frame")] = (0.0, 0.0)
    position: Annotated[Point | None, Quantity("m", help="initial position of the frame's origin, or it follows")] = None
    angle: Annotated[float | None, Quantity("rad", help="direction at the start")] = None
    velocity: Annotated[Point | None, Quantity("m/s", help="initial velocity of the origin, or it follows")] = None
    angular_velocity: Annotated[float | None, Quantity("rad/s", help="angular velocity at the start")] = None
    payloads: Annotated[
        tuple[float, ...],
        Quantity("kg", above=0.0, help='masses at its points "payload", which its mass includes', tied="the mass of the body"),
    ] = ()

    def __post_init__(self) -> None:
        check_quantities(self, f"body '{self.name}'")
        if self.name == GROUND or not self.name:
            raise InputError(f"body name {self.name!r}", f"any name but '' and '{GROUND}'")
        for label, place in self.points.items():
            check_place(f"body '{self.name}': {label}", place)
        if self.inertia is None and self.angular_velocity:
            raise InputError(
                f"body '{self.name}': angular_velocity = {self.angular_velocity:g} rad/s, but the body does not rotate",
                "an inertia, or no angular_velocity",
            )

    @property
    def placed_position(self) -> Point:
        """Initial guess of the origin's position [m]."""
        return (0.0, 0.0) if self.position is None else self.position

    @property
    def placed_angle(self) -> float:
        """Initial guess of the angle [rad]."""
        return 0.0 if self.angle is None else self.angle

    def velocity_at(self, offset: Point) -> Point | None:
        """Return the given velocity at an offset from the origin in the fixed frame [m/s]; None if it is not given."""
        if self.velocity is None or offset == (0.0, 0.0):
            return self.velocity
        if self.angular_velocity is None:
            return None
        return self.velocity[0] - self.angular_velocity * offset[1], self.velocity[1] + self.angular_velocity * offset[0]

    @cached_property
    def rotates(self) -> bool:
        """True if the body has an inertia and therefore rotates."""
        return self.inertia is not None

    @cached_property
    def extent(self) -> float:
        """Largest distance of a point from the origin, at least the radius of gyration [m]."""
        gyration = math.sqrt((self.inertia or 0.0) / self.mass)
        return max([math.hypot(*point) for point in (self.centre, *self.points.values())] + [gyration])

    def turned(self, offset: Point) -> Point:
        """Return a vector, given in the body's frame, in the fixed frame at the start [m]."""
        (x, y), cos, sin = offset, math.cos(self.placed_angle), math.sin(self.placed_angle)
        return cos * x - sin * y, sin * x + cos * y

    def place(self, point: str) -> Point:
        """Return the position of a named point at the start [m]."""
        x, y = self.points[point]
        (ox, oy), cos, sin = self.placed_position, math.cos(self.placed_angle), math.sin(self.placed_angle)
        return ox + cos * x - sin * y, oy + sin * x + cos * y


def bar_points(length: float) -> dict[str, Point]:
    """Return the points of a straight bar in its frame [m]."""
    return {"start": (0.0, 0.0), "middle": (0.5 * length, 0.0), "end": (length, 0.0)}


def uniform_inertia(length: float, mass: float) -> float:
    """Return the moment of inertia of a uniform bar about its middle [kg m^2]."""
    return mass * length**2 / 12.0


def uniform_legs(mass: float, lengths: Sequence[float], middles: Sequence[Point]) -> tuple[Point, float]:
    """Return the mass centre [m] of straight legs of one mass per length, and their inertia about it [kg m^2] (Steiner)."""
    shares = [length / sum(lengths) for length in lengths]
    x, y = (sum(share * middle[axis] for share, middle in zip(shares, middles, strict=True)) for axis in (0, 1))
    legs = zip(shares, lengths, middles, strict=True)
    return (x, y), mass * sum(share * (length**2 / 12.0 + math.dist(middle, (x, y)) ** 2) for share, length, middle in legs)


@documented
@checked
def bar(
    name: str,
    *,
    length: Annotated[float, Quantity("m", above=0.0, help="length")],
    mass: Annotated[float, Quantity("kg", above=0.0, help="mass")],
    position: Annotated[Point | None, Meaning("position of its start [m]")] = None,
    angle: Annotated[float | None, Quantity("rad", help="direction from start to end")] = None,
    inertia: Annotated[
        float | None, Quantity("kg m^2", above=0.0, help="inertia about its middle; m L^2/12 if not given")
    ] = None,
) -> Body:
    """Return a straight bar with points "start", "middle" and "end"; uniform unless its inertia is given."""
    points = bar_points(length)
    return Body(
        name=name,
        mass=mass,
        inertia=uniform_inertia(length, mass) if inertia is None else inertia,
        points=points,
        centre=points["middle"],
        position=position,
        angle=angle,
    )


def point_mass(name: str, *, mass: float, position: Point | None = None) -> Body:
    """Return a body without rotation and with one point, "centre"."""
    return Body(name=name, mass=mass, inertia=None, points={"centre": (0.0, 0.0)}, position=position)


@documented
@dataclass(frozen=True)
class Track:
    """Point of a body whose position, velocity, acceleration and deviation from the commanded path are recorded."""

    name: Annotated[str, Meaning("name of the tracked point")]
    body: Annotated[str, Meaning("the body")]
    point: Annotated[str | Point, Meaning('a point of the body, or a position in its frame such as "1.2, 0 m"')]
    tolerance: Annotated[float | None, Quantity("m", above=0.0, help="deviation within which the point has settled")] = None

    def __post_init__(self) -> None:
        check_quantities(self, f"tracked point {self.name!r}")
        if not self.name or not isinstance(self.name, str):
            raise InputError(f"tracked point {self.name!r}", "a name that is not empty")
        if not isinstance(self.point, str):
            object.__setattr__(self, "point", tuple(self.point))
