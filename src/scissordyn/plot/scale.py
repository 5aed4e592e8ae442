"""Engineering scales: ms, mm, kN in place of powers of ten."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

__all__ = ["DEGREES", "Scale", "engineering"]

PREFIXES = {-12: "p", -9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}

PREFIXED = {"m": (-9, 0), "s": (-9, 0), "N": (-12, 9), "N m": (-12, 9), "J": (-12, 9), "W": (-12, 9), "Pa": (0, 9)}
"""Units that take a prefix, and the smallest and largest power of ten that engineers give one for."""

SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


@dataclass(frozen=True)
class Scale:
    """How numbers in SI units are shown.

    Parameters
    ----------
    factor : float
        Shown number per number in SI units.
    unit : str
        What the shown numbers are in; "" for pure numbers.
    """

    factor: float
    unit: str

    def label(self, quantity: str) -> str:
        """A quantity with its unit, for an axis."""
        return f"{quantity} [{self.unit}]" if self.unit else quantity


DEGREES = Scale(180.0 / math.pi, "deg")


def engineering(unit: str, *values: ArrayLike) -> Scale:
    """The scale at which the largest of the values has one to three digits before the point.

    Parameters
    ----------
    unit : str
        SI unit of the values, such as "N m" or "rad/s^2".
    *values : array_like
        What is to be shown together; what is not finite is passed over.

    Returns
    -------
    Scale
        A prefix where the unit takes one, a power of ten where it does not.
    """
    largest = max(
        (float(np.max(np.abs(part), initial=0.0, where=np.isfinite(part))) for part in map(np.asarray, values)), default=0.0
    )
    # 0.9999995 counts as 1, so that rounding noise in a value of 1 m does not turn metres into millimetres
    power = 3 * math.floor(math.log10(largest * (1.0 + 1e-6)) / 3.0) if largest > 0.0 else 0
    shown = "" if unit == "1" else unit.replace("^2", "²").replace("^3", "³").replace(" ", "·")
    if unit in PREFIXED:
        low, high = PREFIXED[unit]
        power = min(max(power, low), high)
        return Scale(10.0**-power, PREFIXES[power] + shown)
    if power in (0, -3):  # thousandths read well as decimals
        return Scale(1.0, shown)
    return Scale(10.0**-power, f"10{str(power).translate(SUPERSCRIPT)} {shown}".rstrip())
