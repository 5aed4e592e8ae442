"""Describe a still or a film frame by frame, independently of the program that draws it."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from scissordyn.components.place import GROUND
from scissordyn.components.port.stroke import AXIS_POINTS
from scissordyn.errors import InputError
from scissordyn.model.addition import panel_ends, payload_points
from scissordyn.model.body import Body, Track
from scissordyn.model.mechanism import Mechanism
from scissordyn.plot.bar_diagram import Diagram, check_quantity, known_diagrams, part_indices
from scissordyn.plot.contact import frame_contacts
from scissordyn.plot.label import PLACING, name_offsets
from scissordyn.plot.scale import Scale, engineering
from scissordyn.plot.series import time_scale
from scissordyn.plot.style import SIZES
from scissordyn.plot.symbol import Symbol, cross_sections, symbols, wheel_points
from scissordyn.record.placement import Placement, placed
from scissordyn.record.results import Run, values_at
from scissordyn.warning import LISTED_MAX

CLOSED_SHAPES = ("plate", "block", "payload", "panel")  # Kinds of drawn parts whose outlines are closed polygons
PAYLOAD_HALF_SIDE, PANEL_HALF_WIDTH = 1.5, 0.55  # [sizes of loads in `load_shapes`] half the dimensions of drawn loads


Corners = tuple[np.ndarray, np.ndarray]  # Lower left and upper right corner [m]


@dataclass(frozen=True)
class Shape:
    """Polyline that represents a body, a guide, or one stroke of a component's symbol."""

    name: str
    kind: str
    points: np.ndarray  # (frames, points, 2) Coordinates in the picture's frame, in which gravity points downwards [m]
    tone: int = 0  # 0 or 1: bars and plates alternate between two colours
    parts: tuple[int, ...] = ()  # Indices of a bending bar's parts in the scene's diagrams

    @property
    def places(self) -> np.ndarray:
        """Points of each part of a bending bar, shape (frames, parts, points, 2) [m]."""
        spans = self.points.reshape(len(self.points), -1, AXIS_POINTS, 2)
        per_span = len(self.parts) // spans.shape[1]
        step = (AXIS_POINTS - 1) // per_span
        inside = step * np.arange(per_span)[:, None] + np.arange(step + 1)
        return spans[:, :, inside].reshape(len(spans), len(self.parts), step + 1, 2)


@dataclass(frozen=True)
class ClearanceJoint:
    """Position and magnified view of a clearance joint in each frame."""

    name: str
    place: np.ndarray  # (frames, 2) Bearing centre [m]
    journal: np.ndarray  # (frames, 2) Journal centre in the magnified bearing, in drawn journal radii
    path: np.ndarray  # (points, 2) Journal centre at finer instants, in drawn journal radii
    reached: np.ndarray  # (frames,) Number of path points up to each frame
    touched: np.ndarray  # (frames,) True if there was contact at any instant since the previous frame
    force: np.ndarray  # (frames,) Largest force since the previous frame [N]
    gain: float  # Magnification of the clearance relative to the magnification of the journal


@dataclass(frozen=True)
class Channel:
    """Magnified view of a clearance guide: its block between horizontal surfaces; the unit is half the drawn block."""

    name: str  # Name of the guide
    block: np.ndarray  # (samples, corners, 2) Corners of the block in cyclic order, with magnified clearance
    touching: np.ndarray  # (samples, corners) True where a corner is in contact
    surfaces: dict[float, float]  # Height of the guide surface on each side; the keys are 1 and -1
    force: np.ndarray  # (samples,) Largest corner force [N]
    place: np.ndarray  # (samples, 2) Position of the block in the picture [m]
    gain: float  # Magnification of the clearance relative to the magnification of the block
    corners: tuple[str, ...]  # Names of the contact points in the order of `block`
    hollow: bool = False  # True if the block surrounds the guide, as a ring surrounds a pole

    @property
    def touched(self) -> np.ndarray:
        """True in samples in which any corner is in contact, shape (samples,)."""
        return np.asarray(self.touching.any(axis=1))


