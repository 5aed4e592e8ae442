"""Numbers with engineering prefixes and significant digits."""

from __future__ import annotations

import math

import numpy as np

from scissordyn.units import prefix

__all__ = ["column"]


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
