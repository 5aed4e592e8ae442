"""Impedances of journal bearings: of short and long ones by their integrals, of finite ones by a table.

With V the size of the velocity 2 e'/c - w x e/c (e the journal's place, w its angular speed, both as the bearing sees
them), and psi its direction from e, the film exerts mu R L (R/c)^2 V (radial, tangential) on the journal.
"""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path

import numpy as np

from scissordyn.kernel import kernel

TABLE = Path(__file__).parent / "finite.npz"

GAPS, DIRECTIONS = 20, 33
"""Nodes over the root of the least film thickness, and over the direction psi of the velocity from 0 to pi."""

TABLE_THICKNESS_MIN = 1e-3  # [clearances] least film thickness of the table; below, impedances grow as those of a long bearing

POWERS = 1.5, 1.0, 2.0
"""By which powers of the film thickness radial force, tangential force and pressure of the table are divided."""

DIRECTION_WIDTH = 0.15  # [rad] range of psi about pi/2 with the closest nodes: there the film passes from one side to the other

WIDEST = 3.0441218408957904  # asinh(pi / (2 DIRECTION_WIDTH))

ROOT = math.sqrt(TABLE_THICKNESS_MIN)

TABLE_WIDTH = DIRECTIONS + 2  # Columns of a table with its neighbours on both sides


def eccentricities() -> np.ndarray:
    """Return eccentricities at equal steps of the root of the least film thickness, from contact on, shape (GAPS,)."""
    return 1.0 - np.linspace(math.sqrt(TABLE_THICKNESS_MIN), 1.0, GAPS) ** 2


def directions() -> np.ndarray:
    """psi, shape (DIRECTIONS,) [rad]."""
    return 0.5 * math.pi + DIRECTION_WIDTH * np.sinh(WIDEST * np.linspace(-1.0, 1.0, DIRECTIONS))


def steepness(eccentricity: float | np.ndarray) -> np.ndarray:
    """Return the divisors of the impedances, shape (..., 3): powers of the film thickness, as they grow towards contact."""
    return np.asarray((1.0 - np.asarray(eccentricity))[..., None] ** -np.array(POWERS))


@kernel
def short_bearing(eccentricity, sine, cosine, full):
    """Impedance of a short bearing (Ocvirk) over (L/D)^2, for the direction psi by its sine and cosine.

    The pressure is positive on the half where cos(theta - psi) < 0; with `full`, both halves count. The integrals over cos^2,
    sin^2 and their product over H^3 are those of trigonometric polynomials in Sommerfeld's angle s (Booker 1965), with
    cos s = (e + cos theta)/(1 + e cos theta): from psi + 90 deg to psi + 270 deg.
    """
    e = eccentricity
    root = math.sqrt(1.0 - e * e)
    if full:
        s1, c1, s2, c2, angle = 0.0, -1.0, 0.0, -1.0, 2.0 * math.pi
    else:
        near, far = 1.0 / (1.0 - e * sine), 1.0 / (1.0 + e * sine)
        s1, c1, s2, c2 = root * cosine * near, (e - sine) * near, -root * cosine * far, (e + sine) * far
        angle = math.atan2(-2.0 * e * root * cosine, 2.0 * e * e - 1.0 - e * e * sine * sine)
        if angle < 0.0:
            angle += 2.0 * math.pi
    ends = 0.5 * (s2 * c2 - s1 * c1)
    both = (0.5 + e * e) * angle + ends - 2.0 * e * (s2 - s1)
    across = (1.0 - e * e) * (0.5 * angle - ends)
    mixed = root * (0.5 * (s2 * s2 - s1 * s1) + e * (c2 - c1))
    factor = -2.0 / root**5
    return factor * (cosine * both + sine * mixed), factor * (cosine * mixed + sine * across)


@kernel
def long_end(e, sine, cosine):
    """Return the end of the pressure that begins at theta = 0, for sin psi <= 0: Sommerfeld's angle, from 0 to 2 pi.

    With t = tan(theta/2) the pressure has the factor a t^3 - b (2-e) t^2 + a (1+e) t - b (2+e). Its one real root has the size
    k g(t), k = |b/a|, g = ((2-e) t^2 + 2+e)/(t^2 + 1+e): g falls from (2+e)/(1+e) to 2-e, so that Newton's method for
    log t - log g needs few steps.
    """
    b, a = -sine / (2.0 + e * e), abs(cosine) / ((1.0 + e) * (1.0 + e))
    k = b / max(a, 1e-100)
    t = k * (2.0 - e)
    for _ in range(4):  # Newton steps for the end of a long bearing's film; fewer are enough
        top, bottom = (2.0 - e) * t * t + 2.0 + e, t * t + 1.0 + e
        slope = 2.0 * t * t * e * e / top / bottom
        t = (t * slope + k * top / bottom) / (1.0 + slope)
    half = math.atan(t * math.sqrt((1.0 - e) / (1.0 + e)))
    return 2.0 * (math.pi - half) if cosine > 0.0 else 2.0 * half