@dataclass(frozen=True)
class Scene:
    """Contents of a picture or film at each frame, in the coordinates of the picture, in which gravity points downwards."""

    time: np.ndarray  # (frames,) [s]
    scale: Scale  # Unit in which times are shown
    shapes: tuple[Shape, ...]
    pins: np.ndarray  # (frames, pins, 2) Ideal joints [m]
    supports: np.ndarray  # (supports, 2) Pins on the ground [m]
    clearance_joints: tuple[ClearanceJoint, ...]  # Clearance joints, those to magnify first
    low: np.ndarray  # (2,) Lower left corner of the visible region [m]
    high: np.ndarray  # (2,) Upper right corner of the visible region [m]
    turns: int = 0  # Number of quarter turns of the picture that make gravity point downwards
    channels: tuple[Channel, ...] = ()  # Magnified views of the clearance guides
    shown: int = LISTED_MAX  # Number of clearance joints and channels magnified at the same time
    pin_names: tuple[str, ...] = ()
    tracks: tuple[tuple[str, np.ndarray], ...] = ()  # Names of the tracked points, and their positions (frames, 2) [m]
    magnification: float = 1.0  # Factor that multiplies the deflections of bending bars
    diagrams: tuple[Diagram, ...] = ()  # Diagrams available for bending bars, at the frames
    on_bars: str = ""  # Quantity of the diagram drawn at first; "" for none
    rings: tuple[tuple[str, np.ndarray], ...] = ()  # Names of all joints with clearance, and their positions (frames, 2) [m]
    # Name, kind and position (frames, 2) [m] of everything that stills label
    names: tuple[tuple[str, str, np.ndarray], ...] = ()

    def instant(self, frame: int, digits: int = 4) -> str:
        return f"t = {self.scale.factor * self.time[frame]:.{digits}g} {self.scale.unit}"

    @property
    def magnified(self) -> list[Channel | ClearanceJoint]:
        """All magnified views: first the channels of guides, then the clearance joints."""
        return [*self.channels, *self.clearance_joints]

    def name_offsets(
        self,
        count: int | None = None,
        *,
        region: np.ndarray | Corners | None = None,
        longer: float = PLACING.region,
        instants: int = PLACING.film_instants,
    ) -> np.ndarray:
        """Return the offsets of the names of magnified joints, as `label.name_offsets` computes them.

        Shapes: `region` (2, 2) [m]; returns (instants, magnified, 2) [pt].
        """
        named = self.magnified[:count]
        if not named:
            return np.empty((instants, 0, 2))
        lines = [
            np.concatenate([shape.points, shape.points[:, :1]], axis=1) if shape.kind in CLOSED_SHAPES else shape.points
            for shape in self.shapes
        ]
        nothing = np.empty((len(self.time), 0, 2))
        places = np.concatenate([nothing, *(joint.place[:, None] for joint in named)], axis=1)
        others = np.concatenate([self.pins, *(joint.place[:, None] for joint in self.magnified[len(named) :])], axis=1)
        low, high = (self.low, self.high) if region is None else region
        names = [joint.name for joint in named]
        return name_offsets(names, places, lines, others, (low, high), longer=longer, instants=instants)


def _component_shapes(drawn: list[Symbol], diagrams: tuple[Diagram, ...]) -> list[Shape]:
    """Return the shapes of components; elements of a bending bar become parts of that bar."""
    tones: dict[str, int] = {}
    place_of = {name: k for k, name in enumerate(diagrams[0].parts)} if diagrams else {}
    shapes = []
    for symbol in drawn:
        kind = "bar" if symbol.bar else "rod" if symbol.kind == "rod" else "component"
        tone = tones.setdefault(symbol.bar, len(tones) % 2) if symbol.bar else 0
        parts = part_indices(symbol.name, place_of) if symbol.kind == "beam" else ()
        shapes += [Shape(symbol.name, kind, stroke, tone, parts) for stroke in symbol.strokes]
    return shapes


