"""Time of one evaluation of each law [ns], through the dispatch, as called by the equations of motion.

Run by hand: ``python benchmarks/laws/evaluation.py``. Each figure is processor time, the best of 25 loops of 200000 calls with
changing arguments, in rounds over all laws of a kind, less the same loop without a call. The last column is the ratio to the
default law of the kind.
"""

from __future__ import annotations

import math
import time

import numpy as np

from scissordyn.compiler.c import loaded
from scissordyn.compiler.unit import Unit
from scissordyn.kernel import F1, Entry
from scissordyn.laws.catalogue import BY_KIND
from scissordyn.laws.contact import JointContact
from scissordyn.laws.evaluate import elastic_force, friction_force, friction_states, normal_force
from scissordyn.laws.material import STEEL
from scissordyn.plugin.element import element, pointers, row_of

JOINT = JointContact(clearance=0.5e-3, journal_radius=10e-3, length=15e-3, journal=STEEL, bearing=STEEL)
CALLS = 200_000
ROUNDS = 25
REFERENCE = {"stiffness": "liu", "damping": "flores", "friction": "lugre"}


def _elastic_loop(address: int, p: F1, calls: int) -> float:
    total = 0.0
    for k in range(calls):
        indentation = 1e-6 + 1e-10 * k + 1e-30 * total
        total = indentation + elastic_force(address, indentation, p)
    return total


def _normal_loop(address: int, p: F1, z: F1, dz: F1, calls: int) -> float:
    total = 0.0
    for k in range(calls):
        elastic = 100.0 + 1e-3 * k + 1e-30 * total
        total = elastic + normal_force(address, elastic, 1e-5, 0.1, 0.5, z, dz, p)
    return total


def _friction_loop(address: int, p: F1, z: F1, dz: F1, calls: int) -> float:
    total = 0.0
    for k in range(calls):
        slip_speed = 1e-4 + 1e-8 * k + 1e-30 * total
        total = slip_speed + friction_force(address, slip_speed, 100.0, z, dz, p)
    return total


def _empty_loop(calls: int) -> float:
    total = 0.0
    for k in range(calls):
        total = 1e-6 + 1e-10 * k + 1e-30 * total
    return total


def _compiled(loops):
    """Loops with all that they call, in one library."""
    unit, entries = Unit(), [Entry(loop) for loop in loops]
    for one in entries:
        unit.entry(one)
    library = loaded(unit.text())
    return [one.bound(library) for one in entries]


@element(slot="stiffness")
def soft(indentation, stiffness, clearance):
    """Liu's force."""
    return stiffness * indentation * math.sqrt(indentation / (2.0 * (clearance + indentation)))


@element(slot="damping")
def lossy(elastic, rate, approach, factor):
    """A loss in proportion to the rate."""
    return elastic * (1.0 + factor * rate / approach)


@element(slot="friction")
def sticky(slip_speed, normal_force, coefficient):
    """Coulomb's friction, smoothed."""
    return coefficient * normal_force * math.tanh(slip_speed / 1e-4)


def rounds(calls):
    """Nanoseconds per call of each, the best of several rounds over all of them."""
    for function, *arguments in calls.values():
        function(*arguments, 10)
    times = dict.fromkeys(calls, math.inf)
    for _ in range(ROUNDS):
        for name, (function, *arguments) in calls.items():
            start = time.process_time_ns()
            function(*arguments, CALLS)
            times[name] = min(times[name], (time.process_time_ns() - start) / CALLS)
    return times


def main():
    """Print a Markdown table for each kind."""
    elastic, normal, friction, empty_loop = _compiled((_elastic_loop, _normal_loop, _friction_loop, _empty_loop))
    liu = row_of(BY_KIND["stiffness"]["liu"](), JOINT)
    users = {
        "stiffness": soft(liu[0], liu[1]),
        "damping": lossy(0.2),
        "friction": sticky(0.05),
    }
    for kind, laws in BY_KIND.items():
        calls = {"": (empty_loop,)}
        for name, law in ({name: law() for name, law in laws.items()} | {"a user's function": users[kind]}).items():
            row = row_of(law, JOINT)
            if kind == "stiffness":
                calls[name] = elastic, pointers(law)["force"], row
            elif kind == "damping":
                calls[name] = normal, pointers(law)["force"], row, np.zeros(len(law.states)), np.zeros(len(law.states))
            else:
                z, dz = np.zeros(len(law.states)), np.zeros(len(law.states))
                friction_states(pointers(law)["start"], 0.01, z, row)
                calls[name] = friction, pointers(law)["force"], row, z, dz
        found = rounds(calls)
        empty = found.pop("")
        print(f"| {kind} | ns | against {REFERENCE[kind]} |\n| --- | ---: | ---: |")
        for name, value in found.items():
            print(f"| {name} | {value - empty:.1f} | {(value - empty) / (found[REFERENCE[kind]] - empty):.1f} |")
        print()


if __name__ == "__main__":
    main()
