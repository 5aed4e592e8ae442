"""Models in MJCF and URDF as people and programs write them: motion against MuJoCo, what is left out, what has no bounds."""

import math

import numpy as np
import pytest
from tests.build import one_line_error

import scissordyn as sd
from scissordyn.exchange.xml_element import BODIES_MAX, DEPTH_MAX

from .peer import by_mujoco, mujoco

STEP = 'timestep="1e-4" integrator="RK4"'  # MJCF attributes of an accurate integration
NO_CONTACT = '<default><geom contype="0" conaffinity="0"/></default>'  # MJCF element that switches contacts of all geoms off


def tree(rng):
    """Return a random tree of planar bodies in MJCF, with hinges, slides, springs, dampers and reference positions."""
    start = []

    def number(low, high):
        return f"{rng.uniform(low, high):.3f}"

    def joint(kind):
        axis = {"hinge": rng.choice(["0 1 0", "0 -1 0"]), "x": "1 0 0.2", "z": "0.1 0 -1"}[kind]
        text = f'<joint type="{"hinge" if kind == "hinge" else "slide"}" axis="{axis}"'
        text += f' pos="{number(-0.1, 0.1)} {number(-0.2, 0.2)} {number(-0.1, 0.1)}"' * int(rng.integers(2))
        text += f' stiffness="{number(5, 40)}" springref="{number(-0.2, 0.2)}" damping="{number(0, 0.3)}"' * int(
            rng.integers(2)
        )
        start.append((rng.uniform(-0.2, 0.2), rng.uniform(-1, 1)))
        return text + f' ref="{number(-0.2, 0.2)}"' * int(rng.integers(2)) + "/>"

    def body(depth):
        kinds = [["hinge"], ["hinge"], ["x"], ["x", "hinge"], ["x", "z", "hinge"]][rng.integers(5)]
        joints = "".join(map(joint, kinds))
        box = f'pos="{number(-0.2, 0.2)} {number(-0.2, 0.2)} {number(-0.3, 0.1)}" mass="{number(0.5, 2)}"'
        inside = "".join(body(depth + 1) for _ in range(rng.integers(0, 3 - depth)))
        return (
            f'<body pos="{number(-0.5, 0.5)} {number(-0.3, 0.3)} {number(-0.5, 0.5)}" euler="0 {number(-40, 40)} 0">{joints}'
            f'<geom type="box" size="0.05 0.08 0.15" {box}/>{inside}</body>'
        )

    bodies = "".join(body(0) for _ in range(2))
    positions, speeds = (" ".join(map(str, values)) for values in zip(*start, strict=True))
    return bodies, f'<keyframe><key qpos="{positions}" qvel="{speeds}"/></keyframe>'


def motions(text, until=0.2, samples=3):
    """Return the mass centres in a motion by this package, in the plane, and by MuJoCo, in space."""
    mechanism, notes = sd.read_mjcf(text)
    run = sd.simulate(mechanism, until=until, samples=samples, rtol=1e-10, atol=1e-12)
    return run, by_mujoco(text, until, samples, lambda data: data.xipos[1:], keyframe="<key " in text), notes


@pytest.mark.parametrize("seed", range(6))
def test_random_trees_move_as_in_mujoco(seed):
    """Cross-check by a second code: positions of all mass centres."""
    bodies, start = tree(np.random.default_rng(seed))
    text = f'<mujoco><option gravity="0.5 0 -9.81" {STEP}/>{NO_CONTACT}<worldbody>{bodies}</worldbody>{start}</mujoco>'
    run, places, notes = motions(text)
    assert run["position"].values == pytest.approx(places[:, :, [0, 2]], abs=1e-10)
    assert np.ptp(places, axis=0).max() > 0.05
    assert not any("tilted" in note for note in notes)


