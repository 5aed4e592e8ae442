"""Further parts for a printed case file, with values that fit its structure: `scissordyn new KIND --with servo,tip,payload`."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from scissordyn.component.catalogue import COMPONENTS
from scissordyn.component.place import GROUND, BodyPoint
from scissordyn.component.time_function import Cycloidal
from scissordyn.config.quantity import read_quantity, written
from scissordyn.config.table import instance
from scissordyn.config.time_function import DriveTable
from scissordyn.errors import InputError, command, did_you_mean
from scissordyn.kinematics.path import Path, drive_inertia, drive_rate, path_of
from scissordyn.model.addition import with_panels, with_payload
from scissordyn.model.commanded import rigid
from scissordyn.model.joint import Revolute
from scissordyn.model.mechanism import Mechanism
from scissordyn.plan.plan import plan
from scissordyn.run.inverse_dynamics import feed_forward
from scissordyn.run.start.reaction import ideal_reactions
from scissordyn.units import Quantity

Given = Mapping[str, Any]  # Values of the keys of a table
Changes = Callable[[str, Given], Given]  # From the name of a section and its values to what the user has asked for
DURATION = 2.0  # Of the move from rest to rest, unless another is asked for [s]
HELD = 1.1  # The run lasts longer than the move by this factor, so that what settles is seen
OSCILLATIONS, DAMPING = 6.0, 0.7  # Of the servo's error: natural frequency times the duration of the move, and damping ratio
SHARE = 0.1  # Of the mechanism's mass, weight or size, for payloads and loads
RESERVE = 1.5  # The servo's limit over the torque of the ideal mechanism
AT_REST = 0.01  # Points that move less, as a fraction of the size, do not carry or measure anything
BEYOND = 0.02  # Of the move, by which stops stand behind its end


@dataclass(frozen=True)
class Stroke:
    """A structure and a move of its driven body from rest to rest."""

    mechanism: Mechanism  # Of the printed file
    motion: Cycloidal  # The angle of its driven body

    @cached_property
    def path(self) -> Path:
        """Positions between both ends of the move, with ideal joints."""
        ideal = rigid(self.mechanism.ideal()).driven(self.motion)
        path = path_of(plan(ideal), self.motion.duration)
        assert path is not None, "a printed structure can be driven"
        return path

    @cached_property
    def ends(self) -> tuple[int, int]:
        """Where the move starts and ends on the path."""
        last = self.path.place.size - 1
        return (0, last) if self.turn > 0.0 else (last, 0)

    @property
    def turn(self) -> float:
        """How far the driven body turns [rad]."""
        return self.motion.end - self.motion.start

    @property
    def size(self) -> float:
        """Length of the mechanism's parts [m]."""
        return self.path.closure.size

    @property
    def mass(self) -> float:
        """Of all bodies [kg]."""
        return sum(body.mass for body in self.mechanism.bodies)

    @property
    def weight(self) -> float:
        """A force to compare loads with [N]: the weight, or where there is no gravity that on earth."""
        return self.mass * (self.mechanism.gravity or 9.81)

    def place(self, point: BodyPoint, end: int) -> np.ndarray:
        """Position of a point at the start (0) or the end (1) of the move [m]."""
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
        """A point that loads act from: the first of the ground, or of the driven body."""
        first = next((name for name, _ in self.mechanism.ground), "")
        return (GROUND, first) if first else (self.mechanism.input_body, "start")

    @cached_property
    def tip(self) -> BodyPoint:
        """The point of a body that is farthest from the anchor at the end of the move, and moves."""
        points = [
            (body.name, point)
            for body in self.mechanism.bodies
            for point in body.points
            if np.linalg.norm(self.way((body.name, point))) > AT_REST * self.size and body.name != self.anchor[0]
        ]
        from_anchor = [np.linalg.norm(self.place(point, 1) - self.place(self.anchor, 1)) for point in points]
        return points[int(np.argmax(np.round(from_anchor, 9)))]

    def way(self, point: BodyPoint) -> np.ndarray:
        """From where a point starts to where it ends [m]."""
        return np.asarray(self.place(point, 1) - self.place(point, 0))

    def distance(self, end: int) -> float:
        """From the anchor to the tip at the start (0) or the end (1) of the move [m]."""
        return float(np.linalg.norm(self.place(self.tip, end) - self.place(self.anchor, end)))

    def velocity(self, point: BodyPoint) -> np.ndarray:
        """Of a point at the start, for unit speed of the driven body [m/rad]."""
        name, local = point
        rate, first = drive_rate(self.path, self.ends[0]), self.path.closure.first[name]
        x, y = self.mechanism.body(name).points[local]
        cos, sin = rate[first + 2 : first + 4] if self.path.closure.natural.rotates(name) else (0.0, 0.0)
        return np.asarray(rate[first : first + 2] + np.array([cos * x - sin * y, sin * x + cos * y]))

    @cached_property
    def hinge(self) -> Revolute:
        """A pin between the driven body and another that moves."""
        driven = self.mechanism.input_body
        for joint in self.mechanism.joints:
            names = {joint.journal[0], joint.bearing[0]}
            if driven in names and GROUND not in names:
                return joint
        raise AssertionError("a driven body is pinned to another one")

    @property
    def pair(self) -> dict[str, str]:
        """The driven body and the one that it is pinned to, as `body` and `base`."""
        driven = self.mechanism.input_body
        other = next(name for name in (self.hinge.journal[0], self.hinge.bearing[0]) if name != driven)
        return {"body": driven, "base": other}

    def opening(self, end: int, beyond: float = 0.0) -> float:
        """Angle of the driven body against the other at the start (0) or the end (1) of the move, or beyond it [rad]."""
        names = [body.name for body in self.mechanism.bodies]
        body, base = names.index(self.pair["body"]), names.index(self.pair["base"])
        angle = self.path.angle[:, body] - self.path.angle[:, base]
        # continuous from the angles as placed, in which turns count
        angle += self.mechanism.bodies[body].placed_angle - self.mechanism.bodies[base].placed_angle - angle[self.ends[0]]
        start, last = angle[self.ends[0]], angle[self.ends[1]]
        return float((start, last + beyond * (last - start))[end])


