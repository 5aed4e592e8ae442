"""Joints that close loops of a URDF: motion against MuJoCo and closed form, what is left out, and errors."""

import math

import numpy as np
import pytest
from tests.build import one_line_error

import scissordyn as sd

from .peer import by_mujoco, centres

GRAVITY = "<mujoco><option gravity='0 0 -9.81'/></mujoco>"  # Elements that give a URDF gravity along -z
# URDF element of an inertia that is equal about all axes
INERTIA = "<inertia ixx='{0}' iyy='{0}' izz='{0}' ixy='0' ixz='0' iyz='0'/>"

GROUND, CRANK, ROD, ROCKER = 0.9, 0.3, 0.8, 0.7
"""[m] lengths of the links of the four-bar linkage."""


def corner():
    """Return the angles of rod and rocker [rad] for a vertical crank, by the triangle of rod, rocker and a diagonal."""
    across = math.hypot(GROUND, CRANK)
    down = math.atan2(-CRANK, GROUND)
    inside = math.acos((ROD**2 + across**2 - ROCKER**2) / (2 * ROD * across))
    rod = down + inside
    x, z = ROD * math.cos(rod) - GROUND, CRANK + ROD * math.sin(rod)
    return rod, math.atan2(z, x)


def link(name, length):
    inertia = INERTIA.format(length**2 / 12)
    return f"<link name='{name}'><inertial><origin xyz='{length / 2} 0 0'/><mass value='1'/>{inertia}</inertial></link>"


def joint(name, parent, child, place, angle, kind="continuous"):
    """Return the text of a joint about y at an angle that turns from x to z."""
    ends = f"<parent link='{parent}'/><child link='{child}'/>"
    origin = f"<origin xyz='{place} 0 {{}}' rpy='0 {-angle!r} 0'/>"
    return f"<joint name='{name}' type='{kind}'>{ends}{origin.format(0)}<axis xyz='0 -1 0'/></joint>"


def four_bar(closing):
    rod, rocker = corner()
    links = "<link name='base'/>" + link("crank", CRANK) + link("rod", ROD) + link("rocker", ROCKER)
    joints = joint("A", "base", "crank", 0, math.pi / 2) + joint("B", "crank", "rod", CRANK, rod - math.pi / 2)
    joints += joint("D", "base", "rocker", GROUND, rocker)
    return f"<robot name='r'>{links}{joints}{GRAVITY}{closing}</robot>"


def four_bar_in_mjcf():
    """Return the four-bar linkage in MJCF, closed by a stiff connection."""
    rod, rocker = corner()

    def body(name, place, angle, length, inside=""):
        inertia = f"<inertial pos='{length / 2} 0 0' mass='1' diaginertia='{' '.join([repr(length**2 / 12)] * 3)}'/>"
        turn = f"pos='{place} 0 0' euler='0 {-angle!r} 0'"
        return f"<body name='{name}' {turn}><joint axis='0 -1 0'/>{inertia}{inside}</body>"

    bodies = body("crank", 0, math.pi / 2, CRANK, body("rod", CRANK, rod - math.pi / 2, ROD)) + body(
        "rocker", GROUND, rocker, ROCKER
    )
    stiff = "solref='2e-4 1' solimp='0.9999 0.9999 0.001'"
    return (
        f"<mujoco><compiler angle='radian'/><option gravity='0 0 -9.81' timestep='1e-4' integrator='RK4'/>"
        f"<worldbody>{bodies}</worldbody>"
        f"<equality><connect body1='rod' body2='rocker' anchor='{ROD} 0 0' {stiff}/></equality></mujoco>"
    )


# Children of a <loop_joint>: its points on both links
ENDS = f"<link1 link='rod' xyz='{ROD} 0 0'/><link2 link='rocker' xyz='{ROCKER} 0 0'/>"
AXIS = "<axis><xyz>0 1 0</xyz></axis>"  # SDF element of a joint axis along y


def gazebo(inside="", kind="revolute", parent="rod", child="rocker", after=""):
    """Return a <gazebo> element with a joint and elements after it."""
    ends = f"<parent>{parent}</parent><child>{child}</child>"
    return f"<gazebo><joint name='C' type='{kind}'>{ends}{inside}</joint>{after}</gazebo>"


def loop_joint(inside, kind=""):
    """Return a <loop_joint> element."""
    suffix = f" type='{kind}'" if kind else ""
    return f"<loop_joint name='C'{suffix}>{inside}</loop_joint>"


# Elements that close the same loop of a URDF, by their form
CLOSINGS = {
    "as in Isaac Sim": loop_joint(ENDS, "spherical"),
    "as in Drake": loop_joint(f"{ENDS}<axis xyz='0 1 0'/>", "continuous"),
    "with a prefix": f"<d:loop_joint xmlns:d='d' name='C'>{ENDS}</d:loop_joint>",
    "in gazebo": gazebo(f"<pose>{ROCKER} 0 0 0 0.3 0</pose>{AXIS}"),
    "with the child first": gazebo(f"<pose>{ROD} 0 0 0 0 0</pose>{AXIS}", parent="rocker", child="rod"),
    "from a frame": gazebo(f"<pose relative_to='rod'>{ROD} 0 0 0 0 0</pose>{AXIS}"),
    "in degrees": gazebo(f"<pose degrees='true'>{ROCKER} 0 0 0 45 0</pose>{AXIS}"),
    "about a turned axis": gazebo(f"<pose>{ROCKER} 0 0 {math.pi / 2} 0 0</pose><axis><xyz>0 0 -1</xyz></axis>"),
}


