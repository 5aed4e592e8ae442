"""Nodes and coefficients that kernels contain, against many digits of another library."""

import math

import numpy as np
import pytest
from mpmath import mp

from scissordyn.components.film.impedance import DIRECTION_SPAN, DIRECTION_WIDTH
from scissordyn.integrate.history import CHEBYSHEV_NODES, TRANSFORM
from scissordyn.interpolation import gauss_rule, lagrange_polynomials


@pytest.mark.parametrize("points", [1, 2, 3, 4, 5, 6, 16, 25])
def test_gauss_rule_is_correctly_rounded(points):
    """Cross-check: each node and weight is the float nearest to the root of Legendre's polynomial found by bracketing."""
    with mp.workdps(50):
        half = [(k - 0.25) / (points + 0.5) for k in range(points // 2, 0, -1)]  # [pi] around positive roots
        ends = [(math.cos(math.pi * (x + 0.05 / points)), math.cos(math.pi * (x - 0.05 / points))) for x in half]
        positive = [mp.findroot(lambda x: mp.legendre(points, x), pair, solver="anderson") for pair in ends]
        roots = [-x for x in reversed(positive)] + [mp.mpf(0)] * (points % 2) + positive
        weights = [(1 - x**2) / (points * mp.legendre(points - 1, x)) ** 2 for x in roots]
        nodes = [float((1 + x) / 2) for x in roots]
        found = gauss_rule(points)
        assert found[0].tolist() == nodes
        assert found[1].tolist() == [float(weight) for weight in weights]


def test_lagrange_polynomials_at_their_nodes():
    """Identity: 1 at the own node and 0 at the others."""
    nodes = (-0.7, 0.1, 0.3, 2.0)
    rows = np.array(lagrange_polynomials(nodes), float)
    values = rows @ np.array(nodes) ** np.arange(4)[:, None]
    assert values == pytest.approx(np.eye(4), abs=1e-14)


def test_transform_inverts_the_powers_of_its_nodes():
    """Cross-check: nodes are Chebyshev's, and the transform is the inverse of their powers, rounded once."""
    with mp.workdps(50):
        assert [float(-mp.cos(k * mp.pi / 7)) for k in range(8)] == CHEBYSHEV_NODES.tolist()
        inverse = mp.inverse(mp.matrix([[mp.mpf(x) ** k for k in range(8)] for x in CHEBYSHEV_NODES.tolist()]))
        assert [[float(inverse[i, j]) for j in range(8)] for i in range(8)] == TRANSFORM.tolist()


def test_range_of_directions():
    """Closed form: the nodes of the film's table reach a quarter turn to both sides."""
    assert DIRECTION_WIDTH * math.sinh(DIRECTION_SPAN) == pytest.approx(0.5 * math.pi, rel=1e-15)
