"""Impedances of journal bearings: of short and long ones by their integrals, of finite ones by a table.

With V the size of the velocity 2 e'/c - w x e/c (e the journal's place, w its angular speed, both as the bearing sees
them), and psi its direction from e, the film exerts mu R L (R/c)^2 V (radial, tangential) on the journal.
"""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path

import numpy as np

from scissordyn.component.film.grid import (
    DIRECTIONS,
    GAPS,
    NEAREST,
    POWERS,
    SHARP,
    WIDEST,
    directions,
    eccentricities,
    steepness,
)
from scissordyn.jit import kernel

__all__ = ["finite_table", "long_bearing", "looked_up", "pressure_table", "short_bearing"]

TABLE = Path(__file__).parent / "finite.npz"

ROOT = math.sqrt(NEAREST)

POINTS, WEIGHTS = np.polynomial.legendre.leggauss(24)
_POWERS = POWERS
_POINTS, _WEIGHTS = tuple(POINTS.tolist()), tuple(WEIGHTS.tolist())


@kernel()
def sommerfeld_angle(eccentricity, sine, cosine):
    """The angle s with cos s = (e + cos theta)/(1 + e cos theta), from -pi to pi."""
    return math.atan2(math.sqrt(1.0 - eccentricity * eccentricity) * sine, eccentricity + cosine)


@kernel()
def short_bearing(eccentricity, sine, cosine, full):
    """Impedance of a short bearing (Ocvirk) over (L/D)^2, for the direction psi by its sine and cosine.

    The pressure is positive on the half where cos(theta - psi) < 0; with `full`, both halves count. The integrals over cos^2,
    sin^2 and their product over H^3 are those of trigonometric polynomials in Sommerfeld's angle (Booker 1965).
    """
    e = eccentricity
    root = math.sqrt(1.0 - e * e)
    if full:
        first, last = -math.pi, math.pi
    else:
        first = sommerfeld_angle(e, cosine, -sine)  # psi + 90 deg
        last = sommerfeld_angle(e, -cosine, sine)
        if last < first:
            last += 2.0 * math.pi
    s1, c1, s2, c2 = math.sin(first), math.cos(first), math.sin(last), math.cos(last)
    angle = last - first
    both = (0.5 + e * e) * angle + 0.5 * (s2 * c2 - s1 * c1) - 2.0 * e * (s2 - s1)
    across = (1.0 - e * e) * (0.5 * angle - 0.5 * (s2 * c2 - s1 * c1))
    mixed = root * (0.5 * (s2 * s2 - s1 * s1) + e * (c2 - c1))
    factor = -2.0 / root**5
    return factor * (cosine * both + sine * mixed), factor * (cosine * mixed + sine * across)


@kernel()
def long_pressure(e, sine, cosine, s, c):
    """Pressure of a long bearing at theta by its sine and cosine, 0 at theta = 0 (Sommerfeld 1904; squeeze beside it)."""
    h = 1.0 + e * c
    wedge = -sine * s * (2.0 + e * c) / (2.0 + e * e)
    squeeze = 0.5 * cosine * (1.0 - c) * (2.0 + e + e * c) / ((1.0 + e) * (1.0 + e))
    return 6.0 * (wedge + squeeze) / (h * h)


@kernel()
def long_end(e, sine, cosine):
    """Where the pressure that begins at theta = 0 ends: t = tan(theta/2), the root of a cubic, by bisection.

    For sin psi <= 0 the film lies between theta = 0 and that root, over the thin side where it is approached.
    """
    a, b = cosine / ((1.0 + e) * (1.0 + e)), sine / (2.0 + e * e)
    # over x = atan t, from -pi/2 to pi/2: multiplied by cos^3
    low, high = (-0.5 * math.pi, 0.0) if cosine > 0.0 else (0.0, 0.5 * math.pi)
    for _ in range(60):
        middle = 0.5 * (low + high)
        s, c = math.sin(middle), math.cos(middle)
        value = a * s * (s * s + (1.0 + e) * c * c) - b * c * ((2.0 - e) * s * s + (2.0 + e) * c * c)
        if (value > 0.0) == (cosine > 0.0):
            high = middle
        else:
            low = middle
    return 0.5 * (low + high)


@kernel()
def long_bearing(eccentricity, sine, cosine, full):
    """Impedance of a long bearing, for the direction psi by its sine and cosine, its pressure integrated by Gauss' rule.

    The pressure counts where it is positive (Guembel), with `full` everywhere.
    """
    e, side = eccentricity, 1.0
    if sine > 0.0:
        sine, side = -sine, -1.0
    root = math.sqrt(1.0 - e * e)
    last = 2.0 * math.pi
    if not full:
        half = long_end(e, sine, cosine)
        theta = 2.0 * half
        last = sommerfeld_angle(e, math.sin(theta), math.cos(theta))
        if last <= 0.0:
            last += 2.0 * math.pi
    radial = tangential = 0.0
    panels = 2
    for panel in range(panels):
        low, wide = last * panel / panels, last / panels
        for k in range(24):
            s = low + 0.5 * wide * (1.0 + _POINTS[k])
            below = 1.0 - e * math.cos(s)
            c, q = (math.cos(s) - e) / below, root * math.sin(s) / below
            weight = 0.5 * wide * _WEIGHTS[k] * root / below * long_pressure(e, sine, cosine, q, c)
            radial += weight * c
            tangential += weight * q
    return radial, side * tangential


