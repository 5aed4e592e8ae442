"""Roots of guards inside steps against closed forms: courses of known polynomials, followed in steps of any length."""

import math

import numpy as np
import pytest
from course import WAVES, polynomials, run, waves

from scissordyn.integrate import advance as loop
from scissordyn.integrate.event import cubic, cubic_root, cubic_summit, may_rise
from scissordyn.integrate.integration import DATA, FALL, GUARD, MODE, RISE, TIME


def shifted(*roots, factor=1.0):
    """Return the coefficients, constant first, of a polynomial with these roots."""
    return tuple(factor * np.polynomial.Polynomial.fromroots(roots).coef)


def test_one_root_in_one_step(name):
    """Closed form: t^5 = 0.3 in a single step of length 2, to the guard's precision, and the step ends there."""
    found = run(name, 2.0, guards_=polynomials((-0.3, 0.0, 0.0, 0.0, 0.0, 1.0)), first=2.0)
    exact = 0.3**0.2
    assert found.log[:, TIME] == pytest.approx([exact], abs=1e-13)
    assert found.log[0, DATA] == pytest.approx(5.0 * exact**4, rel=1e-10)
    assert list(found.log[:, MODE]) == [RISE]
    assert np.min(np.abs(found.ends - exact)) < 1e-13


@pytest.mark.parametrize("crosses", [False, True])
def test_rises_and_falls_of_several_guards(name, crosses):
    """Closed form: all crossings of three cubics in one long step, in order, each once; ending on them or going across."""
    roots = ((0.21, 0.62, 1.31), (0.05, 0.9, 1.9), (0.33, 0.35, 1.6))
    table = polynomials(*(shifted(*each, factor=(-1.0) ** k) for k, each in enumerate(roots)))
    modes = tuple(int(row[0] > 0.0) for row in table)
    found = run(name, 1.95, guards_=table, modes=modes, first=1.95, crosses=crosses, monitors=False)
    exact = sorted((root, k) for k, each in enumerate(roots) for root in each)
    order = np.argsort(found.log[:, TIME], kind="stable")
    assert found.log[order, TIME] == pytest.approx([root for root, _ in exact], abs=1e-12)
    assert list(found.log[order, GUARD].astype(int)) == [k for _, k in exact]
    for k in range(3):
        kinds = found.log[order][found.log[order, GUARD] == k, MODE]
        assert list(kinds) == [RISE if (modes[k] + i) % 2 == 0 else FALL for i in range(3)]


def test_a_rise_between_two_probes(name):
    """Closed form: a hump 2e-4 wide, 1e-8 high, between two sixths of the step, is entered and left where its roots are."""
    middle, half = 0.4231, 1e-4
    hump = shifted(middle - half, middle + half, factor=-1.0)
    found = run(name, 1.0, guards_=polynomials(hump), first=1.0)
    assert found.log[:, TIME] == pytest.approx([middle - half, middle + half], abs=1e-9)
    assert list(found.log[:, MODE]) == [RISE, FALL]


@pytest.mark.parametrize("offset", [0.0, 1.7])
def test_a_wave_inside_a_step(offset):
    """Closed form: sin 40 t - 0.9 in one step that holds twelve periods: every rise and every fall of it."""
    level = 0.9
    end = 2.0
    guard = waves(math.cos(offset), math.sin(offset), -level)
    beyond = (1,) if math.sin(offset) > level else (0,)
    found = run("dop853", end, guards_=polynomials(guard), modes=beyond, first=end, log_rows=400)
    rise, fall = math.asin(level), math.pi - math.asin(level)
    turns = np.arange(20) * 2.0 * math.pi
    times = (np.concatenate([rise + turns, fall + turns]) - offset) / WAVES
    exact = np.sort(times[(times > 0.0) & (times < end)])
    assert found.log[:, TIME] == pytest.approx(exact, abs=1e-12)


def test_a_guard_that_touches_zero_from_below():
    """Limit: -(t - 0.4)^2 - 1e-6 comes near zero and does not cross it; raised by 2e-6 it crosses twice."""
    below = run("dop853", 1.0, guards_=polynomials((-0.16 - 1e-6, 0.8, -1.0)), first=1.0)
    assert below.log.shape[0] == 0
    above = run("dop853", 1.0, guards_=polynomials((-0.16 + 1e-6, 0.8, -1.0)), first=1.0)
    assert above.log[:, TIME] == pytest.approx([0.4 - 1e-3, 0.4 + 1e-3], abs=1e-9)


