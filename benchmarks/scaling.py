"""Measure longer arrays: cost with one clearance joint, with clearance everywhere, and with friction in all joints."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass
from statistics import median

from benchmarks.cases import UNTIL, array, clearance_everywhere, friction_everywhere, name_of
from benchmarks.measure import command, fitted_exponent, table
from scissordyn.casefile.configuration import write_configuration
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.options import Options
from scissordyn.plan.plan import plan
from scissordyn.record.dataset import results
from scissordyn.record.trajectory import Trajectory
from scissordyn.record.xarray_dataset import as_dataset
from scissordyn.run.trajectory import compute, record_trajectory

UNITS = (2, 10, 50, 200)
SHARED = 1.5  # Target for the time of an evaluation in a long array with one clearance joint, relative to two units

FLIGHT, CONTACT = 1e-3, 2e-3
"""Simulated times with clearance at every joint [s]: before and after the first contact at 1.4 ms."""

FRICTION = 20e-3  # Simulated time in contact with friction at every joint [s]


@dataclass(frozen=True)
class Phases:
    """Times of the parts of a run.

    Parameters
    ----------
    path : Trajectory
    integration, setup, dataset : float
        Processor times [s].
    """

    path: Trajectory
    integration: float
    setup: float
    dataset: float


def measure(quick: bool = False) -> str:
    """Return the three tables."""
    one = _one_clearance(UNITS[:3] if quick else UNITS, 3 if quick else 9)
    everywhere = _clearance_everywhere((2, 4, 8) if quick else (2, 4, 8, 16, 32), 1 if quick else 3)
    return f"{one}\n{everywhere}\n{_friction_everywhere(UNITS[:2] if quick else UNITS, 1 if quick else 3)}"


def _phases(cases: Mapping[str, tuple[Mechanism, Options]], repeats: int) -> dict[str, Phases]:
    """Return median times of alternating cases, without a first run of each."""
    times: dict[str, list[tuple[float, float, float]]] = {name: [] for name in cases}
    paths: dict[str, Trajectory] = {}
    for turn in range(repeats + 1):
        for name, (mechanism, options) in cases.items():
            began = time.perf_counter()
            path = paths[name] = compute(plan(mechanism), options)
            computed = time.perf_counter()
            as_dataset(
                results(path.plan, write_configuration(mechanism, options), *record_trajectory(path.plan, options, path))
            )
            integration = float(path.statistics["seconds"])
            if turn:
                times[name].append((integration, computed - began - integration, time.perf_counter() - computed))
    return {name: Phases(paths[name], *map(median, zip(*found, strict=True))) for name, found in times.items()}


def _one_clearance(units: tuple[int, ...], repeats: int) -> str:
    named = {f"{name_of(kinetic)}, N = {count}": (kinetic, count) for kinetic in (None, 0.1) for count in units}
    found = _phases({name: (array(*case), Options(UNTIL * case[1] / 2)) for name, case in named.items()}, repeats)
    rows = []
    for name, (kinetic, _) in named.items():
        phases, shortest = found[name], found[f"{name_of(kinetic)}, N = {units[0]}"]
        path, (cost, least) = phases.path, (one.integration / float(one.path.statistics["rates"]) for one in (phases, shortest))
        ratio = cost / least
        verdict = f"{ratio:.2f}" + ("" if ratio <= SHARED else " missed")
        rows.append(
            [
                name,
                str(path.plan.coordinates.free),
                str(path.statistics["steps"]),
                f"{1e3 * phases.integration:.2f}",
                f"{1e9 * cost:.0f}",
                verdict if path.status == "complete" else path.status,
                f"{1e3 * phases.setup:.1f}",
                f"{1e3 * phases.dataset:.1f}",
            ]
        )
    head = [
        "clearance at joint A",
        "unknowns",
        "steps",
        "integration [ms]",
        "per rate [ns]",
        "to N = 2",
        "set-up [ms]",
        "Dataset [ms]",
    ]
    text = (
        f"Medians of {repeats} runs through the same angle at 1e-8, {1e3 * UNTIL:g} ms for N = 2, with the same speed of the "
        f"tip; a rate may take {SHARED:g} times as long as with N = 2.\n\n"
    )
    return text + table(head, rows)


def _clearance_everywhere(units: tuple[int, ...], repeats: int) -> str:
    mechanisms = {count: clearance_everywhere(count) for count in units}
    flights = _phases({str(n): (m, Options(FLIGHT, samples=2)) for n, m in mechanisms.items()}, repeats)
    contacts = _phases({str(n): (m, Options(CONTACT, samples=101)) for n, m in mechanisms.items()}, repeats)
    rows, joints, per_rate, per_time = [], [], [], []
    for count, mechanism in mechanisms.items():
        flight, contact = flights[str(count)], contacts[str(count)]
        path = contact.path
        joints.append(float(len(mechanism.clearance_joints)))
        per_rate.append(flight.integration / float(flight.path.statistics["rates"]))
        per_time.append(contact.integration / path.end)
        rows.append(
            [
                f"N = {count}",
                str(len(mechanism.clearance_joints)),
                str(path.plan.coordinates.free),
                f"{1e6 * per_rate[-1]:.2f}",
                path.status,
                str(path.statistics["steps"]),
                str(path.statistics["events"]),
                f"{per_time[-1]:.2f}",
                f"{1e3 * contact.setup:.0f}",
                f"{1e3 * contact.dataset:.0f}",
            ]
        )
    head = [
        "clearance at all joints",
        "joints",
        "unknowns",
        "per rate in flight [us]",
        "status",
        "steps",
        "events",
        "ms per simulated ms",
        "set-up [ms]",
        "Dataset [ms]",
    ]
    text = (
        f"Clearance at every revolute joint, no friction, dop853, at 1e-8: {1e3 * FLIGHT:g} ms of free flight, then "
        f"{1e3 * CONTACT:g} ms with impacts.\nTime grows as the number of joints to the power "
        f"{fitted_exponent(joints, per_rate):.2f} for an evaluation of the right-hand side in flight\n"
        f"and {fitted_exponent(joints, per_time):.2f} for a simulated time with impacts.\n\n"
    )
    return text + table(head, rows)


def _friction_everywhere(units: tuple[int, ...], repeats: int) -> str:
    options = Options(FRICTION, samples=101, start="in-contact")
    found = _phases({str(count): (friction_everywhere(count), options) for count in units}, repeats)
    rows, per_step, per_time = [], [], []
    for count, phases in zip(units, found.values(), strict=True):
        steps = int(phases.path.statistics["steps"]) + int(phases.path.statistics["rejected"])
        per_step.append(phases.integration / steps)
        per_time.append(phases.integration / phases.path.end)
        rows.append(
            [
                f"N = {count}",
                str(3 * count),
                phases.path.status,
                str(steps),
                f"{1e3 * per_step[-1]:.3f}",
                f"{per_time[-1]:.2f}",
            ]
        )
    sizes = [float(count) for count in units]
    text = (
        f"Clearance of 0.1 mm and LuGre 0.1 at every revolute joint, started in contact, 60 to 58 degrees in 2 s, the first "
        f"{1e3 * FRICTION:g} ms at 1e-8.\nTime grows as N to the power {fitted_exponent(sizes, per_step):.2f} for a step and "
        f"{fitted_exponent(sizes, per_time):.2f} for a simulated time.\n\n"
    )
    head = ["in contact at all joints", "joints", "status", "steps and rejected", "ms per step", "ms per simulated ms"]
    return text + table(head, rows)


if __name__ == "__main__":
    command("scaling", measure)
