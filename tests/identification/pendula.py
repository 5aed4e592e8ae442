"""Pendula as cases, and their motions by equations that are not the package's."""

import numpy as np
from scipy.integrate import solve_ivp

# Case file of a pendulum
PENDULUM = """
[structure]
kind = "mechanism"
gravity = "9.81 m/s^2"

[[ground]]
name = "O"
position = "0, 0 m"

[[body]]
name = "arm"
mass = "0.15 kg"
inertia = "0.0006 kg m^2"
points = { pin = "0, 0 m" }
centre = "0.15, 0 m"
position = "0, 0 m"
angle = "-30 deg"

[[joint]]
name = "A"
journal = "arm.pin"
bearing = "ground.O"

[[torsion_spring]]
name = "pivot"
body = "arm"
damping = "0.0005 N m s/rad"

[run]
until = "3 s"
start = "as-placed"
"""

# Case file of a double pendulum
DOUBLE = (
    PENDULUM.replace('points = { pin = "0, 0 m" }', 'points = { pin = "0, 0 m", end = "0.2, 0 m" }').replace(
        "[[joint]]",
        """[[body]]
name = "tip"
mass = "0.1 kg"
inertia = "0.0004 kg m^2"
points = { pin = "0, 0 m" }
centre = "0.1, 0 m"
position = "0.17, -0.1 m"
angle = "-40 deg"

[[joint]]
name = "B"
journal = "tip.pin"
bearing = "arm.end"

[[joint]]""",
        1,
    )
    + """
[[torsion_spring]]
name = "elbow"
body = "tip"
base = "arm"
damping = "0.0001 N m s/rad"
"""
)


def pendulum(times, *, angle, speed=0.0, mass=0.15, centre=0.15, inertia=0.0006, damping=0.0005, gravity=9.81):
    """Return angle from the horizontal x axis and its rate, by (I + m a^2) phi'' = -m g a cos(phi) - d phi'."""

    def rates(_, y):
        return y[1], (-mass * gravity * centre * np.cos(y[0]) - damping * y[1]) / (inertia + mass * centre**2)

    found = solve_ivp(rates, (0.0, times[-1]), (angle, speed), t_eval=times, method="DOP853", rtol=1e-12, atol=1e-12)
    return found.y.T


def double(
    times, state, *, m=(0.15, 0.1), a=(0.15, 0.1), inertia=(0.0006, 0.0004), length=0.2, damping=(0.0005, 0.0001), g=9.81
):
    """Return both angles and their rates, by Lagrange's equations in the two angles."""

    def rates(_, y):
        (p, q), (u, v) = y[:2], y[2:]
        couple, sine = m[1] * length * a[1] * np.cos(p - q), m[1] * length * a[1] * np.sin(p - q)
        matrix = [[inertia[0] + m[0] * a[0] ** 2 + m[1] * length**2, couple], [couple, inertia[1] + m[1] * a[1] ** 2]]
        force = [
            -sine * v**2 - (m[0] * a[0] + m[1] * length) * g * np.cos(p) - damping[0] * u + damping[1] * (v - u),
            sine * u**2 - m[1] * a[1] * g * np.cos(q) - damping[1] * (v - u),
        ]
        return (u, v, *np.linalg.solve(matrix, force))

    found = solve_ivp(rates, (0.0, times[-1]), state, t_eval=times, method="DOP853", rtol=1e-11, atol=1e-11)
    return found.y.T
