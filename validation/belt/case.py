"""Stick-slip of a block on a belt with LuGre friction."""

from __future__ import annotations

import functools
import math
import time

import numpy as np
import xarray as xr
from numba import njit
from scipy.integrate import solve_ivp

from validation.case import Case, Check, Code, Measured, Model, run, timed

__all__ = ["CASE"]

NAME = "belt"
UNTIL, SPEED = 25.0, 0.1  # End of the run [s], speed of the belt [m/s]
TIMES = np.linspace(0.0, UNTIL, 2501)


@njit
def pulled(t, y):
    """Return the time derivative of the state of the block: position and speed on the belt, and bristle deflection."""
    x, v, z = y
    g = 1.0 + 0.5 * math.exp(-((v / 1e-3) ** 2))
    bristle = v - 1e5 * abs(v) * z / g
    friction = 1e5 * z + math.sqrt(1e5) * bristle + 0.4 * v
    return np.array([v, 2.0 * (SPEED * t - x) - friction, bristle])


def second(tolerance: float, method: str = "Radau") -> tuple[np.ndarray, float]:
    """Integrate `pulled` by scipy; return positions on the belt at `TIMES` [m] and the computing time [s]."""
    began = time.perf_counter()
    scale = tolerance * np.array([1.0, 1.0, 1e-5])
    found = solve_ivp(pulled, (0.0, UNTIL), np.zeros(3), method, t_eval=TIMES, rtol=tolerance, atol=scale)
    return found.y[0], time.perf_counter() - began


@functools.cache
def exact() -> np.ndarray:
    """Return the reference: positions of the block on the belt at `TIMES` [m]."""
    return second(1e-11)[0]


def on_belt(found: xr.Dataset) -> np.ndarray:
    """Return the position of the block on the belt [m]."""
    return found["position"].sel(body="block", axis="x").values + SPEED * found["time"].values


def slips(place: np.ndarray) -> np.ndarray:
    """Return the times at which the block starts to slip: its speed on the belt rises above 10 mm/s [s]."""
    speed = np.gradient(place, TIMES)
    over = np.flatnonzero((speed[:-1] <= 0.01) & (speed[1:] > 0.01))
    return TIMES[over] + (0.01 - speed[over]) / (speed[over + 1] - speed[over]) * (TIMES[1] - TIMES[0])


def error(found: xr.Dataset) -> float:
    """Return the largest error of the position of the block in a run [m]."""
    return float(np.max(np.abs(on_belt(found) - exact())))


def checks() -> list[Check]:
    """Check the final position, and the period and spring force of the limit cycle."""
    place = on_belt(run(NAME, samples=TIMES.size, rtol=1e-9, atol=1e-9))
    made = [
        Check("place on the belt at 25 s [m]", exact()[-1], place[-1], 1e-7, "second formulation"),
        Check("place on the belt at 25 s [m]", 1.908839199, place[-1], 1e-7, "published"),
    ]
    wanted, got = slips(exact()), slips(place)
    made.append(Check("number of slips", float(wanted.size), float(got.size), 0.0, "second formulation"))
    made.append(
        Check("period of the limit cycle [s]", float(np.diff(wanted)[-1]), float(np.diff(got)[-1]), 1e-5, "second formulation")
    )
    late = TIMES > 10.0
    pull = 2.0 * (SPEED * TIMES - place)[late], 2.0 * (SPEED * TIMES - exact())[late]
    made.append(Check("largest spring force [N]", float(pull[1].max()), float(pull[0].max()), 1e-6, "second formulation"))
    made.append(Check("smallest spring force [N]", float(pull[1].min()), float(pull[0].min()), 1e-6, "second formulation"))
    return made


def scipys(method: str, tolerance: float) -> Measured:
    """Run scipy on the compiled equations."""
    place, seconds = second(tolerance, method)
    return float(np.max(np.abs(place - exact()))), seconds


def models() -> list[Model]:
    """Return the check of scipy against the published position."""

    def off(method: str) -> float:
        return abs(float(second(1e-10, method)[0][-1]) - 1.908839199)

    published = "published place at 25 s [m]; tolerance 1e-10"
    return [Model(f"scipy {method}", published, lambda method=method: off(method), 1e-7) for method in ("Radau", "LSODA")]


def codes() -> list[Code]:
    """Return the codes at a range of settings."""
    tolerances = (1e-4, 1e-5, 1e-6, 1e-7, 1e-8)
    return [
        Code("scissordyn, simulate()", timed(NAME, error, samples=TIMES.size), tolerances),
        Code("scipy Radau, compiled equations", lambda one: scipys("Radau", one), tolerances),
        Code("scipy LSODA, compiled equations", lambda one: scipys("LSODA", one), tolerances),
    ]


CASE = Case(
    NAME, "Block on a belt with LuGre friction", checks, "largest error of the place in 25 s [m]", 1e-5, codes, models=models
)
