"""Reference speed of damping in contacts that are loaded beyond an impact at their approach speed, by closed forms."""

import math

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

import scissordyn as sd
from scissordyn.laws.damping.exact import Exact
from scissordyn.laws.damping.proportional import force as published
from scissordyn.laws.evaluate import APPROACH_FLOOR, reference_speed

K = 1e9  # [N/m^n] stiffness of the elastic force K delta^n
MASS = 1.3  # [kg] mass on the contact
PRELOAD = 5e3  # [N] force that loads the contact


def damped(depth, rate, n, xi, approach=0.0, mass=MASS):
    """Return the normal force with the package's reference speed."""
    if depth <= 0.0:
        return 0.0
    elastic = K * depth**n
    return max(0.0, published(elastic, rate, reference_speed(elastic, depth, rate, approach, mass), xi))


def static(n, load=PRELOAD):
    """Return the indentation under a load and the angular frequency of small vibrations about it."""
    depth = (load / K) ** (1.0 / n)
    return depth, math.sqrt(n * load / (MASS * depth))


@pytest.mark.parametrize("n", [1.0, 1.5, 3.0])
@pytest.mark.parametrize("restitution", [0.2, 0.5, 0.95])
@pytest.mark.parametrize("speed", [1e-6, 1e-2, 5.0])
def test_free_impact_keeps_the_published_law(n, restitution, speed):
    """Closed form: the reference speed equals the approach speed exactly, as sup v^2/v0^2 = (n+1)/8 is below 1."""
    xi = Exact(restitution=restitution).factor
    deepest = (0.5 * (n + 1.0) * MASS * speed**2 / K) ** (1.0 / (n + 1.0))
    duration = math.pi * deepest / speed

    def motion(time, y):
        depth, rate = max(y[0], 0.0), y[1]
        elastic = K * depth**n
        assert reference_speed(elastic, depth, rate, speed, MASS) == speed
        return rate, -max(0.0, published(elastic, rate, speed, xi)) / MASS

    found = solve_ivp(motion, (0.0, 3.0 * duration), (0.0, speed), rtol=1e-8, atol=1e-12 * deepest, first_step=1e-3 * duration)
    assert -found.y[1, -1] / speed == pytest.approx(restitution, rel=2e-3)


@pytest.mark.parametrize("n", [1.0, 1.5, 3.0])
def test_reference_speed_at_the_deepest_point(n):
    """Closed form: without approach speed, v^2/v0^2 = (n+1)/8 at the deepest point of an undamped impact."""
    deepest = (0.5 * (n + 1.0) * MASS / K) ** (1.0 / (n + 1.0))
    elastic = K * deepest**n
    assert reference_speed(elastic, deepest, 0.0, 0.0, MASS) ** 2 == pytest.approx((n + 1.0) / 8.0, rel=1e-12)


@pytest.mark.parametrize("n", [1.0, 1.5, 3.0])
@pytest.mark.parametrize("load", [10.0, 5e3])
def test_small_vibrations_about_a_load(n, load):
    """Closed form: the damping ratio is xi/sqrt(n) for any load and amplitude, by the logarithmic decrement."""
    xi, (depth, omega) = 0.12, static(n, load)
    amplitude, periods = 1e-4 * depth, 5
    start = depth + amplitude, 0.0

    def motion(time, y):
        return y[1], (load - damped(y[0], y[1], n, xi)) / MASS

    span = 2.0 * math.pi * periods / omega
    found = solve_ivp(motion, (0.0, 1.2 * span), start, rtol=1e-11, atol=1e-10 * amplitude, method="DOP853", dense_output=True)
    ratio = xi / math.sqrt(n)
    expected = amplitude * math.exp(-2.0 * math.pi * periods * ratio / math.sqrt(1.0 - ratio**2))
    at = span / math.sqrt(1.0 - ratio**2)
    assert found.sol(at)[0] - depth == pytest.approx(expected, rel=2e-3)


@pytest.mark.parametrize("restitution", [0.2, 0.5, 0.9])
@pytest.mark.parametrize("n", [1.0, 1.5])
def test_slow_loading(restitution, n):
    """Closed form: (F - F_el)/F_el = 2 xi P'/(sqrt(n) w P) for a load that grows at the rate P'."""
    xi, (depth, omega) = sd.Flores(restitution=restitution).factor, static(n)
    for loading in (1e5, 1e3):
        rate = depth * loading / (n * PRELOAD)
        excess = damped(depth, rate, n, xi) / PRELOAD - 1.0
        assert excess == pytest.approx(2.0 * xi * loading / (math.sqrt(n) * omega * PRELOAD), rel=1e-3)


def test_loss_of_a_sinusoidal_load():
    """Closed form: a cycle of small amplitude loses pi k A^2 2 zeta Omega/w, by quadrature of the damping force."""
    n, xi, (depth, omega) = 1.5, 0.3, static(1.5)
    stiffness, ratio, slow, losses = n * PRELOAD / depth, xi / math.sqrt(1.5), 0.01 * omega, []
    for amplitude in (1e-3 * depth, 2e-3 * depth):

        def power(angle, amplitude=amplitude):
            here, rate = depth + amplitude * math.sin(angle), amplitude * slow * math.cos(angle)
            return (damped(here, rate, n, xi) - K * here**n) * rate / slow

        losses.append(quad(power, 0.0, 2.0 * math.pi, epsabs=0.0, epsrel=1e-9)[0])
        assert losses[-1] == pytest.approx(math.pi * stiffness * amplitude**2 * 2.0 * ratio * slow / omega, rel=1e-3)
    assert losses[1] / losses[0] == pytest.approx(4.0, rel=1e-3)


def test_bounds():
    """Limit: the damping force stays within 2 xi F_el, and its slope within that of the contact's frequency."""
    xi, n = 1.7, 1.5
    depth, _ = static(n)
    rates = np.concatenate([-np.geomspace(1e-12, 1e3, 200), np.geomspace(1e-12, 1e3, 200)])
    for approach in (0.0, 1e-3):
        for rate in rates.tolist():
            elastic = K * depth**n
            v = reference_speed(elastic, depth, rate, approach, MASS)
            assert abs(published(elastic, rate, v, xi) / elastic - 1.0) <= 2.0 * xi * (1.0 + 1e-12)
            h = 1e-4 * abs(rate) + 1e-9
            up, down = (
                published(elastic, r, reference_speed(elastic, depth, r, approach, MASS), xi) for r in (rate + h, rate - h)
            )
            assert abs(up - down) / (2.0 * h) <= 2.0 * xi * math.sqrt(MASS * n * elastic / depth / n) * (1.0 + 1e-6)


def test_reference_speed_of_a_touch_at_rest():
    """Limit: a contact that just touches at rest has a finite reference speed; without mass it is the approach speed."""
    assert reference_speed(0.0, 0.0, 0.0, 0.0, MASS) == APPROACH_FLOOR
    assert reference_speed(1e6, 1e-3, 10.0, 0.3, 0.0) == 0.3
