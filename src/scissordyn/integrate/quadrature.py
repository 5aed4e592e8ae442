"""Gauss nodes of a step, and the integral of a rate up to any point inside it."""

from __future__ import annotations

import numpy as np


def gauss_nodes(points: int) -> np.ndarray:
    """Gauss-Legendre nodes on [0, 1], exact for rates of degree 2 points - 1 over the whole step."""
    return 0.5 * (np.polynomial.legendre.leggauss(points)[0] + 1.0)


def primitives(nodes: np.ndarray) -> np.ndarray:
    """Integrals from 0 to theta of the Lagrange polynomials on some nodes.

    Shapes: `nodes` (k,); returns (k, k).
    """
    rows = []
    for i, node in enumerate(nodes):
        others = np.delete(nodes, i)
        basis = np.polynomial.Polynomial.fromroots(others) / float(np.prod(node - others))
        rows.append(basis.integ().coef[1:])
    return np.array(rows)
