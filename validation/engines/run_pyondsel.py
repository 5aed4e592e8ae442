"""OndselSolver (pyondsel): parts with revolute and translational joints, driven by a motion of the first body."""

import math
import sys
import time

import numpy as np
from pyondsel.model.asmt_model import AsmtModel
from pyondsel.model.joint import Joint
from pyondsel.model.marker import Marker
from pyondsel.model.motion import Motion
from pyondsel.model.part import Part
from pyondsel.model.simulation import Simulation
from shared import read, show, turns_of

problem, setting = read()
if "hole" in problem:
    sys.exit("kinematics only: joints have no clearance")
turns = turns_of(problem)
times = np.linspace(-1.0, 1.0, len(turns))
fit = np.polynomial.Chebyshev.fit(times, turns, 36).convert(kind=np.polynomial.Polynomial).coef  # a motion is an expression
expression = "".join(f"{c:.17g}+time*(" for c in fit[:-1]) + f"{fit[-1]:.17g}" + ")" * (len(fit) - 1)
model, parts = AsmtModel("A"), []
for k, given in enumerate(problem["bodies"]):
    (x, y, turn), j = given["pose"], given["inertia"] or 1.0
    c, s = math.cos(turn), math.sin(turn)
    rotation = ((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0))
    parts.append(model.add_part(Part(f"B{k}", (x, y, 0.0), rotation, mass=given["mass"], moments_of_inertia=(j, j, j))))


def mark(name, k, place, rotation=((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))):
    marker = Marker(name, (*place, 0.0), rotation)
    if k < 0:
        model.add_ground_marker(marker)
        return model.ground_path(name)
    parts[k].add_marker(marker)
    return model.part_path(f"B{k}", name)


for n, (a, place, b, other) in enumerate(problem["pins"]):
    (k, here), (m, there) = sorted([(a, place), (b, other)])
    model.add_joint(Joint(f"J{n}", "revolute", mark(f"I{n}", k, here), mark(f"K{n}", m, there)))
    if (k, m) == (-1, 0):
        model.add_motion(Motion("input", f"J{n}", expression=expression))
for k, turn in problem["slides"]:
    c, s = math.cos(turn), math.sin(turn)
    frame = ((0.0, -s, c), (0.0, c, s), (-1.0, 0.0, 0.0))  # the third axis is along the slide
    start = problem["bodies"][k]["pose"][:2]
    model.add_joint(Joint(f"S{k}", "translational", mark(f"SI{k}", -1, start, frame), mark(f"SK{k}", k, [0.0, 0.0], frame)))
model.simulation = Simulation(-1.0, 1.0, frames=len(turns) - 1)
began = time.perf_counter()
found = model.solve().parts
seconds = time.perf_counter() - began
poses = [found[f"/A/B{k}"] for k in range(len(parts))]
rest = [math.nan] * 3
show([[[*pose.positions[n][:2], pose.bryant_angles[n][2], *rest] for pose in poses] for n in range(len(turns))], seconds)
