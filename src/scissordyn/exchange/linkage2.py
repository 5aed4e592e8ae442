"""Read mechanisms of David Rector's Linkage program: files that end in .linkage2.

Connectors are pins, links are bars between them. Lengths are in 1/96 inch. A positive speed of an input turns clockwise.
"""

from __future__ import annotations

import math
from itertools import combinations
from typing import Any

from scissordyn.annotation import SHOWN_LENGTH_MAX
from scissordyn.components.place import GROUND, Point
from scissordyn.components.time_function import ConstantSpeed
from scissordyn.errors import InputError
from scissordyn.exchange.drawing import (
    LINEAR_DENSITY,
    Block,
    Drawing,
    Imported,
    mechanism_of_drawing,
    plain_name,
    uniform,
    with_printable_notes,
)
from scissordyn.exchange.source import POINTS_MAX
from scissordyn.exchange.xml_element import Element, is_true, numbers, parse
from scissordyn.units import checked, rpm

EXAMPLE = "scissordyn import crane.linkage2 -o case.toml"  # Correct command, which error texts show
LENGTH_UNIT = 0.0254 / 96.0  # [m] length unit of coordinates in .linkage2 files, 1/96 inch
MECHANISM_LAYER_BIT = 16  # Bit of the attribute `layer` that marks parts of the mechanism; parts without it are decoration

# [m] largest distance between points of a .linkage2 file that coincide; coordinates have six decimals
GEOMETRY_TOL = 1e-6 * LENGTH_UNIT


@checked
def read_linkage2(text: str, *, linear_density: float = LINEAR_DENSITY) -> Imported:
    """Return the mechanism of a file of the Linkage program.

    Parameters
    ----------
    text : str
        Content of the file.
    linear_density : float
        Mass per length of the bars, which have no mass in the file [kg/m].

    Returns
    -------
    Imported
        Pins and bars are named by the identifiers of the file, "pin 7" and "link 2", or by the names given there.

    Raises
    ------
    InputError
        If the text is not such a file, or contains actuators, gears, chains, fastened parts or curved slides.
    """
    root = parse(text.encode("utf-8", "replace"))
    if root.tag != "linkage2":
        raise InputError(f"the root of the file is <{root.tag}>", "<linkage2>, as the Linkage program writes it", EXAMPLE)
    notes: list[str] = []
    drawing = _Linkage(root, linear_density, notes).drawing()
    notes.append("gravity: none in the file, so it is 0; set structure.gravity")
    return with_printable_notes(mechanism_of_drawing(drawing), notes)