@pytest.mark.parametrize("backwards", [False, True])
def test_a_guard_that_stands_still_at_one_end_of_a_step(name, backwards):
    """Closed form: t^3 - 0.95 t^6 - 0.1 has no rate at 0 and a high one at 1; above zero between the roots of a quadratic."""
    course = np.polynomial.Polynomial([-0.1, 0.0, 0.0, 1.0, 0.0, 0.0, -0.95])
    roots = np.cbrt((1.0 + np.array([-1.0, 1.0]) * math.sqrt(1.0 - 0.38)) / 1.9)
    if backwards:
        course, roots = course(np.polynomial.Polynomial([1.0, -1.0])), 1.0 - roots[::-1]
    found = run(name, 1.0, guards_=polynomials(tuple(course.coef)), first=1.0)
    assert found.log[:, TIME] == pytest.approx(roots, abs=1e-12)
    assert list(found.log[:, MODE]) == [RISE, FALL]


@pytest.mark.parametrize("crosses", [False, True])
def test_a_guard_that_lets_go_and_touches_again_in_one_step(name, crosses):
    """Closed form: what the touch finds is its own rate, not that of an earlier one, whether a step may go across or not."""
    course = shifted(0.3, 0.5, factor=2.0)
    found = run(name, 1.0, guards_=polynomials(course), modes=(1,), first=1.0, crosses=crosses, monitors=False)
    assert found.log[:, TIME] == pytest.approx([0.3, 0.5], abs=1e-12)
    assert list(found.log[:, MODE]) == [FALL, RISE]
    assert found.log[:, DATA] == pytest.approx([-0.4, 0.4], rel=1e-9)
    assert np.min(np.abs(found.ends - 0.5)) < 1e-12


def test_a_guard_beyond_zero_at_the_start():
    """Closed form: one that is past zero at the start by round-off is crossed when it turns and moves further beyond.

    (t - 0.3)^2 starts above zero with mode 0: it is not crossed while it falls, but as it rises again, at its lowest point.
    """
    found = run("dop853", 1.0, guards_=polynomials((0.09 + 1e-5, -0.6, 1.0)), first=1.0)
    assert found.log[:, TIME] == pytest.approx([0.3], abs=1e-6)
    through = run("dop853", 1.0, guards_=polynomials((0.09 - 0.04, -0.6, 1.0)), first=1.0)
    assert through.log[:, TIME] == pytest.approx([0.5], abs=1e-12)
    rising = run("dop853", 1.0, guards_=polynomials((1e-4, 1.0)), first=1.0)
    assert rising.log[:, TIME] == pytest.approx([0.0], abs=1e-12)


def test_guards_crossed_at_one_instant():
    """Contract: two guards with the same root are both logged there; one that moves the other way is not."""
    table = polynomials((-0.5, 1.0), (-1.0, 2.0), (0.5, -1.0))
    found = run("dopri5", 1.0, guards_=table, modes=(0, 0, 0), first=0.9)
    assert found.log[:, TIME] == pytest.approx([0.0, 0.5, 0.5][-found.log.shape[0] :], abs=1e-12)
    assert {int(k) for k in found.log[found.log[:, TIME] > 0.1, GUARD]} == {0, 1}


def test_an_event_that_its_guard_refuses():
    """Contract: a reset that does not change its mode leaves no row in the log, and the run goes on to its end."""
    found = run("dop853", 1.0, guards_=polynomials((-0.5, 1.0)), refuses=(1,), first=0.3)
    assert found.status in (loop.FINISHED, loop.STUCK)
    assert found.log.shape[0] == 0


@pytest.mark.parametrize("crosses", [False, True])
def test_a_guard_beyond_zero_that_turns_and_refuses_what_recedes(name, crosses):
    """Closed form: b + (t - a)^2 + (t - a)^3 is crossed once, right behind a, where it begins to rise, and the run goes on."""
    for place in np.linspace(0.05, 0.65, 13):
        shallow = np.polynomial.Polynomial((1e-6, 0.0, 1.0, 1.0))(np.polynomial.Polynomial((-place, 1.0)))
        found = run(name, 1.0, guards_=polynomials(tuple(shallow.coef)), refuses=(2,), first=1.0, crosses=crosses)
        assert found.status == loop.FINISHED, place
        assert found.log[:, TIME] == pytest.approx([place], abs=1e-9)
        assert 0.0 < found.log[0, DATA] < 1e-9


