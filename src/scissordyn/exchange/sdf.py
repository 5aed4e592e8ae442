"""Convert a model in SDF to MJCF, with the joints that close its loops.

Source: the specification of SDFormat (http://sdformat.org/spec) and its tutorial "Pose frame semantics". Without `relative_to`,
links are placed in the model, joints in their child link, and frames in the frame of `attached_to`. An axis is in the frame of
its joint, and in files before version 1.5 in that of the model.
"""

from __future__ import annotations

import re
from collections import defaultdict
from typing import NamedTuple

import numpy as np

from scissordyn.annotation import SHOWN_LENGTH_MAX
from scissordyn.errors import InputError
from scissordyn.exchange.loop_joint import (
    KINDS,
    WORLD,
    Frame,
    LoopJoint,
    Pose,
    axis_attributes,
    link_name,
    pose,
    read_axis,
    read_pose,
)
from scissordyn.exchange.sdf_tree import Edge, mjcf_of, spanning_tree
from scissordyn.exchange.source import listed
from scissordyn.exchange.xml_element import (
    BODIES_MAX,
    EXAMPLE,
    Element,
    child_of,
    is_true,
    numbers,
    text_of,
    value_of,
)

MODEL = "__model__"  # Name, reserved in SDF, of the coordinate frame of a model

CHILDREN = {
    "model": "pose static link joint frame",
    "link": "pose inertial",
    "inertial": "pose mass inertia",
    "inertia": "ixx ixy ixz iyy iyz izz",
    "joint": "parent child pose axis",
    "axis": "xyz use_parent_model_frame limit dynamics",
    "limit": "lower upper",
    "dynamics": "damping friction spring_reference spring_stiffness",
    "frame": "pose",
}
"""Child elements that the import uses, by the SDF element that contains them."""


class SdfModel(NamedTuple):
    """Model in MJCF, and the joints that close its loops."""

    text: str
    loops: list[LoopJoint]


def convert_sdf(root: Element, notes: list[str]) -> SdfModel:
    """Convert the model with joints of an SDF file to MJCF; add a note for each part that is left out."""
    left_out = defaultdict[str, list[Element]](list)
    model, gravity = _find_model(root, left_out, notes)
    version = re.fullmatch(r"(\d{1,4})\.(\d{1,4})", root.attributes.get("version", "").strip())
    is_old = version is not None and (int(version[1]), int(version[2])) < (1, 5)
    return _Model(model, is_old, left_out, notes).convert(gravity)


def _find_model(root: Element, left_out: dict[str, list[Element]], notes: list[str]) -> tuple[Element, tuple[float, ...]]:
    """Return the only model with joints, and the gravity of its world."""
    worlds = [child for child in root.children if child.tag == "world"]
    parts = [part for place in (root, *worlds) for part in place.children if part.tag != "world"]
    models = [part for part in parts if part.tag == "model"]
    moving = [model for model in models if child_of(model, "joint")]
    if len(moving) != 1:
        names = ": " + listed([model.shown for model in moving]) if moving else ""
        raise InputError(f"the SDF has {len(moving)} models with joints{names}", "one model with joints", EXAMPLE)
    gravities = [part for part in parts if part.tag == "gravity"]
    # before version 1.6 gravity is part of <physics>
    gravities += [part for physics in parts if physics.tag == "physics" for part in physics.children if part.tag == "gravity"]
    for part in parts:
        if part is not moving[0] and part.tag not in ("gravity", "physics"):
            left_out[f"<{part.tag}>"].append(part)
    if gravities:
        return moving[0], numbers(gravities[0].text, 3, f"line {gravities[0].line}: <gravity>")
    notes.append("gravity: the SDF has none; the default of its worlds is assumed, 9.8 m/s^2 along -z")
    return moving[0], (0.0, 0.0, -9.8)


