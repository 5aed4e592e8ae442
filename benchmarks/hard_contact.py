"""Hard contact: cost over the number of joints, against compliant contact, accuracy over the step, memory of a batch."""

from __future__ import annotations

import dataclasses
import json
import resource
import time
from statistics import median

import numpy as np

import scissordyn as sd
from benchmarks.measure import command, fitted_exponent, table
from scissordyn.model.mechanism import Mechanism

UNITS = (2, 4, 8, 16, 32, 64)
STEP, STEPS = 1e-4, 2000
SOLAR = "examples/solar_array.toml"
STEPS_OF_SOLAR = (1e-3, 5e-4, 2e-4, 1e-4)


def array(units: int) -> Mechanism:
    """An array with every joint loose."""
    arm = sd.scissor(units=units, bar_length=0.5, bar_mass=0.2, slider_mass=0.3, angle=sd.degrees(60), gravity=9.81)
    joint = sd.Clearance(1e-4, damping=sd.Flores(0.7), friction=sd.LuGre(kinetic=0.1), contact="hard")
    move = sd.Cycloidal(sd.degrees(60), sd.degrees(58), 2.0)
    return arm.with_clearance("all", joint).driven(move)


def hard(mechanism: Mechanism) -> Mechanism:
    """The same with hard contact at every clearance joint."""
    joints = tuple(
        dataclasses.replace(joint, clearance=joint.clearance and dataclasses.replace(joint.clearance, contact="hard"))
        for joint in mechanism.joints
    )
    return dataclasses.replace(mechanism, joints=joints)


def measure(quick: bool = False) -> str:
    """The tables."""
    scaling, solar = _scaling(UNITS[:3] if quick else UNITS), _solar(STEPS_OF_SOLAR[:2] if quick else STEPS_OF_SOLAR, not quick)
    return f"{scaling}\n{solar}\n{_memory(200 if quick else 100_000)}"


def _scaling(units: tuple[int, ...]) -> str:
    """Time of a step over the number of units."""
    rows, cost = [], []
    for count in units:
        one, taken, found = array(count), [], {}
        for _ in range(3):
            run = sd.simulate(one, until=STEP * STEPS, step=STEP, samples=3)
            found = json.loads(run.attrs["statistics"])
            began = time.process_time()
            sd.simulate(one, until=STEP * STEPS, step=STEP, samples=3)
            whole = time.process_time() - began
            began = time.process_time()
            sd.simulate(one, until=STEP * STEPS / 10, step=STEP, samples=3)
            taken.append((whole - (time.process_time() - began)) / (0.9 * STEPS))
        cost.append(median(taken))
        joints = len(one.joints)
        each = found["factorizations"] / max(found["contact_steps"], 1)
        rows.append((str(count), str(joints), f"{1e6 * cost[-1]:.1f}", f"{each:.2f}", str(found["steps_not_solved"])))
    head = ("units", "clearance joints", "processor time of a step [us]", "factorizations of a step", "steps not solved")
    exponent = fitted_exponent([float(count) for count in units], cost)
    return f"{table(head, rows)}\nThe cost of a step grows as N^{exponent:.2f}.\n"


def _solar(steps: tuple[float, ...], compared: bool) -> str:
    """The solar array by steps of several sizes, and compliant beside it."""
    case = sd.read_case(SOLAR)
    until, one = case.run.until, hard(case.mechanism)
    reference, rows = None, []
    if compared:
        began = time.process_time()
        reference = sd.simulate(case.mechanism, until=until)
        spent = time.process_time() - began
        far = float(reference["track_deviation"].max())
        rows.append(("compliant, 1e-8", f"{spent:.2f}", str(reference.sizes["contact"]), f"{1e3 * far:.2f}", "", ""))
    for step in steps:
        taken, run = [], None
        for _ in range(3):
            began = time.process_time()
            run = sd.simulate(one, until=until, step=step)
            taken.append(time.process_time() - began)
        assert run is not None
        away = ("", "")
        if reference is not None:
            apart = np.linalg.norm((run["track_position"] - reference["track_position"]).values, axis=-1)
            away = f"{1e3 * np.sqrt(np.mean(apart**2)):.2f}", f"{1e3 * apart.max():.2f}"
        far = 1e3 * float(run["track_deviation"].max())
        rows.append((f"hard, {1e3 * step:g} ms", f"{median(taken):.3f}", str(run.sizes["contact"]), f"{far:.2f}", *away))
    head = (
        "contact",
        "processor time [s]",
        "contacts",
        "largest deviation of the tip [mm]",
        "rms distance of paths [mm]",
        "largest [mm]",
    )
    return table(head, rows)


def _memory(cases: int) -> str:
    """Largest memory of a process over a batch."""
    one, kept = array(2), []
    for part in (cases // 100, cases):
        sd.simulate_many(one, {"O.clearance": np.linspace(1e-4, 2e-4, part)}, until=2e-3, step=STEP, threads=1)
        kept.append(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0)
    return f"Largest memory after {cases // 100} cases {kept[0]:.0f} MB, after {cases} cases {kept[1]:.0f} MB.\n"


if __name__ == "__main__":
    command("hard_contact", measure)
