"""Read mechanisms from links of PMKS+, the planar linkage simulator of Worcester Polytechnic Institute."""

from __future__ import annotations

import math
from dataclasses import replace

from scissordyn.components.place import GROUND, Point
from scissordyn.components.time_function import ConstantSpeed, Trapezoidal
from scissordyn.errors import InputError
from scissordyn.exchange.drawing import (
    LINEAR_DENSITY,
    Block,
    Drawing,
    DrawnBar,
    Imported,
    mechanism_of_drawing,
    plain_name,
    uniform,
    with_point_mass,
    with_printable_notes,
)
from scissordyn.exchange.pmks_link import (
    COMPUTED_BY_PMKS,
    EXAMPLE,
    GROUNDED,
    INPUT,
    PRISMATIC,
    WELDED,
    PmksJoint,
    PmksLink,
    Sketch,
    read_link,
)
from scissordyn.exchange.source import POINTS_MAX
from scissordyn.model.coupling import Drive
from scissordyn.model.mechanism import Mechanism
from scissordyn.units import checked, rpm

PIN_TOL = 0.5e-3  # [drawing units] largest distance of a force from the pin on which it acts; half the last digit of positions


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
    notes: list[str] = []
    sketch = read_link(link, notes)
    drawing = _with_loads(_drawing(sketch, linear_density, notes), PIN_TOL * sketch.scale)
    if not drawing.gravity:
        notes.append("gravity: off in the link, so it is 0; set structure.gravity")
    return with_printable_notes(_with_oscillation(mechanism_of_drawing(drawing), notes), notes)


def _drawing(sketch: Sketch, density: float, notes: list[str]) -> Drawing:
    """Convert the content of a PMKS+ link to pins, bars, blocks and loads."""
    joints = sketch.joints
    names: dict[str, str] = {}
    for key, link in sketch.links.items():
        names[key] = plain_name(link.name or key, names.values())
    places = {joint.name: joint.place for joint in joints.values()}
    bars: dict[str, DrawnBar] = {}
    blocks: list[tuple[Block, float]] = []  # Blocks with their masses
    for key, link in sketch.links.items():
        if unknown := [joint for joint in link.joints if joint not in joints]:
            raise InputError(f"link '{link.name}' refers to the unknown joint '{unknown[0]}'", "joints of the drawing", EXAMPLE)
        ends = [joints[joint] for joint in link.joints]
        if link.piston or (len(ends) == 2 and any(joint.has(PRISMATIC) for joint in ends) and ends[0].place == ends[1].place):
            blocks.append((_block(link, ends, sketch, names, names[key], notes), link.mass))
        else:
            bars[names[key]] = _bar(names[key], link, tuple(joint.name for joint in ends), places, density, notes)
    for block, mass in blocks:
        if block.follower:
            bars[block.follower] = with_point_mass(bars[block.follower], places[block.pin], mass)
        if block.carrier != GROUND and block.carrier not in bars:
            what = f"block '{block.name}' of the drawing slides on '{block.carrier}', which is not a bar"
            raise InputError(what, "a slider on a bar or on the ground, drawn in PMKS+ and shared again", EXAMPLE)
    slides = {joint.name for joint in joints.values() if joint.has(PRISMATIC)}
    if ending := [name for name, bar in bars.items() if slides.intersection(bar.pins)]:
        what = f"link '{min(ending)}' ends in a sliding joint without a block"
        raise InputError(what, "a slider with its block", EXAMPLE)
    for load in sketch.loads:
        if names.get(load.bar) not in bars:
            raise InputError(f"force '{load.name}' acts on the unknown link '{load.bar}'", "a force on a link", EXAMPLE)
    return Drawing(
        pins={pin: place for pin, place in places.items() if pin not in slides},
        fixed=tuple(joint.name for joint in joints.values() if joint.has(GROUNDED) and not joint.has(PRISMATIC)),
        bars=tuple(bars.values()),
        blocks=tuple(block for block, _ in blocks),
        drives=_drives(joints, bars, rpm(sketch.speed), notes),
        loads=tuple(replace(load, bar=names[load.bar]) for load in sketch.loads),
        gravity=9.81 if sketch.gravity else 0.0,
    )


