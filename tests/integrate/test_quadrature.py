"""Gauss nodes inside a step against moments."""

import numpy as np
import pytest

from scissordyn.integrate.quadrature import gauss_nodes, primitives
from scissordyn.integrate.tableau import METHODS, tableau


@pytest.mark.parametrize("points", range(2, 7))
def test_whole_step(points):
    """Closed form: the integral of theta^k over the step is 1/(k+1) up to degree 2 points - 1, and no longer beyond."""
    nodes = gauss_nodes(points)
    weights = primitives(nodes).sum(axis=1)
    for degree in range(2 * points):
        assert weights @ nodes**degree == pytest.approx(1.0 / (degree + 1), abs=1e-13)
    assert abs(weights @ nodes ** (2 * points) - 1.0 / (2 * points + 1)) > 1e-8


@pytest.mark.parametrize("points", range(2, 7))
def test_part_of_a_step(points):
    """Closed form: up to theta the integral of a polynomial through the nodes is exact up to degree points - 1."""
    nodes = gauss_nodes(points)
    table = primitives(nodes)
    assert np.all((nodes > 0.0) & (nodes < 1.0))
    for theta in (0.0, 0.3, 1.0):
        powers = theta ** np.arange(1, points + 1)
        for degree in range(points):
            found = (table @ powers) @ nodes**degree
            assert found == pytest.approx(theta ** (degree + 1) / (degree + 1), abs=1e-13)


@pytest.mark.parametrize("name", METHODS[2:])
def test_rule_of_a_method(name):
    """Closed form: the moments that a rule of one node more than the dense output has rows integrates exactly."""
    method = tableau(name)
    degree = 2 * method.dense.shape[0] + 1
    assert method.weight @ method.gauss**degree == pytest.approx(1.0 / (degree + 1), abs=1e-13)
    assert np.sum(method.weight) == pytest.approx(1.0, abs=1e-14)
