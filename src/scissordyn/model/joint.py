"""Joints between bodies: pins, guides and welds."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

from scissordyn.components.place import GROUND, BodyPoint, Name, Point, Reference
from scissordyn.components.port.declaration import Attachment, Ends, direction, place
from scissordyn.errors import InputError
from scissordyn.model.body import Body
from scissordyn.model.clearance import Clearance, ContactPoint, GuideClearance
from scissordyn.units import Meaning, Quantity, check_quantities, documented


@documented
@dataclass(frozen=True)
class Revolute:
    """Pin between two bodies, ideal unless it has a clearance."""

    name: Annotated[str, Meaning("name; [[clearance]] refers to it")]
    journal: Annotated[BodyPoint, Meaning("the point that carries the journal")]
    bearing: Annotated[BodyPoint, Meaning("the point that carries the bearing")]
    clearance: Annotated[Clearance | None, Meaning("clearance of the joint", "Clearance(5e-4)")] = None

    def __post_init__(self) -> None:
        check_quantities(self, f"joint '{self.name}'")
        if self.journal[0] == self.bearing[0]:
            raise InputError(f"joint '{self.name}' joins body '{self.journal[0]}' to itself", "two different bodies")

    @property
    def bodies(self) -> tuple[str, str]:
        """Names of the two bodies."""
        return self.journal[0], self.bearing[0]

    @property
    def attachments(self) -> tuple[Attachment, ...]:
        """Vectors from which its contact force is computed: from bearing to journal, and the directions of both bodies."""
        ends = place(self.journal), place(self.bearing, -1.0)
        return (*ends, direction(2, self.journal[0]), direction(4, self.bearing[0]))

    @property
    def ends(self) -> Ends:
        """Points on which its contact acts, the journal first."""
        return self.journal, self.bearing


@documented
@dataclass(frozen=True)
class Guide:
    """Straight line, on the ground or on a moving body, that a point of another body follows.

    Point and direction of the line are in the frame of its body. An aligned follower is a block in a channel (a prismatic
    joint); any other follower rotates freely about its guided point. A clearance guide is a channel and stays aligned if made
    ideal.
    """

    name: Annotated[str, Meaning("name; [[guide_clearance]] refers to it")]
    follower: Annotated[BodyPoint, Meaning("the guided point")]
    through: Annotated[Point, Quantity("m", help="a point of the line")] = (0.0, 0.0)
    direction: Annotated[float, Quantity("rad", help="direction of the line")] = 0.0
    body: Annotated[str, Meaning("the body that carries the line")] = GROUND
    aligned: Annotated[bool, Meaning("whether the follower also keeps its angle to the line")] = False
    clearance: Annotated[GuideClearance | None, Meaning("clearance of the guide")] = None

    def __post_init__(self) -> None:
        check_quantities(self, f"guide '{self.name}'")
        if self.clearance is not None and not self.aligned:
            raise InputError(f"guide '{self.name}' has a clearance but is not aligned", "aligned = true")
        if self.follower[0] == self.body:
            raise InputError(f"guide '{self.name}' guides body '{self.body}' along itself", "two different bodies")
        if self.follower[0] == GROUND:
            raise InputError(
                f"guide '{self.name}' on body '{self.body}' guides a point of the '{GROUND}'", "a point of a body as follower"
            )

    def contact_points(self, follower: Body, follower_direction: float) -> tuple[ContactPoint, ...]:
        """Return the contact points of a guide with clearance; its direction is given in the frame of its follower [rad]."""
        name, clearance, guided = self.name, self.clearance, follower.points[self.follower[1]]
        assert clearance is not None
        radius = clearance.corner_radius
        centres = clearance.centres(guided, follower_direction)
        cos, sin = math.cos(follower_direction), math.sin(follower_direction)
        reach = [cos * (y - guided[1]) - sin * (x - guided[0]) for x, y in centres]
        if min(reach) >= 0.0 or max(reach) <= 0.0 or not all(reach):
            raise InputError(
                f"guide '{name}': its corners are {', '.join(f'{1e3 * far:g}' for far in reach)} mm to the left of its line",
                "corners on both sides of the guided point, and none on the line itself",
            )
        inside = -1.0 if clearance.around else 1.0  # side of the rounded corner, seen from the middle
        sides = {side: [abs(far) for far in reach if far * side > 0.0] for side in (1.0, -1.0)}
        nearest = {side: min(points) if clearance.around else max(points) for side, points in sides.items()}
        distances = {side: inside * far + radius + clearance.clearance for side, far in nearest.items()}
        if clearance.around and max(distances.values()) >= 0.0:
            raise InputError(
                f"guide '{name}': the corners of the ring leave {-2e3 * max(distances.values()):g} mm for the pole",
                "corners farther from the guided point, or a smaller clearance or corner radius",
            )
        points = []
        for number, (centre, far) in enumerate(zip(centres, reach, strict=True), start=1):
            side = math.copysign(1.0, far)
            towards = inside * side
            normal = -towards * math.sin(self.direction), towards * math.cos(self.direction)
            surface = self.body, self.through, normal, distances[side]
            points.append(ContactPoint(f"{name}/corner {number}", name, follower.name, centre, *surface, clearance))
        return tuple(points)


@documented
@dataclass(frozen=True)
class Weld:
    """Rigid connection: two points coincide, and the bodies keep the relative angle of the start."""

    name: Name
    start: Reference
    end: Reference

    def __post_init__(self) -> None:
        check_quantities(self, f"weld '{self.name}'")
        if self.start[0] == self.end[0]:
            raise InputError(f"weld '{self.name}' connects body '{self.start[0]}' to itself", "two different bodies")
