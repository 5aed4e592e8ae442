"""Components: what one costs per evaluation, and a class of the user's own against the same one of the package."""

from __future__ import annotations

import dataclasses
import time
from statistics import median
from typing import Annotated, Any

import scissordyn as sd
from benchmarks.measure import command, table
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.options import Options
from scissordyn.plan.plan import plan
from scissordyn.run.advance.driver import count_steps
from scissordyn.run.advance.loop import advance
from scissordyn.run.trajectory import make_driver

UNTIL = 0.05
COUNTS = (0, 1, 4, 16, 64)


def force(length: Any, rate: Any, stiffness: Any, free_length: Any, damping: Any) -> Any:
    """The formula of the package's own spring."""
    stretch = length - free_length
    return stiffness * stretch + damping * rate, 0.5 * stiffness * stretch**2, damping * rate**2


@sd.component(port="line", force=force, symbol="spring")
class OwnSpring:
    """A spring as a user would write it."""

    name: str
    start: tuple[str, str]
    end: tuple[str, str]
    stiffness: Annotated[float, sd.Quantity("N/m", above=0.0, help="stiffness")]
    free_length: Annotated[float, sd.Quantity("m", minimum=0.0, help="length without force")] = 0.0
    damping: Annotated[float, sd.Quantity("N s/m", minimum=0.0, help="damping")] = 0.0


def with_springs(kind: Any, count: int) -> Mechanism:
    """A driven array of eight units whose free end is held by springs."""
    arm = sd.scissor(units=8, bar_length=0.5, bar_mass=0.2, slider_mass=0.5).driven(speed=sd.rpm(20))
    springs = tuple(
        kind(f"spring {k}", ("unit 8/bar 1", "end"), ("slider", "centre"), 10.0 + k, free_length=1.0, damping=0.1)
        for k in range(count)
    )
    loose = arm.with_clearance("A", sd.Clearance(0.1e-3))
    return dataclasses.replace(loose, components=springs)


def measure(quick: bool = False) -> str:
    """Time per evaluation of the right-hand side over the number of springs."""
    counts, repeats = (COUNTS[:3], 2) if quick else (COUNTS, 21)
    rows = []
    for method in ("dop853", "rodas5p"):
        costs: dict[tuple[str, int], list[float]] = {}
        cases = {(kind.__name__, n): with_springs(kind, n) for kind in (sd.Spring, OwnSpring) for n in counts}
        for turn in range(repeats + 1):
            for key, mechanism in cases.items():
                driver, _, _ = make_driver(plan(mechanism), Options(UNTIL, method=method))
                began = time.process_time()
                advance(driver, UNTIL)
                seconds, done = time.process_time() - began, count_steps(driver.state)
                if turn:
                    costs.setdefault(key, []).append(seconds / (done["rates"] + done["jacobians"]) * 1e9)
        for n in counts:
            spring, own = (costs[kind.__name__, n] for kind in (sd.Spring, OwnSpring))
            ratio = median(b / a for a, b in zip(spring, own, strict=True))
            rows.append((method, str(n), f"{median(spring):.0f}", f"{median(own):.0f}", f"{ratio:.2f}"))
    said = (
        f"Medians of {repeats} alternating runs, array of 8 units with one clearance joint, 50 ms at 1e-8; processor "
        "time of the integration divided by the evaluations of the right-hand side and of the Jacobian.\n"
    )
    return f"{said}\n{table(('method', 'springs', '`Spring` [ns]', 'own class [ns]', 'ratio'), rows)}"


if __name__ == "__main__":
    command("components", measure)
