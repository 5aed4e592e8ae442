"""Scissor arrays with ideal joints against closed forms."""

from __future__ import annotations

import math

from validation.case import Case, Check, mechanism, run

__all__ = ["CASE"]

NAME = "array"
L, M, SLIDER, G = 2.0, 5.68, 5.0, 9.81  # Length [m] and mass [kg] of a bar, mass of the slider [kg], gravity [m/s^2]
SPEED, START, UNTIL = 5.0 * math.pi, math.pi / 6.0, 0.02  # Speed [rad/s] and start angle [rad] of the bars, end of the run [s]


def checks() -> list[Check]:
    """Check torques of several lengths, a reaction of two units, and the position of the outer pins."""
    angle = START + SPEED * UNTIL
    made = []
    for units in (2, 10, 100):
        found = run(NAME, f"structure.units={units}")
        count = (units - 1) * units * (units + 1) / 3
        torque = SPEED**2 * L**2 * (M * count - 0.5 * SLIDER) * math.sin(2 * angle)
        torque += (units * M + SLIDER) * G * L * math.cos(angle)
        got = float(found["drive_torque"][-1])
        made.append(Check(f"N = {units}: torque at 20 ms [N m]", torque, got, 1e-9, "closed form"))
        far = max(float(found["position"].sel(body=f"unit {units}/bar {k}", axis="x")[-1]) for k in (1, 2))
        made.append(
            Check(f"N = {units}: pivot of the last unit [m]", (units - 0.5) * L * math.cos(angle), far, 1e-10, "closed form")
        )
    force = run(NAME)["reaction"].sel(joint="A")
    y = -SLIDER * (G - L * SPEED**2 * math.sin(angle))
    x = ((4 * M - SLIDER) * L * SPEED**2 * math.sin(angle) + (SLIDER - 2 * M) * G) / math.tan(angle)
    made.append(Check("N = 2: force on the journal along x at 20 ms [N]", x, float(force[-1, 0]), 1e-9, "closed form"))
    made.append(Check("N = 2: force on the journal along y at 20 ms [N]", y, float(force[-1, 1]), 1e-9, "closed form"))
    joints = len(mechanism(NAME, "structure.units=100").joints)
    made.append(Check("N = 100: number of revolute joints", 3 * 100, float(joints), 0.0, "closed form"))
    return made


CASE = Case(NAME, "Scissor arrays", checks)
