"""Joints between bodies, and guides."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from scissordyn.component.place import GROUND, BodyPoint, Point
from scissordyn.component.port.contact import journal_attachments, journal_ends
from scissordyn.component.port.declaration import Attachment, Ends
from scissordyn.errors import InputError
from scissordyn.model.clearance import Clearance
from scissordyn.model.guide_clearance import GuideClearance
from scissordyn.units import Meaning, Quantity, check_quantities


@dataclass(frozen=True)
class Revolute:
    """A pin between two bodies, ideal unless it has a clearance.

    Parameters
    ----------
    name : str
    journal : (str, str)
        Body and point that carry the journal.
    bearing : (str, str)
        Body and point that carry the bearing.
    clearance : Clearance, optional
        Of the joint; None for an ideal one.
    """

    name: str
    journal: BodyPoint
    bearing: BodyPoint
    clearance: Annotated[Clearance | None, Meaning("of the joint", "Clearance(5e-4)")] = None

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
        """What the maps of its contact read, with clearance."""
        return journal_attachments(self)

    @property
    def ends(self) -> Ends:
        """What its contact acts on."""
        return journal_ends(self)


@dataclass(frozen=True)
class Guide:
    """A straight line, on the ground or on a moving body, that keeps a point of a body on it.

    Parameters
    ----------
    name : str
    follower : (str, str)
        Body and point that are guided.
    through : (float, float)
        A point of the line, in the frame of its body [m].
    direction : float
        Direction of the line in that frame [rad].
    body : str
        The body that carries the line; the ground unless given.
    aligned : bool
        Whether the follower also keeps its angle against the line, as a block in a channel does (a prismatic joint); otherwise
        it rotates freely about its guided point.
    clearance : GuideClearance, optional
        Of the guide; None for an ideal one. A clearance guide is a channel, so `aligned` is true for it, also when it is made
        ideal.
    """

    name: str
    follower: BodyPoint
    through: Annotated[Point, Quantity("m", help="a point of the line")] = (0.0, 0.0)
    direction: Annotated[float, Quantity("rad", help="direction of the line")] = 0.0
    body: str = GROUND
    aligned: bool = False
    clearance: GuideClearance | None = None

    def __post_init__(self) -> None:
        check_quantities(self, f"guide '{self.name}'")
        if self.clearance is not None and not self.aligned:
            raise InputError(f"guide '{self.name}' with a clearance but not aligned", "a clearance guide that is aligned")
        if self.follower[0] == self.body:
            raise InputError(f"guide '{self.name}' guides body '{self.body}' along itself", "two different bodies")
        if self.follower[0] == GROUND:
            raise InputError(
                f"guide '{self.name}' on body '{self.body}' guides a point of the '{GROUND}'", "a point of a body as follower"
            )
