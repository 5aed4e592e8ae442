"""Parse a PMKS+ link: the address of a drawing in Worcester Polytechnic Institute's planar linkage simulator.

The format was read from the public source of PMKS+ (github.com/PMKS-Web/PMKSWeb, src/app/services/transcoding). Sections after
the question mark end with a dot: truth values, decimal settings, integer settings, units, one section for each joint, an empty
one, one for each link, an empty one, one for each force, an empty one, and the selected part. The last character is the length
of all previous characters modulo 62. Numbers are integers of thousandths in base 64; a leading zero marks a negative one. The
format has no version field: a later version is recognised by additional sections and characters.

An earlier format is ``?j=A,1.4,0.485,AB,R,t,0,0.1,t,%0A...&l=...&f=...&s=10,false,false,m`` with one line for each part. Joint:
name, place, links, R or P, on the ground, angle of a slide, friction, input. Link: name, mass, inertia, mass centre, joints,
forces, outline. Force: name, link, two ends of an arrow, global, outward, magnitude. Settings: input speed, clockwise, gravity,
length unit. A later version of this format has R or P after the name of a link.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from urllib.parse import parse_qs, unquote

from scissordyn.components.place import Point
from scissordyn.errors import InputError
from scissordyn.exchange.drawing import Load, plain_name

BASE64_DIGITS = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz_-"  # Digits 0 to 63 of numbers in a PMKS+ link
EXAMPLE = "scissordyn import 'https://app.pmksplus.com/?...' -o case.toml"  # Correct command, which error texts show
EXPECTED_LINK = "a link from 'Share' in PMKS+"  # Expected value in errors about damaged PMKS+ links
SUPPORTED_LINKS = "links of bars, pins and forces; open the link in PMKS+, and share it again"
"""Expected value in errors about PMKS+ links of the earlier format."""


PRISMATIC, INPUT, GROUNDED, WELDED, _, SEALED = range(6)  # Bit positions in the flags of a joint in a PMKS+ link
CLOCKWISE, GRAVITY = 0, 1  # Bit positions in the settings of a drawing: input turns clockwise, gravity acts

TRUE_TEXTS = ("t", "true")  # Texts that mean true in the earlier format of PMKS+ links

LENGTH_UNITS = (("in", 0.0254, 0.45359237, 4.4482216152605), ("cm", 0.01, 1.0, 1.0), ("m", 1.0, 1.0, 1.0))
"""Length unit with its length [m], and the mass [kg] and force [N] that are the units of drawings with this length unit."""

LINK_KINDS = dict.fromkeys("YAMG0123", True) | dict.fromkeys("Namg4567", False)
"""Allowed first characters of a link's text in PMKS+: True for a separate link, False for a part of a welded link."""

COMPUTED_BY_PMKS = {"inertia": "AMam1256", "centre": "AGag1357"}
"""First characters of links whose inertia or mass centre PMKS+ computes from the drawn outline."""


@dataclass(frozen=True)
class PmksJoint:
    name: str
    flags: int
    place: Point
    angle: float = 0.0
    slot: tuple[str, ...] = ()
    speed: float = 0.0  # [rpm]

    def has(self, bit: int) -> bool:
        return bool(self.flags >> bit & 1)


@dataclass(frozen=True)
class PmksLink:
    name: str
    mass: float
    inertia: float
    centre: Point
    joints: tuple[str, ...]
    first: str = "Y"  # First character of the link's record
    piston: bool = False


@dataclass(frozen=True)
class Sketch:
    """Content of a PMKS+ link of either format, in SI units; joints and links by name."""

    joints: dict[str, PmksJoint]
    links: dict[str, PmksLink]
    loads: list[Load]  # Loads; their bars are keys of `links`
    speed: float  # Input speed [rpm], negative clockwise
    gravity: bool
    scale: float  # Length unit [m]


def read_link(link: str, notes: list[str], letters_max: int = 50_000) -> Sketch:
    """Parse a link of the present or the earlier format; add a note for each part that is left out.

    `letters_max`: [characters] Length of the longest link that is read; a link of this length has about a thousand joints.
    """
    if len(link) > letters_max:
        raise InputError(f"the link of PMKS+ has more than {letters_max} characters", EXPECTED_LINK, EXAMPLE)
    return (_read_earlier if link.partition("?")[2].startswith("j=") else _read_present)(link.strip(), notes)


