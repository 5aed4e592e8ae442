"""Singular positions: passed correctly, or named as the cause."""

import math

import numpy as np
import pytest
from energy_balance import closure_error, energy_drift

import scissordyn as sd

PIN = sd.Clearance(1e-3)  # Clearance of the joints
TIGHT = {"rtol": 1e-10, "atol": 1e-10}  # Tolerances of accurate runs


def names_a_part(run, mechanism):
    """Return whether the cause of a failed run names a body, a joint or a guide of the mechanism."""
    names = [*(body.name for body in mechanism.bodies), *mechanism.joint_names]
    return any(f"'{name}'" in run.attrs["cause"] for name in names)


@pytest.mark.parametrize("units", [1, 2, 3, 8])
def test_driven_through_the_upright_position(units):
    """Limit: at 90 deg all pivots are on one line; the array passes, and torque and energy are those of its mirror image.

    Without gravity the motion beyond 90 deg is the mirror image of the earlier one in reverse, so that the torque is odd.
    """
    array = sd.scissor(units=units, angle=math.pi / 2 - 0.3, gravity=0.0).driven(speed=1.0)
    run = sd.simulate(array, until=0.6, samples=61, **TIGHT)
    assert run.attrs["status"] == "complete"
    assert closure_error(run, array) < 1e-12
    torque = run["drive_torque"].values
    assert np.allclose(torque, -torque[::-1], rtol=0, atol=1e-8 * np.max(np.abs(torque)))
    assert float(np.max(np.abs(run["energy_residual"]))) < 1e-8 * float(run["kinetic_energy"].max())


@pytest.mark.parametrize("units", range(1, 6))
def test_falling_through_the_folded_position(units):
    """Identity: a falling array passes th = 0, where its bars lie on one line, or the run ends and names them.

    If it passes, energy is constant and the bars of a unit stay each other's mirror image.
    """
    array = sd.scissor(units=units)
    run = sd.simulate(array, until=1.0, samples=201, **TIGHT)
    if run.attrs["status"] != "complete":
        assert names_a_part(run, array), run.attrs["cause"]
        return
    assert energy_drift(run, array) < 1e-8
    assert closure_error(run, array) < 1e-12
    for unit in range(1, units + 1):
        first, second = (run["angle"].sel(body=f"unit {unit}/bar {number}").values for number in (1, 2))
        assert np.allclose(first, -second, rtol=0, atol=1e-6)


def clearance_array(units, joint):
    """Return an array folded at 1 rad/s within 0.1 s, with clearance at one joint."""
    return sd.scissor(units=units, angle=0.1).with_clearance(joint, PIN).driven(speed=-1.0)


# Functions that build a mechanism that reaches a singular position, and the end of its run [s]
ENDS = {
    **{f"folded array of {n}": (lambda n=n: sd.scissor(units=n, angle=0.3).driven(speed=-1.0), 1.0) for n in (1, 2, 3)},
    "folded array, clearance at A": (lambda: clearance_array(2, "A"), 0.2),
    "folded array, clearance at a pivot": (lambda: clearance_array(2, "unit 1/pivot"), 0.2),
    "folded array, clearance at an inner end joint": (lambda: clearance_array(2, "unit 1/lower"), 0.2),
    "ring at its limit": (lambda: sd.hoberman_ring(units=6).driven(speed=1.0), 1.0),
    "kite folded": (
        lambda: sd.four_bar(ground=0.2, crank=0.2, coupler=0.3, rocker=0.3, gravity=0.0, angle=0.3).driven(speed=-1.0),
        0.5,
    ),
    "crossed parallelogram folded": (
        lambda: sd.four_bar(ground=0.2, crank=0.1, coupler=0.2, rocker=0.1, gravity=0.0, angle=0.3, branch="crossed").driven(
            speed=-1.0
        ),
        0.5,
    ),
    "crank driven beyond the rocker's reach": (
        lambda: sd.four_bar(ground=0.2, crank=0.15, coupler=0.12, rocker=0.1).driven(speed=1.0),
        0.5,
    ),
    "crank driven beyond the rod's reach": (lambda: sd.slider_crank(crank=0.12, rod=0.1, angle=0.5).driven(speed=1.0), 1.0),
    "rod as long as the crank": (lambda: sd.slider_crank(crank=0.1, rod=0.1, angle=1.2).driven(speed=1.0), 0.5),
}


@pytest.mark.parametrize("case", ENDS)
def test_singular_position_is_passed_or_named(case):
    """Identity: a driven mechanism passes a singular position with closed balance and joints, or names the cause."""
    build, until = ENDS[case]
    mechanism = build()
    run = sd.simulate(mechanism, until=until, samples=51, **TIGHT)
    assert closure_error(run, mechanism) < 1e-12
    assert np.all(np.isfinite(run["energy_residual"].values))
    if run.attrs["status"] == "complete":
        balance = run["kinetic_energy"] + abs(run["potential_energy"]) + abs(run["drive_work"])
        assert float(np.max(np.abs(run["energy_residual"]))) < 1e-6 * float(balance.max())
    else:
        # what it cannot pass is an ideal joint or a body, not whichever joint has clearance
        ideal = mechanism.ideal() if mechanism.clearance_joints else mechanism
        clearance = {joint.name for joint in mechanism.clearance_joints}
        named = [*(body.name for body in ideal.bodies), *(name for name in ideal.joint_names if name not in clearance)]
        assert any(f"'{name}'" in run.attrs["cause"] for name in named), run.attrs["cause"]
