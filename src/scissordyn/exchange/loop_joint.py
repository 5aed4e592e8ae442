"""Read joints that close loops: `<loop_joint>` elements of a URDF, and SDF joints in its `<gazebo>` elements.

Sources: the URDF parser of Drake's RigidBodyTree and the importer of Isaac Sim for `<loop_joint>` (children `link1` and `link2`
with the attributes `link`, `xyz` and `rpy`; Drake also has `<axis xyz>`, 1 0 0 if absent); for SDF joints in `<gazebo>` the
tutorial "Model a 4-bar linkage in SDFormat and URDF" of Gazebo; for their poses and axes the specification of SDFormat.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from scissordyn.annotation import SHOWN_LENGTH_MAX
from scissordyn.errors import InputError
from scissordyn.exchange.xml_element import (
    BODIES_MAX,
    EXAMPLE,
    VALUE_MAX,
    Element,
    child_of,
    is_true,
    numbers,
    text_of,
    value_of,
)

WORLD = "world"  # Name of the fixed link of an imported URDF or SDF model

AXIS_PARTS = {
    "limit": {"lower", "upper"},
    "dynamics": {"damping", "friction", "spring_reference", "spring_stiffness"},
}
"""Child elements of an SDF <axis> that the import uses, each with its own child elements that the import uses."""

KINDS = {
    "revolute": "pin",
    "continuous": "pin",
    "ball": "pin",
    "spherical": "pin",
    "prismatic": "slide",
    "fixed": "weld",
}
"""Kind of planar joint, by the type of a URDF or SDF joint that can close a loop."""


class Pose(NamedTuple):
    """Position and orientation of a frame (the inner frame) in another frame (the outer frame)."""

    position: np.ndarray
    rotation: Rotation

    def times(self, inner: Pose) -> Pose:
        """Return the pose in the outer frame of a third frame, whose pose in the inner frame is `inner`."""
        return Pose(self.position + self.rotation.apply(inner.position), self.rotation * inner.rotation)

    def inverse(self) -> Pose:
        """Return the pose of the outer frame in the inner frame."""
        back = self.rotation.inv()
        return Pose(-back.apply(self.position), back)

    @property
    def quaternion(self) -> np.ndarray:
        """Quaternion in the order of MuJoCo: w, x, y, z."""
        return np.roll(self.rotation.as_quat(), 1)


def pose(values: tuple[float, ...] = (0.0,) * 6) -> Pose:
    """Return the pose at x, y, z [m] with roll, pitch, yaw [rad]: rotations about the fixed axes x, y, z, in this order."""
    return Pose(np.array(values[:3]), Rotation.from_euler("xyz", values[3:]))


class Frame(NamedTuple):
    """Frame that is fixed to a link, with its pose in the frame of the link."""

    link: str
    pose: Pose


class LoopJoint(NamedTuple):
    """Joint that closes a loop.

    The joint is at `places[0]` on the first link and at `places[1]` on the second one. A frame of another link is read at the
    start and then moves with the link of the joint.
    """

    name: str
    shown: str  # Name and line for messages
    kind: str  # "pin", "slide" or "weld"
    links: tuple[str, str]
    places: tuple[Frame, Frame]
    axis: tuple[float, ...] | None  # Axis in the frame `axis_of`; None if the file does not give it
    axis_of: Frame
    attributes: dict[str, str]  # Limits, spring, damping and friction, as in MJCF


def loop_joints(element: Element, notes: list[str]) -> list[LoopJoint]:
    """Return the joints that close loops in a `<loop_joint>` or `<gazebo>` element; none for other or incomplete elements."""
    if element.tag.rpartition(":")[2] == "loop_joint":
        return _urdf_joint(element, notes)
    if element.tag == "gazebo" and "reference" not in element.attributes:
        return [joint for child in element.children if child.tag == "joint" for joint in _gazebo_joint(child, notes)]
    return []


def _urdf_joint(element: Element, notes: list[str]) -> list[LoopJoint]:
    """Return the joint of a `<loop_joint>` element; none if its type or links cannot be read."""
    ends = [child_of(element, tag) for tag in ("link1", "link2")]
    kind = KINDS.get(element.attributes.get("type", "revolute"), "")
    # no source defines the direction of a slide in this element
    if not kind or kind == "slide" or not all(end is not None and end.attributes.get("link") for end in ends):
        return []
    places = []
    for end in ends:
        assert end is not None
        place = [
            value
            for name in ("xyz", "rpy")
            for value in numbers(end.attributes.get(name, "0 0 0"), 3, f"line {end.line}: {name} of <{end.tag}>")
        ]
        places.append(Frame(end.attributes["link"], pose(tuple(place))))
    axis = child_of(element, "axis")
    along = None
    if axis is not None and kind == "pin" and element.attributes.get("type") != "spherical":
        along = _direction(axis.attributes.get("xyz", "1 0 0"), axis, f"line {axis.line}: xyz of <axis>")
    _note_unread(element, {"link1", "link2", "axis"}, notes)
    name = element.attributes.get("name", "") or "loop joint"
    first, second = places
    return [LoopJoint(name, f"joint {element.shown}", kind, (first.link, second.link), (first, second), along, first, {})]


def _gazebo_joint(element: Element, notes: list[str]) -> list[LoopJoint]:
    """Return an SDF joint of a `<gazebo>` element; its frame is the frame of its child link unless it has a <pose>."""
    kind = KINDS.get(element.attributes.get("type", ""), "")
    child, parent = (link_name(element, tag) for tag in ("child", "parent"))
    if not kind or not child or not parent:
        return []
    placed = child_of(element, "pose")
    place = Frame(child, pose())
    if placed is not None:
        link = placed.attributes.get("relative_to") or placed.attributes.get("frame") or child
        place = Frame(link, read_pose(placed))
    along, axis_of, attributes = None, place, dict[str, str]()
    if (axis := child_of(element, "axis")) is not None:
        along, frame = read_axis(axis)
        axis_of = Frame(frame, pose()) if frame else place
        _note_unread(axis, {"xyz", "use_parent_model_frame", *(AXIS_PARTS if kind == "pin" else ())}, notes, element)
        for part in axis.children:
            if part.tag in AXIS_PARTS and kind == "pin":
                _note_unread(part, AXIS_PARTS[part.tag], notes, element)
        attributes = axis_attributes(axis, element.attributes["type"]) if kind == "pin" else {}
    elif kind == "slide":
        along = (0.0, 0.0, 1.0)
    if kind == "slide" and axis_of is place:
        notes.append(f"joint {element.shown}: its axis is read in the frame of the joint, as in SDFormat 1.5 and later")
    _note_unread(element, {"child", "parent", "pose", "axis"}, notes)
    name = element.attributes.get("name", "") or "joint"
    return [LoopJoint(name, f"joint {element.shown}", kind, (child, parent), (place, place), along, axis_of, attributes)]


def link_name(joint: Element, tag: str) -> str:
    """Return the name of the link in the text of `<parent>` or `<child>`, or in its attribute `link` in early files."""
    end = child_of(joint, tag)
    return "" if end is None else end.text.strip() or end.attributes.get("link", "")


def read_pose(element: Element) -> Pose:
    """Return the pose in an SDF `<pose>`: angles in radians or degrees, or a quaternion x, y, z, w."""
    what = f"line {element.line}: <{element.tag}>"
    if element.attributes.get("rotation_format", "euler_rpy") == "quat_xyzw":
        *place, x, y, z, w = numbers(element.text or "0 0 0 0 0 0 1", 7, what)
        if not any((x, y, z, w)):
            raise InputError(f"{what} has the quaternion 0 0 0 0", "a quaternion that is not zero", EXAMPLE)
        return Pose(np.array(place), Rotation.from_quat((x, y, z, w)))
    values = numbers(element.text if element.text.strip() else "0 0 0 0 0 0", 6, what)
    if is_true(element.attributes.get("degrees", "")):
        values = (*values[:3], *np.radians(values[3:]).tolist())
    return pose(values)


def read_axis(axis: Element, *, in_model: bool = False) -> tuple[tuple[float, ...], str]:
    """Return the vector of an SDF `<axis>`, and the name of its frame: "" is the joint's, "__model__" the model's frame."""
    element = child_of(axis, "xyz")
    text = "0 0 1" if element is None or not element.text.strip() else element.text
    vector = _direction(text, axis, f"line {axis.line}: <xyz> of <axis>")
    expressed = "" if element is None else element.attributes.get("expressed_in", "")
    in_model = is_true(text_of(axis, "use_parent_model_frame", str(in_model)))
    return vector, expressed or ("__model__" if in_model else "")


def _direction(text: str, axis: Element, what: str) -> tuple[float, ...]:
    vector = numbers(text, 3, what)
    if not any(vector):
        raise InputError(f"line {axis.line}: the axis of the joint is 0 0 0", "a vector, for example 0 1 0", EXAMPLE)
    largest = max(map(abs, vector))
    return tuple(value / largest for value in vector)


def _note_unread(element: Element, read_tags: set[str], notes: list[str], joint: Element | None = None) -> None:
    """Add a note about child elements, other than `read_tags`, of a joint or of an element in it: they are not read."""
    if unread := list(dict.fromkeys(child.tag for child in element.children if child.tag not in read_tags)):
        tags = ", ".join(f"<{tag[:SHOWN_LENGTH_MAX]}>" for tag in unread[:5]) + (" and more" if len(unread) > 5 else "")
        notes.append(f"joint {(joint or element).shown}: {tags} left out, because the joint closes a loop")


def axis_attributes(axis: Element, kind: str) -> dict[str, str]:
    """Return the limits, spring, damping and friction of an axis as attributes of a joint in MJCF."""
    attributes: dict[str, str] = {}
    limit, dynamics = child_of(axis, "limit"), child_of(axis, "dynamics")
    if limit is not None and kind in ("revolute", "prismatic"):
        low, high = (_bound(limit, tag, sign) for tag, sign in (("lower", -1.0), ("upper", 1.0)))
        if low > high:
            raise InputError(f"line {limit.line}: lower limit {low:g} > upper limit {high:g}", "lower < upper", EXAMPLE)
        if low > -VALUE_MAX or high < VALUE_MAX:
            # limits that coincide are apart by round-off, because MJCF requires a range
            attributes["range"] = f"{low!r} {max(high, math.nextafter(low, math.inf))!r}"
    if dynamics is not None:
        for tag, name in (
            ("damping", "damping"),
            ("friction", "frictionloss"),
            ("spring_stiffness", "stiffness"),
            ("spring_reference", "springref"),
        ):
            if value := value_of(dynamics, tag, 0.0):
                attributes[name] = repr(value)
    return attributes


def _bound(limit: Element, tag: str, sign: float) -> float:
    """Return a limit of a joint, at most `VALUE_MAX` in magnitude; a missing limit is `sign` times `VALUE_MAX`."""
    child = child_of(limit, tag)
    try:
        value = sign * VALUE_MAX if child is None else float(child.text)
    except ValueError:
        value = math.nan
    if math.isnan(value):
        raise InputError(f"line {limit.line}: <{tag}> of <limit> is not a number", "a number, or inf", EXAMPLE)
    return max(-VALUE_MAX, min(VALUE_MAX, value))


def add_loop_sites(spec: Any, joints: list[LoopJoint]) -> None:
    """Add the frames of loop joints to a MuJoCo model as sites, which do not move if MuJoCo fuses links that are welded."""
    if len(joints) > BODIES_MAX:
        raise InputError(f"the model has more than {BODIES_MAX} joints that close loops", "fewer joints", EXAMPLE)
    bodies = {body.name: body for body in spec.bodies}
    for number, joint in enumerate(joints):
        frames = (*(Frame(link, pose()) for link in joint.links), *joint.places, joint.axis_of)
        for k, frame in enumerate(frames):
            link = WORLD if frame.link == "__model__" else frame.link
            if link not in bodies:
                raise InputError(
                    f"{joint.shown} refers to '{link[:SHOWN_LENGTH_MAX]}'", "the name of a link of the model", EXAMPLE
                )
            site = bodies[link].add_site()
            site.name, site.pos, site.quat = site_name(number, k), frame.pose.position, frame.pose.quaternion


def site_name(number: int, k: int) -> str:
    """Return the name of the k-th site of a loop joint: 0 and 1 are its links, 2 and 3 its frames on them, 4 its axis frame."""
    return f"mark {k} of loop joint {number}"
