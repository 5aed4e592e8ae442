"""Gauss and Kronrod's rule of three and seven nodes on [0, 1] (Kronrod, Nodes and Weights of Quadrature Formulas, 1965)."""

from __future__ import annotations

import numpy as np

_HALF = (0.960491268708020283, 0.774596669241483377, 0.434243749346802558)  # Positive nodes on [-1, 1]
_OUTER, _MIDDLE = (0.104656226026467265, 0.268488089868333441, 0.401397414775962223), 0.450916538658474142

NODES = 0.5 + 0.5 * np.array([*(-x for x in _HALF), 0.0, *_HALF[::-1]])
WEIGHTS = 0.5 * np.array([*_OUTER, _MIDDLE, *_OUTER[::-1]])  # exact up to degree 11
GAUSS_WEIGHTS = np.array([0.0, 5.0, 0.0, 8.0, 0.0, 5.0, 0.0]) / 18.0  # exact up to degree 5
