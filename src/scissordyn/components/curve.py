"""Curves through pairs of numbers: monotone cubic pieces with their integral, constant beyond the ends."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, Literal

import numpy as np

from scissordyn.errors import InputError
from scissordyn.kernel import kernel
from scissordyn.units import Meaning, Pairs

KNOT_SIZE = 4  # Number of values per knot of a characteristic curve: place, value, slope, and integral from the first knot

ACTS = ("both", "forward", "backward")  # Senses of motion in which a load can act; kernels get the index

Acts = Annotated[Literal["both", "forward", "backward"], Meaning("in both senses of the motion, or in one")]


@kernel
def active_fraction(speed, acts, transition):
    """Return the fraction of a load that acts at a speed; `acts` is an index of `ACTS`, `transition` a speed."""
    if acts == 0.0:
        return 1.0
    sense = 1.0 if acts == 1.0 else -1.0
    return 0.5 * (1.0 + math.tanh(sense * speed / transition))


@kernel
def curve_at(place, table, first, count):
    """Return value and integral of a curve whose knots begin at index `first`, and the distance beyond its ends."""
    low, last = 0, count - 1
    start, end = table[first], table[first + KNOT_SIZE * last]
    if place <= start:
        value = table[first + 1]
        return value, (place - start) * value, start - place
    if place >= end:
        value = table[first + KNOT_SIZE * last + 1]
        return value, table[first + KNOT_SIZE * last + 3] + (place - end) * value, place - end
    while last - low > 1:
        middle = (low + last) // 2
        if table[first + KNOT_SIZE * middle] <= place:
            low = middle
        else:
            last = middle
    a, b = first + KNOT_SIZE * low, first + KNOT_SIZE * last
    h = table[b] - table[a]
    t = (place - table[a]) / h
    # cubic Hermite polynomial through values and slopes, and its integral
    y, z, p, q = table[a + 1], table[b + 1], h * table[a + 2], h * table[b + 2]
    value = y + t * (p + t * (3.0 * (z - y) - 2.0 * p - q + t * (2.0 * (y - z) + p + q)))
    area = t * (y + t * (p / 2.0 + t * ((3.0 * (z - y) - 2.0 * p - q) / 3.0 + t * (2.0 * (y - z) + p + q) / 4.0)))
    return value, table[a + 3] + h * area, 0.0


def curve_knots(pairs: Sequence[tuple[float, float]], *, periodic: bool = False) -> list[float]:
    """Return the knots of a curve that overshoots no pair (Fritsch and Butland 1984, doi:10.1137/0905021)."""
    from scipy.interpolate import PchipInterpolator

    place, value = np.array(pairs, float).T
    curve = PchipInterpolator(place, value)
    slope = curve.derivative()(place)
    if periodic:
        span, inside = place[-1] - place[0], slice(0, -1)
        three = np.concatenate([place[inside] - span, place[inside], place + span])
        slope = PchipInterpolator(three, np.concatenate([value[inside], value[inside], value])).derivative()(place)
    h = np.diff(place)
    area = 0.5 * h * (value[1:] + value[:-1]) + h * h * (slope[:-1] - slope[1:]) / 12.0
    integral = np.concatenate([[0.0], np.cumsum(area)])
    numbers: list[float] = np.column_stack([place, value, slope, integral]).ravel().tolist()
    return numbers


def check_curve(label: str, pairs: Sequence[tuple[float, float]], meaning: Pairs, *, periodic: bool = False) -> None:
    """Raise `InputError` unless the places of a curve increase."""
    places = [place for place, _ in pairs]
    if len(pairs) < 2 or not np.all(np.isfinite(pairs)) or not np.all(np.diff(places) > 0.0):
        raise InputError(
            f"{label}: the curve has {len(pairs)} pairs" + (f" at {places!r:.80}" if len(pairs) > 1 else ""),
            f"two or more {meaning.names[0]}, which increase, and as many {meaning.names[1]}",
        )
    if periodic and pairs[0][1] != pairs[-1][1]:
        raise InputError(
            f"{label}: the periodic curve begins with {pairs[0][1]:g} and ends with {pairs[-1][1]:g}", "equal values"
        )


def check_start(label: str, pairs: Sequence[tuple[float, float]], start: float, unit: str) -> None:
    """Raise `InputError` if the start is beyond the ends of a curve."""
    first, last = pairs[0][0], pairs[-1][0]
    if not first - 1e-9 * abs(first) <= start <= last + 1e-9 * abs(last):
        raise InputError(
            f"{label}: its curve goes from {first:.6g} to {last:.6g} {unit}, and the start is at {start:.6g} {unit}",
            "a curve that covers the stroke",
        )
