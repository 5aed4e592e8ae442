"""Models in MJCF and URDF that are planar mechanisms."""

import numpy as np
import pytest
from tests.build import one_line_error

import scissordyn as sd
from scissordyn.exchange.mjcf_text import mjcf

from .peer import by_mujoco, centres, followed

# MJCF model of a double pendulum
DOUBLE = """<mujoco>
  <option gravity="0 0 -9.81" timestep="0.0005" integrator="RK4"/>
  <default><geom contype="0" conaffinity="0"/></default>
  <worldbody>
    <body name="upper" pos="0.1 0 2" euler="0 60 0">
      <joint name="hip" type="hinge" axis="0 1 0"/>
      <geom type="capsule" fromto="0 0 0 0 0 -0.7" size="0.03" mass="2"/>
      <body name="lower" pos="0 0 -0.7" euler="0 -20 0">
        <joint name="knee" type="hinge" axis="0 1 0"/>
        <geom type="box" size="0.04 0.03 0.25" pos="0.05 0 -0.3" mass="1.3"/>
      </body>
    </body>
  </worldbody>
</mujoco>"""

# MJCF model of a slider-crank
CRANK = """<mujoco>
  <option gravity="0 -9.81 0"/>
  <worldbody>
    <body name="crank">
      <joint name="O" type="hinge" axis="0 0 1" damping="0.1"/>
      <geom type="capsule" fromto="0 0 0 0.3 0 0" size="0.02" mass="1"/>
    </body>
    <body name="rod" pos="0.3 0 0">
      <joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/><joint type="hinge" axis="0 0 1"/>
      <geom type="capsule" fromto="0 0 0 0.8 0 0" size="0.02" mass="1"/>
    </body>
    <body name="slider" pos="1.1 0 0">
      <joint name="track" type="slide" axis="1 0 0"/>
      <geom type="box" size="0.05 0.05 0.05" mass="2"/>
    </body>
  </worldbody>
  <equality>
    <connect name="A" body1="crank" body2="rod" anchor="0.3 0 0"/>
    <connect name="B" body1="rod" body2="slider" anchor="0.8 0 0"/>
  </equality>
  <actuator><motor joint="O"/></actuator>
</mujoco>"""

# URDF model of an arm with two links
URDF = """<robot name="arm">
  <link name="base"/>
  <link name="one"><inertial><mass value="1"/><origin xyz="0 0 -0.5"/>
    <inertia ixx="0.1" iyy="0.1" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="two"><inertial><mass value="0.5"/><origin xyz="0 0 -0.3"/>
    <inertia ixx="0.02" iyy="0.02" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="first" type="continuous"><parent link="base"/><child link="one"/><axis xyz="0 1 0"/></joint>
  <joint name="second" type="continuous"><parent link="one"/><child link="two"/>
    <origin xyz="0.2 0 -1"/><axis xyz="0 1 0"/></joint>
</robot>"""


def test_a_double_pendulum_swings_as_in_the_program_it_comes_from():
    """Cross-check by a second code: MuJoCo integrates its own model by a method of fourth order."""
    mechanism, notes = sd.read_mjcf(DOUBLE)
    assert all("<option>" in note for note in notes)  # its time step and method
    run = sd.simulate(mechanism, until=0.6, samples=13, rtol=1e-11, atol=1e-13)
    assert np.max(abs(run["position"].values - by_mujoco(DOUBLE, 0.6, 13, centres, keyframe=False))) < 2e-9


def test_a_loop_closed_by_connections_is_a_slider_crank():
    """Cross-check: the mechanism of `slider_crank` with the same lengths; what is left out is named."""
    mechanism, notes = sd.read_mjcf(CRANK)
    assert [joint.name for joint in mechanism.joints] == ["O", "A", "B"]
    run = sd.simulate(mechanism.driven(speed=5.0, body="crank"), until=1.0, samples=40)
    other = sd.simulate(sd.slider_crank(crank=0.3, rod=0.8).driven(speed=5.0), until=1.0, samples=40)
    assert run["angle"].sel(body="rod").values == pytest.approx(other["angle"].sel(body="rod").values, abs=1e-9)
    assert mechanism.components[0].damping == 0.1
    for left_out in ("its input is held at 0, so its torque is 0 N m", "geoms with contact"):
        assert any(left_out in note for note in notes)