@kernel()
def cubic(f, a, b, c, d):
    """Between b and c at f in (0, 1): through both, with slopes that continue (Catmull and Rom)."""
    return b + 0.5 * f * (c - a + f * (2.0 * a - 5.0 * b + 4.0 * c - d + f * (3.0 * (b - c) + d - a)))


@kernel()
def at_node(table, first, which, row, column):
    """A number of the table, beyond its edges continued: by symmetry in psi, along a parabola in the film thickness."""
    sign = 1.0
    if column < 0:
        column = -column
        sign = -1.0 if which == 1 else 1.0
    elif column >= DIRECTIONS:
        column = 2 * (DIRECTIONS - 1) - column
        sign = -1.0 if which == 1 else 1.0
    width = 3 * DIRECTIONS
    place = first + 3 * column + which
    if row < 0:
        return sign * (3.0 * table[place] - 3.0 * table[place + width] + table[place + 2 * width])
    if row >= GAPS:
        end = place + (GAPS - 1) * width
        return sign * (3.0 * table[end] - 3.0 * table[end - width] + table[end - 2 * width])
    return sign * table[place + row * width]


@kernel()
def tabulated(table, first, which, gap, direction):
    """Radial, tangential or pressure of a table at a film thickness over the clearance and a direction from 0 to pi."""
    x = (math.sqrt(max(gap, NEAREST)) - ROOT) / (1.0 - ROOT) * (GAPS - 1)
    y = 0.5 * (math.asinh((direction - 0.5 * math.pi) / SHARP) / WIDEST + 1.0) * (DIRECTIONS - 1)
    row, column = min(max(int(x), 0), GAPS - 2), min(max(int(y), 0), DIRECTIONS - 2)
    fx, fy = x - row, y - column
    v0 = v1 = v2 = v3 = 0.0
    for k in range(4):
        value = cubic(
            fy,
            at_node(table, first, which, row + k - 1, column - 1),
            at_node(table, first, which, row + k - 1, column),
            at_node(table, first, which, row + k - 1, column + 1),
            at_node(table, first, which, row + k - 1, column + 2),
        )
        if k == 0:
            v0 = value
        elif k == 1:
            v1 = value
        elif k == 2:
            v2 = value
        else:
            v3 = value
    return cubic(fx, v0, v1, v2, v3) / gap ** _POWERS[which]


def looked_up(table: np.ndarray, eccentricity: float, direction: float) -> tuple[float, float, float]:
    """Radial, tangential and pressure of a table at an eccentricity and a direction from 0 to pi [rad]."""
    flat = np.ascontiguousarray(table).ravel()
    found = [float(tabulated(flat, 0, k, 1.0 - eccentricity, direction)) for k in range(3)]
    return found[0], found[1], found[2]


@cache
def _stored() -> tuple[np.ndarray, np.ndarray]:
    with np.load(TABLE) as file:
        return file["ratios"], file["values"]


@cache
def finite_table(ratio: float) -> np.ndarray:
    """The table of a bearing of finite length, shape (GAPS, DIRECTIONS, 3).

    Parameters
    ----------
    ratio : float
        L/D, within those of the file; interpolated over its logarithm, relative to (L/D)^2/(1 + (L/D)^2).
    """
    from scipy.interpolate import CubicSpline

    ratios, values = _stored()

    def scale(x: np.ndarray) -> np.ndarray:
        return np.asarray(x**2 / (1.0 + x**2))

    relative = values / scale(ratios)[:, None, None, None]
    found: np.ndarray = CubicSpline(np.log(ratios), relative)(math.log(ratio)) * scale(np.array(ratio))
    return found


@cache
def pressure_table(model: str, ratio: float) -> np.ndarray:
    """The table of a short or a long bearing, of which only the largest pressure is read, shape (GAPS, DIRECTIONS, 3)."""
    theta = np.linspace(0.0, 2.0 * np.pi, 721)
    table = np.zeros((GAPS, DIRECTIONS, 3))
    for i, e in enumerate(eccentricities()):
        finer = math.sqrt((1.0 - e) / (1.0 + e))
        at = np.pi + 2.0 * np.arctan(finer * np.tan(0.5 * (theta - np.pi)))
        for j, psi in enumerate(directions()):
            if model == "short":
                pressure = -3.0 * ratio**2 * np.cos(at - psi) / (1.0 + e * np.cos(at)) ** 3
            else:
                s, c, h = np.sin(at), np.cos(at), 1.0 + e * np.cos(at)
                wedge = math.sin(psi) * s * (2.0 + e * c) / (2.0 + e * e)
                squeeze = 0.5 * math.cos(psi) * (1.0 - c) * (2.0 + e + e * c) / (1.0 + e) ** 2
                pressure = 6.0 * (wedge + squeeze) / h**2
            table[i, j, 2] = max(float(np.max(pressure)), 0.0)
    return np.asarray(table / steepness(eccentricities())[:, None, :])
