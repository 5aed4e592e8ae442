"""Gauss nodes of a step, and the integral of a rate up to any point inside it."""

from __future__ import annotations

import numpy as np

__all__ = ["NODES", "PRIMITIVE"]

POINTS = 4
"""Exact for rates of degree 7; the rate inside the step is the polynomial through the nodes."""

NODES: np.ndarray = 0.5 * (np.polynomial.legendre.leggauss(POINTS)[0] + 1.0)
"""Gauss-Legendre nodes on [0, 1]."""


def _primitives() -> np.ndarray:
    """Row k: integral from 0 to theta of the k-th Lagrange polynomial, as coefficients of theta, theta^2, ..."""
    rows = []
    for k, node in enumerate(NODES):
        others = np.delete(NODES, k)
        basis = np.polynomial.Polynomial.fromroots(others) / float(np.prod(node - others))
        rows.append(basis.integ().coef[1:])
    return np.array(rows)


PRIMITIVE: np.ndarray = _primitives()