def _said(value: float, unit: str) -> str:
    """A number with two digits and its unit, as one would type it."""
    return written(float(f"{value:.2g}"), unit)


def _exact(value: float, unit: str) -> str:
    """A number as near as a case file has it: to twelve digits."""
    return written(round(value, 12), unit)


def _move(start: str, end: str, duration: float = DURATION) -> dict[str, Any]:
    return {"cycloidal": {"start": start, "end": end, "duration": written(duration, "s")}}


def _servo(stroke: Stroke) -> Given:
    inertia = float(drive_inertia(stroke.path)[stroke.ends[0]])
    bandwidth = 2.0 * math.pi * OSCILLATIONS / stroke.motion.duration
    torque = np.abs(feed_forward(stroke.mechanism, stroke.motion, until=stroke.motion.duration, samples=201).values)
    gains = {
        "name": "feed-forward",
        "proportional": _said(inertia * bandwidth**2, "N m/rad"),
        "derivative": _said(2.0 * DAMPING * inertia * bandwidth, "N m s/rad"),
        "limit": _said(RESERVE * float(torque.max()), "N m"),
    }
    return {"controller": gains, "feed_forward": "ideal", "name": "servo"}


def _tip(stroke: Stroke) -> Given:
    body, point = stroke.tip
    return {"name": "tip", "body": body, "point": point, "tolerance": _said(1e-3 * stroke.size, "m")}


def _panels(stroke: Stroke) -> Given:
    names = [body.name for body in stroke.mechanism.bodies]
    first = "unit */bar 1" if "unit 1/bar 1" in names else stroke.pair["base"]
    return {"bodies": first, "mass": _said(SHARE * stroke.mass, "kg")}


