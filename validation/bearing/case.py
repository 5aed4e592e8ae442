"""Loaded shaft in an oil film."""

from __future__ import annotations

import functools
import math
import time
from dataclasses import replace

import numpy as np
import xarray as xr
from numba import njit
from scipy.integrate import quad, solve_ivp

import scissordyn as sd
from scissordyn.components.film.film import FIRST_TABLE_VALUE, Film, force
from scissordyn.components.film.impedance import finite_table, looked_up
from validation.case import Case, Check, Code, Measured, Model, mechanism, run, timed

__all__ = ["CASE"]

NAME = "bearing"
UNTIL, SPEED = 0.2, 20.0 * math.pi  # End of the run [s], angular velocity of the shaft [rad/s]
MASS, VISCOSITY, CLEARANCE, RADIUS, LENGTH = 457.11, 0.05, 4e-5, 0.02, 0.04  # [kg], [Pa s], [m], [m], [m]
TIMES = np.linspace(0.0, UNTIL, 401)
POINTS, WEIGHTS = np.polynomial.legendre.leggauss(64)  # Gauss points and weights on the interval from -1 to 1
SOMMERFELD = ((0.2, 0.631), (0.6, 0.121), (0.8, 0.0446), (0.9, 0.0188))  # Eccentricity ratios, published Sommerfeld numbers
ROUGH = 1e-7 / CLEARANCE  # Roughness divided by the clearance


@njit
def falling(t, y):
    """Return the time derivative of the state of the shaft: x, y and their rates.

    Ocvirk's pressure over the half where the film is squeezed is integrated by Gauss' rule.
    """
    ex, ey = y[0] / CLEARANCE, y[1] / CLEARANCE
    a = 2.0 * y[2] / CLEARANCE + SPEED * ey
    b = 2.0 * y[3] / CLEARANCE - SPEED * ex
    # thickness c (1 - ex cos p - ey sin p) at the angle p from x; the film is squeezed where a cos p + b sin p > 0
    middle = math.atan2(b, a)
    gap = 1.0 - math.sqrt(ex * ex + ey * ey)
    x = max(gap, 0.0) / ROUGH
    least = ROUGH * (0.5 * x * math.erfc(-x / math.sqrt(2.0)) + math.exp(-0.5 * x * x) / math.sqrt(2.0 * math.pi))
    size = math.sqrt(ex * ex + ey * ey)
    shrunk = (1.0 - least) / size if size > 0.0 else 1.0
    fx = fy = 0.0
    for panel in range(4):
        for k in range(POINTS.size):
            p = middle - 0.5 * math.pi + 0.25 * math.pi * (panel + 0.5 * (1.0 + POINTS[k]))
            h = 1.0 - shrunk * (ex * math.cos(p) + ey * math.sin(p))
            pressed = a * math.cos(p) + b * math.sin(p)
            # mean over the length of 3 mu (L/D)^2 ... (1 - zeta^2)
            mean = 2.0 * (0.5 * LENGTH / RADIUS) ** 2 * pressed / h**3
            weight = 0.125 * math.pi * WEIGHTS[k] * mean
            fx -= weight * math.cos(p)
            fy -= weight * math.sin(p)
    scale = VISCOSITY * RADIUS * LENGTH * (RADIUS / CLEARANCE) ** 2 / MASS
    return np.array([y[2], y[3], scale * fx, scale * fy - 9.81])


def second(tolerance: float, method: str = "Radau") -> tuple[np.ndarray, float]:
    """Integrate `falling` by scipy; return the positions at `TIMES` [m] and the computing time [s]."""
    began = time.perf_counter()
    scale = tolerance * np.array([1e-4, 1e-4, 1e-1, 1e-1])
    found = solve_ivp(falling, (0.0, UNTIL), np.zeros(4), method, t_eval=TIMES, rtol=tolerance, atol=scale)
    return found.y[:2].T, time.perf_counter() - began


@functools.cache
def exact() -> np.ndarray:
    """Return the reference: positions of the shaft at `TIMES` [m]."""
    return second(1e-11)[0]


def error(found: xr.Dataset) -> float:
    """Return the largest error of the position of the shaft in a run [m]."""
    return float(np.max(np.abs(found["film_displacement"].values[:, 0] - exact())))


def film(model: str, **given: object) -> Film:
    """Return the film of the case with smooth surfaces."""
    ends = ("ground", "O"), ("shaft", "centre")
    return Film("film", *ends, VISCOSITY, CLEARANCE, RADIUS, LENGTH, 1e-12, model=model, **given)  # type: ignore[arg-type]


