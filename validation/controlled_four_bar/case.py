"""Controlled four-bar linkage with three clearance joints and friction, against a published record with rigid contact."""

from __future__ import annotations

import math

import numpy as np

from validation.case import Case, Check, run
from validation.controlled_four_bar.record import ANGLES, ECCENTRICITIES, SPEEDS, TIMES, TORQUES
from validation.controlled_four_bar.steering import law

__all__ = ["CASE"]

NAME = "controlled_four_bar"
AMPLITUDE, FREQUENCY = 6.0, 0.75 * math.pi  # Reference motion of the crank [rad], [rad/s]

JOINTS = ("crank pin", "rocker pin", "rocker bearing")

LATE = 2  # Index of the first instant at which the journals of all joints have settled in contact


def _torque(time: float, angle: float, speed: float) -> float:
    """Return the torque law at a state of the crank."""
    phase = FREQUENCY * time
    wanted = AMPLITUDE * math.sin(phase)
    rate, second = AMPLITUDE * FREQUENCY * math.cos(phase), -wanted * FREQUENCY**2
    return law(wanted, rate, second, wanted - angle, speed, 200.0, 10.0)


def checks() -> list[Check]:
    """Check the torque law at the record's states, and angles and journal positions at its 21 instants."""
    found, soft = run(NAME), run(NAME, *(f"{joint}.stiffness.stiffness=1e6 N/m" for joint in JOINTS))
    given = [_torque(t, a, s) for t, a, s in zip(TIMES, ANGLES[:, 0], SPEEDS, strict=True)]
    missed = float(np.abs(np.array(given) - TORQUES).max())
    made = [
        Check("torque law at the record's states: largest difference [N m]", 0.0, missed, 1e-4, "published", relative=False)
    ]
    angles = np.unwrap(found["angle"].values, axis=0)
    for k, body in enumerate(("crank", "coupler", "rocker")):
        missed = float(np.abs(angles[:, k] - ANGLES[:, k]).max())
        label = f"angle of the {body}: largest difference at 21 instants [rad]"
        made.append(Check(label, 0.0, missed, 5e-4, "published", relative=False))
    missed = float(np.abs(np.unwrap(soft["angle"].values, axis=0) - ANGLES).max())
    label = "angles at a hundredth of the stiffness: largest difference [rad]"
    made.append(Check(label, 0.0, missed, 1e-3, "published", relative=False))
    for k, joint in enumerate(JOINTS):
        places = 1e3 * found["eccentricity"].sel(joint=joint).values
        missed = float(np.linalg.norm(places - ECCENTRICITIES[:, 2 * k : 2 * k + 2], axis=1)[LATE:].max()) / 5.0
        label = f"journal of the {joint}: largest difference of its place from 0.1 s on, in clearances"
        made.append(Check(label, 0.0, missed, 0.1, "published", relative=False))
    for k, body in enumerate(("crank", "coupler", "rocker")):
        label = f"angle of the {body} at 1 s [rad]"
        made.append(Check(label, float(ANGLES[-1, k]), float(angles[-1, k]), 1e-4, "published"))
    return made


CASE = Case(NAME, "Controlled four-bar linkage with three clearance joints", checks, quick=False)
