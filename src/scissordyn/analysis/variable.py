"""Common parts of the measures: described variables, the window of time, and checks of arrays."""

from __future__ import annotations

import math

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from scissordyn.errors import InputError

Variable = tuple[tuple[str, ...], np.ndarray, dict[str, str]]


def described(dims: tuple[str, ...], values: ArrayLike, units: str, long_name: str) -> Variable:
    """A variable of a Dataset with its unit and long name."""
    return dims, np.asarray(values), {"units": units, "long_name": long_name}


def window(run: xr.Dataset, after: float, until: float | None) -> tuple[float, float]:
    """The window of a run."""
    first, last = float(run["time"].values[0]), float(run["time"].values[-1])
    end = last if until is None else until
    if not (math.isfinite(after) and math.isfinite(end) and after < end <= last * (1.0 + 1e-12)) or end <= first:
        raise InputError(
            f"a window from {after:g} s to {end:g} s of a run from {first:g} s to {last:g} s",
            "a window inside the run, its end after its start",
        )
    return max(after, first), end


def series(values: ArrayLike, *, least: int) -> np.ndarray:
    """Numbers as a finite array of one dimension.

    Shapes: `values` (n,); returns (n,).
    """
    numbers = np.asarray(values, float)
    if numbers.ndim != 1 or numbers.size < least or not np.all(np.isfinite(numbers)):
        raise InputError(
            f"values of shape {numbers.shape}{'' if np.all(np.isfinite(numbers)) else ', not all finite'}",
            f"one dimension of at least {least} finite numbers",
        )
    return numbers


def as_table(values: ArrayLike, *, least: int) -> np.ndarray:
    """Numbers as a finite array of two dimensions: a row a sample, a column a quantity.

    Shapes: `values` (n,); returns (n, quantities).
    """
    numbers = np.asarray(values, float)
    table = numbers[:, None] if numbers.ndim == 1 else numbers
    if table.ndim != 2 or table.shape[0] < least or table.shape[1] == 0 or not np.all(np.isfinite(table)):
        raise InputError(
            f"samples of shape {numbers.shape}{'' if np.all(np.isfinite(numbers)) else ', not all finite'}",
            f"at least {least} samples, each of one or several finite numbers",
        )
    return table
