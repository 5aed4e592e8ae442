"""Time functions as the kernels evaluate them, and the basis b(t) = (1, cos th_1, sin th_1, ...) of the drives.

Every function consists of pieces: from the start of a piece on, a polynomial of fifth degree plus a sine.
"""

from __future__ import annotations

import math

import numpy as np

from scissordyn.components.time_function import (
    ConstantSpeed,
    Cycloidal,
    Harmonic,
    Polynomial,
    Tabulated,
    TimeFunction,
    Trapezoidal,
)
from scissordyn.interpolation import quintic_spline
from scissordyn.kernel import F1, F2, I1, entry, equals, kernel
from scissordyn.tolerance import ROUND_OFF_TOL

PIECE_COLUMNS = 10
"""Number of values of a piece of a time function.

They are its start, six coefficients from the highest power down, and amplitude, frequency and phase of a sine.
"""


def function_rows(motion: TimeFunction, start: float) -> np.ndarray:
    """Return the pieces of a time function, each a polynomial or harmonic, shape (pieces, PIECE_COLUMNS)."""
    match motion:
        case ConstantSpeed(speed):
            return _pieces((0.0, (start, speed)))
        case Harmonic(mean, amplitude, angular_frequency, phase):
            return _pieces((0.0, (mean,), (amplitude, angular_frequency, phase)))
        case Polynomial(coefficients):
            return _pieces((0.0, coefficients))
        case Cycloidal(before, after, duration):
            rise, turn = (after - before) / duration, 2.0 * math.pi / duration
            sine = (-(after - before) / (2.0 * math.pi), turn, 0.0)
            return _pieces((-math.inf, (before,)), (0.0, (before, rise), sine), (duration, (after,)))
        case Trapezoidal(before, after, duration, ramp, strokes, begin):
            ramps = ramp * duration
            speed = (after - before) / (duration - ramps)
            bend, moved = 0.5 * speed / ramps, 0.5 * speed * ramps
            pieces: list[tuple[float | tuple[float, ...], ...]] = [(-math.inf, (before,))]
            for stroke in range(strokes):
                pieces += [
                    (stroke * duration - begin, (before, 0.0, bend)),
                    (stroke * duration + ramps - begin, (before + moved, speed)),
                    ((stroke + 1) * duration - ramps - begin, (after - moved, speed, -bend)),
                ]
                before, after, speed, bend, moved = after, before, -speed, -bend, -moved
            return _pieces(*pieces, (strokes * duration - begin, (before,)))
        case Tabulated():
            spline = quintic_spline(motion.times, motion.values)
            inside = np.flatnonzero(np.diff(spline.x) > 0.0)
            rows = np.zeros((inside.size, PIECE_COLUMNS))
            rows[:, 0] = spline.x[inside]
            rows[:, 1:7] = spline.c[:, inside].T
            return rows


def breaks_of(motion: TimeFunction) -> tuple[float, ...]:
    """Return the instants [s] at which the second or third derivative of a time function jumps; steps should end there."""
    match motion:
        case Cycloidal():
            return (motion.duration,)
        case Trapezoidal():
            ramps = motion.ramp * motion.duration
            strokes = range(motion.strokes)  # a reversal itself is smooth: the same parabola leads to it and away from it
            starts, ends = (k * motion.duration + ramps for k in strokes), ((k + 1) * motion.duration - ramps for k in strokes)
            instants = (*starts, *ends, motion.strokes * motion.duration)
            return tuple(instant - motion.begin for instant in instants if instant > motion.begin)
        case _:
            return ()


def _pieces(*pieces: tuple[float | tuple[float, ...], ...]) -> np.ndarray:
    """Return rows from triples of start, coefficients in ascending order, and sine."""
    rows = np.zeros((len(pieces), PIECE_COLUMNS))
    for row, (instant, coefficients, *sine) in zip(rows, pieces, strict=True):
        assert isinstance(coefficients, tuple)
        row[0] = instant
        row[7 - len(coefficients) : 7] = coefficients[::-1]
        if sine:
            row[7:] = sine[0]
    return rows


