"""Store the assembled mechanism in the DXF of its parts, as an invisible block that `import` reads.

Bars are polylines through their pins. Points on layer ``pins`` join two bodies, points on layer ``ground`` are fixed, and lines
on layer ``guide`` are guides. Names, masses and joined bodies are extended data (XDATA) of these entities, in JSON.
"""

from __future__ import annotations

import json
import math
from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import chain, count
from typing import Any

from scissordyn.components.place import GROUND, BodyPoint, Point
from scissordyn.errors import InputError
from scissordyn.exchange.drawing import Block, Drawing, DrawnBar, Pair, mechanism_of_drawing
from scissordyn.model.body import Body
from scissordyn.model.mechanism import Mechanism

BLOCK = "scissordyn_assembly"  # Name of the DXF block with the assembled mechanism
APPLICATION = "SCISSORDYN"  # Application name of the extended data that an exported DXF contains
CHUNK_LENGTH = 240  # [characters] Length of the strings into which the extended data of a DXF is divided; DXF allows 255

EXPECTED_DXF = "a DXF that scissordyn export wrote, with its data"  # Expected value in errors about damaged DXF data


def assemble(mechanism: Mechanism) -> dict[str, Body] | None:
    """Return the bodies by name, moved to their start positions and angles; None if the mechanism cannot be assembled."""
    from scissordyn.exchange.mjcf_text import place_bodies

    try:
        start = place_bodies(mechanism.ideal())
    except InputError:
        return None
    return {
        name: replace(here.body, position=(here.origin.real, here.origin.imag), angle=here.angle)
        for name, here in start.items()
    }


def left_out(mechanism: Mechanism) -> list[str]:
    """Return a note for each kind of part that the assembly in the DXF of a mechanism does not contain."""
    if assemble(mechanism) is None:
        return ["the assembly: left out of the DXF, as the bodies cannot be assembled"]
    parts: dict[str, tuple[Any, ...]] = {
        "components": mechanism.components,
        "drives": (*mechanism.drives, *mechanism.coordinate_drives),
        "couplings": mechanism.couplings,
        "rods": mechanism.rods,
        "latches": mechanism.latches,
        "welds": mechanism.welds,
        "clearances": (*mechanism.clearance_joints, *(guide for guide in mechanism.guides if guide.clearance)),
        "speeds at the start": tuple(body for body in mechanism.bodies if body.velocity or body.angular_velocity),
    }
    notes = [f"{what}: left out of the assembly in the DXF ({len(listed)})" for what, listed in parts.items() if listed]
    if mechanism.gravity:
        notes.append("gravity: left out of the assembly in the DXF")
    return notes


def add_assembly(document: Any, mechanism: Mechanism) -> None:
    """Add the block with the assembled mechanism to a DXF in millimetres; add nothing if it cannot be assembled."""
    places = assemble(mechanism)
    if places is None:
        return
    if APPLICATION not in document.appids:
        document.appids.add(APPLICATION)
    block = document.blocks.new(BLOCK)
    pin_of, pins = _pins(mechanism, places)

    def add(entity: Any, **data: Any) -> None:
        text = json.dumps(data)
        entity.set_xdata(APPLICATION, [(1000, text[k : k + CHUNK_LENGTH]) for k in range(0, len(text), CHUNK_LENGTH)])

    def mm(place: Point) -> Point:
        return 1e3 * place[0], 1e3 * place[1]

    for body in mechanism.bodies:
        if not body.rotates:
            continue
        body_pins = [pin_of[body.name, point] for point in body.points]
        corners = [mm(pins[pin]) for pin in body_pins]
        placed = places[body.name]
        (x, y), (ox, oy) = placed.turned(body.centre), placed.placed_position
        layer = {"layer": "bars"}
        line = (
            block.add_lwpolyline(corners, dxfattribs=layer) if len(corners) > 1 else block.add_point(*corners, dxfattribs=layer)
        )
        add(line, bar=body.name, pins=body_pins, mass=body.mass, inertia=body.inertia, centre=[ox + x, oy + y])
    guided = {guide.follower[0] for guide in mechanism.guides}
    for body in mechanism.bodies:
        if not body.rotates and body.name not in guided:
            pin = pin_of[body.name, next(iter(body.points))]
            add(block.add_point(mm(pins[pin]), dxfattribs={"layer": "bars"}), block=body.name, pin=pin, mass=body.mass)
    for point, place in mechanism.ground:
        add(block.add_point(mm(place), dxfattribs={"layer": "ground"}), fixed=pin_of[GROUND, point])
    for joint in mechanism.joints:
        pin, (journal, bearing) = pin_of[joint.journal], joint.bodies
        point = block.add_point(mm(pins[pin]), dxfattribs={"layer": "pins"})
        add(point, joint=joint.name, pin=pin, journal=journal, bearing=bearing)
    for guide in mechanism.guides:
        name, point = guide.follower
        turn = 0.0 if guide.body == GROUND else places[guide.body].placed_angle
        here = pins[pin_of[guide.follower]]
        length = max(mechanism.size, 1e-3)
        end = here[0] + length * math.cos(guide.direction + turn), here[1] + length * math.sin(guide.direction + turn)
        data: dict[str, Any] = {
            "guide": guide.name,
            "pin": pin_of[name, point],
            "carrier": guide.body,
            "aligned": guide.aligned,
        }
        body = mechanism.body(name)
        data |= {"follower": name} if body.rotates else {"block": name, "mass": body.mass}
        add(block.add_line(mm(here), mm(end), dxfattribs={"layer": "guide"}), **data)


