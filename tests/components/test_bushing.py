"""Bushings: their linear oscillations, two free bodies, momentum, energy."""

import math

import numpy as np
import pytest
from scipy.linalg import expm
from tests.build import momenta

import scissordyn as sd

from .shared import METHODS, TIGHT, assert_balance, phases

# Parameters of a bushing with all stiffnesses [N/m, N m/rad] and dampings [N s/m, N m s/rad]
BUSHING_PARAMETERS = {
    "stiffness_x": 400.0,
    "stiffness_y": 900.0,
    "stiffness_xy": 150.0,
    "torsional_stiffness": 6.0,
    "damping_x": 1.5,
    "damping_y": 3.0,
    "damping_xy": -0.8,
    "torsional_damping": 0.04,
}


def plate_on(bushing):
    """Return a rigid body on a bushing at its mass centre."""
    plate = sd.Body("plate", 2.0, 0.03, {"eye": (0.0, 0.0)}, position=(0.02, 0.01), angle=math.radians(20.0))
    return sd.Mechanism((plate,), components=(bushing,), ground=(("O", (0.0, 0.0)),), gravity=0.0)


@pytest.mark.parametrize("method", METHODS)
def test_oscillations_about_the_ground(method):
    """Closed form: on the ground both displacements are a linear system, coupled by K_xy and D_xy, and the angle another."""
    bushing = sd.Bushing("rubber", ("ground", "O"), ("plate", "eye"), free_angle=0.0, **BUSHING_PARAMETERS)
    run = sd.simulate(plate_on(bushing), until=0.5, method=method, samples=51, **TIGHT)
    K, D = np.array([[400.0, 150.0], [150.0, 900.0]]), np.array([[1.5, -0.8], [-0.8, 3.0]])
    A = np.block([[np.zeros((2, 2)), np.eye(2)], [-K / 2.0, -D / 2.0]])
    B = np.array([[0.0, 1.0], [-6.0 / 0.03, -0.04 / 0.03]])
    time = run["time"].values
    placed = np.array([expm(A * t) @ [0.02, 0.01, 0.0, 0.0] for t in time])
    turned = np.array([expm(B * t) @ [math.radians(20.0), 0.0] for t in time])
    np.testing.assert_allclose(run["position"][:, 0], placed[:, :2], atol=1e-10)
    np.testing.assert_allclose(run["angle"][:, 0], turned[:, 0], atol=1e-9)
    np.testing.assert_allclose(run["bushing_force"][:, 0], -placed[:, :2] @ K - placed[:, 2:] @ D, atol=1e-7)
    np.testing.assert_allclose(run["bushing_torque"][:, 0], -6.0 * turned[:, 0] - 0.04 * turned[:, 1], atol=1e-8)
    stored = 0.5 * np.einsum("ti,ij,tj->t", placed[:, :2], K, placed[:, :2]) + 3.0 * turned[:, 0] ** 2
    np.testing.assert_allclose(run["bushing_energy"][:, 0], stored, atol=1e-9)
    assert_balance(run)


@pytest.mark.parametrize("method", METHODS)
def test_two_free_bodies(method):
    """Cross-check by a second formulation: Newton and Euler for two bodies, the force along the axes of the rotating start."""
    mass, inertia, eye = (2.0, 1.2), (0.03, 0.02), (np.array([0.15, 0.02]), np.array([-0.1, 0.05]))
    start = [0.0, 0.0, 0.3, 0.32, 0.1, -0.2, 0.4, -0.3, 3.0, -0.2, 0.5, -4.0]

    def turn(angle):
        return np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])

    def rate(mode, t, y):
        arm = turn(y[2]) @ eye[0], turn(y[5]) @ eye[1]
        velocity = [y[6:8] + y[8] * np.array([-arm[0][1], arm[0][0]]), y[9:11] + y[11] * np.array([-arm[1][1], arm[1][0]])]
        apart, apart_rate = y[3:5] + arm[1] - y[:2] - arm[0], velocity[1] - velocity[0]
        u = turn(-y[2]) @ apart
        u_rate = turn(-y[2]) @ apart_rate - y[8] * np.array([-u[1], u[0]])
        K, D = np.array([[400.0, 150.0], [150.0, 900.0]]), np.array([[1.5, -0.8], [-0.8, 3.0]])
        pull = turn(y[2]) @ (-K @ u - D @ u_rate)
        torque = -6.0 * (y[5] - y[2] + 0.5) - 0.04 * (y[11] - y[8])

        def moment(r, f):
            return float(r[0] * f[1] - r[1] * f[0])

        # the reaction acts on the start's body where the end is
        one = -torque - moment(arm[0] + apart, pull)
        return np.array(
            [*y[6:], *(-pull / mass[0]), one / inertia[0], *(pull / mass[1]), (torque + moment(arm[1], pull)) / inertia[1]]
        )

    def body(k):
        state, speed = start[3 * k : 3 * k + 3], start[6 + 3 * k : 9 + 3 * k]
        return sd.Body(
            f"body {k}",
            mass[k],
            inertia[k],
            {"eye": tuple(eye[k].tolist())},
            position=tuple(state[:2]),
            angle=state[2],
            velocity=tuple(speed[:2]),
            angular_velocity=speed[2],
        )

    bushing = sd.Bushing("rubber", ("body 0", "eye"), ("body 1", "eye"), free_angle=-0.5, **BUSHING_PARAMETERS)
    mechanism = sd.Mechanism((body(0), body(1)), components=(bushing,), gravity=0.0)
    run = sd.simulate(mechanism, until=1.0, method=method, samples=51, **TIGHT)
    _, _, at = phases(rate, (lambda t, y: 1.0, lambda t, y: 1.0), start, 1.0)
    found = at(run["time"].values)
    np.testing.assert_allclose(run["position"].values.reshape(51, 4), found[:, [0, 1, 3, 4]], atol=1e-8)
    np.testing.assert_allclose(run["angle"], found[:, [2, 5]], atol=1e-8)
    for momentum in momenta(run, mechanism):
        np.testing.assert_allclose(momentum, momentum[:1].repeat(51, axis=0), atol=1e-9)
    assert_balance(run)


@pytest.mark.parametrize("what", ["stiffness", "damping"])
def test_matrices_without_a_negative_eigenvalue(what):
    """Limit: the coupling up to the geometric mean of both axes, no more."""
    sd.Bushing("rubber", ("ground", "O"), ("plate", "eye"), **{f"{what}_x": 4.0, f"{what}_y": 9.0, f"{what}_xy": -6.0})
    with pytest.raises(sd.InputError, match=rf"{what}_xy = 6\.1.*otherwise the bushing generates energy"):
        sd.Bushing("rubber", ("ground", "O"), ("plate", "eye"), **{f"{what}_x": 4.0, f"{what}_y": 9.0, f"{what}_xy": 6.1})