@entry
def function_at(t: float, rows: F2, value: F1) -> None:
    """Write a time function and its first three derivatives at time t into value[0:4]; at a break, those after it."""
    smooth_function(t, t, rows, 0, rows.shape[0], value)


@entry
def function_over(times: F1, rows: F2, values: F2) -> None:
    """Write a time function and its first three derivatives at many times into values[:, 0:4], shape (times, 4)."""
    for k in range(times.shape[0]):
        smooth_function(times[k], times[k], rows, 0, rows.shape[0], values[k])


@kernel
def motion_at(t, which, S):
    """Write a time function of the mechanism and its first three derivatives at time t into Work.function_value."""
    P, W = S.parameters, S.work
    start, stop = P.motion_start[which], P.motion_start[which + 1]
    smooth_function(t, piece_time(t, W.segment), P.motion, start, stop, W.function_value)


@kernel
def piece_time(t, segment):
    """Return an instant in the piece that is valid at time t of a step between two breaks; at its end the piece before."""
    near = 2.0 * ROUND_OFF_TOL * abs(t)
    if t < segment[0] and segment[0] - t <= near:
        return segment[0]
    if t >= segment[1] and t - segment[1] <= near:
        return segment[1] - 2.0 * near
    return t


@kernel
def smooth_function(t, when, rows, start, stop, value):
    """Write the piece of rows `start` to `stop` that is valid at `when`, and its derivatives at t, into value[0:4]."""
    low, high = start, stop - 1
    while low < high:  # the last piece that begins at or before that instant
        middle = (low + high + 1) // 2
        if rows[middle, 0] <= when:
            low = middle
        else:
            high = middle - 1
    begin = rows[low, 0]
    s = 0.0 if begin == -math.inf else t - begin
    v0 = v1 = v2 = v3 = 0.0
    first = 1
    while first < 6 and equals(rows[low, first], 0.0):  # most polynomials have a low degree
        first += 1
    for k in range(first, 7):
        v3 = v3 * s + 3.0 * v2
        v2 = v2 * s + 2.0 * v1
        v1 = v1 * s + v0
        v0 = v0 * s + rows[low, k]
    amplitude, frequency = rows[low, 7], rows[low, 8]
    if not equals(amplitude, 0.0):
        phase = frequency * s + rows[low, 9]
        sin, cos = amplitude * math.sin(phase), amplitude * frequency * math.cos(phase)
        v0 += sin
        v1 += cos
        v2 -= frequency * frequency * sin
        v3 -= frequency * frequency * cos
    value[0], value[1], value[2], value[3] = v0, v1, v2, v3


def function_start(motion: TimeFunction, start: float = 0.0) -> float:
    """Return the value of a time function at t = 0; `start` is the value of a function given only by its speed."""
    value = np.zeros(4)
    function_at(0.0, function_rows(motion, start), value)
    return float(value[0])


@entry
def prescribe(t: float, when: float, rows: F2, starts: I1, basis: F2, angle: F1) -> None:
    """Write b and its derivatives at time t into basis[0:4, :], using the pieces at `when`; `angle` is scratch."""
    for order in range(4):
        basis[order, 0] = 1.0 if order == 0 else 0.0
    for drive in range((basis.shape[1] - 1) // 2):
        smooth_function(t, when, rows, starts[drive], starts[drive + 1], angle)
        c, s = math.cos(angle[0]), math.sin(angle[0])
        w, a, j = angle[1], angle[2], angle[3]
        i = 1 + 2 * drive
        basis[0, i], basis[0, i + 1] = c, s
        basis[1, i], basis[1, i + 1] = -s * w, c * w
        basis[2, i], basis[2, i + 1] = -c * w * w - s * a, -s * w * w + c * a
        basis[3, i] = s * w * w * w - 3.0 * c * w * a - s * j
        basis[3, i + 1] = -c * w * w * w - 3.0 * s * w * a + c * j
