"""Models in MJCF and URDF that are planar mechanisms."""

from __future__ import annotations

import numpy as np
import pytest

import scissordyn as sd
from scissordyn.errors import InputError

mujoco = pytest.importorskip("mujoco")

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
    assert notes == ()
    run = sd.simulate(mechanism, until=0.6, samples=13, rtol=1e-11, atol=1e-13)
    model = mujoco.MjModel.from_xml_string(DOUBLE)
    data = mujoco.MjData(model)
    rows = []
    for step in range(1201):
        if step % 100 == 0:
            mujoco.mj_kinematics(model, data)
            rows.append(data.xipos[1:, [0, 2]].copy())
        mujoco.mj_step(model, data)
    assert np.max(abs(run["position"].values - np.array(rows))) < 2e-9


def test_a_loop_closed_by_connections_is_a_slider_crank():
    """Cross-check: the mechanism of `slider_crank` with the same lengths; what is left out is named."""
    mechanism, notes = sd.read_mjcf(CRANK)
    assert [joint.name for joint in mechanism.joints] == ["O", "A", "B"]
    run = sd.simulate(mechanism.driven(speed=5.0, body="crank"), until=1.0, samples=40)
    other = sd.simulate(sd.slider_crank(crank=0.3, rod=0.8).driven(speed=5.0), until=1.0, samples=40)
    assert run["angle"].sel(body="rod").values == pytest.approx(other["angle"].sel(body="rod").values, abs=1e-9)
    for left_out in ("damping of joint 'O'", "1 actuators", "geoms that may touch"):
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
        ("<mujoco>", "no model of MuJoCo"),
        ('<mujoco><include file="/etc/passwd"/></mujoco>', "names further files"),
        ('<mujoco><worldbody><body><freejoint/><geom size="1"/></body></worldbody></mujoco>', "1 free or ball joints"),
        (DOUBLE.replace('name="knee" type="hinge" axis="0 1 0"', 'name="knee" type="hinge" axis="0 0 1"'), "not all parallel"),
        (CRANK.replace('name="track" type="slide" axis="1 0 0"', 'name="track" type="slide" axis="1 0 1"'), "out of the plane"),
    ],
)
def test_what_is_not_planar_is_one_line(content, said):
    """Identity: the error names what came."""
    with pytest.raises(InputError, match=said) as error:
        sd.read_mjcf(content)
    assert "\n" not in str(error.value)
