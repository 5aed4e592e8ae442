"""Contact of a disc or point of one body with a straight edge, a bar or a disc of another body."""

from __future__ import annotations

import math
from dataclasses import field, replace
from functools import partial
from typing import Annotated

import numpy as np

from scissordyn.components.declaration import TEXTBOOK, component
from scissordyn.components.place import BodyPoint
from scissordyn.components.port import FRAME
from scissordyn.components.port.stroke import arc
from scissordyn.components.stop import START_DEPTH_FRACTION
from scissordyn.errors import InputError
from scissordyn.kernel import kernel
from scissordyn.laws.contact import Damping, Elastic, Friction, JointContact
from scissordyn.laws.damping.factors import Flores
from scissordyn.laws.elastic.power_law import PowerLaw
from scissordyn.laws.evaluate import elastic_force, friction_limit
from scissordyn.laws.friction.coulomb import Coulomb
from scissordyn.laws.friction.none import NoFriction
from scissordyn.laws.material import STEEL, Material
from scissordyn.plugin.element import numbers, pointers, row_of
from scissordyn.units import Meaning, Quantity

UNLIMITED = -1.0  # Value of the kernel parameter `length` [m] for an edge without ends


@kernel
def distance(x, y, along_x, along_y, length):
    """Return the distance of a point from the edge [m], and the unit vector from the edge towards the point.

    An edge without ends bounds a half plane on its right; the distance of a point in it is negative.
    """
    if length < 0.0:
        return along_x * y - along_y * x, -along_y, along_x
    place = min(length, max(0.0, along_x * x + along_y * y))
    dx, dy = x - place * along_x, y - place * along_y
    far = math.sqrt(dx * dx + dy * dy)
    return (far, dx / far, dy / far) if far > 0.0 else (0.0, -along_y, along_x)


@kernel
def indentation(x, y, x_rate, y_rate, reach, length, along_x, along_y):
    """Return the indentation [m], its rate [m/s], and the unit vector from the edge towards the disc."""
    far, nx, ny = distance(x, y, along_x, along_y, length)
    return reach - far, -(nx * x_rate + ny * y_rate), nx, ny


@kernel
def gap(x, y, angle, x_rate, y_rate, speed, radius, reach, length, along_x, along_y):
    """Return the indentation [m], its rate, and the slip speed of the disc's nearest point, to the left of the normal [m/s]."""
    depth, rate, nx, ny = indentation(x, y, x_rate, y_rate, reach, length, along_x, along_y)
    return depth, rate, nx * y_rate - ny * x_rate - radius * speed


@kernel
def force(x, y, normal, tangential, radius, reach, length, along_x, along_y):
    """Return the force on the disc [N] and its torque [N m]."""
    _, nx, ny = distance(x, y, along_x, along_y, length)
    return normal * nx + tangential * ny, normal * ny - tangential * nx, radius * tangential


