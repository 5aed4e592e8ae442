"""The step matrix and the time derivative with controllers, against numerical differentiation of the right-hand side."""

import math

import numpy as np
import pytest

import scissordyn as sd
from reference.kernels import accepted, at_start, check_step_matrix, check_time_derivative
from scissordyn.integrate.history import CHEBYSHEV_NODES, TRANSFORM, make_history

REFERENCE = sd.Harmonic(mean=0.5, amplitude=0.3, angular_frequency=20.0, phase=0.2)  # Reference angle of the controlled body
TIME = 0.3  # [s] instant at which derivatives are compared


def controlled_state(laws):
    """Return system and state of an array with controllers, not on its reference and with a history of delayed signals."""
    arm = sd.scissor(units=2, angle=0.5)
    for law in laws:
        torque = sd.Polynomial((3.0, 40.0, -200.0)) if law.uses_feed_forward else None
        arm = arm.controlled(
            law, reference=REFERENCE, feed_forward=torque, sensor=("slider", "centre"), start_on_reference=False
        )
    handle, state = at_start(arm)
    content, n = handle.content, handle.content.model.n
    rng = np.random.default_rng(5)
    state[n : 2 * n] += 0.1 * rng.normal(size=n)
    state[2 * n :] = 30.0 * rng.normal(size=state.size - 2 * n)
    accepted(handle, state)
    signals = content.state.initial_history.size
    if signals:
        history = make_history(signals, 10)
        wave = np.sin(8.0 * (TIME - 0.25 + 0.05 * CHEBYSHEV_NODES))
        for signal in range(signals):
            history[0, :2] = TIME - 0.3, 0.1
            history[0, 2 + signal * CHEBYSHEV_NODES.size :][: CHEBYSHEV_NODES.size] = TRANSFORM @ wave
        handle.exchange("state", history=history)
        content.state.history_length[0] = 1
    return handle, state, n


# Controllers whose derivatives are compared, with the feed-forward torque of some, by name
LAWS = {
    "pid": (sd.PID(300.0, 40.0, 700.0),),
    "limited": (sd.PID(300.0, 40.0, 700.0, limit=5.0, ramp=1.0),),
    "rate damping": (sd.FeedForward(300.0, 40.0, 700.0, eccentricity_rate_damping=60.0, regularisation_length=0.2),),
    "several": (
        sd.FeedForward(30.0, eccentricity_rate_damping=6.0, regularisation_length=0.2),
        sd.ExtendedDelayedFeedback(7.0, 0.25, 0.3, "sensor_rate_y"),
    ),
    "two integrals": (sd.PID(30.0, 4.0, 70.0), sd.PID(20.0, 3.0, 50.0)),
}


@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize("step", [1e-4, 1e-2])
def test_step_matrix_is_the_derivative(name, step):
    """Cross-check: W^-1 r from the structured solve equals that of a differenced Jacobian (relative error of differences)."""
    handle, state, _ = controlled_state(LAWS[name])
    check_step_matrix(handle, state, step, 1e-5 * (1.0 + np.abs(state)), TIME)


@pytest.mark.parametrize("name", LAWS)
def test_time_derivative(name):
    """Cross-check: the partial derivative by time equals a central difference at fixed state."""
    handle, state, _ = controlled_state(LAWS[name])
    by_time = check_time_derivative(handle, state, 1e-6, time=TIME, rtol=1e-6)
    assert np.max(np.abs(by_time)) > 0.1
    assert math.isfinite(float(np.sum(by_time)))
