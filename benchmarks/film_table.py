"""Compute the table of impedances of bearings of finite length: ``python -m benchmarks.film_table --write`` (4 minutes).

Without ``--write`` it solves Reynolds' equation at random points between the nodes and prints the error of the table.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

from scissordyn.components.film.impedance import directions, eccentricities, steepness
from scissordyn.components.film.reynolds import impedance

RATIOS = tuple(2.0 ** (0.5 * k) for k in range(-4, 5))  # Ratios of length to diameter, from 0.25 to 4

AROUND, ALONG = 200, 20

THICK = 0.01  # Least thickness in the check; the force of a thinner film that separates is too small for the table

FILE = Path(__file__).parents[1] / "src" / "scissordyn" / "components" / "film" / "finite.npz"


def table() -> np.ndarray:
    """Return radial, tangential and pressure values, each divided by `steepness`, shape (ratios, GAPS, DIRECTIONS, 3)."""
    found = []
    for ratio in RATIOS:
        for eccentricity in eccentricities():
            solved = impedance(float(eccentricity), directions(), ratio, around=AROUND, along=ALONG)
            values = np.array([(one.radial, one.tangential, one.pressure) for one in solved])
            found.append(values / steepness(eccentricity))
            print(f"L/D = {ratio:g}, eccentricity {eccentricity:.4f}", file=sys.stderr, flush=True)
    return np.array(found).reshape(len(RATIOS), len(eccentricities()), len(directions()), 3)


def main() -> None:
    """Write or check the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true")
    if parser.parse_args().write:
        np.savez_compressed(FILE, ratios=np.array(RATIOS), values=table())
        return
    check()


def check() -> None:
    """Print the largest differences from solutions between the nodes."""
    from scissordyn.components.film.impedance import finite_table, looked_up

    random = np.random.default_rng(1)
    errors, thick = [], []
    for _ in range(200):
        ratio = float(np.exp(random.uniform(np.log(RATIOS[0]), np.log(RATIOS[-1]))))
        gap, psi = float(random.uniform(0.05, 1.0) ** 2), float(random.uniform(0.0, np.pi))
        (exact,) = impedance(1.0 - gap, np.array([psi]), ratio, around=AROUND, along=ALONG)
        found = looked_up(finite_table(ratio), 1.0 - gap, psi)
        size = np.array([*[np.hypot(exact.radial, exact.tangential)] * 2, exact.pressure])
        errors.append(np.abs(np.array(found) - (exact.radial, exact.tangential, exact.pressure)) / size)
        thick.append(gap >= THICK)
    print("error of the table, of the force along and across and of the pressure")
    for name, chosen in ((f"films above {THICK:g} c", np.array(errors)[thick]), ("all", np.array(errors))):
        for what, values in (("median", np.median(chosen, axis=0)), ("largest", np.max(chosen, axis=0))):
            print(f"{name}, {what}:", ", ".join(f"{error:.3%}" for error in values))


if __name__ == "__main__":
    main()
