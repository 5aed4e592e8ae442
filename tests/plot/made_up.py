"""Made-up runs with the names, shapes and sizes of real ones, and helpers to read the texts of figures."""

import base64
import itertools
import json
import math
import re

import numpy as np
import xarray as xr
from matplotlib.text import Text

import scissordyn as sd
from scissordyn.plot.animation import Film
from scissordyn.plot.animation_scene import scene_of

INSTANTS, END = 2001, 0.05  # Number of samples and end time [s] of a made-up run
CLEARANCE = 0.5e-3  # [m] radial clearance of the joints
CLEARANCE_JOINTS = {"A": 0.0, "unit 1/pivot": 1.3e-3}
"""[s] Delay of the contacts in each clearance joint of a made-up run."""


def mechanism_with(joints):
    arm = sd.scissor(units=2)
    for name in joints:
        arm = arm.with_clearance(name, sd.Clearance(CLEARANCE))
    return arm


def made_up(joints=("A",), *, contacts=True, **attributes):
    """Make up an array that opens at 150 rpm, with contact pulses of 0.3 ms that reach 40 to 85 kN."""
    arm = mechanism_with(joints)
    time = np.linspace(0.0, END, INSTANTS)
    names = [joint.name for joint in (*arm.joints, *arm.guides)]
    bodies = [body.name for body in arm.bodies]
    w, start, length = 5.0 * math.pi, math.pi / 6, 2.0
    theta = start + w * time
    first = np.arange(1.4e-3, END, 2.1e-3) if contacts else np.empty(0)
    rattle = np.zeros(INSTANTS)

    per_joint = {name: np.full((INSTANTS, len(names)), np.nan) for name in ("indentation", "normal_force", "friction_force")}
    eccentricity = np.full((INSTANTS, len(names), 2), np.nan)
    touching = np.zeros((INSTANTS, len(names)), bool)
    clearance = np.full(len(names), np.nan)
    table = []
    for name in joints:
        k, starts = names.index(name), first + CLEARANCE_JOINTS[name]
        pulse = np.zeros(INSTANTS)
        for number, begin in enumerate(starts):
            peak = 40e3 + 45e3 * ((number * 7) % 10) / 9
            inside = (time > begin) & (time < begin + 0.3e-3)
            pulse += np.where(inside, peak * np.sin(math.pi * (time - begin) / 0.3e-3), 0.0)
            table.append((begin, name, peak))
        oscillation = 4.0 * math.pi * (time / END) ** 1.3
        depth = np.where(
            pulse > 0.0, 3e-5 * pulse / 85e3, -0.35 * CLEARANCE * np.sin(60.0 * time / END) ** 2 if contacts else -4e-4
        )
        eccentricity[:, k] = (CLEARANCE + depth)[:, None] * np.stack([np.cos(oscillation), np.sin(oscillation)], axis=-1)
        per_joint["indentation"][:, k], per_joint["normal_force"][:, k] = depth, pulse
        per_joint["friction_force"][:, k] = 0.05 * pulse * np.sign(np.cos(oscillation))
        touching[:, k] = pulse > 0.0
        clearance[k] = CLEARANCE
        rattle += pulse
    table.sort()

    def named(dims, values, units):
        return dims, values, {"units": units}

    angle = np.stack([np.where(name.endswith("1"), theta, -theta) for name in bodies], axis=-1)
    angle[:, -1] = 0.0
    spin = np.gradient(angle, time, axis=0) + 1e-5 * rattle[:, None]
    u1, u2 = np.stack([np.cos(theta), np.sin(theta)], -1), np.stack([np.cos(theta), -np.sin(theta)], -1)
    middle = [0.5 * length * (unit * u1 + (unit - 1) * u2) for unit in (1, 2) for _ in (1, 2)]
    slider = np.stack([np.zeros(INSTANTS), length * np.sin(theta)], -1)
    position = np.stack([*middle, slider], axis=1)
    velocity = np.gradient(position, time, axis=0)
    velocity[:, -1, 1] += 1e-6 * rattle
    acceleration = np.gradient(velocity, time, axis=0)
    reaction = np.zeros((INSTANTS, len(names), 2))
    reaction[:, names.index("A")] = np.stack([7464.0 - 1e5 * time, 1184.0 + 3e4 * time], axis=-1)
    kinetic, potential = 3000.0 + 1e5 * time**2, 200.0 * np.sin(theta)
    lost = np.cumsum(rattle) * 1e-6
    for k in np.flatnonzero(np.isfinite(clearance)):
        reaction[:, k] = np.stack([per_joint["normal_force"][:, k], np.zeros(INSTANTS)], axis=-1)
    peaks, to_peak = np.array([row[2] for row in table], float), np.full(len(table), 0.15e-3)
    variables = {
        "slider_position": named(("time",), position[:, -1, 1], "m"),
        "slider_velocity": named(("time",), velocity[:, -1, 1], "m/s"),
        "slider_acceleration": named(("time",), acceleration[:, -1, 1], "m/s^2"),
        "position": named(("time", "body", "axis"), position, "m"),
        "velocity": named(("time", "body", "axis"), velocity, "m/s"),
        "acceleration": named(("time", "body", "axis"), acceleration, "m/s^2"),
        "angle": named(("time", "body"), angle, "rad"),
        "angular_velocity": named(("time", "body"), spin, "rad/s"),
        "angular_acceleration": named(("time", "body"), np.gradient(spin, time, axis=0), "rad/s^2"),
        "reaction": named(("time", "joint", "axis"), reaction, "N"),
        "drive_torque": named(("time",), 7850.0 + 2e4 * time + 0.9 * rattle, "N m"),
        "kinetic_energy": named(("time",), kinetic, "J"),
        "potential_energy": named(("time",), potential, "J"),
        "elastic_energy": named(("time",), 1.5e-4 * rattle, "J"),
        "drive_work": named(("time",), kinetic + potential + lost - kinetic[0] - potential[0], "J"),
        "dissipated_energy": named(("time",), lost, "J"),
        "energy_residual": named(("time",), 2e-6 * np.sin(400.0 * time), "J"),
        "contact_joint": (("contact",), np.array([row[1] for row in table], dtype=str)),
        "contact_start": named(("contact",), np.array([row[0] for row in table], float), "s"),
        **{f"peak_{part}force": named(("contact",), peaks, "N") for part in ("", "normal_")},
        **{f"peak_{part}time": named(("contact",), to_peak, "s") for part in ("", "normal_")},
        "contact_duration": named(("contact",), np.full(len(table), 0.3e-3), "s"),
    }
    if joints:
        variables |= {
            "eccentricity": named(("time", "joint", "axis"), eccentricity, "m"),
            "in_contact": named(("time", "joint"), touching, "1"),
            "clearance": named(("joint",), clearance, "m"),
            **{
                name: named(("time", "joint"), values, "m" if name == "indentation" else "N")
                for name, values in per_joint.items()
            },
        }
    coordinates = {"time": ("time", time, {"units": "s"}), "body": bodies, "joint": names, "axis": ["x", "y"]}
    return xr.Dataset(variables, coords=coordinates, attrs={"trusted_until": math.nan, **attributes})