@component(
    port=FRAME,
    force=force,
    gap=gap,
    contact=True,
    context=("normal", "tangential"),
    symbol="edge",
    example={
        "start": "ground.O",
        "end": "rod.end",
        "direction": "-90 deg",
        "radius": "20 mm",
        "stiffness": {"law": "power", "coefficient": 1e6},
        "friction": {"law": "coulomb", "kinetic": 0.2},
        "edge_material": "steel",
    },
    source=TEXTBOOK,
)
class EdgeContact:
    r"""Contact of a disc or point with a straight edge: a floor, the side of a bar, or the rim of another disc.

    .. math:: \delta = R + w - d

    d is the distance of the disc's centre from the axis of the edge. An edge of given length has round ends of radius w and two
    sides, as a bar has; of length 0 it is a disc. Without a length it has no ends, and everything on its right is solid.
    Both bodies are pushed at the same point.

    The laws are those of clearance joints with a plane surface. They get the radius of a ball on a plane with the same
    curvature: that of the disc, or R w/(R + w) at another disc. A point has the radius w of the edge's ends. A point at an
    edge without width needs a stiffness law that does not depend on a radius. Damping refers to the approach speed, or to
    more in a contact that is loaded later. A friction law with internal states holds at rest.
    """

    name: str
    start: Annotated[BodyPoint, Meaning("a point of the edge's axis, its beginning if it has a length")]
    end: Annotated[BodyPoint, Meaning("centre of the disc, or the point")]
    direction: Annotated[
        float, Quantity("rad", minimum=-1e4, maximum=1e4, help="direction of the edge in the frame of its body")
    ] = 0.0
    length: Annotated[
        float | None, Quantity("m", minimum=0.0, maximum=1e4, help="length of the edge's axis; no ends if it is not given")
    ] = None
    half_width: Annotated[float, Quantity("m", minimum=0.0, maximum=1e3, help="half the width w of the bar with the edge")] = (
        0.0
    )
    radius: Annotated[float, Quantity("m", minimum=0.0, maximum=1e3, help="radius R of the disc, 0 for a point")] = 0.0
    stiffness: Annotated[Elastic, Meaning("elastic part of the normal force", "Hertz()")] = field(
        default_factory=partial(PowerLaw, 1e8)
    )
    damping: Annotated[Damping, Meaning("damping part of the normal force", "Flores(restitution=0.5)")] = field(
        default_factory=partial(Flores, 0.5)
    )
    friction: Annotated[Friction, Meaning("friction law; one with internal states holds at rest", "Coulomb(kinetic=0.2)")] = (
        field(default_factory=NoFriction)
    )
    thickness: Annotated[float, Quantity("m", above=0.0, help="length of the contact, normal to the plane of motion")] = 15e-3
    material: Annotated[Material, Meaning("material of the disc; of the edge too, unless that is given", "STEEL")] = STEEL
    edge_material: Annotated[Material | None, Meaning("material of the edge")] = None

    def check(self) -> None:
        if self.length is not None and self.reach == 0.0:
            raise InputError(f"edge_contact '{self.name}': a point and an edge without width", "radius or half_width above 0")

    @property
    def surfaces(self) -> JointContact:
        """Both surfaces, for the contact laws: a ball of the same relative curvature on a plane."""
        disc, edge = self.radius, self.half_width
        radius = disc * edge / (disc + edge) if self.length == 0.0 and disc * edge > 0.0 else disc or edge
        bearing = self.material if self.edge_material is None else self.edge_material
        return JointContact(math.inf, radius, self.thickness, self.material, bearing)

    def without_bristles(self) -> EdgeContact:
        """Return the contact with Coulomb friction of the largest coefficient, which replaces its friction at rest."""
        if isinstance(self.friction, NoFriction):
            return self
        row = row_of(self.friction, self.surfaces)
        largest = friction_limit(pointers(self.friction)["limit"], 0.0, 1.0, row)
        if not math.isfinite(largest):
            raise InputError(
                f"edge_contact '{self.name}': friction law '{self.friction.name}' has no static limit, which equilibria need",
                "a law with a kernel `limit`",
                'friction = "none"',
            )
        return replace(self, friction=Coulomb(largest))

    @property
    def reach(self) -> float:
        """Distance of the disc's centre from the edge's axis at the touch [m]."""
        return self.radius + self.half_width

    def parameters(self, start: tuple[float, ...]) -> tuple[float, ...]:
        """Return the kernel's parameters; raise `InputError` for a start in the edge, or a law without finite parameters."""
        self._check_stiffness()
        along = math.cos(self.direction), math.sin(self.direction)
        length = UNLIMITED if self.length is None else self.length
        far = float(distance(start[0], start[1], *along, length)[0])
        if self.reach > 0.0 and self.reach - far > START_DEPTH_FRACTION * self.reach:
            raise InputError(
                f"edge_contact '{self.name}': the disc starts {1e3 * (self.reach - far):.4g} mm deep in the edge",
                f"its centre at least {1e3 * self.reach:.4g} mm from the edge's axis, on the left of an edge without ends",
            )
        return numbers(self, reach=self.reach, length=length, along_x=along[0], along_y=along[1])

    def _check_stiffness(self) -> None:
        """Raise `InputError` for a stiffness law that has no force on a plane surface, or none for a point."""
        try:
            row = row_of(self.stiffness, self.surfaces)
            force = elastic_force(pointers(self.stiffness)["force"], self.reach or 1.0, row)
        except (ArithmeticError, InputError):
            force = math.nan
        if not 0.0 < force < math.inf:
            at = f"a radius of {self.surfaces.journal_radius:g} m on a plane surface"
            raise InputError(
                f"edge_contact '{self.name}': stiffness law '{self.stiffness.name}' has no force for {at}",
                "hertz or braendlein for a radius above 0, power, linear or a user-defined function",
            )

    @property
    def outline(self) -> tuple[np.ndarray, np.ndarray]:
        """Outlines for pictures: the edge in the frame of its body, and the disc about its centre [m]; none without ends."""
        disc = arc(self.radius, 0.0, 360.0, 37)
        if self.length is None:
            return np.empty((0, 2)), disc
        turn = math.degrees(self.direction)
        along = self.length * np.array([math.cos(self.direction), math.sin(self.direction)])
        ends = arc(self.half_width, turn + 90.0, turn + 270.0, 19), arc(self.half_width, turn - 90.0, turn + 90.0, 19) + along
        return np.concatenate([*ends, ends[0][:1]]), disc
