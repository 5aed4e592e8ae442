"""Prescribed angles and the basis b(t) = (1, cos th_1, sin th_1, ...) with three derivatives."""

from __future__ import annotations

import math

import numpy as np

from scissordyn.jit import kernel
from scissordyn.model.body import Body
from scissordyn.model.drive import ConstantSpeed, Drive, Harmonic, TableMotion

__all__ = ["COLUMNS", "motion_rows", "prescribe", "prescribed_angle"]

CONSTANT, HARMONIC, TABLE = 0, 1, 2
COLUMNS = 8
"""Width of a row of the motion table: kind and its numbers, or a knot and the six coefficients of its polynomial."""


def motion_rows(drive: Drive, body: Body) -> np.ndarray:
    """A drive's rows in the motion table.

    Parameters
    ----------
    drive : Drive
    body : Body
        The driven body, for the angle at the start.

    Returns
    -------
    ndarray, shape (rows, COLUMNS)
        First the kind and its numbers; for a table then one row per polynomial piece.
    """
    motion = drive.motion
    if isinstance(motion, ConstantSpeed):
        return np.array([[CONSTANT, body.angle, motion.speed, 0.0, 0.0, 0.0, 0.0, 0.0]])
    if isinstance(motion, Harmonic):
        return np.array([[HARMONIC, motion.mean, motion.amplitude, motion.frequency, motion.phase, 0.0, 0.0, 0.0]])
    assert isinstance(motion, TableMotion)
    from scipy.interpolate import PPoly, make_interp_spline  # a third of a second that other drives need not wait for

    spline = PPoly.from_spline(make_interp_spline(motion.times, motion.angles, k=5).tck)
    inside = np.flatnonzero(np.diff(spline.x) > 0.0)
    rows = np.zeros((inside.size + 1, COLUMNS))
    rows[0, :2] = TABLE, inside.size
    rows[1:, 0] = spline.x[inside]
    rows[1:, 1:7] = spline.c[:, inside].T
    return rows


@kernel(inline=True)
def prescribed_angle(t, rows, angle):
    """Write an angle and its first three derivatives at time t into angle[0:4]."""
    kind = int(rows[0, 0])
    if kind == 0:
        angle[0] = rows[0, 1] + rows[0, 2] * t
        angle[1] = rows[0, 2]
        angle[2] = 0.0
        angle[3] = 0.0
    elif kind == 1:
        amplitude, frequency = rows[0, 2], rows[0, 3]
        phase = frequency * t + rows[0, 4]
        sin, cos = amplitude * math.sin(phase), amplitude * math.cos(phase)
        angle[0] = rows[0, 1] + sin
        angle[1] = frequency * cos
        angle[2] = -frequency * frequency * sin
        angle[3] = -frequency * frequency * frequency * cos
    else:
        low, high = 1, int(rows[0, 1])
        while low < high:  # the last knot at or before t
            middle = (low + high + 1) // 2
            if rows[middle, 0] <= t:
                low = middle
            else:
                high = middle - 1
        s = t - rows[low, 0]
        value = first = second = third = 0.0
        for k in range(1, 7):
            third = third * s + 3.0 * second
            second = second * s + 2.0 * first
            first = first * s + value
            value = value * s + rows[low, k]
        angle[0], angle[1], angle[2], angle[3] = value, first, second, third


@kernel()
def prescribe(t, rows, starts, basis, angle):
    """Write b and its derivatives at time t into basis[0:4, :]; `angle` is work space."""
    for order in range(4):
        basis[order, 0] = 1.0 if order == 0 else 0.0
    for drive in range(starts.size - 1):
        prescribed_angle(t, rows[starts[drive] : starts[drive + 1]], angle)
        c, s = math.cos(angle[0]), math.sin(angle[0])
        w, a, j = angle[1], angle[2], angle[3]
        i = 1 + 2 * drive
        basis[0, i], basis[0, i + 1] = c, s
        basis[1, i], basis[1, i + 1] = -s * w, c * w
        basis[2, i], basis[2, i + 1] = -c * w * w - s * a, -s * w * w + c * a
        basis[3, i] = s * w * w * w - 3.0 * c * w * a - s * j
        basis[3, i + 1] = -c * w * w * w - 3.0 * s * w * a + c * j