@pytest.mark.parametrize("turn", ["1e-5 0 0", "0.4 0 0.3", "40 20 70", "90 0 0", "0 0 180"])
def test_a_plane_anywhere_in_space(turn):
    """Cross-check: distances between mass centres do not depend on the axes of the plane."""
    bodies, start = tree(np.random.default_rng(7))
    inside = f'<worldbody><frame euler="{turn}">{bodies}</frame></worldbody>'
    run, places, notes = motions(f'<mujoco><option gravity="0.5 -1 -9.81" {STEP}/>{NO_CONTACT}{inside}{start}</mujoco>')
    (mechanism, _), normal = sd.read_mjcf(f"<mujoco>{inside}</mujoco>"), places[0] - places[0]
    assert len(mechanism.bodies) == places.shape[1]
    flat = run["position"].values
    depth = places - places[:, :1]  # out of the plane each body keeps its own depth
    first = np.linalg.norm(depth[0], axis=1) ** 2 - np.sum((flat[0] - flat[0, :1]) ** 2, axis=1)
    for k in range(1, len(flat)):
        later = np.linalg.norm(depth[k], axis=1) ** 2 - np.sum((flat[k] - flat[k, :1]) ** 2, axis=1)
        assert later == pytest.approx(first, abs=1e-9)
    assert normal.max() == 0.0
    assert any("the plane of the hinges is tilted by" in note for note in notes) == (
        turn in ("1e-5 0 0", "0.4 0 0.3", "40 20 70")
    )


# URDF element of a link with a given name
LINK = (
    "<link name='{}'><inertial><origin xyz='0.25 0 0'/><mass value='1'/>"
    "<inertia ixx='0.02' iyy='0.02' izz='0.02' ixy='0' ixz='0' iyz='0'/></inertial></link>"
)
# URDF model of two arms, with blanks for origins, axes and further elements
ARMS = (
    "<robot name='r'{}><link name='base'/>"
    + LINK.format("arm")
    + LINK.format("fore")
    + "<joint name='j' type='continuous'><parent link='base'/><child link='arm'/><origin rpy='{}'/><axis xyz='{}'/></joint>"
    "<joint name='k' type='continuous'><parent link='arm'/><child link='fore'/><origin xyz='0.5 0 0' rpy='{}'/><axis xyz='{}'/>"
    "</joint>{}</robot>"
)


@pytest.mark.parametrize(
    ("first", "axis", "second", "other", "said"),
    [
        ("1.5707 0 0", "0 0 1", "0 0 0", "0 0 1", "the plane of the hinges is tilted by 0.005519 deg to the xz plane"),
        ("1.57 0 0", "0 0 1", "3.14159 0 0", "0 0 1", "hinge 'j' is tilted by 7.6e-05 deg to the plane"),
        ("1.57 0 0", "0 0 1", "3.14 0 0", "0 0 -1", "hinge 'k' is tilted by 0.046 deg to the plane"),
        ("0 0 0.7854", "-0.7071 0.7071 0", "0 0 0", "-0.7071 0.7071 0", "the plane of the hinges is tilted by 0.0001052 deg"),
        ("0 0 0", "0 1 0.001", "0 0 0", "0 1 0", "hinge 'j' is tilted by 0.029 deg to the plane"),
    ],
)
def test_rounded_right_angles_are_read_with_a_note(first, axis, second, other, said):
    """Cross-check: the motion differs from MuJoCo's by less than the square of the tilt."""
    text = ARMS.format("", first, axis, second, other, "<mujoco><option gravity='0 0 -9.81'/></mujoco>")
    mechanism, notes = sd.read_mjcf(text)
    assert any(note.startswith(said) for note in notes), notes
    run = sd.simulate(mechanism, until=0.3, samples=3, rtol=1e-10, atol=1e-12)
    model = mujoco.MjModel.from_xml_string(text)
    data, model.opt.timestep, model.opt.integrator = mujoco.MjData(model), 1e-4, mujoco.mjtIntegrator.mjINT_RK4
    for _ in range(3000):
        mujoco.mj_step(model, data)
    here = run["angle"].values[-1] - run["angle"].values[0]
    there = [data.qpos[0], data.qpos[0] + data.qpos[1] * math.copysign(1.0, data.xaxis[0] @ data.xaxis[1])]
    assert abs(here) == pytest.approx(np.abs(there), abs=1e-5)


def arm(joint, option="", more="", geom='type="capsule" fromto="0 0 0 0.5 0 0" size="0.02" mass="1"'):
    return (
        f'<mujoco><option gravity="0 0 -9.81" {STEP}>{option}</option>{NO_CONTACT}\n<worldbody><body name="arm" pos="0 0 1">'
        f"{joint}<geom {geom}/></body></worldbody>{more}</mujoco>"
    )


