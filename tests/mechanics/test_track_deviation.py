"""Deviation of a tracked point between the nodes of its ideal path, which polynomials of degree five follow exactly."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from scissordyn.mechanics.monitored import track_deviation
from scissordyn.record.ideal_path import quintic

STEP, NODES = 0.2, 4  # Distance of the nodes [s] and their number
# x and y of a path over time
POLYNOMIALS = (
    np.polynomial.Polynomial([0.3, -1.0, 2.0, 0.5, -4.0, 3.0]),
    np.polynomial.Polynomial([1.0, 0.2, -3.0, 1.5, 2.0, -6.0]),
)


def table():
    """Return position, velocity and acceleration of two points at the nodes; the first one is at rest."""
    found = np.zeros((NODES, 12))
    for node in range(NODES):
        for order in range(3):
            found[node, 6 + 2 * order : 8 + 2 * order] = [p.deriv(order)(node * STEP) for p in POLYNOMIALS]
    return found


def deviation(t, x, y):
    """Return the deviation of a point at (x, y), the second tracked one."""
    model = SimpleNamespace(track_start=np.array([0, 0, 2]), track_row=np.eye(2), track_column=np.array([0, 1]))
    parameters = SimpleNamespace(ideal=table(), ideal_step=np.array([STEP]))
    state = SimpleNamespace(model=model, parameters=parameters, work=SimpleNamespace(X=np.array([x, y])))
    return float(track_deviation(t, 1, state))


@pytest.mark.parametrize("t", [0.0, 0.05, 0.1, 0.33, 0.4, 0.47, 0.6])
def test_deviation_from_a_path_of_degree_five(t):
    """Closed form: nodes with velocity and acceleration reproduce the polynomial; an offset is the deviation."""
    x, y = (float(p(t)) for p in POLYNOMIALS)
    assert deviation(t, x, y) < 1e-13
    assert deviation(t, x + 3e-3, y - 4e-3) == pytest.approx(5e-3, rel=1e-9)
    node = min(int(t / STEP), NODES - 2)
    a, b = (table()[k, 6:].reshape(3, 2) for k in (node, node + 1))
    np.testing.assert_allclose(quintic(t / STEP - node, STEP, a, b), [x, y], atol=1e-13)


def test_no_deviation_beyond_the_path():
    """Contract: beyond the known path the deviation is zero."""
    assert deviation((NODES - 1) * STEP + 0.01, 9.0, 9.0) == 0.0
    assert math.isfinite(deviation((NODES - 1) * STEP, 9.0, 9.0))