def newtons(force: float) -> str:
    scale = engineering("N", force)
    return f"{scale.factor * force:.3g} {scale.unit}"


def scale_in_words(slower: float, magnification: float = 1.0) -> str:
    """Return the film's time scale and deflection scale as text."""
    factor = float(f"{max(slower, 1.0 / slower):.3g}")
    speed = "real time" if abs(slower - 1.0) < 0.02 else f"{factor:g}× {'slower' if slower > 1.0 else 'faster'}"
    return speed + (f", deflections {magnification:g}×" if magnification != 1.0 else "")


def scene_of(
    run: Run,
    mechanism: Mechanism,
    frames: np.ndarray,
    joints: list[str],
    *,
    guides: Sequence[str] = (),
    shown: int = LISTED_MAX,
    on_bars: str | None = None,
    larger: float = 1.0,
    between: bool = True,
) -> Scene:
    """Return the scene of a run at the given samples.

    `larger` scales blocks, loads and symbols. With `between`, a frame shows contacts and largest forces since the previous
    frame, as films do; otherwise those of its own instant.
    """
    load_size = 0.015  # size of payloads and panels as a fraction of the picture's longer side
    if on_bars is not None:
        check_quantity(on_bars, mechanism)
    diagrams = known_diagrams(run, mechanism)
    if on_bars is not None and not diagrams:
        raise InputError(f"{on_bars}: the run has no bending bars", "a run of this mechanism")
    placement = Placement.at(mechanism, run, frames, turns=upright_turns(mechanism))
    bodies = outlines(placement)
    low, high = picture_corners(placement, bodies)
    size = float(np.max(high - low))
    drawn_size = larger * size
    # blocks come first, so that bars are drawn over them
    solid = sorted(_body_shapes(mechanism, placement, bodies, drawn_size), key=lambda shape: shape.kind != "block")
    drawn = symbols(run, mechanism, placement, frames, SIZES.symbol_radius * drawn_size)
    carried = load_shapes(mechanism, placement, load_size * drawn_size)
    panels, payloads = ([shape for shape in carried if shape.kind == kind] for kind in ("panel", "payload"))
    shapes = [*_guide_lines(mechanism, placement, size), *panels, *solid, *payloads, *_component_shapes(drawn, diagrams)]
    loose = tuple((joint.name, placement.place(joint.bearing)) for joint in mechanism.joints if joint.clearance is not None)
    follow = [(guide.name, placement.place(guide.follower)) for guide in mechanism.guides if guide.clearance is not None]
    names = [(load.name, "payload", load.points.mean(axis=1)) for load in payloads]
    names += [(name, "guide", places) for name, places in follow]
    names += [(symbol.name, "component", symbol.anchor) for symbol in drawn if not symbol.bar]
    names += [(name, "joint", places) for name, places in loose]
    pins = [placement.place(joint.bearing) for joint in mechanism.ideal_joints]
    supported = dict.fromkeys(end for joint in mechanism.joints for end in (joint.journal, joint.bearing) if end[0] == GROUND)
    return Scene(
        time=run["time"].values[frames],
        scale=time_scale(run),
        shapes=tuple(shapes),
        pins=np.stack(pins, axis=1) if pins else np.empty((len(frames), 0, 2)),
        supports=np.array([placement.place(end)[0] for end in supported], float).reshape(-1, 2),
        clearance_joints=_clearance_joints(run, mechanism, placement, frames, joints, between=between),
        low=low,
        high=high,
        turns=placement.turns,
        channels=tuple(_channel(run, mechanism, placement, frames, name, between=between) for name in guides),
        shown=shown,
        pin_names=tuple(joint.name for joint in mechanism.ideal_joints),
        tracks=tuple((track.name, _tracked(mechanism, placement, track)) for track in mechanism.tracks),
        magnification=float(run.attrs.get("magnified", 1.0)),
        diagrams=tuple(diagram.at(frames) for diagram in diagrams),
        on_bars=on_bars or "",
        rings=loose,
        names=tuple((name, kind, np.broadcast_to(places, (len(frames), 2))) for name, kind, places in names),
    )