def _line(stroke: Stroke) -> dict[str, str]:
    return {"start": ".".join(stroke.anchor), "end": ".".join(stroke.tip)}


def _spring(stroke: Stroke) -> Given:
    middle = 0.5 * (stroke.distance(0) + stroke.distance(1))
    return {**_line(stroke), "stiffness": _said(stroke.weight / stroke.size, "N/m"), "free_length": _said(middle, "m")}


def _cable(stroke: Stroke) -> Given:
    return {**_line(stroke), "free_length": _said(1.01 * max(stroke.distance(0), stroke.distance(1)), "m")}


def _pin_friction(stroke: Stroke) -> Given:
    if np.isnan(ideal_reactions(plan(rigid(stroke.mechanism.ideal()).driven(stroke.motion)))).any():
        raise InputError(
            "friction in a pin whose reaction is not determined: this structure has more joints than it needs",
            "a friction torque that is given",
            "--with clutch",
        )
    return {**stroke.pair, "radius": _said(0.01 * stroke.size, "m"), "kinetic": 0.1}


def _rod(stroke: Stroke) -> Given:
    start, end = (stroke.distance(end) for end in (0, 1))
    velocity = np.dot(stroke.place(stroke.tip, 0) - stroke.place(stroke.anchor, 0), stroke.velocity(stroke.tip)) / start
    if abs(velocity) < AT_REST * stroke.size:
        raise InputError(
            f"a rod from {'.'.join(stroke.anchor)} to {'.'.join(stroke.tip)} cannot drive this structure at its start",
            "a motor, or a rod elsewhere",
            "--with motor",
        )
    return {**_line(stroke), "motion": _move(_exact(start, "m"), _said(end, "m"), stroke.motion.duration)}


def _travel_stop(stroke: Stroke) -> Given:
    way = stroke.way(stroke.tip)
    along = way / np.linalg.norm(way)
    limit = float(along @ (stroke.place(stroke.tip, 1) + BEYOND * way))
    return {
        "point": ".".join(stroke.tip),
        "direction": _exact(math.atan2(along[1], along[0]), "rad"),
        "limit": _exact(limit, "m"),
    }


def _tape_spring(stroke: Stroke) -> Given:
    moment = SHARE * stroke.weight * stroke.size
    shares = {"peak_moment": 1.0, "steady_moment": 0.15, "peak_moment_equal": 0.4, "steady_moment_equal": 0.1}
    moments = {name: _said(share * moment, "N m") for name, share in shares.items()}
    stiffness = _said(10.0 * moment, "N m/rad")
    return {**stroke.pair, "stiffness": stiffness, **moments, "free_angle": _exact(stroke.opening(1), "rad")}


def _motor(stroke: Stroke) -> Given:
    torque = SHARE * stroke.weight * stroke.size
    return {
        "body": stroke.mechanism.input_body,
        "stall_torque": _said(math.copysign(torque, stroke.turn), "N m"),
        "no_load_speed": _said(2.0 * abs(stroke.turn) / stroke.motion.duration, "rad/s"),
        "limit": _said(0.8 * torque, "N m"),
    }


def _list(values: Iterable[float], unit: str) -> str:
    return ", ".join(f"{value:.4g}" for value in values) + f" {unit}"


def _reach(stroke: Stroke) -> tuple[float, float]:
    """The least and the largest distance from anchor to tip on the way, and a tenth more [m]."""
    ends = sorted(stroke.distance(end) for end in (0, 1))
    return 0.9 * ends[0], 1.1 * ends[1]


def _nonlinear_spring(stroke: Stroke) -> Given:
    low, high = _reach(stroke)
    forces = (share * SHARE * stroke.weight for share in (0.0, 0.3, 1.0))
    return {
        **_line(stroke),
        "curve": {"lengths": _list((low, 0.5 * (low + high), high), "m"), "forces": _list(forces, "N")},
    }


