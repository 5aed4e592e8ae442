"""Sliding box that friction stops."""

from __future__ import annotations

import numpy as np

from validation.case import Case, Check, run

__all__ = ["CASE"]

NAME = "sliding"
FRICTION, G, SPEED = 0.2, 9.81, 1.0  # Friction coefficient, gravity [m/s^2], speed at the start [m/s]


def checks() -> list[Check]:
    """Check the momentum while it slides, the position where it stops, and the energy."""
    found = run(NAME, samples=701, rtol=1e-10, atol=1e-10)
    velocity = found["velocity"].sel(body="box").values
    time = found["time"].values
    sliding = time < 0.5
    missing = np.abs(velocity[:, 0] + FRICTION * (velocity[:, 1] + G * time) - SPEED)[sliding]
    place = float(found["position"].sel(body="box", axis="x")[-1])
    return [
        Check(
            "largest error of the momentum over the mass while it slides [m/s]",
            0.0,
            float(np.max(missing)),
            1e-12,
            "closed form",
            relative=False,
        ),
        Check("speed at 0.5 s [m/s]", SPEED - FRICTION * G * 0.5, float(velocity[500, 0]), 1e-8, "closed form"),
        Check("where it stops [m]", SPEED**2 / (2.0 * FRICTION * G), place, 1e-8, "closed form"),
        Check("speed at 0.7 s [m/s]", 0.0, float(velocity[-1, 0]), 1e-12, "closed form", relative=False),
        Check("energy lost by friction [J]", SPEED**2, float(found["friction_loss"][-1]), 1e-4, "closed form"),
    ]


CASE = Case(NAME, "Sliding box", checks)