def _tracked(mechanism: Mechanism, placement: Placement, track: Track) -> np.ndarray:
    point = mechanism.body(track.body).points[track.point] if isinstance(track.point, str) else track.point
    return placement.points(track.body, np.array([point], float))[:, 0]


def _body_shapes(mechanism: Mechanism, placement: Placement, outlines: list[np.ndarray], size: float) -> list[Shape]:
    shapes, bars, bent = [], 0, cross_sections(mechanism)
    for body, points in zip(mechanism.bodies, outlines, strict=True):
        if body.name in bent:
            continue
        if points.shape[1] == 1:
            shapes.append(Shape(body.name, "block", _block(mechanism, placement, body.name, points[:, 0], 0.02 * size)))
        else:
            shapes.append(Shape(body.name, "bar" if points.shape[1] == 2 else "plate", points, bars % 2))
            bars += 1
    return shapes


def load_shapes(mechanism: Mechanism, placement: Placement, size: float) -> list[Shape]:
    """Return the shapes of the panels and payloads that `with_panels` and `with_payload` added to a mechanism."""
    square = placement.vectors(PAYLOAD_HALF_SIDE * size * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]))
    shapes = []
    for body in mechanism.bodies:
        for first, last in panel_ends(body):
            ends = placement.points(body.name, np.array([body.points[first], body.points[last]], float))
            start, end = ends[:, 0], ends[:, 1]
            along = end - start
            aside = (
                PANEL_HALF_WIDTH * size * np.stack([-along[:, 1], along[:, 0]], axis=1) / np.linalg.norm(along, axis=1)[:, None]
            )
            corners = np.stack([start - aside, end - aside, end + aside, start + aside], axis=1)
            shapes.append(Shape(first.replace(" start", ""), "panel", corners))
        masses = dict(zip(payload_points(body), body.payloads, strict=False))  # a point that a user named so has no mass
        for name in payload_points(body):
            shown = f"{name}, {masses[name]:.4g} kg" if name in masses else name
            shapes.append(Shape(shown, "payload", placement.place((body.name, name))[:, None] + square))
    return shapes


def _block(mechanism: Mechanism, placement: Placement, body: str, middle: np.ndarray, half: float) -> np.ndarray:
    """Return the corners of a block, whose longer side is along its guide."""
    tilt = np.zeros(placement.count)
    for guide in mechanism.guides:
        if guide.follower[0] == body:
            tilt = guide.direction + placement.angle(guide.body)
            break
    return placed(middle, tilt, half * np.array([[-1.0, -0.6], [1.0, -0.6], [1.0, 0.6], [-1.0, 0.6]]))


def _guide_lines(mechanism: Mechanism, placement: Placement, size: float) -> list[Shape]:
    """Return the lines of the guides, long enough to cross the picture."""
    shapes = []
    for guide in mechanism.guides:
        along = size * np.array([math.cos(guide.direction), math.sin(guide.direction)])
        ends = np.array(guide.through) + np.array([-1.0, 1.0])[:, None] * along
        shapes.append(Shape(guide.name, "guide", placement.points(guide.body, ends)))
    return shapes