class _Linkage:
    """Connectors and links of a .linkage2 file."""

    def __init__(self, root: Element, density: float, notes: list[str]) -> None:
        self.density, self.notes = density, notes
        parts = [part for part in root.children if part.tag in ("connector", "Link", "element") and _is_in_mechanism(part)]
        if len(parts) > POINTS_MAX:
            raise InputError(f"the file has {len(parts)} parts", f"at most {POINTS_MAX}", EXAMPLE)
        for part in parts:
            _check_supported(part)
        if any(part.tag == "ratios" and part.children for part in root.children):
            raise InputError("the file contains gears or chains", "links, anchors, sliders and inputs", EXAMPLE)
        scales = [_number(part, "scalefactor", "1") for part in root.children if part.tag == "program"]
        notes += [f"the scale factor {scale:g} of the drawing is not applied" for scale in scales if scale != 1.0]
        self.connectors = {_identifier(part): part for part in parts if part.tag == "connector"}
        self.pins = dict(zip(self.connectors, _names(self.connectors.values(), "pin"), strict=True))
        self.places: dict[str, Point] = {
            self.pins[key]: (LENGTH_UNIT * _number(part, "x", ""), LENGTH_UNIT * _number(part, "y", ""))
            for key, part in self.connectors.items()
        }
        links = [part for part in parts if part.tag != "connector"]
        self.link_pins = dict(zip(_names(links, "link"), map(self._pins_of, links), strict=True))
        self.fixed = {self.pins[key] for key, part in self.connectors.items() if is_true(part.attributes.get("anchor", ""))}
        # a link between anchors is part of the ground
        self.bars = {name: pins for name, pins in self.link_pins.items() if len(pins) > 1 and not self.fixed.issuperset(pins)}

    def _pins_of(self, link: Element) -> tuple[str, ...]:
        keys = [_identifier(child) for child in link.children if child.tag == "connector"]
        if unknown := [key for key in keys if key not in self.pins]:
            what = f"link {link.shown} refers to the unknown connector '{unknown[0][:SHOWN_LENGTH_MAX]}'"
            raise InputError(what, "connectors of the file", EXAMPLE)
        return tuple(dict.fromkeys(self.pins[key] for key in keys))

    def drawing(self) -> Drawing:
        """Return the linkage with its sliders and inputs."""
        bars = tuple(uniform(name, pins, self.places, self.density) for name, pins in self.bars.items())
        if not bars:
            raise InputError("the file contains no link that moves", "links between connectors", EXAMPLE)
        sliders = {key: part for key, part in self.connectors.items() if is_true(part.attributes.get("slider", ""))}
        blocks = [*filter(None, (self._slider(key, part) for key, part in sliders.items()))]
        drives: dict[str, ConstantSpeed] = {}
        for key, part in self.connectors.items():
            if is_true(part.attributes.get("input", "")):
                drives |= self._input(self.pins[key], part)
        if not drives:
            self.notes.append("no input turns a link: the mechanism moves freely")
        self.notes.append(f"masses: none in the file; {self.density:g} kg/m is assumed")
        for first, second in combinations(self.places, 2):
            if math.dist(self.places[first], self.places[second]) <= GEOMETRY_TOL:
                self.notes.append(f"'{first}' and '{second}' are at one place, but not joined")
        fixed = tuple(pin for pin in self.places if pin in self.fixed)
        return Drawing(self.places, fixed, bars, tuple(blocks), drives)

    def _slider(self, key: str, part: Element) -> Block | None:
        """Return the guided block of a connector that slides along the line through two others; None if it cannot move."""
        pin = self.pins[key]
        limits = [_identifier(child) for child in part.children if child.tag == "slidelimit"]
        if len(limits) != 2 or not all(limit in self.pins for limit in limits):
            raise InputError(f"slider {part.shown} has {len(limits)} connectors to slide between", "two connectors", EXAMPLE)
        first, second = (self.pins[limit] for limit in limits)
        (x, y), (other_x, other_y), place = self.places[first], self.places[second], self.places[pin]
        along = math.atan2(other_y - y, other_x - x)
        off = abs(math.cos(along) * (place[1] - y) - math.sin(along) * (place[0] - x))
        if off > GEOMETRY_TOL:
            self.notes.append(f"'{pin}' is {off:.3g} m beside its slide, which is moved to it")
        carriers = [name for name, pins in self.link_pins.items() if first in pins and second in pins and pin not in pins]
        carrier = next((name for name in carriers if name in self.bars), GROUND)
        if carrier == GROUND and not {first, second} <= self.fixed:
            raise InputError(
                f"slider {part.shown} slides between connectors of two links", "two connectors of one link", EXAMPLE
            )
        bars_at_pin = [name for name, pins in self.bars.items() if pin in pins]
        if (carrier == GROUND and pin in self.fixed) or not (bars_at_pin or pin in self.fixed):
            return None
        self.notes.append(f"'{pin}' slides along a line without ends")
        if bars_at_pin and pin not in self.fixed:
            return Block("", pin, along, carrier=carrier, follower=bars_at_pin[0], guide=f"slide of {pin}")
        # the pin of the block is fixed, so that its mass has no effect
        return Block(f"block of {pin}", pin, along, self.density * LENGTH_UNIT, carrier, guide=f"slide of {pin}")

    def _input(self, pin: str, part: Element) -> dict[str, ConstantSpeed]:
        """Return the constant speed of the link at an input, by link name; empty for an input by hand or to and fro."""
        turning = [name for name, pins in self.bars.items() if pin in pins]
        attributes: dict[str, Any] = part.attributes
        speed = _number(part, "rpm", "15")  # the Linkage program assumes 15 rpm if the file has no speed
        reason = (
            f"{len(turning)} links are at it"
            if len(turning) != 1
            else "it is not an anchor"
            if pin not in self.fixed
            else "it is operated by hand"
            if is_true(attributes.get("alwaysmanual", ""))
            else "it turns to and fro"
            if _number(part, "limitangle", "0") > 0.0
            else ""
        )
        if reason:
            self.notes.append(f"the input at '{pin}' is left out: {reason}")
            return {}
        self.notes.append(f"the input at '{pin}' turns '{turning[0]}' by {abs(speed):g} rpm {'counter' * (speed < 0)}clockwise")
        return {turning[0]: ConstantSpeed(-rpm(speed))}


def _is_in_mechanism(part: Element) -> bool:
    """Return True for a part of the mechanism, False for decoration."""
    layers = part.attributes.get("layer", "")
    return not layers.isdecimal() or int(layers[:9]) == 0 or int(layers[:9]) & MECHANISM_LAYER_BIT != 0


def _check_supported(part: Element) -> None:
    """Raise `InputError` for an actuator, a gear, a fastened part or a curved slide."""
    attributes = part.attributes
    kinds = [f"{name}s" for name in ("actuator", "gear") if is_true(attributes.get(name, ""))]
    kinds += ["fastened parts"] * any(name in attributes for name in ("fasten", "fastenlink", "fastenconnector"))
    kinds += ["fastened parts"] * any(child.tag == "fastenconnector" for child in part.children)
    kinds += ["curved slides"] * (_number(part, "slideradius", "0") != 0.0)
    if kinds:
        raise InputError(
            f"{part.tag.lower()} {part.shown}: {kinds[0]} are not read", "links, anchors, sliders and inputs", EXAMPLE
        )


def _number(part: Element, name: str, default: str) -> float:
    return numbers(part.attributes.get(name) or default, 1, f"line {part.line}: {name}")[0]


def _identifier(part: Element) -> str:
    return part.attributes.get("id", "")


def _names(parts: Any, kind: str) -> list[str]:
    """Return a unique name for each part: its name in the file, or its kind and identifier, such as "pin 7"."""
    names: list[str] = []
    for part in parts:
        names.append(plain_name(part.attributes.get("name") or f"{kind} {_identifier(part)[:SHOWN_LENGTH_MAX]}", names))
    return names
