"""Compute Lyapunov exponents of systems whose largest exponent is known."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import xarray as xr

from benchmarks.measure import command, table
from scissordyn.analysis.lyapunov import largest_exponent, largest_exponent_map

__all__ = ["KNOWN", "henon", "logistic", "lorenz", "measure"]

KNOWN = {"logistic": math.log(2.0), "henon": 0.41934, "lorenz": 0.9056}
"""Largest exponents per step, per step and per second: closed form, tables, Viswanath 1998."""


def _starts(shape: tuple[int, int], low: float, high: float) -> np.ndarray:
    return np.random.default_rng(1).uniform(low, high, shape)


def logistic(variational: bool) -> xr.Dataset:
    """Return exponents of the logistic map at r = 4 over 10 000 steps."""
    slope = (lambda x: np.array([4.0 - 8.0 * x])) if variational else None
    return largest_exponent_map(lambda x: 4.0 * x * (1.0 - x), slope, [0.3], steps=10_000)


def henon(variational: bool) -> xr.Dataset:
    """Return exponents of the Henon map (1.4, 0.3) over 3000 steps from each of 100 starts."""

    def tangent(x: np.ndarray) -> np.ndarray:
        one, nil = np.ones_like(x[0]), np.zeros_like(x[0])
        return np.array([[-2.8 * x[0], one], [0.3 * one, nil]])

    return largest_exponent_map(
        lambda x: np.stack([1.0 - 1.4 * x[0] ** 2 + x[1], 0.3 * x[0]]),
        tangent if variational else None,
        _starts((2, 100), -0.1, 0.1),
        steps=3000,
    )


def lorenz(variational: bool) -> xr.Dataset:
    """Return exponents of the Lorenz equations (10, 28, 8/3) over 100 s from each of 128 starts, after 20 s."""

    def rate(_: float, x: np.ndarray) -> np.ndarray:
        return np.stack([10.0 * (x[1] - x[0]), x[0] * (28.0 - x[2]) - x[1], x[0] * x[1] - 8.0 / 3.0 * x[2]])

    def tangent(_: float, x: np.ndarray) -> np.ndarray:
        one, nil = np.ones_like(x[0]), np.zeros_like(x[0])
        return np.array([[-10.0 * one, 10.0 * one, nil], [28.0 - x[2], -one, -x[0]], [x[1], x[0], -8.0 / 3.0 * one]])

    return largest_exponent(
        rate,
        np.array([[0.0], [0.0], [25.0]]) + _starts((3, 128), -8.0, 8.0),
        interval=1.0,
        intervals=120,
        jacobian=tangent if variational else None,
        discard=20,
        rtol=1e-7,
        atol=1e-7,
    )


SYSTEMS: dict[str, tuple[str, Callable[[bool], xr.Dataset]]] = {
    "logistic": ("logistic map, r = 4, 10⁴ steps", logistic),
    "henon": ("Hénon map (1.4, 0.3), 100 starts × 3000 steps", henon),
    "lorenz": ("Lorenz (10, 28, 8/3), 128 starts × 100 s", lorenz),
}


def measure(quick: bool = False) -> str:
    """Return the table; `quick` leaves out the differential equation."""
    rows = []
    for key, (name, compute) in SYSTEMS.items():
        if quick and key == "lorenz":
            continue
        for variational in (True, False):
            found = compute(variational)
            exponent, error = float(found["exponent"]), float(found["standard_error"])
            way = "variational" if variational else "two trajectories"
            numbers = [f"{KNOWN[key]:.5f}", f"{exponent:.5f} ± {error:.5f}", f"{exponent / KNOWN[key] - 1.0:+.2%}"]
            rows.append([f"{name}, {way}", *numbers])
    return table(("system", "known", "measured", "relative"), rows)


if __name__ == "__main__":
    command("exponents", measure)
