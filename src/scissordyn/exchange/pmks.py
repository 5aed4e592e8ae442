"""Links of PMKS+, the planar mechanism kinematic simulator of Worcester Polytechnic Institute: the address holds the linkage.

The form of the address was read from the public source of PMKS+ (github.com/PMKS-Web/PMKSWeb, src/app/services/transcoding):
behind the question mark stand sections with a dot after each: truth values, decimal settings, whole settings, units, then one
section for each joint, an empty one, one for each link, an empty one, one for each force, an empty one, and what was selected.
The last character is the length of all before it, modulo 62. Numbers are whole numbers of thousandths to the base of 64, a zero
in front means negative. There is no field for the version: a later one is known by the sections and characters that it adds.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from urllib.parse import unquote

from scissordyn.component.place import GROUND, Point
from scissordyn.component.time_function import ConstantSpeed, Trapezoidal
from scissordyn.errors import InputError
from scissordyn.exchange.drawing import (
    LINEAR_DENSITY,
    Block,
    Drawing,
    DrawnBar,
    Imported,
    Load,
    assembled,
    plain_name,
    uniform,
    with_point_mass,
)
from scissordyn.exchange.pmks_earlier import Earlier, is_earlier, read_earlier
from scissordyn.model.drive import Drive
from scissordyn.model.mechanism import Mechanism
from scissordyn.units import rpm

DIGITS = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz_-"
SAMPLE = "scissordyn import 'https://app.pmksplus.com/?...' -o case.toml"
ALLOWED = "a link that 'Share' of PMKS+ gives"

PRISMATIC, INPUT, GROUNDED, WELDED, _, SEALED = range(6)  # Bits of a joint
CLOCKWISE, GRAVITY = 0, 1  # Bits of the settings

LENGTHS = (("in", 0.0254, 0.45359237, 4.4482216152605), ("cm", 0.01, 1.0, 1.0), ("m", 1.0, 1.0, 1.0))
"""Length in m, mass in kg and force in N of each unit of length; masses of drawings in inches are pounds."""

SWING = 0.98  # Part of the way between two locking positions that an input takes

RAMP, STROKES = 0.05, 10_000
"""Part of a stroke in which an input that reverses slows down, and as many strokes as a motion can have."""

LINKS = {"Y": True, "A": True, "M": True, "G": True, "N": False, "a": False, "m": False, "g": False} | {
    str(digit): digit < 4 for digit in range(8)
}
"""First character of a link: whether it is a link of its own, not a part of a welded one. All but Y and N came later."""

AUTOMATIC = {"inertia": "AMam1256", "centre": "AGag1357"}
"""First characters of links whose inertia or mass centre PMKS+ computes from the outline that it draws."""


@dataclass(frozen=True)
class _Joint:
    name: str
    flags: int
    place: Point
    angle: float
    slot: tuple[str, ...]
    speed: float

    def has(self, bit: int) -> bool:
        return bool(self.flags >> bit & 1)


@dataclass(frozen=True)
class _Link:
    first: str
    piston: bool
    name: str
    mass: float
    inertia: float
    centre: Point
    joints: tuple[str, ...]


def read_pmks(link: str, *, linear_density: float = LINEAR_DENSITY) -> Imported:
    """The mechanism of a link of PMKS+.

    Parameters
    ----------
    link : str
        The whole address, or what stands behind its question mark.
    linear_density : float
        Mass per length of links that have none in the drawing [kg/m].

    Returns
    -------
    Imported
        Joints have the names of the drawing. A link that turns about the input has a drive with the speed of the drawing; a
        block that slides is a body without rotation in a guide.

    Raises
    ------
    InputError
        If it is not such a link, is damaged, or has what only a later version writes.
    """
    notes: list[str] = []
    if is_earlier(link):
        return _earlier(read_earlier(unquote(link.strip()) if "%3D" in link else link.strip(), notes), linear_density, notes)
    sections = _sections(link)
    scale, mass_unit, force_unit = _units(sections[3], notes)
    speed = _integer(sections[2].split(",")[0], "input speed")
    flags = _unsigned(sections[0], "settings")
    at = iter(sections[4:])
    joints = {record[0][1:]: _joint(record, scale) for record in _records(at, "joints")}
    links = {record[0][2:]: _link(record, scale, mass_unit) for record in _records(at, "links")}
    forces = list(_records(at, "forces", last=True))
    _check_rest(list(at), notes)
    links_used = {key: item for key, item in links.items() if LINKS[item.first]}
    names = _names(links_used)
    clear = {key: item.name for key, item in joints.items()}
    places = {item.name: item.place for item in joints.values()}
    bars: dict[str, DrawnBar] = {}
    blocks: list[Block] = []
    masses: dict[str, float] = {}
    for key, item in links_used.items():
        on = [joints[joint] for joint in item.joints]
        if item.piston or (len(on) == 2 and any(joint.has(PRISMATIC) for joint in on) and on[0].place == on[1].place):
            blocks.append(_block(names[key], item, on, joints, links_used, names, notes))
            masses[names[key]] = item.mass
        else:
            bars[names[key]] = _bar(
                names[key], item, tuple(clear[joint] for joint in item.joints), places, linear_density, notes
            )
    for block in blocks:
        if block.follower:
            bars[block.follower] = with_point_mass(bars[block.follower], places[block.pin], masses[block.name])
        if block.carrier != GROUND and block.carrier not in bars:
            raise InputError(f"block '{block.name}' slides on '{block.carrier}'", "a link", SAMPLE)
    slides = {item.name for item in joints.values() if item.has(PRISMATIC)}
    named_by = {bar for bar in bars for pin in bars[bar].pins if pin in slides}
    if named_by:
        raise InputError(
            f"link '{min(named_by)}' ends in a joint that slides without a block", "a slider with its block", SAMPLE
        )
    signed = -rpm(speed) if flags & 1 << CLOCKWISE else rpm(speed)
    drawing = Drawing(
        pins={pin: place for pin, place in places.items() if pin not in slides},
        fixed=tuple(item.name for item in joints.values() if item.has(GROUNDED) and not item.has(PRISMATIC)),
        bars=tuple(bars.values()),
        blocks=tuple(blocks),
        drives=_drives(joints, bars, signed, notes),
        gravity=9.81 if flags & 1 << GRAVITY else 0.0,
    )
    drawing = _with_loads(drawing, forces, names, scale, force_unit)
    if not drawing.gravity:
        notes.append("gravity: the link does not ask for it, and it is 0; set structure.gravity")
    return Imported(_reversing(assembled(drawing), notes), tuple(notes))


def _earlier(read: Earlier, density: float, notes: list[str]) -> Imported:
    """The mechanism of a link of the earlier form."""
    lengths = {name: row for name, *row in LENGTHS}
    if read.unit not in lengths:
        raise InputError(f"unit '{read.unit}' of the link", ", ".join(lengths), SAMPLE)
    scale, kilogram, newton = lengths[read.unit]
    pins = {pin: (scale * x, scale * y) for pin, (x, y) in read.pins.items()}
    bars = {}
    for name, (mass, inertia, (x, y), on) in read.bars.items():
        if unknown := [pin for pin in on if pin not in pins]:
            raise InputError(f"link '{name}' through '{unknown[0]}'", "joints of the link", SAMPLE)
        link = _Link("Y", False, name, kilogram * mass, kilogram * scale**2 * inertia, (scale * x, scale * y), on)
        bars[name] = _bar(name, link, on, pins, density, notes)
    notes.append(f"units: lengths in {read.unit}, masses, inertias and forces as PMKS+ shows them beside it")
    joints = {pin: _Joint(pin, 0, place, 0.0, (), 0.0) for pin, place in pins.items()}
    for pin in joints:
        flags = (pin in read.inputs) << INPUT | (pin in read.fixed) << GROUNDED
        joints[pin] = replace(joints[pin], flags=flags)
    loads = []
    for name, bar, place, force, follows in read.forces:
        if bar not in bars:
            raise InputError(f"force '{name}' on '{bar}'", "a force on a link", SAMPLE)
        point = plain_name(f"point of {name}", pins)
        pins[point] = scale * place[0], scale * place[1]
        bars[bar] = replace(bars[bar], pins=(*bars[bar].pins, point))
        loads.append(Load(plain_name(name, ()), bar, pins[point], (newton * force[0], newton * force[1]), follows))
    drawing = Drawing(
        pins=pins,
        fixed=read.fixed,
        bars=tuple(bars.values()),
        drives=_drives(joints, bars, rpm(read.speed), notes),
        loads=tuple(loads),
        gravity=9.81 if read.gravity else 0.0,
    )
    return Imported(_reversing(assembled(drawing), notes), tuple(notes))


def _sections(link: str) -> list[str]:
    """The sections of the address, after a check of its length."""
    text = unquote(link.strip())
    content = text.partition("?")[2] if "?" in text else text
    if "#" in content:
        content = content.partition("#")[0]
    if content.count(".") < 6 or not all(letter.isprintable() for letter in content):
        raise InputError(f"'{_short(link)}' is no link of PMKS+", ALLOWED, SAMPLE)
    body, check = content[:-1], content[-1]
    if DIGITS[len(body) % 62] != check:
        raise InputError(
            f"the link of PMKS+ is damaged: {len(body)} characters end in '{check}' in place of '{DIGITS[len(body) % 62]}'",
            f"{ALLOWED}, copied whole",
            SAMPLE,
        )
    sections = body.split(".")
    counts = [len(part.split(",")) for part in sections[1:3]]
    if counts[0] > 2 or counts[1] > 2 or not 3 <= len(sections[3]) <= 4 or len(sections[0]) > 2:
        raise _newer(f"{counts[0]} decimal and {counts[1]} whole settings and {len(sections[3])} units")
    return sections


def _newer(what: str) -> InputError:
    return InputError(
        f"the link comes from a later version of PMKS+ than is understood here: {what}",
        "links of PMKS+ up to version 2.0.3, and later ones that use nothing new",
        SAMPLE,
    )


def _units(digits: str, notes: list[str]) -> tuple[float, float, float]:
    length, angle, force = (DIGITS.index(digit) if digit in DIGITS else 99 for digit in digits[:3])
    if length > 2 or angle > 1 or force > 1:
        raise InputError(f"units '{digits}' of the link", "inch, cm or m; degree or radian; pound or newton", SAMPLE)
    name, scale, mass, newton = LENGTHS[length]
    pounds = force == 0
    notes.append(
        f"units: lengths in {name}, masses in {'lb' if name == 'in' else 'kg'}, inertias in "
        f"{'lb in^2' if name == 'in' else 'kg cm^2' if name == 'cm' else 'kg m^2'}, forces in {'lbf' if pounds else 'N'}; "
        "the link names those of length and force, PMKS+ shows those of masses"
    )
    return scale, mass, LENGTHS[0][3] if pounds else 1.0 if name != "in" else newton / LENGTHS[0][3]


def _records(sections: Iterator[str], what: str, *, last: bool = False) -> Iterator[list[str]]:
    for section in sections:
        if not section:
            return
        yield section.split(",")
    if not last:
        raise InputError(f"the link of PMKS+ ends within its {what}", f"{ALLOWED}, copied whole", SAMPLE)


def _joint(record: list[str], scale: float) -> _Joint:
    if len(record) not in (5, 8, 9):
        raise _newer(f"a joint of {len(record)} fields")
    flags = _digit(record[0][:1], "kind of a joint")
    if flags >> SEALED:
        raise _newer(f"joint '{record[1]}' is part of a cylinder")
    x, y, angle = (_decimal(field, f"place of joint '{record[1]}'") for field in record[2:5])
    slot = tuple(record[5:8])
    if any(slot) and not all(slot):
        raise InputError(f"slot of joint '{record[1]}' without its link or one of its two joints", ALLOWED, SAMPLE)
    speed = _decimal(record[8], f"speed of joint '{record[1]}'") if len(record) > 8 else 0.0
    return _Joint(plain_name(record[1], ()), flags, (scale * x, scale * y), angle, slot if any(slot) else (), speed)


def _link(record: list[str], scale: float, mass_unit: float) -> _Link:
    first, kind = record[0][:1], record[0][1:2]
    if first not in LINKS or kind not in ("R", "P") or len(record) < 9:
        raise _newer(f"a link that begins with '{record[0][:2]}'")
    mass, inertia, x, y = (_decimal(field, f"link '{record[1]}'") for field in record[2:6])
    joints = record[7 : record.index("", 7)] if "" in record[7:] else record[7:]
    return _Link(
        first, kind == "P", record[1], mass_unit * mass, mass_unit * scale**2 * inertia, (scale * x, scale * y), tuple(joints)
    )


def _names(links: dict[str, _Link]) -> dict[str, str]:
    names: dict[str, str] = {}
    for key, link in links.items():
        names[key] = plain_name(link.name or key, names.values())
    return names


def _bar(name: str, link: _Link, pins: tuple[str, ...], places: dict[str, Point], density: float, notes: list[str]) -> DrawnBar:
    if len(pins) < 2:
        raise InputError(f"link '{name}' with one joint", "two joints or more", SAMPLE)
    thin = uniform(name, pins, places, density)
    if not link.mass > 0.0:
        notes.append(f"link '{name}' has no mass in the drawing: {density:g} kg/m is assumed")
        return thin
    drawn = replace(thin, mass=link.mass, inertia=link.inertia, centre=link.centre)
    if not link.inertia > 0.0:
        notes.append(f"link '{name}' has no inertia in the drawing: that of a uniform bar is assumed")
        drawn = replace(drawn, inertia=thin.inertia * link.mass / thin.mass)
    for what, letters in AUTOMATIC.items():
        if link.first in letters:
            notes.append(f"{what} of link '{name}': as PMKS+ last computed it from the outline that it draws")
    return drawn


def _block(
    name: str,
    link: _Link,
    on: list[_Joint],
    joints: dict[str, _Joint],
    links: dict[str, _Link],
    names: dict[str, str],
    notes: list[str],
) -> Block:
    slides = [joint for joint in on if joint.has(PRISMATIC)]
    pins = [joint for joint in on if not joint.has(PRISMATIC)]
    if len(slides) != 1 or len(pins) != 1:
        raise InputError(f"block '{name}' with {len(pins)} pins and {len(slides)} slides", "one of each", SAMPLE)
    slide, mass = slides[0], link.mass
    if not mass > 0.0:
        raise InputError(f"block '{name}' without mass", "a mass in PMKS+: edit the slider", SAMPLE)
    carrier, direction = GROUND, slide.angle
    if slide.slot:
        carrier, ends = names.get(slide.slot[0], ""), [joints[joint].place for joint in slide.slot[1:] if joint in joints]
        if len(ends) == 2:
            direction = math.atan2(ends[1][1] - ends[0][1], ends[1][0] - ends[0][0])
    if not carrier or not (slide.slot or slide.has(GROUNDED)):
        raise InputError(f"block '{name}' slides on nothing", "a slide on the ground or on a link", SAMPLE)
    if slide.has(INPUT):
        notes.append(f"the input at slide '{slide.name}' is left out: a block is not driven here; add a rod or an actuator")
    if not pins[0].has(WELDED):
        return Block(name, pins[0].name, direction, mass, carrier)
    on_pin = [
        names[key]
        for key, other in links.items()
        if pins[0].name in [joints[j].name for j in other.joints] and not other.piston
    ]
    if len(on_pin) != 1:
        raise InputError(f"block '{name}' welded to {len(on_pin)} links", "one", SAMPLE)
    return Block(name, pins[0].name, direction, 0.0, carrier, follower=on_pin[0], aligned=True)


def _drives(joints: dict[str, _Joint], bars: dict[str, DrawnBar], speed: float, notes: list[str]) -> dict[str, ConstantSpeed]:
    driven: dict[str, ConstantSpeed] = {}
    for joint in joints.values():
        if not joint.has(INPUT) or joint.has(PRISMATIC):
            continue
        turning = [bar.name for bar in bars.values() if joint.name in bar.pins]
        if not joint.has(GROUNDED) or len(turning) != 1:
            notes.append(f"the input at joint '{joint.name}' is left out: it is not between the ground and one link")
            continue
        if not speed:
            notes.append(f"the input at joint '{joint.name}' has no speed: '{turning[0]}' is held")
        driven[turning[0]] = ConstantSpeed(math.copysign(rpm(joint.speed), speed) if joint.speed else speed)
    if not driven:
        notes.append("no input turns a link: the mechanism moves freely")
    return driven


def _reversing(mechanism: Mechanism, notes: list[str]) -> Mechanism:
    """The mechanism with an input that goes to and fro between the positions at which it locks, where PMKS+ reverses it."""
    from scissordyn.plan.plan import plan
    from scissordyn.run.ideal import motion_range

    if len(mechanism.drives) != 1 or not isinstance(mechanism.drives[0].motion, ConstantSpeed):
        return mechanism
    body, speed = mechanism.drives[0].body, mechanism.drives[0].motion.speed
    try:
        low, high, _ = motion_range(plan(mechanism))
    except InputError:  # what cannot be assembled is said where the mechanism is used
        return mechanism
    if not speed or not (math.isfinite(low) and math.isfinite(high)):
        return mechanism
    mean, first = 0.5 * (low + high), mechanism.body(body).angle or 0.0
    amplitude = math.copysign(max(SWING * 0.5 * (high - low), abs(first - mean)), speed)
    duration = 2.0 * amplitude / speed / (1.0 - RAMP)
    strokes = Trapezoidal(mean - amplitude, mean + amplitude, duration, RAMP, STROKES)
    notes.append(
        f"the input '{body}' locks at {math.degrees(low):.6g} and {math.degrees(high):.6g} deg, where PMKS+ reverses it: here "
        f"it turns a hundredth of the way before each, within {2.0 * RAMP * duration:.3g} s from the speed of the link to the "
        f"opposite one, {STROKES} times"
    )
    return replace(mechanism, drives=(Drive(body, replace(strokes, begin=min(strokes.after(first), 0.999999 * duration))),))


def _with_loads(drawing: Drawing, forces: list[list[str]], names: dict[str, str], scale: float, unit: float) -> Drawing:
    """The drawing with forces; each bar gets the place of its force as a further pin, which is on that bar alone."""
    pins, bars, loads = dict(drawing.pins), {bar.name: bar for bar in drawing.bars}, []
    for record in forces:
        if len(record) != 8:
            raise _newer(f"a force of {len(record)} fields")
        bar = names.get(record[1], "")
        if bar not in bars:
            raise InputError(f"force '{record[2]}' on '{record[1]}'", "a force on a link", SAMPLE)
        flags = _digit(record[0][:1], "kind of a force")
        x, y, to_x, to_y, size = (_decimal(field, f"force '{record[2]}'") for field in record[3:8])
        way = math.hypot(to_x - x, to_y - y)
        if not way > 0.0:
            raise InputError(f"force '{record[2]}' without direction", "an arrow with a length", SAMPLE)
        signed = unit * size / way * (1.0 if flags & 2 else -1.0)
        place = scale * x, scale * y
        near = next((pin for pin in bars[bar].pins if math.dist(pins[pin], place) <= 0.5e-3 * scale), "")
        if not near:
            near = plain_name(f"point of {record[2]}", pins)
            pins[near] = place
            bars[bar] = replace(bars[bar], pins=(*bars[bar].pins, near))
        loads.append(
            Load(plain_name(record[2], ()), bar, pins[near], (signed * (to_x - x), signed * (to_y - y)), bool(flags & 1))
        )
    return replace(drawing, pins=pins, bars=tuple(bars.values()), loads=tuple(loads))


def _check_rest(rest: list[str], notes: list[str]) -> None:
    """What stands behind the forces: the selected part, which says nothing here, and entries of later versions."""
    kinds = {"S": "a synthesis", "K": "colours", "C": "anchors of mass centres", "J": "locks", "L": "locks", "F": "locks"}
    if len(rest) > 2:
        raise _newer(f"{len(rest)} sections behind the forces")
    letters = {entry[:1] for section in rest[1:] for entry in section.split(",") if entry}
    if letters - kinds.keys():
        raise _newer(f"an entry '{min(letters - kinds.keys())}' behind the forces")
    notes += [f"{kinds[entry]} of the drawing: left out" for entry in sorted(letters)]


def _digit(letter: str, what: str) -> int:
    if letter not in DIGITS or not letter:
        raise InputError(f"{what}: '{letter}'", ALLOWED, SAMPLE)
    return DIGITS.index(letter)


def _unsigned(text: str, what: str) -> int:
    """A whole number to the base of 64."""
    if not text:
        raise InputError(f"{what} is missing in the link of PMKS+", f"{ALLOWED}, copied whole", SAMPLE)
    value = 0
    for letter in text:
        value = value * len(DIGITS) + _digit(letter, what)
    return value


def _integer(text: str, what: str) -> int:
    """The same, where one that begins with a zero is negative."""
    value = _unsigned(text, what)
    return -value if text[0] == "0" else value


def _decimal(text: str, what: str) -> float:
    return _integer(text, what) / 1000.0


def _short(text: str) -> str:
    return text if len(text) <= 60 else f"{text[:57]}..."
