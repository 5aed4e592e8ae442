"""Convert numbers to text with unit prefixes and at least three significant digits; `table.js` uses the same rules."""

from __future__ import annotations

import math
from collections.abc import Iterable
from decimal import ROUND_HALF_UP, Decimal
from typing import Any

PREFIXES = {-12: "p", -9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}  # unit prefixes by power of ten
DIGITS_MIN = 3  # smallest number of significant digits in a printed value
COLUMN_DIGITS = 4  # significant digits of the largest number in a column; it determines the decimals of all numbers
PLAIN_DIGITS_MAX = 7  # numbers with more digits before or after the decimal point are written with a power of ten


def finite_or_none(value: Any) -> Any:
    """Return a value for a JSON text: None for a number that is not finite, which JSON does not have."""
    return None if isinstance(value, float) and not math.isfinite(value) else value


def prefix(largest: float, low: int = -12, high: int = 9, *, from_tenth: bool = False) -> int:
    """Return the exponent, a multiple of 3, of the unit prefix with which a number is from 1 to 1000.

    With `from_tenth` the number is from 0.1 to 100. `low` and `high` bound the exponent.
    """
    if not (math.isfinite(largest) and largest > 0.0):
        return 0
    # add 1e-9, so that round-off in a power of ten does not change the prefix
    return min(max(3 * math.floor((math.log10(largest) + 1e-9 + from_tenth) / 3.0), low), high)


def numeral(value: float, places: int = 0) -> str:
    """Return a number as text with at least three digits and `places` decimals, such as 9.50; "-" for NaN and infinity."""
    if not math.isfinite(value):
        return "-"
    if value == 0.0:
        return f"{0.0:.{min(places, PLAIN_DIGITS_MAX)}f}"
    exact = Decimal(value)
    wanted = max(places, DIGITS_MIN - 1 - exact.adjusted(), 0)
    if wanted <= PLAIN_DIGITS_MAX and exact.adjusted() < PLAIN_DIGITS_MAX:
        return f"{exact.quantize(Decimal(1).scaleb(-wanted), ROUND_HALF_UP):f}"
    figure = exact.scaleb(-exact.adjusted()).quantize(Decimal(1).scaleb(1 - DIGITS_MIN), ROUND_HALF_UP)
    carried = figure.adjusted()  # rounding may add a digit: 9.996 becomes 10.00
    mantissa = figure.scaleb(-carried).quantize(Decimal(1).scaleb(1 - DIGITS_MIN), ROUND_HALF_UP)
    return f"{mantissa:f}e{exact.adjusted() + carried}"


def decimals(values: Iterable[float], digits: int = COLUMN_DIGITS) -> int:
    """Return the number of decimals with which all numbers of a column are written."""
    largest = max((abs(value) for value in values if math.isfinite(value)), default=0.0)
    before = Decimal(largest).adjusted() if largest else 0
    return min(max(digits - 1 - max(before, 0), 0), PLAIN_DIGITS_MAX)


def numerals(values: Iterable[float], digits: int = COLUMN_DIGITS) -> list[str]:
    """Return the numbers of a column as texts with equal decimals."""
    every = [float(value) for value in values]
    places = decimals(every, digits)
    return [numeral(value, places) for value in every]
