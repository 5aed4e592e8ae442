"""Largest values, integrals and limits of monitored numbers against closed forms: courses of known polynomials and waves."""

import math

import numpy as np
import pytest
from course import WAVES, polynomials, run, waves
from scipy.integrate import quad
from scipy.optimize import brentq

from scissordyn.integrate.integration import ENDED, FIRST_WITHIN, INTEGRAL, LARGEST, LAST_ABOVE, TIME, WHEN
from scissordyn.integrate.method import METHODS

HUMP = np.polynomial.Polynomial((0.1, 1.3, -2.0, 2.2, -1.7))  # Polynomial with one maximum between 0 and 1


def coefficients(polynomial):
    return tuple(polynomial.coef)


def maximum(polynomial, until):
    """Return the largest value of a polynomial between 0 and `until`, and its instant."""
    places = [0.0, until, *(float(root.real) for root in polynomial.deriv().roots() if abs(root.imag) < 1e-12)]
    return max((float(polynomial(place)), place) for place in places if 0.0 <= place <= until)


@pytest.mark.parametrize("step", [math.inf, 0.23, 0.0371])
def test_maximum_inside_a_step(name, step):
    """Closed form: the largest value of a quartic, wherever steps begin and end, and when it is taken."""
    found = run(name, 1.0, rows=polynomials(coefficients(HUMP)), step=step, first=min(step, 1.0))
    value, place = maximum(HUMP, 1.0)
    assert found.state.peak[0, LARGEST] == pytest.approx(value, abs=3e-13)
    assert found.state.peak[0, WHEN] == pytest.approx(place, abs=3e-6)


@pytest.mark.parametrize("falling", [False, True])
def test_maximum_at_an_end(name, falling):
    """Closed form: of what rises all along it is at the end, of what falls at the start, exactly."""
    row = (1.0, -0.5, -0.1) if falling else (0.2, 0.5, 0.1)
    found = run(name, 0.9, rows=polynomials(row), step=0.3, first=0.3)
    exact = (1.0, 0.0) if falling else (0.2 + 0.45 + 0.081, 0.9)
    assert tuple(found.state.peak[0, [LARGEST, WHEN]]) == pytest.approx(exact, abs=1e-12)


@pytest.mark.parametrize("place", [0.3 - 1e-3, 0.3, 0.3 + 1e-3])
def test_maximum_about_the_end_of_a_step(name, place):
    """Closed form: a parabola whose top is just before, at or after the end of a step."""
    found = run(name, 0.9, rows=polynomials((1.0 - place**2, 2.0 * place, -1.0)), step=0.3, first=0.3)
    assert found.state.peak[0, LARGEST] == pytest.approx(1.0, abs=1e-12)
    assert found.state.peak[0, WHEN] == pytest.approx(place, abs=1e-5)


def test_the_largest_of_several_maxima():
    """Closed form: 0.3 t + sin 40 t has a maximum in each period; the last one is the largest."""
    found = run("dop853", 1.0, rows=polynomials(waves(1.0, 0.0, 0.0, 0.3)), step=0.02, first=0.02)
    turn = (math.acos(-0.3 / WAVES) + 2.0 * math.pi * 6) / WAVES
    assert turn < 1.0 < turn + 2.0 * math.pi / WAVES
    assert found.state.peak[0, LARGEST] == pytest.approx(0.3 * turn + math.sin(WAVES * turn), abs=1e-9)
    assert found.state.peak[0, WHEN] == pytest.approx(turn, abs=1e-5)


@pytest.mark.parametrize("name", METHODS[:2])
def test_a_maximum_is_found_in_few_looks(name):
    """Order of convergence: by parabolas it takes 14 looks inside the step, golden sections alone 34."""
    found = run(name, 1.0, rows=polynomials((0.0, 1.0, -1.0, 0.02)), first=1.0)
    assert 4 < int(found.numbers.looks[0]) <= 16


@pytest.mark.parametrize("step", [math.inf, 0.17])
def test_integrals(name, step):
    """Closed form: integrals of a line, its square and its cube, and of a cubic power, over any steps."""
    power = np.polynomial.Polynomial((0.3, -1.0, 2.0, 0.7))
    line = np.polynomial.Polynomial((0.2, 0.9))
    found = run(name, 0.8, rows=polynomials(coefficients(line)), powers=polynomials(coefficients(power)), step=step, first=0.1)
    for q in range(3):
        exact = (line ** (q + 1)).integ()(0.8)
        assert found.state.peak[0, INTEGRAL + q] == pytest.approx(exact, abs=2e-13)
    assert found.state.total[0] == pytest.approx(power.integ()(0.8), abs=2e-13)


def test_integrals_at_samples(name):
    """Closed form: inside long steps, too, the integral of a quadratic power up to each sample."""
    power = np.polynomial.Polynomial((0.3, -1.0, 2.0))
    found = run(name, 0.9, powers=polynomials(coefficients(power)), step=0.3, first=0.3, samples=38)
    assert found.out.total[:, 0] == pytest.approx(power.integ()(found.out.time), abs=2e-13)


