"""LuGre's bristle damping in the paper's case: how far friction exceeds static friction, what changes, what it costs."""

from __future__ import annotations

import json
import math

import numpy as np

import scissordyn as sd
from benchmarks.cases import CLEARANCE, UNTIL
from benchmarks.measure import command, table
from scissordyn.laws.evaluate import friction_force, friction_limit, friction_states
from scissordyn.plugin.element import pointers, row_of

CONSTANT = 1e6  # A damping speed [m/s] at which sigma_1 does not fade
KINETIC = (0.01, 0.03, 0.05, 0.1)  # The paper's kinetic friction coefficients
REPEATS = 7  # Runs that are timed; the shortest counts
PRESSED = 1.0  # Below this normal force [N] both forces round to nothing and their ratio to anything


def variants(kinetic: float) -> dict[str, sd.LuGre]:
    """The dampings that are compared, by name."""
    passive = 4.0 * math.sqrt(2.0 * math.e) * kinetic / 316.0
    return {
        "316, constant": sd.LuGre(kinetic, damping_speed=CONSTANT),
        "31.6, constant": sd.LuGre(kinetic, bristle_damping=31.6, damping_speed=CONSTANT),
        "3.16, constant": sd.LuGre(kinetic, bristle_damping=3.16, damping_speed=CONSTANT),
        "316, v_d = v_s": sd.LuGre(kinetic, damping_speed=1e-3),
        "316, v_d just passive": sd.LuGre(kinetic, damping_speed=passive),
        "316, v_d within mu_s (default)": sd.LuGre(kinetic),
        "31.6, v_d within mu_s": sd.LuGre(kinetic, bristle_damping=31.6),
        "0": sd.LuGre(kinetic, bristle_damping=0.0),
    }


def row(law: sd.LuGre) -> np.ndarray:
    """A law's numbers as the kernels read them."""
    return row_of(law, sd.Clearance(CLEARANCE).surfaces)


def measure(quick: bool = False) -> str:
    """All three tables."""
    return "\n".join((_runs(KINETIC[-1:] if quick else KINETIC), _cycles(), _starts()))


def _runs(coefficients: tuple[float, ...]) -> str:
    rows = []
    for kinetic in coefficients:
        for name, law in variants(kinetic).items():
            arm = sd.scissor(units=2).driven(speed=sd.rpm(150)).with_clearance("A", sd.Clearance(CLEARANCE, friction=law))
            run = sd.simulate(arm, until=UNTIL, samples=50_001, trust=True)
            joint, p = run.sel(joint="A"), row(law)
            normal, tangential = joint["normal_force"].values, np.abs(joint["friction_force"].values)
            limit = np.array(
                [
                    friction_limit(pointers(law)["limit"], v, n, p)
                    for v, n in zip(joint["slip_speed"].values, normal, strict=True)
                ]
            )
            pressed = normal > PRESSED
            statistics = json.loads(run.attrs["statistics"])
            seconds = [json.loads(sd.simulate(arm, until=UNTIL).attrs["statistics"])["seconds"] for _ in range(REPEATS)]
            rows.append(
                [
                    f"{kinetic:g}, {name}",
                    f"{float(np.max(tangential[pressed] / limit[pressed])):.2f}",
                    f"{1e-3 * float(tangential.max()):.2f}",
                    f"{1e-3 * float(run['peak_force'].max()):.3f}",
                    str(run.sizes["contact"]),
                    f"{1e3 * float(run.attrs['trusted_until']):.1f}",
                    str(statistics["steps"]),
                    f"{1e3 * min(seconds):.1f}",
                ]
            )
    text = (
        "The paper's case, 50 ms at 1e-8, sampled every microsecond: the largest |F_t| over its static limit mu_s F_n where\n"
        "F_n > 1 N, the largest |F_t| and F_n, contacts, how long a run at 1e-9 agrees, steps and time of the integration.\n\n"
    )
    head = ["mu_k, sigma_1 [s/m]", "F_t/limit", "F_t [kN]", "F_n [kN]", "contacts", "agrees [ms]", "steps", "[ms]"]
    return text + table(head, rows)


def _cycles() -> str:
    rows = []
    for name, law in variants(0.1).items():
        works = [cycle_work(law, fast) for fast in (1e-3, 1e-2, 1e-1, 1.0)]
        rows.append([name, *(f"{work:+.2f}" for work in works)])
    text = (
        "Work taken by friction in a closed cycle of slip, F_n = 1 N, mu_k = 0.1, in mu_k F_n times the path: 3 um at 0.1\n"
        "mm/s, which bends the bristles to mu_s, 3 um at a fast speed, and the same back. Negative: friction gives energy.\n\n"
    )
    return text + table(["sigma_1 [s/m]", "1 mm/s", "10 mm/s", "0.1 m/s", "1 m/s"], rows)


def cycle_work(law: sd.LuGre, fast: float, *, slow: float = 1e-4, length: float = 3e-6, steps: int = 4000) -> float:
    """Work that friction takes in a closed cycle of slow and fast slip over mu_k times its path; the third cycle counts."""
    p, z, dz = row(law), np.zeros(1), np.zeros(1)
    work = 0.0
    for turn in range(3):
        for speed in (slow, fast, -slow, -fast):
            h = length / abs(speed) / steps
            for _ in range(steps):
                # Heun's method: the bristle relaxes over a micrometre, more than a thousand steps
                before, start = friction_force(pointers(law)["force"], speed, 1.0, z, dz, p), z[0]
                first = dz[0]
                z[0] = start + h * first
                after = friction_force(pointers(law)["force"], speed, 1.0, z, dz, p)
                z[0] = start + 0.5 * h * (first + dz[0])
                if turn == 2:
                    work += 0.5 * (before + after) * speed * h
    return work / (law.kinetic * 4.0 * length)


def _starts() -> str:
    rows = []
    for v in (1e-7, 1e-5, 1e-4, 1e-3, 3e-3, 1e-2, 2e-2, 1e-1):
        found = []
        for law in (sd.LuGre(0.1), sd.law("friction", "elasto-plastic")(0.1), sd.law("friction", "dahl")(0.1)):
            z, p = np.zeros(1), row(law)
            friction_states(pointers(law)["start"], v, z, p)
            found.append(f"{z[0] * law.bristle_stiffness:.6f}")
        rows.append([f"{v:g}", *found])
    text = "Coefficient sigma_0 z that a contact starts with, by its slip speed; mu_k = 0.1.\n\n"
    return text + table(["slip [m/s]", "lugre", "elasto-plastic", "dahl"], rows)


if __name__ == "__main__":
    command("lugre", measure)
