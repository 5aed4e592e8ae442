"""Internal states of components: their unit, and the scale that their errors are compared with."""

from __future__ import annotations

import math
from typing import Annotated

import numpy as np
import pytest
from tests.build import on_pin, warnings_of

import scissordyn as sd
from scissordyn.plan.plan import plan
from scissordyn.plan.system import make_system
from scissordyn.run.advance.tolerance import Tolerances, error_weights

TORQUE = 2.0  # [N m] torque of the dashpot at the speed of the tests


def creep_force(angle, speed, twist, stiffness, viscosity):
    """Return torque, energy, loss and state rate of a torsion spring and a dashpot in series, whose twist is the state."""
    torque = stiffness * (angle - twist)
    return -torque, 0.5 * torque * torque / stiffness, torque * torque / viscosity, torque / viscosity


def creeping(state: sd.State, name: str = "Creep") -> type:
    """Return a class of components with the state `state`."""

    @sd.component(port="hinge", force=creep_force, states=(state,), section=name.lower())
    class Creep:
        name: str
        body: str
        stiffness: Annotated[float, sd.Quantity("N m/rad", above=0.0)]
        viscosity: Annotated[float, sd.Quantity("N m s/rad", above=0.0)]
        base: str = "ground"

    return Creep


# Class of a component whose internal state has an error scale computed from its stiffness
BY_TORQUE = creeping(sd.State("twist", "rad", scale=lambda part: TORQUE / part.stiffness), "by_torque")
# Class of the same component, with a number as error scale of its state
BY_NUMBER = creeping(sd.State("twist", "rad", scale=TORQUE / 1e6), "by_number")
# Class of the same component, with an error scale that is far too large
COARSE = creeping(sd.State("twist", "rad", scale=1.0), "coarse")


def turning(*components: object) -> sd.Mechanism:
    """Return a bar that rotates at 2 rad/s, with components."""
    return on_pin(sd.bar("rod", length=1.0, mass=2.0), *components).driven(speed=2.0)


@pytest.mark.parametrize("stiffness", [1e2, 1e4, 1e6, 1e8])
@pytest.mark.parametrize("tolerance", [1e-6, 1e-8])
def test_the_torque_is_right_at_any_stiffness(stiffness, tolerance):
    """Closed form: T = c W (1 - exp(-k t/c)), also where the transient is 1e8 times faster than the motion.

    The tolerance is one of each step, and the samples lie between them. Rounding of an angle of 1 rad leaves k eps of torque.
    """
    run = sd.simulate(turning(BY_TORQUE("creep", "rod", stiffness, 1.0)), until=0.5, rtol=tolerance, atol=tolerance)
    exact = TORQUE * (np.exp(-stiffness * run["time"].values) - 1.0)
    error = float(np.max(np.abs(run["by_torque_torque"].values[:, 0] - exact)))
    assert error < 100.0 * tolerance * TORQUE + 100.0 * stiffness * np.finfo(float).eps
    assert warnings_of(run) == []


def test_a_number_is_a_scale_too():
    """Contract: a number in the place of the function of the part."""
    one, other = (sd.simulate(turning(kind("creep", "rod", 1e6, 1.0)), until=0.1) for kind in (BY_TORQUE, BY_NUMBER))
    np.testing.assert_array_equal(one["by_torque_torque"], other["by_number_torque"])


def test_a_scale_that_does_not_fit_is_told():
    """Limit: a scale of 1 rad at a twist of 2e-6 rad is a warning with the scale that would fit."""
    run = sd.simulate(turning(COARSE("creep", "rod", 1e6, 1.0)), until=0.5)
    said = [text for text in warnings_of(run) if "its state 'twist'" in text]
    assert len(said) == 1
    assert "the scale of 1 rad is too large" in said[0]
    suggested = float(said[0].split("about ")[1].split(" rad")[0])
    assert 1e-6 < suggested < 1e-5


def weights(*components: object) -> Tolerances:
    """Return the error weights of a mechanism at its start."""
    made = plan(turning(*components))
    system = make_system(made)
    y = np.zeros(2 * made.coordinates.free + int(system.content.model.state_start[-1]))
    return error_weights(made, system, y, rtol=1e-8, atol=1e-9)


