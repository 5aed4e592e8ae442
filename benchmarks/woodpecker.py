"""Compare the descent of the woodpecker toy with several kinds of contact from one start.

Command: ``python -m benchmarks.woodpecker``.
"""

from __future__ import annotations

import dataclasses
import sys
from pathlib import Path
from typing import Any

import numpy as np

import scissordyn as sd

UNTIL, STEP = 3.0, 1e-5  # End of the runs [s], of which the last second is measured, and the step of time stepping [s]


def changed(mechanism: sd.Mechanism, **fields: Any) -> sd.Mechanism:
    """Return the toy with other contacts; the sleeve has hardly any restitution, the beak 0.5."""
    for guide in mechanism.guides:
        assert guide.clearance is not None
        mechanism = mechanism.with_clearance(guide.name, dataclasses.replace(guide.clearance, **fields))
    return mechanism


def hard(mechanism: sd.Mechanism) -> sd.Mechanism:
    """Return the toy with hard contacts."""
    for guide, restitution in zip(mechanism.guides, (0.001, 0.5), strict=True):
        assert guide.clearance is not None
        friction = sd.law("friction", "coulomb")(kinetic=0.3)
        own = {"contact": "hard", "damping": sd.Flores(restitution=restitution), "friction": friction, "stiffness": sd.Hertz()}
        mechanism = mechanism.with_clearance(guide.name, dataclasses.replace(guide.clearance, **own))  # type: ignore[arg-type]
    return mechanism


def descent(mechanism: sd.Mechanism, **options: Any) -> float:
    """Return the mean speed of the descent in the last second [mm/s]."""
    run = sd.simulate(mechanism, until=UNTIL, start="as-placed", samples=301, **options)
    height = run["position"].sel(body="sleeve", axis="y").values
    return 1e3 * float(height[200] - height[300])


def main() -> None:
    """Print the speeds."""
    sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))
    from reference.woodpecker import march

    toy = sd.zoo["woodpecker"].mechanism
    softer = changed(toy, stiffness=sd.law("stiffness", "linear")(1e5))
    sleeve = softer.guides[0].clearance
    assert sleeve is not None
    softer = softer.with_clearance("pole", dataclasses.replace(sleeve, damping=sd.law("damping", "kelvin-voigt")(5.0)))
    print(f"corners of 1e6 N/m: {descent(toy):.0f} mm/s")
    print(f"corners of 1e5 N/m: {descent(softer):.0f} mm/s")
    print(f"hard contacts, step of {1e6 * STEP:g} us: {descent(hard(toy), step=STEP):.0f} mm/s")
    heights, _ = march(np.zeros(3), np.array([-0.34, 0.0, -7.5]), STEP, UNTIL, np.full(3, 0.3))
    print(f"Moreau's time stepping in Glocker's coordinates: {1e3 * (heights[2 * (len(heights) // 3)] - heights[-1]):.0f} mm/s")


if __name__ == "__main__":
    main()