@pytest.mark.parametrize(
    ("joint", "flag", "left_out"),
    [
        ('axis="0 1 0" stiffness="50" damping="3"', "spring", ["stiffness"]),
        ('axis="0 1 0" stiffness="50" damping="3"', "damper", ["damping"]),
        ('axis="0 1 0" range="-9 9" frictionloss="3"', "limit", ["limits"]),
        ('axis="0 1 0" range="-9 9" frictionloss="3"', "constraint", ["dry friction", "limits"]),
        ('axis="0 1 0" frictionloss="3"', "frictionloss", ["dry friction"]),
        ('type="slide" axis="1 0 1" stiffness="50"', "spring", ["stiffness"]),
        ('axis="0 1 0" stiffness="50"', "gravity", []),
    ],
)
def test_flags_disable_forces(joint, flag, left_out):
    """Cross-check: the motion of MuJoCo with the same flag; each force that is left out is named."""
    run, places, notes = motions(arm(f'<joint name="j" {joint}/>', f'<flag {flag}="disable"/>'))
    if "frictionloss" not in joint or len(left_out) == 2 or "dry friction" in left_out:
        assert run["position"].values == pytest.approx(places[:, :, [0, 2]], abs=1e-9)
    assert [note.split(" of joint")[0] for note in notes if "says" in note] == left_out


def test_equalities_that_a_flag_disables_are_left_out():
    """Contract: the loop is open, and a note says why."""
    text = arm(
        '<joint name="j" axis="0 1 0"/>',
        '<flag equality="disable"/>',
        '<equality><connect name="c" body1="arm" anchor=".5 0 0"/></equality>',
    )
    mechanism, notes = sd.read_mjcf(text)
    assert [joint.name for joint in mechanism.joints] == ["j"]
    assert "equality 'c': left out, as <flag equality='disable'> says" in notes


@pytest.mark.parametrize(
    ("joint", "said"),
    [
        (
            'axis="0 1 0" stiffness="5 0 20"',
            ["stiffness of joint 'j': its linear part, 5 N m per rad, is kept; the coefficients 0, 20"],
        ),
        (
            'axis="0 1 0" damping="1 3 5"',
            ["damping of joint 'j': its linear part, 1 N m per rad/s, is kept; the coefficients 3, 5"],
        ),
        (
            'axis="1 0 0" type="slide" stiffness="0 7"',
            ["stiffness of joint 'j': its linear part, 0 N per m, is kept; the coefficients 7, 0"],
        ),
        ('axis="0 1 0" stiffness="5"', []),
    ],
)
def test_polynomials_are_named(joint, said):
    """Contract: coefficients that are lost are in the note."""
    notes = sd.read_mjcf(arm(f'<joint name="j" {joint}/>')).notes
    assert [note.rpartition(" of ")[0] for note in notes if "linear part" in note] == said


@pytest.mark.parametrize(
    ("limits", "start"), [("-150 0", 0.0), ("0 150", 0.0), ("-150 90", math.pi / 2), ("-150 89.9", math.pi / 2)]
)
def test_a_limit_at_the_start_holds(limits, start):
    """Cross-check: MuJoCo's limit is soft, so that it yields by less than a milliradian."""
    joint = f'<joint name="j" type="hinge" axis="0 1 0" limited="true" range="{limits}"/>'
    text = arm(joint, more=f'<keyframe><key qpos="{start}"/></keyframe>')
    run, places, notes = motions(text, until=0.3)
    assert not any("left out" in note for note in notes if "limit" in note)
    assert any("its end stop is at the start" in note for note in notes) == ("89.9" in limits)
    assert run["position"].values == pytest.approx(places[:, :, [0, 2]], abs=2e-3)


def test_a_violated_limit_is_left_out_and_the_other_one_stays():
    """Contract: a note names the one that is left out."""
    mechanism, notes = sd.read_mjcf(arm('<joint name="j" axis="0 1 0" range="-150 -20"/>'))
    assert "upper limit of joint 'j': left out; it is -0.349066 rad, the start 0 rad" in notes
    assert [part.name for part in mechanism.components] == ["lower limit of j"]