def _gas_spring(stroke: Stroke) -> Given:
    low, high = _reach(stroke)
    lengths = {"extended_length": f"{high:.4g} m", "stroke": f"{high - low:.4g} m"}
    return {**_line(stroke), "force": _said(SHARE * stroke.weight, "N"), **lengths}


def _stroke_load(stroke: Stroke) -> Given:
    way = stroke.way(stroke.tip)
    direction = math.atan2(way[1], way[0])
    start = float(np.array([math.cos(direction), math.sin(direction)]) @ stroke.place(stroke.tip, 0))
    length = float(np.linalg.norm(way))
    travels = (start - 0.2 * length, start + 0.5 * length, start + 1.2 * length)
    forces = (-share * SHARE * stroke.weight for share in (0.0, 1.0, 0.5))
    curve = {"travels": _list(travels, "m"), "forces": _list(forces, "N")}
    return {"point": ".".join(stroke.tip), "direction": _exact(direction, "rad"), "curve": curve}


def _angle_load(stroke: Stroke) -> Given:
    torques = (share * SHARE * stroke.weight * stroke.size for share in (0.0, 1.0, 0.0, -1.0, 0.0))
    curve = {"angles": "0, 90, 180, 270, 360 deg", "torques": _list(torques, "N m")}
    return {"body": stroke.mechanism.input_body, "curve": curve, "periodic": True}


def _tabulated_motor(stroke: Stroke) -> Given:
    torque = math.copysign(SHARE * stroke.weight * stroke.size, stroke.turn)
    speed = 2.0 * stroke.turn / stroke.motion.duration
    ends = sorted(((-2.0 * speed, torque), (0.0, torque), (0.8 * speed, 1.2 * torque), (speed, 0.0), (5.0 * speed, -torque)))
    speeds, torques = zip(*ends, strict=True)
    return {
        "body": stroke.mechanism.input_body,
        "curve": {"speeds": _list(speeds, "rad/s"), "torques": _list(torques, "N m")},
    }


def _linear_motor(stroke: Stroke) -> Given:
    start, end = (stroke.distance(end) for end in (0, 1))
    force, speed = math.copysign(SHARE * stroke.weight, end - start), 2.0 * (end - start) / stroke.motion.duration
    ends = sorted(((-20.0 * speed, force), (0.0, force), (speed, 0.0), (20.0 * speed, -force)))
    speeds, forces = zip(*ends, strict=True)
    return {**_line(stroke), "curve": {"speeds": _list(speeds, "m/s"), "forces": _list(forces, "N")}}


def _bushing(stroke: Stroke) -> Given:
    start, end = stroke.hinge.journal, stroke.hinge.bearing
    turned = stroke.mechanism.body(end[0]).placed_angle - stroke.mechanism.body(start[0]).placed_angle
    return {"start": ".".join(start), "end": ".".join(end), "free_angle": _exact(turned, "rad")}


