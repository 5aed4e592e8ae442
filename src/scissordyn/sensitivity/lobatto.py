"""Lobatto's rule of four nodes and its extension to seven on [0, 1] (Gander and Gautschi 2000, doi:10.1023/A:1022318402393).

Rules without nodes at the ends do not see a kink near an end, after the last node or before the first one.
"""

from __future__ import annotations

import math

import numpy as np

END_OFFSET = 1e-10  # Distance of the outer nodes from the ends, where a jump at an end does not count

_OUTER, _INNER = 0.5 - 0.5 * math.sqrt(2.0 / 3.0), 0.5 - 0.5 / math.sqrt(5.0)
_WEIGHT = (77 / 1470 / 2, 432 / 1470 / 2, 625 / 1470 / 2)

NODES = np.array([END_OFFSET, _OUTER, _INNER, 0.5, 1.0 - _INNER, 1.0 - _OUTER, 1.0 - END_OFFSET])
WEIGHTS = np.array([*_WEIGHT, 672 / 1470 / 2, *_WEIGHT[::-1]])  # exact up to degree 9
COARSE_WEIGHTS = np.array([1 / 12, 0.0, 5 / 12, 0.0, 5 / 12, 0.0, 1 / 12])  # exact up to degree 5
