"""Models in SDF: motion against MuJoCo and closed form, equal forms of one model, what is left out, and errors."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tests.build import one_line_error

import scissordyn as sd
from scissordyn.exchange.xml_element import BODIES_MAX, DEPTH_MAX

from .peer import by_mujoco, centres
from .test_loops import CLOSINGS, CRANK, GROUND, ROCKER, ROD, corner, four_bar_in_mjcf
from .test_loops import four_bar as four_bar_in_urdf


def inertial(length, moment=None):
    moment = length**2 / 12 if moment is None else moment
    diagonal = "".join(f"<i{axis}{axis}>{moment!r}</i{axis}{axis}>" for axis in "xyz")
    return f"<inertial><pose>{length / 2} 0 0 0 0 0</pose><mass>1</mass><inertia>{diagonal}</inertia></inertial>"


def link(name, length, pose, frame=""):
    place = f"<pose relative_to='{frame}'>{pose}</pose>" if frame else f"<pose>{pose}</pose>"
    return f"<link name='{name}'>{place}{inertial(length)}</link>"


def joint(name, parent, child, *, pose="", axis="<axis><xyz>0 -1 0</xyz></axis>", kind="revolute"):
    return f"<joint name='{name}' type='{kind}'><parent>{parent}</parent><child>{child}</child>{pose}{axis}</joint>"


def file(inside, version="1.7", model="", gravity="0 0 -9.81"):
    return (
        f"<sdf version='{version}'><world name='w'><gravity>{gravity}</gravity>"
        f"<model name='m'{model}>{inside}</model></world></sdf>"
    )


END = f"<pose>{ROCKER} 0 0 0 0 0</pose>"  # SDF pose at the end of the rocker


def four_bars():
    """Return equal four-bar linkages, each written in another way that SDF allows."""
    rod, rocker = corner()
    crank = math.pi / 2
    absolute = (
        link("crank", CRANK, f"0 0 0 0 {-crank!r} 0")
        + link("rod", ROD, f"0 0 {CRANK} 0 {-rod!r} 0")
        + link("rocker", ROCKER, f"{GROUND} 0 0 0 {-rocker!r} 0")
    )
    joints = joint("A", "world", "crank") + joint("B", "crank", "rod") + joint("D", "world", "rocker")
    closed = joint("C", "rod", "rocker", pose=END)
    yield "absolute", file(absolute + joints + closed)
    yield (
        "the model alone, with its physics before version 1.6",
        (
            f"<sdf version='1.5'><world name='w'><physics><gravity>0 0 -9.81</gravity></physics>"
            f"<model name='m'>{absolute + joints + closed}</model></world></sdf>"
        ),
    )
    placed = "<joint name='{}' type='{}'><pose relative_to='{}'>{}</pose><parent>{}</parent><child>{}</child>{}</joint>"
    axis = "<axis><xyz>0 -1 0</xyz></axis>"
    relative = (
        placed.format("A", "revolute", "__model__", f"0 0 0 0 {-crank!r} 0", "world", "crank", axis)
        + link("crank", CRANK, "0 0 0 0 0 0", "A")
        + placed.format("B", "revolute", "crank", f"{CRANK} 0 0 0 {crank - rod!r} 0", "crank", "rod", axis)
        + link("rod", ROD, "0 0 0 0 0 0", "B")
        + f"<frame name='end' attached_to='rod'><pose>{ROD} 0 0 0 0 0</pose></frame>"
        + f"<frame name='support'><pose>{GROUND} 0 0 0 0 0</pose></frame>"
        + placed.format("D", "continuous", "support", f"0 0 0 0 {-math.degrees(rocker)!r} 0", "world", "rocker", axis).replace(
            "relative_to='support'", "relative_to='support' degrees='true'"
        )
        + link("rocker", ROCKER, "0 0 0 0 0 0", "D")
        + "<joint name='C' type='ball'><pose relative_to='end'/><parent>end</parent><child>rocker</child></joint>"
    )
    yield "relative poses and frames", file(relative)
    turn = Rotation.from_euler("y", -rod).as_quat()
    quaternion = absolute.replace(
        f"<pose>0 0 {CRANK} 0 {-rod!r} 0</pose>",
        f"<pose rotation_format='quat_xyzw'>0 0 {CRANK} {' '.join(map(repr, turn.tolist()))}</pose>",
    )
    assert quaternion != absolute
    yield "a quaternion", file(quaternion + joints + closed, "1.9")
    shifted = absolute + f"<frame name='held'><pose>{GROUND} 0 0 0 0 0.5</pose></frame><pose>{GROUND} 0 0 0 0 0.5</pose>"
    yield "placed by a frame", file(shifted + joints + closed, model=" placement_frame='held'")
    # axes in the frame of the model, of a named frame, and of the joint, which is turned about x
    turned = joint("B", "crank", "rod", pose="<pose>0 0 0 1 2 3</pose>")
    yield "axes before version 1.5", file(absolute + joints.replace(joint("B", "crank", "rod"), turned) + closed, "1.4")
    named = turned.replace("<xyz>", "<xyz expressed_in='__model__'>")
    yield "a named frame", file(absolute + joints.replace(joint("B", "crank", "rod"), named) + closed)
    flagged = turned.replace("<axis>", "<axis><use_parent_model_frame>true</use_parent_model_frame>")
    yield "a flag", file(absolute + joints.replace(joint("B", "crank", "rod"), flagged) + closed, "1.6")
    up = f"<pose>0 0 0 {math.pi / 2!r} 0 0</pose>"
    own = joint("B", "crank", "rod", pose=up, axis="<axis><xyz>0 0 1</xyz></axis>")
    yield "a turned joint", file(absolute + joints.replace(joint("B", "crank", "rod"), own) + closed)
    back = joint("B", "rod", "crank", pose=f"<pose>{CRANK} 0 0 0 0 0</pose>") + joint("A", "world", "crank")
    yield "a chain from its end", file(absolute + back + joint("D", "world", "rocker") + closed)
    base = "<link name='base'><inertial><mass>5</mass></inertial></link>" + joint("fix", "world", "base", kind="fixed", axis="")
    yield "a base that is fixed", file(absolute + base + joints.replace("world", "base") + closed)


@pytest.mark.parametrize("form", range(len(list(four_bars()))))
def test_a_linkage_moves_as_in_mujoco(form):
    """Cross-check: mass centres of a falling four-bar linkage, against MuJoCo with a stiff connection."""
    name, text = list(four_bars())[form]
    mechanism, notes = sd.read_mjcf(text)
    assert {joint.name for joint in mechanism.joints} == {"A", "B", "C", "D"}, name
    assert not any("open" in note or "left out" in note for note in notes), name
    run = sd.simulate(mechanism, until=0.3, samples=4, rtol=1e-9, atol=1e-11)
    places = by_mujoco(four_bar_in_mjcf(), 0.3, 4, centres, keyframe=False)
    order = [[body.name for body in mechanism.bodies].index(body) for body in ("crank", "rod", "rocker")]
    assert run["position"].values[:, order] == pytest.approx(places, abs=2e-5), name


def test_a_slide_is_part_of_a_loop():
    """Closed form: position of the block of a slider-crank while the crank turns at a constant speed."""
    rod = -math.asin(0.3 * math.sin(0.5) / 0.8)
    x, z = 0.3 * math.cos(0.5), 0.3 * math.sin(0.5)
    links = link("crank", 0.3, "0 0 0 0 -0.5 0") + link("rod", 0.8, f"{x!r} 0 {z!r} 0 {-rod!r} 0")
    links += link("block", 0.1, f"{x + 0.8 * math.cos(rod)!r} 0 0 0 0 0")
    joints = joint("A", "world", "crank") + joint("B", "crank", "rod") + joint("C", "rod", "block")
    slide = joint("S", "world", "block", axis="<axis><xyz>1 0 0</xyz></axis>", kind="prismatic")
    mechanism = sd.read_mjcf(file(links + joints + slide)).mechanism
    assert [guide.name for guide in mechanism.guides] == ["S"]
    run = sd.simulate(mechanism.driven(speed=2.0, body="crank"), until=1.0, samples=5)
    angle = 0.5 + 2.0 * run["time"].values
    block = 0.3 * np.cos(angle) + np.sqrt(0.8**2 - (0.3 * np.sin(angle)) ** 2)
    assert run["position"].sel(body="block", axis="x").values == pytest.approx(block + 0.05, abs=1e-6)


# SDF element with damping and a spring
DYNAMICS = (
    "<dynamics><damping>0.3</damping><spring_reference>0.2</spring_reference><spring_stiffness>4</spring_stiffness></dynamics>"
)


@pytest.mark.parametrize("turned", [False, True])
def test_springs_and_limits_act_in_the_sense_of_the_joint(turned):
    """Cross-check: an arm with spring, damper and stop, in MuJoCo; also with the arm as parent of the joint."""
    limit = "<limit><lower>-0.4</lower><upper>1e16</upper></limit>"
    axis = f"<axis><xyz>0 1 0</xyz>{limit}{DYNAMICS}</axis>"
    base = "<link name='base'><inertial><mass>5</mass></inertial></link>" + joint("fix", "world", "base", kind="fixed", axis="")
    arm = joint("J", *(("arm", "base") if turned else ("base", "arm")), axis=axis)
    mechanism, notes = sd.read_mjcf(file(base + link("arm", 0.5, "0 0 0 0 0 0") + arm))
    assert [part.name for part in mechanism.components] == ["spring of J", "lower limit of J"]
    assert not any("left out" in note for note in notes)
    sense = -1 if turned else 1
    text = (
        "<mujoco><compiler angle='radian'/><option gravity='0 0 -9.81' timestep='1e-4' integrator='RK4'/><worldbody><body>"
        f"<joint axis='0 {sense} 0' damping='0.3' springref='0.2' stiffness='4'/>"
        f"<inertial pos='0.25 0 0' mass='1' diaginertia='{' '.join([repr(0.5**2 / 12)] * 3)}'/></body></worldbody></mujoco>"
    )
    run = sd.simulate(mechanism, until=0.2, samples=5, rtol=1e-9, atol=1e-11)
    places = by_mujoco(text, 0.2, 5, centres, keyframe=False)
    before = places[:, 0, 1] > -0.25 * math.sin(0.35)  # samples before the stop of a joint that turns backwards
    assert run["position"].sel(body="arm").values[before] == pytest.approx(places[before, 0], abs=1e-8)
    assert before.sum() >= 3
    last = float(sd.simulate(mechanism, until=0.6, samples=2)["position"].sel(body="arm", axis="y")[-1])
    assert (last > -0.25 * math.sin(0.45)) == turned  # a turn about +y lowers the arm


# SDF element of an axis with limits, damping and a spring
FORCES = (
    "<axis><xyz>0 {} 0</xyz><limit><lower>-0.05</lower><upper>2</upper></limit><dynamics><damping>0.3</damping>"
    "<spring_reference>-1</spring_reference><spring_stiffness>9</spring_stiffness></dynamics></axis>"
)


@pytest.mark.parametrize(
    ("parent", "child", "place", "axis"), [("rod", "rocker", ROCKER, 1), ("rocker", "rod", ROD, 1), ("rocker", "rod", ROD, -1)]
)
def test_forces_of_a_joint_do_not_depend_on_the_tree(parent, child, place, axis):
    """Identity: a joint with spring, damper and stop in the tree, as in MuJoCo, and as the joint that closes the loop."""
    pose = f"<pose>{place} 0 0 0 0 0</pose>"
    closing = joint("C", parent, child, pose=pose, axis=FORCES.format(axis))
    in_tree = dict(four_bars())["absolute"].replace(joint("C", "rod", "rocker", pose=END), closing)
    in_loop = four_bar_in_urdf(f"<gazebo>{closing}</gazebo>")
    runs = []
    for text, until in ((in_tree, 0.3), (in_loop, 0.3), (four_bar_in_urdf(CLOSINGS["in gazebo"]), 0.3)):
        found = sd.read_mjcf(text)
        assert not any("open" in note or "left out" in note for note in found.notes)
        run = sd.simulate(found.mechanism, until=until, samples=4, rtol=1e-9, atol=1e-11)
        runs.append(run["position"].sel(body=["crank", "rod", "rocker"]).values)
    assert runs[0] == pytest.approx(runs[1], abs=1e-6)
    assert abs(runs[0] - runs[2]).max() > 1e-3


def test_inertia_is_in_the_axes_of_the_inertial_pose():
    """Closed form: moment about y of a body whose principal axes are turned about x, and its mass centre."""
    moments = "<ixx>0.1</ixx><iyy>0.2</iyy><izz>0.25</izz>"
    body = f"<inertial><pose>0.1 0 0.3 {math.pi / 3!r} 0 0</pose><mass>2</mass><inertia>{moments}</inertia></inertial>"
    found = sd.read_mjcf(file(f"<link name='a'>{body}</link>" + joint("J", "world", "a"))).mechanism.bodies[0]
    assert found.mass == 2.0
    assert found.inertia == pytest.approx(0.2 * math.cos(math.pi / 3) ** 2 + 0.25 * math.sin(math.pi / 3) ** 2, rel=1e-12)
    assert found.centre == pytest.approx((0.1, 0.3), abs=1e-15)


def test_a_file_is_recognised_by_its_ending(tmp_path):
    """Identity: file and text."""
    text = file(link("a", 1.0, "0 0 0 0 0 0") + joint("J", "world", "a"))
    (tmp_path / "robot.sdf").write_text(text)
    assert sd.read_drawing(tmp_path / "robot.sdf") == sd.read_mjcf(text)


ARM = link("a", 1.0, "0 0 0 0 0 0")  # SDF element of a link
HINGE = joint("J", "world", "a")  # SDF element of a joint between the world and the link


def arm(more="", **changes):
    """Return a file with the arm and further elements; `inertial` and `axis` begin these elements of link and hinge."""
    link, hinge = ARM, HINGE.replace("</xyz>", "</xyz>" + changes.get("axis", ""))
    return file(link.replace("<inertial>", changes.get("inertial", "<inertial>")) + more + hinge)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            f"<sdf version='1.7'><model name='m'>{ARM}{HINGE}</model></sdf>",
            "gravity: the SDF has none; the default of its worlds",
        ),
        (file(f"<link name='a'/>{HINGE}"), "link 'a' (line 1) has no <inertial>: 1 kg and 1 kg m^2, the defaults of SDF, are"),
        (arm("\n<plugin name='p'/>"), "1 <plugin> left out: 'p' (line 2)"),
        (arm(inertial="<visual name='v'/><inertial>"), "1 <visual> left out: 'v' (line 1)"),
        (arm(inertial="<gravity>0</gravity><inertial>"), "link 'a' (line 1): gravity acts on it, although"),
        (arm(axis="<limit><effort>5</effort></limit>"), "1 <effort> in <limit> left out: line 1"),
        (arm(axis="<mimic joint='k'/>"), "1 <mimic> in <axis> left out: line 1"),
        (arm().replace("<gravity>", "<include><uri>model://sun</uri></include><gravity>"), "1 <include> left out: line 1"),
        (arm().replace("<model", "<model name='ground'/><model"), "1 <model> left out: 'ground' (line 1)"),
        (arm(axis="<dynamics><friction>1</friction></dynamics>"), "dry friction of joint 'J': a clutch"),
    ],
)
def test_parts_that_are_left_out_or_assumed(text, said):
    """Contract: each is named with its line."""
    assert any(note.startswith(said) for note in sd.read_mjcf(text).notes)


# SDF elements of a chain with one link more than allowed
CHAIN = "".join(link(f"l{k}", 1.0, "0 0 0 0 0 0") for k in range(DEPTH_MAX + 1)) + "".join(
    joint(f"j{k}", f"l{k - 1}" if k else "world", f"l{k}") for k in range(DEPTH_MAX + 1)
)


TWO_MODELS = f"<sdf><model name='m'>{ARM}{HINGE}</model><model name='n'>{ARM}{HINGE}</model></sdf>"
RING = "<frame name='f' attached_to='g'/><frame name='g' attached_to='f'/>" + joint(
    "J", "world", "a", pose="<pose relative_to='f'/>"
)
TILTED = link("b", 1.0, "0 0 0 0 0 0") + HINGE + joint("K", "a", "b", axis="<axis><xyz>1 0 0</xyz></axis>")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("<sdf version='1.7'/>", "the SDF has 0 models with joints; expected one model with joints"),
        (file(ARM), "the SDF has 0 models with joints"),
        (TWO_MODELS, "2 models with joints: 'm' (line 1), 'n'"),
        (file(HINGE), "model 'm' (line 1) has no links"),
        (file(f"<static>true</static>{ARM}{HINGE}"), "model 'm' (line 1) is static"),
        (arm(ARM), "line 1: a second <link> is named 'a'"),
        (file("<link/>" + HINGE), "line 1: <link> is named ''"),
        (file("<link name='world'/>" + HINGE), "line 1: <link> is named 'world'"),
        (file(ARM + HINGE.replace("revolute", "universal")), "joint 'J' (line 1) is of type 'universal'"),
        (file(ARM + HINGE.replace("revolute", "ball")), "joint 'J' (line 1) of type 'ball' does not close a loop"),
        (file(ARM + joint("J", "world", "b")), "joint 'J' (line 1) refers to 'b'; expected a link of the model, or world"),
        (file(ARM + joint("J", "a", "a")), "joint 'J' (line 1) joins 'a' to itself"),
        (file(ARM + "<frame name='f' attached_to='f'/>" + joint("J", "f", "a")), "joint 'J' (line 1) refers to 'f'"),
        (file(ARM + RING), "the pose of 'f' refers to itself"),
        (file(link("a", 1.0, "0 0 0 0 0 0", "J") + HINGE), "refers to itself"),
        (file(link("a", 1.0, "0 0 0 0 0 0", "none") + HINGE), "line 1: <link> refers to 'none'"),
        (file(link("a", 1.0, "0 0 0 0 0") + HINGE), "line 1: <pose> = '0 0 0 0 0'; expected 6 numbers of at most 1e+16"),
        (file(link("a", 1.0, "0 0 nan 0 0 0") + HINGE), "expected 6 numbers of at most 1e+16"),
        (arm().replace("<mass>1<", "<mass>heavy<"), "line 1: <mass> = 'heavy'; expected 1 number of at most 1e+16"),
        (arm().replace("<mass>1<", "<mass>0<"), "mass"),
        (arm(inertial="<inertial auto='true'>"), "its inertia is computed from its shapes"),
        (arm().replace("0 -1 0</xyz>", "0 0 0</xyz>"), "line 1: the axis of the joint is 0 0 0"),
        (arm(axis="<limit><lower>2</lower><upper>1</upper></limit>"), "lower limit 2 > upper limit 1"),
        (arm(axis="<limit><lower>low</lower></limit>"), "line 1: <lower> of <limit> is not a number"),
        (arm().replace("<xyz>", "<xyz expressed_in='none'>"), "line 1: <joint> refers to 'none'"),
        (file(ARM + HINGE, gravity="0 0"), "line 1: <gravity> = '0 0'; expected 3 numbers of at most 1e+16"),
        (file(ARM + TILTED), "hinges 'J' and 'K' form an angle of 90 deg"),
        (file(CHAIN), f"a chain of the model has more than {DEPTH_MAX} links"),
        (file(HINGE + "".join(f"<link name='{k}'/>" for k in range(BODIES_MAX + 1))), f"more than {BODIES_MAX} bodies"),
        (file(ARM + "".join(joint(f"J{k}", "world", "a") for k in range(BODIES_MAX + 1))), f"more than {BODIES_MAX} joints"),
    ],
)
def test_models_that_are_errors(text, said):
    """Contract: one line that says what is wrong and what is expected."""
    with one_line_error(said):
        sd.read_mjcf(text)
