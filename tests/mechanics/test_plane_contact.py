"""Contact points at guide surfaces: the step matrix, and the forces between the two bodies."""

import dataclasses
from functools import partial

import numpy as np
import pytest
from tests.build import momenta

import scissordyn as sd
from reference.kernels import check_step_matrix, check_time_derivative, increments, touching
from scissordyn.laws.elastic.power_law import PowerLaw
from scissordyn.laws.friction.threlfall import Threlfall
from scissordyn.mechanics import functions


def floating(clearance):
    """Return a block in a channel of a body that floats and tumbles freely."""
    block = sd.Body("block", 2.0, 4e-3, {"guided": (0.01, -0.02)}, centre=(0.02, 0.01), position=(0.03, 0.02), angle=0.4)
    frame = sd.Body("frame", 5.0, 0.05, {"end": (0.3, 0.0)}, centre=(0.1, -0.03), position=(-0.1, 0.05), angle=-0.3)
    frame = dataclasses.replace(frame, velocity=(0.2, -0.1), angular_velocity=3.0)
    block = dataclasses.replace(block, velocity=(0.5, 0.3))
    guide = sd.Guide("channel", ("block", "guided"), through=(0.05, 0.02), direction=0.7, body="frame")
    return sd.Mechanism((block, frame), guides=(guide,), gravity=0.0).with_clearance("channel", clearance)


def crank_and_block(clearance):
    """Return a slider-crank whose slider is a block in a channel."""
    linkage = sd.slider_crank(gravity=9.81, angle=0.5, slider_inertia=2e-5)
    drive = sd.Harmonic(mean=0.5 - 0.3 * np.sin(0.2), amplitude=0.3, angular_frequency=20.0, phase=0.2)
    return linkage.driven(drive).with_clearance("guide", clearance)


two_touching = partial(touching, chosen=[0, 2], surface="level")
"""The system in a random state in which two corners slide in contact."""

# Clearance of a block in its guide
BLOCK = sd.GuideClearance(5e-4, length=0.06, width=0.03, corner_radius=3e-3, friction=sd.LuGre(0.1))


@pytest.mark.parametrize("describe", [floating, crank_and_block])
@pytest.mark.parametrize("step", [1e-7, 1e-5, 1e-3])
def test_step_matrix_is_the_derivative(describe, step):
    """Cross-check: W^-1 r from the structured solve equals that of a differenced Jacobian, to the error of differences."""
    handle, state = two_touching(describe(BLOCK), 7)
    check_step_matrix(handle, state, step, increments(handle, state))


def test_time_derivative():
    """Cross-check: the partial derivative by time equals a central difference at fixed state."""
    handle, state = two_touching(crank_and_block(BLOCK), 3)
    assert np.any(check_time_derivative(handle, state, 1e-9))


def test_rate_of_the_gap_is_its_derivative():
    """Cross-check: delta' of each corner is the central difference of delta along the motion."""
    handle, state = two_touching(floating(BLOCK), 5)
    n = handle.content.model.n
    gap, rate = np.zeros(4), np.zeros(4)
    functions.guards(0.0, state, handle.address, gap, rate)
    ends, h = [], 1e-7
    for sign in (1.0, -1.0):
        moved, there = state.copy(), np.zeros(4)
        moved[:n] += sign * h * state[n : 2 * n]
        functions.guards(0.0, moved, handle.address, there, np.zeros(4))
        ends.append(there)
    np.testing.assert_allclose(rate, (ends[0] - ends[1]) / (2.0 * h), rtol=1e-7, atol=1e-9)


def test_floating_guide_keeps_momenta():
    """Identity: without outer forces both momenta are constant, and damping and friction account for the energy."""
    mechanism = floating(dataclasses.replace(BLOCK, clearance=1e-3, stiffness=PowerLaw(1e8, 1.5), friction=Threlfall(0.1)))
    run = sd.simulate(mechanism, until=0.3, rtol=1e-9, atol=1e-9)
    assert run.attrs["status"] == "complete"
    linear, angular = momenta(run, mechanism)
    assert run.sizes["contact"] > 5
    assert np.max(run["friction_loss"].values) > 1e-3 * run["kinetic_energy"].values[0]
    # round-off, gathered over some hundred steps
    assert np.max(np.abs(linear - linear[0])) < 1e-13 * np.max(np.abs(linear[0]))
    assert np.max(np.abs(angular - angular[0])) < 1e-12
    # the quadratures' fraction of the tolerance
    assert np.max(np.abs(run["energy_residual"].values)) < 1e-9 * run["kinetic_energy"].values[0]


def test_reactions_balance_the_body_of_the_guide():
    """Identity: the forces of the corners account for the accelerations of both bodies."""
    mechanism = floating(dataclasses.replace(BLOCK, stiffness=PowerLaw(1e7, 1.5), friction=Threlfall(0.3)))
    run = sd.simulate(mechanism, until=0.05)
    force = run["reaction"].sel(joint="channel").values
    touching = np.abs(force).max(axis=1) > 1.0
    assert np.sum(touching) > 20
    names = ["channel/corner 1", "channel/corner 2", "channel/corner 3", "channel/corner 4"]
    np.testing.assert_allclose(force, run["reaction"].sel(joint=names).sum("joint").values, atol=1e-12)
    for body, sign in (("block", 1.0), ("frame", -1.0)):
        pushed = mechanism.body(body).mass * run["acceleration"].sel(body=body).values
        np.testing.assert_allclose(pushed, sign * force, atol=1e-9 * np.max(np.abs(force)))
