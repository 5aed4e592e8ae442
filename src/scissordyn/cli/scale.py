"""Numbers with engineering prefixes and significant digits."""

from __future__ import annotations

import numpy as np

from scissordyn.numeral import numerals
from scissordyn.units import prefix


def column(values: np.ndarray, unit: str, digits: int = 5) -> tuple[str, list[str]]:
    """A unit with its prefix, and the numbers as `numeral.numerals` writes them."""
    finite = np.abs(values[np.isfinite(values)])
    largest = float(finite.max()) if finite.size else 0.0
    factor, letter = prefix(largest) if unit.isalpha() and unit != "deg" else (1.0, "")
    return letter + unit, numerals((values / factor).tolist(), digits)
