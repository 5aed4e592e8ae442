"""Impedances of journal bearings: of short and long ones by their integrals, of finite ones by a table.

The film exerts the force mu R L (R/c)^2 V (radial, tangential) on the journal. V is the magnitude of 2 e'/c - w x e/c, with the
position e and the angular velocity w of the journal relative to the bearing; psi is its direction from that of e. An impedance
is the pair (radial, tangential), together with the largest pressure over mu (R/c)^2 V. Film thicknesses are over the clearance.
"""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path

import numpy as np

from scissordyn.kernel import kernel

TABLE = Path(__file__).parent / "finite.npz"  # File with the impedances of finite bearings, computed by `reynolds`

GAPS, DIRECTIONS = 20, 33
"""Numbers of nodes of the impedance table: by root of least film thickness, and by direction psi from 0 to pi."""

# [clearances] least film thickness in the impedance table; thinner films are extrapolated as in a long bearing
TABLE_THICKNESS_MIN = 1e-3

POWERS = 1.5, 1.0, 2.0
"""Exponents of one over the film thickness: growth of radial force, tangential force and pressure towards contact.

Tables contain the values without this growth.
"""

DIRECTION_WIDTH = 0.15  # [rad] range of psi about pi/2 with the closest table nodes: the film passes to the other side there

DIRECTION_SPAN = math.asinh(0.5 * math.pi / DIRECTION_WIDTH)
"""asinh(pi/(2 DIRECTION_WIDTH)): half the range of asinh((psi - pi/2)/DIRECTION_WIDTH); columns are equally spaced in it."""

THICKNESS_ROOT_MIN = math.sqrt(TABLE_THICKNESS_MIN)  # Square root of the least film thickness in the impedance table

TABLE_WIDTH = DIRECTIONS + 2  # Number of columns of the padded impedance table (`padded`)


def eccentricities() -> np.ndarray:
    """Return the eccentricities of a table's rows, from contact on: equally spaced in the root of the least film thickness."""
    return 1.0 - np.linspace(math.sqrt(TABLE_THICKNESS_MIN), 1.0, GAPS) ** 2


def directions() -> np.ndarray:
    """Return the directions psi of a table's columns, shape (DIRECTIONS,) [rad]."""
    return 0.5 * math.pi + DIRECTION_WIDTH * np.sinh(DIRECTION_SPAN * np.linspace(-1.0, 1.0, DIRECTIONS))


def steepness(eccentricity: float | np.ndarray) -> np.ndarray:
    """Return the growth of impedances towards contact, shape (..., 3): the film thickness to the negative `POWERS`."""
    return np.asarray((1.0 - np.asarray(eccentricity))[..., None] ** -np.array(POWERS))


@kernel
def short_bearing(eccentricity, sine, cosine, full):
    """Return the impedance of a short bearing (Ocvirk) over (L/D)^2; psi is given by its sine and cosine.

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
    """Return the end of the pressure of a long bearing that begins at theta = 0, for sin psi <= 0, as Sommerfeld's angle.

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
    """Return the impedance of a long bearing; psi is given by its sine and cosine.

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
    """Return the row of the table's cell that contains a film thickness, and its position in the cell, from 0 to 1."""
    x = (math.sqrt(max(gap, TABLE_THICKNESS_MIN)) - THICKNESS_ROOT_MIN) / (1.0 - THICKNESS_ROOT_MIN) * (GAPS - 1)
    row = min(max(int(x), 0), GAPS - 2)
    return row, x - row


@kernel
def column_of(direction):
    """Return the column of the table's cell that contains a direction psi, and its position in the cell, from 0 to 1."""
    y = 0.5 * (math.asinh((direction - 0.5 * math.pi) / DIRECTION_WIDTH) / DIRECTION_SPAN + 1.0) * (DIRECTIONS - 1)
    column = min(max(int(y), 0), DIRECTIONS - 2)
    return column, y - column


@kernel
def thickness_powers(gap):
    """Return a film thickness to the `POWERS`, by which interpolated values of a table are divided."""
    return gap * math.sqrt(gap), gap, gap * gap


@kernel
def tabulated(table, first, gap, direction):
    """Return the impedance (radial, tangential, pressure) that a padded table gives at a film thickness and a direction psi.

    The table begins at index `first` of an array.
    """
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
    by = thickness_powers(gap)
    return radial / by[0], tangential / by[1], pressure / by[2]


@kernel
def tabulated_pressure(table, first, gap, direction):
    """Return the pressure of `tabulated` alone."""
    (row, fx), (column, fy) = row_of(gap), column_of(direction)
    across, along = cubic_weights(fx), cubic_weights(fy)
    pressure = 0.0
    for k in range(4):
        at = first + 3 * ((row + k) * TABLE_WIDTH + column) + 2
        for l in range(4):
            pressure += across[k] * along[l] * table[at + 3 * l]
    return pressure / thickness_powers(gap)[2]


@kernel
def squeezed_pressure(table, first, gap):
    """Return the pressure of a pure approach, psi = 0, which is a column of the table."""
    row, fx = row_of(gap)
    across, pressure = cubic_weights(fx), 0.0
    for k in range(4):
        pressure += across[k] * table[first + 3 * ((row + k) * TABLE_WIDTH + 1) + 2]
    return pressure / thickness_powers(gap)[2]


def padded(table: np.ndarray) -> np.ndarray:
    """Return a table with one more node on each side: by symmetry in psi, along a parabola in the film thickness.

    Shapes: `table` (GAPS, DIRECTIONS, 3); returns (GAPS + 2, TABLE_WIDTH, 3).
    """
    odd = np.array([1.0, -1.0, 1.0])
    wide = np.concatenate([table[:, 1:2] * odd, table, table[:, -2:-1] * odd], axis=1)
    first, last = (3.0 * a - 3.0 * b + c for a, b, c in (wide[:3], wide[:-4:-1]))
    return np.concatenate([first[None], wide, last[None]])


def looked_up(table: np.ndarray, eccentricity: float, direction: float) -> tuple[float, float, float]:
    """Return the impedance (radial, tangential, pressure) of a table at an eccentricity and a direction from 0 to pi [rad]."""
    radial, tangential, pressure = tabulated(np.ravel(padded(table)), 0, 1.0 - eccentricity, direction)
    return float(radial), float(tangential), float(pressure)


@cache
def _stored() -> tuple[np.ndarray, np.ndarray]:
    with np.load(TABLE) as file:
        return file["ratios"], file["values"]


@cache
def finite_table(ratio: float) -> np.ndarray:
    """Return the table of a finite bearing with length over diameter `ratio`, shape (GAPS, DIRECTIONS, 3)."""
    from scipy.interpolate import CubicSpline

    ratios, values = _stored()

    def scale(x: np.ndarray) -> np.ndarray:
        return np.asarray(x**2 / (1.0 + x**2))

    relative = values / scale(ratios)[:, None, None, None]
    relative_impedance: np.ndarray = CubicSpline(np.log(ratios), relative)(math.log(ratio)) * scale(np.array(ratio))
    return relative_impedance


@cache
def pressure_table(model: str, ratio: float) -> np.ndarray:
    """Return the largest pressures in a short or long bearing, shape (GAPS, DIRECTIONS, 3).

    The layout is that of `finite_table`: entry 2 is the pressure; entries 0 and 1, the impedances, stay zero.
    """
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
