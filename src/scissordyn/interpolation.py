"""Splines through tables; Gauss nodes and Lagrange polynomials in decimal arithmetic.

Those in decimal arithmetic are rounded once, so that they are equal on every machine.

Eigenvalues, inverses and cosines of NumPy differ in their last digits between processors and versions. Constants of the
compiled library must not differ.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from decimal import Context, Decimal, localcontext
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline, PPoly

EXTENDED = Context(prec=38)  # decimal arithmetic with more than twice the digits of a float


def quintic_spline(places: Sequence[float], values: Sequence[float]) -> PPoly:
    """Return the spline of fifth degree through a table, as pieces of polynomials."""
    from scipy.interpolate import PPoly, make_interp_spline  # imported here: it takes a third of a second

    return PPoly.from_spline(make_interp_spline(places, values, k=5).tck)


def periodic_spline(places: np.ndarray, values: np.ndarray) -> CubicSpline:
    """Return the periodic cubic spline through a table whose first and last values are equal."""
    from scipy.interpolate import CubicSpline  # imported here: it takes a third of a second

    return CubicSpline(places, values, bc_type="periodic")


def gauss_rule(points: int) -> tuple[np.ndarray, np.ndarray]:
    """Return nodes and weights of Gauss-Legendre quadrature on [0, 1], exact up to degree 2 points - 1."""
    nodes, weights = [], []
    with localcontext(EXTENDED):
        for k in range(points):
            # Newton's method from Tricomi's estimate of a root, which has three correct digits; each step doubles their number
            x = Decimal(-math.cos(math.pi * (k + 0.75) / (points + 0.5)))
            for _ in range(5):
                value, slope = _legendre(points, x)
                x -= value / slope
            slope = _legendre(points, x)[1]
            nodes.append((1 + x) / 2)
            weights.append(1 / ((1 - x * x) * slope * slope))
    return np.array(nodes, float), np.array(weights, float)


def _legendre(degree: int, x: Decimal) -> tuple[Decimal, Decimal]:
    """Return the Legendre polynomial and its slope at x in (-1, 1)."""
    before, value = Decimal(1), x
    for n in range(2, degree + 1):
        before, value = value, ((2 * n - 1) * x * value - (n - 1) * before) / n
    return value, degree * (before - x * value) / (1 - x * x)


def lagrange_polynomials(nodes: Iterable[float]) -> list[list[Decimal]]:
    """Return the Lagrange polynomials of some nodes as rows of coefficients of 1, x, x^2, ...; polynomial i is 1 at node i."""
    rows = []
    with localcontext(EXTENDED):
        exact = [Decimal(float(node)) for node in nodes]
        for i, node in enumerate(exact):
            row = [Decimal(1)]
            for other in exact[:i] + exact[i + 1 :]:
                products = zip([Decimal(0), *row], [*row, Decimal(0)], strict=True)
                row = [(lower - other * same) / (node - other) for lower, same in products]
            rows.append(row)
    return rows
