"""Simple pendulum (A01)."""

from __future__ import annotations

import math
import time

import numpy as np
import xarray as xr
from numba import njit
from scipy.integrate import solve_ivp

from validation.case import Case, Check, Code, Measured, Model, mechanism, run, timed
from validation.exudyn_model import Settings, limit, positions
from validation.pendulum.exudyn_tree import pendulum
from validation.pendulum.reference import place

__all__ = ["CASE"]

NAME = "pendulum"
UNTIL = 10.0
TIMES = np.linspace(0.0, UNTIL, 101)


def exact() -> np.ndarray:
    """Return the exact positions of the mass at `TIMES` [m]."""
    return np.array([place(t) for t in TIMES])


def checks() -> list[Check]:
    """Check position and energy at a tight tolerance."""
    found = run(NAME, samples=101, rtol=1e-12, atol=1e-12)
    mass = found["position"].sel(body="mass").values
    away = float(np.max(np.abs(mass - exact())))
    energy = float(np.max(np.abs(found["energy_residual"].values)))
    return [
        Check("x at 10 s [m]", float(exact()[-1, 0]), float(mass[-1, 0]), 1e-9, "closed form", relative=False),
        Check("y at 10 s [m]", float(exact()[-1, 1]), float(mass[-1, 1]), 1e-9, "closed form", relative=False),
        Check("largest error of the position in 10 s [m]", 0.0, away, 1e-9, "closed form", relative=False),
        Check("largest change of the energy in 10 s [J]", 0.0, energy, 1e-9, "closed form", relative=False),
    ]


def error(found: xr.Dataset) -> float:
    """Return the largest error of the position of the mass in a run [m]."""
    return float(np.max(np.abs(found["position"].sel(body="mass").values - exact())))


@njit
def swing(t, y):
    """Return the rates of the angle from the downward vertical and of the angular velocity."""
    return np.array([y[1], -9.81 * math.sin(y[0])])


def scipys(method: str, tolerance: float) -> Measured:
    """Run scipy on the equation of the angle."""
    began = time.perf_counter()
    found = solve_ivp(swing, (0.0, UNTIL), (-0.5 * math.pi, 0.0), method=method, t_eval=TIMES, rtol=tolerance, atol=tolerance)
    seconds = time.perf_counter() - began
    made = np.column_stack([np.sin(found.y[0]), -np.cos(found.y[0])])
    return float(np.max(np.abs(made - exact()))), seconds


def exudyns(step: float, **options: object) -> Measured:
    """Run Exudyn's generalised alpha method on the mass and the distance constraint."""
    t, made, seconds = positions(mechanism(NAME), UNTIL, Settings(step, **options), "mass")  # type: ignore[arg-type]
    wanted = np.array([place(float(one)) for one in t[:: max(1, len(t) // 100)]])
    return float(np.max(np.abs(made[:: max(1, len(t) // 100), :2] - wanted))), seconds


def exudyns_tree(tolerance: float) -> Measured:
    """Run Exudyn's DOPRI5 on one angle, at its own instants."""
    t, angle, seconds = pendulum(tolerance, UNTIL)
    some = slice(None, None, max(1, len(t) // 100))
    made = np.column_stack([np.cos(angle[some]), np.sin(angle[some])])
    return float(np.max(np.abs(made - np.array([place(float(one)) for one in t[some]])))), seconds


def models() -> list[Model]:
    """Return the checks of scipy and Exudyn at tight settings and in the limit of short steps."""

    def implicit(**options: object) -> float:
        tends = limit(mechanism(NAME), UNTIL, Settings(1e-3, 1e-11, **options), "mass")  # type: ignore[arg-type]
        return float(np.max(np.abs(tends[:2] - exact()[-1])))

    tight = "closed form, 10 s [m]; tolerance 1e-12"
    short = "closed form, at 10 s [m]; limit of steps of 1 and 0.5 ms"
    return [
        Model("scipy DOP853", tight, lambda: scipys("DOP853", 1e-12)[0], 1e-8),
        Model("scipy LSODA", tight, lambda: scipys("LSODA", 1e-12)[0], 1e-8),
        Model("Exudyn, generalised alpha, index 3", short, implicit, 1e-6, "exudyn"),
        Model("Exudyn, trapezoidal, index 2", short, lambda: implicit(radius=1.0, index2=True), 1e-6, "exudyn"),
        Model("Exudyn DOPRI5, kinematic tree", tight, lambda: exudyns_tree(1e-12)[0], 1e-8, "exudyn"),
    ]


def codes() -> list[Code]:
    """Return the codes at a range of settings."""
    tolerances = (1e-5, 1e-6, 1e-7, 1e-8, 1e-9)
    steps = (1e-2, 3e-3, 1e-3, 3e-4, 1e-4)
    return [
        Code("scissordyn, simulate()", timed(NAME, error, samples=101), tolerances),
        Code("scipy DOP853, compiled equation of the angle", lambda one: scipys("DOP853", one), tolerances),
        Code("scipy LSODA, compiled equation of the angle", lambda one: scipys("LSODA", one), tolerances),
        Code("Exudyn, generalised alpha, index 3", exudyns, steps, "step [s]", 1, "exudyn"),
        Code(
            "Exudyn, trapezoidal, index 2",
            lambda one: exudyns(one, radius=1.0, index2=True),
            steps,
            "step [s]",
            1,
            "exudyn",
        ),
        Code("Exudyn DOPRI5, kinematic tree", exudyns_tree, tolerances, package="exudyn"),
    ]


CASE = Case(NAME, "Simple pendulum (A01)", checks, "largest error of the position in 10 s [m]", 1e-5, codes, models=models)
