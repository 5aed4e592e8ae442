"""What bars that bend cost: the paper's array beside that of rigid bars, and arrays of more units.

``python -m benchmarks.bent_bars``: processor time of the integration alone, and of making a mechanism and all that `simulate`
does with it; the least of interleaved repetitions.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Mapping
from functools import partial

import numpy as np

import scissordyn as sd
from scissordyn.model.options import Options
from scissordyn.plan.plan import plan
from scissordyn.run.advance.loop import advance
from scissordyn.run.trajectory import make_driver

TUBE = {"bending_stiffness": 42743.0, "axial_stiffness": 7.5e7}
STROKE, UNITS, REPETITIONS = 50e-3, (2, 4, 8, 16, 32), 5


def array(units: int = 2, **options: object) -> sd.Mechanism:
    """The paper's array, frictionless, its bars tubes if options of `with_bending` are given."""
    made = sd.scissor(units=units).with_clearance("A", sd.Clearance(0.5e-3))
    if options:
        made = sd.with_bending(made, **TUBE, **options)  # type: ignore[arg-type]
    return made.driven(speed=sd.rpm(150))


def spent(mechanism: sd.Mechanism, until: float) -> tuple[float, dict[str, int]]:
    """Processor time of one integration [s], and its steps and right-hand sides."""
    driver, _, _ = make_driver(plan(mechanism), Options(until))
    begun = time.process_time()
    advance(driver, until)
    counts = driver.integration.content.state.counts[0]
    return time.process_time() - begun, {name: int(counts[name]) for name in ("steps", "rejected", "rates")}


def least(cases: Mapping[str, sd.Mechanism], until: float) -> dict[str, tuple[float, dict[str, int]]]:
    """Of interleaved repetitions."""
    found = {name: (np.inf, dict[str, int]()) for name in cases}
    for repetition in range(REPETITIONS + 1):
        for name, mechanism in cases.items():
            took, counts = spent(mechanism, until)
            if repetition and took < found[name][0]:  # the first one loads
                found[name] = took, counts
    return found


def whole(cases: Mapping[str, Callable[[], sd.Mechanism]], until: float) -> dict[str, float]:
    """Processor time of making a mechanism, planning and integrating it, and of the Dataset [s], of interleaved repetitions."""
    found = dict.fromkeys(cases, np.inf)
    for repetition in range(REPETITIONS + 1):
        for name, made in cases.items():
            begun = time.process_time()
            sd.simulate(made(), until=until)
            if repetition:
                found[name] = min(found[name], time.process_time() - begun)
    return found


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--elements", action="store_true", help="beam elements too, which take half a minute")
    chosen = parser.parse_args()
    cases = {"rigid": array} | {f"{modes} modes": partial(array, modes=modes) for modes in (4, 6, 8, 10)}
    if chosen.elements:
        cases |= {f"{elements} elements": partial(array, elements=elements) for elements in (2, 4)}
    print("two units, stroke of 50 ms; integration, then all of `simulate`")
    print("| bars | steps | rejected | right-hand sides | time [ms] | over rigid bars | time [ms] | over rigid bars |")
    table, runs = least({name: made() for name, made in cases.items()}, STROKE), whole(cases, STROKE)
    for name, (took, counts) in table.items():
        numbers = " | ".join(f"{value}" for value in counts.values())
        alone = f"{1e3 * took:.1f} | {took / table['rigid'][0]:.1f}"
        print(f"| {name} | {numbers} | {alone} | {1e3 * runs[name]:.1f} | {runs[name] / runs['rigid']:.1f} |", flush=True)
    print("\n6 modes a bar, 5 ms\n| units | free coordinates | steps | time [ms] | of a step [us] | exponent of that |")
    before: tuple[int, float] | None = None
    for units, (took, counts) in ((n, least({"one": array(n, modes=6)}, 5e-3)["one"]) for n in UNITS):
        each = took / (counts["steps"] + counts["rejected"])
        power = "" if before is None else f"{np.log(each / before[1]) / np.log(units / before[0]):.2f}"
        free = plan(array(units, modes=6)).coordinates.free
        print(f"| {units} | {free} | {counts['steps']} | {1e3 * took:.1f} | {1e6 * each:.1f} | {power} |", flush=True)
        before = units, each


if __name__ == "__main__":
    main()
