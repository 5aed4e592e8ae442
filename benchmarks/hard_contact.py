"""Measure hard contact: cost by number of joints, compliant contact, accuracy by step size, memory of a batch."""

from __future__ import annotations

import dataclasses
import json
import resource
import time
from statistics import median

import numpy as np
import xarray as xr

import scissordyn as sd
from benchmarks.measure import DECISIONS, command, fitted_exponent, table
from scissordyn.model.mechanism import Mechanism

UNITS = (2, 4, 8, 16, 32, 64)
STEP, STEPS = 1e-4, 2000
SOLAR = "examples/solar_array.toml"
STEPS_OF_SOLAR = (1e-3, 5e-4, 2e-4, 1e-4)
DRAWN = 2e-4
LEAST_IMPULSE = 1e-7  # Smallest impulse shown [N s]; smaller ones are round-off of closed contacts

STARTS = ("concentric", "in-contact")


def array(units: int) -> Mechanism:
    """Return an array with clearance in every joint."""
    arm = sd.scissor(units=units, bar_length=0.5, bar_mass=0.2, slider_mass=0.3, angle=sd.degrees(60), gravity=9.81)
    joint = sd.Clearance(1e-4, damping=sd.Flores(0.7), friction=sd.LuGre(kinetic=0.1), contact="hard")
    move = sd.Cycloidal(sd.degrees(60), sd.degrees(58), 2.0)
    return arm.with_clearance("all", joint).driven(move)


def hard(mechanism: Mechanism) -> Mechanism:
    """Return the mechanism with hard contact at every clearance joint."""
    joints = tuple(
        dataclasses.replace(joint, clearance=joint.clearance and dataclasses.replace(joint.clearance, contact="hard"))
        for joint in mechanism.joints
    )
    return dataclasses.replace(mechanism, joints=joints)


def measure(quick: bool = False) -> str:
    """Return the tables; without `quick` also draw docs/hard_contact.png."""
    units = UNITS[:3] if quick else UNITS
    tables, costs = [], {}
    for start in STARTS:
        text, costs[start] = _scaling(units, start)
        tables.append(text)
    solar, compliant, stepped = _solar(STEPS_OF_SOLAR[:2] if quick else STEPS_OF_SOLAR)
    if not quick:
        _draw(units, costs, compliant, stepped)
    return "\n".join([*tables, solar, _memory(200 if quick else 100_000)])


def _scaling(units: tuple[int, ...], start: str) -> tuple[str, list[float]]:
    """Return the table of step times by number of units, and the times [s]."""
    rows, cost = [], []
    for count in units:
        one, taken, found = array(count), [], {}
        for _ in range(3):
            run = sd.simulate(one, until=STEP * STEPS, step=STEP, samples=3, start=start)
            found = json.loads(run.attrs["statistics"])
            began = time.process_time()
            sd.simulate(one, until=STEP * STEPS, step=STEP, samples=3, start=start)
            whole = time.process_time() - began
            began = time.process_time()
            sd.simulate(one, until=STEP * STEPS / 10, step=STEP, samples=3, start=start)
            taken.append((whole - (time.process_time() - began)) / (0.9 * STEPS))
        cost.append(median(taken))
        joints = len(one.joints)
        each = found["factorizations"] / max(found["contact_steps"], 1)
        one_solution = 1e6 * cost[-1] / each
        rows.append(
            (
                str(count),
                str(joints),
                f"{1e6 * cost[-1]:.1f}",
                f"{each:.2f}",
                f"{one_solution:.1f}",
                str(found["steps_not_solved"]),
            )
        )
    head = (
        "units",
        "clearance joints",
        "processor time of a step [µs]",
        "factorizations of a step",
        "of a factorization [µs]",
        "steps not solved",
    )
    exponent = fitted_exponent([float(count) for count in units], cost)
    return f"Start: {start}.\n\n{table(head, rows)}\nThe cost of a step grows as N^{exponent:.2f}.\n", cost


def _solar(steps: tuple[float, ...]) -> tuple[str, xr.Dataset, xr.Dataset]:
    """Return a table of the solar array by step size, the compliant run, and the run with the step `DRAWN`."""
    case = sd.read_case(SOLAR)
    until, one = case.run.until, hard(case.mechanism)
    began = time.process_time()
    reference = sd.simulate(case.mechanism, until=until)
    spent = time.process_time() - began
    far = float(reference["track_deviation"].max())
    rows = [("compliant, 1e-8", f"{spent:.2f}", str(reference.sizes["contact"]), f"{1e3 * far:.2f}", "", "")]
    made = {}
    for step in steps:
        taken = []
        for _ in range(3):
            began = time.process_time()
            made[step] = sd.simulate(one, until=until, step=step)
            taken.append(time.process_time() - began)
        run = made[step]
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
    return table(head, rows), reference, made.get(DRAWN, made[steps[-1]])


def _draw(units: tuple[int, ...], costs: dict[str, list[float]], compliant: xr.Dataset, stepped: xr.Dataset) -> None:
    """Draw docs/hard_contact.png: deviation of the tip, impulses, and the cost of a step."""
    from matplotlib.ticker import NullFormatter, ScalarFormatter

    from scissordyn.plot.file import figure_of
    from scissordyn.plot.style import BLUE, GREY, VERMILION, panels, small

    tip, impulses, cost = drawn = panels(None, 1, 3, size=(12.0, 3.8), share=False)
    for run, label, colour, marker in (
        (compliant, "compliant", BLUE, "o"),
        (stepped, f"hard, {1e3 * DRAWN:g} ms", VERMILION, "x"),
    ):
        tip.plot(run["time"], 1e3 * run["track_deviation"][:, 0], color=colour, linewidth=1.0, label=label)
        impulses.semilogy(run["contact_start"], run["impulse"], marker, color=colour, markersize=3, alpha=0.6, label=label)
    tip.set(xlabel="time [s]", ylabel="distance of the tip from its ideal path [mm]")
    impulses.set(xlabel="onset of the contact [s]", ylabel="normal impulse of a contact [N s]", ylim=(LEAST_IMPULSE, 300.0))
    for (start, taken), marker, colour in zip(costs.items(), "os", (BLUE, VERMILION), strict=True):
        cost.loglog(units, [1e6 * each for each in taken], f"{marker}-", color=colour, markersize=4, linewidth=1.0, label=start)
    goal = 1e6 * costs[STARTS[-1]][0] * (np.array(units) / units[0]) ** 1.1
    cost.loglog(units, goal, ":", color=GREY, linewidth=1.0, label="as N to the power 1.1")
    cost.set(xlabel="number of units N", ylabel="processor time of a step [µs]")
    cost.set_xticks(units)
    cost.xaxis.set_major_formatter(ScalarFormatter())
    cost.xaxis.set_minor_formatter(NullFormatter())
    for axes in drawn:
        axes.legend(frameon=False, fontsize=small())
    figure_of(drawn).savefig(DECISIONS.parent / "hard_contact.png", dpi=110, metadata={"Software": ""})


def _memory(cases: int) -> str:
    """Return the largest memory of a process during a batch."""
    one, kept = array(2), []
    for part in (cases // 100, cases):
        sd.simulate_many(one, {"O.clearance": np.linspace(1e-4, 2e-4, part)}, until=2e-3, step=STEP, threads=1)
        kept.append(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0)
    return f"Largest memory after {cases // 100} cases {kept[0]:.0f} MB, after {cases} cases {kept[1]:.0f} MB.\n"


if __name__ == "__main__":
    command("hard_contact", measure)