def _read_present(link: str, notes: list[str]) -> Sketch:
    """Parse a link of the present format."""
    sections = _sections(link)
    scale, kilogram, newton = _units(sections[3], notes)
    flags = _unsigned(sections[0], "settings")
    speed = _integer(sections[2].split(",")[0], "input speed")
    at = iter(sections[4:])
    joints = {record[0][1:]: _joint(record, scale) for record in _records(at, "joints")}
    links = [(record[0], _link(record, scale, kilogram)) for record in _records(at, "links")]
    loads = [_force(record, scale, newton) for record in _records(at, "forces", last=True)]
    _check_rest(list(at), notes)
    return Sketch(
        joints,
        {key[2:]: part for key, part in links if LINK_KINDS[part.first]},
        loads,
        speed=-speed if flags & 1 << CLOCKWISE else speed,
        gravity=bool(flags & 1 << GRAVITY),
        scale=scale,
    )


def _sections(link: str) -> list[str]:
    """Split the address into sections; raise `InputError` if its check character is wrong."""
    text = unquote(link)
    content = text.partition("?")[2] if "?" in text else text
    if "#" in content:
        content = content.partition("#")[0]
    if content.count(".") < 6 or not all(letter.isprintable() for letter in content):
        raise InputError(f"'{link if len(link) <= 60 else f'{link[:57]}...'}' is not a link of PMKS+", EXPECTED_LINK, EXAMPLE)
    body, check = content[:-1], content[-1]
    if BASE64_DIGITS[len(body) % 62] != check:
        raise InputError(
            f"the link of PMKS+ is damaged: {len(body)} characters end in '{check}' instead of "
            f"'{BASE64_DIGITS[len(body) % 62]}'",
            f"{EXPECTED_LINK}, copied completely",
            EXAMPLE,
        )
    sections = body.split(".")
    counts = [len(part.split(",")) for part in sections[1:3]]
    if counts[0] > 2 or counts[1] > 2 or not 3 <= len(sections[3]) <= 4 or len(sections[0]) > 2:
        raise _unsupported_version(f"{counts[0]} decimal and {counts[1]} integer settings and {len(sections[3])} units")
    return sections


def _unsupported_version(what: str) -> InputError:
    return InputError(
        f"the link is from an unsupported later version of PMKS+: {what}",
        "a link of PMKS+ up to version 2.0.3, or one without newer features",
        EXAMPLE,
    )


def _units(digits: str, notes: list[str]) -> tuple[float, float, float]:
    length, angle, force = (BASE64_DIGITS.index(digit) if digit in BASE64_DIGITS else 99 for digit in digits[:3])
    if length > 2 or angle > 1 or force > 1:
        raise InputError(f"units '{digits}' of the link", "inch, cm or m; degree or radian; pound or newton", EXAMPLE)
    name, scale, mass, newton = LENGTH_UNITS[length]
    pounds = force == 0
    notes.append(
        f"units: lengths in {name}, masses in {'lb' if name == 'in' else 'kg'}, inertias in "
        f"{'lb in^2' if name == 'in' else 'kg cm^2' if name == 'cm' else 'kg m^2'}, forces in {'lbf' if pounds else 'N'}; "
        "length and force units are those of the link, mass units those that PMKS+ displays"
    )
    return scale, mass, LENGTH_UNITS[0][3] if pounds else 1.0 if name != "in" else newton / LENGTH_UNITS[0][3]


def _records(sections: Iterator[str], what: str, *, last: bool = False) -> Iterator[list[str]]:
    for section in sections:
        if not section:
            return
        yield section.split(",")
    if not last:
        raise InputError(f"the link of PMKS+ ends within its {what}", f"{EXPECTED_LINK}, copied completely", EXAMPLE)


