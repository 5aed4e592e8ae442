"""Largest Lyapunov exponent from the growth of a perturbation."""

from __future__ import annotations

import math

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from scissordyn.analysis.variable import dataset_variable
from scissordyn.errors import InputError


def exponent_from_growth(
    log_growth: ArrayLike, durations: ArrayLike, *, discard: int = 0, blocks: int = 20, unit: str = "1/s"
) -> xr.Dataset:
    """Compute the Lyapunov exponent from the growth of a perturbation that is rescaled to its initial size after each interval.

        lambda = sum ln(d_k / d_0) / sum T_k

    The standard error is that of the mean rate of blocks, assumed independent. It is too large for blocks shorter than a
    rotation of the perturbation, because growth in one block and decay in the next compensate. It is too small for blocks
    shorter than the correlation time of the motion. It does not include rare events later in the motion.

    Parameters
    ----------
    log_growth : array_like, shape (intervals,) or (intervals, members)
        ln(d_k / d_0), for one trajectory or for each of an ensemble.
    durations : array_like, shape (intervals,) or ()
        T_k [s], or 1 for a map.
    discard : int
        Intervals at the start, in which the perturbation aligns with the most unstable direction.
    blocks : int
        Number of blocks; an ensemble has at least one per member.
    unit : str
        Unit of the exponent: "1/s", or "1" per step of a map.

    Returns
    -------
    Dataset
        `running`, the estimate after each interval, with `time` along `interval`; `exponent`; `standard_error` (NaN with fewer
        than two blocks); `member_exponent` along `member`.

    Raises
    ------
    InputError
        If shapes do not fit, a duration is not positive, a growth is NaN, or no interval is left.

    References
    ----------
    Benettin, Galgani, Giorgilli and Strelcyn 1980, doi:10.1007/BF02128236
    """
    growth = np.asarray(log_growth, float)
    growth = growth[:, None] if growth.ndim == 1 else growth
    duration = np.broadcast_to(np.asarray(durations, float), growth.shape[:1])
    if growth.ndim != 2 or np.any(np.isnan(growth)) or not np.all(duration > 0.0) or blocks < 1:
        raise InputError(
            f"log_growth of shape {growth.shape}, durations of shape {np.shape(durations)}, blocks = {blocks!r}",
            "numbers per interval, or per interval and member; durations > 0; blocks >= 1",
        )
    if not 0 <= discard < growth.shape[0]:
        raise InputError(
            f"discard = {discard!r} of {growth.shape[0]} intervals", "a whole number >= 0, less than the intervals"
        )
    growth, duration = growth[discard:], duration[discard:]
    elapsed = np.cumsum(duration)
    size = min(math.ceil(blocks / growth.shape[1]), growth.shape[0])
    cut = np.array_split(np.arange(growth.shape[0]), size)
    rates = np.concatenate([np.sum(growth[part], axis=0) / np.sum(duration[part]) for part in cut])
    error = float(np.std(rates, ddof=1) / math.sqrt(rates.size)) if rates.size > 1 else math.nan
    members = np.sum(growth, axis=0) / elapsed[-1]
    running = np.cumsum(np.mean(growth, axis=1)) / elapsed
    return xr.Dataset(
        {
            "running": dataset_variable(("interval",), running, unit, "largest Lyapunov exponent so far"),
            "exponent": dataset_variable((), running[-1], unit, "largest Lyapunov exponent"),
            "standard_error": dataset_variable((), error, unit, "standard error of the exponent"),
            "member_exponent": dataset_variable(("member",), members, unit, "largest Lyapunov exponent of one trajectory"),
        },
        coords={
            "time": dataset_variable(
                ("interval",), elapsed, "s" if unit == "1/s" else "1", "time since the discarded intervals"
            )
        },
        attrs={"discard": discard, "blocks": rates.size},
    )
