"""Tests of two samples: Kolmogorov and Smirnov for one value, energy distance for several, signed ranks for pairs."""

from __future__ import annotations

import numpy as np
from scipy.spatial.distance import cdist

__all__ = ["energy_distance", "energy_test"]


def energy_distance(one: np.ndarray, other: np.ndarray) -> float:
    """Return the energy distance of two samples, zero for equal distributions (Székely and Rizzo 2013).

    Samples have the shape (values, numbers).
    """
    return float(2.0 * cdist(one, other).mean() - cdist(one, one).mean() - cdist(other, other).mean())


def energy_test(one: np.ndarray, other: np.ndarray, *, permutations: int = 999, seed: int = 1) -> tuple[float, float]:
    """Return the energy distance of two samples, and the fraction of permutations of both with one as large.

    Parameters
    ----------
    one, other : ndarray, shape (values, numbers)
        Columns are divided by their standard deviation in both samples.
    permutations, seed : int

    Returns
    -------
    (float, float)
        Distance and p.
    """
    every = np.concatenate([one, other])
    every = every / every.std(axis=0)
    apart, count = cdist(every, every), len(one)
    random = np.random.default_rng(seed)

    def distance(order: np.ndarray) -> float:
        here, there = order[:count], order[count:]
        within = apart[np.ix_(here, here)].mean() + apart[np.ix_(there, there)].mean()
        return float(2.0 * apart[np.ix_(here, there)].mean() - within)

    found = distance(np.arange(len(every)))
    as_large = sum(distance(random.permutation(len(every))) >= found for _ in range(permutations))
    return found, (as_large + 1) / (permutations + 1)
