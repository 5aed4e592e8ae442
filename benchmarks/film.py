"""Measure the effect of oil in the paper's case over clearance and viscosity, and its cost."""

from __future__ import annotations

import json
from statistics import median
from time import perf_counter

import numpy as np
import xarray as xr

import scissordyn as sd
from benchmarks.measure import command, table

UNTIL = 1.0 / 15.0  # Duration of the stroke of the paper's array at 150 rpm from 30 to 90 degrees [s]

CLEARANCES = (2e-4, 5e-4, 1e-3)

OILS = {"dry": None, "10 mPa s": 0.01, "50 mPa s": 0.05, "200 mPa s": 0.2}

MEMBERS = 5  # Number of neighbouring runs whose clearances differ by a relative 1e-9


CASE = """The paper's array of two units, joint A loose, LuGre friction of 0.05, 150 rpm over the stroke from 30 to 90 degrees;
a finite bearing of 0.75 diameters, roughness 1 um, at the default tolerance.
"""

RIGID = """Films are between rigid surfaces, of oil whose viscosity does not grow with pressure: their largest forces and
torques are not those of a real joint.

"""


def array(clearance: float, viscosity: float | None, friction: bool = True, bearing: str = "finite") -> sd.Mechanism:
    """Return the paper's array with clearance in joint A."""
    oil = None if viscosity is None else sd.Lubrication(viscosity=viscosity, bearing=bearing)  # type: ignore[arg-type]
    law = sd.LuGre(0.05) if friction else sd.NoFriction()
    gap = sd.Clearance(clearance, friction=law, lubrication=oil)
    return sd.scissor(units=2).driven(speed=sd.rpm(150)).with_clearance("A", gap)


def measure(quick: bool) -> str:
    """Return the page."""
    return f"{_answers(quick)}\n{_cost(quick)}"


def _spread(values: list[float], factor: float = 1.0) -> str:
    low, high = factor * min(values), factor * max(values)
    here = f"{factor * median(values):.4g}"
    return here if high - low < 5e-4 * abs(high) else f"{here} ({low:.4g} to {high:.4g})"


def _answers(quick: bool) -> str:
    rows = []
    for clearance in CLEARANCES[1:2] if quick else CLEARANCES:
        for name, viscosity in OILS.items():
            runs = [
                sd.simulate(array(clearance * (1.0 + 1e-9 * member), viscosity), until=UNTIL)
                for member in range(1 if quick else MEMBERS)
            ]
            found: dict[str, list[float]] = {}
            for run in runs:
                for key, value in _numbers(run).items():
                    found.setdefault(key, []).append(value)
            film = "-" if viscosity is None else _spread(found["film"], 1e-3)
            rows.append(
                [
                    f"{1e3 * clearance:g} mm, {name}",
                    _spread(found["contacts"]),
                    _spread(found["speed"], 1e3),
                    _spread(found["force"], 1e-3),
                    film,
                    _spread(found["torque"], 1e-3),
                    _spread(found["work"], 1e-3),
                    _spread(found["lost"]),
                ]
            )
    members = f"Median of {MEMBERS} neighbours whose clearances differ by a relative 1e-9, their range where they differ."
    head = ["", "contacts", "first at [mm/s]", "contact [kN]", "film [kN]", "torque [kN m]", "work [kJ]", "lost [J]"]
    return f"{CASE}{members}\n{RIGID}{table(head, rows)}"


def _numbers(run: xr.Dataset) -> dict[str, float]:
    speed = run["approach_speed"].values
    lost = sum(float(run[name].values[-1]) for name in ("damping_loss", "friction_loss", "damper_loss") if name in run)
    return {
        "contacts": float(run.sizes["contact"]),
        "speed": float(speed[0]) if speed.size else 0.0,
        "force": float(run["peak_force"].max()) if speed.size else 0.0,
        "film": float(run["film_peak_force"].max()) if "film" in run.dims else 0.0,
        "torque": float(np.abs(run["peak_drive_torque"]).max()),
        "work": float(run["drive_work"].values[-1]),
        "lost": lost,
    }


def _cost(quick: bool) -> str:
    made = {}
    for friction in (False, True):
        label = "LuGre 0.05" if friction else "frictionless"
        cases = [(5e-4, 0.05, bearing) for bearing in ("short", "long", "finite")]
        if not friction:
            cases += [(clearance, viscosity, "finite") for clearance in (2e-4, 6e-4) for viscosity in (0.01, 0.1)]
        for clearance in dict.fromkeys(clearance for clearance, _, _ in cases):
            made[f"{label}, {1e3 * clearance:g} mm, dry"] = array(clearance, None, friction)
            for _, viscosity, bearing in (case for case in cases if case[0] == clearance):
                name = f"{label}, {1e3 * clearance:g} mm, {1e3 * viscosity:g} mPa s, {bearing}"
                made[name] = array(clearance, viscosity, friction, bearing)
    seconds: dict[str, list[float]] = {name: [] for name in made}
    steps, methods = {}, {}
    for turn in range(2 if quick else 8):
        for name, mechanism in made.items():
            began = perf_counter()
            run = sd.simulate(mechanism, until=UNTIL)
            if turn:
                seconds[name].append(perf_counter() - began)
            found = json.loads(run.attrs["statistics"])
            steps[name], methods[name] = found["steps"], found["method"]
    rows, dry = [], ""
    for name, times in seconds.items():
        dry = name if name.endswith("dry") else dry
        ratio = median(one / other for one, other in zip(times, seconds[dry], strict=True))
        rows.append([name, methods[name], str(steps[name]), f"{1e3 * median(times):.1f}", f"{ratio:.2f}"])
    text = "Time of `simulate`, interleaved runs; median of the ratios to the dry run above, of the same turn.\n\n"
    return text + table(["", "method", "steps", "[ms]", "ratio"], rows)


if __name__ == "__main__":
    command("film", measure)