def test_each_state_is_weighed_alone():
    """Contract: the tolerance times its own scale, whatever is beside it."""
    soft, stiff = BY_TORQUE("soft", "rod", 10.0, 1.0), BY_TORQUE("stiff", "rod", 1e7, 1.0)
    found = weights(soft, stiff)
    np.testing.assert_allclose(found.absolute, [1e-9 * TORQUE / 10.0, 1e-9 * TORQUE / 1e7], rtol=1e-14)
    assert found.group.tolist()[-3:] == [0, 1, 2]
    assert np.all(found.relative < 1e-14)


@pytest.mark.parametrize("scale", [0.0, -1.0, float("nan"), float("inf"), "1 rad"])
def test_a_scale_that_is_no_size(scale):
    """Contract: what is no size is refused before the run, in one line."""
    part = creeping(sd.State("twist", "rad", scale=lambda part: scale), "odd")("creep", "rod", 1e6, 1.0)
    with pytest.raises(sd.InputError, match=r"'creep': the scale of its state 'twist' is .*finite number above zero \[rad\]"):
        sd.simulate(turning(part), until=0.1)


def test_the_torque_of_an_integrator():
    """Contract: weighed against 1 N m, in a small mechanism against its own torques m L a, not against 1 N m."""
    for size, mass in ((1.0, 2.0), (1e-3, 1e-6)):
        free = on_pin(sd.bar("rod", length=size, mass=mass), gravity=9.81)
        held = free.controlled(sd.PID(1e-3 * mass, integral=1e-3 * mass), reference=sd.Polynomial((0.1,)))
        made = plan(held)
        system = make_system(made)
        y = np.zeros(2 * made.coordinates.free + 1)
        y[: made.coordinates.free] = made.coordinates.placed[0][: made.coordinates.free]
        found = error_weights(made, system, y, rtol=1e-8, atol=1e-8)
        fastest = (found.absolute[0] / found.absolute[made.coordinates.free]) ** -2  # 1/t_f^2 of the reference length
        assert found.absolute[-1] == pytest.approx(1e-8 * min(1.0, mass * size * size * fastest), rel=1e-9)
        assert found.relative[-1] == 1e-8


def test_the_states_of_friction_laws():
    """Contract: as docs/decisions/0010 says, 100 times the tolerance of their size in steady sliding, in one group."""
    law = sd.LuGre(0.05)
    arm = sd.scissor().with_clearance("all", sd.Clearance(2e-4, friction=law)).driven(speed=1.0)
    made = plan(arm)
    system, n, contacts = make_system(made), made.coordinates.free, len(arm.contacts)
    found = error_weights(made, system, np.zeros(2 * n + contacts), rtol=1e-8, atol=1e-9)
    assert found.group.tolist() == [0, n, 2 * n, 2 * n + contacts]
    np.testing.assert_array_equal(found.relative[2 * n :], 1e-6)
    np.testing.assert_allclose(found.absolute[2 * n :], 1e-6 * 0.05 / law.bristle_stiffness, rtol=1e-3)


def test_modes_with_an_internal_state():
    """Closed form: wheel on a spring, and on a spring and a dashpot in series, by the eigenvalues of angle, speed and twist."""
    inertia, spring, stiffness, viscosity = 2.0, 50.0, 80.0, 6.0
    wheel = sd.Body("wheel", 1.0, inertia, {"pin": (0.0, 0.0)}, position=(0.0, 0.0), angle=0.0)
    pin = sd.Revolute("pin", ("wheel", "pin"), ("ground", "O"))
    parts = (sd.TorsionSpring("spring", "wheel", stiffness=spring), BY_NUMBER("creep", "wheel", stiffness, viscosity))
    found = sd.modes(sd.Mechanism((wheel,), (pin,), ground=(("O", (0.0, 0.0)),), components=parts))
    held = (spring + stiffness) / inertia
    roots = np.linalg.eigvals([[0, 1, 0], [-held, 0, stiffness / inertia], [stiffness / viscosity, 0, -stiffness / viscosity]])
    root = roots[np.argmax(roots.imag)]
    assert found["angular_frequency"].item() == pytest.approx(math.sqrt(held), rel=1e-7)
    assert found["damping_ratio"].item() == pytest.approx(-root.real / abs(root), rel=1e-7)
    assert 2.0 * math.pi * found["damped_frequency"].item() == pytest.approx(root.imag, rel=1e-7)