def _pins(mechanism: Mechanism, places: Mapping[str, Body]) -> tuple[dict[BodyPoint, str], dict[str, Point]]:
    """Return the name of the pin at each body point, and the position of each pin; joined points share a pin."""
    at = {(GROUND, point): place for point, place in mechanism.ground}
    at |= {(body.name, point): places[body.name].place(point) for body in mechanism.bodies for point in body.points}
    group = {point: {point} for point in at}
    for joint in mechanism.joints:
        joined = group[joint.journal] | group[joint.bearing]
        group |= dict.fromkeys(joined, joined)
    names = defaultdict[int, list[str]](list)
    for joint in mechanism.joints:
        names[id(group[joint.journal])].append(joint.name)
    pin_of: dict[BodyPoint, str] = {}
    pins: dict[str, Point] = {}
    for (body, point), points in group.items():
        if (body, point) in pin_of:
            continue
        named = names[id(points)]
        name = named[0] if len(named) == 1 else _common_start(named) or f"{body} {point}"
        name = next(filter(lambda free: free not in pins, chain([name], (f"{name} {k}" for k in count(2)))))
        pins[name] = at[body, point]
        pin_of |= dict.fromkeys(points, name)
    return pin_of, pins


def _common_start(names: list[str]) -> str:
    """Return the common start of all names, for example "A" for "A 1" and "A 2"."""
    first, last = min(names, default=""), max(names, default="")
    return first[: next((k for k, pair in enumerate(zip(first, last, strict=False)) if pair[0] != pair[1]), None)].strip()


def assembly_of(document: Any) -> Any:
    """Return the block that `add_assembly` wrote; None if the drawing has no such block, or shows the block by an insert."""
    if BLOCK not in document.blocks or any(insert.dxf.name == BLOCK for insert in document.modelspace().query("INSERT")):
        return None
    return document.blocks.get(BLOCK)


def read_assembly(block: Any, factor: float, notes: list[str]) -> Mechanism:
    """Build the mechanism from the entities in the block that `add_assembly` wrote; `factor` is the drawing's unit [m]."""
    pins: dict[str, Point] = {}
    fixed: list[str] = []
    bars: list[DrawnBar] = []
    blocks: list[Block] = []
    pairs: list[Pair] = []
    try:
        for data, corners in _entities(block, factor):
            if "bar" in data:
                pins |= zip(map(str, data["pins"]), corners, strict=True)
                x, y = map(float, data["centre"])
                bar_pins = tuple(dict.fromkeys(map(str, data["pins"])))
                bars.append(DrawnBar(str(data["bar"]), bar_pins, float(data["mass"]), float(data["inertia"]), (x, y)))
            elif "fixed" in data:
                pins[str(data["fixed"])] = corners[0]
                fixed.append(str(data["fixed"]))
            elif "joint" in data:
                pairs.append(Pair(*(str(data[key]) for key in ("joint", "pin", "journal", "bearing"))))
            else:
                blocks.append(_block(data, corners))
                pins.setdefault(str(data["pin"]), corners[0])
        mechanism = mechanism_of_drawing(Drawing(pins, tuple(fixed), tuple(bars), tuple(blocks), pairs=tuple(pairs)))
    except InputError:
        raise
    except (KeyError, TypeError, ValueError, AttributeError, IndexError) as error:
        raise InputError(f"block '{BLOCK}' of the DXF: its data are damaged ({error})", EXPECTED_DXF) from None
    notes += [
        f"block '{BLOCK}' of the DXF is read; the separately drawn parts are not",
        "drive, gravity, clearances and components are not in the DXF",
    ]
    return mechanism


def _entities(block: Any, factor: float) -> Iterator[tuple[dict[str, Any], list[Point]]]:
    """Yield the data of each entity and its corners [m]."""
    for entity in block:
        if not entity.has_xdata(APPLICATION):
            raise ValueError(f"{entity.dxftype()} {entity.dxf.handle} has no extended data")
        data = json.loads("".join(str(tag.value) for tag in entity.get_xdata(APPLICATION) if tag.code == 1000))
        kind = entity.dxftype()
        if kind == "LWPOLYLINE":
            places = list(entity.vertices_in_wcs())
        else:
            places = [entity.dxf.location] if kind == "POINT" else [entity.dxf.start, entity.dxf.end]
        yield data, [(factor * float(place.x), factor * float(place.y)) for place in places]


def _block(data: Mapping[str, Any], corners: list[Point]) -> Block:
    if len(corners) == 1:
        return Block(str(data["block"]), str(data["pin"]), None, float(data["mass"]))
    (x, y), (further_x, further_y) = corners
    direction = math.atan2(further_y - y, further_x - x)
    carrier, follower = str(data["carrier"]), str(data.get("follower", ""))
    guide = str(data["guide"])
    name, mass = (guide, 0.0) if follower else (str(data["block"]), float(data["mass"]))
    return Block(name, str(data["pin"]), direction, mass, carrier, follower, bool(data["aligned"]), guide)