FURTHER: Mapping[str, tuple[str, Callable[[Stroke], Given]]] = {
    "servo": ("control", _servo),
    "tip": ("track", _tip),
    "payload": ("payload", lambda stroke: {"at": ".".join(stroke.tip), "mass": _said(SHARE * stroke.mass, "kg")}),
    "panels": ("panels", _panels),
    "spring": ("spring", _spring),
    "constant_force_spring": (
        "constant_force_spring",
        lambda stroke: {**_line(stroke), "tension": _said(SHARE * stroke.weight, "N")},
    ),
    "nonlinear_spring": ("nonlinear_spring", _nonlinear_spring),
    "gas_spring": ("gas_spring", _gas_spring),
    "cable": ("cable", _cable),
    "torsion_spring": (
        "torsion_spring",
        lambda stroke: {
            **stroke.pair,
            "stiffness": _said(SHARE * stroke.weight * stroke.size, "N m/rad"),
            "free_angle": _exact(stroke.opening(1), "rad"),
        },
    ),
    "tape_spring": ("tape_spring", _tape_spring),
    "clutch": ("clutch", lambda stroke: {**stroke.pair, "capacity": _said(SHARE * stroke.weight * stroke.size, "N m")}),
    "pin_friction": ("pin_friction", _pin_friction),
    "pin_lugre": ("pin_lugre", _pin_friction),
    "bushing": ("bushing", _bushing),
    "force": (
        "force",
        lambda stroke: {"point": ".".join(stroke.tip), "force": f"0, {-float(f'{SHARE * stroke.weight:.2g}'):g} N"},
    ),
    "torque": (
        "torque",
        lambda stroke: {
            "body": stroke.mechanism.input_body,
            "torque": _said(SHARE * stroke.weight * stroke.size, "N m"),
        },
    ),
    "stroke_load": ("stroke_load", _stroke_load),
    "angle_load": ("angle_load", _angle_load),
    "motor": ("motor", _motor),
    "tabulated_motor": ("tabulated_motor", _tabulated_motor),
    "linear_motor": ("linear_motor", _linear_motor),
    "angle_stop": ("angle_stop", lambda stroke: {**stroke.pair, "angle": _exact(stroke.opening(1, BEYOND), "rad")}),
    "travel_stop": ("travel_stop", _travel_stop),
    "rod": ("rod", _rod),
    "latch": ("latch", lambda stroke: {**stroke.pair, "angle": _exact(stroke.opening(1, -0.01), "rad")}),
}
"""What can be asked for: the table of each, and its values for a structure and its move."""

DRIVING = ("motor", "tabulated_motor", "linear_motor", "rod")  # Parts that move the mechanism in place of a drive

assert set(COMPONENTS) - {"actuator", "beam", "flexible_bar", "roller", "cam", "guide_friction", "guide_lugre"} <= set(FURTHER)


LOADS = ("payload", "panels")


def _loaded(mechanism: Mechanism, load: str, given: Given) -> Mechanism:
    """The mechanism with a payload or panels."""
    mass = read_quantity(given["mass"], Quantity("kg"))
    return with_payload(mechanism, given["at"], mass) if load == "payload" else with_panels(mechanism, given["bodies"], mass)


def fitted(mechanism: Mechanism, turn: float, parts: Iterable[str], changes: Changes) -> dict[str, Given]:
    """Tables of further parts for a structure, and what else changes in its file with them."""
    names = list(dict.fromkeys(parts))
    for name in names:
        if name not in FURTHER:
            raise InputError(
                f"part '{name}'{did_you_mean(name, FURTHER)}",
                ", ".join(FURTHER) + "; scissordyn new mechanism shows the tables of bodies, joints and guides",
                "scissordyn new scissor --with servo,tip,payload",
            )
    drives = [name for name in names if name in (*DRIVING, "servo")]
    if len(drives) > 1:
        both = f"{drives[0]} and {drives[1]}, which both drive the structure"
        raise InputError(both, "one of them", f"--with {command(drives[0])}")
    if "latch" in names and not drives:
        raise InputError("a latch, which a prescribed drive does not let lock", "a latch with a servo", "--with servo,latch")
    start = mechanism.body(mechanism.input_body).placed_angle
    drive = changes("drive", _move(_exact(start, "rad"), _exact(start + turn, "rad")))
    motion = instance(DriveTable, drive, {}).motion()
    assert isinstance(motion, Cycloidal), "the only motion of this table"
    tables: dict[str, Given] = {}
    for name in sorted(names, key=lambda part: part not in LOADS):  # servo and springs are for the loaded structure
        section, values = FURTHER[name]
        tables[section] = changes(section, values(Stroke(mechanism, motion)))
        if name in LOADS:
            mechanism = _loaded(mechanism, name, tables[section])
    if not set(names) & set(DRIVING):
        tables["drive"] = drive
    tables["run"] = {"until": written(HELD * motion.duration, "s")}
    return tables