def test_steep_and_shallow_roots(name):
    """Closed form: slopes from 1e-3 to 1e9 at the root; the guard itself is small there, within its precision."""
    for slope in (1e-3, 1.0, 1e9):
        precision = 1e-9 * slope
        found = run(name, 1.0, guards_=polynomials((-0.7310001 * slope, slope)), first=1.0, precision=precision)
        assert found.log[:, TIME] == pytest.approx([0.7310001], abs=2e-9)


def test_cubic():
    """Closed form: root, largest value and values of a cubic with given values and slopes at 0 and 1."""
    for c in ((-0.2, 0.1, 2.0, -0.7), (-1e-3, 1.0, -1.0, 0.5), (-0.5, 0.0, 0.0, 1.3)):
        curve = np.polynomial.Polynomial(c)
        a, b, slope_a, slope_b = curve(0.0), curve(1.0), curve.deriv()(0.0), curve.deriv()(1.0)
        assert b > 0.0
        for place in (0.0, 0.2, 0.5, 0.9, 1.0):
            assert cubic(place, a, slope_a, b, slope_b)[0] == pytest.approx(curve(place), abs=1e-13)
        assert curve(cubic_root(a, slope_a, b, slope_b)) == pytest.approx(0.0, abs=1e-11)
    hump = np.polynomial.Polynomial((-0.3, 2.0, -1.0, -0.9))
    summit = hump(np.max([root for root in hump.deriv().roots() if 0.0 < root < 1.0]))
    place, found = cubic_summit(hump(0.0), hump.deriv()(0.0), hump(1.0), hump.deriv()(1.0))
    assert found == pytest.approx(hump(place), abs=1e-13)
    # six halvings: within 1/64 of the place, where the curve is flat
    assert found <= summit
    assert found == pytest.approx(summit, abs=0.5 * abs(hump.deriv(2)(0.5)) / 64.0**2)


def test_where_a_rise_may_hide():
    """Contract: a cubic that stays below zero hides no rise, one with a hump above does; an error halfway may hide one, too."""
    below = np.polynomial.Polynomial((-0.3, 1.0, -1.0))  # highest at -0.05
    above = np.polynomial.Polynomial((-0.2, 1.0, -1.0))  # highest at 0.05
    for curve, rises in ((below, False), (above, True)):
        ends = curve(0.0), curve.deriv()(0.0), curve(1.0), curve.deriv()(1.0)
        assert bool(may_rise(*ends, 0.0, 1e-12)) is rises
        assert may_rise(*ends, 0.1, 1e-12)
    assert may_rise(-1.0, 0.5, -1.0, -0.5, math.inf, 1e-12) is False
    assert may_rise(-1.0, 0.0, 0.5, 1.0, 0.0, 1e-12) is True


def test_a_guard_out_of_reach_costs_nothing():
    """Contract: a guard that cannot come to zero within a step leaves the dense output alone; one that may does not."""
    far = run("dop853", 1.0, guards_=polynomials((-100.0, 1.0)), step=0.5, first=0.5, samples=0)
    near = run("dop853", 1.0, guards_=polynomials((-0.51, 0.5)), step=0.5, first=0.5, samples=0)
    assert int(near.state.counts["rates"][0]) > int(far.state.counts["rates"][0])
    assert far.log.shape[0] == near.log.shape[0] == 0


def test_samples_know_their_mode(name):
    """Closed form: beside each sample stands the mode of the guard at that instant, also when a step goes across its roots."""
    table = polynomials(shifted(0.25, 0.61, factor=-1.0))
    for crosses in (False, True):
        found = run(name, 1.0, guards_=table, first=1.0, crosses=crosses, monitors=False, samples=100)
        within = (found.out.time > 0.25) & (found.out.time < 0.61)
        assert np.array_equal(found.out.mode[:, 0] == 1, within)
        assert found.out.state[:, 0] == pytest.approx(found.out.time, abs=1e-13)
