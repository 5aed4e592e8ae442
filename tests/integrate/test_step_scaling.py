"""How time runs inside a step, against its definition."""

import numpy as np
import pytest

from scissordyn.integrate.step_scaling import AFTER_START, BEFORE_END, EVEN, fraction, place, speed


@pytest.mark.parametrize("scaling", [EVEN, AFTER_START, BEFORE_END])
def test_time_inside_a_step(scaling):
    """Identity: from 0 to 1, at the speed that the derivative says, and back again."""
    assert (fraction(scaling, 0.0), fraction(scaling, 1.0)) == (0.0, 1.0)
    for s in np.linspace(0.05, 0.95, 7):
        h = 1e-6
        slope = (fraction(scaling, s + h) - fraction(scaling, s - h)) / (2.0 * h)
        assert speed(scaling, s) == pytest.approx(slope, abs=1e-9)
        assert place(scaling, fraction(scaling, s)) == pytest.approx(s, abs=1e-12)


def test_slow_ends():
    """Closed form: time is the square of s from the start, and one less the square of 1 - s towards the end."""
    assert fraction(AFTER_START, 0.3) == pytest.approx(0.09)
    assert fraction(BEFORE_END, 0.7) == pytest.approx(1.0 - 0.09)
    assert speed(AFTER_START, 0.0) == speed(BEFORE_END, 1.0) == 0.0
