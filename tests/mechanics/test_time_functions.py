"""Values and derivatives of time functions in kernels, compared with closed forms."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from scissordyn.mechanics import time_function

NEVER = -math.inf  # [s] start of a function that has no earlier piece

# Table of three time functions: 1 + 2 s - s^2 + 0.5 s^3; 3 until t = 1, then 3 + 4 s; a sine with mean 0.2
ROWS = np.array(
    [
        [0.5, 0.0, 0.0, 0.5, -1.0, 2.0, 1.0, 0.0, 0.0, 0.0],
        [NEVER, 0.0, 0.0, 0.0, 0.0, 0.0, 3.0, 0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0, 0.0, 0.0, 4.0, 3.0, 0.0, 0.0, 0.0],
        [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.2, 1.5, 7.0, 0.3],
    ]
)
STARTS = np.array([0, 1, 3, 4])  # Row at which each function begins, and the number of rows


def at(t, which, segment=(-math.inf, math.inf)):
    """Return the value and derivatives of one of the functions."""
    work = SimpleNamespace(function_value=np.zeros(4), segment=np.array(segment))
    state = SimpleNamespace(parameters=SimpleNamespace(motion=ROWS, motion_start=STARTS), work=work)
    time_function.motion_at(t, which, state)
    return work.function_value


@pytest.mark.parametrize("t", [0.7, 1.9])
def test_polynomial_and_its_derivatives(t):
    """Closed form: 1 + 2 s - s^2 + 0.5 s^3 and its three derivatives."""
    s = t - 0.5
    wanted = [1.0 + 2.0 * s - s**2 + 0.5 * s**3, 2.0 - 2.0 * s + 1.5 * s**2, -2.0 + 3.0 * s, 3.0]
    np.testing.assert_allclose(at(t, 0), wanted, rtol=1e-14)


def test_piece_of_a_function():
    """Closed form: before, at and after a break, and late, when the rows of the next function have begun."""
    np.testing.assert_allclose(at(0.9, 1), [3.0, 0.0, 0.0, 0.0])
    np.testing.assert_allclose(at(1.0, 1), [3.0, 4.0, 0.0, 0.0])
    np.testing.assert_allclose(at(5.0, 1), [19.0, 4.0, 0.0, 0.0])
    np.testing.assert_allclose(at(1.0, 1, (0.0, 1.0)), [3.0, 0.0, 0.0, 0.0])  # a step that ends at the break


def test_sine_and_its_derivatives():
    """Closed form: 0.2 + 1.5 sin(7 t + 0.3) and its three derivatives."""
    phase = 7.0 * 1.3 + 0.3
    wanted = [0.2 + 1.5 * math.sin(phase), 10.5 * math.cos(phase), -73.5 * math.sin(phase), -514.5 * math.cos(phase)]
    np.testing.assert_allclose(at(1.3, 2), wanted, rtol=1e-13)