def test_a_urdf_is_a_chain():
    """Identity: masses, inertias about the hinges' axis and places of the links."""
    mechanism, _ = sd.read_mjcf(URDF)
    assert [body.name for body in mechanism.bodies] == ["one", "two"]
    assert [body.inertia for body in mechanism.bodies] == pytest.approx([0.1, 0.02])
    assert mechanism.body("two").position == pytest.approx((0.2, -1.0))
    assert {joint.name for joint in mechanism.joints} == {"first", "second"}
    assert mechanism.gravity == pytest.approx(9.81)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("<mujoco>", "cannot read the model"),
        ('<mujoco><include file="/etc/passwd"/></mujoco>', "line 1: <include file='/etc/passwd'> refers to another file"),
        ('<mujoco><worldbody><body><joint type="ball"/><geom size="1"/></body></worldbody></mujoco>', "1 ball joints"),
        (
            DOUBLE.replace('name="knee" type="hinge" axis="0 1 0"', 'name="knee" type="hinge" axis="0 0 1"'),
            "hinges 'hip' and 'knee' form an angle of 90 deg",
        ),
        (
            CRANK.replace('name="track" type="slide" axis="1 0 0"', 'name="track" type="slide" axis="1 0 1"'),
            "slide 'track' is tilted by 45 deg to the plane",
        ),
    ],
)
def test_what_is_not_planar_is_one_line(content, said):
    """Contract: the error names what came."""
    with one_line_error(match=said):
        sd.read_mjcf(content)


# MJCF model with springs, dampers and limits of hinges
HINGED = """<mujoco><compiler angle="radian"/><option gravity="0 0 -9.81" timestep="1e-4" integrator="RK4"/>
<default><geom contype="0" conaffinity="0"/></default><worldbody><body name="arm" pos="0 0 1" euler="0 0.3 0">
<joint name="p" type="hinge" axis="0 {sign}1 0" stiffness="3" springref="0.4" damping="0.2" group="1"/>
<geom type="capsule" fromto="0 0 0 0.5 0 0" size="0.02" mass="1" rgba="1 0 0 1"/>
<body name="tool" pos="0.5 0 0"><site name="tip"/></body></body></worldbody>
<keyframe><key name="start" qpos="0.7" qvel="3"/></keyframe></mujoco>"""


@pytest.mark.parametrize("sign", ["", "-"])
def test_a_keyframe_a_spring_and_a_massless_tool(sign):
    """Cross-check: MuJoCo integrates the same model from the same keyframe."""
    text = HINGED.format(sign=sign)
    mechanism, notes = sd.read_mjcf(text)
    run = sd.simulate(mechanism, until=0.3, samples=4)
    turned = by_mujoco(text, 0.3, 4, lambda data: data.qpos[0])
    angle = run["angle"].sel(body="arm").values
    sense = 1.0 if sign else -1.0
    assert angle - angle[0] == pytest.approx(sense * (turned - turned[0]), abs=2e-4)
    assert float(run["angular_velocity"].sel(body="arm")[0]) == pytest.approx(3.0 * sense)
    assert mechanism.bodies[0].points["tip"] == pytest.approx((0.5, 0.0))
    assert {"attribute 'group' of 1 <joint> left out (line 3)", "attribute 'rgba' of 1 <geom> left out (line 4)"} <= set(notes)


def test_limits_are_end_stops():
    """Limit: a falling arm stays within the range of its hinge."""
    text = HINGED.format(sign="").replace('group="1"', 'limited="true" range="0.5 1.0"')
    mechanism, notes = sd.read_mjcf(text)
    turned = -0.3 - sd.simulate(mechanism, until=0.5, samples=200)["angle"].sel(body="arm").values
    assert any("limits of joint 'p': end stops" in note for note in notes)
    assert 1.0 < turned.max() < 1.01  # 1.079 without the stop


