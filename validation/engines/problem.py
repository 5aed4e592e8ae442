"""The four mechanisms as plain data for the engines, with their reference motions."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import xarray as xr

import scissordyn as sd
from scissordyn.exchange.mjcf_text import mjcf
from validation.engines.exact_pin import Pin, motion

SAMPLES = 51
CLEARANCE, JOURNAL = 0.2e-3, 10e-3  # [m] of the pin in the hole
RESTITUTION = 0.7

Problem = dict[str, Any]


def problems() -> dict[str, Problem]:
    """Return the problems by name; `reference` holds x, y, angle and their rates of each body at equal times."""
    crank = sd.slider_crank(crank=0.3, rod=0.8, crank_mass=1.0, rod_mass=1.0, rod_inertia=0.8**2 / 12.0, slider_mass=2.0)
    crank = crank.replace("gravity", 9.81).replace("crank.angular_velocity", 2.0)
    array = sd.scissor(units=30, bar_length=0.5, bar_mass=0.5, slider_mass=1.0, angle=sd.degrees(60))
    array = array.replace("gravity_direction", 0.0)  # across the array: it opens at the anchored end
    return {
        "slider-crank": _free(crank, 1.0),
        "scissor array": _free(array, 0.4),
        "parallelogram": _parallelogram(),
        "pin in a hole": _hole(),
    }


def _free(mechanism: sd.Mechanism, until: float) -> Problem:
    """Return a mechanism of pins and guides that moves freely; the reference is a tight run."""
    run = sd.simulate(mechanism, until=until, samples=SAMPLES, rtol=1e-11, atol=1e-13)
    if run.attrs["status"] != "complete":
        raise RuntimeError(run.attrs["cause"])
    names = [body.name for body in mechanism.bodies]
    ground = dict(mechanism.ground)

    def end(place: tuple[str, str]) -> tuple[int, list[float]]:
        if place[0] == "ground":
            return -1, list(ground[place[1]])
        body = mechanism.body(place[0])
        return names.index(body.name), list(np.subtract(body.points[place[1]], body.centre))

    states = _states(run)
    down = mechanism.gravity * np.array([math.cos(mechanism.gravity_direction), math.sin(mechanism.gravity_direction)])
    return {
        "gravity": down.tolist(),
        "until": until,
        "bodies": [
            {"mass": body.mass, "inertia": body.inertia or 0.0, "pose": state[:3], "rate": state[3:]}
            for body, state in zip(mechanism.bodies, states[0], strict=True)
        ],
        "pins": [[*end(joint.journal), *end(joint.bearing)] for joint in mechanism.joints],
        "slides": [[names.index(guide.follower[0]), guide.direction] for guide in mechanism.guides],
        "mjcf": mjcf(mechanism).text,
        "names": names,
        "reference": states,
    }


def _states(run: xr.Dataset) -> list[Any]:
    """Return x, y, angle and their rates of each body at each time; bodies without rotation have the angle 0."""
    parts = [run[name].sel(axis=axis).values for name in ("position", "velocity") for axis in "xy"]
    turn, rate = (np.nan_to_num(run[name].transpose("time", "body").values) for name in ("angle", "angular_velocity"))
    states: list[Any] = np.stack([*parts[:2], turn, *parts[2:], rate], axis=-1).tolist()
    return states


def _parallelogram() -> Problem:
    """Return two equal cranks with a coupler; without gravity they turn at constant speed through both change points."""
    speed, until, length, span = 6.0, 1.0, 0.3, 0.6
    pins = [[-1, [0.0, 0.0], 0, [-length / 2, 0.0]], [0, [length / 2, 0.0], 1, [-span / 2, 0.0]]]
    pins += [[1, [span / 2, 0.0], 2, [length / 2, 0.0]], [-1, [span, 0.0], 2, [-length / 2, 0.0]]]
    turns = 1.0 + speed * np.linspace(0.0, until, SAMPLES)

    def state(angle: float) -> list[list[float]]:
        x, y = length * math.cos(angle), length * math.sin(angle)
        half = [-speed * y / 2, speed * x / 2]
        places = [x / 2, y / 2, angle], [x + span / 2, y, 0.0], [span + x / 2, y / 2, angle]
        rates = [*half, speed], [-speed * y, speed * x, 0.0], [*half, speed]
        return [[*place, *rate] for place, rate in zip(places, rates, strict=True)]

    masses = [(0.3, 0.3 * length**2 / 12), (0.6, 0.6 * span**2 / 12), (0.3, 0.3 * length**2 / 12)]
    crank = '<inertial pos="0.15 0 0" mass="0.3" diaginertia="0.0015 0.0015 0.00225"/>'
    tree = (
        f'<body name="a" euler="0 0 1"><joint type="hinge" axis="0 0 1"/>{crank}'
        '<body name="c" pos="0.3 0 0" euler="0 0 -1"><joint type="hinge" axis="0 0 1"/>'
        '<inertial pos="0.3 0 0" mass="0.6" diaginertia="0.01 0.01 0.018"/></body></body>'
        f'<body name="b" pos="0.6 0 0" euler="0 0 1"><joint type="hinge" axis="0 0 1"/>{crank}</body>'
    )
    text = (
        '<mujoco><compiler angle="radian"/><option timestep="0.0001" gravity="0 0 0" integrator="RK4"/>'
        f'<worldbody>{tree}</worldbody><equality><connect body1="b" body2="c" anchor="0.3 0 0" solref="0.0002 1" '
        f'solimp="0.9999 0.9999 0.001"/></equality><keyframe><key qvel="{speed} -{speed} {speed}"/></keyframe></mujoco>'
    )
    return {
        "gravity": [0.0, 0.0],
        "until": until,
        "bodies": [
            {"mass": mass, "inertia": inertia, "pose": row[:3], "rate": row[3:]}
            for (mass, inertia), row in zip(masses, state(1.0), strict=True)
        ],
        "pins": pins,
        "slides": [],
        "mjcf": text,
        "names": ["a", "c", "b"],
        "reference": [state(float(angle)) for angle in turns],
    }


def _hole() -> Problem:
    """Return a bar that hangs with a hole on a fixed pin, without friction; the reference is the event-driven solution."""
    start = np.array([0.5, 0.0, 0.0, 0.0, 0.0, 0.0])
    states, _ = motion(Pin(CLEARANCE, JOURNAL + CLEARANCE, RESTITUTION), np.linspace(0.0, 0.5, SAMPLES)[1:], start)
    return {
        "gravity": [0.0, -9.81],
        "until": 0.5,
        "bodies": [{"mass": 1.0, "inertia": 1.0 / 12.0, "pose": [0.5, 0.0, 0.0], "rate": [0.0, 0.0, 0.0]}],
        "pins": [],
        "slides": [],
        "hole": {"body": 0, "place": [-0.5, 0.0], "radius": JOURNAL + CLEARANCE, "pin": JOURNAL, "restitution": RESTITUTION},
        "mjcf": "",
        "names": [],
        "reference": [[state.tolist()] for state in (start, *states)],
    }