def _clearance_joints(
    run: Run, mechanism: Mechanism, placement: Placement, frames: np.ndarray, names: list[str], *, between: bool
) -> tuple[ClearanceJoint, ...]:
    """Return the magnified views of clearance joints in each frame."""
    path_points = 4000  # largest number of points of a journal's path, about the width of a screen in pixels
    if not names:
        return ()
    last = int(frames[-1])
    instants = np.linspace(0, last, min(last + 1, path_points)).astype(int) if between else frames
    path = np.unique(np.concatenate([frames, instants]))
    reached = np.searchsorted(path, frames, side="right") if between else np.zeros(len(frames), int)
    clearance, touching = (values_at(run, *read, "joint", joint=names) for read in (("clearance",), ("in_contact", "time")))
    force = np.hypot(*values_at(run, "reaction", "axis", "time", "joint", joint=names))
    magnified = placement.vectors(values_at(run, "eccentricity", "joint", "time", "axis", joint=names))
    magnified *= (SIZES.magnified_clearance / clearance)[:, None, None]
    touched, largest = _contacts(run, names, frames, touching, force, between=between)
    joints = []
    for k, (name, gap) in enumerate(zip(names, clearance.tolist(), strict=True)):
        joint = mechanism.joint(name)
        if joint.clearance is None:
            what = f"joint '{name}' has clearance in the run but is ideal in the mechanism"
            raise InputError(what, "the mechanism of the run")
        gain = SIZES.magnified_clearance * joint.clearance.journal_radius / gap
        moving = placement.place(joint.bearing), magnified[k, frames], magnified[k, path], reached
        joints.append(ClearanceJoint(name, *moving, touched[:, k], largest[:, k], gain))
    return tuple(joints)


