"""Horizon of gradients beside the instant at which a run leaves a far more accurate one: forty chaotic slider-cranks.

``python -m benchmarks.gradient_horizon --write`` writes the page, in minutes; ``--quick`` takes four cranks.
"""

from __future__ import annotations

import math
import time

import numpy as np

import scissordyn as sd
from benchmarks.measure import command, paragraph, table
from scissordyn.plan.plan import plan
from scissordyn.run.predictability import agreement_end, compute_comparable

UNTIL = 0.1  # End of the runs [s]
SPEEDS = (2700.0, 3600.0)  # [rpm] range
TOLERANCES = (1e-9, 1e-11)
REFERENCE = 1e-3  # [tolerances] of the run that counts as exact, as for `trusted_until`
FACTORS = (100.0, 10.0, 0.1)  # [tolerances] of the second run; the first is that of gradients
EVERY = 100  # [compared instants] distance of those at which a second run is compared, as for gradients


def horizons(rpm: float, tolerance: float) -> tuple[list[float], list[float]]:
    """Return the horizons [s], by the reference and by each second run, and the costs of these [runs]."""
    pin = sd.Clearance(0.5e-3, journal_radius=9.5e-3, stiffness=sd.Hertz(), damping=sd.LankaraniNikravesh(0.9))
    crank = sd.slider_crank().driven(speed=sd.rpm(rpm)).with_clearance("slider pin", pin)
    options = sd.Options(UNTIL, "concentric", 2, tolerance, tolerance, events="located")
    path, (times, states) = compute_comparable(plan(crank), options)
    few = times[::EVERY], states[::EVERY]
    found, seconds = [agreement_end(options, path, (times, states), REFERENCE)], list[float]()
    for factor in (1.0, *FACTORS):
        began = time.process_time()
        found.append(agreement_end(options, path, few, factor))
        seconds.append(time.process_time() - began)
    return [found[0], *found[2:]], [spent / seconds[0] for spent in seconds[1:]]


def measure(quick: bool) -> str:
    """Horizons by second runs, relative to the instant of divergence, for two tolerances."""
    speeds = np.linspace(*SPEEDS, 2 if quick else 20)
    rows, diverging = [], 0
    for tolerance in TOLERANCES:
        runs = [horizons(float(rpm), tolerance) for rpm in speeds]
        runs = [run for run in runs if math.isfinite(run[0][0])]
        diverging += len(runs)
        for place, factor in enumerate(FACTORS):
            parts = np.array([min(found[1 + place], UNTIL) / found[0] for found, _ in runs])
            late, cost = parts[parts > 1.0], np.median([costs[place] for _, costs in runs])
            cells = [f"{late.size} of {parts.size}", f"{100.0 * float(np.max(late - 1.0, initial=0.0)):.0f} %"]
            rows.append([f"{tolerance:g}", f"{factor:g}", *cells, f"{float(np.median(parts)):.2f}", f"{cost:.1f}"])
    text = paragraph(
        f"Slider-cranks of docs/tutorials/chaos.md at {SPEEDS[0]:g} to {SPEEDS[1]:g} rpm, {len(speeds)} speeds at each of two",
        f"tolerances; {diverging} of the runs leave a run at a thousandth of the tolerance within {1e3 * UNTIL:g} ms. The",
        "horizon is the instant at which a second run, at a multiple of the tolerance, leaves the first one, compared at",
        f"every {EVERY}th instant. A limit has to be early rather than late. The cost is processor time relative to a second",
        "run at the same tolerance.",
    )
    head = ("tolerance", "multiple", "later than the divergence", "by at most", "median of the ratio", "cost [runs]")
    return f"{text}\n\n{table(head, rows)}"


if __name__ == "__main__":
    command("gradient_horizon", measure)
