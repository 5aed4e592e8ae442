"""Numbers of tables as text, with three significant digits or more; `numeral.js` does the same in the browser."""

from __future__ import annotations

import math
from collections.abc import Iterable
from decimal import ROUND_HALF_UP, Decimal

__all__ = ["LEAST", "decimals", "numeral", "numerals"]

LEAST = 3
"""Significant digits of every number."""

LARGEST = 4
"""Significant digits of the largest number of a column, whose decimals the others take."""

MOST = 7
"""Numbers with more digits after the point than this, or before it, are written with a power of ten."""


def numeral(value: float, places: int = 0) -> str:
    """A number as text, trailing zeros kept: 9.50.

    Parameters
    ----------
    value : float
    places : int
        Digits after the point; more where the number would have fewer than three significant digits.

    Returns
    -------
    str
        A dash for what is not finite. Halves are rounded away from zero, as browsers do.
    """
    if not math.isfinite(value):
        return "-"
    if value == 0.0:
        return f"{0.0:.{min(places, MOST)}f}"
    exact = Decimal(value)
    wanted = max(places, LEAST - 1 - exact.adjusted(), 0)
    if wanted <= MOST and exact.adjusted() < MOST:
        return f"{exact.quantize(Decimal(1).scaleb(-wanted), ROUND_HALF_UP):f}"
    figure = exact.scaleb(-exact.adjusted()).quantize(Decimal(1).scaleb(1 - LEAST), ROUND_HALF_UP)
    carried = figure.adjusted()  # 9.996 becomes 10.00
    mantissa = figure.scaleb(-carried).quantize(Decimal(1).scaleb(1 - LEAST), ROUND_HALF_UP)
    return f"{mantissa:f}e{exact.adjusted() + carried}"


def decimals(values: Iterable[float], digits: int = LARGEST) -> int:
    """Digits after the point that a column of numbers has in common.

    Parameters
    ----------
    values : iterable of float
        Those not finite are ignored.
    digits : int
        Significant digits of the largest.
    """
    largest = max((abs(value) for value in values if math.isfinite(value)), default=0.0)
    before = Decimal(largest).adjusted() if largest else 0
    return min(max(digits - 1 - max(before, 0), 0), MOST)


def numerals(values: Iterable[float], digits: int = LARGEST) -> list[str]:
    """Numbers of one column as text.

    Parameters
    ----------
    values : iterable of float
    digits : int
        Significant digits of the largest.

    Returns
    -------
    list of str
        With the same digits after the point, but for numbers that are small beside the largest.
    """
    every = [float(value) for value in values]
    places = decimals(every, digits)
    return [numeral(value, places) for value in every]
