"""Constant-force springs: the full tension, the part of it before the strip has left its drum, energy."""

from __future__ import annotations

import math
from functools import partial

import numpy as np
import pytest

import scissordyn as sd
from scissordyn.component.constant_force_spring import ConstantForceSpring
from scissordyn.errors import InputError

from .shared import ENDS, METHODS, TIGHT, assert_balance, ball_on, phases

MASS, TENSION, UNCOILED = 0.8, 12.0, 0.25
ball = partial(ball_on, mass=MASS)


def spring(damping: float = 0.0) -> ConstantForceSpring:
    """The spring of these tests."""
    return ConstantForceSpring("reel", *ENDS, TENSION, UNCOILED, damping)


@pytest.mark.parametrize("method", METHODS)
def test_full_tension_is_constant(method: str) -> None:
    """Closed form: beyond the uncoiling length a mass on the line of the spring moves on a parabola."""
    run = sd.simulate(ball(spring(), velocity=(3.0, 0.0)), until=0.3, method=method, **TIGHT)
    t = run["time"].values
    length = 0.5 + 3.0 * t - 0.5 * TENSION / MASS * t**2
    assert length.min() > UNCOILED
    np.testing.assert_allclose(run["constant_force_spring_length"][:, 0], length, atol=1e-10)
    np.testing.assert_array_equal(run["constant_force_spring_force"][:, 0], TENSION)
    np.testing.assert_allclose(run["constant_force_spring_energy"][:, 0], TENSION * (length - 0.5 * UNCOILED), rtol=1e-10)
    assert_balance(run)


@pytest.mark.parametrize("method", METHODS)
def test_short_strip_is_linear(method: str) -> None:
    """Closed form: below the uncoiling length the mass is a plane oscillator with the stiffness T_0/l_1: an ellipse."""
    w = math.sqrt(TENSION / UNCOILED / MASS)
    run = sd.simulate(ball(spring(), place=(0.2, 0.0), velocity=(0.0, 0.1 * w)), until=1.5, method=method, **TIGHT)
    t = run["time"].values
    exact = np.stack([0.2 * np.cos(w * t), 0.1 * np.sin(w * t)], axis=1)
    np.testing.assert_allclose(run["position"][:, 0], exact, atol=1e-9)
    length = np.linalg.norm(exact, axis=1)
    np.testing.assert_allclose(run["constant_force_spring_energy"][:, 0], 0.5 * TENSION / UNCOILED * length**2, rtol=1e-7)
    assert_balance(run)


@pytest.mark.parametrize("damping", [0.0, 0.2])
@pytest.mark.parametrize("method", METHODS)
def test_orbit_across_the_uncoiling_length(method: str, damping: float) -> None:
    """Cross-check by a second formulation: an orbit with both parts of the law, by scipy with the kink as an event."""
    start = (0.5, 0.0, 0.4, 0.6)

    def rate(mode: int, t: float, y: np.ndarray) -> tuple[float, ...]:
        length = math.hypot(y[0], y[1])
        pull = TENSION * (length / UNCOILED if mode else 1.0) + damping * (y[0] * y[2] + y[1] * y[3]) / length
        return y[2], y[3], -pull * y[0] / length / MASS, -pull * y[1] / length / MASS - 1.6

    def beyond(t: float, y: np.ndarray) -> float:
        return math.hypot(y[0], y[1]) - UNCOILED

    made = ball(spring(damping), place=start[:2], velocity=start[2:], gravity=1.6)
    run = sd.simulate(made, until=1.2, method=method, **TIGHT)
    instants, _, at = phases(rate, (beyond, lambda t, y: -beyond(t, y)), start, 1.2)
    assert len(instants) >= 4
    np.testing.assert_allclose(run["position"][:, 0], at(run["time"].values)[:, :2], atol=1e-8)
    assert_balance(run)


def test_what_it_cannot_be() -> None:
    """Contract: an uncoiling length of zero would be a jump of the force, and is refused."""
    with pytest.raises(InputError, match="uncoiling_length must be a finite number >= 1e-12"):
        ConstantForceSpring("reel", *ENDS, 1.0, 0.0)
