"""Friction in ideal pins: time of one evaluation by the number of pins, and steps of explicit and implicit methods."""

from __future__ import annotations

import time

import scissordyn as sd
from benchmarks.measure import command, table

UNITS = (1, 3, 10, 20)
STAGES, SIZE = 12, 1e-5


def microseconds(mechanism: sd.Mechanism, steps: int) -> str:
    """Of one evaluation within so many steps of dop853, the least of three, less what a short run takes."""
    spans = []
    for count in (20, 20 + steps):
        best = float("inf")
        for _ in range(3):
            began = time.process_time()
            sd.simulate(mechanism, until=count * SIZE, step=SIZE, method="dop853", samples=2)
            best = min(best, time.process_time() - began)
        spans.append(best)
    return f"{1e6 * (spans[1] - spans[0]) / (steps * STAGES):.1f}"


def measure(quick: bool = False) -> str:
    """Two tables."""
    costs = []
    for units in UNITS[: 2 if quick else None]:
        array = sd.scissor(units=units)
        rubbing = sd.with_joint_friction(array, radius=0.01, kinetic=0.15)
        counts = str(units), str(len(rubbing.components))
        costs.append((*counts, microseconds(array, 20_000), microseconds(rubbing, 6000 // units**2 + 100)))
    steps = []
    for transition in (1e-1, 1e-2, 1e-3)[: 2 if quick else None]:
        crank = sd.slider_crank(crank=0.1, rod=0.3).replace("crank.angular_velocity", 30.0)
        rubbing = sd.with_joint_friction(crank, radius=0.012, kinetic=0.15, transition=transition)
        counts = [
            sd.simulate_many(rubbing, {"gravity": [9.81]}, until=0.3, method=method, measures=["steps"])["steps"]
            for method in ("dop853", "rodas5p")
        ]
        steps.append((f"{1e3 * transition:g}", *(f"{float(count[0]):.0f}" for count in counts)))
    return (
        f"{table(('units', 'pins', 'without friction [us]', 'with it [us]'), costs)}\n\n"
        f"{table(('transition [mm/s]', 'dop853 steps', 'rodas5p steps'), steps)}"
    )


if __name__ == "__main__":
    command("joint_friction", measure)
