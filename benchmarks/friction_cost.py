"""Measure what each friction law costs on three mechanisms, and what limits the steps of friction under load."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

import scissordyn as sd
from benchmarks.measure import DECISIONS, command, table
from scissordyn.errors import InputError
from scissordyn.laws.catalogue import FRICTION

EXAMPLES = Path(__file__).parent.parent / "examples"

TOLERANCE = 1e-6

TOLERANCES = tuple(10.0**-power for power in range(3, 10))

FINEST = 1e-11  # Tolerance of the runs that the others are compared with

Laws = Mapping[str, Mapping[str, Any]]
"""Values of `friction` in a case file, by the name of a row."""

EQUAL = {"lugre, static = kinetic": "lugre", "brown-mcphee, static = kinetic": "brown-mcphee"}
"""Laws whose friction does not weaken with the slip speed."""

CASES: Mapping[str, tuple[str, float, str, float]] = {
    "paper": ("paper", 0.1, "clearance.A.friction", 0.05),
    "lift": ("lift", 0.12, "clearance", 0.3),
    "solar array": ("solar_array", 0.12, "clearance.all.friction", 0.4),
}
"""Example, kinetic coefficient, key that is changed, and end of the run [s]."""

TEXT = f"""Steps (accepted and rejected) of runs at rtol = {TOLERANCE:g}, time of the integration, and how often the slip of a
joint in contact changes its sign, by 20 000 samples. `paper`: `examples/paper.toml`, 50 ms, one loose joint, kinetic
coefficient 0.1. `lift`: `examples/lift.toml`, 0.3 s from static equilibrium, 0.05 mm at all nine pins, restitution 0.9, 0.12.
`solar array`: `examples/solar_array.toml`, the first 0.4 s, 13 loose joints, 0.12. Other parameters are the laws' defaults.
"""

LIMIT = """The static coefficient of `lugre` and `brown-mcphee` is 1.5 times the kinetic one unless it is given. Where friction
weakens with the slip speed (Stribeck), a joint under load sticks and slips, and every step has to follow this motion. Bristles
spring back when a slip ends, so that its sign changes; without them the joint creeps between two slips. With equal
coefficients there is no such motion, and bristles that relax within microseconds take few steps.
"""


def measure(quick: bool) -> str:
    """Return the page."""
    laws = {name: {"law": name} for name in FRICTION} | {name: {"law": law, "static": None} for name, law in EQUAL.items()}
    rows = [[name, *(cell for case in CASES for cell in _cells(case, law, quick))] for name, law in laws.items()]
    head = ["law", *(f"{case}: {what}" for case in CASES for what in ("steps", "[s]", "reversals"))]
    return f"{TEXT}\n{table(head, rows)}\n{LIMIT}\n{_precision(quick)}"


def _run(case: str, law: Mapping[str, Any], rtol: float, quick: bool) -> xr.Dataset:
    example, kinetic, key, until = CASES[case]
    given = dict(law) | ({"static": kinetic} if "static" in law else {})
    words = ", ".join(f"{name} = {json.dumps(value)}" for name, value in given.items())
    words = f"{{ {words} }}" if given["law"] == "none" else f"{{ {words}, kinetic = {kinetic} }}"
    if key == "clearance":
        words = f'[{{ joint = "all", clearance = "0.05 mm", restitution = 0.9, friction = {words} }}]'
    read = sd.read_case(EXAMPLES / f"{example}.toml", [f"{key} = {words}"])
    options = {**vars(read.run), "until": until / (20.0 if quick else 1.0), "trust": False, "samples": 20_001, "rtol": rtol}
    return sd.simulate(read.mechanism, **{**options, "atol": None})


def _cells(case: str, law: Mapping[str, Any], quick: bool) -> list[str]:
    """Return the steps, the time and the reversals of a run as texts."""
    try:
        run = _run(case, law, TOLERANCE, quick)
    except InputError as error:
        return [str(error)[:20], "-", "-"]
    steps = json.loads(run.attrs["statistics"])
    if run.attrs["status"] != "complete":
        return [run.attrs["status"], "-", "-"]
    slip, touching = run["slip_speed"].values, run["in_contact"].values
    reversed_ = (slip[1:] * slip[:-1] < 0.0) & touching[1:] & touching[:-1]
    return [f"{steps['steps'] + steps['rejected']}", f"{steps['seconds']:.2g}", f"{np.count_nonzero(reversed_)}"]


def _precision(quick: bool) -> str:
    """Return a table of steps and errors over the tolerance on the lift, and draw it."""
    laws: Laws = {
        "ambrosio": {"law": "ambrosio"},
        "stribeck": {"law": "stribeck"},
        "brown-mcphee": {"law": "brown-mcphee"},
        "lugre": {"law": "lugre"},
        "lugre, static = kinetic": {"law": "lugre", "static": None},
    }
    found: dict[str, list[tuple[int, float]]] = {}
    for name, law in laws.items():
        exact = float(_run("lift", law, FINEST, quick)["friction_loss"][-1])
        found[name] = []
        for tolerance in TOLERANCES:
            run = _run("lift", law, tolerance, quick)
            steps = json.loads(run.attrs["statistics"])
            error = abs(float(run["friction_loss"][-1]) / exact - 1.0)
            found[name].append((steps["steps"] + steps["rejected"], error))
    if not quick:
        _draw(found)
    rows = [[name, *(f"{steps}, {error:.0e}" for steps, error in levels)] for name, levels in found.items()]
    text = (
        f"The lift again: steps, and the error of the work taken by friction, relative to that of a run at {FINEST:g}, by rtol."
    )
    seen = """
Without stick-slip the error falls with the steps. With it runs whose steps differ at all differ by about 1e-3 of the work.
"""
    picture = "" if quick else f"{seen}\n![Error of the work of friction over steps](friction_cost.png)\n"
    return f"{text}\n\n{table(['law', *(f'{tolerance:g}' for tolerance in TOLERANCES)], rows)}{picture}"


def _draw(found: Mapping[str, list[tuple[int, float]]]) -> None:
    """Draw errors over steps, both logarithmic."""
    from scissordyn.plot.file import write
    from scissordyn.plot.style import BLUE, GREEN, ORANGE, PURPLE, VERMILION, legend, panels

    (axes,) = panels(None, 1, size=(7.0, 4.2))
    for (name, levels), color, mark in zip(found.items(), (BLUE, GREEN, ORANGE, VERMILION, PURPLE), "osD^v", strict=True):
        steps, errors = zip(*levels, strict=True)
        axes.loglog(steps, np.maximum(errors, math.ulp(1.0)), marker=mark, markersize=4, linewidth=1.0, color=color, label=name)
    axes.set_xlabel("steps, rejected ones included")
    axes.set_ylabel("relative error of the work of friction")
    legend([axes])
    write(axes, DECISIONS / "measured" / "friction_cost.png")


if __name__ == "__main__":
    command("friction_cost", measure)
