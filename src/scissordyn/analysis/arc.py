"""The smallest arc of a circle with a given fraction of a distribution."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from scissordyn.errors import InputError


def smallest_arc(angles: ArrayLike, *, fraction: float = 1.0, weights: ArrayLike | None = None) -> float:
    """The smallest arc with a given fraction of the weight of points on a circle.

    With the angles sorted around the circle and w_i their weights, the smallest a_j - a_i with

        w_i + ... + w_j >= fraction sum w

    across the zero of the angle where that is shorter. The arc of all points is 2 pi
    less the largest gap (the circular range, Mardia and Jupp 2000, Directional Statistics, doi:10.1002/9780470316979).

    Shapes: `angles` (n,) [rad], `weights` (n,).
    """
    if not 0.0 < fraction <= 1.0:
        raise InputError(f"fraction = {fraction!r}", "a number > 0 and <= 1")
    around = np.mod(np.asarray(angles, float), 2.0 * np.pi)
    weight = np.ones_like(around) if weights is None else np.asarray(weights, float)
    if around.ndim != 1 or weight.shape != around.shape or np.any(weight < 0.0):
        raise InputError(
            f"angles of shape {around.shape} with weights of shape {weight.shape}", "one weight, not negative, per angle"
        )
    order = np.argsort(around[weight > 0.0])
    around, weight = around[weight > 0.0][order], weight[weight > 0.0][order]
    if not around.size:
        return float("nan")
    twice = np.concatenate([around, around + 2.0 * np.pi])
    cumulative = np.concatenate([[0.0], np.cumsum(np.concatenate([weight, weight]))])
    first = np.arange(around.size)
    # round-off in the sum must not require more points than there are
    needed = fraction * cumulative[around.size] * (1.0 - 1e-12)
    last = np.minimum(np.searchsorted(cumulative, cumulative[first] + needed, side="left") - 1, first + around.size - 1)
    return float(np.min(twice[last] - twice[first]))