@pytest.mark.parametrize(
    "joints",
    [
        '<joint name="s" type="slide" axis="1 0 0" stiffness="100" damping="2"/>',
        '<joint name="s" type="slide" axis="1 0 1" stiffness="100" damping="2" ref="0.1"/>',
        '<joint name="s" type="slide" axis="0 0 1" stiffness="100"/>',
        '<joint name="s" type="slide" axis="0 1 0" stiffness="100"/>',
        '<joint name="s" type="slide" axis="1 0 0" stiffness="100"/><joint name="t" type="slide" axis="1 0 2" stiffness="30"/>',
        '<joint name="s" type="slide" axis="0 1 0" stiffness="100"/><joint name="t" type="slide" axis="0 0 1" stiffness="30"/>',
    ],
)
def test_models_of_slides_alone(joints):
    """Cross-check: MuJoCo moves the same body; a direction alone is in a plane with gravity."""
    qpos = " ".join(["0.1"] * joints.count("<joint"))
    run, places, _ = motions(
        arm(joints, more=f'<keyframe><key qpos="{qpos}" qvel="{qpos}"/></keyframe>', geom='type="box" size=".1 .1 .1"')
    )
    plane = [1, 2] if 'axis="0 1 0"' in joints else [0, 2]
    assert run["position"].values == pytest.approx(places[:, :, plane], abs=1e-9)


@pytest.mark.parametrize(
    "joints",
    [
        '<joint name="j" axis="0 1 0" armature="0.2"/>',
        '<joint type="slide" axis="1 0 0"/><joint name="j" axis="0 -1 0" armature="0.2"/>',
    ],
)
def test_the_rotor_of_a_hinge_on_the_ground_turns_with_its_body(joints):
    """Cross-check: motion of a falling arm in MuJoCo, whose rotor has more inertia than the arm."""
    run, places, notes = motions(arm(joints))
    assert run["position"].values == pytest.approx(places[:, :, [0, 2]], abs=1e-9)
    assert "rotor inertia of joint 'j': 0.2 kg m^2 is added to the inertia of body 'arm'" in notes
    without = motions(arm(joints.replace("0.2", "0")))[1]
    assert abs(without - places).max() > 0.01


def test_other_rotors_are_left_out():
    """Contract: a rotor on a moving base and the armature of a slide are named with the reason."""
    inside = '<body name="fore" pos="0.5 0 0"><joint name="k" axis="0 1 0" armature="0.1"/><geom size="0.1"/></body></body>'
    text = arm('<joint name="j" type="slide" axis="1 0 0" armature="0.2"/>').replace("</body>", inside)
    notes = sd.read_mjcf(text).notes
    assert "rotor inertia of joint 'j': left out, because it resists a slide" in notes
    assert "rotor inertia of joint 'k': left out, because its base moves" in notes


def test_a_weld_that_is_open_at_the_start_is_named():
    """Closed form: the angle of the keyframe against that of the model."""
    bodies = "".join(f'<body name="{name}"><joint axis="0 1 0"/><geom size=".1"/></body>' for name in "ab")
    text = f'<mujoco><worldbody>{bodies}</worldbody><equality><weld name="w" body1="a" body2="b"/></equality>{{}}</mujoco>'
    assert not any("weld" in note for note in sd.read_mjcf(text.format("")).notes)
    turned = text.format('<keyframe><key qpos="0.5 0.7"/></keyframe>')
    assert "weld 'w' is open by -11.5 deg at the start: that angle is kept" in sd.read_mjcf(turned).notes


def test_a_default_namespace_and_lines_of_errors():
    """Identity: with and without a namespace; messages of MuJoCo have the lines of the user's text."""
    plain = ARMS.format("", "0 0 0", "0 1 0", "0 0 0", "0 1 0", "")
    assert sd.read_mjcf(plain.replace("'r'", "'r' xmlns='http://drake.mit.edu' xmlns:d=\"x\"")) == sd.read_mjcf(plain)
    text = arm('<joint\n name="j" axis="0 1 0"\n damping="much"/>').replace(
        "<mujoco>", '<mujoco xmlns="x"><visual>\n<a/>\n</visual>\n<!--\n-->'
    )
    with pytest.raises(sd.InputError, match="Element 'joint', line 6"):
        sd.read_mjcf(text)


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (
            "<gazebo><joint name='c' type='screw'><parent>arm</parent><child>base</child></joint></gazebo>",
            "joint 'c' (line 1) in <gazebo> between 'arm' and 'base' left out: if it closes a loop, the loop is open here",
        ),
        ("\n<gazebo reference='arm'><material>Red</material></gazebo>", "1 <gazebo> left out: line 2"),
        (
            "<d:loop_joint xmlns:d='d' name='c'><parent link='arm'/><child link='base'/></d:loop_joint>",
            "joint 'c' (line 1) between 'arm' and 'base' left out: if it closes a loop, the loop is open here",
        ),
        ("<transmission name='t'><joint/></transmission>", "1 <transmission> left out: 't' (line 1)"),
    ],
)
def test_foreign_elements_of_a_urdf(more, said):
    """Contract: a loop that a URDF cannot hold is not named like a colour."""
    notes = sd.read_mjcf(ARMS.format("", "0 0 0", "0 1 0", "0 0 0", "0 1 0", more)).notes
    assert said in notes
    assert any("a loop" in note for note in notes) == ("a loop" in said)


