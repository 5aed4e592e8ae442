"""Longer arrays: one loose joint must cost the same at any length, many loose joints in proportion to it."""

from __future__ import annotations

import time

from benchmarks.cases import UNTIL, all_loose, array
from benchmarks.measure import Times, command, fitted_exponent, interleaved, table
from scissordyn.model.mechanism import Mechanism
from scissordyn.simulation.dataset import to_dataset
from scissordyn.simulation.options import Options
from scissordyn.simulation.trajectory import compute

UNITS = (2, 10, 50, 200)
SHARED = 1.5
"""Most that the integration of a long array with one loose joint may take, in times of that of two units."""

FLIGHT, KNOCKING = 1e-3, 2e-3
"""Simulated times with every joint loose [s]: before the first contact at 1.4 ms, and after it."""


def measure(quick: bool = False) -> str:
    """Both tables."""
    one = _one_loose(UNITS[:3] if quick else UNITS, 3 if quick else 9)
    return f"{one}\n{_all_loose((2, 4, 8) if quick else (2, 4, 8, 16, 32), 1 if quick else 3)}"


def _phases(mechanism: Mechanism, options: Options, repeats: int) -> tuple[Times, Times, Times]:
    """Integration, set-up and Dataset."""
    parts: list[dict[str, float]] = []

    def run() -> None:
        began = time.perf_counter()
        path = compute(mechanism, options)
        computed = time.perf_counter()
        to_dataset(mechanism, options, path)
        integration = float(path.statistics["seconds"])
        parts.append(
            {
                "integration": integration,
                "set-up": computed - began - integration,
                "Dataset": time.perf_counter() - computed,
            }
        )

    run()
    found = interleaved({name: lambda n=name: (run(), parts[-1][n])[1] for name in parts[0]}, repeats)
    return found["integration"], found["set-up"], found["Dataset"]


def _one_loose(units: tuple[int, ...], repeats: int) -> str:
    rows, first = [], {}
    for kinetic in (None, 0.1):
        for count in units:
            mechanism, options = array(kinetic, count), Options(UNTIL)
            path = compute(mechanism, options)
            integration, setup, dataset = _phases(mechanism, options, repeats)
            first.setdefault(kinetic, integration.median)
            ratio = integration.median / first[kinetic]
            per_rate = integration.median / float(path.statistics["rates"])
            rows.append(
                [
                    f"{'frictionless' if kinetic is None else f'LuGre {kinetic:g}'}, N = {count}",
                    str(path.layout.free),
                    str(path.statistics["steps"]),
                    f"{1e3 * integration.median:.2f}",
                    f"{ratio:.2f}" + ("" if ratio <= SHARED else " missed") if path.status == "complete" else path.status,
                    f"{1e9 * per_rate:.0f}",
                    f"{1e3 * setup.median:.1f}",
                    f"{1e3 * dataset.median:.1f}",
                ]
            )
    head = [
        "joint A loose",
        "unknowns",
        "steps",
        "integration [ms]",
        "to N = 2",
        "per rate [ns]",
        "set-up [ms]",
        "Dataset [ms]",
    ]
    text = f"Medians of {repeats} runs of 50 ms at 1e-8; the integration may take {SHARED:g} times that of N = 2.\n\n"
    return text + table(head, rows)


def _all_loose(units: tuple[int, ...], repeats: int) -> str:
    rows, joints, per_rate, per_time = [], [], [], []
    for count in units:
        mechanism = all_loose(count)
        flight, options = Options(FLIGHT, samples=2), Options(KNOCKING, samples=101)
        flown, path = compute(mechanism, flight), compute(mechanism, options)
        quiet, _, _ = _phases(mechanism, flight, repeats)
        knocking, setup, dataset = _phases(mechanism, options, repeats)
        joints.append(float(len(mechanism.loose)))
        per_rate.append(quiet.median / int(flown.statistics["rates"]))
        per_time.append(knocking.median / path.end)
        rows.append(
            [
                f"N = {count}",
                str(len(mechanism.loose)),
                str(path.layout.free),
                f"{1e6 * per_rate[-1]:.2f}",
                path.status,
                str(path.statistics["steps"]),
                str(path.statistics["events"]),
                f"{per_time[-1]:.2f}",
                f"{1e3 * setup.median:.0f}",
                f"{1e3 * dataset.median:.0f}",
            ]
        )
    head = [
        "all joints loose",
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
        f"Every revolute joint loose, frictionless, dop853, at 1e-8: {1e3 * FLIGHT:g} ms of free flight, then "
        f"{1e3 * KNOCKING:g} ms with knocks.\nTime grows as the number of joints to the power "
        f"{fitted_exponent(joints, per_rate):.2f} for an evaluation of the right-hand side in flight\n"
        f"and {fitted_exponent(joints, per_time):.2f} for a simulated time with knocks.\n\n"
    )
    return text + table(head, rows)


if __name__ == "__main__":
    command("scaling", measure)