def _contacts(
    run: Run, names: Sequence[str], frames: np.ndarray, touching: np.ndarray, force: np.ndarray, *, between: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Return which points touch in each frame, and their largest forces: at its instant, or since the previous frame.

    Shapes: `touching, force` (samples, points); returns (frames, points), (frames, points).
    """
    if not between:
        return touching[frames], force[frames]
    # a contact may be shorter than a frame
    begins, last = np.concatenate([[0], frames[:-1] + 1]), int(frames[-1]) + 1
    touched, largest = frame_contacts(run, names, run.variables["time"].values[frames])
    touched |= np.logical_or.reduceat(touching[:last], begins, axis=0)
    return touched, np.maximum(np.maximum.reduceat(force[:last], begins, axis=0), largest)


def guides_for_contacts(mechanism: Mechanism, names: Iterable[str]) -> list[str]:
    """Replace the contact points of each clearance guide by the guide's name, once; keep the names of joints."""
    guide = {point.name: point.guide for point in mechanism.contact_points}
    return list(dict.fromkeys(guide.get(name, name) for name in names))


def _channel(run: Run, mechanism: Mechanism, placement: Placement, frames: np.ndarray, guide: str, *, between: bool) -> Channel:
    """Return the magnified view of a clearance guide in each frame."""
    half_length = 1.3  # half the length of the drawn block
    described = mechanism.guide(guide)
    gap = described.clearance
    if gap is None:
        raise InputError(
            f"guide '{guide}' is ideal", "a clearance guide", f'mechanism.with_clearance("{guide}", GuideClearance(...))'
        )
    points = [point for point in mechanism.contact_points if point.guide == guide]
    last = int(frames[-1]) + 1 if between else run.sizes["time"]
    corner = [point.name for point in points]
    indentation, touching = (
        values_at(run, name, "time", "joint", joint=corner)[:last] for name in ("indentation", "in_contact")
    )
    reaction = values_at(run, "reaction", "time", "joint", "axis", joint=corner)[:last]
    follower = mechanism.body(described.follower[0])
    base = 0.0 if described.body == GROUND else mechanism.body(described.body).placed_angle
    direction = base + described.direction - follower.placed_angle
    x, y = (np.array([point.centre for point in points]) - np.array(follower.points[described.follower[1]])).T
    cos, sin = math.cos(direction), math.sin(direction)
    along, across = cos * x + sin * y, cos * y - sin * x
    side, distance = np.sign(across), np.array([point.distance for point in points])
    inside = -1.0 if gap.around else 1.0  # sign of the direction from a corner towards its surface
    half = abs(float(np.mean(distance)) - gap.clearance)
    centred = inside * np.abs(across) + gap.corner_radius  # extent of the outline towards the surface with the block centred
    moved = indentation[frames] + distance - centred
    surface = distance / half + (SIZES.magnified_clearance / gap.clearance - 1.0 / half) * gap.clearance
    heights = inside * side * (centred / half + SIZES.magnified_clearance * moved / gap.clearance)
    tips = np.stack([np.broadcast_to(half_length * along / np.max(np.abs(along)), heights.shape), heights], axis=-1)
    around = np.argsort(np.arctan2(across, along))
    corners = tuple(points[k].name for k in around)
    force = np.linalg.norm(reaction, axis=2)
    touched, largest = _contacts(run, corners, frames, touching.astype(bool)[:, around], force[:, around], between=between)
    return Channel(
        guide,
        tips[:, around],
        touched,
        {face: face * float(surface[inside * side == face][0]) for face in (1.0, -1.0)},
        largest.max(axis=1),
        placement.place(described.follower),
        SIZES.magnified_clearance * half / gap.clearance,
        corners,
        gap.around,
    )


def outlines(placement: Placement) -> list[np.ndarray]:
    """Return the outlines of all bodies in their order, each of shape (samples, points, 2) [m]."""
    return [placement.points(body.name, outline(body)) for body in placement.mechanism.bodies]


def picture_corners(placement: Placement, bodies: Sequence[np.ndarray] | None = None) -> Corners:
    """Return the corners of a region that contains the bodies and ground points at all samples, with a margin."""
    margin_fraction = 0.1  # margin around the mechanism as a fraction of its longer side
    fixed = placement.vectors(np.array([place for _, place in placement.mechanism.ground], float).reshape(-1, 2))
    everything = np.concatenate(
        [*(part.reshape(-1, 2) for part in bodies or outlines(placement)), fixed, wheel_points(placement)]
    )
    low, high = everything.min(axis=0), everything.max(axis=0)
    margin = margin_fraction * (float(np.max(high - low)) or 1.0)
    return low - margin, high + margin


def ring_size(joints: np.ndarray, scale: float, largest: float) -> float:
    """Return a diameter of the rings around joints that leaves the bars between them visible [pt].

    Shapes: `joints` (frames, joints, 2) [m].
    """
    together = 1e-3  # joints nearer than this fraction of the largest distance count as one place
    free_fraction = 0.5  # largest ring diameter as a fraction of the distance between neighbouring joints
    smallest = 3.5  # smallest diameter of a ring [pt]
    apart = np.linalg.norm(joints[:, :, None] - joints[:, None], axis=-1)
    apart[apart <= together * np.max(apart, initial=0.0)] = np.inf
    nearest = float(np.median(np.min(apart, axis=(1, 2), initial=np.inf)))
    return float(np.clip(free_fraction * scale * nearest, smallest, largest))


def upright_turns(mechanism: Mechanism) -> int:
    """Return the number of counter-clockwise quarter turns that make gravity point downwards.

    Return 0 without gravity, or if gravity is oblique.
    """
    oblique = 0.1  # gravity further from the next quarter turn is oblique [quarter turns]
    if mechanism.gravity == 0.0:
        return 0
    turns = (-0.5 * math.pi - mechanism.gravity_direction) / (0.5 * math.pi)
    return round(turns) % 4 if abs(turns - round(turns)) < oblique else 0


def outline(body: Body) -> np.ndarray:
    """Return the outline of a body in its own frame: the segment between its extreme points, or the polygon around them.

    Shapes: returns (points, 2).
    """
    local = np.array([*dict.fromkeys(body.points.values())] or [body.centre], float)
    if len(local) < 3:
        return local
    apart = np.linalg.norm(local[:, None] - local[None], axis=-1)
    i, j = np.unravel_index(int(np.argmax(apart)), apart.shape)
    along = (local[j] - local[i]) / apart[i, j]
    aside = (local - local[i]) @ np.array([-along[1], along[0]])
    if np.max(np.abs(aside)) < 1e-9 * apart[i, j]:
        return local[[i, j]]
    middle = local.mean(axis=0)
    return local[np.argsort(np.arctan2(*(local - middle).T[::-1]))]
