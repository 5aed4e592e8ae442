"""SolveSpace: points of bars with constraints of its sketches, solved at each angle of the first body."""

import math
import sys
import time

from python_solvespace import ResultFlag, SolverSystem
from shared import pose_of, read, show, turns_of

problem, setting = read()
if "hole" in problem:
    sys.exit("kinematics only: joints have no clearance")
sketch = SolverSystem()
plane = sketch.create_2d_base()
ground, bars = {}, []
for k, given in enumerate(problem["bodies"]):
    local = {pin[1][0] if pin[0] == k else pin[3][0] for pin in problem["pins"] if k in (pin[0], pin[2])}
    x, y, turn = given["pose"]
    points = {u: sketch.add_point_2d(x + u * math.cos(turn), y + u * math.sin(turn), plane) for u in sorted(local)}
    bars.append(points)
    if len(points) > 1:
        ends = [points[min(local)], points[max(local)]]
        if k:  # both ends of the first body are given
            sketch.distance(*ends, max(local) - min(local), plane)
        for u in sorted(local)[1:-1]:
            sketch.coincident(points[u], sketch.add_line_2d(*ends, plane), plane)
            sketch.distance(ends[0], points[u], u - min(local), plane)


def fixed(x, y):
    point = sketch.add_point_2d(x, y, plane)
    sketch.dragged(point, plane)
    return point


for a, place, b, other in problem["pins"]:
    sketch.coincident(*(bars[k][at[0]] if k >= 0 else fixed(*at) for k, at in ((a, place), (b, other))), plane)
for k, turn in problem["slides"]:
    x, y = problem["bodies"][k]["pose"][:2]
    line = sketch.add_line_2d(fixed(x, y), fixed(x + math.cos(turn), y + math.sin(turn)), plane)
    sketch.coincident(bars[k][0.0], line, plane)
far = max(bars[0])
sketch.dragged(bars[0][far], plane)  # the input: the end of the first body
hinge = next((place if a == 0 else other)[0] for a, place, b, other in problem["pins"] if {a, b} == {-1, 0})
made, began = [], time.perf_counter()
for turn in turns_of(problem):
    x, y = ((far - hinge) * value for value in (math.cos(turn), math.sin(turn)))
    sketch.set_params(bars[0][far].params, [x, y])
    answer = sketch.solve()
    if answer != ResultFlag.OKAY:
        sys.exit(f"{ResultFlag(answer).name} at {turn:.3f} rad")
    rows = []
    for points in bars:
        if len(points) > 1:
            local = min(points), max(points)
            rows.append(pose_of([sketch.params(points[u].params) for u in local], local))
        else:
            rows.append([*sketch.params(points[0.0].params), 0.0, *[math.nan] * 3])
    made.append(rows)
show(made, time.perf_counter() - began)