def _joint(record: list[str], scale: float) -> PmksJoint:
    if len(record) not in (5, 8, 9):
        raise _unsupported_version(f"a joint of {len(record)} fields")
    flags = _unsigned(record[0][:1], "kind of a joint")
    if flags >> SEALED:
        raise _unsupported_version(f"joint '{record[1]}' is part of a cylinder")
    x, y, angle = (_decimal(field, f"place of joint '{record[1]}'") for field in record[2:5])
    slot = tuple(record[5:8])
    if any(slot) and not all(slot):
        raise InputError(f"the slot of joint '{record[1]}' does not name a link and two of its joints", EXPECTED_LINK, EXAMPLE)
    speed = _decimal(record[8], f"speed of joint '{record[1]}'") if len(record) > 8 else 0.0
    return PmksJoint(plain_name(record[1], ()), flags, (scale * x, scale * y), angle, slot if any(slot) else (), speed)


def _link(record: list[str], scale: float, kilogram: float) -> PmksLink:
    first, kind = record[0][:1], record[0][1:2]
    if first not in LINK_KINDS or kind not in ("R", "P") or len(record) < 9:
        raise _unsupported_version(f"a link that begins with '{record[0][:2]}'")
    mass, inertia, x, y = (_decimal(field, f"link '{record[1]}'") for field in record[2:6])
    joints = record[7 : record.index("", 7)] if "" in record[7:] else record[7:]
    centre = scale * x, scale * y
    return PmksLink(record[1], kilogram * mass, kilogram * scale**2 * inertia, centre, tuple(joints), first, kind == "P")


def _force(record: list[str], scale: float, newton: float) -> Load:
    if len(record) != 8:
        raise _unsupported_version(f"a force of {len(record)} fields")
    flags = _unsigned(record[0][:1], "kind of a force")
    x, y, to_x, to_y, size = (_decimal(field, f"force '{record[2]}'") for field in record[3:8])
    arrow = (x, y), (to_x - x, to_y - y)
    return _load(record[2], record[1], arrow, size if flags & 2 else -size, scale, newton, follows=bool(flags & 1))


def _load(name: str, bar: str, arrow: tuple[Point, Point], size: float, scale: float, newton: float, *, follows: bool) -> Load:
    """Return the load for an arrow with start and components in the units of the link, and a magnitude `size`."""
    (x, y), (along, up) = arrow
    length = math.hypot(along, up)
    if not length > 0.0:
        raise InputError(f"force '{name}' has no direction", "an arrow with a length", EXAMPLE)
    signed = newton * size / length
    return Load(plain_name(name, ()), bar, (scale * x, scale * y), (signed * along, signed * up), follows)


def _check_rest(rest: list[str], notes: list[str]) -> None:
    """Check the sections of a link after its forces; add notes for known parts, and raise `InputError` for unknown ones."""
    kinds = {"S": "a synthesis", "K": "colours", "C": "anchors of mass centres", "J": "locks", "L": "locks", "F": "locks"}
    if len(rest) > 2:
        raise _unsupported_version(f"{len(rest)} sections after the forces")
    letters = {entry[:1] for section in rest[1:] for entry in section.split(",") if entry}
    if letters - kinds.keys():
        raise _unsupported_version(f"an entry '{min(letters - kinds.keys())}' after the forces")
    notes += [f"{kinds[entry]} of the drawing: left out" for entry in sorted(letters)]


def _unsigned(text: str, what: str, digits_max: int = 12) -> int:
    """Return the value of an unsigned integer in base 64.

    `digits_max`: largest accepted number of digits, including the sign.
    """
    if not 0 < len(text) <= digits_max:
        wrong = f"has {len(text)} digits" if text else "is missing in the link of PMKS+"
        raise InputError(f"{what} {wrong}", f"{EXPECTED_LINK}, copied completely", EXAMPLE)
    value = 0
    for letter in text:
        if letter not in BASE64_DIGITS:
            raise InputError(f"{what} contains '{letter}', which is not a base-64 digit", EXPECTED_LINK, EXAMPLE)
        value = value * len(BASE64_DIGITS) + BASE64_DIGITS.index(letter)
    return value


def _decimal(text: str, what: str) -> float:
    return _integer(text, what) / 1000.0


