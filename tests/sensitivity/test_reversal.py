"""Derivatives through a contact whose sliding reverses, where Dahl's law has a kink."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import scissordyn as sd
from scissordyn.plan.plan import plan
from scissordyn.sensitivity.forward import forward
from scissordyn.sensitivity.seed import Start, derivatives, parameter_of

RADIUS, INERTIA, SPEED, SPIN, END = 0.01, 1e-4, (0.4, 0.05), 3.0, 0.0032  # of a ball of 1 kg, in SI units

PATHS = {
    "hole.friction.kinetic": 0.3,
    "hole.friction.bristle_stiffness": 1e5,
    "hole.clearance": 1e-3,
    "hole.stiffness.stiffness": 1e8,
}
"""Paths of the parameters and their values in SI units."""


def ball():
    """Return a turning ball that strikes the wall of its hole once, without loss along the normal."""
    kinetic, bristles, clearance, stiffness = PATHS.values()
    body = sd.Body("ball", 1.0, INERTIA, {"c": (0.0, 0.0)}, (0.0, 0.0), velocity=SPEED, angular_velocity=SPIN)
    gap = sd.Clearance(
        clearance,
        journal_radius=RADIUS,
        stiffness=sd.law("stiffness", "linear")(stiffness),
        damping=sd.Flores(1.0),
        friction=sd.law("friction", "dahl")(kinetic=kinetic, bristle_stiffness=bristles),
    )
    hole = sd.Revolute("hole", ("ball", "c"), ("ground", "o"), clearance=gap)
    return sd.Mechanism(bodies=(body,), joints=(hole,), ground=(("o", (0.0, 0.0)),), gravity=0.0)


def final_state(kinetic, bristles, clearance, stiffness):
    """Return position, velocity, two integrals and the number of reversals, each of which ends a piece of the integration.

    The integrals are those of the normal force times the amount of the slip speed, and of the power of friction.
    """

    def slip(t, y, sign):
        e = math.hypot(y[0], y[1])
        return (y[4] * y[0] - y[3] * y[1]) / e + y[5] * RADIUS

    def leaves(t, y, sign):
        return math.hypot(y[0], y[1]) - clearance

    def rates(t, y, sign):
        e = math.hypot(y[0], y[1])
        nx, ny, v, normal = y[0] / e, y[1] / e, slip(t, y, sign), stiffness * (e - clearance)
        friction = normal * bristles * y[6]
        along, across = -normal * nx + friction * ny, -normal * ny - friction * nx
        bristle = v * (1.0 - bristles * y[6] / kinetic * sign)
        return [y[3], y[4], y[5], along, across, -RADIUS * friction / INERTIA, bristle, normal * v * sign, friction * v]

    t = clearance / math.hypot(*SPEED)
    y = np.array([SPEED[0] * t, SPEED[1] * t, SPIN * t, *SPEED, SPIN, 0.0, 0.0, 0.0])
    y[6], sign, reversals = math.tanh(slip(t, y, 1.0) / 1e-3) * kinetic / bristles, math.copysign(1.0, slip(t, y, 1.0)), 0
    leaves.terminal, leaves.direction, slip.terminal = True, -1.0, True
    while True:
        slip.direction = -sign
        run = solve_ivp(rates, (t, END), y, method="DOP853", rtol=1e-13, atol=1e-16, events=(slip, leaves), args=(sign,))
        t, y = run.t[-1], run.y[:, -1]
        if run.t_events[1].size:
            return np.concatenate([y[:2] + (END - t) * y[3:5], y[3:5], y[7:]]), reversals
        sign, reversals = -sign, reversals + 1


def slope(name, step=1e-3):
    """Return the derivative of the final state by one parameter divided by its value: differences of sixth order."""
    weights = {1: 0.75, 2: -0.15, 3: 1.0 / 60.0}
    ends = {at: final_state(*(PATHS | {name: PATHS[name] * (1.0 + at * step)}).values())[0] for at in (-3, -2, -1, 1, 2, 3)}
    return sum(weights[at] / step * (ends[at] - ends[-at]) for at in weights)


@pytest.mark.parametrize("method", ["dop853", "rodas5p"])
def test_dahl_friction_whose_sliding_reverses(method):
    """Cross-check by a second formulation that locates the reversals: position and velocity after the contact."""
    assert final_state(*PATHS.values())[1] == 2
    mechanism, options = ball(), sd.Options(END, "as-placed", 2, 1e-11, 1e-11, method, events="located")
    begin = Start(mechanism, "as-placed")
    run = forward(plan(mechanism), options, [derivatives(begin, parameter_of(mechanism, path, 1.0)) for path in PATHS])
    n = plan(mechanism).coordinates.free
    for k, path in enumerate(PATHS):
        expected = slope(path)
        for part, found in ((expected[:2], run.state[:2, k]), (expected[2:4], run.state[n : n + 2, k])):
            assert found == pytest.approx(part, abs=1e-6 * np.max(np.abs(part)))


@pytest.mark.parametrize("method", ["dop853", "rodas5p"])
def test_integrals_of_slidings_that_reverse(method):
    """Cross-check by the same formulation: integrals whose integrands have kinks within steps of the run."""
    width = 0.015  # default length of the bearing
    found = sd.gradient(
        ball(), of=["pressure_distance", "friction_loss"], by=list(PATHS), until=END, start="as-placed", method=method
    )
    factors = np.array([1.0 / (2.0 * RADIUS * width), 1.0])
    assert found["value"].values == pytest.approx(final_state(*PATHS.values())[0][4:] * factors, rel=1e-5)
    for name, value in PATHS.items():
        assert found["derivative"].sel(parameter=name).values * value == pytest.approx(slope(name)[4:] * factors, rel=2e-7)


def test_slip_speeds_that_are_round_off():
    """Closed form: at rest slip speeds reverse by round-off; the contact force balances the weight and the drag of a flow."""
    gap = sd.Clearance(
        5e-4, damping=sd.law("damping", "standard-linear-solid")(), friction=sd.law("friction", "bengisu-akay")(kinetic=0.23)
    )
    one = sd.Body("one", 0.5, 0.004, {"start": (0.0, 0.0), "end": (0.17, 0.0)}, (0.08, 0.0), (0.0, 0.0), -1.05)
    end = (0.17 * math.cos(-1.05), 0.17 * math.sin(-1.05))
    two = sd.Body("two", 0.6, 0.004, {"start": (0.0, 0.0)}, (0.08, 0.01), end, -1.2)
    joints = (
        sd.Revolute("J", ("one", "start"), ("ground", "o"), clearance=gap),
        sd.Revolute("K", ("two", "start"), ("one", "end")),
    )
    drag = sd.Drag("drag", ("two", "start"), damping=60.0, drag_coefficient=0.0, flow=(1.5, -2.2))
    arms = sd.Mechanism(bodies=(one, two), joints=joints, components=(drag,), ground=(("o", (0.0, 0.0)),), gravity=9.81)
    by = {"body.one.mass": (0.0, -9.81), "body.one.centre.y": (0.0, 0.0), "drag.damping": (1.5, -2.2)}
    found = sd.gradient(arms, by=list(by), until=4e-3, start="static", method="rodas5p", trajectory=True, samples=3)
    force = np.array([60.0 * 1.5, -60.0 * 2.2 - 1.1 * 9.81])
    assert found["normal_force"].sel(joint="J").values == pytest.approx(np.full(3, np.hypot(*force)), rel=1e-8)
    slopes = np.array([force @ part / np.hypot(*force) for part in by.values()])
    assert found["normal_force_derivative"].sel(joint="J").values == pytest.approx(np.tile(slopes, (3, 1)), abs=1e-4)
