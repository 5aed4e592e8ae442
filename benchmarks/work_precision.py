"""Error against time for every method, from large to small tolerances."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr

import scissordyn as sd
from benchmarks.cases import CLEARANCE, FRICTION, UNTIL, array, name_of
from benchmarks.measure import DECISIONS, Measured, command, interleaved, table
from scissordyn.integrate.tableau import METHODS
from scissordyn.model.options import Options
from scissordyn.plan.plan import plan
from scissordyn.run.trajectory import compute

TOLERANCES = (1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10)
CONTACTS = 3
REFERENCE, WITNESS = ("dop853", 1e-12), ("rodas5p", 1e-11)
"""The reference run of the errors, and that of another method, whose difference is the resolution of the errors."""

ERRORS = {
    "start": "contact_start",
    "speed": "approach_speed",
    "peak": "peak_force",
}


@dataclass(frozen=True)
class Point:
    """One method at one tolerance.

    Parameters
    ----------
    seconds : float
    steps : int
    errors : dict
        Largest relative error of the first contacts' start, speed and peak; "end": of the slider at the end, in clearances.
        Empty if the run failed.
    """

    seconds: float
    steps: int
    errors: dict[str, float]


def _run(mechanism: sd.Mechanism, method: str, tolerance: float) -> xr.Dataset:
    return sd.simulate(mechanism, until=UNTIL, samples=2, rtol=tolerance, atol=tolerance, method=method)


def _errors(run: xr.Dataset, reference: xr.Dataset) -> dict[str, float]:
    if run.attrs["status"] != "complete":
        return {}
    found = {}
    for name, variable in ERRORS.items():
        exact = reference[variable].values[:CONTACTS]
        here = run[variable].values[:CONTACTS]
        found[name] = float(np.max(np.abs(here / exact - 1.0))) if here.size == CONTACTS else np.inf
    found["end"] = abs(float(run["slider_position"][-1] - reference["slider_position"][-1])) / CLEARANCE
    return found


def measure(quick: bool = False) -> str:
    """Table, and the picture unless quick."""
    tolerances = TOLERANCES[1::3] if quick else TOLERANCES
    page, points = "", {}
    for kinetic in FRICTION:
        found, floor = _case(kinetic, tolerances, 1 if quick else 5)
        points[name_of(kinetic)] = (found, floor)
        rows = [
            [
                method,
                f"{tolerance:.0e}",
                f"{1e3 * point.seconds:.2f}",
                str(point.steps),
                *(f"{point.errors[name]:.0e}" if point.errors else "failed" for name in (*ERRORS, "end")),
            ]
            for (method, tolerance), point in found.items()
        ]
        floors = ", ".join(f"{name} {value:.0e}" for name, value in floor.items())
        head = ["method", "tolerance", "time [ms]", "steps", *ERRORS, "end"]
        page += (
            f"{name_of(kinetic)}; reference and {WITNESS[0]} at {WITNESS[1]:.0e} differ by: {floors}.\n\n{table(head, rows)}\n"
        )
    if not quick:
        _draw(points)
        page += "![Error against time of all methods](../work-precision.png)\n\n"
        page += f"Dotted: difference of reference and {WITNESS[0]} at {WITNESS[1]:.0e}; failed runs are left out.\n"
    intro = (
        f"Integration alone, 50 ms. Largest relative error of start, speed and peak force of the first {CONTACTS}\n"
        f"contacts, and of the slider's position at 50 ms in clearances, against {REFERENCE[0]} at {REFERENCE[1]:.0e}.\n\n"
    )
    return intro + page


def _case(
    kinetic: float | None, tolerances: tuple[float, ...], repeats: int
) -> tuple[dict[tuple[str, float], Point], dict[str, float]]:
    mechanism = array(kinetic)
    reference = _run(mechanism, *REFERENCE)
    floor = _errors(_run(mechanism, *WITNESS), reference)
    candidates: dict[str, Measured] = {}
    counts = {}
    for method in METHODS:
        for tolerance in tolerances:
            options = Options(UNTIL, samples=2, rtol=tolerance, atol=tolerance, method=method)
            candidates[f"{method} {tolerance}"] = lambda o=options: float(compute(plan(mechanism), o).statistics["seconds"])
            counts[method, tolerance] = int(compute(plan(mechanism), options).statistics["steps"])
    times = interleaved(candidates, repeats)
    points = {
        (method, tolerance): Point(
            times[f"{method} {tolerance}"].median, steps, _errors(_run(mechanism, method, tolerance), reference)
        )
        for (method, tolerance), steps in counts.items()
    }
    return points, floor


def _draw(cases: dict[str, tuple[dict[tuple[str, float], Point], dict[str, float]]]) -> None:
    """Write work-precision.png."""
    from matplotlib.figure import Figure
    from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

    figure = Figure(figsize=(11.0, 6.2), layout="constrained")
    grid = figure.subplots(2, len(cases), sharex="col", sharey="row", squeeze=False)
    labels = {"peak": f"peak force of {CONTACTS} contacts\nrelative error", "end": "slider at 50 ms\nerror in clearances"}
    for column, (name, (points, floor)) in enumerate(cases.items()):
        for row, (quantity, label) in enumerate(labels.items()):
            axes = grid[row, column]
            for method in METHODS:
                own = [point for (one, _), point in points.items() if one == method and point.errors]
                seconds, errors = [1e3 * p.seconds for p in own], [p.errors[quantity] for p in own]
                axes.loglog(seconds, errors, "o-", markersize=3, linewidth=1.0, label=method)
            axes.axhline(floor[quantity], color="0.6", linewidth=0.8, linestyle=":")
            axes.grid(True, which="major", color="0.9", linewidth=0.5)
            axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
            axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
            axes.xaxis.set_minor_locator(NullLocator())
            if row == 0:
                axes.set_title(name)
            else:
                axes.set_xlabel("time of 50 ms simulated [ms]")
            if column == 0:
                axes.set_ylabel(label)
    grid[0, 0].legend(frameon=False, fontsize="small")
    DECISIONS.mkdir(parents=True, exist_ok=True)
    figure.savefig(DECISIONS / "work-precision.png", dpi=110)


if __name__ == "__main__":
    command("work_precision", measure)
