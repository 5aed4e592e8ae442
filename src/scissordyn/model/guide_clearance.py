"""The clearance of a straight guide, and the contact of its block with the guide surfaces."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Annotated

from scissordyn.component.place import Point
from scissordyn.component.port.declaration import Attachment, Ends, direction, frame, place
from scissordyn.errors import InputError
from scissordyn.laws.contact import Damping, Elastic, Friction, JointContact
from scissordyn.laws.damping.factors import Flores
from scissordyn.laws.elastic.hertz import Hertz
from scissordyn.laws.friction.none import NoFriction
from scissordyn.laws.material import STEEL, Material
from scissordyn.model.body import Body, check_place
from scissordyn.model.clearance import ContactKind, check_hard
from scissordyn.units import Meaning, Quantity, check_quantities, documented


@documented
@dataclass(frozen=True)
class GuideClearance:
    """A clearance guide: a block in a wider channel, whose rounded corners make contact with the two guide surfaces.

    The clearance is c = (H - W)/2 with H the width of the channel and W that of the block (Flores, Ambrosio, Claro and
    Lankarani 2008, doi:10.1115/1.2802113). A rectangular block is centred on the guided point and straight at the start. Given
    corners are in the follower's frame; one to the left of the guided point, seen along the guide, faces the left guide
    surface, and each surface has the distance c from the nearest corners that face it. Around a pole each corner faces the
    surface on its own side of it from outside. Elastic laws are those with parameters at a plane surface: hertz, braendlein,
    power, linear, or of your own. Hard contact is as in a `Clearance`.
    """

    clearance: Annotated[float, Quantity("m", above=0.0, help="gap on either side of the centred block, (H - W)/2")]
    length: Annotated[float | None, Quantity("m", above=0.0, help="of the block, along the guide")] = None
    width: Annotated[float | None, Quantity("m", above=0.0, help="of the block, across the guide")] = None
    corners: Annotated[tuple[Point, ...], Meaning("in place of length and width: centres of rounded corners")] = ()
    corner_radius: Annotated[float, Quantity("m", above=0.0, help="radius of the block's corners")] = 1e-3
    around: Annotated[bool, Meaning("whether the follower surrounds the guide, as a ring does a pole")] = False
    thickness: Annotated[float, Quantity("m", above=0.0, help="length of the corners' edges")] = 15e-3
    material: Annotated[Material, Meaning("of the block, and of the guide unless that is given", "STEEL")] = STEEL
    guide_material: Annotated[Material | None, Meaning("of the guide")] = None
    stiffness: Annotated[Elastic, Meaning("an elastic law", "Hertz()")] = field(default_factory=Hertz)
    damping: Annotated[Damping, Meaning("a damping law", "Flores(restitution=0.9)")] = field(default_factory=Flores)
    friction: Annotated[Friction, Meaning("a friction law", "Ambrosio(kinetic=0.1)")] = field(default_factory=NoFriction)
    contact: ContactKind = "compliant"

    def __post_init__(self) -> None:
        check_quantities(self)
        if self.corners:
            if self.length is not None or self.width is not None:
                raise InputError("corners of a block beside its length or width", "either corners, or length and width")
            for point in self.corners:
                check_place("corner", point)
        elif self.length is None or self.width is None:
            raise InputError("a clearance guide without the size of its block", "length and width, or corners")
        elif 2.0 * self.corner_radius > min(self.length, self.width):
            raise InputError(
                f"corner_radius = {self.corner_radius:g} m on a block of {self.length:g} m by {self.width:g} m",
                f"at most {0.5 * min(self.length, self.width):g} m",
            )
        self._check_stiffness()
        check_hard(self)

    def _check_stiffness(self) -> None:
        """Raise `InputError` for a law without finite parameters at infinite bearing radius."""
        try:
            numbers = self.stiffness.parameters(self.surfaces)
        except (ArithmeticError, InputError):
            numbers = (math.nan,)
        if not all(math.isfinite(number) for number in numbers):
            raise InputError(
                f"stiffness '{self.stiffness.name}' in a clearance guide: it is for a journal in a bearing, and its formula "
                "has no value for a contact point at a plane guide surface",
                "hertz, braendlein, power, linear or a user-defined function",
            )

    @property
    def surfaces(self) -> JointContact:
        """A rounded corner and its guide surface, as input of the laws."""
        return JointContact(
            clearance=math.inf,
            journal_radius=self.corner_radius,
            length=self.thickness,
            journal=self.material,
            bearing=self.material if self.guide_material is None else self.guide_material,
            gap=self.clearance,
        )

    def centres(self, guided: Point, direction: float) -> tuple[Point, ...]:
        """Centres of the corners in the follower's frame [m].

        Parameters
        ----------
        guided : (float, float)
            The guided point in that frame [m].
        direction : float
            Direction of the guide in that frame at the start [rad].

        Returns
        -------
        tuple of (float, float)
        """
        if self.length is None or self.width is None:
            return self.corners
        half, side = 0.5 * self.length - self.corner_radius, 0.5 * self.width - self.corner_radius
        cos, sin = math.cos(direction), math.sin(direction)
        ends = ((-half, -side), (half, -side), (half, side), (-half, side))
        return tuple((guided[0] + cos * x - sin * y, guided[1] + sin * x + cos * y) for x, y in ends)


@dataclass(frozen=True)
class ContactPoint:
    """A contact point of a clearance guide: a rounded corner of the block and the guide surface that it faces."""

    name: str  # "GUIDE/corner 1", "GUIDE/corner 2",
    guide: str  # Name of the guide
    follower: str  # The body that the corner belongs to
    centre: Point  # Centre of the corner's arc, in the follower's frame [m]
    body: str  # The body that carries the guide, or the ground
    through: Point  # A point of the guide's line, in the frame of that body [m]
    normal: Point  # Unit vector across the guide from the corner towards the guide surface, in that frame
    # Of the guide surface from the guide's line along the normal [m]; negative for a pole, which a ring meets from outside
    distance: float
    clearance: GuideClearance

    @property
    def attachments(self) -> tuple[Attachment, ...]:
        """From the guide's line to the centre of the corner's arc, the block's direction, and that of the guide's frame."""
        ends = place((self.follower, self.centre)), place((self.body, self.through), -1.0)
        return (*ends, direction(2, self.follower), frame(4, self.body))

    @property
    def ends(self) -> Ends:
        """The contact force acts on the block."""
        return (self.follower, self.centre), (self.body, self.through)


def block_contact_points(
    name: str,
    clearance: GuideClearance,
    *,
    follower: Body,
    point: str,
    body: str,
    through: Point,
    direction: float,
    follower_direction: float,
) -> tuple[ContactPoint, ...]:
    guided, radius = follower.points[point], clearance.corner_radius
    centres = clearance.centres(guided, follower_direction)
    cos, sin = math.cos(follower_direction), math.sin(follower_direction)
    reach = [cos * (y - guided[1]) - sin * (x - guided[0]) for x, y in centres]
    if min(reach) >= 0.0 or max(reach) <= 0.0 or not all(reach):
        raise InputError(
            f"guide '{name}': corners {', '.join(f'{1e3 * far:g}' for far in reach)} mm to the left of its line",
            "corners on both sides of the guided point, and none on the line itself",
        )
    inside = -1.0 if clearance.around else 1.0  # where the rounded corner is, seen from the middle
    sides = {side: [abs(far) for far in reach if far * side > 0.0] for side in (1.0, -1.0)}
    nearest = {side: min(points) if clearance.around else max(points) for side, points in sides.items()}
    distances = {side: inside * far + radius + clearance.clearance for side, far in nearest.items()}
    if clearance.around and max(distances.values()) >= 0.0:
        raise InputError(
            f"guide '{name}': a ring whose corners leave {-2e3 * max(distances.values()):g} mm for the pole",
            "corners farther from the guided point, or a smaller clearance or corner radius",
        )
    points = []
    for number, (centre, far) in enumerate(zip(centres, reach, strict=True), start=1):
        side = math.copysign(1.0, far)
        towards = inside * side
        normal = -towards * math.sin(direction), towards * math.cos(direction)
        label = f"{name}/corner {number}"
        points.append(ContactPoint(label, name, follower.name, centre, body, through, normal, distances[side], clearance))
    return tuple(points)
