"""Remove the parts of an MJCF or URDF text that the import does not use, and convert SDF.

Unused parts are overwritten with blanks, so that MuJoCo's messages have the line numbers of the user's text.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path, PurePath
from typing import NamedTuple

from scissordyn.annotation import SHOWN_LENGTH_MAX
from scissordyn.errors import InputError
from scissordyn.exchange.loop_joint import LoopJoint, loop_joints
from scissordyn.exchange.sdf import convert_sdf
from scissordyn.exchange.source import listed
from scissordyn.exchange.xml_element import (
    BODIES_MAX,
    EXAMPLE,
    Element,
    child_of,
    further_file,
    parse,
    text_of,
    with_includes,
)

ATTRIBUTE = re.compile(rb"""\s([^\s=<>"'/]+)\s*=\s*("[^"]*"|'[^']*')""")  # Pattern of an XML attribute
COUNT = re.compile(r"[0-9]{1,9}")  # Pattern of the attribute `count` of an MJCF <replicate>: at most nine digits
NOT_FINITE = re.compile(r"(?i)(?<![\w.])(?:nan|inf|infinity)(?![\w.])")  # Pattern of a number that is not finite
# Translation table that blanks out XML text: each byte except line breaks becomes a blank
BLANK_TABLE = bytes(byte if byte in b"\r\n" else 32 for byte in range(256))

TEXT_ATTRIBUTES = frozenset({"name", "class", "childclass", "model", "mesh", "link", "joint", "jointinparent", "file"}) | {
    "filename",
    "tendon",
    *(f"{part}{number}" for part in ("body", "joint", "site", "tendon") for number in "12"),
}
"""Attributes of MJCF whose values are texts, not numbers."""

# Attributes that the import uses of each MJCF element with a position
PLACE_ATTRIBUTES = "name class pos quat euler axisangle xyaxes zaxis"

ACTUATORS = ("motor", "position", "velocity", "damper", "general")
"""Names of the MJCF actuator elements that the import uses."""

# Attributes that the import uses of an MJCF actuator
ACTUATOR_ATTRIBUTES = (
    "name class group joint jointinparent tendon gear ctrllimited ctrlrange forcelimited forcerange inheritrange kp kv "
    "dampratio timeconst gaintype gainprm biastype biasprm dyntype dynprm"
)

ATTRIBUTES = {
    "mujoco": "model",
    "compiler": "*",
    "default": "class",
    "option": "gravity actuatorgroupdisable",
    "flag": "gravity spring damper passive equality limit frictionloss constraint contact actuation clampctrl",
    "body": f"{PLACE_ATTRIBUTES} childclass",
    "frame": f"{PLACE_ATTRIBUTES} childclass",
    "replicate": "count offset euler sep",
    "inertial": f"{PLACE_ATTRIBUTES} mass diaginertia fullinertia",
    "joint": "name class type axis pos ref range limited damping stiffness springref springdamper frictionloss armature "
    "actuatorfrcrange actuatorfrclimited joint1 joint2 polycoef active joint coef",
    "freejoint": "name align",
    "geom": f"{PLACE_ATTRIBUTES} type size fromto mass density contype conaffinity mesh shellinertia fitscale",
    "site": "name class pos fromto type size",
    "mesh": "name class vertex face scale refpos refquat inertia file builtin",
    "equality": "active",
    "connect": "name class active body1 body2 anchor site1 site2",
    "weld": "name class active body1 body2 anchor relpose site1 site2",
    "fixed": "name class limited range",
    "tendon": "name class active tendon1 tendon2 polycoef",
    "key": "name qpos qvel ctrl",
    **dict.fromkeys(ACTUATORS, ACTUATOR_ATTRIBUTES),
}
"""Attributes that the import uses, by the MJCF element that has them; "*" means all attributes."""

TREE_ELEMENTS = "body frame replicate inertial joint freejoint geom site"  # MJCF elements that a body can contain

CHILDREN = {
    "mujoco": "compiler default option worldbody equality keyframe asset actuator tendon sensor contact deformable",
    "default": " ".join(("default joint geom site mesh equality", *ACTUATORS)),
    "actuator": " ".join(ACTUATORS),
    "option": "flag",
    "worldbody": TREE_ELEMENTS,
    "body": TREE_ELEMENTS,
    "frame": TREE_ELEMENTS,
    "replicate": TREE_ELEMENTS,
    "equality": "connect weld joint tendon",
    "tendon": "fixed",
    "fixed": "joint",
    "keyframe": "key",
    "asset": "mesh",
}
"""Child elements that the import uses, by the MJCF element that contains them."""

URDF_ATTRIBUTES = {
    "robot": "name",
    "link": "name",
    "origin": "xyz rpy",
    "mass": "value",
    "inertia": "ixx ixy ixz iyy iyz izz",
    "joint": "name type",
    "parent": "link",
    "child": "link",
    "axis": "xyz",
    "limit": "lower upper effort",
    "mimic": "joint multiplier offset",
    "dynamics": "damping friction",
    "collision": "name",
    "box": "size",
    "cylinder": "radius length",
    "capsule": "radius length",
    "sphere": "radius",
    "mesh": "filename scale",
    "compiler": "*",
    "option": "gravity",
    "flag": ATTRIBUTES["flag"],
}
"""Attributes that the import uses, by the URDF element that has them; "*" means all attributes."""


URDF_CHILDREN = {
    "robot": "link joint mujoco",
    "link": "inertial collision",
    "inertial": "origin mass inertia",
    "joint": "parent child origin axis limit mimic dynamics",
    "collision": "origin geometry",
    "geometry": "box cylinder capsule sphere mesh",
    "mujoco": "compiler option",
    "option": "flag",
}
"""Child elements that the import uses, by the URDF element that contains them."""


BODY_GENERATORS = ("attach", "composite", "flexcomp")  # MJCF elements that generate bodies; these bodies are left out as well


class NamedMotor(NamedTuple):
    """Motor that a URDF names for a joint."""

    joint: str  # Name of the joint
    shown: str  # Name and line for messages
    facts: str  # Interface and gear reduction, for messages


class Source(NamedTuple):
    """Text of a model for MuJoCo, and properties of the user's text from which it was made."""

    text: str
    notes: list[str]
    gives_gravity: bool  # False if MuJoCo's default gravity applies
    key_count: int  # Number of keyframes of the whole model
    loops: list[LoopJoint]  # Joints that close loops of a URDF or SDF
    motors: list[NamedMotor]  # Motors that a URDF names


def remove_unused(text: str, folder: Path | None) -> Source:
    """Return a model without the parts that the import does not use, with a note for each kind of part that is left out."""
    notes: list[str] = []
    content = bytearray(with_includes(text, folder, notes).encode("utf-8"))
    root = parse(bytes(content))
    if root.tag == "sdf":
        model = convert_sdf(root, notes)
        return Source(model.text, notes, True, 0, model.loops, [])
    if root.tag not in ("mujoco", "robot"):
        raise InputError(f"the root of the model is <{root.tag}>", "<mujoco>, <robot> (URDF) or <sdf>", EXAMPLE)
    part = _XmlCleaner(content, is_urdf=root.tag == "robot")
    part.visit(root)
    gives_gravity = part.gives_gravity or not part.is_urdf
    return Source(content.decode("utf-8"), notes + part.notes(), gives_gravity, part.key_count, part.loops, part.motors[::-1])


class _XmlCleaner:
    """Visitor of an MJCF or URDF model that blanks what the import does not use, and collects loops, motors and notes."""

    def __init__(self, content: bytearray, *, is_urdf: bool) -> None:
        self.content, self.is_urdf = content, is_urdf
        self.attributes, self.children = (URDF_ATTRIBUTES, URDF_CHILDREN) if is_urdf else (ATTRIBUTES, CHILDREN)
        self.key_count, self.body_count, self.gives_gravity = 0, 0, False
        self.meshes: set[str] = set()  # Names of the meshes that geoms use
        self.elements = defaultdict[str, list[Element]](list)
        self.unused = defaultdict[tuple[str, str], list[int]](list)
        self.lost: list[str] = []
        self.loops: list[LoopJoint] = []
        self.motors: list[NamedMotor] = []
        self.actuators: list[tuple[int, bool]] = []  # First byte of each actuator's element, and True if it is read
        self.joints: set[str] = set()  # Names of the joints in the model
        self.tendons: set[str] = set()  # Names of the tendons that are read
        self.first_key: Element | None = None
        self.has_copies = False  # True if the model has <replicate>

    def visit(self, root: Element) -> None:
        stack = [(root, 1)]
        while stack:
            element, copies = stack.pop()
            self._blank_attributes(element)
            self._check(element)
            if element.tag == "geom" and "mesh" in element.attributes:
                self.meshes.add(element.attributes["mesh"])
            self.gives_gravity |= element.tag == "option" and "gravity" in element.attributes
            if element.tag in ("body", "link"):
                self.body_count += copies
            if element.tag == "replicate":
                self.has_copies = True
                copies *= _count(element)
            if max(self.body_count, copies) > BODIES_MAX:
                raise InputError(f"the model has more than {BODIES_MAX} bodies", "fewer bodies", EXAMPLE)
            if element.tag == "joint":
                self.joints.add(element.attributes.get("name", ""))
            elif element.tag == "fixed":
                self.tendons.add(element.attributes.get("name", ""))
            allowed = self.children.get(element.tag, "").split()
            # the last element is visited first, so assets come after geoms, and what refers to joints or tendons after these
            order = ("keyframe", "actuator", "equality", "tendon", "asset")
            last = [child for tag in order for child in reversed(element.children) if child.tag == tag]
            for child in (*last, *(child for child in reversed(element.children) if child.tag not in order)):
                is_used = child.tag in allowed and not self._is_unused(child, element)
                if element.tag == "actuator":
                    self.actuators.append((child.start, is_used))
                if is_used:
                    stack.append((child, copies))
                else:
                    self._leave_out(child)

    def _is_unused(self, child: Element, parent: Element) -> bool:
        """Return True if this element is not used inside this parent, although the import reads elements of its kind."""
        has_inertial = parent.tag in ("body", "link") and any(
            sibling.tag == "inertial" and (not self.is_urdf or any(part.tag == "mass" for part in sibling.children))
            for sibling in parent.children
        )
        if child.tag == "key":
            self.key_count += 1
            if self.first_key is None:
                self.first_key = child_of(parent, "key")
                self._blank_inputs(self.first_key or child)
            return child is not self.first_key
        if parent.tag == "actuator":
            joint = child.attributes.get("joint", child.attributes.get("jointinparent"))
            if joint is None:
                return child.attributes.get("tendon", "") not in self.tendons
            # copies of joints in <replicate> have other names
            return joint not in self.joints and not self.has_copies
        if child.tag == "fixed":
            return not (self.has_copies or self.joints.issuperset(part.attributes.get("joint", "") for part in child.children))
        if child.tag == "tendon" and parent.tag == "equality":
            return any(key in child.attributes and child.attributes[key] not in self.tendons for key in ("tendon1", "tendon2"))
        if child.tag == "geom" and parent.tag != "default":
            kind, masses = child.attributes.get("type", ""), [child.attributes.get(name) for name in ("mass", "density")]
            weightless = has_inertial or "0" in masses
            return (weightless and "mesh" in child.attributes) or kind in ("hfield", "sdf") or "hfield" in child.attributes
        if child.tag == "mesh" and parent.tag == "asset":
            file = PurePath(child.attributes.get("file", "")).stem
            return child.attributes.get("name", file) not in self.meshes
        return child.tag == "collision" and has_inertial

    def _blank_inputs(self, key: Element) -> None:
        """Blank the inputs of unread actuators in a keyframe; blank all inputs if their count is not that of the actuators."""
        read = [is_read for _, is_read in sorted(self.actuators)]
        inputs = next((attribute for attribute in self._attributes(key) if attribute[1] == b"ctrl"), None)
        if inputs is None or (read and all(read)):
            return
        start, values = key.start + inputs.start(2), list(re.finditer(rb"[^\s\"']+", inputs[2]))
        if len(values) != len(read) or not any(read):
            self._blank(key.start + inputs.start(), key.start + inputs.end())
            self.lost.append(f"inputs of keyframe {key.shown} left out, because actuators are left out")
            return
        for value, is_read in zip(values, read, strict=True):
            if not is_read:
                self._blank(start + value.start(), start + value.end())

    def _attributes(self, element: Element) -> Iterator[re.Match[bytes]]:
        return ATTRIBUTE.finditer(bytes(self.content[element.start : element.inside]))

    def _leave_out(self, element: Element) -> None:
        self._blank(element.start, element.end)
        if element.tag.startswith("xacro:"):
            raise InputError(
                f"line {element.line}: the URDF contains <{element.tag}>", "an expanded URDF", "xacro robot.xacro > robot.urdf"
            )
        if element.tag == "key":
            return
        if not self.is_urdf:
            self.elements[element.tag].append(element)
            return
        if motors := _named_motors(element):
            self.motors += motors[::-1]  # the last element is visited first
            return
        loops = loop_joints(element, self.lost)
        self.loops += loops
        read = {joint.shown for joint in loops}
        for part in (element, *element.descendants()):
            is_joint = part.tag.endswith("joint") and (part is element or "type" in part.attributes)
            if is_joint and f"joint {part.shown}" not in read:
                self.lost.append(_lost_joint(part, element))
        if not loops:
            self.elements[element.tag].append(element)
        elif element.tag == "gazebo":
            for child in element.children:
                if child.tag != "joint":
                    self.elements[child.tag].append(child)

    def _check(self, element: Element) -> None:
        for name in ("file", "filename"):
            if name in element.attributes and element.tag in ("mesh", "model"):
                raise further_file(element, name)
        for name, value in element.attributes.items():
            if name not in TEXT_ATTRIBUTES and NOT_FINITE.search(value):
                raise InputError(
                    f"line {element.line}: {name} = '{value[:SHOWN_LENGTH_MAX]}' of <{element.tag}> is not finite",
                    "finite numbers",
                    EXAMPLE,
                )
        if element.tag == "mesh" and "builtin" in element.attributes:
            raise InputError(
                f"line {element.line}: <mesh builtin> is generated by MuJoCo", "vertices, or an <inertial>", EXAMPLE
            )

    def _blank_attributes(self, element: Element) -> None:
        used = self.attributes.get(element.tag, "").split()
        if used == ["*"]:
            return
        for attribute in self._attributes(element):
            name = attribute[1].decode()
            if name in used:
                continue
            self._blank(element.start + attribute.start(), element.start + attribute.end())
            if name.partition(":")[0] != "xmlns":
                self.unused[element.tag, name[:SHOWN_LENGTH_MAX]].append(element.line)

    def _blank(self, start: int, end: int) -> None:
        self.content[start:end] = self.content[start:end].translate(BLANK_TABLE)

    def notes(self) -> list[str]:
        """Return a note for each kind of element and attribute that is left out."""
        lines = []
        for elements in self.elements.values():
            elements.sort(key=lambda element: element.start)
        for tag, elements in sorted(self.elements.items(), key=lambda group: group[1][0].start):
            bodies = ", with the bodies that it generates" if tag in BODY_GENERATORS else ""
            lines.append(f"{len(elements)} <{tag}> left out{bodies}: {listed([element.shown for element in elements])}")
        for (tag, name), numbers in self.unused.items():
            where = listed([str(number) for number in dict.fromkeys(numbers)])
            lines.append(f"attribute '{name}' of {len(numbers)} <{tag}> left out (line {where})")
        return lines + self.lost


def _named_motors(element: Element) -> list[NamedMotor]:
    """Return the motors that a `<transmission>` or `<ros2_control>` element names; none for any other element."""
    if element.tag not in ("transmission", "ros2_control"):
        return []
    motors = []
    for joint in (part for part in element.children if part.tag == "joint" and part.attributes.get("name")):
        parts = [joint, *(part for part in element.children if part.tag == "actuator")]
        interfaces = [text_of(part, "hardwareInterface").rpartition("/")[2] for part in parts]
        interfaces += [part.attributes.get("name", "") for part in joint.children if part.tag == "command_interface"]
        if element.tag == "ros2_control" and not any(interfaces):
            continue  # a joint that is only measured
        reductions = [text_of(part, "mechanicalReduction") for part in parts]
        facts = [("interface", interfaces), ("reduction", reductions)]
        words = "".join(f"; {what} {next(filter(None, texts))[:SHOWN_LENGTH_MAX]}" for what, texts in facts if any(texts))
        motors.append(NamedMotor(joint.attributes["name"], f"<{element.tag}> {element.shown}", words))
    return motors


def _lost_joint(joint: Element, outer: Element) -> str:
    """Return the note for a joint of a URDF that is not read; `outer` is the unsupported element that contains it."""
    ends = [child.attributes.get("link") or child.text.strip() for child in joint.children if child.tag in ("parent", "child")]
    between = f" between {' and '.join(f'{end!r}' for end in ends)}" if len(ends) == 2 else ""
    within = f" in <{outer.tag}>" if outer is not joint else ""
    return f"joint {joint.shown}{within}{between} left out: if it closes a loop, the loop is open here"


def _count(element: Element) -> int:
    """Return the number of copies that a <replicate> element makes."""
    text = element.attributes.get("count", "").strip()
    if not COUNT.fullmatch(text):
        raise InputError(f"line {element.line}: count = '{text}' of <replicate>", f"an integer up to {BODIES_MAX}", EXAMPLE)
    return int(text)