def shown_texts(figure):
    """Return the visible texts of a figure; of the tick labels, those inside the view."""
    figure.draw_without_rendering()
    hidden = set()
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            low, high = sorted(axis.get_view_interval())
            slack = 1e-9 * (high - low)
            used = axis.get_major_ticks()
            for tick in axis.majorTicks:
                if tick not in used or not low - slack <= tick.get_loc() <= high + slack:
                    hidden |= {tick.label1, tick.label2}
    return [text for text in figure.findobj(Text) if text.get_visible() and text.get_text().strip() and text not in hidden]


def overlaps(figure):
    """Return pairs of texts whose boxes overlap, and texts that leave the figure."""
    boxes = [(text.get_text(), text.get_window_extent()) for text in shown_texts(figure)]
    boxes = [(text, box) for text, box in boxes if box.width > 0.0]
    found = [(a, b) for (a, one), (b, other) in itertools.combinations(boxes, 2) if one.overlaps(other)]
    frame = figure.bbox
    return found + [
        (a, "edge")
        for a, one in boxes
        if one.x0 < frame.x0 - 1 or one.y0 < frame.y0 - 1 or one.x1 > frame.x1 + 1 or one.y1 > frame.y1 + 1
    ]


def data_of(text):
    """Return the scene of a page."""
    found = re.search(r'<script type="application/json" id="scene">(.*?)</script>', text, re.DOTALL)
    return json.loads(found[1])


def floats(pack_scene):
    """Return packed numbers of a page."""
    return np.frombuffer(base64.b64decode(pack_scene), np.float32)


def magnified(run, mechanism, sample, joint):
    """Return the panel of a joint in a film that begins at one sample."""
    guides = [guide.name for guide in mechanism.guides if guide.name == joint]
    film = Film(
        scene_of(run, mechanism, np.array([sample, -1]), [joint] if not guides else [], guides=guides, between=False), 1.0
    )
    return film.panels[0]
