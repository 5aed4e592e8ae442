"""Numbers with engineering prefixes and significant digits."""

from __future__ import annotations

import math

import numpy as np

__all__ = ["column", "prefix", "short"]

PREFIXES = ((1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"), (1e-12, "p"))


def prefix(largest: float) -> tuple[float, str]:
    """The factor and letter of the engineering prefix of a number."""
    if not (math.isfinite(largest) and largest > 0.0):
        return 1.0, ""
    return next(((factor, letter) for factor, letter in PREFIXES if largest >= factor), PREFIXES[-1])


def column(values: np.ndarray, unit: str, digits: int = 5) -> tuple[str, list[str]]:
    """A unit with its prefix, and the numbers with the same number of decimals; a dash for NaN.

    Parameters
    ----------
    values : ndarray
        In SI.
    unit : str
        SI unit; a prefix is put before it if it is a single name.
    digits : int
        Significant digits of the largest number.
    """
    finite = np.abs(values[np.isfinite(values)])
    largest = float(finite.max()) if finite.size else 0.0
    factor, letter = prefix(largest) if unit.isalpha() and unit != "deg" else (1.0, "")
    before = math.floor(math.log10(largest / factor)) + 1 if largest > 0.0 else 1
    decimals = max(0, digits - max(before, 1))
    return letter + unit, [f"{value / factor:.{decimals}f}" if math.isfinite(value) else "-" for value in values.tolist()]


def short(value: float, unit: str) -> str:
    """One number with its unit, to four digits."""
    factor, letter = prefix(abs(value))
    return f"{value / factor:.4g} {letter}{unit}"
