"""Values of additional parts for a structure, as in `scissordyn new KIND --with servo`: they fit its size and motion."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, get_type_hints

import numpy as np

from scissordyn.casefile.part import PARTS
from scissordyn.casefile.quantity import exact_text, rounded_text
from scissordyn.casefile.structure import ControlTable, PanelsTable, PayloadTable
from scissordyn.casefile.table import Table, instance
from scissordyn.casefile.time_function import DriveTable
from scissordyn.components.catalogue import COMPONENTS
from scissordyn.components.place import GROUND, BodyPoint
from scissordyn.components.time_function import Cycloidal
from scissordyn.control.catalogue import controller
from scissordyn.equilibrium.start import ideal_reactions
from scissordyn.errors import InputError, command, did_you_mean
from scissordyn.kinematics.path import Path, drive_inertia, drive_rate, path_of
from scissordyn.model.addition import with_panels, with_payload
from scissordyn.model.commanded import rigid
from scissordyn.model.mechanism import Mechanism
from scissordyn.plan.plan import plan
from scissordyn.run.inverse_dynamics import feed_forward
from scissordyn.units import Pairs, extras, quantities

Given = Mapping[str, Any]  # values of a table by key
# function(table name, values of the table) -> values with the user's changes
Changes = Callable[[str, Given], Given]


@dataclass(frozen=True)
class Stroke:
    """Structure whose driven body moves from rest to rest."""

    mechanism: Mechanism
    motion: Cycloidal  # angle of the driven body over time
    margin: float = 0.02  # [of the stroke] distance of end stops beyond the end of the motion
    least_motion: float = 0.01  # [mechanism sizes] points with a smaller motion get no load and no measurement
    load: float = 0.1  # [of the mechanism's mass, weight or size] size of payloads and loads

    @cached_property
    def path(self) -> Path:
        """Positions of the ideal mechanism from start to end of the motion."""
        ideal = rigid(self.mechanism.ideal()).driven(self.motion)
        path = path_of(plan(ideal), self.motion.duration)
        assert path is not None, "a printed structure can be driven"
        return path

    @cached_property
    def ends(self) -> tuple[int, int]:
        """Indices of the first and last position of the motion among the positions of `path`."""
        last = self.path.place.size - 1
        return (0, last) if self.turn > 0.0 else (last, 0)

    @property
    def is_limited(self) -> bool:
        """True if the driven body cannot turn round without passing a singular position."""
        turn = math.copysign(2.0 * math.pi, self.turn)
        path = path_of(plan(rigid(self.mechanism.ideal()).driven(speed=turn)), 1.0)
        return path is None or bool(path.singular)

    @property
    def turn(self) -> float:
        """Rotation of the driven body during the motion [rad]."""
        return self.motion.end - self.motion.start

    @property
    def size(self) -> float:
        """Size of the mechanism [m]."""
        return self.path.closure.size

    @property
    def mass(self) -> float:
        """Mass of all bodies [kg]."""
        return sum(body.mass for body in self.mechanism.bodies)

    @property
    def weight(self) -> float:
        """Weight of the mechanism [N], with 9.81 m/s^2 if it has no gravity; the sizes of loads are fractions of it."""
        return self.mass * (self.mechanism.gravity or 9.81)

    def place(self, point: BodyPoint, end: int) -> np.ndarray:
        """Return the position of a point at the start (0) or the end (1) of the motion [m]."""
        name, local = point
        if name == GROUND:
            return np.array(dict(self.mechanism.ground)[local])
        k = [body.name for body in self.mechanism.bodies].index(name)
        body, angle = self.mechanism.bodies[k], self.path.angle[self.ends[end], k]
        x, y = np.subtract(body.points[local], body.centre)
        cos, sin = math.cos(angle), math.sin(angle)
        return np.asarray(self.path.position[self.ends[end], k] + (cos * x - sin * y, sin * x + cos * y))

    @cached_property
    def anchor(self) -> BodyPoint:
        """Point that is the fixed end of springs and cables: the first point of the ground, or of the driven body."""
        first = next((name for name, _ in self.mechanism.ground), "")
        return (GROUND, first) if first else (self.mechanism.input_body, "start")

    @cached_property
    def tip(self) -> BodyPoint:
        """Moving point that is farthest from the anchor at the end of the motion."""
        points = [
            (body.name, point)
            for body in self.mechanism.bodies
            for point in body.points
            if np.linalg.norm(self.displacement((body.name, point))) > self.least_motion * self.size
            and body.name != self.anchor[0]
        ]
        from_anchor = [np.linalg.norm(self.place(point, 1) - self.place(self.anchor, 1)) for point in points]
        return points[int(np.argmax(np.round(from_anchor, 9)))]

    def displacement(self, point: BodyPoint) -> np.ndarray:
        """Return the displacement of a point from the start to the end of the motion [m]."""
        return np.asarray(self.place(point, 1) - self.place(point, 0))


def _rounded(value: float, digits: int = 2) -> float:
    """Return a number rounded to `digits` significant digits."""
    return float(f"{value:.{digits}g}")


def _without_round_off(value: float) -> float:
    """Return a number rounded to 14 decimals, which removes round-off."""
    return round(value, 14) + 0.0  # adding 0.0 removes the sign of -0


def _curve(pairs: Iterable[tuple[float, float]]) -> list[tuple[float, ...]]:
    """Return the points of a curve in increasing order, rounded to four significant digits."""
    return [tuple(_rounded(number, 4) for number in pair) for pair in sorted(pairs)]


def _in_units(section: str, values: Given) -> Given:
    """Return the values of a table as text, with the units that its keys declare; other values stay."""
    units = {key: declared.quantity.unit for key, declared in _table(section).declared_keys().items() if declared.quantity}
    written_values = dict(values)
    for key, value in values.items():
        if isinstance(value, float) and units[key] != "1":
            written_values[key] = rounded_text(value, units[key])
        elif isinstance(value, list):
            hint = get_type_hints(COMPONENTS[section], include_extras=True)[key]
            pairs = next(extra for extra in extras(hint) if isinstance(extra, Pairs))
            columns = zip(pairs.names, zip(*value, strict=True), pairs.units, strict=True)
            written_values[key] = {name: exact_text(column, unit) for name, column, unit in columns}
        elif key == "controller":
            kind: Any = controller(value["name"])
            gains = quantities(kind)
            written_values[key] = {
                name: rounded_text(number, gains[name].unit) if name in gains else number for name, number in value.items()
            }
    return written_values


def _table(section: str) -> type[Table]:
    """Return the table of a part of a case file."""
    return ControlTable if section == "control" else LOAD_TABLES[section] if section in LOAD_TABLES else PARTS[section].table


def _move(start: float, end: float, unit: str, duration: float = 2.0) -> dict[str, Any]:
    return {
        "cycloidal": {
            "start": rounded_text(start, unit),
            "end": rounded_text(end, unit),
            "duration": rounded_text(duration, "s"),
        }
    }


Values = Mapping[str, Given]  # values of the tables of parts, by name of the part


def _servo(stroke: Stroke) -> Values:
    """Return a servo with 6 natural oscillations per motion, damping ratio 0.7, and 1.5 times the needed torque."""
    inertia = float(drive_inertia(stroke.path)[stroke.ends[0]])
    bandwidth = 2.0 * math.pi * 6.0 / stroke.motion.duration
    torque = np.abs(feed_forward(stroke.mechanism, stroke.motion, until=stroke.motion.duration, samples=201).values)
    gains = {
        "name": "feed-forward",
        "proportional": _rounded(inertia * bandwidth**2),
        "derivative": _rounded(2.0 * 0.7 * inertia * bandwidth),
        "limit": _rounded(1.5 * float(torque.max())),
    }
    return {"servo": {"controller": gains, "feed_forward": "ideal", "name": "servo"}}


def _parts_at_tip(stroke: Stroke) -> Values:
    body, point = stroke.tip
    displacement, tip, force = stroke.displacement(stroke.tip), ".".join(stroke.tip), stroke.load * stroke.weight
    length = float(np.linalg.norm(displacement))
    along = displacement / length
    direction = math.atan2(along[1], along[0])
    start, limit = (
        float(along @ place)
        for place in (stroke.place(stroke.tip, 0), stroke.place(stroke.tip, 1) + stroke.margin * displacement)
    )
    load = [(start - 0.2 * length, 0.0), (start + 0.5 * length, -force), (start + 1.2 * length, -0.5 * force)]
    return {
        "tip": {"name": "tip", "body": body, "point": point, "tolerance": _rounded(1e-3 * stroke.size)},
        "payload": {"at": tip, "mass": _rounded(stroke.load * stroke.mass)},
        "force": {"point": tip, "force": f"0, {-float(f'{force:.2g}'):g} N"},
        "drag": {"point": tip, "drag_coefficient": 1.0, "area": _rounded((0.1 * stroke.size) ** 2)},
        "stroke_load": {"point": tip, "direction": _without_round_off(direction), "curve": _curve(load)},
        "travel_stop": {"point": tip, "direction": _without_round_off(direction), "limit": _without_round_off(limit)},
    }


def _parts_along_line(stroke: Stroke) -> Values:
    """Return springs, cables and other parts that act along the line from the anchor to the tip."""
    start, end = (float(np.linalg.norm(stroke.place(stroke.tip, k) - stroke.place(stroke.anchor, k))) for k in (0, 1))
    low, high = 0.9 * min(start, end), 1.1 * max(start, end)  # the range of the motion, extended by a tenth
    force, middle = stroke.load * stroke.weight, 0.5 * (low + high)
    pushed, speed = math.copysign(force, end - start), 2.0 * (end - start) / stroke.motion.duration
    progressive = [(low, 0.0), (middle, 0.3 * force), (high, force)]
    drive = [(-20.0 * speed, pushed), (0.0, pushed), (speed, 0.0), (20.0 * speed, -pushed)]
    parts: dict[str, Given] = {
        "spring": {
            "stiffness": _rounded(stroke.weight / stroke.size),
            "free_length": _rounded(0.5 * (start + end)),
        },
        "constant_force_spring": {"tension": _rounded(force)},
        "nonlinear_spring": {"curve": _curve(progressive)},
        "gas_spring": {
            "force": _rounded(force),
            "extended_length": _rounded(high, 4),
            "stroke": _rounded(high - low, 4),
        },
        "cable": {"free_length": _rounded(1.01 * max(start, end))},
        "linear_motor": {"curve": _curve(drive)},
        "rod": {"motion": _move(_without_round_off(start), _rounded(end), "m", stroke.motion.duration)},
    }
    line = {"start": ".".join(stroke.anchor), "end": ".".join(stroke.tip)}
    return {name: {**line, **values} for name, values in parts.items()}


def _rod(stroke: Stroke) -> Values:
    """Return a rod that drives the structure; raise `InputError` if the tip does not move along the rod at the start."""
    (name, point), path = stroke.tip, stroke.path
    rate, first = drive_rate(path, stroke.ends[0]), path.closure.first[name]
    x, y = stroke.mechanism.body(name).points[point]
    cos, sin = rate[first + 2 : first + 4] if path.closure.natural.rotates(name) else (0.0, 0.0)
    velocity = rate[first : first + 2] + np.array([cos * x - sin * y, sin * x + cos * y])
    line = stroke.place(stroke.tip, 0) - stroke.place(stroke.anchor, 0)
    if abs(np.dot(line, velocity) / np.linalg.norm(line)) < stroke.least_motion * stroke.size:
        raise InputError(
            f"a rod from {'.'.join(stroke.anchor)} to {'.'.join(stroke.tip)} cannot drive this structure at its start",
            "a motor, or a rod elsewhere",
            "--with motor",
        )
    return _parts_along_line(stroke)


def _parts_at_pin(stroke: Stroke) -> Values:
    """Return torsion springs, clutches and other parts between the driven body and a moving body that is pinned to it."""
    mechanism, driven = stroke.mechanism, stroke.mechanism.input_body
    pin = next(joint for joint in mechanism.joints if driven in joint.bodies and GROUND not in joint.bodies)
    base = next(name for name in pin.bodies if name != driven)
    names = [body.name for body in mechanism.bodies]
    angle = stroke.path.angle[:, names.index(driven)] - stroke.path.angle[:, names.index(base)]
    # the angle starts with its placed value, full turns included
    angle += mechanism.body(driven).placed_angle - mechanism.body(base).placed_angle - angle[stroke.ends[0]]
    start, end = (float(angle[k]) for k in stroke.ends)
    turned = mechanism.body(pin.bearing[0]).placed_angle - mechanism.body(pin.journal[0]).placed_angle
    moment = stroke.load * stroke.weight * stroke.size
    shares = {"peak_moment": 1.0, "steady_moment": 0.15, "peak_moment_equal": 0.4, "steady_moment_equal": 0.1}
    moments = {name: _rounded(share * moment) for name, share in shares.items()}
    friction = {"radius": _rounded(0.01 * stroke.size), "kinetic": 0.1}
    hinges: dict[str, Given] = {
        "torsion_spring": {"stiffness": _rounded(moment), "free_angle": _without_round_off(end)},
        "tape_spring": {"stiffness": _rounded(10.0 * moment), **moments, "free_angle": _without_round_off(end)},
        "clutch": {"capacity": _rounded(moment)},
        "pin_friction": friction,
        "pin_lugre": friction,
        "angle_stop": {"angle": _without_round_off(end + stroke.margin * (end - start))},
        "latch": {"angle": _without_round_off(end - 0.01 * (end - start))},
    }
    ends = {"start": ".".join(pin.journal), "end": ".".join(pin.bearing)}
    return {
        **{name: {"body": driven, "base": base, **values} for name, values in hinges.items()},
        "panels": {
            "bodies": "unit */bar 1" if "unit 1/bar 1" in names else base,
            "mass": _rounded(stroke.load * stroke.mass),
        },
        "bushing": {**ends, "free_angle": _without_round_off(turned)},
    }


def _parts_with_friction(stroke: Stroke) -> Values:
    if np.isnan(ideal_reactions(plan(rigid(stroke.mechanism.ideal()).driven(stroke.motion)))).any():
        raise InputError(
            "pin friction: the structure has redundant joints, therefore the pin's reaction is not determined",
            "a given friction torque",
            "--with clutch",
        )
    return _parts_at_pin(stroke)


def _parts_on_driven_body(stroke: Stroke) -> Values:
    torque = stroke.load * stroke.weight * stroke.size
    cogging = [(0.5 * math.pi * k, _rounded(torque * share, 4)) for k, share in enumerate((0.0, 1.0, 0.0, -1.0, 0.0))]
    parts: Values = {
        "torque": {"torque": _rounded(torque)},
        "angle_load": {"curve": cogging, "periodic": True},
    }
    return {name: {"body": stroke.mechanism.input_body, **values} for name, values in parts.items()}


def _motors(stroke: Stroke) -> Values:
    """Return motors with 1.5 times the torque that the motion needs at each speed, and twice its largest speed."""
    needed = np.abs(feed_forward(stroke.mechanism, stroke.motion, until=stroke.motion.duration, samples=201).values)
    fastest = 2.0 * stroke.turn / stroke.motion.duration
    speed = 0.5 * fastest * (1.0 - np.cos(np.linspace(0.0, 2.0 * math.pi, needed.size)))  # of a cycloidal motion
    stall = math.copysign(1.5 * float(np.max(needed / (1.0 - speed / (2.0 * fastest)))), stroke.turn)
    body = stroke.mechanism.input_body
    motor = {
        "stall_torque": _rounded(stall),
        "no_load_speed": _rounded(2.0 * abs(fastest)),
        "limit": _rounded(abs(stall)),
    }
    curve = [(-4.0 * fastest, stall), (0.0, stall), (2.0 * fastest, 0.0), (10.0 * fastest, -4.0 * stall)]
    return {"motor": {"body": body, **motor}, "tabulated_motor": {"body": body, "curve": _curve(curve)}}


PART_VALUES: Mapping[str, Callable[[Stroke], Values]] = {
    "servo": _servo,
    "tip": _parts_at_tip,
    "payload": _parts_at_tip,
    "panels": _parts_at_pin,
    **dict.fromkeys(("spring", "constant_force_spring", "nonlinear_spring", "gas_spring", "cable"), _parts_along_line),
    **dict.fromkeys(("torsion_spring", "tape_spring", "clutch"), _parts_at_pin),
    **dict.fromkeys(("pin_friction", "pin_lugre"), _parts_with_friction),
    "bushing": _parts_at_pin,
    **dict.fromkeys(("force", "drag"), _parts_at_tip),
    "torque": _parts_on_driven_body,
    "stroke_load": _parts_at_tip,
    "angle_load": _parts_on_driven_body,
    **dict.fromkeys(("motor", "tabulated_motor"), _motors),
    "linear_motor": _parts_along_line,
    "angle_stop": _parts_at_pin,
    "travel_stop": _parts_at_tip,
    "rod": _rod,
    "latch": _parts_at_pin,
}
"""Functions that fit the values of an additional part to a structure and its motion, by name of the part."""

SECTIONS = {name: {"servo": "control", "tip": "track"}.get(name, name) for name in PART_VALUES}
"""Table of the case file that describes an additional part, by name of the part."""

DRIVING_PARTS = ("motor", "tabulated_motor", "linear_motor", "rod")  # parts that move the structure instead of a drive

MOTORS, STOPS = ("motor", "tabulated_motor"), ("angle_stop", "travel_stop")  # parts that turn the structure or end its motion

NOT_FITTED = {"actuator", "beam", "flexible_bar", "roller", "cam", "edge_contact", "guide_friction", "guide_lugre"}
"""Tables of components that `fit_parts` does not fit to a structure."""

assert set(COMPONENTS) - NOT_FITTED <= set(PART_VALUES)


LOAD_TABLES: Mapping[str, type[Table]] = {"payload": PayloadTable, "panels": PanelsTable}
"""Tables of the parts that increase the mass of the structure."""


def fit_parts(mechanism: Mechanism, turn: float, parts: Iterable[str], changes: Changes) -> dict[str, Given]:
    """Return the values of the tables of additional parts, and of other tables that change with them.

    A motor gets an end stop if it could drive the structure through a singular position.
    `turn` is the rotation of the driven body from rest to rest [rad]; `changes` applies the user's changes to a table.
    """
    names = list(dict.fromkeys(parts))
    for name in names:
        if name not in PART_VALUES:
            raise InputError(
                f"unknown part '{name}'{did_you_mean(name, PART_VALUES)}",
                ", ".join(PART_VALUES) + "; scissordyn new mechanism shows the tables of bodies, joints and guides",
                "scissordyn new scissor --with servo,tip,payload",
            )
    drives = [name for name in names if name in (*DRIVING_PARTS, "servo")]
    if len(drives) > 1:
        both = f"{drives[0]} and {drives[1]} both drive the structure"
        raise InputError(both, "one driving part", f"--with {command(drives[0])}")
    if "latch" in names and drives in ([], ["rod"]):
        raise InputError("a latch cannot lock against a prescribed motion", "a latch with a servo", "--with servo,latch")
    start = mechanism.body(mechanism.input_body).placed_angle
    drive = changes("drive", _move(_without_round_off(start), _without_round_off(start + turn), "rad"))
    motion = instance(DriveTable, drive, {}).motion()
    assert isinstance(motion, Cycloidal), "the only motion of this table"
    stroke = Stroke(mechanism, motion)
    if set(names) & set(MOTORS) and not set(names) & set(STOPS) and stroke.is_limited:
        names.append(STOPS[0])  # a motor would drive the structure through its singular position
    tables: dict[str, Given] = {}
    for name in sorted(
        names, key=lambda part: part not in LOAD_TABLES
    ):  # loads first, because the servo and springs depend on the mass of the structure
        section = SECTIONS[name]
        tables[section] = changes(section, _in_units(section, PART_VALUES[name](stroke)[name]))
        if name in LOAD_TABLES:
            add, where = (with_payload, "at") if name == "payload" else (with_panels, "bodies")
            mass = LOAD_TABLES[name].declared_keys()["mass"].read(tables[section]["mass"], {})
            stroke = Stroke(add(stroke.mechanism, tables[section][where], mass), motion)
    if not set(names) & set(DRIVING_PARTS):
        tables["drive"] = drive
    tables["run"] = {"until": rounded_text(1.1 * motion.duration, "s")}
    return tables
