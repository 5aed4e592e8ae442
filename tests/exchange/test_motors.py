"""Motors and servos of MJCF, and motors that a URDF names."""

import pytest

import scissordyn as sd

from .peer import by_mujoco, centres

# Beginning of an MJCF model: a leg with hinges and a slide
HEAD = """<mujoco>
  <option gravity="0 0 -9.81" timestep="0.0005" integrator="RK4"/>
  <default><geom contype="0" conaffinity="0"/><position kp="20" kv="2"/></default>
  <worldbody>
    <body name="upper" pos="0.1 0 2" euler="0 60 0">
      <joint name="hip" type="hinge" axis="0 1 0" ref="10"/>
      <geom type="capsule" fromto="0 0 0 0 0 -0.7" size="0.03" mass="2"/>
      <body name="lower" pos="0 0 -0.7" euler="0 -20 0">
        <joint name="knee" type="hinge" axis="0 -1 0" actuatorfrcrange="-2 2"/>
        <geom type="box" size="0.04 0.03 0.25" pos="0.05 0 -0.3" mass="1.3"/>
      </body>
    </body>
    <body name="cart" pos="1 0 0">
      <joint name="rail" type="slide" axis="1 0 1"/><geom size="0.1" mass="2"/>
      <body name="pole" pos="0 0 0.1">
        <joint name="pin" type="hinge" axis="0 1 0"/>
        <geom type="capsule" fromto="0 0 0 0 0 0.5" size="0.02" mass="0.5"/>
        <body name="bead" pos="0 0 0.3"><joint name="rod" type="slide" axis="0 0 1"/><geom size="0.02" mass="0.1"/></body>
      </body>
    </body>
  </worldbody>
"""

SLIDE = '<joint name="rod" type="slide" axis="0 0 1"/>'  # MJCF element of the slide in the model

# Actuators of the model in MJCF, the end of the file
MOTORS = """<actuator>
    <position name="hip servo" joint="hip" gear="-2" forcerange="-8 8" ctrlrange="-1 1" ctrllimited="true"/>
    <velocity name="knee speed" joint="knee" kv="3"/>{}
    <general name="lift" joint="rail" gainprm="3 1 0" gaintype="affine" biastype="affine" biasprm="1 -40 -5" gear="1.5"/>
    <motor name="tip" jointinparent="pin" gear="3"/>
    <motor name="push" joint="rail" gear="2" forcerange="-1 1"/>
    <motor name="feed" joint="rod"/>
  </actuator>
  <keyframe><key qpos="0.1 0.2 0.3 0.1 0" ctrl="2 1.5 {} 4 0.2 1.5 1.2"/><key qpos="1 1 1 1 0"/></keyframe>
</mujoco>"""


def test_motors_and_servos_move_as_in_the_program_they_come_from():
    """Cross-check by a second code: servos with limits that act, gear, input ranges, affine gains; a muscle is left out.

    MuJoCo's steps of fourth order do not locate the instants at which a limit acts: hence 3e-7 m.
    """
    mechanism, notes = sd.read_mjcf(HEAD + MOTORS.format('<muscle name="flesh" joint="knee" lengthrange="0 1"/>', "0.1"))
    assert "1 <muscle> left out: 'flesh' (line 24)" in notes
    assert "actuator 'hip servo': its input is held at 1; it is a servo of 80 N m/rad and 8 N m s/rad" in notes
    run = sd.simulate(mechanism, until=0.6, samples=13, rtol=1e-10, atol=1e-12)
    assert abs(run["control_torque"]).max("time").values.tolist() == pytest.approx([16.0, 2.0])  # both limits act
    moved = by_mujoco(HEAD + MOTORS.format("", ""), 0.6, 13, centres)
    assert abs(moved[-1] - moved[0]).min() > 0.01
    assert run["position"].values == pytest.approx(moved, abs=3e-7)


