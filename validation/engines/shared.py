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
