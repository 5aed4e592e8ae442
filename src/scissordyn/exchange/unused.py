"""What a model in MJCF or URDF holds beyond what an import takes from it."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections import Counter
from collections.abc import Mapping

PLACE = "name pos quat euler axisangle xyaxes zaxis class"

MUJOCO = {
    "mujoco": "model",
    "compiler": "*",
    "default": "*",
    "option": "gravity",
    "worldbody": "",
    "body": f"{PLACE} childclass",
    "frame": f"{PLACE} childclass",
    "inertial": "*",
    "joint": "name type axis pos ref range limited class damping stiffness springref frictionloss armature "
    "joint1 joint2 polycoef active",
    "freejoint": "name",
    "geom": f"{PLACE} type size fromto mass density contype conaffinity mesh",
    "site": "name pos class",
    "equality": "",
    "connect": "name class active body1 body2 anchor site1 site2",
    "weld": "name class active body1 body2 anchor relpose site1 site2",
    "keyframe": "",
    "key": "name qpos qvel",
}
"""Attributes that the import uses, or names itself, of each element of MJCF; "*" are all, with the elements inside."""

URDF = {
    "robot": "name",
    "link": "name",
    "inertial": "*",
    "joint": "name type",
    "parent": "*",
    "child": "*",
    "origin": "xyz rpy",
    "axis": "*",
    "limit": "lower upper",
    "mimic": "joint multiplier offset",
    "dynamics": "*",
    "collision": "*",
    "mujoco": "*",
}
"""The same of URDF."""


def unused(root: ET.Element) -> list[str]:
    """A line for each element, and for each attribute of the elements that are used, that the import does not use."""
    table = URDF if root.tag == "robot" else MUJOCO
    elements: dict[str, list[str]] = {}
    attributes: Counter[tuple[str, str]] = Counter()

    def visit(element: ET.Element) -> None:
        taken = table.get(element.tag)
        if taken is None:
            elements.setdefault(element.tag, []).append(element.get("name", ""))
            return
        if taken == "*":
            return
        attributes.update((element.tag, key) for key in element.attrib if key not in taken.split())
        for child in element:
            visit(child)

    visit(root)
    lines = []
    for tag, names in elements.items():
        titles = ", ".join(f"'{name}'" for name in names if name)
        lines.append(f"{len(names)} <{tag}> left out{': ' + titles if titles else ''}")
    lines += [f"attribute '{key}' of {count} <{tag}>: left out" for (tag, key), count in attributes.items()]
    return lines


def fields_left_out(fields: Mapping[str, object]) -> list[str]:
    """A line for each field of a link or a table that says something and that the import does not use."""
    return [f"{name}: left out" for name, value in fields.items() if value]


def without_pictures(root: ET.Element) -> ET.Element:
    """The model without shapes from files that are only looked at: visuals of URDF, meshes of bodies whose inertia is given."""
    for link in root.iter("link"):
        for shape in [*link.findall("visual"), *(link.findall("collision") if link.find("inertial/mass") is not None else [])]:
            link.remove(shape)
    for body in root.iter("body"):
        if body.find("inertial") is not None:
            for geom in [geom for geom in body.findall("geom") if geom.get("mesh")]:
                body.remove(geom)
    if root.tag == "mujoco" and not any(geom.get("mesh") or geom.get("hfield") for geom in root.iter("geom")):
        for asset in root.findall("asset"):
            for shape in [element for element in asset if element.tag in ("mesh", "texture", "material")]:
                asset.remove(shape)
        for geom in root.iter("geom"):
            geom.attrib.pop("material", None)
    return root
