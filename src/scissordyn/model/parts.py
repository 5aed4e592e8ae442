"""Parts of a mechanism: bodies, joints, guides, drives and gravity, and what is found among them."""

from __future__ import annotations

import copy
import dataclasses
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Any, Self, TypeVar

from scissordyn.annotation import body_point, shown
from scissordyn.components.declaration import Component
from scissordyn.components.latch import Latch
from scissordyn.components.place import GROUND, BodyPoint, Point
from scissordyn.components.rod import Rod
from scissordyn.errors import InputError, did_you_mean
from scissordyn.model.body import Body, Track
from scissordyn.model.clearance import Clearance, ContactPoint, Lubrication
from scissordyn.model.coupling import CoordinateDrive, Coupling, Drive
from scissordyn.model.joint import Guide, Revolute, Weld
from scissordyn.tolerance import ROUND_OFF_TOL
from scissordyn.units import Meaning, Quantity, counted

Gravity = Annotated[float, Quantity("m/s^2", minimum=0.0, help="gravitational acceleration")]
GravityDirection = Annotated[float, Quantity("rad", help="direction of gravity; -pi/2 is along -y")]

Named = TypeVar("Named", Body, Revolute, Guide)


@dataclass(frozen=True)
class Parts:
    """Parts of a mechanism by kind; `Mechanism` checks that they fit each other."""

    bodies: tuple[Body, ...]
    joints: tuple[Revolute, ...] = ()
    guides: tuple[Guide, ...] = ()
    drives: tuple[Drive, ...] = ()
    welds: tuple[Weld, ...] = ()
    components: tuple[Component, ...] = ()
    ground: Annotated[tuple[tuple[str, Point], ...], Meaning("named points of the fixed frame [m]")] = ()
    gravity: Gravity = 9.81
    gravity_direction: GravityDirection = -math.pi / 2
    input_body: Annotated[str, Meaning("the body that `driven` drives by default")] = ""
    output_body: Annotated[str, Meaning("the output body, such as the slider of an array")] = ""
    rods: tuple[Rod, ...] = ()
    latches: tuple[Latch, ...] = ()
    tracks: Annotated[tuple[Track, ...], Meaning("points whose motion is recorded")] = ()
    couplings: tuple[Coupling, ...] = ()
    coordinate_drives: tuple[CoordinateDrive, ...] = ()
    source: Annotated[str, Meaning("authors of the description, for `citations`; several are separated by semicolons")] = ""
    _closed: bool = dataclasses.field(default=False, kw_only=True, compare=False, repr=False)

    @property
    def clearances_closed(self) -> bool:
        """True if `ideal` closed clearances; couplings that become redundant thereby are not an error."""
        return self._closed

    def body(self, name: str) -> Body:
        """Return the body with a name."""
        body = self._bodies.get(name)
        return _named("body", name, self._bodies) if body is None else body

    def joint(self, name: str) -> Revolute:
        """Return the revolute joint with a name."""
        return _named("joint", name, self._joints)

    def guide(self, name: str) -> Guide:
        """Return the guide with a name."""
        return _named("guide", name, {guide.name: guide for guide in self.guides})

    def __str__(self) -> str:
        counts = {
            "body": len(self.bodies),
            "ideal joint": len(self.ideal_joints),
            "clearance joint": len(self.clearance_joints),
            "guide": len(self.guides),
            "drive": len(self.drives) + len(self.coordinate_drives),
            "component": len(self.components) + len(self.rods),
        }
        parts = [counted(count, kind) for kind, count in counts.items() if count]
        return f"Mechanism of {', '.join(parts)}"

    def _repr_pretty_(self, printer: Any, cycle: bool) -> None:  # IPython and Jupyter show this
        printer.text(str(self))

    @cached_property
    def _bodies(self) -> dict[str, Body]:
        return {body.name: body for body in self.bodies}

    @cached_property
    def _joints(self) -> dict[str, Revolute]:
        return {joint.name: joint for joint in self.joints}

    def place(self, reference: BodyPoint) -> Point:
        """Return the position of a point of a body or of the ground at the start [m]."""
        body, point = body_point(reference) if isinstance(reference, str) else reference
        return dict(self.ground)[point] if body == GROUND else self.body(body).place(point)

    def joint_or_point(self, named: str | BodyPoint) -> Revolute | BodyPoint:
        """Return the revolute joint with a name, or the point given as "BODY.POINT" or as a pair."""
        if not isinstance(named, str):
            return named
        if "." in named and named not in self._joints:
            return body_point(named)
        try:
            return self.joint(named)
        except InputError as error:
            raise InputError(error.what, f'{error.expected}, or a point as "BODY.POINT"', error.example) from None

    @cached_property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the revolute joints, then of the guides, then of the contact points of clearance guides."""
        return tuple(part.name for parts in (self.joints, self.guides, self.contact_points) for part in parts)

    @cached_property
    def contact_points(self) -> tuple[ContactPoint, ...]:
        """Contact points of the clearance guides, in order."""
        points: list[ContactPoint] = []
        for guide in self.guides:
            if guide.clearance is None:
                continue
            follower = self.body(guide.follower[0])
            base = 0.0 if guide.body == GROUND else self.body(guide.body).placed_angle
            points += guide.contact_points(follower, base + guide.direction - follower.placed_angle)
        return tuple(points)

    @property
    def output_guide(self) -> Guide | None:
        """First guide on the ground that leads the output body; None if there is none."""
        guides = (guide for guide in self.guides if guide.follower[0] == self.output_body and guide.body == GROUND)
        return next(guides, None)

    @cached_property
    def ideal_guides(self) -> tuple[Guide, ...]:
        """Guides without clearance, in order."""
        return tuple(guide for guide in self.guides if guide.clearance is None)

    @cached_property
    def size(self) -> float:
        """Size of the mechanism: largest distance of points of a body, or of bodies and ground points [m]."""
        points = [list(body.points.values()) for body in self.bodies]
        spans = [math.dist(a, b) for places in points for a in places for b in places]
        if max(spans, default=0.0) <= ROUND_OFF_TOL * max((math.hypot(*a) for places in points for a in places), default=0.0):
            places = [body.placed_position for body in self.bodies] + [place for _, place in self.ground]
            spans = [math.dist(places[0], place) for place in places]
        return max(spans) or 1.0

    @cached_property
    def contacts(self) -> tuple[Revolute | ContactPoint, ...]:
        """Possible contacts: the clearance joints, then the contact points of the clearance guides."""
        return (*self.clearance_joints, *self.contact_points)

    def contact_groups(self, names: Iterable[str]) -> dict[str, list[str]]:
        """Return names of contacts by the clearance joint or guide that they belong to; a guide has several contact points."""
        guides = {point.name: point.guide for point in self.contact_points}
        groups: dict[str, list[str]] = {}
        for name in names:
            groups.setdefault(guides.get(name, name), []).append(name)
        return groups

    @property
    def lubricated(self) -> tuple[tuple[Revolute, Clearance, Lubrication], ...]:
        """Joints with an oil film, in order, each with its clearance and its oil."""
        pairs = ((joint, joint.clearance) for joint in self.clearance_joints)
        return tuple((joint, gap, gap.lubrication) for joint, gap in pairs if gap is not None and gap.lubrication is not None)

    @property
    def exerting(self) -> tuple[Component, ...]:
        """Parts that exert forces, except contacts: the components, then the films of lubricated joints."""
        films: list[Any] = [
            oil.film(joint.name, joint.bearing, joint.journal, gap.surfaces) for joint, gap, oil in self.lubricated
        ]
        return (*self.components, *films)

    @cached_property
    def clearance_joints(self) -> tuple[Revolute, ...]:
        """Joints with clearance, in order."""
        return tuple(joint for joint in self.joints if joint.clearance is not None)

    @cached_property
    def ideal_joints(self) -> tuple[Revolute, ...]:
        """Joints without clearance, in order."""
        return tuple(joint for joint in self.joints if joint.clearance is None)

    @property
    def coupling_parts(self) -> tuple[Coupling | CoordinateDrive, ...]:
        """Couplings, then drives of coordinates."""
        return (*self.couplings, *self.coordinate_drives)

    def with_parts(self, parts: Mapping[str, Any], *, check: bool = True) -> Self:
        """Return the mechanism with other parts.

        Parameters
        ----------
        parts : mapping of str to tuple
            New parts by field.
        check : bool
            Whether to check parts and names. It can be False if names and connected bodies are unchanged.
        """
        if check:
            return dataclasses.replace(self, **parts)
        changed_mechanism = copy.copy(self)
        changed_mechanism.__dict__.update(parts)
        return changed_mechanism


def _named(what: str, name: str, parts: Mapping[str, Named]) -> Named:
    """Return a named part; raise `InputError` if it does not exist."""
    if not isinstance(name, str) or name not in parts:
        raise InputError(f"unknown {what} {shown(name)}{did_you_mean(name, parts)}", "one of " + (", ".join(parts) or "none"))
    return parts[name]