def test_speeds_of_the_own_export_return():
    """Contract: a mechanism that is exported and read again starts with its speed."""
    arm = sd.Body("arm", 1.0, 0.02, {"start": (0.0, 0.0)}, (0.25, 0.0), angle=0.35, angular_velocity=3.0)
    joint = sd.Revolute("p", ("arm", "start"), ("ground", "O"))
    again = sd.read_mjcf(mjcf(sd.Mechanism((arm,), (joint,), ground=(("O", (0.0, 0.0)),))).text).mechanism
    assert again.bodies[0].angular_velocity == pytest.approx(3.0)
    assert again.bodies[0].angle == pytest.approx(0.35)


def test_a_urdf_with_a_mesh_to_look_at_and_a_loop():
    """Contract: what is only looked at is no error; an element of another dialect is named."""
    text = """<robot name="m"><link name="base"/><link name="arm"><visual><geometry><mesh filename="package://p/l.stl"/></geometry>
    </visual><inertial><origin xyz="0 0 .45"/><mass value="1"/><inertia ixx=".1" ixy="0" ixz="0" iyy=".1" iyz="0" izz=".01"/>
    </inertial></link><joint name="j" type="continuous"><parent link="base"/><child link="arm"/><axis xyz="0 1 0"/></joint>
    <constraint_joint name="closure"/></robot>"""
    mechanism, notes = sd.read_mjcf(text)
    assert [body.name for body in mechanism.bodies] == ["arm"]
    assert "1 <constraint_joint> left out: 'closure' (line 4)" in notes
    assert "joint 'closure' (line 4) left out: if it closes a loop, the loop is open here" in notes


# MJCF model with springs, dampers and limits of slides
SLIDING = """<mujoco><compiler angle="radian"/><option gravity="0 0 -9.81" timestep="1e-4" integrator="RK4"/>
<default><geom contype="0" conaffinity="0"/></default><worldbody><body name="cart" pos="0 0 1">
<joint name="s" type="slide" axis="1 0 {tilt}" stiffness="40" springref="0.1" damping="0.5" {limits}/>
<geom type="capsule" fromto="0 0 0 0.1 0 0" size="0.02" mass="1"/><body name="arm" pos="0.1 0 0">
<joint name="p" type="hinge" axis="0 1 0" frictionloss="{friction}"/>
<geom type="capsule" fromto="0 0 0 0.5 0 0" size="0.02" mass="1"/></body></body></worldbody>
<keyframe><key name="start" qpos="0.05 0.2"/></keyframe></mujoco>"""


@pytest.mark.parametrize("tilt", [0.0, 0.5])
def test_spring_and_damping_of_a_slide(tilt):
    """Cross-check: MuJoCo integrates the same model, level and inclined."""
    here, there = followed(SLIDING.format(tilt=tilt, limits="", friction=0))
    assert np.max(abs(here - there)) < 1e-9


def test_dry_friction_of_a_hinge_is_a_clutch_that_slips():
    """Cross-check: MuJoCo's friction is a soft constraint, the clutch yields within a milliradian."""
    rubbing, there = followed(SLIDING.format(tilt=0, limits="", friction=0.3))
    free, _ = followed(SLIDING.format(tilt=0, limits="", friction=0))
    assert np.max(abs(rubbing - there)) < 1.5e-3
    assert np.max(abs(free - there)) > 1.5e-2


def test_limits_of_a_slide_on_the_ground_are_end_stops():
    """Limit: the cart stays within the range of its slide; 0.26 m without it."""
    text = SLIDING.format(tilt=0, limits='limited="true" range="-0.05 0.12"', friction=0)
    mechanism, notes = sd.read_mjcf(text)
    travel = sd.simulate(mechanism, until=0.5, samples=200)["position"].sel(body="cart", axis="x").values - 0.05
    assert any("limits of joint 's': end stops" in note for note in notes)
    assert 0.12 < travel.max() < 0.122


