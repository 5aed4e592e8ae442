"""The step matrix and the time derivative, compared with numerical differentiation of the right-hand side."""

from dataclasses import replace

import numpy as np
import pytest

import scissordyn as sd
from reference.kernels import check_step_matrix, check_time_derivative, increments, touching
from scissordyn.laws.damping.standard_linear_solid import StandardLinearSolid
from scissordyn.laws.evaluate import reference_speed
from scissordyn.mechanics import functions


def array(joint, units, slip="surfaces", **laws):
    """Return a moving array with a clearance joint with friction."""
    drive = sd.Harmonic(mean=0.5, amplitude=0.3, angular_frequency=40.0, phase=0.2)
    arm = sd.scissor(units=units, angle=0.5 + 0.3 * np.sin(0.2)).driven(drive)
    return arm.with_clearance(joint, sd.Clearance(5e-4, **{"friction": sd.LuGre(0.1)} | laws, slip=slip))


@pytest.mark.parametrize(
    ("joint", "units"), [("A", 2), ("O", 1), ("unit 1/pivot", 2), ("unit 1/upper", 3), ("unit 2/lower", 3)]
)
@pytest.mark.parametrize("step", [1e-7, 1e-5, 1e-3])
def test_step_matrix_is_the_derivative(joint, units, step):
    """Cross-check: W^-1 r from the structured solve equals that of a differenced Jacobian, to the error of differences."""
    handle, state = touching(array(joint, units), 7)
    check_step_matrix(handle, state, step, increments(handle, state))


@pytest.mark.parametrize("joint", ["A", "unit 1/pivot"])
@pytest.mark.parametrize("speed", [0.0, 1e-3])
@pytest.mark.parametrize("step", [1e-7, 1e-5, 1e-3])
def test_step_matrix_of_contacts_that_are_loaded(joint, speed, step):
    """Cross-check: step matrix where the reference speed of damping depends on indentation and its rate."""
    handle, state = touching(array(joint, 2), 7)
    content = handle.content
    content.state.memory[:], content.state.mass[:] = speed, 0.7
    functions.rate(0.0, state, handle.address, np.zeros(state.size))
    contact = content.work.contact[0]
    assert reference_speed(contact["elastic"], contact["depth"], contact["rate"], speed, 0.7) > 1.1 * speed
    check_step_matrix(handle, state, step, increments(handle, state))


@pytest.mark.parametrize("joint", ["A", "unit 1/pivot"])
def test_step_matrix_with_the_slip_of_contact_points(joint):
    """Cross-check: step matrix where the slip speed is e'.t delta/|e|."""
    handle, state = touching(array(joint, 2, "contact-points"), 7)
    check_step_matrix(handle, state, 1e-5, increments(handle, state))


@pytest.mark.parametrize("friction", [sd.NoFriction(), sd.LuGre(0.1)])
@pytest.mark.parametrize("step", [1e-7, 1e-5, 1e-3])
def test_step_matrix_with_states_of_the_normal_force(friction, step):
    """Cross-check: step matrix where surfaces relax, with and without bristles."""
    handle, state = touching(array("A", 2, damping=StandardLinearSolid(1.5, 3e-4), friction=friction), 7)
    state[-1] = 40.0
    sizes = increments(handle, state)
    sizes[-1] = 1e-3
    check_step_matrix(handle, state, step, sizes)


@pytest.mark.parametrize("units", [2, 3])
@pytest.mark.parametrize("damped", [False, True])
@pytest.mark.parametrize("step", [1e-7, 1e-5, 1e-3])
def test_step_matrix_with_eliminated_unknowns(units, damped, step):
    """Cross-check: step matrix where bristles and pairs of multiplier and coordinate are eliminated before the band."""
    arm = sd.scissor(units=units, angle=0.6).with_clearance("all", sd.Clearance(5e-4, friction=sd.LuGre(0.1)))
    if damped:  # a state of a component, and one body that is moved by a time function
        clutch = sd.Clutch("clutch", "unit 1/bar 1", 20.0, base="unit 1/bar 2", yield_angle=2e-3)
        arm = replace(arm, components=(clutch,)).driven(sd.Harmonic(mean=0.6, amplitude=0.3, angular_frequency=40.0))
    closed = np.arange(len(arm.clearance_joints)) % 4 > 0  # one joint in four stays open
    handle, state = touching(arm, 11, closed, spread=1e-4)
    model = handle.content.model
    n, states = model.n, int(model.state_start[-1])
    assert model.pair.shape[0] > 0
    assert int(np.sum(model.permutation < 0)) == states + model.pair.shape[0]
    assert handle.content.work.band.shape[0] == n + handle.content.work.multiplier.size - 2 * model.pair.shape[0]
    check_step_matrix(handle, state, step, increments(handle, state))


@pytest.mark.parametrize(("joint", "units"), [("A", 2), ("unit 1/pivot", 2), ("unit 1/upper", 3)])
def test_time_derivative(joint, units):
    """Cross-check: the partial derivative by time equals a central difference at fixed state."""
    handle, state = touching(array(joint, units), 3)
    check_time_derivative(handle, state, 1e-9)