def _integer(text: str, what: str) -> int:
    """Return a signed integer in base 64; a leading zero marks a negative one."""
    value = _unsigned(text, what)
    return -value if text[0] == "0" else value


def _read_earlier(link: str, notes: list[str]) -> Sketch:
    """Parse a link of the earlier format; add a note for each part that is left out."""
    query = (unquote(link) if "%3D" in link else link).partition("?")[2].partition("#")[0]
    parts = {key: values[0] for key, values in parse_qs(query, keep_blank_values=True).items()}
    if "l" not in parts:
        raise InputError("the link of the earlier PMKS+ format has no links ('&l=')", SUPPORTED_LINKS)
    joints, links, forces = (
        [line.split(",") for line in parts.pop(key, "").splitlines() if line.strip()] for key in ("j", "l", "f")
    )
    speed, clockwise, gravity, unit = [*parts.pop("s", "").split(","), "", "", "", ""][:4]
    notes += [f"'{key}' of the link: left out" for key, value in parts.items() if value]
    lengths = {name: row for name, *row in LENGTH_UNITS}
    if unit not in lengths:
        raise InputError(f"unknown unit '{unit}' of the link", ", ".join(lengths), EXAMPLE)
    scale, kilogram, newton = lengths[unit]
    sliding = [joint[0] for joint in joints if len(joint) > 4 and joint[4] == "P"]
    if sliding or any(len(joint) < 9 for joint in joints):
        what = f"joint '{sliding[0]}', which slides" if sliding else "a joint with fewer than 9 entries"
        raise InputError(f"the link of the earlier PMKS+ format has {what}", SUPPORTED_LINKS)
    frictional = sum(_number(joint[7] or "0", f"joint '{joint[0]}'") != 0.0 for joint in joints)
    if frictional:
        notes.append(f"friction of {frictional} joints: left out")
    if links:
        notes.append("outlines of links: left out")
    notes.append(f"units: lengths in {unit}, masses, inertias and forces in the units that PMKS+ displays")
    rpms = _number(speed or "0", "speed of the input")
    return Sketch(
        {joint[0]: _earlier_joint(joint, scale) for joint in joints},
        {name: _earlier_link(name, entries, scale, kilogram) for name, *entries in links},
        [_earlier_force(force, scale, newton) for force in forces],
        speed=-rpms if clockwise in TRUE_TEXTS else rpms,
        gravity=gravity in TRUE_TEXTS,
        scale=scale,
    )


def _earlier_joint(entries: list[str], scale: float) -> PmksJoint:
    x, y = (_number(entry, f"joint '{entries[0]}'") for entry in entries[1:3])
    flags = (entries[5] in TRUE_TEXTS) << GROUNDED | (entries[8] in TRUE_TEXTS) << INPUT
    return PmksJoint(plain_name(entries[0], ()), flags, (scale * x, scale * y))


def _earlier_link(name: str, entries: list[str], scale: float, kilogram: float) -> PmksLink:
    entries = entries[1:] if entries[:1] in (["R"], ["P"]) else entries
    if len(entries) < 5:
        raise InputError(f"link '{name}' has {len(entries) + 1} entries", SUPPORTED_LINKS)
    mass, inertia, x, y = (_number(entry, f"link '{name}'") for entry in entries[:4])
    joints = tuple(filter(None, entries[4].split("|")))
    return PmksLink(name, kilogram * mass, kilogram * scale**2 * inertia, (scale * x, scale * y), joints)


def _earlier_force(entries: list[str], scale: float, newton: float) -> Load:
    name = entries[0]
    if len(entries) not in (9, 10):
        raise InputError(f"force '{name}' has {len(entries)} entries", SUPPORTED_LINKS)
    x, y, to_x, to_y, *parts = (_number(entry, f"force '{name}'") for entry in (*entries[2:6], *entries[8:]))
    size = math.hypot(*parts) * (1.0 if entries[7] in TRUE_TEXTS else -1.0)
    arrow = (x, y), (to_x - x, to_y - y)
    return _load(name, entries[1], arrow, size, scale, newton, follows=entries[6] not in TRUE_TEXTS)


def _number(text: str, what: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(f"{what}: '{text}' in the link of PMKS+ is not a number", "a number")
    return value
