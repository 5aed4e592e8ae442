"""Lobatto's rule of four nodes and its extension to seven on [0, 1] (Gander and Gautschi 2000, doi:10.1023/A:1022318402393).

Rules without nodes at the ends do not see a kink near an end, after the last node or before the first one.
"""

from __future__ import annotations

import math

import numpy as np

from scissordyn.tolerance import EVENT_TOL

_OUTER, _INNER = 0.5 - 0.5 * math.sqrt(2.0 / 3.0), 0.5 - 0.5 / math.sqrt(5.0)

# First three of the seven weights of the Lobatto-Kronrod rule on 0 .. 1
_WEIGHT = (77 / 1470 / 2, 432 / 1470 / 2, 625 / 1470 / 2)

# nodes of the seven-point rule on 0 .. 1; the outer ones lie inside jumps at the ends
NODES = np.array([EVENT_TOL, _OUTER, _INNER, 0.5, 1.0 - _INNER, 1.0 - _OUTER, 1.0 - EVENT_TOL])
WEIGHTS = np.array([*_WEIGHT, 672 / 1470 / 2, *_WEIGHT[::-1]])  # weights of the seven-point rule, exact up to degree 9

# weights of the four-point rule for error estimates, exact up to degree 5
COARSE_WEIGHTS = np.array([1 / 12, 0.0, 5 / 12, 0.0, 5 / 12, 0.0, 1 / 12])
