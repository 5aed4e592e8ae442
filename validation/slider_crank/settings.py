"""Scan Exudyn's settings on the slider-crank: ``python -m validation.slider_crank.settings``; one minute."""

from __future__ import annotations

import itertools
import math

from benchmarks.measure import table

from validation.slider_crank.case import error
from validation.slider_crank.equations import CLEARANCE
from validation.slider_crank.exudyn_pin import Settings, exudyns

GOAL = 1e-3  # Error of the orbit that has to be reached [clearances]
TOLERANCES = (1e-8, 5e-9, 2e-9, 1e-9, 1e-10)  # Relative tolerances of the scan


def measured(tolerance: float, settings: Settings) -> tuple[float, float]:
    """Return error and seconds; infinite if Exudyn fails."""
    try:
        seconds, orbit = exudyns(tolerance, settings)
    except Exception as failure:  # another code's failure is a result
        print(f"{settings} at {tolerance:g}: {failure}")
        return math.inf, math.inf
    return error(orbit), seconds


def main() -> None:
    """Print every combination of settings with its errors and its least time to the goal."""
    measured(1e-8, Settings())  # loads the library
    rows, runs = [], 0
    for longest, force, growth, scale in itertools.product(
        (1e-3, 1e-4), (1.0, 10.0, 30.0, 100.0), (2.0, 5.0, 10.0, 30.0), (CLEARANCE, 1.0)
    ):
        made = [measured(one, Settings(longest, force, growth, scale)) for one in TOLERANCES]
        runs += len(made)
        reached = [took for miss, took in made if miss <= GOAL]
        rows.append(
            [
                f"{longest:g}",
                f"{force:g}",
                f"{growth:g}",
                "clearances" if scale == CLEARANCE else "metres",
                *(f"{miss:.1e}" for miss, _ in made),
                str(len(reached)),
                f"{1e3 * min(reached):.3g}" if reached else "-",
            ]
        )
    head = ["longest step [s]", "force [N]", "growth", "absolute in", *(f"{one:g}" for one in TOLERANCES), "met", "time [ms]"]
    print(table(head, sorted(rows, key=lambda row: float(row[-1]) if row[-1] != "-" else math.inf)))
    print(f"{sum(int(row[-2]) for row in rows)} of {runs} runs have an error of at most {GOAL:g}.")


if __name__ == "__main__":
    main()