@pytest.mark.parametrize("form", CLOSINGS)
def test_a_loop_moves_as_in_mujoco(form):
    """Cross-check: mass centres of a four-bar linkage that falls, against MuJoCo with a stiff connection."""
    mechanism, notes = sd.read_mjcf(four_bar(CLOSINGS[form]))
    assert {joint.name for joint in mechanism.joints} == {"A", "B", "C", "D"}
    assert not any("open" in note or "left out" in note for note in notes)
    run = sd.simulate(mechanism, until=0.3, samples=4, rtol=1e-9, atol=1e-11)
    places = by_mujoco(four_bar_in_mjcf(), 0.3, 4, centres, keyframe=False)
    order = [[body.name for body in mechanism.bodies].index(name) for name in ("crank", "rod", "rocker")]
    assert run["position"].values[:, order] == pytest.approx(places, abs=2e-5)
    assert np.ptp(places, axis=0).max() > 0.05


def slider_crank(closing):
    """Return a slider-crank with a crank of 0.3 m and a rod of 0.8 m, closed by a slide between block and base."""
    crank, rod = 0.5, -math.asin(0.3 * math.sin(0.5) / 0.8)
    links = "<link name='base'/>" + link("crank", 0.3) + link("rod", 0.8) + link("block", 0.1)
    joints = joint("A", "base", "crank", 0, crank) + joint("B", "crank", "rod", 0.3, rod - crank)
    joints += joint("C", "rod", "block", 0.8, -rod)
    return f"<robot name='r'>{links}{joints}{closing}</robot>"


@pytest.mark.parametrize(("parent", "child"), [("base", "block"), ("block", "base"), ("world", "block")])
def test_a_slide_closes_a_loop(parent, child):
    """Closed form: position of the block of a slider-crank while the crank turns at a constant speed."""
    place = "<pose relative_to='block'>0 0 0 0 0 0</pose><axis><xyz>1 0 0</xyz></axis>"
    mechanism = sd.read_mjcf(slider_crank(gazebo(place, "prismatic", parent, child))).mechanism
    assert [(guide.name, guide.aligned) for guide in mechanism.guides] == [("C 2", True)]
    run = sd.simulate(mechanism.driven(speed=2.0, body="crank"), until=1.0, samples=5)
    angle = 0.5 + 2.0 * run["time"].values
    block = 0.3 * np.cos(angle) + np.sqrt(0.8**2 - (0.3 * np.sin(angle)) ** 2)
    assert run["position"].sel(body="block", axis="x").values == pytest.approx(block + 0.05, abs=1e-6)
    assert run["position"].sel(body="block", axis="y").values == pytest.approx(0.0, abs=1e-6)


def test_a_weld_closes_a_loop():
    """Closed form: a four-bar linkage with a fixed corner does not move."""
    mechanism = sd.read_mjcf(four_bar(gazebo(kind="fixed"))).mechanism
    assert [weld.name for weld in mechanism.welds] == ["C"]
    run = sd.simulate(mechanism, until=0.1, samples=2)
    assert np.ptp(run["position"].values, axis=0).max() < 1e-6


LOST = "left out, because the joint closes a loop"  # End of a note about a part of a joint
OPEN = "left out: if it closes a loop, the loop is open here"  # End of a note about a joint


@pytest.mark.parametrize(
    ("closing", "said"),
    [
        (gazebo(f"{AXIS}<physics/><sensor/>", after="<plugin name='p'/>"), {f"joint 'C' (line 1): <physics>, <sensor> {LOST}"}),
        (gazebo(f"{AXIS}<physics/><sensor/>", after="<plugin name='p'/>"), {"1 <plugin> left out: 'p' (line 1)"}),
        (
            gazebo("<axis><xyz>0 1 0</xyz><limit><effort>1</effort></limit><mimic/></axis>"),
            {f"joint 'C' (line 1): <effort> {LOST}", f"joint 'C' (line 1): <mimic> {LOST}"},
        ),
        (gazebo(AXIS, "screw"), {f"joint 'C' (line 1) in <gazebo> between 'rod' and 'rocker' {OPEN}"}),
        (loop_joint(ENDS, "prismatic"), {f"joint 'C' (line 1) {OPEN}"}),
        (loop_joint("<link1 link='rod'/><link2 link='rocker'/>"), {"connection 'C' is open by 0.949 m at the start"}),
    ],
)
def test_parts_of_loop_joints_that_are_left_out(closing, said):
    """Contract: each part that is not read is named with its joint and line."""
    assert said <= set(sd.read_mjcf(four_bar(closing)).notes)


@pytest.mark.parametrize(
    ("closing", "said"),
    [
        (gazebo(child="nothing"), "joint 'C' (line 1) refers to 'nothing'; expected the name of a link"),
        (gazebo(child="rod"), "joint 'C' (line 1) joins 'rod' and 'rod', which are one rigid body"),
        (gazebo("<pose>0 0 0</pose>"), "line 1: <pose> = '0 0 0'; expected 6 numbers of at most 1e+16"),
        (gazebo("<pose>0 0 0 nan 0 0</pose>"), "expected 6 numbers of at most 1e+16"),
        (gazebo("<axis><xyz>0 0 0</xyz></axis>"), "line 1: the axis of the joint is 0 0 0"),
        (gazebo("<axis><xyz>1 0 0</xyz></axis>"), "hinges 'A' and 'C' form an angle of 90 deg"),
        (loop_joint(f"{ENDS}<axis xyz='0 0 0'/>"), "line 1: the axis of the joint is 0 0 0"),
        (loop_joint(f"{ENDS}<axis/>"), "form an angle of"),
        (loop_joint("<link1 link='rod' xyz='1e999 0 0'/><link2 link='rod'/>"), "line 1: xyz of <link1>"),
    ],
)
def test_loop_joints_that_are_errors(closing, said):
    """Contract: one line that says what is wrong and what is expected."""
    with one_line_error(said):
        sd.read_mjcf(four_bar(closing))
