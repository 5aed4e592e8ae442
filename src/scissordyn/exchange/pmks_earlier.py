"""Links of PMKS+ in its earlier form: ``?j=A,1.4,0.485,AB,R,t,0,0.1,t,%0A...&l=...&f=...&s=10,false,false,m``.

One line for each joint (name, place, links, R or P, on the ground, angle of a slide, friction, input), link (name, mass,
inertia, mass centre, joints, forces, outline) and force (name, link, two ends of an arrow, global, outward, size), and the
settings: speed of the input, clockwise, gravity, unit of length. A later one has R or P behind the name of a link.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from urllib.parse import parse_qs

from scissordyn.component.place import Point
from scissordyn.errors import InputError
from scissordyn.exchange.unused import fields_left_out

AGAIN = "links of bars, pins and forces; open the link in PMKS+, and share it again"
TRUE = ("t", "true")


@dataclass(frozen=True)
class Earlier:
    """What a link says, in its own units."""

    pins: dict[str, Point]
    fixed: tuple[str, ...]
    inputs: tuple[str, ...]
    bars: dict[str, tuple[float, float, Point, tuple[str, ...]]]  # Mass, inertia, mass centre, pins
    forces: list[tuple[str, str, Point, Point, bool]]  # Name, bar, place, force, whether it follows the bar
    speed: float  # [rpm], negative clockwise
    gravity: bool
    unit: str


def is_earlier(link: str) -> bool:
    """Whether a link has the earlier form."""
    return link.partition("?")[2].startswith("j=")


def read_earlier(link: str, notes: list[str]) -> Earlier:
    """The parts of a link; what is not used is added to the notes."""
    parts = {
        key: values[0] for key, values in parse_qs(link.partition("?")[2].partition("#")[0], keep_blank_values=True).items()
    }
    if "l" not in parts:
        raise InputError("a link of the earlier form of PMKS+ without links ('&l=')", AGAIN)
    joints = [line.split(",") for line in _lines(parts.pop("j"))]
    links = [line.split(",") for line in _lines(parts.pop("l"))]
    forces = [line.split(",") for line in _lines(parts.pop("f", ""))]
    settings = [*parts.pop("s", "").split(","), "", "", "", ""]
    notes += fields_left_out({f"'{key}' of the link": value for key, value in parts.items()})
    sliding = [joint[0] for joint in joints if len(joint) > 4 and joint[4] == "P"]
    if sliding or any(len(joint) < 9 for joint in joints):
        what = f"joint '{sliding[0]}', which slides" if sliding else "a joint of fewer than 9 entries"
        raise InputError(f"a link of the earlier form of PMKS+ with {what}", AGAIN)
    bars = {}
    for name, *entries in links:
        entries = entries[1:] if entries[:1] in (["R"], ["P"]) else entries
        if len(entries) < 5:
            raise InputError(f"link '{name}' of {len(entries) + 1} entries", AGAIN)
        mass, inertia, x, y = (_number(entry, f"link '{name}'") for entry in entries[:4])
        bars[name] = mass, inertia, (x, y), tuple(filter(None, entries[4].split("|")))
    frictional = sum(_number(joint[7] or "0", f"joint '{joint[0]}'") != 0.0 for joint in joints)
    notes += fields_left_out({f"friction of {frictional} joints": frictional, "outlines of links": len(links)})
    clockwise = settings[1] in TRUE
    speed = _number(settings[0] or "0", "speed of the input")
    return Earlier(
        pins={
            joint[0]: (_number(joint[1], f"joint '{joint[0]}'"), _number(joint[2], f"joint '{joint[0]}'")) for joint in joints
        },
        fixed=tuple(joint[0] for joint in joints if joint[5] in TRUE),
        inputs=tuple(joint[0] for joint in joints if joint[8] in TRUE),
        bars=bars,
        forces=[_force(force) for force in forces],
        speed=-speed if clockwise else speed,
        gravity=settings[2] in TRUE,
        unit=settings[3],
    )


def _lines(text: str) -> list[str]:
    return [line for line in text.splitlines() if line.strip()]


def _number(text: str, what: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(f"{what}: '{text}' in the link of PMKS+", "a number")
    return value


def _force(entries: list[str]) -> tuple[str, str, Point, Point, bool]:
    if len(entries) not in (9, 10):
        raise InputError(f"force '{entries[0]}' of {len(entries)} entries", AGAIN)
    x, y, to_x, to_y = (_number(entry, f"force '{entries[0]}'") for entry in entries[2:6])
    size, way = math.hypot(*(_number(entry, f"force '{entries[0]}'") for entry in entries[8:])), math.hypot(to_x - x, to_y - y)
    if not way > 0.0:
        raise InputError(f"force '{entries[0]}' without direction", "an arrow with a length")
    signed = size / way if entries[7] in TRUE else -size / way
    return entries[0], entries[1], (x, y), (signed * (to_x - x), signed * (to_y - y)), entries[6] not in TRUE
