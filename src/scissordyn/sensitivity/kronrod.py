"""Gauss's rule of three nodes and Kronrod's of seven on [0, 1] (Kronrod, Nodes and Weights of Quadrature Formulas, 1965)."""

from __future__ import annotations

import numpy as np

_OUTER, _GAUSS, _INNER = 0.019754365645989858, 0.11270166537925831, 0.28287812532659872  # Nodes before the middle
_WEIGHT = 0.052328113013233632, 0.13424404493416672, 0.20069870738798111

NODES = np.array([_OUTER, _GAUSS, _INNER, 0.5, 1.0 - _INNER, 1.0 - _GAUSS, 1.0 - _OUTER])
WEIGHTS = np.array([*_WEIGHT, 0.22545826932923707, *_WEIGHT[::-1]])  # exact up to degree 11
GAUSS_WEIGHTS = np.array([0.0, 5 / 18, 0.0, 4 / 9, 0.0, 5 / 18, 0.0])  # exact up to degree 5
