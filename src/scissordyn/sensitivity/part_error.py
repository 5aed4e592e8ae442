"""Estimate the errors of derivatives in a step, or a part of it, that is repeated in dual numbers."""

from __future__ import annotations

import math

from scissordyn.integrate.step import add_rows
from scissordyn.integrate.tableau import EXPLICIT
from scissordyn.kernel import derivative, kernel, value_of

PARTS_MAX = 1000  # Largest number of parts, with rejected ones, into which a step is divided for accurate derivatives
PART_MIN_FRACTION = 1e-7  # [steps] shortest part of a step that is divided for accurate derivatives; its error is negligible

WEIGHT_FACTOR = 10.0
"""Largest absolute error of a derivative in a step, as a multiple of the absolute error weight of the value.

The derivative is by the parameter divided by its scale.
"""


@kernel
def part_error(T, h, reverses, run, s, w):
    """Return the largest error of the derivatives in a step, relative to the allowed one; NaN if one is NaN.

    The error control of the values does not notice a kink of a law or controller, because a kink changes the derivatives much
    more than the values. Coordinates and rates count always, internal states where a sliding reverses; elsewhere those of
    friction relax.
    """
    worst = 0.0
    rows, scale = (T.stages + 1, value_of(h)) if T.kind == EXPLICIT else (T.stages, 1.0)
    for which in range(1 + T.combined):
        for i in range(s.y.size):
            w.estimate[which, i] = 0.0
        add_rows(scale, T.error[which], rows, w.stages, w.estimate[which])
    groups = w.group.size - 1 if reverses else min(2, w.group.size - 1)
    for g in range(groups):
        start, stop = w.group[g], w.group[g + 1]
        for k in range(run.parameters[0]):
            error = other = size = weight = 0.0
            for i in range(start, stop):
                error += derivative(w.estimate[0, i], k) ** 2
                other += derivative(w.estimate[1, i], k) ** 2
                size += max(derivative(s.y[i], k) ** 2, derivative(w.new[i], k) ** 2)
                weight = max(weight, value_of(w.atol[i]) + value_of(w.rtol[i]) * abs(value_of(s.y[i])))
            if error == 0.0:
                continue
            if T.combined == 1:
                error = error * error / (error + 0.01 * other)
            ratio = math.sqrt(error) / (run.tolerance[0] * math.sqrt(size) + WEIGHT_FACTOR * weight)
            if not ratio <= worst:
                worst = ratio
                if worst != worst:
                    return worst
    return worst
