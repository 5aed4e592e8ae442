"""Time of one evaluation of each law [ns], through the dispatch, as called by the equations of motion.

Run by hand: ``python benchmarks/laws/evaluation.py``. Each figure is the best of seven loops of 200000 calls with changing
arguments, less the same loop without a call. The last column is the ratio to the default law of the kind.
"""

from __future__ import annotations

import math
import time

import numba
import numpy as np

from scissordyn.laws.catalogue import BY_KIND
from scissordyn.laws.contact import JointContact
from scissordyn.laws.dispatch import elastic_force, friction_force, friction_start, normal_force
from scissordyn.laws.impact import table_row
from scissordyn.laws.material import STEEL
from scissordyn.laws.user import UserDamping, UserElastic, UserFriction

JOINT = JointContact(clearance=0.5e-3, journal_radius=10e-3, length=15e-3, journal=STEEL, bearing=STEEL)
CALLS = 200_000
REFERENCE = {"stiffness": "liu", "damping": "flores", "friction": "lugre"}


@numba.njit
def _elastic_loop(kernel_kind, p, calls):
    total = 0.0
    for k in range(calls):
        total += elastic_force(kernel_kind, 1e-6 + 1e-10 * k + 1e-30 * total, p)
    return total


@numba.njit
def _normal_loop(kernel_kind, p, calls):
    total = 0.0
    for k in range(calls):
        total += normal_force(kernel_kind, 100.0 + 1e-3 * k + 1e-30 * total, 1e-5, 0.1, 0.5, p)
    return total


@numba.njit
def _friction_loop(kernel_kind, p, z, dz, calls):
    total = 0.0
    for k in range(calls):
        total += friction_force(kernel_kind, 1e-4 + 1e-8 * k + 1e-30 * total, 100.0, z, dz, p)
    return total


@numba.njit
def _empty_loop(calls):
    total = 0.0
    for k in range(calls):
        total += 1e-6 + 1e-10 * k + 1e-30 * total
    return total


def best(function, *arguments):
    """Nanoseconds per call."""
    function(*arguments, 10)
    times = []
    for _ in range(7):
        start = time.perf_counter_ns()
        function(*arguments, CALLS)
        times.append(time.perf_counter_ns() - start)
    return min(times) / CALLS


def main():
    """Print a Markdown table for each kind."""
    empty = best(_empty_loop)
    liu = table_row(BY_KIND["stiffness"]["liu"](), JOINT)
    users = {
        "stiffness": UserElastic(lambda d, k, c: k * d * math.sqrt(d / (2.0 * (c + d))), (liu[0], liu[1])),
        "damping": UserDamping(lambda f, d, r, a, xi: f * (1.0 + xi * r / a), (0.2,)),
        "friction": UserFriction(lambda v, n, mu: mu * n * math.tanh(v / 1e-4), (0.05,)),
    }
    print(f"(empty loop: {empty:.2f} ns, subtracted)\n")
    for kind, laws in BY_KIND.items():
        made = {name: law() for name, law in laws.items()} | {"a user's function": users[kind]}
        found = {}
        for name, law in made.items():
            row = table_row(law, JOINT)
            if kind == "stiffness":
                found[name] = best(_elastic_loop, law.kernel_kind, row) - empty
            elif kind == "damping":
                found[name] = best(_normal_loop, law.kernel_kind, row) - empty
            else:
                z, dz = np.zeros(len(law.states)), np.zeros(len(law.states))
                friction_start(law.kernel_kind, 0.01, z, row)
                found[name] = best(_friction_loop, law.kernel_kind, row, z, dz) - empty
        print(f"| {kind} | ns | against {REFERENCE[kind]} |\n| --- | ---: | ---: |")
        for name, value in found.items():
            print(f"| {name} | {value:.1f} | {value / found[REFERENCE[kind]]:.1f} |")
        print()


if __name__ == "__main__":
    main()