def acting(one: Film, place: float, rate: float, speed: float) -> tuple[float, float]:
    """Return the forces of a film along and across the eccentricity [N], for the eccentricity `place` [m] and its `rate`."""
    numbers = one.parameters((0.0, 0.0, 0.0))
    found = getattr(force, "py_func", force)(
        place, 0.0, 0.0, rate, 0.0, speed, 0.0, *numbers[:FIRST_TABLE_VALUE], np.array(numbers)
    )
    return float(found[0]), float(found[1])


def squeeze(model: str, last: float, load: float = 1000.0) -> tuple[float, float]:
    """Return the squeeze time from the centre to the eccentricity ratio `last`, by closed form and by the film force [s]."""
    one = film(model, full=True)
    found = quad(lambda e: -acting(one, e * CLEARANCE, CLEARANCE, 0.0)[0] / load, 0.0, last, epsrel=1e-12, limit=200)[0]
    short = model == "short"
    factor = math.pi * RADIUS * LENGTH**3 if short else 12.0 * math.pi * LENGTH * RADIUS**3
    return factor * VISCOSITY / (CLEARANCE**2 * load) * last / (1.0 - last**2) ** (1.5 if short else 0.5), found


def checks() -> list[Check]:
    """Check wedge, squeeze, Sommerfeld numbers, the fall of the shaft, its final position and the energy balance."""
    e, made = 0.6, []
    scale = 6.0 * VISCOSITY * SPEED * RADIUS * LENGTH * (RADIUS / CLEARANCE) ** 2
    radial, tangential = acting(film("long"), e * CLEARANCE, 0.0, SPEED)
    wedge = 2.0 * e * e / ((2.0 + e * e) * (1.0 - e * e)), math.pi * e / ((2.0 + e * e) * math.sqrt(1.0 - e * e))
    made.append(Check("wedge of a long bearing at e = 0.6, along e [N]", -scale * wedge[0], radial, 1e-9, "closed form"))
    made.append(Check("the same across e [N]", scale * wedge[1], tangential, 1e-9, "closed form"))
    for model in ("short", "long"):
        wanted, found = squeeze(model, 0.9)
        made.append(Check(f"squeeze of a {model} bearing from the centre to e = 0.9 [s]", wanted, found, 1e-8, "closed form"))
    for e, published in SOMMERFELD:
        along, across, _ = looked_up(finite_table(1.0), e, 0.5 * math.pi)
        number = 1.0 / (math.pi * e * math.hypot(along, across))
        made.append(Check(f"Sommerfeld number at e = {e:g}, L/D = 1", published, number, 0.015, "published"))
    found = run(NAME, samples=TIMES.size, rtol=1e-10, atol=1e-10)
    made.append(
        Check("largest error of the place in 0.2 s [m]", 0.0, error(found), 1e-11, "second formulation", relative=False)
    )
    balance = float(np.abs(found["energy_residual"]).max() / np.abs(found["drive_work"]).max())
    made.append(Check("energy balance over the work of the drive", 0.0, balance, 1e-8, "closed form", relative=False))
    arm = mechanism(NAME)
    joint = arm.joint("bearing").clearance
    assert joint is not None
    assert joint.lubrication is not None
    finite = arm.with_clearance("bearing", replace(joint, lubrication=replace(joint.lubrication, bearing="finite")))
    x, y = sd.simulate(finite, until=0.6, samples=61)["film_displacement"].values[-1, 0] / CLEARANCE
    made.append(Check("eccentricity at rest, finite film", 0.8, math.hypot(x, y), 0.01, "published"))
    return made


def models() -> list[Model]:
    """Return scipy's check by another method."""

    def off(method: str) -> float:
        return float(np.max(np.abs(second(1e-9, method)[0] - exact())))

    return [Model("scipy LSODA", "place of the shaft [m]; tolerance 1e-9", lambda: off("LSODA"), 1e-11)]


def codes() -> list[Code]:
    """Return the codes at a range of settings."""
    tolerances = (1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9)
    return [
        Code("scissordyn, simulate()", timed(NAME, error, samples=TIMES.size), tolerances),
        Code("scipy Radau, compiled equations", lambda one: scipys("Radau", one), tolerances),
        Code("scipy LSODA, compiled equations", lambda one: scipys("LSODA", one), tolerances),
    ]


def scipys(method: str, tolerance: float) -> Measured:
    """Run scipy on the compiled equations."""
    place, seconds = second(tolerance, method)
    return float(np.max(np.abs(place - exact()))), seconds


CASE = Case(NAME, "Loaded shaft in an oil film", checks, "largest error of the place in 0.2 s [m]", 1e-9, codes, models=models)
