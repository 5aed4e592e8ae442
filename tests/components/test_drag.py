"""Drag of a fluid: falls and drifts in closed form, the direction of the force, the energy balance."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import scissordyn as sd

from .shared import METHODS, TIGHT, assert_balance, ball_on

MASS, G = 2.0, 9.81  # Mass [kg] of a ball and gravitational acceleration [m/s^2]
AIR = {"drag_coefficient": 0.5, "area": 0.3, "density": 4.0}  # Drag coefficient, area [m^2] and density [kg/m^3]
QUADRATIC = 0.5 * 4.0 * 0.5 * 0.3  # rho C_d A/2 of the numbers above [kg/m]


def drag(**numbers):
    """Return the drag of a ball."""
    return sd.Drag("air", ("ball", "centre"), **numbers)


@pytest.mark.parametrize("method", METHODS)
def test_a_ball_falls_to_its_terminal_speed(method):
    """Closed form: v = v_e tanh(g t/v_e) of a fall in fast flow, y = -(v_e^2/g) ln cosh(g t/v_e)."""
    run = sd.simulate(ball_on(drag(**AIR), mass=MASS, gravity=G), until=5.0, method=method, **TIGHT)
    terminal, time = math.sqrt(MASS * G / QUADRATIC), run["time"].values
    np.testing.assert_allclose(run["velocity"].values[:, 0, 1], -terminal * np.tanh(G * time / terminal), atol=1e-8)
    fallen = terminal**2 / G * np.log(np.cosh(G * time / terminal))
    np.testing.assert_allclose(run["position"].values[:, 0, 1], -fallen, atol=1e-8)
    assert float(run["drag_peak_force"][0]) == pytest.approx(MASS * G * math.tanh(G * 5.0 / terminal) ** 2, rel=1e-8)
    assert_balance(run)


def test_slow_flow_carries_a_ball():
    """Closed form: in a flow, damping brings the velocity to that of the flow exponentially; the flow's power is work."""
    flow, damping = np.array([3.0, -1.0]), 1.5
    ball = ball_on(drag(damping=damping, flow=tuple(flow.tolist())), mass=MASS)
    run = sd.simulate(ball, until=4.0, **TIGHT)
    decay = np.exp(-damping / MASS * run["time"].values)
    np.testing.assert_allclose(run["velocity"].values[:, 0], flow * (1.0 - decay)[:, None], atol=1e-9)
    momentum = MASS * flow @ flow
    np.testing.assert_allclose(run["load_work"].values, momentum * (1.0 - decay), atol=1e-8)
    np.testing.assert_allclose(run["damper_loss"].values, 0.5 * momentum * (1.0 - decay**2), atol=1e-8)
    assert_balance(run)


def test_drag_turns_a_bar():
    """Second formulation: the angle of a pendulum with drag at its end, by scipy; the drag acts at the end's speed."""
    length, mass = 0.8, 1.5
    bar = sd.Body("bar", mass, mass * length**2 / 12.0, {"start": (-0.4, 0.0), "end": (0.4, 0.0)}, angle=0.0)
    pendulum = sd.Mechanism(
        (bar,),
        joints=(sd.Revolute("pivot", ("bar", "start"), ("ground", "O")),),
        components=(sd.Drag("air", ("bar", "end"), damping=0.2, **AIR),),
        ground=(("O", (0.0, 0.0)),),
        gravity=G,
    )
    run = sd.simulate(pendulum, until=3.0, **TIGHT)

    def rate(t, y):
        speed = length * y[1]
        moment = -mass * G * 0.5 * length * math.cos(y[0]) - length * (0.2 + QUADRATIC * abs(speed)) * speed
        return [y[1], moment / (mass * length**2 / 3.0)]

    found = solve_ivp(rate, (0.0, 3.0), [0.0, 0.0], t_eval=run["time"].values, rtol=1e-11, atol=1e-11)
    np.testing.assert_allclose(run["angle"].values[:, 0], found.y[0], atol=1e-8)
    assert_balance(run)


def test_drag_without_a_coefficient_is_refused():
    """Contract: no coefficient, or an area without one, is one line."""
    for numbers in ({}, {"area": 0.1}, {"drag_coefficient": 1.0, "damping": 2.0}):
        with pytest.raises(sd.InputError, match=r"drag 'air': damping = .*above 0"):
            drag(**numbers)
