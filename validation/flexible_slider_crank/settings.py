"""Scan Exudyn's settings: ``python -m validation.flexible_slider_crank.settings``; some minutes of one processor."""

from __future__ import annotations

import itertools
import math

from benchmarks.measure import table

from validation.flexible_slider_crank.cable import Settings, orbit
from validation.flexible_slider_crank.case import GOAL, error

STEPS = (4e-6, 3e-6, 2e-6)  # Step sizes [s]


def measured(step: float, settings: Settings) -> tuple[float, float]:
    """Return error and seconds; infinite if Exudyn fails."""
    try:
        found, seconds = orbit(step, settings)
    except Exception as failure:  # another code's failure is a result
        print(f"{settings} at {step:g}: {type(failure).__name__}")
        return math.inf, math.inf
    return error(found), seconds


def main() -> None:
    """Print every combination of settings with its errors and its least time to the goal."""
    measured(8e-6, Settings(located=True))  # loads the library
    rows, runs = [], 0
    for elements, reduced, (radius, index2), modified, newton in itertools.product(
        (12, 16), (0, 1), ((0.9, False), (1.0, False), (1.0, True)), (True, False), (1e-3, 1e-5)
    ):
        chosen = Settings(elements, reduced, radius, index2, modified, newton, located=True)
        made = [measured(one, chosen) for one in STEPS]
        runs += len(made)
        reached = [took for miss, took in made if miss <= GOAL]
        kind = "trapezoidal, index 2" if index2 else f"generalised alpha {radius:g}"
        rows.append(
            [
                str(elements),
                str(reduced),
                kind,
                "modified" if modified else "full",
                f"{newton:g}",
                *(f"{miss:.1e}" for miss, _ in made),
                str(len(reached)),
                f"{1e3 * min(reached):.3g}" if reached else "-",
            ]
        )
    head = ["elements", "reduced", "method", "Newton", "tolerance [N]", *(f"{1e6 * one:g} us" for one in STEPS), "met", "[ms]"]
    print(table(head, sorted(rows, key=lambda row: float(row[-1]) if row[-1] != "-" else math.inf)))
    print(f"{sum(int(row[-2]) for row in rows)} of {runs} runs have an error of at most {GOAL:g}.")


if __name__ == "__main__":
    main()
