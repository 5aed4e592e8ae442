"""Engineering scales: ms, mm, kN in place of powers of ten."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from scissordyn.numeral import PREFIXES, numerals, prefix

if TYPE_CHECKING:
    import xarray as xr

PREFIXED = {"m": (-9, 0), "s": (-9, 0), "N": (-12, 9), "N m": (-12, 9), "J": (-12, 9), "W": (-12, 9), "Pa": (0, 9)}
"""Units that take a prefix, and the smallest and largest power of ten of their prefixes."""

SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


@dataclass(frozen=True)
class Scale:
    factor: float  # Shown number per number in SI units
    unit: str  # Unit of the shown numbers; "" for pure numbers
    labels: tuple[str, ...] = ()  # Names that are shown in place of the numbers 0, 1,

    def label(self, quantity: str) -> str:
        """A quantity with its unit, for an axis."""
        return f"{quantity} [{self.unit}]" if self.unit else quantity

    def text(self, value: float, digits: int = 4) -> str:
        """A number in SI units as a shown number, without the unit; or the name in its place."""
        if self.labels:
            return self.labels[round(value)] if math.isfinite(value) else "-"
        return f"{value * self.factor + 0.0:.{digits}g}"  # minus zero is zero

    def cells(self, *values: float, digits: int = 4) -> list[str]:
        """Numbers in SI units, or names, as the cells of a table, see `numeral.numerals`."""
        if self.labels:
            return [self.text(value) for value in values]
        return numerals([value * self.factor for value in values], digits)

    def cell(self, value: float, digits: int = 4) -> str:
        """One number in SI units as the cell of a table, with its unit."""
        return f"{self.cells(value, digits=digits)[0]} {self.unit}".rstrip()

    def with_unit(self, value: float, digits: int = 4) -> str:
        """A number in SI units as a shown number with its unit."""
        return f"{self.text(value, digits)} {self.unit}".rstrip()


DEGREES = Scale(180.0 / math.pi, "deg")


def engineering(unit: str, *values: ArrayLike) -> Scale:
    """The engineering scale of the largest of the values."""
    parts = [np.abs(np.asarray(part, float)) for part in values]
    largest = max((float(np.max(part, initial=0.0, where=np.isfinite(part))) for part in parts), default=0.0)
    shown = "" if unit == "1" else _printed(unit)
    if unit in PREFIXED:
        power = prefix(largest, *PREFIXED[unit], from_tenth=unit in ("m", "s"))
        return Scale(10.0**-power, PREFIXES[power] + shown)
    size = math.log10(largest) + 1e-9 if largest > 0.0 else 0.0
    if -3.0 <= size < 4.0:
        return Scale(1.0, shown)
    power = 3 * math.floor(size / 3.0)
    return Scale(10.0**-power, f"10{str(power).translate(SUPERSCRIPT)} {shown}".rstrip())


def _printed(unit: str) -> str:
    """A unit with raised powers and a dot for the product."""
    product = "·".join(unit.replace("**", "^").replace("*", " ").replace("/", " / ").split()).replace("·/·", "/")
    return product.replace("^2", "²").replace("^3", "³")


def scale_of(values: xr.DataArray) -> Scale:
    """The scale of a variable: the unit in which the user wrote it, degrees of an angle, an engineering one otherwise."""
    if "labels" in values.attrs:
        return Scale(1.0, "", tuple(values.attrs["labels"]))
    if values.attrs.get("shown_unit"):
        return Scale(1.0 / float(values.attrs["shown_scale"]), _printed(str(values.attrs["shown_unit"])))
    unit = str(values.attrs.get("units", "1"))
    return DEGREES if unit == "rad" else engineering(unit, values.values)
