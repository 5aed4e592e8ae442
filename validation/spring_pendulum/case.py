"""Spring pendulum against polar coordinates."""

from __future__ import annotations

import math
import time
from functools import cache

import numpy as np
import xarray as xr
from numba import njit
from scipy.integrate import solve_ivp

from validation.case import Case, Check, Code, Measured, Model, run, timed

__all__ = ["CASE"]

NAME = "spring_pendulum"
UNTIL = 10.0
TIMES = np.linspace(0.0, UNTIL, 201)
K, FREE, G = 100.0, 1.0, 9.81  # Stiffness [N/m] and free length [m] of the spring, gravity [m/s^2]


@njit
def polar(t, y):
    """Return the rates of length, angle from the downward vertical, and their velocities, of a mass of 1 kg."""
    r, angle, stretch, turn = y
    return np.array(
        [
            stretch,
            turn,
            r * turn**2 + G * math.cos(angle) - K * (r - FREE),
            (-G * math.sin(angle) - 2.0 * stretch * turn) / r,
        ]
    )


def second(tolerance: float, method: str = "DOP853") -> tuple[np.ndarray, float]:
    """Integrate `polar` by scipy; return the positions at `TIMES` [m] and the computing time [s]."""
    began = time.perf_counter()
    start = (1.2, 0.5 * math.pi, 0.0, 0.0)
    found = solve_ivp(polar, (0.0, UNTIL), start, method, t_eval=TIMES, rtol=tolerance, atol=tolerance)
    seconds = time.perf_counter() - began
    return np.column_stack([found.y[0] * np.sin(found.y[1]), -found.y[0] * np.cos(found.y[1])]), seconds


@cache
def exact() -> np.ndarray:
    """Return the exact positions at `TIMES` [m]; the first call compiles `polar`."""
    return second(1e-13)[0]


def error(found: xr.Dataset) -> float:
    """Return the largest error of the position of the mass in a run [m]."""
    return float(np.max(np.abs(found["position"].sel(body="mass").values - exact())))


def checks() -> list[Check]:
    """Check position and energy at a tight tolerance."""
    found = run(NAME, samples=TIMES.size, rtol=1e-13, atol=1e-13)
    mass = found["position"].sel(body="mass").values
    energy = float(np.max(np.abs(found["energy_residual"].values)))
    return [
        Check("x at 10 s [m]", exact()[-1, 0], mass[-1, 0], 1e-8, "second formulation", relative=False),
        Check("y at 10 s [m]", exact()[-1, 1], mass[-1, 1], 1e-8, "second formulation", relative=False),
        Check("largest error of the position in 10 s [m]", 0.0, error(found), 1e-8, "second formulation", relative=False),
        Check("largest change of the energy in 10 s [J]", 0.0, energy, 1e-10, "closed form", relative=False),
    ]


def scipys(method: str, tolerance: float) -> Measured:
    """Run scipy on polar coordinates."""
    made, seconds = second(tolerance, method)
    return float(np.max(np.abs(made - exact()))), seconds


def models() -> list[Model]:
    """Return the checks of scipy at tight tolerances: the two methods against each other, and the energy of the reference."""

    def energy() -> float:
        start = np.array([1.2, 0.5 * math.pi, 0.0, 0.0])
        found = solve_ivp(polar, (0.0, UNTIL), start, "DOP853", rtol=1e-13, atol=1e-13)
        r, angle, stretch, turn = found.y
        total = 0.5 * (stretch**2 + (r * turn) ** 2) - G * r * np.cos(angle) + 0.5 * K * (r - FREE) ** 2
        return float(np.max(np.abs(total - total[0])))

    return [
        Model("scipy DOP853", "closed form, largest change of the energy [J]; tolerance 1e-13", energy, 1e-9),
        Model("scipy LSODA", "DOP853 at 1e-13, 10 s [m]; tolerance 1e-12", lambda: scipys("LSODA", 1e-12)[0], 1e-8),
    ]


def codes() -> list[Code]:
    """Return the codes at a range of settings."""
    tolerances = (1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10)
    return [
        Code("scissordyn, simulate()", timed(NAME, error, samples=TIMES.size), tolerances),
        Code("scipy DOP853, compiled polar coordinates", lambda one: scipys("DOP853", one), tolerances),
        Code("scipy LSODA, compiled polar coordinates", lambda one: scipys("LSODA", one), tolerances),
    ]


CASE = Case(NAME, "Spring pendulum", checks, "largest error of the position in 10 s [m]", 1e-5, codes, models=models)
