"""Couplings and coordinate drives in MJCF: coordinates are joints, or tendons along joints or between two points."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from scissordyn.component.place import GROUND
from scissordyn.errors import InputError
from scissordyn.model.coupling import Coordinate, CoordinateDrive, Coupling, Distance, RelativeAngle
from scissordyn.model.joint import Guide
from scissordyn.model.mechanism import Mechanism

SAME = 1e-12  # Weights of a joint below this are those of a slide across it


@dataclass
class Tree:
    """Where the bodies of a mechanism are attached, and the joints by which they move against what they are attached to."""

    parents: Mapping[str, str]
    guides: Mapping[str, Guide]  # By the bodies that they lead
    hinges: dict[str, str] = field(default_factory=dict)  # Names of joints by bodies
    slides: dict[str, list[str]] = field(default_factory=dict)  # Likewise; two of a body that moves freely

    def joints(self, mechanism: Mechanism, coordinate: Coordinate, what: str) -> dict[str, float]:
        """Weights of the joints whose sum a coordinate is, but for a constant."""
        if isinstance(coordinate, RelativeAngle):
            weights: dict[str, float] = {}
            for body, sign in zip(coordinate.bodies, (1.0, -1.0), strict=True):
                for name in self._up(body):
                    if name in self.hinges:
                        joint = self.hinges[name]
                        weights[joint] = weights.get(joint, 0.0) + sign
            return {joint: weight for joint, weight in weights.items() if weight}
        assert not isinstance(coordinate, Distance)
        (body, point), base = coordinate.point, coordinate.base
        described = mechanism.body(body)
        if self.parents[body] == base and body in self.slides:
            guide, slides = self.guides.get(body), self.slides[body]
            turned = coordinate.direction - (guide.direction if guide else 0.0)
            turns = described.rotates and body in self.hinges
            there = guide.follower[1] if guide else None
            if not turns or point == there or (guide is None and described.points[point] == (0.0, 0.0)):
                pairs = zip(slides, (math.cos(turned), math.sin(turned)), strict=False)
                return {joint: weight for joint, weight in pairs if abs(weight) > SAME}
        raise InputError(
            f"{what} of the slide of '{body}.{point}' in MJCF",
            "a slide along the guide of its body, of the point that the guide leads if the body turns",
        )

    def _up(self, body: str) -> list[str]:
        """A body, what it is attached to, and so on."""
        names = []
        while body != GROUND:
            names.append(body)
            body = self.parents[body]
        return names


class Couplings:
    """What is added to a model for couplings and coordinate drives."""

    def __init__(self, mechanism: Mechanism, tree: Tree, bodies: Mapping[str, ET.Element], root: ET.Element) -> None:
        self.mechanism, self.tree, self.bodies = mechanism, tree, bodies
        self.tendons = ET.Element("tendon")
        self.root = root

    def add(self, equality: ET.Element, motors: ET.Element, stiff: Mapping[str, Any]) -> None:
        for part in self.mechanism.couplings:
            what = f"coupling '{part.name}'"
            ends = [self._joints(coordinate, what) for coordinate in (part.output, part.input)]
            single = [next(iter(end.items())) for end in ends if end and len(end) == 1]
            if len(single) == 2:
                (first, weight), (second, other) = single
                pair: dict[str, Any] = {
                    "joint1": first,
                    "joint2": second,
                    "polycoef": f"0 {part.ratio * other / weight!r} 0 0 0",
                }
                ET.SubElement(equality, "joint", name=part.name, **pair, **stiff)
            else:
                sides = zip(("output", "input"), ends, strict=True)
                first, second = (self._tendon(part, side, end) for side, end in sides)
                pair = {"tendon1": first, "tendon2": second, "polycoef": f"0 {part.ratio!r} 0 0 0"}
                ET.SubElement(equality, "tendon", name=part.name, **pair, **stiff)
        for drive in self.mechanism.coordinate_drives:
            weights = self._joints(drive.coordinate, f"drive '{drive.name}'")
            ET.SubElement(motors, "motor", name=drive.name, tendon=self._tendon(drive, "coordinate", weights))
        if len(self.tendons):
            self.root.append(self.tendons)

    def _joints(self, coordinate: Coordinate, what: str) -> dict[str, float] | None:
        return None if isinstance(coordinate, Distance) else self.tree.joints(self.mechanism, coordinate, what)

    def _tendon(self, part: Coupling | CoordinateDrive, side: str, weights: Mapping[str, float] | None) -> str:
        """A tendon whose length is a coordinate but for a constant; its name."""
        name, coordinate = f"{part.name} {side}", getattr(part, side)
        if weights is None:
            spatial = ET.SubElement(self.tendons, "spatial", name=name)
            for end, (body, point) in (("start", coordinate.start), ("end", coordinate.end)):
                x, y = dict(self.mechanism.ground)[point] if body == GROUND else self.mechanism.body(body).points[point]
                ET.SubElement(self.bodies[body], "site", name=f"{name} {end}", pos=f"{x!r} {y!r} 0")
                ET.SubElement(spatial, "site", site=f"{name} {end}")
        else:
            fixed = ET.SubElement(self.tendons, "fixed", name=name)
            for joint, weight in weights.items():
                ET.SubElement(fixed, "joint", joint=joint, coef=repr(weight))
        return name
