"""Andrews' squeezing mechanism (A03)."""

from __future__ import annotations

import functools
import time

import numpy as np
import xarray as xr
from numba import njit
from scipy.integrate import solve_ivp

from validation.case import Case, Check, Code, Measured, Model, mechanism, run, timed
from validation.exudyn_model import Settings, limit, positions
from validation.squeezer.reference import START, TEST_SET, angles, rate

__all__ = ["CASE"]

NAME = "squeezer"
UNTIL = 0.05
SAMPLES = 101  # Number of instants at which angles are compared
NAMES = ("beta", "Theta", "gamma", "Phi", "delta", "Omega", "epsilon")  # Angles of the second formulation


compiled = njit(rate)  # Right-hand side of the second formulation for scipy, compiled at the first call


@functools.cache
def exact() -> np.ndarray:
    """Return the angles of the second formulation at the samples."""
    return angles(np.linspace(0.0, UNTIL, SAMPLES))


def relative(found: xr.Dataset) -> np.ndarray:
    """Return the angles `NAMES` in a run, computed from the directions of the bodies [rad]."""
    k = {f"K{one}": found["angle"].sel(body=f"K{one}").values for one in range(1, 8)}
    return np.column_stack([k["K1"], k["K2"] - k["K1"], k["K3"], k["K4"] - k["K5"], k["K5"], k["K6"] - k["K7"], k["K7"]])


def checks() -> list[Check]:
    """Check angles at 0.03 s against published ones, and at 0.05 s against the second formulation."""
    found = run(NAME, samples=SAMPLES, rtol=1e-12, atol=1e-12)
    made = relative(found)
    at = 60  # 0.03 s
    published = [
        Check(f"{name} at 0.03 s [rad]", TEST_SET[k], made[at, k], 5e-9, "published", relative=False)
        for k, name in enumerate(NAMES)
    ]
    second = [
        Check(f"{name} at 0.05 s [rad]", exact()[-1, k], made[-1, k], 5e-9, "second formulation", relative=False)
        for k, name in enumerate(NAMES)
    ]
    energy = float(np.max(np.abs(found["energy_residual"].values)))
    return [*published, *second, Check("error of the energy balance [J]", 0.0, energy, 1e-9, "closed form", relative=False)]


def error(found: xr.Dataset) -> float:
    """Return the largest error of the crank's angle [rad]."""
    return float(np.max(np.abs(relative(found)[:, 0] - exact()[:, 0])))


def scipys(method: str, tolerance: float) -> Measured:
    """Run scipy on the compiled second formulation."""
    began = time.perf_counter()
    times = np.linspace(0.0, UNTIL, SAMPLES)
    start = np.concatenate([START, np.zeros(7)])
    found = solve_ivp(compiled, (0.0, UNTIL), start, method, t_eval=times, rtol=tolerance, atol=tolerance)
    seconds = time.perf_counter() - began
    return float(np.max(np.abs(found.y[0] - exact()[:, 0]))), seconds


def exudyns(step: float, **options: object) -> Measured:
    """Run Exudyn on bodies and pins."""
    t, made, seconds = positions(mechanism(NAME), UNTIL, Settings(step, **options), "K1")  # type: ignore[arg-type]
    wanted = np.linspace(0.0, UNTIL, SAMPLES)
    turned = made[np.searchsorted(t, wanted - 0.5 * (t[1] - t[0])), 2]
    return float(np.max(np.abs(turned - exact()[:, 0]))), seconds


def models() -> list[Model]:
    """Return the checks of scipy against the published angle, and of Exudyn in the limit of short steps."""

    def published(method: str, tolerance: float) -> float:
        start = np.concatenate([START, np.zeros(7)])
        found = solve_ivp(compiled, (0.0, 0.03), start, method, rtol=tolerance, atol=tolerance)
        return float(np.max(np.abs(found.y[:7, -1] - TEST_SET)))

    def tends(**options: object) -> float:
        crank = limit(mechanism(NAME), UNTIL, Settings(5e-6, 1e-11, **options), "K1")  # type: ignore[arg-type]
        return abs(float(crank[2] - exact()[-1, 0]))

    test_set = "published angles at 0.03 s [rad]; tolerance "
    short = "second formulation, crank's angle at 0.05 s [rad]; limit of steps of 5 and 2.5 \u00b5s"
    return [
        Model("scipy DOP853", f"{test_set}1e-11", lambda: published("DOP853", 1e-11), 1e-8),
        Model("scipy Radau", f"{test_set}1e-9", lambda: published("Radau", 1e-9), 1e-7),
        Model("Exudyn, generalised alpha, index 3", short, tends, 1e-6, "exudyn"),
        Model("Exudyn, trapezoidal, index 2", short, lambda: tends(radius=1.0, index2=True), 1e-6, "exudyn"),
    ]


def codes() -> list[Code]:
    """Return the codes at a range of settings."""
    tolerances = (1e-5, 1e-6, 1e-7, 1e-8, 1e-9)
    steps = (1e-4, 5e-5, 2.5e-5, 1.25e-5, 5e-6, 2.5e-6)
    return [
        Code("scissordyn, simulate()", timed(NAME, error, samples=SAMPLES), tolerances),
        Code("scipy DOP853, compiled equations of seven angles", lambda one: scipys("DOP853", one), tolerances),
        Code("scipy Radau, compiled equations of seven angles", lambda one: scipys("Radau", one), tolerances[:3]),
        Code("Exudyn, generalised alpha, index 3", exudyns, steps, "step [s]", 1, "exudyn"),
        Code(
            "Exudyn, trapezoidal, index 2",
            lambda one: exudyns(one, radius=1.0, index2=True),
            steps,
            "step [s]",
            1,
            "exudyn",
        ),
    ]


CASE = Case(
    NAME,
    "Andrews' squeezing mechanism (A03)",
    checks,
    "largest error of the crank's angle in 0.05 s [rad]",
    1e-4,
    codes,
    models=models,
)