class _Model:
    """Links, joints and frames of an SDF model, with their poses."""

    def __init__(self, model: Element, is_old: bool, left_out: dict[str, list[Element]], notes: list[str]) -> None:
        self.model, self.is_old, self.left_out, self.notes = model, is_old, left_out, notes
        if is_true(text_of(model, "static")):
            raise InputError(f"model {model.shown} is static", "a model that moves, without <static>", EXAMPLE)
        self.links, self.joints, self.frames = (self._named(tag) for tag in ("link", "joint", "frame"))
        for tag, named in (("bodies", self.links), ("joints", self.joints), ("frames", self.frames)):
            if len(named) > BODIES_MAX:
                raise InputError(f"the model has more than {BODIES_MAX} {tag}", "a smaller model", EXAMPLE)
        if not self.links:
            raise InputError(f"model {model.shown} has no links", "one link or more", EXAMPLE)
        self.named = {**self.frames, **self.joints, **self.links}
        self.first = model.attributes.get("canonical_link", "")
        if self.first not in self.links:
            self.first = next(iter(self.links))
        self.poses = {MODEL: pose()}
        self._note_unread()

    def _named(self, tag: str) -> dict[str, Element]:
        """Return the children of the model that have a tag, by their names."""
        elements: dict[str, Element] = {}
        for child in self.model.children:
            if child.tag != tag:
                continue
            name = child.attributes.get("name", "")
            if not name or name in (WORLD, MODEL):
                raise InputError(f"line {child.line}: <{tag}> is named '{name}'", "a name, for example 'arm'", EXAMPLE)
            if name in elements:
                raise InputError(f"line {child.line}: a second <{tag}> is named '{name}'", "each name once", EXAMPLE)
            elements[name] = child
        return elements

    def _note_unread(self) -> None:
        """Add the elements that are not read, inside elements that are read, to `left_out`."""
        stack = [self.model]
        while stack:
            element = stack.pop()
            read = CHILDREN.get(element.tag, "").split()
            for child in reversed(element.children):
                if child.tag in read:
                    stack.append(child)
                elif read:
                    owner = "" if element.tag in ("model", "link", "joint") else f" in <{element.tag}>"
                    self.left_out[f"<{child.tag[:SHOWN_LENGTH_MAX]}>{owner}"].append(child)
                    if child.tag == "gravity" and element.tag == "link" and child.text.strip() and not is_true(child.text):
                        self.notes.append(f"link {element.shown}: gravity acts on it, although its <gravity> is off")

    def convert(self, gravity: tuple[float, ...]) -> SdfModel:
        """Convert the SDF model to the MJCF text of a tree of bodies, and a list of the joints that close loops."""
        self._place()
        edges = [self._edge(name, joint) for name, joint in self.joints.items()]
        bodies = {name: (self._pose(name, link), *self._inertial(link)) for name, link in self.links.items()}
        tree = spanning_tree(list(self.links), edges, self.first)
        for edge in tree.edges.values():
            if edge.type == "ball":
                what = f"joint {edge.shown} of type 'ball' does not close a loop"
                raise InputError(what, "revolute, continuous, prismatic or fixed", EXAMPLE)
        loops = [self._loop(edge, pose() if edge.links[0] == WORLD else bodies[edge.links[0]][0]) for edge in tree.loops]
        for tag, elements in self.left_out.items():
            self.notes.append(f"{len(elements)} {tag} left out: {listed([element.shown for element in elements])}")
        return SdfModel(mjcf_of(tree, bodies, gravity), loops)

    def _place(self) -> None:
        """Set the pose of the model in the world, which <pose> gives for the frame of the model or for `placement_frame`."""
        placed = child_of(self.model, "pose")
        if placed is None:
            return
        if placed.attributes.get("relative_to", "") not in ("", WORLD):
            raise InputError(f"line {placed.line}: the pose of the model is relative to a frame", "the world", EXAMPLE)
        outer = read_pose(placed)
        if frame := self.model.attributes.get("placement_frame"):
            outer = outer.times(self._pose(frame, self.model).inverse())
        self.poses = {MODEL: outer}

    def _loop(self, edge: Edge, link: Pose) -> LoopJoint:
        """Return the loop joint of an edge; `link` is the pose of its child link."""
        if edge.attributes and edge.type == "prismatic":
            attributes = ", ".join(edge.attributes)
            self.notes.append(f"joint {edge.shown}: {attributes} left out, because the joint is a slide that closes a loop")
        place = Frame(edge.links[0], link.inverse().times(edge.pose))
        axis = None if edge.type == "ball" else tuple(edge.pose.rotation.inv().apply(edge.axis).tolist())
        shown, kind = f"joint {edge.shown}", KINDS[edge.type]
        return LoopJoint(edge.name, shown, kind, edge.links, (place, place), axis, place, edge.attributes)

    def _edge(self, name: str, joint: Element) -> Edge:
        """Return a joint with its pose and axis in the world."""
        kind = joint.attributes.get("type", "")
        if kind not in KINDS or kind == "spherical":
            what = f"joint {joint.shown} is of type '{kind[:SHOWN_LENGTH_MAX]}'"
            raise InputError(what, "revolute, continuous, prismatic, fixed, or a ball joint that closes a loop", EXAMPLE)
        child, parent = (self._link(link_name(joint, tag), joint) for tag in ("child", "parent"))
        if child == parent:
            raise InputError(f"joint {joint.shown} joins '{child}' to itself", "two different links", EXAMPLE)
        here = self._pose(name, joint, self.joints)
        axis, attributes = np.array([0.0, 0.0, 1.0]), {}
        element = child_of(joint, "axis")
        if element is None and kind not in ("fixed", "ball"):
            axis = here.rotation.apply(axis)
        if element is not None:
            vector, frame = read_axis(element, in_model=self.is_old)
            turn = self._pose(frame, joint).rotation if frame else here.rotation
            axis, attributes = turn.apply(vector), axis_attributes(element, kind)
        return Edge(name, joint.shown, kind, (child, parent), here, axis, attributes)

    def _inertial(self, link: Element) -> tuple[np.ndarray, float, np.ndarray]:
        """Return mass centre, mass, and inertia about the mass centre in the axes of the link."""
        element = child_of(link, "inertial")
        if element is None:
            self.notes.append(f"link {link.shown} has no <inertial>: 1 kg and 1 kg m^2, the defaults of SDF, are assumed")
            return np.zeros(3), 1.0, np.eye(3)
        if is_true(element.attributes.get("auto", "")):
            what = f"link {link.shown}: its inertia is computed from its shapes"
            raise InputError(what, "mass and inertia in <inertial>", EXAMPLE)
        placed, inertia = child_of(element, "pose"), child_of(element, "inertia")
        here = pose() if placed is None else read_pose(placed)
        mass = value_of(element, "mass", 1.0)
        ixx, iyy, izz, ixy, ixz, iyz = (
            default if inertia is None else value_of(inertia, name, default)
            for name, default in (("ixx", 1.0), ("iyy", 1.0), ("izz", 1.0), ("ixy", 0.0), ("ixz", 0.0), ("iyz", 0.0))
        )
        turn = here.rotation.as_matrix()
        return here.position, mass, turn @ np.array([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]]) @ turn.T

    def _pose(self, name: str, user: Element, named: dict[str, Element] | None = None) -> Pose:
        """Return the pose of a link, joint or frame in the world; if `named` is given, `name` is one of its elements."""
        chain: list[tuple[str, Pose]] = []
        seen: set[int] = set()
        while name not in self.poses or named is not None:
            element = (named or self.named).get(name)
            named = None
            if element is None:
                what = f"line {user.line}: <{user.tag}> refers to '{name[:SHOWN_LENGTH_MAX]}'"
                raise InputError(what, "a link, joint or frame of the model", EXAMPLE)
            if id(element) in seen:
                raise InputError(f"line {user.line}: the pose of '{name}' refers to itself", "poses without a circle", EXAMPLE)
            seen.add(id(element))
            placed = child_of(element, "pose")
            chain.append((name if self.named.get(name) is element else "", pose() if placed is None else read_pose(placed)))
            frame = placed.attributes.get("relative_to") or placed.attributes.get("frame") if placed is not None else ""
            default = link_name(element, "child") if element.tag == "joint" else element.attributes.get("attached_to")
            name, user = frame or default or MODEL, element
            if name == WORLD:
                raise InputError(f"line {element.line}: a pose in the model is relative to the world", "the model", EXAMPLE)
        here = self.poses[name]
        for part, inner in reversed(chain):
            here = here.times(inner)
            if part:
                self.poses[part] = here
        return here

    def _link(self, name: str, joint: Element) -> str:
        """Return the name of a link; if `name` is that of a frame or joint, the link to which it is attached."""
        seen: set[str] = set()
        while name not in self.links and name != WORLD:
            element = self.frames.get(name) or self.joints.get(name)
            if name == MODEL:
                return self.first
            if element is None or name in seen:
                what = f"joint {joint.shown} refers to '{name[:SHOWN_LENGTH_MAX]}'"
                raise InputError(what, "a link of the model, or world", EXAMPLE)
            seen.add(name)
            name = link_name(element, "child") if element.tag == "joint" else element.attributes.get("attached_to") or MODEL
        return name
