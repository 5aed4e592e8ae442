"""Read a problem and print a result: used by the files that run in the environments of the engines."""

import json
import math
import sys
import time


def read():
    """Return the problem and the name of the setting from the command line."""
    with open(sys.argv[1], encoding="utf-8") as file:
        return json.load(file), sys.argv[2]


def run(problem, step, advance, states):
    """Advance by steps, and print the states at equal times with the seconds of wall time."""
    samples = len(problem["reference"])
    every = max(1, round(problem["until"] / step / (samples - 1)))
    made, began = [states()], time.perf_counter()
    for _ in range(samples - 1):
        advance(every, problem["until"] / (samples - 1) / every)
        made.append(states())
    print("\n" + json.dumps({"states": made, "seconds": time.perf_counter() - began}))


def ring(hole, count=120):
    """Return the corners of a polygon around a hole, in the frame of its body; its sides touch the circle."""
    (x, y), radius = hole["place"], hole["radius"] / math.cos(math.pi / count)
    turns = [2.0 * math.pi * k / count for k in range(count)]
    return [(x + radius * math.cos(turn), y + radius * math.sin(turn)) for turn in turns]


def tree(problem):
    """Return the bodies of a spanning tree in order from the ground, and the pins that close its loops.

    Each entry of the tree holds a body, the body before it (-1 is the ground), and the points of both that coincide. A body
    on a slide has its own place there.
    """
    sliding = [k for k, _ in problem["slides"]]
    found = [(k, -1, [0.0, 0.0], problem["bodies"][k]["pose"][:2]) for k in sliding]
    reached, loops, left = {-1, *sliding}, [], list(problem["pins"])
    while left:
        for pin in [pin for pin in left if pin[0] in reached or pin[2] in reached]:
            left.remove(pin)
            a, place, b, other = pin
            if a in reached and b in reached:
                loops.append(pin)
            else:
                found.append((b, a, other, place) if a in reached else (a, b, place, other))
                reached.add(found[-1][0])
    return found, loops


def start_of(problem, k, parent):
    """Return the angle and the angular velocity of a body relative to the body before it."""
    mine, other = problem["bodies"][k], problem["bodies"][parent] if parent >= 0 else {"pose": [0.0] * 3, "rate": [0.0] * 3}
    return mine["pose"][2] - other["pose"][2], mine["rate"][2] - other["rate"][2]


def boxes(hole, count=90, thick=2e-3):
    """Return centre, angle and half sizes of the boxes of a ring around a hole, in the frame of its body."""
    (x, y), reach, turns = hole["place"], hole["radius"] + thick, [2.0 * math.pi * k / count for k in range(count)]
    size = [thick, math.tan(math.pi / count) * reach, 0.005]
    return [([x + reach * math.cos(turn), y + reach * math.sin(turn), 0.0], turn, size) for turn in turns]


def turns_of(problem):
    """Return the angle of the first body, the crank, at each sample: the input of kinematics."""
    return [sample[0][2] for sample in problem["reference"]]


def pose_of(ends, locals_):
    """Return x, y and angle of a body from the places of two points on its axis; velocities are unknown."""
    (x, y), (u, v) = ends
    turn, share = math.atan2(v - y, u - x), -locals_[0] / (locals_[1] - locals_[0])
    return [x + share * (u - x), y + share * (v - y), turn, *[math.nan] * 3]


def show(made, seconds):
    """Print states and seconds as `run` does."""
    print("\n" + json.dumps({"states": made, "seconds": seconds}))