# MJCF model of two hinges with a polynomial equality
GEARED = """<mujoco><compiler angle="radian"/><option gravity="0 0 -9.81" timestep="1e-4" integrator="RK4"/>
<default><geom contype="0" conaffinity="0"/></default><worldbody><body name="upper" pos="0.1 0 2" euler="0 0.4 0">
<joint name="hip" axis="0 1 0" ref="0.2"/><geom type="capsule" fromto="0 0 0 0 0 -0.7" size="0.03" mass="2"/>
<body name="lower" pos="0 0 -0.7" euler="0 -0.3 0"><joint name="knee" axis="0 -1 0"/>
<geom type="box" size="0.04 0.03 0.25" pos="0.05 0 -0.3" mass="1.3"/>
<body name="pad" pos="0 0 -0.5"><joint name="reach" type="slide" axis="1 0 0.4" ref="0.02"/><geom size="0.05" mass="0.4"/>
</body></body></body></worldbody>
<equality><joint joint1="knee" joint2="hip" polycoef="{knee}" solref="2e-4 1" solimp="0.9999 0.9999 0.001"/>
<joint name="rack" joint1="reach" joint2="hip" polycoef="0 -0.2 0 0 0" solref="2e-4 1" solimp="0.9999 0.9999 0.001"/></equality>
<keyframe><key qpos="0.9 1.15 -0.12" qvel="1 1.5 -0.2"/></keyframe></mujoco>"""


def test_equalities_of_joints_are_couplings():
    """Cross-check: MuJoCo's stiff constraint between hinges of opposite axes, and between a slide and a hinge."""
    text = GEARED.format(knee="0.1 1.5 0 0 0")
    mechanism, _ = sd.read_mjcf(text)
    assert [coupling.name for coupling in mechanism.couplings] == ["coupling of knee", "rack"]
    here, there = followed(text)
    assert np.min(np.ptp(there, axis=0)) > 0.15
    assert np.max(abs(here - there)) < 1e-8


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (GEARED.format(knee="0 1 0.1 0 0"), "its polynomial is not linear"),
        (GEARED.format(knee="0.1 0 0 0 0"), "it relates fewer than two joints"),
        (GEARED.format(knee="0 1 0 0 0").replace(' joint2="hip" polycoef="0 1 0 0 0"', ""), "it relates fewer than two joints"),
        (
            CRANK.replace('<joint type="slide" axis="1 0 0"/>', '<joint name="knee" type="slide" axis="1 0 0"/>').replace(
                "<equality>", '<equality><joint joint1="knee" joint2="O"/>'
            ),
            "a slide of a body that slides in two directions",
        ),
    ],
)
def test_equalities_of_joints_that_no_coupling_says(text, reason):
    """Contract: each is named."""
    mechanism, notes = sd.read_mjcf(text)
    assert f"equality 'coupling of knee': left out; {reason}" in notes
    assert "coupling of knee" not in {coupling.name for coupling in mechanism.couplings}


def test_a_mimic_joint_of_a_urdf():
    """Closed form: on a vertical axis a torque turns the base link, and its mimic with the square of the multiplier."""
    link = """<link name="{}"><inertial><mass value="1"/>
    <inertia ixx=".2" iyy=".2" izz=".3" ixy="0" ixz="0" iyz="0"/></inertial></link>"""
    joint = '<joint name="{0}" type="continuous"><parent link="base"/><child link="{1}"/><axis xyz="0 0 {2}"/>{3}</joint>'
    mimic = '<mimic joint="first" multiplier="-2.5" offset="0.3"/>'
    joints = joint.format("first", "one", 1, "") + joint.format("second", "two", -1, mimic)
    mechanism, notes = sd.read_mjcf(
        f'<robot name="m"><link name="base"/>{link.format("one")}{link.format("two")}{joints}</robot>'
    )
    (coupling,) = mechanism.couplings
    assert (coupling.ratio, coupling.offset) == pytest.approx((2.5, -0.3))
    assert "equality 'coupling of second' is open by 0.3 rad at the start" in notes
    assert not any("mimic" in note for note in notes)
    run = sd.simulate(mechanism.with_parts({"components": (sd.Torque("motor", "one", torque=0.4),)}), until=1.0, samples=5)
    angle, other = run["angle"].values.T
    assert other == pytest.approx(2.5 * angle - 0.3)
    assert angle - angle[0] == pytest.approx(0.5 * 0.4 / (0.3 * (1 + 2.5**2)) * run["time"].values ** 2)