def _bar(
    name: str, link: PmksLink, pins: tuple[str, ...], places: dict[str, Point], density: float, notes: list[str]
) -> DrawnBar:
    if len(pins) < 2:
        raise InputError(f"link '{name}' has fewer than two joints", "two joints or more", EXAMPLE)
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


def _block(link: PmksLink, on: list[PmksJoint], sketch: Sketch, names: dict[str, str], name: str, notes: list[str]) -> Block:
    slides = [joint for joint in on if joint.has(PRISMATIC)]
    pins = [joint for joint in on if not joint.has(PRISMATIC)]
    if len(slides) != 1 or len(pins) != 1:
        raise InputError(f"block '{name}' has {len(pins)} pins and {len(slides)} slides", "one pin and one slide", EXAMPLE)
    slide = slides[0]
    if not link.mass > 0.0:
        raise InputError(f"block '{name}' has no mass", "a mass, set in PMKS+ at the slider", EXAMPLE)
    carrier, direction = GROUND, slide.angle
    if slide.slot:
        carrier = names.get(slide.slot[0], "")
        ends = [sketch.joints[joint].place for joint in slide.slot[1:] if joint in sketch.joints]
        if len(ends) == 2:
            direction = math.atan2(ends[1][1] - ends[0][1], ends[1][0] - ends[0][0])
    if not carrier or not (slide.slot or slide.has(GROUNDED)):
        raise InputError(f"the slide of block '{name}' has no line", "a slide on the ground or on a link", EXAMPLE)
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
        raise InputError(f"block '{name}' is welded to {len(on_pin)} links", "a weld to one link", EXAMPLE)
    return Block(name, pins[0].name, direction, 0.0, carrier, follower=on_pin[0], aligned=True)


def _drives(
    joints: dict[str, PmksJoint], bars: dict[str, DrawnBar], speed: float, notes: list[str]
) -> dict[str, ConstantSpeed]:
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


def _with_loads(drawing: Drawing, tolerance: float) -> Drawing:
    """Move each load to the pin of its bar within `tolerance` [m]; give a load without such a pin a new pin on its bar."""
    pins, bars, loads = dict(drawing.pins), {bar.name: bar for bar in drawing.bars}, []
    for load in drawing.loads:
        bar = bars[load.bar]
        pin = next((pin for pin in bar.pins if math.dist(pins[pin], load.place) <= tolerance), "")
        if not pin:
            pin = plain_name(f"point of {load.name}", pins)
            pins[pin] = load.place
            bars[load.bar] = replace(bar, pins=(*bar.pins, pin))
        loads.append(replace(load, place=pins[pin]))
    return replace(drawing, pins=pins, bars=tuple(bars.values()), loads=tuple(loads))


def _with_oscillation(mechanism: Mechanism, notes: list[str], ramp: float = 0.05) -> Mechanism:
    """Return the mechanism with an oscillating input if its input locks at two positions; PMKS+ reverses it there.

    `ramp`: [strokes] Part of a stroke in which an oscillating input decelerates.
    """
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
    duration = 2.0 * amplitude / speed / (1.0 - ramp)
    strokes = Trapezoidal(mean - amplitude, mean + amplitude, duration, ramp, POINTS_MAX)
    notes.append(
        f"the input '{body}' locks at {math.degrees(low):.6g} and {math.degrees(high):.6g} deg, where PMKS+ reverses it: here "
        f"it stops a hundredth of the range before each and reverses within {2.0 * ramp * duration:.3g} s, "
        f"for {POINTS_MAX} strokes"
    )
    return replace(mechanism, drives=(Drive(body, replace(strokes, begin=min(strokes.after(first), 0.999999 * duration))),))
