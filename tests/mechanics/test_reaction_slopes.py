"""The step matrix with friction that follows reactions, compared with differences of the right-hand side."""

import dataclasses

import numpy as np
import pytest

import scissordyn as sd
from reference.kernels import accepted, at_start, check_step_matrix, check_time_derivative
from scissordyn.plan import joint_friction

FRICTION = {"radius": 0.02, "kinetic": 0.3}  # Pin radius [m] and friction coefficient


def arm(driven, **friction):
    """Return an arm with friction in its ideal pins and a spring at its tip; driven with a loose joint, or free."""
    array = sd.scissor(units=2, angle=0.6)
    tip = next(iter(array.body("unit 2/bar 1").points))
    spring = sd.Spring("spring", ("ground", "origin"), ("unit 2/bar 1", tip), stiffness=300.0, free_length=1.0)
    array = dataclasses.replace(array, components=(spring,))
    if driven:
        array = array.with_clearance("A", sd.Clearance(5e-4)).driven(sd.Harmonic(0.6, 0.3, 40.0))
    return sd.with_joint_friction(array, **FRICTION, **friction)


def crank(driven, **friction):
    """Return a slider-crank with friction in its pins, closed by quadratic constraints."""
    linkage = sd.slider_crank(crank=0.1, rod=0.3)
    linkage = linkage.driven(sd.Harmonic(0.6, 0.3, 40.0)) if driven else linkage
    return sd.with_joint_friction(linkage, **FRICTION, **friction)


@pytest.mark.parametrize("kind", [arm, crank])
@pytest.mark.parametrize("driven", [False, True])
@pytest.mark.parametrize("friction", [{"transition": 0.3}, {"bristle_stiffness": 1e3, "bristle_damping": 3.0}])
def test_step_matrix(kind, driven, friction):
    """Cross-check: W^-1 r and the derivative by time equal those of differences; the slopes of the reactions are not zero."""
    handle, state = at_start(kind(driven, **friction))
    n = handle.content.model.n
    rng = np.random.default_rng(3)
    state[n : 2 * n] += rng.normal(size=n)
    state[2 * n :] = 0.05 * rng.normal(size=state.size - 2 * n)
    accepted(handle, state)
    steps = np.repeat([1e-6, 1e-6, 1e-6], [n, n, state.size - 2 * n])
    for step in (1e-4, 1e-2):
        check_step_matrix(handle, state, step, steps)
    if driven:
        check_time_derivative(handle, state, 1e-6)
    assert float(np.abs(handle.content.friction.by_state).max()) > 0.0


def test_steps_saved_by_slopes_of_reactions(monkeypatch):
    """Contract: a crank that runs down takes less than a quarter of the implicit steps needed with constant reactions."""
    crank = sd.slider_crank(crank=0.1, rod=0.3).replace("crank.angular_velocity", 30.0)
    rubbing = sd.with_joint_friction(crank, radius=0.012, kinetic=0.3)
    ends = []
    for most in (0, 40):
        monkeypatch.setattr(joint_friction, "COUPLED_STATES_MAX", most)
        batch = sd.simulate_many(rubbing, {"gravity": [9.81]}, until=5.0, method="rodas5p", measures=["steps", "damper_loss"])
        ends.append((float(batch["steps"][0]), float(batch["damper_loss"][0])))
    assert ends[1][0] < ends[0][0] / 4.0
    assert ends[1][1] == pytest.approx(ends[0][1], rel=1e-4)