FLEX = '<worldbody><flexcomp name="f" type="grid" count="1000000 1000000 1" dim="2"/></worldbody>'  # 10^12 bodies


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ('<actuator><motor name="m" joint="k"/></actuator>', "1 <motor> left out: 'm' (line 2)"),
        ('<actuator><muscle name="m" joint="j"/></actuator>', "1 <muscle> left out: 'm' (line 2)"),
        ('<actuator><motor joint="j" nsample="1000000000"/></actuator>', "attribute 'nsample' of 1 <motor> left out (line 2)"),
        ('<tendon><spatial name="t"><site site="s"/></spatial></tendon>', "1 <spatial> left out: 't' (line 2)"),
        ('<sensor><jointpos joint="j"/></sensor>', "1 <jointpos> left out: line 2"),
        ('<keyframe><key/><key ctrl="1"/></keyframe>', "start: positions and velocities of keyframe '0', the first of 2"),
        (
            '<asset><texture name="t" type="2d" builtin="flat" width="1000000" height="1000000"/></asset>',
            "1 <texture> left out: 't' (line 2)",
        ),
        ('<size memory="100T" nuserdata="1000000000"/>', "1 <size> left out: line 2"),
        (FLEX, "1 <flexcomp> left out, with the bodies that it generates: 'f' (line 2)"),
    ],
)
def test_what_mujoco_does_not_get(more, said):
    """Contract: what is not used is named with its line and not compiled, however large it asks to be."""
    assert said in sd.read_mjcf(arm('<joint name="j" axis="0 1 0"/>', more=more)).notes


# MJCF file that another file includes
PART = """<?xml version="1.0"?>
<!-- a part -->
<mujoco{}>
<worldbody><body name="b{}"><joint axis="0 1 0"/>
<geom size=".1"/></body></worldbody></mujoco>"""


def test_included_files_are_part_of_the_model(tmp_path):
    """Identity: files within files against one text; notes have the line of the include."""
    for path in ("common/part.xml", "bodies.xml", "options.xml"):
        (tmp_path / path).parent.mkdir(exist_ok=True)
    (tmp_path / "common/part.xml").write_text(PART.format(" model='p'", 1))
    inside = "<mujocoinclude><body name='b2'><joint axis='0 1 0' margin='1'/><geom size='.2'/></body></mujocoinclude>"
    (tmp_path / "bodies.xml").write_text(inside)
    (tmp_path / "options.xml").write_text("<mujoco><option gravity='0 0 -1'/><include file='./common/part.xml'/></mujoco>")
    model = "<mujoco>\n<include file='options.xml'/>\n<worldbody><include file='bodies.xml'/></worldbody></mujoco>"
    (tmp_path / "model.xml").write_text(model)
    mechanism, notes = sd.read_drawing(tmp_path / "model.xml")
    assert [body.name for body in mechanism.bodies] == ["b1", "b2"]
    assert mechanism.gravity == 1.0
    assert {"'options.xml' (line 2) is included", "'./common/part.xml' (line 2) is included"} <= set(notes)
    assert "attribute 'margin' of 1 <joint> left out (line 3)" in notes


def test_included_files_are_found_as_in_mujoco(tmp_path):
    """Cross-check: bodies of a model in three folders by MuJoCo; the folder of the model is the first place of each file."""
    body = "<body name='{}'><joint axis='0 1 0'/><geom size='.1'/></body>"
    texts = {
        "model.xml": "<include file='a/one.xml'/><include file='last.xml'/>",
        "a/one.xml": "<include file='b/two.xml'/><include file='both.xml'/><include file='beside.xml'/>",
        "a/b/two.xml": "<include file='../up.xml'/>",
        "a/up.xml": body.format("up"),
        "both.xml": body.format("of the model"),
        "a/both.xml": body.format("of the part"),
        "a/beside.xml": body.format("beside"),
        "last.xml": body.format("last"),
        "a/last.xml": body.format("of the part"),
    }
    (tmp_path / "a/b").mkdir(parents=True)
    for name, text in texts.items():
        inside = f"<worldbody>{text}</worldbody>" if "<body" in text else text
        (tmp_path / name).write_text(f"<mujoco>{inside}</mujoco>")
    mechanism, notes = sd.read_drawing(tmp_path / "model.xml")
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "model.xml"))
    assert [body.name for body in mechanism.bodies] == [model.body(k).name for k in range(1, model.nbody)]
    assert [body.name for body in mechanism.bodies] == ["up", "of the model", "beside", "last"]
    assert "'../up.xml' (line 1) is included from 'a/up.xml'" in notes


