"""Constant-force springs: the full tension, the part of it before the strip has left its drum, energy."""

import math

import numpy as np
import pytest

import scissordyn as sd

from .shared import ENDS, METHODS, TIGHT, assert_balance, ball_on, phases

MASS, TENSION, UNCOILED = 0.8, 12.0, 0.25  # Mass of the ball [kg], tension [N] and uncoiling length [m] of the spring


@pytest.mark.parametrize("damping", [0.0, 0.2])
@pytest.mark.parametrize("method", METHODS)
def test_orbit_across_the_uncoiling_length(method, damping):
    """Cross-check by a second formulation: an orbit with both parts of the law, by scipy with the kink as an event."""
    start = (0.5, 0.0, 0.4, 0.6)

    def rate(mode, t, y):
        length = math.hypot(y[0], y[1])
        pull = TENSION * (length / UNCOILED if mode else 1.0) + damping * (y[0] * y[2] + y[1] * y[3]) / length
        return y[2], y[3], -pull * y[0] / length / MASS, -pull * y[1] / length / MASS - 1.6

    def beyond(t, y):
        return math.hypot(y[0], y[1]) - UNCOILED

    reel = sd.ConstantForceSpring("reel", *ENDS, TENSION, UNCOILED, damping)
    made = ball_on(reel, mass=MASS, place=start[:2], velocity=start[2:], gravity=1.6)
    run = sd.simulate(made, until=1.2, method=method, **TIGHT)
    instants, _, at = phases(rate, (beyond, lambda t, y: -beyond(t, y)), start, 1.2)
    assert len(instants) >= 4
    np.testing.assert_allclose(run["position"][:, 0], at(run["time"].values)[:, :2], atol=1e-8)
    length = run["constant_force_spring_length"].values
    stored = np.where(length > UNCOILED, TENSION * (length - 0.5 * UNCOILED), 0.5 * TENSION / UNCOILED * length**2)
    np.testing.assert_allclose(run["constant_force_spring_energy"], stored, rtol=1e-12)
    assert_balance(run)


def test_what_it_cannot_be():
    """Contract: an uncoiling length of zero would be a jump of the force, and is refused."""
    with pytest.raises(sd.InputError, match=r"uncoiling_length = .*expected a number from 1e-12"):
        sd.ConstantForceSpring("reel", *ENDS, 1.0, 0.0)
