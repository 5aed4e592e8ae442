"""Kimech: positions of links with revolute and prismatic joints, driven by the angle of the first body."""

import math
import sys
import time

from kimech import KinematicDriver, Mechanism, solve
from shared import read, show, turns_of

problem, setting = read()
if "hole" in problem:
    sys.exit("kinematics only: joints have no clearance")
mechanism = Mechanism("mechanism")
links = [mechanism.add_link(f"body {k}") for k in range(len(problem["bodies"]))]
pick = [*links, mechanism.ground]
joints = []
for n, (a, place, b, other) in enumerate(problem["pins"]):
    (k, here), (m, there) = sorted([(a, place), (b, other)])
    ends = pick[k].add_point(f"P{n}", tuple(here)), pick[m].add_point(f"Q{n}", tuple(there))
    joints.append((k, m, mechanism.revolute(*ends)))
for k, turn in problem["slides"]:
    axis = (math.cos(turn), math.sin(turn))
    ends = mechanism.ground.add_point(f"G{k}", tuple(problem["bodies"][k]["pose"][:2])), links[k].add_point(f"S{k}", (0.0, 0.0))
    mechanism.prismatic(*ends, axis_a=axis, axis_b=axis)
crank = next(joint for k, m, joint in joints if (k, m) == (-1, 0))
began = time.perf_counter()
driver = KinematicDriver(crank, position=turns_of(problem))
guess = {link: tuple(given["pose"]) for link, given in zip(links, problem["bodies"], strict=True)}
solution = solve(mechanism, drivers=driver, initial_guess=guess)
seconds = time.perf_counter() - began
poses = [solution.body_poses(link) for link in links]
show([[[*map(float, pose[n]), *[math.nan] * 3] for pose in poses] for n in range(len(problem["reference"]))], seconds)
