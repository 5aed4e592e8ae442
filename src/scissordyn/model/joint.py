"""Joints between bodies: pins, guides and welds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from scissordyn.components.place import GROUND, BodyPoint, Name, Point, Reference
from scissordyn.components.port.declaration import Attachment, Ends, direction, place
from scissordyn.errors import InputError
from scissordyn.model.clearance import Clearance, GuideClearance
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
        """Vectors that the maps of its contact read: from bearing to journal, and the directions of rotating bodies."""
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