@pytest.mark.parametrize(
    ("file", "said"),
    [
        ("/etc/passwd", "line 1: '/etc/passwd' is outside the folder of the model"),
        ("../other.xml", "line 1: '../other.xml' is outside the folder of the model"),
        ("zero.xml", "line 1: 'zero.xml' is outside the folder of the model"),
        ("itself.xml", "line 1: 'itself.xml' is included twice"),
        ("none.xml", "No such file or directory"),
        ("circle.xml", "Too many levels of symbolic links"),
        ("x" * 5000, "File name too long"),
        ("broken.xml", "cannot read the model: no element found"),
    ],
)
def test_includes_that_are_not_read(file, said, tmp_path):
    """Contract: no file outside the folder of the model, by no name, and no file in itself."""
    folder = tmp_path / "models"
    folder.mkdir()
    (tmp_path / "other.xml").write_text("<mujoco/>")
    (folder / "zero.xml").symlink_to("/dev/zero")
    (folder / "itself.xml").write_text("<mujoco><include file='itself.xml'/></mujoco>")
    (folder / "circle.xml").symlink_to("circle.xml")
    (folder / "broken.xml").write_text("<mujoco>")
    (folder / "model.xml").write_text(f"<mujoco><include file='{file}'/></mujoco>")
    with pytest.raises(sd.InputError, match=said):
        sd.read_drawing(folder / "model.xml")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (arm('<joint axis="0 1 0"/><replicate count="1000000000000"><geom size="1"/></replicate>'), "count = '1000000000000'"),
        (arm('<joint axis="0 1 0"/><replicate count="0x7fffffff"><geom size="1"/></replicate>'), "count = '0x7fffffff'"),
        (
            arm("<replicate count='999'><replicate count='999'><geom size='1'/></replicate></replicate>"),
            f"more than {BODIES_MAX} bodies",
        ),
        ("<mujoco><worldbody>" + "<body/>" * (BODIES_MAX + 1) + "</worldbody></mujoco>", f"more than {BODIES_MAX} bodies"),
        ("<mujoco>" + "<a>" * 100_000, f"nested in more than {DEPTH_MAX} elements"),
        ('<!DOCTYPE m [<!ENTITY a "b">]><mujoco>&a;</mujoco>', "line 1 of the model declares a document type"),
        (
            "<mujoco><asset><mesh name='m' builtin='sphere'/></asset><worldbody><geom mesh='m'/></worldbody></mujoco>",
            "<mesh builtin>",
        ),
        ("<robot name='r'><xacro:arm xmlns:xacro='x'/></robot>", "line 1: the URDF contains <xacro:arm>"),
        ("<html/>", "the root of the model is <html>"),
        (arm('<joint name="inf" axis="0 1 0" ref="-NaN"/>'), "line 2: ref = '-NaN' of <joint>"),
        (arm('<joint axis="0 1 0" pos="0 inf 0"/>'), "line 2: pos = '0 inf 0' of <joint>"),
        ("<mujoco>\0</mujoco>", "cannot read the model"),
        (arm("<freejoint/>"), "has no hinges and no slides"),
        (ARMS.format("", "0 0 0", "0 1 0", "0.02 0 0", "0 1 0", ""), r"hinges 'j' and 'k' form an angle of 1\.146 deg"),
        (
            arm('<joint name="p" axis="0 1 0"/><joint name="s" type="slide" axis="1 0 0"/>'),
            "slide 's' behind hinge 'p' turns with",
        ),
    ],
)
def test_models_that_are_not_read_are_one_line(text, said):
    """Contract: refused before MuJoCo compiles it."""
    with one_line_error(match=said):
        sd.read_mjcf(text)
