"""Scissordyn: a mechanism made of the same numbers as the other engines get."""

import math
import time

import numpy as np
from shared import read, show

import scissordyn as sd

problem, setting = read()
places, joints = [{} for _ in [*problem["bodies"], None]], []  # the last is the ground


def end(k, place, name):
    """Name a point of a body or of the ground."""
    places[k][name] = tuple(place)
    return (f"body {k}" if k >= 0 else "ground", name)


for n, (a, place, b, other) in enumerate(problem["pins"]):
    joints.append(sd.Revolute(f"pin {n}", end(a, place, f"P{n}"), end(b, other, f"Q{n}")))
if "hole" in problem:
    hole = problem["hole"]
    clearance = sd.Clearance(
        hole["radius"] - hole["pin"],
        journal_radius=hole["pin"],
        damping=sd.Flores(hole["restitution"]),
        contact="hard",
    )
    joints.append(sd.Revolute("pin", end(-1, [0.0, 0.0], "O"), end(0, hole["place"], "hole"), clearance=clearance))
bodies = [
    sd.Body(
        f"body {k}",
        given["mass"],
        given["inertia"] or None,
        points=places[k],
        position=tuple(given["pose"][:2]),
        angle=given["pose"][2] if given["inertia"] else None,
        angular_velocity=given["rate"][2] if given["inertia"] and k == 0 else None,
    )
    for k, given in enumerate(problem["bodies"])
]
guides = [
    sd.Guide(f"guide {k}", (f"body {k}", next(iter(places[k]))), tuple(problem["bodies"][k]["pose"][:2]), turn)
    for k, turn in problem["slides"]
]
x, y = problem["gravity"]
mechanism = sd.Mechanism(
    tuple(bodies),
    tuple(joints),
    tuple(guides),
    ground=tuple(places[-1].items()),
    gravity=math.hypot(x, y),
    gravity_direction=math.atan2(y, x),
)
careful = {"step": 1e-5} if "hole" in problem else {"rtol": 1e-10, "atol": 1e-12}
options = careful if setting == "careful" else {}
for _ in range(2):  # the first loads libraries
    began = time.perf_counter()
    run = sd.simulate(mechanism, until=problem["until"], samples=len(problem["reference"]), **options)
    seconds = time.perf_counter() - began
parts = [run[name].sel(axis=axis).values for name in ("position", "velocity") for axis in "xy"]
turn, rate = (np.nan_to_num(run[name].transpose("time", "body").values) for name in ("angle", "angular_velocity"))
show(np.stack([*parts[:2], turn, *parts[2:], rate], axis=-1).tolist(), seconds)
