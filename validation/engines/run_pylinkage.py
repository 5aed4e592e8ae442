"""Pylinkage: points from pairs of bars (dyads), in the order of construction, driven by the angle of the first body."""

import math
import sys
import time

from pylinkage.actuators import Crank
from pylinkage.components import Ground
from pylinkage.dyads import FixedDyad, RRPDyad, RRRDyad
from pylinkage.simulation import Linkage
from shared import pose_of, read, show, turns_of

problem, setting = read()
if "hole" in problem:
    sys.exit("kinematics only: joints have no clearance")
bodies, turns = problem["bodies"], turns_of(problem)
places, parts = {}, []  # of points, by body and place on its axis


def at(k, u):
    """Return where a point is at the start: dyads take the solution that is nearest."""
    x, y, turn = bodies[k]["pose"]
    return {"x": x + u * math.cos(turn), "y": y + u * math.sin(turn)}


def add(part, *keys):
    parts.append(part)
    for key in keys:
        places[key] = getattr(part, "output", part)
    return places[keys[0]]


ground = {tuple(place) for a, one, b, other in problem["pins"] for k, place in ((a, one), (b, other)) if k < 0}
fixed = {place: add(Ground(*place), place) for place in sorted(ground)}
half = bodies[0]["pose"][0] / math.cos(turns[0])  # the first body turns about the origin
places[0, -half] = fixed[0.0, 0.0]
for u in (0.0, half):
    add(Crank(anchor=fixed[0.0, 0.0], radius=u + half, angular_velocity=1.0, initial_angle=turns[0], name=f"crank {u}"), (0, u))
guides = {}
for k, turn in problem["slides"]:
    x, y = bodies[k]["pose"][:2]
    guides[k] = [add(Ground(x + r * math.cos(turn), y + r * math.sin(turn)), (k, r)) for r in (-1.0, 1.0)]
if len(bodies) == 3:
    rod = -problem["pins"][1][3][0]  # half of the length of the second body
    places[1, -rod] = places[0, half]
    if guides:
        add(RRPDyad(places[0, half], *guides[2], distance=2 * rod, **at(2, 0.0)), (2, 0.0), (1, rod))
    else:
        places[2, -half] = fixed[2 * rod, 0.0]
        add(RRRDyad(places[0, half], places[2, -half], 2 * rod, 2 * half, **at(1, rod)), (1, rod), (2, half))
else:  # a unit after the other: centre pin from its two lower ends, then the far ends
    slider = len(bodies) - 1
    add(RRPDyad(places[0, 0.0], *guides[slider], distance=half, **at(slider, 0.0)), (slider, 0.0), (1, -half))
    places[1, 0.0] = places[0, 0.0]
    for k in range(0, slider, 2):
        if k:
            places[k, -half], places[k + 1, -half] = places[k - 1, half], places[k - 2, half]
            add(RRRDyad(places[k, -half], places[k + 1, -half], half, half, **at(k, 0.0)), (k, 0.0), (k + 1, 0.0))
        for m in (k, k + 1):
            if (m, half) not in places:
                add(FixedDyad(places[m, -half], places[m, 0.0], distance=2 * half, angle=0.0), (m, half))
linkage = Linkage(parts)
ends = [sorted(u for b, u in [key for key in places if isinstance(key[1], float)] if b == k) for k in range(len(bodies))]
made, before, began = [], turns[0], time.perf_counter()
for turn in turns:
    next(linkage.step(iterations=1, dt=turn - before))
    before, rows = turn, []
    for k, local in enumerate(ends):
        if k in guides:
            rows.append([*places[k, 0.0].position, 0.0, *[math.nan] * 3])
        else:
            rows.append(pose_of([places[k, u].position for u in (local[0], local[-1])], (local[0], local[-1])))
    made.append(rows)
show(made, time.perf_counter() - began)
