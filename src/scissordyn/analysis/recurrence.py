"""Recurrence plots: pairs of samples at which a motion returns to an earlier state."""

from __future__ import annotations

import math

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike
from scipy.spatial.distance import cdist

from scissordyn.analysis.variable import dataset_variable, finite_numbers
from scissordyn.errors import InputError


def recurrence(
    values: ArrayLike,
    *,
    threshold: float | None = None,
    dimension: int = 1,
    delay: int = 1,
    shortest: int = 2,
    apart: int = 1,
    most: int = 5000,
) -> xr.Dataset:
    r"""Compute the recurrence plot, its recurrence rate and its determinism.

    .. math::
        R_{ij} = 1 \text{ if } \|x_i - x_j\| \le \text{threshold},\quad
        x_i = (v_i, v_{i+\text{delay}}, \dots, v_{i+(\text{dimension}-1)\,\text{delay}})

    The recurrence rate is the fraction of ones. Determinism is the fraction of the ones that lie on diagonal lines of at least
    `shortest` points: times at which the motion returned and then repeated itself. Both exclude indices that differ by less
    than `apart`. Both depend on the threshold, so compare them only at the same one.

    Periodic motion has determinism 1. Quasi-periodic motion has nearly 1 if enough quantities or dimensions unfold it, exactly
    1 for the rotation of a circle, as distances are Euclidean. A projection has isolated false recurrences. Independent noise
    has 2 RR - RR^2 for lines of two; chaotic maps lie in between.

    Parameters
    ----------
    values : array_like, shape (n,) or (n, quantities)
        Values; quantities of different units must be scaled first.
    threshold : float, optional
        Largest distance of recurrent states, in the unit of the values; by default 0.2 of their standard deviation.
    dimension, delay : int
        Dimension and delay of the embedding (Takens 1981).
    shortest : int
        Number of points of the shortest line.
    apart : int
        Smallest difference of indices of a recurrence (Theiler 1986).
    most : int
        Largest number of samples n; it limits the memory of the n x n recurrence matrix.

    Returns
    -------
    Dataset
        `recurrent` along `first` and `second`, `recurrence_rate`, `determinism`, `longest_line`; attribute `threshold`.

    Raises
    ------
    InputError
        If there are fewer than 10 samples or more than `most`, or an option is out of bounds.

    References
    ----------
    Eckmann, Kamphorst and Ruelle 1987, doi:10.1209/0295-5075/4/9/004; Marwan et al. 2007, doi:10.1016/j.physrep.2006.11.001
    """
    if min(dimension, delay, apart) < 1 or shortest < 2:
        raise InputError(
            f"dimension = {dimension!r}, delay = {delay!r}, shortest = {shortest!r}, apart = {apart!r}",
            "whole numbers >= 1, shortest >= 2",
        )
    table = finite_numbers(values, least=10 + (dimension - 1) * delay, dimensions=2)
    count = table.shape[0] - (dimension - 1) * delay
    if count > most:
        raise InputError(f"a recurrence plot of {count} samples", f"at most {most} samples", "values[-2000:]")
    if apart >= count:
        raise InputError(f"apart = {apart!r} for {count} embedded states", f"an index difference of at most {count - 1}")
    near = 0.2 * math.sqrt(float(np.sum(np.var(table, axis=0)))) if threshold is None else threshold
    if not (math.isfinite(near) and near >= 0.0):
        raise InputError(f"threshold = {near!r}", "a number >= 0 in the unit of the values")
    embedded = np.concatenate([table[k * delay : k * delay + count] for k in range(dimension)], axis=1)
    recurrent = cdist(embedded, embedded, "euclidean") <= near
    lines = _lines(recurrent, apart)
    points, on_lines = int(np.sum(lines)), int(np.sum(lines[lines >= shortest]))
    pairs = (count - apart) * (count - apart + 1) // 2
    return xr.Dataset(
        {
            "recurrent": dataset_variable(("first", "second"), recurrent, "1", "recurrence"),
            "recurrence_rate": dataset_variable((), points / pairs, "1", "fraction of the pairs of samples that recur"),
            "determinism": dataset_variable(
                (), on_lines / points if points else math.nan, "1", "fraction of recurrences on lines"
            ),
            "longest_line": dataset_variable((), int(np.max(lines, initial=0)), "1", "points of the longest line"),
        },
        attrs={"threshold": near, "dimension": dimension, "delay": delay, "shortest": shortest, "apart": apart},
    )


def _lines(recurrent: np.ndarray, apart: int) -> np.ndarray:
    """Return the lengths of all diagonal lines [points], `apart` or more from the main diagonal; single points are lines."""
    lengths = []
    for offset in range(apart, len(recurrent)):
        diagonal = np.diagonal(recurrent, offset)
        edges = np.flatnonzero(np.diff(np.concatenate([[False], diagonal, [False]]).astype(np.int8)))
        lengths.append(edges[1::2] - edges[::2])
    return np.concatenate(lengths)
