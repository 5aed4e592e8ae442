"""Engineering scales: ms, mm or kN instead of powers of ten."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from scissordyn.numeral import PREFIXES, numerals, prefix

if TYPE_CHECKING:
    import xarray as xr

PREFIX_POWERS = {"m": (-9, 0), "s": (-9, 0), "N": (-12, 9), "N m": (-12, 9), "J": (-12, 9), "W": (-12, 9), "Pa": (0, 9)}
"""Powers of ten of the smallest and the largest prefix of each SI unit, for axis labels; other units have no prefix."""

# Translation table from digits and minus to superscripts, for powers of ten in axis labels
SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


@dataclass(frozen=True)
class Scale:
    factor: float  # Displayed value divided by the value in SI units
    unit: str  # Displayed unit; "" for dimensionless values
    labels: tuple[str, ...] = ()  # Names displayed instead of the values 0, 1, ...

    def label(self, quantity: str) -> str:
        """Return a quantity with its unit, as the label of an axis."""
        return f"{quantity} [{self.unit}]" if self.unit else quantity

    def text(self, value: float, digits: int = 4) -> str:
        """Return a value in SI units as displayed, without its unit; or the name that replaces it."""
        if self.labels:
            return self.labels[round(value)] if math.isfinite(value) else "-"
        return f"{value * self.factor + 0.0:.{digits}g}"  # minus zero is zero

    def cells(self, *values: float, digits: int = 4) -> list[str]:
        """Return values in SI units as the cells of a table, aligned by `numeral.numerals`; or the names that replace them."""
        if self.labels:
            return [self.text(value) for value in values]
        return numerals([value * self.factor for value in values], digits)

    def cell(self, value: float, digits: int = 4) -> str:
        """Return a value in SI units as the cell of a table, with its unit."""
        return f"{self.cells(value, digits=digits)[0]} {self.unit}".rstrip()

    def with_unit(self, value: float, digits: int = 4) -> str:
        """Return a value in SI units as displayed, with its unit."""
        return f"{self.text(value, digits)} {self.unit}".rstrip()


DEGREES = Scale(180.0 / math.pi, "deg")  # Conversion of angles from rad to deg in pictures


def engineering(unit: str, *values: ArrayLike) -> Scale:
    """Return the engineering scale of the largest magnitude among the values."""
    parts = [np.abs(np.asarray(part, float)) for part in values]
    largest = max((float(np.max(part, initial=0.0, where=np.isfinite(part))) for part in parts), default=0.0)
    shown = "" if unit == "1" else _printed(unit)
    if unit in PREFIX_POWERS:
        power = prefix(largest, *PREFIX_POWERS[unit], from_tenth=unit in ("m", "s"))
        return Scale(10.0**-power, PREFIXES[power] + shown)
    size = math.log10(largest) + 1e-9 if largest > 0.0 else 0.0
    if -3.0 <= size < 4.0:
        return Scale(1.0, shown)
    power = 3 * math.floor(size / 3.0)
    return Scale(10.0**-power, f"10{str(power).translate(SUPERSCRIPT)} {shown}".rstrip())


def _printed(unit: str) -> str:
    """Return a unit with superscript powers, and dots for products."""
    if " or " in unit:
        return " or ".join(map(_printed, unit.split(" or ")))
    product = "·".join(unit.replace("**", "^").replace("*", " ").replace("/", " / ").split()).replace("·/·", "/")
    return product.replace("^2", "²").replace("^3", "³")


def scale_of(values: xr.DataArray) -> Scale:
    """Return the scale of a variable: the user's unit, degrees for angles, or else an engineering scale."""
    if "labels" in values.attrs:
        return Scale(1.0, "", tuple(values.attrs["labels"]))
    if values.attrs.get("shown_unit"):
        return Scale(1.0 / float(values.attrs["shown_scale"]), _printed(str(values.attrs["shown_unit"])))
    unit = str(values.attrs.get("units", "1"))
    return DEGREES if unit == "rad" else engineering(unit, values.values)