@pytest.mark.parametrize(
    ("motor", "said"),
    [
        ('<general {} biastype="affine" biasprm="0 3 0"/>', "left out; its force grows with the position or the speed"),
        ('<position {} kp="1" forcerange="-1 5"/>', "its limits -1 and 5 N m are 5 N m in both senses"),
        ('<position {} timeconst="0.1"/>', "the filter of its input is left out"),
        ('<general {} dyntype="integrator"/>', "left out; its input is integrated over time"),
        ('<position name="a" joint="rod"/>', "left out; it pushes a turning body along a moving one"),
        ('<position name="a" joint="rail" forcerange="-1 1"/>', "its force limits are left out"),
        ('<motor {} group="3"/>', "left out; the model disables it"),
    ],
)
def test_what_a_motor_cannot_hold_is_named(motor, said):
    """Contract: nothing is dropped in silence."""
    head = HEAD.replace("<option", '<option actuatorgroupdisable="3"')
    if 'joint="rod"' in motor:
        head = head.replace(SLIDE, SLIDE + '<joint type="hinge" axis="0 1 0"/>')
    actuator = motor.format('name="a" joint="hip"')
    assert f"actuator 'a': {said}" in sd.read_mjcf(f"{head}<actuator>{actuator}</actuator></mujoco>").notes


# URDF model whose elements name motors
MOTOR_URDF = """<robot name="arm">
  <link name="base"/>
  <link name="one"><inertial><mass value="1"/><origin xyz="0 0 -0.5"/>
    <inertia ixx="0.1" iyy="0.1" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="first" type="revolute"><parent link="base"/><child link="one"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="1" effort="12" velocity="3"/></joint>
  <transmission name="t"><type>transmission_interface/SimpleTransmission</type>
    <joint name="first"><hardwareInterface>hardware_interface/EffortJointInterface</hardwareInterface></joint>
    <actuator name="m"><mechanicalReduction>50</mechanicalReduction></actuator></transmission>
  <ros2_control name="c" type="system">
    <joint name="first"><command_interface name="position"/></joint>
    <joint name="second"><command_interface name="velocity"/></joint>
    <joint name="third"><state_interface name="position"/></joint></ros2_control>
</robot>"""


def test_motors_of_a_urdf_are_torques_to_be_set():
    """Contract: a URDF names motors and their limits, but has no gains."""
    mechanism, notes = sd.read_mjcf(MOTOR_URDF)
    said = "torque 'motor of first' is 0 N m; a URDF has no gains, at most 12 N m; interface {}"
    assert "<transmission> 't' (line 7): " + said.format("EffortJointInterface; reduction 50") in notes
    assert "<ros2_control> 'c' (line 10): " + said.format("position") in notes
    assert "<ros2_control> 'c' (line 10): left out, because its joint 'second' is not a hinge of the model" in notes
    (torque,) = (part for part in mechanism.components if isinstance(part, sd.Torque))
    pushed = sd.simulate(mechanism.replace("motor of first.torque", 3.0), until=0.1)
    assert torque.base == "ground"
    assert float(pushed["load_work"][-1]) > 0.0


# MJCF model of two bars whose joints have so much damping that a rate is 2.95e4 1/s, in a fluid if it is inserted
DAMPED = """<mujoco>
  <option gravity="0 0 0" timestep="0.00001" integrator="RK4"{}/>
  <default><joint type="hinge" axis="0 0 1" damping="1"/><geom contype="0" conaffinity="0"/></default>
  <worldbody><body name="upper"><joint name="shoulder"/><geom type="capsule" fromto="0 0 0 0.1 0 0" size="0.01"/>
    <body name="lower" pos="0.1 0 0"><joint name="wrist"/><geom type="capsule" fromto="0 0 0 0.1 0 0" size="0.01"/></body>
  </body></worldbody>
  <actuator><motor joint="shoulder" gear="100"/><motor joint="wrist" gear="100"/></actuator>
  <keyframe><key ctrl="0.5 0.5"/></keyframe>
</mujoco>"""


def test_damping_that_is_stiff_moves_as_in_the_program_it_comes_from():
    """Cross-check by a second code at a step size below the time constants; a fluid is left out with a note."""
    mechanism, notes = sd.read_mjcf(DAMPED.format(' density="1000"'))
    assert "attribute 'density' of 1 <option> left out (line 2)" in notes
    run = sd.simulate(mechanism, until=0.02, samples=5, rtol=1e-10, atol=1e-12)
    moved = by_mujoco(DAMPED.format(""), 0.02, 5, lambda data: data.xipos[1:, :2])
    assert abs(moved[-1] - moved[0]).min() > 0.01
    assert run["position"].values == pytest.approx(moved, abs=1e-10)