@pytest.mark.parametrize("crosses", [False, True])
def test_peak_and_integral_of_a_contact(name, crosses):
    """Closed form: a guard's number is followed from rise to fall; the log has its largest value, when, and integrals."""
    roots = 0.31, 0.74
    guard = -np.polynomial.Polynomial.fromroots(roots)
    found = run(name, 1.0, guards_=polynomials(coefficients(guard)), first=0.05, step=0.05, crosses=crosses)
    assert found.log[:, TIME] == pytest.approx(roots, abs=1e-12)
    ended = found.log[1, ENDED:]
    assert ended[LARGEST] == pytest.approx(guard(0.525), abs=1e-12)
    assert ended[WHEN] == pytest.approx(0.525, abs=1e-5)
    if not crosses:  # one that is crossed is integrated over the whole step in which it begins
        exact = guard.integ()(roots[1]) - guard.integ()(roots[0])
        # where time runs slowly the integrand has degree five, which the weights of dopri5 integrate to their order
        assert ended[INTEGRAL] == pytest.approx(exact, rel=1e-5 if name == "dopri5" else 1e-11)
        square = (guard**2).integ()
        assert ended[INTEGRAL + 1] == pytest.approx(square(roots[1]) - square(roots[0]), rel=1e-4)


def test_when_a_number_stays_within_its_limit(name):
    """Closed form: when a decaying number is first within its limit, and when it is last above it."""
    cubic = np.polynomial.Polynomial.fromroots((0.2, 0.45, 0.8))  # above zero in (0.2, 0.45) and beyond 0.8
    row = coefficients(-cubic + 1.0)
    for limit, first, last in ((1.0, 0.2, 0.8), (1.0 + 1e-3, None, None)):
        roots = sorted(root.real for root in (-cubic + (1.0 - limit)).roots() if abs(root.imag) < 1e-9)
        found = run(name, 0.95, rows=polynomials(row), band=(limit,), step=0.19, first=0.19)
        assert found.state.band[0, FIRST_WITHIN] == pytest.approx(first or roots[0], abs=1e-8)
        assert found.state.band[0, LAST_ABOVE] == pytest.approx(last or roots[2], abs=1e-8)


def test_never_above_and_never_within():
    """Limit: what is always within its limit is so from the start and never above; what is always above is so to the end."""
    rows = polynomials((1.0, 0.1), (1.0, 0.1))
    found = run("dopri5", 1.0, rows=rows, band=(2.0, 0.5), step=0.3, first=0.3)
    assert found.state.band[0, FIRST_WITHIN] == 0.0
    assert math.isnan(found.state.band[0, LAST_ABOVE])
    assert math.isnan(found.state.band[1, FIRST_WITHIN])
    assert found.state.band[1, LAST_ABOVE] == pytest.approx(1.0, abs=1e-14)


def test_above_its_limit_in_the_last_step(name):
    """Limit: a number that passes its limit in the last step is above it to the end."""
    found = run(name, 1.0, rows=polynomials((0.0, 1.0)), band=(0.95,), step=0.3, first=0.3)
    assert found.state.band[0, FIRST_WITHIN] == 0.0
    assert found.state.band[0, LAST_ABOVE] == pytest.approx(1.0, abs=1e-14)


@pytest.mark.parametrize("name", ["dop853", "rodas5p"])
def test_a_wave_that_steps_follow(name):
    """Cross-check: peak, integral and last passing of a damped wave by scipy."""

    def number(t):
        return math.sin(WAVES * t) + 1.5 - 2.0 * t

    found = run(name, 1.0, rows=polynomials(waves(1.0, 0.0, 1.5, -2.0)), band=(1.2,), step=0.01, first=0.01)
    assert found.state.peak[0, INTEGRAL] == pytest.approx(quad(number, 0.0, 1.0, epsabs=1e-13, limit=200)[0], abs=1e-8)
    top = brentq(lambda t: WAVES * math.cos(WAVES * t) - 2.0, 0.03, 0.06)
    assert found.state.peak[0, LARGEST] == pytest.approx(number(top), abs=1e-9)
    times = np.linspace(0.0, 1.0, 20001)
    last = int(np.max(np.flatnonzero([number(t) > 1.2 for t in times])))
    assert found.state.band[0, LAST_ABOVE] == pytest.approx(
        brentq(lambda t: number(t) - 1.2, times[last], times[last + 1]), abs=1e-7
    )


def test_unmonitored():
    """Contract: with monitoring off nothing is integrated and no peak is kept; the motion is the same."""
    on = run("dop853", 1.0, rows=polynomials((1.0,)), powers=polynomials((1.0,)), first=0.4)
    off = run("dop853", 1.0, rows=polynomials((1.0,)), powers=polynomials((1.0,)), first=0.4, monitors=False)
    assert np.array_equal(on.ends, off.ends)
    assert on.state.total[0] == pytest.approx(1.0)
    assert off.state.total[0] == 0.0 == off.state.peak[0, LARGEST]
