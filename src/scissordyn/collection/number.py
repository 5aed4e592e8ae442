"""A number that a right program gives for a mechanism: where it is in a run, how large it is, and who says so."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from scissordyn.annotation import is_number
from scissordyn.config.quantity import read_quantity
from scissordyn.config.table import located
from scissordyn.errors import InputError, did_you_mean
from scissordyn.units import Quantity

if TYPE_CHECKING:
    import xarray as xr

Origin = Literal["closed form", "published", "second formulation", "this program"]  # Who says how large a number is
BETWEEN = 1e-6  # Samples are at an instant if they are no farther from it than this fraction of their distance


@dataclass(frozen=True)
class Number:
    """A number of a run, and how large it should be."""

    what: str  # In words
    variable: str  # Of the run
    where: Mapping[str, str | int]  # Names, or indices from 0, along its dimensions but for time
    # An instant with its unit, which has to be one of the samples, "start", "end", "largest" or "smallest"; empty for a
    # variable without time
    at: str
    value: str  # With their units: how large it is, and the largest difference
    tolerance: str
    origin: Origin  # See `Origin`
    reason: str  # The formula, the publication, or the other program
    ideal: bool = True  # Whether it is a number of the mechanism with ideal joints

    def measure(self, run: xr.Dataset) -> Found:
        """The number in a run, compared with what it should be."""
        with located(f"number '{self.what}'"):
            if self.variable not in run:
                near = did_you_mean(self.variable, map(str, run.variables))
                raise InputError(f"no variable '{self.variable}'{near}", "a variable of the run")
            values = self._selected(run)
            unit = str(values.attrs.get("units", "1"))
            expected, tolerance = (_read(text, unit) for text in (self.value, self.tolerance))
            if values.ndim:
                raise InputError(f"'{self.variable}' along {', '.join(map(str, values.dims))}", "a name along each in `where`")
            return Found(self, float(values), expected, tolerance, unit)

    def _selected(self, run: xr.Dataset) -> xr.DataArray:
        values = run[self.variable]
        for dim, chosen in self.where.items():
            if dim not in values.dims:
                raise InputError(f"'{self.variable}' along '{dim}'", ", ".join(map(str, values.dims)))
            labels = [] if isinstance(chosen, int) else values[dim].values.astype(str).tolist()
            index = chosen if isinstance(chosen, int) else labels.index(chosen) if chosen in labels else -1
            if not 0 <= index < values.sizes[dim]:
                allowed = ", ".join(labels) or f"0 to {values.sizes[dim] - 1}"
                raise InputError(f"no {dim} '{chosen}'{did_you_mean(str(chosen), labels)}", allowed)
            values = values.isel({dim: index})
        if "time" not in values.dims:
            return values
        if self.at in ("largest", "smallest"):
            reduced = values.max("time") if self.at == "largest" else values.min("time")
            return reduced.assign_attrs(values.attrs)
        return values.isel(time=_instant(run["time"].values, self.at))


@dataclass(frozen=True)
class Found:
    """What a run gives for a number."""

    number: Number
    found: float  # In the unit of the variable
    expected: float
    tolerance: float
    unit: str

    @property
    def difference(self) -> float:
        """Found less expected."""
        return self.found - self.expected

    @property
    def met(self) -> bool:
        """Whether the difference is within the tolerance."""
        return math.isfinite(self.found) and abs(self.difference) <= self.tolerance


def _read(text: str, unit: str) -> float:
    """A number with its unit, in SI."""
    try:
        return read_quantity(float(text) if unit == "1" and is_number(_plain(text)) else text, Quantity(unit))
    except InputError as error:
        raise InputError(f"'{text}': {error.what}", error.allowed or f"a number in {unit}") from None


def _plain(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text


def _instant(times: np.ndarray, at: str) -> int:
    """The index of an instant among the samples."""
    if at in ("start", "end"):
        return 0 if at == "start" else len(times) - 1
    wanted = read_quantity(at, Quantity("s"))
    index = int(np.argmin(np.abs(times - wanted)))
    if abs(times[index] - wanted) > BETWEEN * (times[-1] - times[0]) / max(len(times) - 1, 1):
        raise InputError(f"at = '{at}' is between the samples", f"an instant such as {times[index]:.9g} s")
    return index
