"""The largest value of a smooth sampled curve."""

import math

import numpy as np
import pytest

import scissordyn as sd
from scissordyn.kinematics.path import smooth_peak


@pytest.mark.parametrize("phase", [0.0, 0.3, 0.7])
def test_the_top_of_a_sine(phase: float) -> None:
    """Closed form: 1, at a quarter period, to the fourth power of the distance of the samples."""
    time = np.linspace(0.0, 1.0, 501)
    largest, when = smooth_peak(time, np.sin(2.0 * math.pi * (time + 1e-3 * phase)))
    assert largest == pytest.approx(1.0, abs=1e-8)
    assert when == pytest.approx(0.25 - 1e-3 * phase, abs=1e-7)


def test_curves_without_a_top_inside() -> None:
    """Limit: the largest sample at an end, beside a gap or on a plateau; NaN without any value."""
    time = np.linspace(0.0, 1.0, 5)
    assert smooth_peak(time, time) == (1.0, 1.0)
    assert smooth_peak(time, np.array([0.0, 3.0, math.nan, 1.0, 0.0])) == (3.0, 0.25)
    assert smooth_peak(time, np.ones(5)) == (1.0, 0.0)
    # a bend that is lost in rounding
    assert smooth_peak(time, np.array([0.5, np.nextafter(1.0, 0.0), 1.0, 1.0, 0.5])) == (1.0, 0.5)
    assert all(map(math.isnan, smooth_peak(time, np.full(5, math.nan))))


def test_reactions_of_an_ideal_mechanism() -> None:
    """Cross-check: located from 501 samples they are those of 100 001."""
    crank = sd.slider_crank(gravity=9.81).driven(speed=sd.rpm(1000))
    found, fine = sd.ideal_kinematics(crank, until=0.06), sd.simulate(crank, until=0.06, samples=100_001)
    force = np.linalg.norm(fine["reaction"].transpose("time", "joint", "axis").values, axis=2)
    np.testing.assert_allclose(found["peak_reaction"], np.nanmax(force, axis=0), rtol=1e-6)
