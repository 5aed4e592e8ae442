"""Helpers for measures of a motion: Dataset variables with units, time windows, and checks of arrays."""

from __future__ import annotations

import math

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from scissordyn.annotation import shown
from scissordyn.errors import InputError

Variable = tuple[tuple[str, ...], np.ndarray, dict[str, str]]


def dataset_variable(dims: tuple[str, ...], values: ArrayLike, units: str, long_name: str) -> Variable:
    """Return dimensions, values and attributes of a Dataset variable with a unit and a long name."""
    return dims, np.asarray(values), {"units": units, "long_name": long_name}


def window(run: xr.Dataset, after: float, until: float | None) -> tuple[float, float]:
    """Return start and end of a time window of a run [s]; raise `InputError` if it does not fit the run."""
    first, last = float(run["time"].values[0]), float(run["time"].values[-1])
    end = last if until is None else until
    if not (math.isfinite(after) and math.isfinite(end) and after < end <= last * (1.0 + 1e-12)) or end <= first:
        raise InputError(
            f"the window from {after:g} s to {end:g} s does not fit a run from {first:g} s to {last:g} s",
            "a window inside the run, its end after its start",
        )
    return max(after, first), end


def finite_numbers(values: ArrayLike, *, least: int, dimensions: int = 1) -> np.ndarray:
    """Return values as a finite array (n,) or, with two dimensions, (n, quantities): a row per sample."""
    try:
        numbers = np.asarray(values, float)
    except (TypeError, ValueError):
        raise InputError(f"values {shown(values)}", f"at least {least} samples, each a finite number") from None
    table = numbers[:, None] if numbers.ndim == 1 and dimensions == 2 else numbers
    finite = bool(np.all(np.isfinite(table)))
    if table.ndim != dimensions or table.shape[0] < least or not table.size or not finite:
        raise InputError(
            f"values of shape {numbers.shape}{'' if finite else ', not all finite'}",
            f"at least {least} samples, each {'a finite number' if dimensions == 1 else 'with one or several finite numbers'}",
        )
    return table