@kernel
def long_bearing(eccentricity, sine, cosine, full):
    """Impedance of a long bearing, for the direction psi by its sine and cosine.

    The pressure counts where it is positive (Guembel), with `full` everywhere. It is zero at both ends of that part, so that
    its integrals over cos and sin are those of sin and cos with dp/dtheta = 6 (sin(theta - psi) + K)/h^3: trigonometric
    polynomials in Sommerfeld's angle.
    """
    e, side = eccentricity, 1.0
    if sine > 0.0:
        sine, side = -sine, -1.0
    last = 2.0 * math.pi if full else long_end(e, sine, cosine)
    root = math.sqrt(1.0 - e * e)
    s, c = math.sin(last), math.cos(last)
    constant = -3.0 * e * sine / (2.0 + e * e)
    across = 0.5 * (last - s * c)  # of sin^2 in Sommerfeld's angle, and so on
    along = last - across
    mixed = 0.5 * s * s
    sine_sine = across * root * root
    sine_cosine = root * (mixed - e * (1.0 - c))
    cosine_cosine = along - 2.0 * e * s + e * e * last
    sine_one = root * (1.0 - c - e * mixed)
    cosine_one = (1.0 + e * e) * s - e * (along + last)
    factor = 6.0 / root**5
    radial = -factor * (cosine * sine_sine - sine * sine_cosine + constant * sine_one)
    tangential = factor * (cosine * sine_cosine - sine * cosine_cosine + constant * cosine_one)
    return radial, side * tangential


@kernel
def cubic_weights(f):
    """Return the weights of four nodes at f in (0, 1) between the inner two (Catmull and Rom)."""
    return (
        f * (f * (1.0 - 0.5 * f) - 0.5),
        1.0 + f * f * (1.5 * f - 2.5),
        f * (0.5 + f * (2.0 - 1.5 * f)),
        0.5 * f * f * (f - 1.0),
    )


@kernel
def row_of(gap):
    """Row of a cell of the table, and where in it a film thickness over the clearance lies."""
    x = (math.sqrt(max(gap, TABLE_THICKNESS_MIN)) - ROOT) / (1.0 - ROOT) * (GAPS - 1)
    row = min(max(int(x), 0), GAPS - 2)
    return row, x - row


@kernel
def column_of(direction):
    """Column of a cell of the table, and where in it a direction lies."""
    y = 0.5 * (math.asinh((direction - 0.5 * math.pi) / DIRECTION_WIDTH) / WIDEST + 1.0) * (DIRECTIONS - 1)
    column = min(max(int(y), 0), DIRECTIONS - 2)
    return column, y - column


@kernel
def steepness_at(gap):
    """Powers `POWERS` of a film thickness over the clearance."""
    return gap * math.sqrt(gap), gap, gap * gap


@kernel
def tabulated(table, first, gap, direction):
    """Radial, tangential and pressure of a table at a film thickness over the clearance and a direction from 0 to pi."""
    (row, fx), (column, fy) = row_of(gap), column_of(direction)
    across, along = cubic_weights(fx), cubic_weights(fy)
    radial = tangential = pressure = 0.0
    for k in range(4):
        at = first + 3 * ((row + k) * TABLE_WIDTH + column)
        for l in range(4):
            weight, node = across[k] * along[l], at + 3 * l
            radial += weight * table[node]
            tangential += weight * table[node + 1]
            pressure += weight * table[node + 2]
    by = steepness_at(gap)
    return radial / by[0], tangential / by[1], pressure / by[2]


@kernel
def tabulated_pressure(table, first, gap, direction):
    """The pressure alone."""
    (row, fx), (column, fy) = row_of(gap), column_of(direction)
    across, along = cubic_weights(fx), cubic_weights(fy)
    pressure = 0.0
    for k in range(4):
        at = first + 3 * ((row + k) * TABLE_WIDTH + column) + 2
        for l in range(4):
            pressure += across[k] * along[l] * table[at + 3 * l]
    return pressure / steepness_at(gap)[2]


@kernel
def squeezed_pressure(table, first, gap):
    """The pressure of pure approach, psi = 0, which is a column of the table."""
    row, fx = row_of(gap)
    across, pressure = cubic_weights(fx), 0.0
    for k in range(4):
        pressure += across[k] * table[first + 3 * ((row + k) * TABLE_WIDTH + 1) + 2]
    return pressure / steepness_at(gap)[2]


def padded(table: np.ndarray) -> np.ndarray:
    """The table with one more node on each side: by symmetry in psi, along a parabola in the film thickness.

    Shapes: `table` (GAPS, DIRECTIONS, 3); returns (GAPS + 2, TABLE_WIDTH, 3).
    """
    odd = np.array([1.0, -1.0, 1.0])
    wide = np.concatenate([table[:, 1:2] * odd, table, table[:, -2:-1] * odd], axis=1)
    first, last = (3.0 * a - 3.0 * b + c for a, b, c in (wide[:3], wide[:-4:-1]))
    return np.concatenate([first[None], wide, last[None]])


def looked_up(table: np.ndarray, eccentricity: float, direction: float) -> tuple[float, float, float]:
    """Radial, tangential and pressure of a table at an eccentricity and a direction from 0 to pi [rad]."""
    radial, tangential, pressure = tabulated(np.ravel(padded(table)), 0, 1.0 - eccentricity, direction)
    return float(radial), float(tangential), float(pressure)


@cache
def _stored() -> tuple[np.ndarray, np.ndarray]:
    with np.load(TABLE) as file:
        return file["ratios"], file["values"]


@cache
def finite_table(ratio: float) -> np.ndarray:
    """The table of a bearing of finite length, shape (GAPS, DIRECTIONS, 3)."""
    from scipy.interpolate import CubicSpline

    ratios, values = _stored()

    def scale(x: np.ndarray) -> np.ndarray:
        return np.asarray(x**2 / (1.0 + x**2))

    relative = values / scale(ratios)[:, None, None, None]
    relative_impedance: np.ndarray = CubicSpline(np.log(ratios), relative)(math.log(ratio)) * scale(np.array(ratio))
    return relative_impedance


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
