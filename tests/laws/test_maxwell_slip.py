"""Maxwell-slip friction: two elements in parallel."""

import math

import numpy as np
import pytest
from bouncing import JOINT, at, row

from scissordyn.laws.evaluate import friction_force, friction_limit, friction_states
from scissordyn.laws.experiment import oscillation, steady_coefficient
from scissordyn.laws.friction.maxwell_slip import MaxwellSlip

LAW = MaxwellSlip(0.2, 0.3, 2e5, 3e3)  # Friction law of the tests
NORMAL = 50.0  # [N] normal force


def slid(law, path, normal=NORMAL, steps=4000):
    """Return the force after slipping along given distances in turn, by the classical Runge-Kutta method over the distance."""
    p, z, dz = row(law, JOINT), np.zeros(2), np.zeros(2)

    def rate(z, speed):
        friction_force(at(law), speed, normal, np.ascontiguousarray(z), dz, p)
        return dz.copy()

    for distance in path:
        h, speed = abs(distance) / steps, math.copysign(1.0, distance)
        for _ in range(steps):
            one = rate(z, speed)
            two = rate(z + 0.5 * h * one, speed)
            three = rate(z + 0.5 * h * two, speed)
            z = z + h / 6.0 * (one + 2.0 * two + 2.0 * three + rate(z + h * three, speed))
    return friction_force(at(law), speed, normal, z, dz, p)


@pytest.mark.parametrize("x", [1e-8, 3e-7, 2e-5, 1e-3])
def test_from_rest(x):
    """Closed form: F = F_n mu (w_1 (1 - exp(-s_1 x/(w_1 mu))) + w_2 (1 - exp(-s_2 x/(w_2 mu))))."""
    parts = [(0.3 * 0.2, 2e5), (0.7 * 0.2, 3e3)]
    exact = NORMAL * sum(-size * math.expm1(-stiffness * x / size) for size, stiffness in parts)
    assert slid(LAW, [x]) == pytest.approx(exact, rel=1e-6)


def test_reversal():
    """Closed form: after full sliding one way, each element follows 2 exp(-s x/(w mu)) - 1 in the other direction."""
    x = 4e-6
    parts = [(0.3 * 0.2, 2e5), (0.7 * 0.2, 3e3)]
    exact = NORMAL * sum(size * (2.0 * math.exp(-stiffness * x / size) - 1.0) for size, stiffness in parts)
    assert slid(LAW, [1e-3, -x], steps=20000) == pytest.approx(exact, rel=1e-5)


def test_steady_and_start():
    """Closed form: steady friction is mu at any speed; a contact starts with tanh(v/(1 mm/s)) of it in each element."""
    np.testing.assert_allclose(steady_coefficient(LAW, JOINT, [-1.0, -1e-5, 1e-5, 1.0]), [-0.2, -0.2, 0.2, 0.2], rtol=1e-14)
    z = np.zeros(2)
    friction_states(at(LAW, "start"), 5e-4, z, row(LAW, JOINT))
    np.testing.assert_allclose(z, math.tanh(0.5) * np.array([0.06 / 2e5, 0.14 / 3e3]), rtol=1e-14)


def test_slopes_of_a_small_loop():
    """Limit: a small loop begins with the slope s_1 + s_2; after the stiff element slides, only the soft slope remains."""
    loop = oscillation(LAW, JOINT, amplitude=2e-6, frequency=5.0)
    turn = int(np.argmax(loop.displacement))
    x, force = loop.displacement[turn : turn + 180], loop.coefficient[turn : turn + 180]
    slope = np.gradient(force, x)
    assert slope[1] == pytest.approx(2.0 * 2e5, rel=0.1)
    assert slope[-20] < 3.0 * 3e3


def test_limit_of_friction():
    """Limit: in any state that slip can reach the force is within mu F_n, and sliding reaches mu F_n."""
    p = row(LAW, JOINT)
    reached = np.array([0.06 / 2e5, 0.14 / 3e3])
    for part in np.linspace(-1.0, 1.0, 9):
        for other in np.linspace(-1.0, 1.0, 9):
            found = friction_force(at(LAW), 1e-3, NORMAL, reached * np.array([part, other]), np.zeros(2), p)
            assert abs(found) <= friction_limit(at(LAW, "limit"), 1e-3, NORMAL, p) * (1.0 + 1e-13)
    assert friction_force(at(LAW), 1e-3, NORMAL, reached, np.zeros(2), p) == pytest.approx(0.2 * NORMAL, rel=1e-13)
