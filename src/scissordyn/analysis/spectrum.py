"""Power spectrum of a signal and its dominant frequencies."""

from __future__ import annotations

import math

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike
from scipy import signal

from scissordyn.analysis.variable import dataset_variable, finite_numbers
from scissordyn.errors import InputError
from scissordyn.units import checked


@checked
def spectrum(
    values: ArrayLike,
    *,
    spacing: float,
    segments: int = 4,
    peaks: int = 5,
    window: str = "hann",
    unit: str = "1",
    dominance: float = 10.0,
) -> xr.Dataset:
    """Compute the one-sided power spectral density by Welch's method, and its dominant frequencies.

    The signal is cut into `segments` that overlap by half. The mean is subtracted, the segments are windowed, and their
    periodograms are averaged. The integral of the density is the variance of the signal. Peaks are refined by a parabola
    through the logarithms of three neighbours, accurate to about a twentieth of the resolution 1/(length of a segment).

    Parameters
    ----------
    values : array_like, shape (n,)
        Equally spaced samples.
    spacing : float
        Time between samples [s], or 1 for a map.
    segments : int
        Number of segment lengths in the signal; more segments give less scatter and less resolution.
    peaks : int
        Largest number of dominant frequencies.
    dominance : float
        Smallest power density of a dominant frequency, relative to the median density.
    window : str
        Name of a window of scipy.signal.
    unit : str
        Unit of the values.

    Returns
    -------
    Dataset
        `power_density` along `frequency`; `dominant_frequency` and `dominant_density` along `peak`, strongest first;
        `flatness`, the geometric mean of the density divided by the arithmetic mean: near 0 for lines, 0.56 for one periodogram
        of white noise, approaching 1 with more segments.

    Raises
    ------
    InputError
        If there are fewer than 16 samples, or an option is out of bounds.

    References
    ----------
    Welch 1967, doi:10.1109/TAU.1967.1161901
    """
    signal_values = finite_numbers(values, least=16)
    if not (math.isfinite(spacing) and spacing > 0.0) or not 1 <= segments <= signal_values.size // 8 or peaks < 0:
        raise InputError(
            f"spacing = {spacing!r}, segments = {segments!r}, peaks = {peaks!r}",
            f"spacing > 0, segments from 1 to {signal_values.size // 8} for {signal_values.size} samples, peaks >= 0",
        )
    frequency, density = signal.welch(
        signal_values,
        fs=1.0 / spacing,
        window=window,
        nperseg=signal_values.size // segments,
        detrend="constant",
        scaling="density",
    )
    inside = density[1:]
    top = float(np.max(inside))
    flatness = math.nan
    if top > 0.0:
        # keeps round-off of a pure tone and exact zeros out of the geometric mean
        floored = np.maximum(inside, top * np.finfo(float).eps ** 2)
        flatness = float(np.exp(np.mean(np.log(floored))) / np.mean(floored))
    where, _ = signal.find_peaks(density, height=max(dominance * float(np.median(inside)), 1e-12 * top))
    where = where[np.argsort(-density[where], kind="stable")][:peaks]
    left, middle, right = (np.log(np.maximum(density[where + k], 1e-300)) for k in (-1, 0, 1))
    bend = left - 2.0 * middle + right
    shift = np.divide(0.5 * (left - right), bend, out=np.zeros_like(bend), where=bend != 0.0)
    pitch = "Hz" if spacing != 1.0 else "1"
    per = f"({unit})^2 s" if spacing != 1.0 else f"({unit})^2"
    return xr.Dataset(
        {
            "power_density": dataset_variable(("frequency",), density, per, "power spectral density"),
            "dominant_frequency": dataset_variable(("peak",), (where + shift) * frequency[1], pitch, "dominant frequency"),
            "dominant_density": dataset_variable(("peak",), density[where], per, "power density at a dominant frequency"),
            "flatness": dataset_variable((), flatness, "1", "spectral flatness"),
        },
        coords={"frequency": dataset_variable(("frequency",), frequency, pitch, "frequency")},
        attrs={"spacing": spacing, "segments": segments, "window": window},
    )
