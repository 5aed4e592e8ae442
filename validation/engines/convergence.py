"""Errors of rigid contact over the step: a pendulum on a pin in a hole by Siconos and scissordyn against the exact solution."""

from __future__ import annotations

import json
import subprocess
import time
from pathlib import Path

import numpy as np

import scissordyn as sd
from validation.engines.exact_pin import Pin, motion

HERE = Path(__file__).parent
UNTIL, JOURNAL, CLEARANCE = 0.5, 10e-3, 0.5e-3
STEPS = (1e-3, 1e-4, 1e-5)
START = [0.5, 0.0, 0.0, 0.0, 0.0, 0.0]
COLUMNS = ("code", "step size [s]", "angle error [rad]", "time [s]", "energy error [J]", "message")


def pendulum(restitution: float, friction: float) -> Pin:
    """Return the pendulum."""
    return Pin(CLEARANCE, JOURNAL + CLEARANCE, restitution, friction)


def energy(pin: Pin, states: np.ndarray) -> np.ndarray:
    """Return the energy of the bar [J] at each state."""
    moving = np.sum(states[:, 3:5] ** 2, axis=1) + pin.inertia * states[:, 5] ** 2
    return np.asarray(0.5 * moving + pin.gravity * states[:, 1])


def ours(pin: Pin, step: float, events: str) -> tuple[np.ndarray, float]:
    """Return states at 51 times and the seconds of hard contact."""
    arm = sd.Body("arm", 1.0, pin.inertia, points={"hole": (-pin.arm, 0.0)}, position=(pin.arm, 0.0), angle=0.0)
    rough = {"friction": sd.LuGre(kinetic=pin.friction)} if pin.friction else {}
    joint = sd.Clearance(CLEARANCE, journal_radius=JOURNAL, damping=sd.Flores(pin.restitution), contact="hard", **rough)
    pivot = sd.Revolute("pin", ("ground", "O"), ("arm", "hole"), clearance=joint)
    mechanism = sd.Mechanism((arm,), (pivot,), ground=(("O", (0.0, 0.0)),), gravity=pin.gravity)
    for _ in range(2):  # the first loads libraries
        began = time.perf_counter()
        run = sd.simulate(mechanism, until=UNTIL, samples=51, step=step, events=events)
        seconds = time.perf_counter() - began
    parts = [run[name].sel(axis=axis).values[:, 0] for name in ("position", "velocity") for axis in "xy"]
    turn, rate = (run[name].values.reshape(-1) for name in ("angle", "angular_velocity"))
    return np.stack([*parts[:2], turn, *parts[2:], rate], axis=-1), seconds


def siconos(pin: Pin, step: float, folder: Path) -> tuple[np.ndarray, float]:
    """Return states at 51 times and the seconds of Siconos, or NaN if it is not installed."""
    hole = {"place": [-pin.arm, 0.0], "radius": pin.radius, "pin": JOURNAL}
    hole |= {"restitution": pin.restitution, "friction": pin.friction}
    body = {"mass": 1.0, "inertia": pin.inertia, "pose": START[:3], "rate": START[3:]}
    problem = {"gravity": [0.0, -pin.gravity], "until": UNTIL, "bodies": [body], "pins": [], "slides": [], "hole": hole}
    file = folder / "pendulum.json"
    file.write_text(json.dumps({**problem, "reference": [0.0] * 51}))
    command = ["/usr/bin/python3", str(HERE / "run_siconos.py"), str(file), repr(step)]
    made = subprocess.run(command, capture_output=True, text=True, check=False)
    if made.returncode:
        return np.full((51, 6), np.nan), float("nan")
    found = json.loads(made.stdout.splitlines()[-1])
    return np.array(found["states"])[:, 0], found["seconds"]


def convergence(folder: Path) -> list[list[str]]:
    """Return the rows of the table of errors over the step."""
    rough, smooth = pendulum(0.7, 0.2), pendulum(1.0, 0.0)
    exact, impacts = motion(rough, np.linspace(0.0, UNTIL, 51)[1:], np.array(START))
    rows = [["exact", "", "", "", "", f"angle {exact[-1, 2]:.8f} rad, {impacts} impacts"]]
    runs = [
        ("siconos", lambda pin, step: siconos(pin, step, folder)),
        ("scissordyn, located", lambda pin, step: ours(pin, step, "located")),
        ("scissordyn, crossed", lambda pin, step: ours(pin, step, "crossed")),
    ]
    for name, run in runs:
        for step in STEPS:
            states, seconds = run(rough, step)
            if np.isnan(seconds):
                rows.append([name, f"{step:g}", "", "", "", "not installed"])
                continue
            error = abs(states[-1, 2] - exact[-1, 2])
            change = np.abs(energy(smooth, run(smooth, step)[0])).max()
            rows.append([name, f"{step:g}", f"{error:.1e}", f"{seconds:.2g}", f"{change:.1e}", ""])
            print(*rows[-1], sep=" | ", flush=True)
    return rows
