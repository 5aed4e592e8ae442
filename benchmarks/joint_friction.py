"""Friction in ideal pins: time of one evaluation by the number of pins, and steps of explicit and implicit methods."""

from __future__ import annotations

import time
from unittest.mock import patch

import scissordyn as sd
from benchmarks.measure import command, table
from scissordyn.plan import joint_friction

UNITS = (1, 3, 10, 20)
FRICTIONS = {
    "transition 10 mm/s": {"transition": 1e-2},
    "transition 1 mm/s": {"transition": 1e-3},
    "transition 0.1 mm/s": {"transition": 1e-4},
    "bristles 1e5 1/m": {"bristle_stiffness": 1e5},
}
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
    for label, friction in list(FRICTIONS.items())[: 1 if quick else None]:
        crank = sd.slider_crank(crank=0.1, rod=0.3).replace("crank.angular_velocity", 30.0)
        rubbing = sd.with_joint_friction(crank, radius=0.012, kinetic=0.3, **friction)
        counts = []
        for method, most in (("dop853", 0), ("rodas5p", 0), ("rodas5p", joint_friction.COUPLED_STATES_MAX)):
            with patch.object(joint_friction, "COUPLED_STATES_MAX", most):
                batch = sd.simulate_many(rubbing, {"gravity": [9.81]}, until=20.0, method=method, measures=["steps"])
            counts.append(f"{float(batch['steps'][0]):.0f}")
        steps.append((label, *counts))
    return (
        f"{table(('units', 'pins', 'without friction [us]', 'with it [us]'), costs)}\n\n"
        f"{table(('friction', 'dop853 steps', 'rodas5p, constant reactions', 'rodas5p'), steps)}"
    )


if __name__ == "__main__":
    command("joint_friction", measure)
