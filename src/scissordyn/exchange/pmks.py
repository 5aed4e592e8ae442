"""Read links of PMKS+, the planar linkage simulator of Worcester Polytechnic Institute, whose address holds the linkage.

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
from dataclasses import dataclass, replace
from urllib.parse import parse_qs, unquote

from scissordyn.components.place import GROUND, Point
from scissordyn.components.time_function import ConstantSpeed, Trapezoidal
from scissordyn.errors import InputError
from scissordyn.exchange.drawing import (
    LINEAR_DENSITY,
    Block,
    Drawing,
    DrawnBar,
    Imported,
    Load,
    assembled,
    imported,
    plain_name,
    uniform,
    with_point_mass,
)
from scissordyn.model.coupling import Drive
from scissordyn.model.mechanism import Mechanism
from scissordyn.units import checked, rpm

DIGITS = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz_-"
SAMPLE = "scissordyn import 'https://app.pmksplus.com/?...' -o case.toml"
EXPECTED_LINK = "a link from 'Share' in PMKS+"
SUPPORTED_LINKS = "links of bars, pins and forces; open the link in PMKS+, and share it again"

LINK_MAX = 50_000  # Largest number of characters of a link, which has about a thousand joints then
DIGITS_MAX = 12  # Largest number of base-64 digits of a number, including its sign

PRISMATIC, INPUT, GROUNDED, WELDED, _, SEALED = range(6)  # Bit positions in the flags of a joint
CLOCKWISE, GRAVITY = 0, 1  # Bit positions in the settings

TRUE_TEXTS = ("t", "true")  # Truth values of the earlier format

LENGTH_UNITS = (("in", 0.0254, 0.45359237, 4.4482216152605), ("cm", 0.01, 1.0, 1.0), ("m", 1.0, 1.0, 1.0))
"""Length in m, mass in kg and force in N for each length unit; masses of drawings in inches are pounds."""
PIN_TOL = 0.5e-3  # A force nearer to a pin than this acts there: half the last digit of a place [length unit]


RAMP_FRACTION = 0.05  # Fraction of a stroke in which an oscillating input decelerates
STROKES_MAX = 10_000  # Largest number of strokes of a motion

LINK_KINDS = {"Y": True, "A": True, "M": True, "G": True, "N": False, "a": False, "m": False, "g": False} | {
    str(digit): digit < 4 for digit in range(8)
}
"""First characters of links: True for a separate link, False for part of a welded one. Later versions added most of them."""

COMPUTED_BY_PMKS = {"inertia": "AMam1256", "centre": "AGag1357"}
"""First characters of links whose inertia or mass centre PMKS+ computes from the drawn outline."""


@dataclass(frozen=True)
class _Joint:
    name: str
    flags: int
    place: Point
    angle: float = 0.0
    slot: tuple[str, ...] = ()
    speed: float = 0.0  # [rpm]

    def has(self, bit: int) -> bool:
        return bool(self.flags >> bit & 1)


@dataclass(frozen=True)
class _Link:
    name: str
    mass: float
    inertia: float
    centre: Point
    joints: tuple[str, ...]
    first: str = "Y"  # First character of the link's record
    piston: bool = False


@dataclass(frozen=True)
class _Sketch:
    """Content of a link of either format, in SI units; joints and links are keyed by their names."""

    joints: dict[str, _Joint]
    links: dict[str, _Link]
    loads: list[Load]  # Loads whose bars are keys of links
    speed: float  # Input speed [rpm], negative clockwise
    gravity: bool
    scale: float  # Length unit [m]


@checked
def read_pmks(link: str, *, linear_density: float = LINEAR_DENSITY) -> Imported:
    """Return the mechanism of a PMKS+ link.

    Parameters
    ----------
    link : str
        Complete address, or the part after its question mark.
    linear_density : float
        Mass per length of links without mass in the drawing [kg/m].

    Returns
    -------
    Imported
        Joints have the names of the drawing. A link that turns at the input joint has a drive with the speed of the drawing.
        A sliding block is a body without rotation in a guide.

    Raises
    ------
    InputError
        If the text is not a PMKS+ link, is damaged, or uses features of later versions.
    """
    if len(link) > LINK_MAX:
        raise InputError(f"the link of PMKS+ has more than {LINK_MAX} characters", EXPECTED_LINK, SAMPLE)
    notes: list[str] = []
    sketch = (_read_earlier if link.partition("?")[2].startswith("j=") else _read_present)(link.strip(), notes)
    drawing = _with_loads(_drawing(sketch, linear_density, notes), PIN_TOL * sketch.scale)
    if not drawing.gravity:
        notes.append("gravity: off in the link, so it is 0; set structure.gravity")
    return imported(_with_oscillation(assembled(drawing), notes), notes)


def _drawing(sketch: _Sketch, density: float, notes: list[str]) -> Drawing:
    """Return pins, bars and blocks; the loads of the result refer to bars by name."""
    joints = sketch.joints
    names: dict[str, str] = {}
    for key, link in sketch.links.items():
        names[key] = plain_name(link.name or key, names.values())
    places = {joint.name: joint.place for joint in joints.values()}
    bars: dict[str, DrawnBar] = {}
    blocks: list[tuple[Block, float]] = []  # Blocks with their masses
    for key, link in sketch.links.items():
        if unknown := [joint for joint in link.joints if joint not in joints]:
            raise InputError(f"link '{link.name}' refers to the unknown joint '{unknown[0]}'", "joints of the drawing", SAMPLE)
        on = [joints[joint] for joint in link.joints]
        if link.piston or (len(on) == 2 and any(joint.has(PRISMATIC) for joint in on) and on[0].place == on[1].place):
            blocks.append((_block(link, on, sketch, names, names[key], notes), link.mass))
        else:
            bars[names[key]] = _bar(names[key], link, tuple(joint.name for joint in on), places, density, notes)
    for block, mass in blocks:
        if block.follower:
            bars[block.follower] = with_point_mass(bars[block.follower], places[block.pin], mass)
        if block.carrier != GROUND and block.carrier not in bars:
            raise InputError(f"block '{block.name}' slides on '{block.carrier}'", "a link", SAMPLE)
    slides = {joint.name for joint in joints.values() if joint.has(PRISMATIC)}
    if ending := [name for name, bar in bars.items() if slides.intersection(bar.pins)]:
        what = f"link '{min(ending)}' ends in a sliding joint without a block"
        raise InputError(what, "a slider with its block", SAMPLE)
    for load in sketch.loads:
        if names.get(load.bar) not in bars:
            raise InputError(f"force '{load.name}' acts on the unknown link '{load.bar}'", "a force on a link", SAMPLE)
    return Drawing(
        pins={pin: place for pin, place in places.items() if pin not in slides},
        fixed=tuple(joint.name for joint in joints.values() if joint.has(GROUNDED) and not joint.has(PRISMATIC)),
        bars=tuple(bars.values()),
        blocks=tuple(block for block, _ in blocks),
        drives=_drives(joints, bars, rpm(sketch.speed), notes),
        loads=tuple(replace(load, bar=names[load.bar]) for load in sketch.loads),
        gravity=9.81 if sketch.gravity else 0.0,
    )


def _bar(name: str, link: _Link, pins: tuple[str, ...], places: dict[str, Point], density: float, notes: list[str]) -> DrawnBar:
    if len(pins) < 2:
        raise InputError(f"link '{name}' has fewer than two joints", "two joints or more", SAMPLE)
    thin = uniform(name, pins, places, density)
    if not link.mass > 0.0:
        notes.append(f"link '{name}' has no mass in the drawing: {density:g} kg/m is assumed")
        return thin
    drawn = replace(thin, mass=link.mass, inertia=link.inertia, centre=link.centre)
    if not link.inertia > 0.0:
        notes.append(f"link '{name}' has no inertia in the drawing: that of a uniform bar is assumed")
        drawn = replace(drawn, inertia=thin.inertia * link.mass / thin.mass)
    for what, letters in COMPUTED_BY_PMKS.items():
        if link.first in letters:
            notes.append(f"{what} of link '{name}': as PMKS+ last computed it from the outline that it draws")
    return drawn


def _block(link: _Link, on: list[_Joint], sketch: _Sketch, names: dict[str, str], name: str, notes: list[str]) -> Block:
    slides = [joint for joint in on if joint.has(PRISMATIC)]
    pins = [joint for joint in on if not joint.has(PRISMATIC)]
    if len(slides) != 1 or len(pins) != 1:
        raise InputError(f"block '{name}' has {len(pins)} pins and {len(slides)} slides", "one of each", SAMPLE)
    slide = slides[0]
    if not link.mass > 0.0:
        raise InputError(f"block '{name}' has no mass", "a mass, set in PMKS+ at the slider", SAMPLE)
    carrier, direction = GROUND, slide.angle
    if slide.slot:
        carrier = names.get(slide.slot[0], "")
        ends = [sketch.joints[joint].place for joint in slide.slot[1:] if joint in sketch.joints]
        if len(ends) == 2:
            direction = math.atan2(ends[1][1] - ends[0][1], ends[1][0] - ends[0][0])
    if not carrier or not (slide.slot or slide.has(GROUNDED)):
        raise InputError(f"block '{name}' slides on nothing", "a slide on the ground or on a link", SAMPLE)
    if slide.has(INPUT):
        notes.append(
            f"the input at slide '{slide.name}' is left out: drives on blocks are not supported; add a rod or an actuator"
        )
    if not pins[0].has(WELDED):
        return Block(name, pins[0].name, direction, link.mass, carrier)
    on_pin = [
        names[key]
        for key, other in sketch.links.items()
        if pins[0].name in [sketch.joints[joint].name for joint in other.joints] and not other.piston
    ]
    if len(on_pin) != 1:
        raise InputError(f"block '{name}' is welded to {len(on_pin)} links", "one link", SAMPLE)
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


def _with_loads(drawing: Drawing, near: float) -> Drawing:
    """Return the drawing with each load at a pin of its bar; a load without a near pin gets a new one on that bar alone."""
    pins, bars, loads = dict(drawing.pins), {bar.name: bar for bar in drawing.bars}, []
    for load in drawing.loads:
        bar = bars[load.bar]
        pin = next((pin for pin in bar.pins if math.dist(pins[pin], load.place) <= near), "")
        if not pin:
            pin = plain_name(f"point of {load.name}", pins)
            pins[pin] = load.place
            bars[load.bar] = replace(bar, pins=(*bar.pins, pin))
        loads.append(replace(load, place=pins[pin]))
    return replace(drawing, pins=pins, bars=tuple(bars.values()), loads=tuple(loads))


def _with_oscillation(mechanism: Mechanism, notes: list[str]) -> Mechanism:
    """Return the mechanism with an oscillating input if its input locks at two positions, where PMKS+ reverses it."""
    swing = 0.98  # amplitude as a fraction of half the range between the locking positions
    from scissordyn.plan.plan import plan
    from scissordyn.run.ideal import motion_range

    if len(mechanism.drives) != 1 or not isinstance(mechanism.drives[0].motion, ConstantSpeed):
        return mechanism
    body, speed = mechanism.drives[0].body, mechanism.drives[0].motion.speed
    try:
        low, high, _ = motion_range(plan(mechanism))
    except InputError:  # an assembly error is reported when the mechanism is used
        return mechanism
    if not speed or not (math.isfinite(low) and math.isfinite(high)):
        return mechanism
    mean, first = 0.5 * (low + high), mechanism.body(body).angle or 0.0
    amplitude = math.copysign(max(swing * 0.5 * (high - low), abs(first - mean)), speed)
    duration = 2.0 * amplitude / speed / (1.0 - RAMP_FRACTION)
    strokes = Trapezoidal(mean - amplitude, mean + amplitude, duration, RAMP_FRACTION, STROKES_MAX)
    notes.append(
        f"the input '{body}' locks at {math.degrees(low):.6g} and {math.degrees(high):.6g} deg, where PMKS+ reverses it: here "
        f"it stops a hundredth of the range before each and reverses within {2.0 * RAMP_FRACTION * duration:.3g} s, "
        f"for {STROKES_MAX} strokes"
    )
    return replace(mechanism, drives=(Drive(body, replace(strokes, begin=min(strokes.after(first), 0.999999 * duration))),))


def _read_present(link: str, notes: list[str]) -> _Sketch:
    """Return the content of a link of the present format."""
    sections = _sections(link)
    scale, kilogram, newton = _units(sections[3], notes)
    flags = _unsigned(sections[0], "settings")
    speed = _integer(sections[2].split(",")[0], "input speed")
    at = iter(sections[4:])
    joints = {record[0][1:]: _joint(record, scale) for record in _records(at, "joints")}
    links = [(record[0], _link(record, scale, kilogram)) for record in _records(at, "links")]
    loads = [_force(record, scale, newton) for record in _records(at, "forces", last=True)]
    _check_rest(list(at), notes)
    return _Sketch(
        joints,
        {key[2:]: part for key, part in links if LINK_KINDS[part.first]},
        loads,
        speed=-speed if flags & 1 << CLOCKWISE else speed,
        gravity=bool(flags & 1 << GRAVITY),
        scale=scale,
    )


def _sections(link: str) -> list[str]:
    """Return the sections of the address after checking its length."""
    text = unquote(link)
    content = text.partition("?")[2] if "?" in text else text
    if "#" in content:
        content = content.partition("#")[0]
    if content.count(".") < 6 or not all(letter.isprintable() for letter in content):
        raise InputError(f"'{link if len(link) <= 60 else f'{link[:57]}...'}' is not a link of PMKS+", EXPECTED_LINK, SAMPLE)
    body, check = content[:-1], content[-1]
    if DIGITS[len(body) % 62] != check:
        raise InputError(
            f"the link of PMKS+ is damaged: {len(body)} characters end in '{check}' instead of '{DIGITS[len(body) % 62]}'",
            f"{EXPECTED_LINK}, copied completely",
            SAMPLE,
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
        SAMPLE,
    )


def _units(digits: str, notes: list[str]) -> tuple[float, float, float]:
    length, angle, force = (DIGITS.index(digit) if digit in DIGITS else 99 for digit in digits[:3])
    if length > 2 or angle > 1 or force > 1:
        raise InputError(f"units '{digits}' of the link", "inch, cm or m; degree or radian; pound or newton", SAMPLE)
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
        raise InputError(f"the link of PMKS+ ends within its {what}", f"{EXPECTED_LINK}, copied completely", SAMPLE)


def _joint(record: list[str], scale: float) -> _Joint:
    if len(record) not in (5, 8, 9):
        raise _unsupported_version(f"a joint of {len(record)} fields")
    flags = _unsigned(record[0][:1], "kind of a joint")
    if flags >> SEALED:
        raise _unsupported_version(f"joint '{record[1]}' is part of a cylinder")
    x, y, angle = (_decimal(field, f"place of joint '{record[1]}'") for field in record[2:5])
    slot = tuple(record[5:8])
    if any(slot) and not all(slot):
        raise InputError(f"the slot of joint '{record[1]}' lacks its link or one of its two joints", EXPECTED_LINK, SAMPLE)
    speed = _decimal(record[8], f"speed of joint '{record[1]}'") if len(record) > 8 else 0.0
    return _Joint(plain_name(record[1], ()), flags, (scale * x, scale * y), angle, slot if any(slot) else (), speed)


def _link(record: list[str], scale: float, kilogram: float) -> _Link:
    first, kind = record[0][:1], record[0][1:2]
    if first not in LINK_KINDS or kind not in ("R", "P") or len(record) < 9:
        raise _unsupported_version(f"a link that begins with '{record[0][:2]}'")
    mass, inertia, x, y = (_decimal(field, f"link '{record[1]}'") for field in record[2:6])
    joints = record[7 : record.index("", 7)] if "" in record[7:] else record[7:]
    centre = scale * x, scale * y
    return _Link(record[1], kilogram * mass, kilogram * scale**2 * inertia, centre, tuple(joints), first, kind == "P")


def _force(record: list[str], scale: float, newton: float) -> Load:
    if len(record) != 8:
        raise _unsupported_version(f"a force of {len(record)} fields")
    flags = _unsigned(record[0][:1], "kind of a force")
    x, y, to_x, to_y, size = (_decimal(field, f"force '{record[2]}'") for field in record[3:8])
    arrow = (x, y), (to_x - x, to_y - y)
    return _load(record[2], record[1], arrow, size if flags & 2 else -size, scale, newton, follows=bool(flags & 1))


def _load(name: str, bar: str, arrow: tuple[Point, Point], size: float, scale: float, newton: float, *, follows: bool) -> Load:
    """Return a force along an arrow, given by its foot and span in the units of a link."""
    (x, y), (along, up) = arrow
    length = math.hypot(along, up)
    if not length > 0.0:
        raise InputError(f"force '{name}' has no direction", "an arrow with a length", SAMPLE)
    signed = newton * size / length
    return Load(plain_name(name, ()), bar, (scale * x, scale * y), (signed * along, signed * up), follows)


def _check_rest(rest: list[str], notes: list[str]) -> None:
    """Check the sections after the forces: the selected part, which is ignored, and entries of later versions."""
    kinds = {"S": "a synthesis", "K": "colours", "C": "anchors of mass centres", "J": "locks", "L": "locks", "F": "locks"}
    if len(rest) > 2:
        raise _unsupported_version(f"{len(rest)} sections behind the forces")
    letters = {entry[:1] for section in rest[1:] for entry in section.split(",") if entry}
    if letters - kinds.keys():
        raise _unsupported_version(f"an entry '{min(letters - kinds.keys())}' behind the forces")
    notes += [f"{kinds[entry]} of the drawing: left out" for entry in sorted(letters)]


def _unsigned(text: str, what: str) -> int:
    """Return an unsigned integer in base 64."""
    if not 0 < len(text) <= DIGITS_MAX:
        wrong = f"has {len(text)} digits" if text else "is missing in the link of PMKS+"
        raise InputError(f"{what} {wrong}", f"{EXPECTED_LINK}, copied completely", SAMPLE)
    value = 0
    for letter in text:
        if letter not in DIGITS:
            raise InputError(f"{what} contains '{letter}', which is not a base-64 digit", EXPECTED_LINK, SAMPLE)
        value = value * len(DIGITS) + DIGITS.index(letter)
    return value


def _decimal(text: str, what: str) -> float:
    return _integer(text, what) / 1000.0


def _integer(text: str, what: str) -> int:
    """Return a signed integer in base 64; a leading zero marks a negative one."""
    value = _unsigned(text, what)
    return -value if text[0] == "0" else value


def _read_earlier(link: str, notes: list[str]) -> _Sketch:
    """Return the content of a link of the earlier format; unused parts are added to the notes."""
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
        raise InputError(f"unknown unit '{unit}' of the link", ", ".join(lengths), SAMPLE)
    scale, kilogram, newton = lengths[unit]
    sliding = [joint[0] for joint in joints if len(joint) > 4 and joint[4] == "P"]
    if sliding or any(len(joint) < 9 for joint in joints):
        what = f"joint '{sliding[0]}', which slides" if sliding else "a joint with fewer than 9 entries"
        raise InputError(f"the link of the earlier PMKS+ format has {what}", SUPPORTED_LINKS)
    frictional = sum(_number(joint[7] or "0", f"joint '{joint[0]}'") != 0.0 for joint in joints)
    notes += [f"friction of {frictional} joints: left out"] * bool(frictional) + ["outlines of links: left out"] * bool(links)
    notes.append(f"units: lengths in {unit}, masses, inertias and forces in the units that PMKS+ displays")
    rpms = _number(speed or "0", "speed of the input")
    return _Sketch(
        {joint[0]: _earlier_joint(joint, scale) for joint in joints},
        {name: _earlier_link(name, entries, scale, kilogram) for name, *entries in links},
        [_earlier_force(force, scale, newton) for force in forces],
        speed=-rpms if clockwise in TRUE_TEXTS else rpms,
        gravity=gravity in TRUE_TEXTS,
        scale=scale,
    )


def _earlier_joint(entries: list[str], scale: float) -> _Joint:
    x, y = (_number(entry, f"joint '{entries[0]}'") for entry in entries[1:3])
    flags = (entries[5] in TRUE_TEXTS) << GROUNDED | (entries[8] in TRUE_TEXTS) << INPUT
    return _Joint(plain_name(entries[0], ()), flags, (scale * x, scale * y))


def _earlier_link(name: str, entries: list[str], scale: float, kilogram: float) -> _Link:
    entries = entries[1:] if entries[:1] in (["R"], ["P"]) else entries
    if len(entries) < 5:
        raise InputError(f"link '{name}' has {len(entries) + 1} entries", SUPPORTED_LINKS)
    mass, inertia, x, y = (_number(entry, f"link '{name}'") for entry in entries[:4])
    joints = tuple(filter(None, entries[4].split("|")))
    return _Link(name, kilogram * mass, kilogram * scale**2 * inertia, (scale * x, scale * y), joints)


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
