"""Fixed tendons of MJCF: equalities become couplings of several joints, actuators forces on the joints."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import scissordyn as sd

from .peer import followed

STIFF = 'solref="2e-4 1" solimp="0.9999 0.9999 0.001"'  # MJCF attributes of an equality as stiff as the time step permits

# MJCF model of a finger with three joints, a slider and tendons
FINGER = """<mujoco><compiler angle="radian"/><option gravity="0 0 -9.81" timestep="1e-4" integrator="RK4"/>
<default><geom contype="0" conaffinity="0"/></default><worldbody>
<body name="first"><joint name="a" axis="0 1 0" ref="0.1"/><geom type="capsule" fromto="0 0 0 0.4 0 0" size="0.02" mass="0.9"/>
<body name="second" pos="0.4 0 0"><joint name="b" axis="0 -1 0"/>
<geom type="capsule" fromto="0 0 0 0.3 0 0" size="0.02" mass="0.6"/>
<body name="third" pos="0.3 0 0" euler="0 0.3 0"><joint name="c" axis="0 1 0"/>
<geom type="capsule" fromto="0 0 0 0.2 0 0" size="0.02" mass="0.4"/></body></body></body>
<body name="block" pos="1 0 0"><joint name="s" type="slide" axis="1 0 0.3"/><geom size="0.05" mass="0.7"/></body></worldbody>
<tendon><fixed name="flexor"><joint joint="a" coef="0.5"/><joint joint="b" coef="-0.8"/><joint joint="c" coef="1.1"/></fixed>
<fixed name="pull"><joint joint="s" coef="2"/><joint joint="c" coef="0.3"/></fixed>{more}</tendon>
<equality>{equality}</equality><actuator>{motor}</actuator>
<keyframe><key qpos="{start}" ctrl="{input}"/></keyframe></mujoco>"""


def finger(equality="", motor="", more="", start="0.1 0 0 0", input=""):
    return FINGER.format(equality=equality, motor=motor, more=more, start=start, input=input)


# Start at which the flexor's length is 0.07 above its reference: 0.5 * 0.3 - 0.8 * 0.4 + 1.1 * c = 0.07
OPEN = f"0.4 0.4 {(0.07 + 0.17) / 1.1!r} 0"


@pytest.mark.parametrize(
    ("equality", "start", "names"),
    [
        (f'<tendon name="hold" tendon1="flexor" polycoef="0.07 0 0 0 0" {STIFF}/>', OPEN, ["hold"]),
        (f'<tendon tendon1="flexor" tendon2="pull" polycoef="0 1.5 0 0 0" {STIFF}/>', "0.1 0 0 0", ["coupling of a"]),
    ],
)
def test_a_held_tendon_moves_as_in_mujoco(equality, start, names):
    """Cross-check by a second code: a tendon at a length, and two tendons that share a joint."""
    text = finger(equality, start=start)
    assert [part.name for part in sd.read_mjcf(text).mechanism.couplings] == names
    here, there = followed(text)
    free, _ = followed(finger(start=start))
    assert np.max(abs(here - there)) < 2e-9
    assert np.max(abs(here - free)) > 0.02


def test_a_held_tendon_moves_by_lagrange():
    """Independent formulation: absolute angles of three bars, whose weighted sum is constant, with one multiplier."""
    mechanism, _ = sd.read_mjcf(finger('<tendon tendon1="flexor"/>'))
    run = sd.simulate(mechanism, until=0.5, samples=6, rtol=1e-10, atol=1e-12)
    bars = [mechanism.body(name) for name in ("first", "second", "third")]
    mass, inertia = (np.array([getattr(bar, name) for bar in bars]) for name in ("mass", "inertia"))
    length, centre = np.array([0.4, 0.3, 0.2]), np.array([bar.centre[0] for bar in bars])
    reach = np.tril(np.tile(length, (3, 1)), -1) + np.diag(centre)  # lever of the angle of bar j in the centre of bar i
    # hinges about y turn clockwise in the plane of x and z, so a = -first, b = second - first and c = second - third
    weights = np.array([-0.5 + 0.8, -0.8 + 1.1, -1.1])

    def rates(_, state):
        angle, speed = state[:3], state[3:]
        x, y = reach * np.cos(angle), reach * np.sin(angle)
        matrix = np.einsum("i,ij,ik->jk", mass, x, x) + np.einsum("i,ij,ik->jk", mass, y, y) + np.diag(inertia)
        # centres accelerate by (-y, x) times the angular accelerations, and by -(x, y) times the squared speeds
        force = np.einsum("i,ij,ik,k->j", mass, x, y, speed**2) - np.einsum("i,ij,ik,k->j", mass, y, x, speed**2)
        force = force - 9.81 * mass @ x
        whole = np.block([[matrix, weights[:, None]], [weights[None, :], np.zeros((1, 1))]])
        return np.concatenate([speed, np.linalg.solve(whole, np.append(force, 0.0))[:3]])

    start = np.append(run["angle"].sel(body=["first", "second", "third"]).values[0], np.zeros(3))
    found = solve_ivp(rates, (0.0, 0.5), start, "DOP853", run["time"].values, rtol=1e-11, atol=1e-12).y[:3].T
    here = run["angle"].sel(body=["first", "second", "third"]).values
    assert np.ptp(here, axis=0).min() > 0.3
    assert here == pytest.approx(found, abs=1e-8)


def test_actuators_on_tendons_move_as_in_mujoco():
    """Cross-check by a second code: forces by coefficients, force limits, and a servo on a tendon of one joint."""
    motor = """<motor name="close" tendon="flexor" gear="-0.6" forcerange="-1 1"/><motor name="draw" tendon="pull" gear="0.5"/>
    <position name="hold" tendon="one" kp="2" kv="0.3"/>"""
    text = finger(motor=motor, more='<fixed name="one"><joint joint="b" coef="1.5"/></fixed>', input="2 0.8 0.2")
    mechanism, notes = sd.read_mjcf(text)
    torques = {part.name: part.torque for part in mechanism.components if isinstance(part, sd.Torque)}
    assert torques == pytest.approx({"close on a": 0.3, "close on b": 0.48, "close on c": 0.66, "draw on c": -0.12})
    assert "actuator 'draw on s': its input is held at 0.8, so its force is 0.8 N" in notes
    here, there = followed(text)
    assert np.max(abs(here - followed(finger())[0])) > 0.05
    assert np.max(abs(here - there)) < 1e-10


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"motor": '<position name="m" tendon="flexor"/>', "input": "0"}, "actuator 'm': left out; its force depends on the"),
        ({"motor": '<motor name="m" tendon="gone"/>'}, "1 <motor> left out: 'm' (line 11)"),
        ({"equality": '<tendon name="e" tendon1="gone"/>'}, "1 <tendon> left out: 'e' (line 11)"),
        ({"equality": '<tendon name="e" tendon1="one"/>'}, "equality 'e': left out; it relates fewer than two joints"),
        (
            {"equality": '<tendon name="e" tendon1="flexor" tendon2="pull" polycoef="0 1 1 0 0"/>'},
            "equality 'e': left out; its polynomial is not linear",
        ),
        ({"equality": '<tendon name="e" tendon1="flexor" polycoef="0.1 0 0 0 0"/>'}, "equality 'e' is open by 0.2 rad at"),
        ({"more": '<fixed name="t" stiffness="3"><joint joint="a" coef="1"/></fixed>'}, "attribute 'stiffness' of 1 <fixed>"),
        ({"more": '<fixed name="t" range="0 1"><joint joint="a" coef="1"/></fixed>'}, "limits of tendon 't': left out"),
        ({"more": '<fixed name="t"><joint joint="gone" coef="1"/></fixed>'}, "1 <fixed> left out: 't' (line 10)"),
        ({"more": '<spatial name="gone"><site site="p"/><site site="q"/></spatial>'}, "1 <spatial> left out: 'gone' (line 10)"),
    ],
)
def test_what_a_tendon_cannot_hold_is_named(given, said):
    """Contract: nothing is dropped in silence."""
    default = {"more": '<fixed name="one"><joint joint="b" coef="1"/></fixed>'}
    assert any(note.startswith(said) for note in sd.read_mjcf(finger(**default | given)).notes)
