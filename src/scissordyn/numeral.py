"""Prefixes of units, and numbers of tables as text, with three significant digits or more, as `table.js` in the browser."""

from __future__ import annotations

import math
from collections.abc import Iterable
from decimal import ROUND_HALF_UP, Decimal

PREFIXES = {-12: "p", -9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}  # By power of ten
LEAST = 3  # Significant digits of every number
LARGEST = 4  # Significant digits of the largest number of a column, whose decimals the others take
MOST = 7  # Numbers with more digits after the point than this, or before it, are written with a power of ten


def prefix(largest: float, low: int = -12, high: int = 9, *, from_tenth: bool = False) -> int:
    """The power of ten with which the figure of a number is 1 to 1000, or 0.1 to 100."""
    if not (math.isfinite(largest) and largest > 0.0):
        return 0
    # the next float below a limit counts as the limit, so that round-off does not choose the prefix
    return min(max(3 * math.floor((math.log10(largest) + 1e-9 + from_tenth) / 3.0), low), high)


def numeral(value: float, places: int = 0) -> str:
    """A number as text, trailing zeros kept: 9.50."""
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
    """Digits after the point that a column of numbers has in common."""
    largest = max((abs(value) for value in values if math.isfinite(value)), default=0.0)
    before = Decimal(largest).adjusted() if largest else 0
    return min(max(digits - 1 - max(before, 0), 0), MOST)


def numerals(values: Iterable[float], digits: int = LARGEST) -> list[str]:
    """Numbers of one column as text."""
    every = [float(value) for value in values]
    places = decimals(every, digits)
    return [numeral(value, places) for value in every]
