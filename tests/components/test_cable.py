"""Cables: taut and slack at located instants, motion and energy, in Python and from a case file."""

import math
from functools import partial

import numpy as np
import pytest
from scipy.optimize import brentq

import scissordyn as sd

from .shared import ENDS, METHODS, TIGHT, assert_balance, ball_on, events_of, phases

# Mass [kg], gravity [m/s^2], stiffness [N/m], free length [m] and drop height [m] of a ball on a cable
MASS, GRAVITY, STIFFNESS, FREE, HEIGHT = 2.0, 9.81, 200.0, 0.5, 0.3
ball = partial(ball_on, mass=MASS, gravity=GRAVITY)


def drop(damping):
    """Return instants at which a cable is taut and slack when a mass drops on it, and the speed upwards then, in closed form.

    From rest, HEIGHT above the length at which the cable is taut; with the stretch s, s'' + 2 b s' + w^2 s = g.
    """
    w, b = math.sqrt(STIFFNESS / MASS), damping / (2.0 * MASS)
    fast, settled = math.sqrt(w * w - b * b), GRAVITY / w**2
    taut, speed = math.sqrt(2.0 * HEIGHT / GRAVITY), math.sqrt(2.0 * HEIGHT * GRAVITY)
    sine = (speed - b * settled) / fast

    def stretch(t):
        return settled + math.exp(-b * t) * (-settled * math.cos(fast * t) + sine * math.sin(fast * t))

    def rate(t):
        wave = -settled * math.cos(fast * t) + sine * math.sin(fast * t)
        return math.exp(-b * t) * (fast * (settled * math.sin(fast * t) + sine * math.cos(fast * t)) - b * wave)

    def tension(t):
        return STIFFNESS * stretch(t) + damping * rate(t)

    half = 0.5 * math.pi / fast  # the tension has one zero, while the mass rises
    slack = brentq(tension, half, 3.0 * half, xtol=1e-15)
    # without tension the mass is thrown: it passes the taut length a little later if the damper let go of it first
    s, v = stretch(slack), rate(slack)
    later = (-v - math.sqrt(max(0.0, v * v - 2.0 * GRAVITY * s))) / GRAVITY
    return taut, taut + slack + later, -(v + GRAVITY * later)


@pytest.mark.parametrize("damping", [0.0, 2.0])
@pytest.mark.parametrize("method", METHODS)
def test_a_drop_makes_it_taut_and_slack(method, damping):
    """Closed form: a fall, a (damped) oscillation, a throw; both instants to 1e-8 s, and the next one of the throw."""
    rope = sd.Cable("rope", *ENDS, STIFFNESS, FREE, damping)
    taut, slack, speed = drop(damping)
    again = slack + 2.0 * speed / GRAVITY
    run = sd.simulate(ball(rope, place=(0.0, HEIGHT - FREE)), until=again + 0.02, method=method, samples=401, **TIGHT)
    assert events_of(run, "taut") == pytest.approx([taut, again], abs=1e-8)
    assert events_of(run, "slack")[0] == pytest.approx(slack, abs=1e-8)
    assert_balance(run)
    length, now = run["cable_length"].values[:, 0], run["cable_taut"].values[:, 0] == 1.0
    np.testing.assert_array_equal(now, length > FREE)
    assert np.all(run["cable_force"].values[~now] == 0.0)
    assert np.all(run["cable_force"].values >= 0.0)
    np.testing.assert_allclose(run["cable_energy"].values[now, 0], 0.5 * STIFFNESS * (length[now] - FREE) ** 2, rtol=1e-9)
    if damping == 0.0:
        assert float(run["cable_peak_force"][0]) == pytest.approx(
            MASS * GRAVITY + math.sqrt((MASS * GRAVITY) ** 2 + 2.0 * STIFFNESS * MASS * GRAVITY * HEIGHT), rel=1e-8
        )
        assert np.max(np.abs(run["dissipated_energy"].values)) < 1e-12


@pytest.mark.parametrize("method", METHODS)
def test_a_swing_with_a_slack_cable(method):
    """Cross-check by a second formulation: a mass thrown upwards beside its cable, by scipy in Cartesian coordinates."""
    damping, start = 1.5, (0.3, -0.35, 1.5, 3.0)

    def rate(mode, t, y):
        length = math.hypot(y[0], y[1])
        pull = max(0.0, STIFFNESS * (length - FREE) + damping * (y[0] * y[2] + y[1] * y[3]) / length) if mode else 0.0
        return y[2], y[3], -pull * y[0] / length / MASS, -pull * y[1] / length / MASS - GRAVITY

    def inside(t, y):
        return FREE - math.hypot(y[0], y[1])

    rope = sd.Cable("rope", *ENDS, STIFFNESS, FREE, damping)
    run = sd.simulate(ball(rope, place=start[:2], velocity=start[2:]), until=2.0, method=method, samples=201, **TIGHT)
    instants, modes, at = phases(rate, (inside, lambda t, y: -inside(t, y)), start, 2.0)
    assert len(instants) >= 4
    np.testing.assert_allclose(run["event_time"], instants, atol=1e-8)
    assert [kind == "taut" for kind in run["event_kind"].values] == [mode == 1 for mode in modes]
    np.testing.assert_allclose(run["position"][:, 0], at(run["time"].values)[:, :2], atol=1e-8)
    assert_balance(run)


def test_a_stretched_start_is_taut():
    """Limit: placed beyond its free length it pulls from the first instant on, and balances the weight where it should."""
    settled = FREE + MASS * GRAVITY / STIFFNESS
    run = sd.simulate(ball(sd.Cable("rope", *ENDS, STIFFNESS, FREE), place=(0.0, -settled)), until=0.2, **TIGHT)
    assert run["cable_taut"].values.min() == 1.0
    np.testing.assert_allclose(run["cable_force"], MASS * GRAVITY, rtol=1e-9)
    assert list(run["event_kind"].values) == ["taut"]
    assert run["event_time"].values.tolist() == [0.0]
    assert run["event_time"].attrs["long_name"] == "instant of the event; 0 for a component that acts from the start"


def test_what_it_cannot_be():
    """Contract: a cable without stiffness, or from a body to itself, is refused in one line."""
    with pytest.raises(sd.InputError, match=r"stiffness = 0.*expected a number from 1e-30"):
        sd.Cable("rope", *ENDS, 0.0, 0.5)
    with pytest.raises(sd.InputError, match="acts between body 'ball' and itself"):
        sd.Cable("rope", ("ball", "a"), ("ball", "b"), 1.0, 0.5)
