"""Names in drawings, previews of a mechanism and of its ideal kinematics, and the orientation of pictures."""

import dataclasses
import itertools
import math
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from tests.build import EXAMPLES

import scissordyn as sd
from scissordyn.cli.main import status_of
from scissordyn.explore.case import open_case
from scissordyn.explore.drag import Drag
from scissordyn.kinematics.transmission import dyads
from scissordyn.model.options import Options
from scissordyn.plan.plan import plan
from scissordyn.plot.animation_scene import ring_size, scene_of, upright_turns
from scissordyn.plot.drawing import BAR_FILLS
from scissordyn.plot.file import svg
from scissordyn.plot.label import PLACING, name_offsets
from scissordyn.plot.still import structure
from scissordyn.plot.stroke import kinematics
from scissordyn.plot.style import SCALE_BAR
from scissordyn.run.ideal import motion_range
from scissordyn.units import short

FILES = sorted(EXAMPLES.glob("*.toml"))  # Case files of all examples
LIFT = EXAMPLES / "lift.toml"  # Case file of a scissor lift
PAPER = str(EXAMPLES / "paper.toml")  # Case file of the paper's array


def names_in(axes):
    """Return the names in a drawing, without the text of its scale bar."""
    return [text for text in axes.texts if text.get_text() and text.get_gid() != SCALE_BAR]


def written(texts):
    """Return the texts that are not empty, with escaped dollar signs restored."""
    return [text.get_text().replace(r"\$", "$") for text in texts if text.get_text()]


def on_rings(axes):
    """Return names that touch the circle of a clearance joint."""
    figure = axes.get_figure(root=True)
    renderer, found = FigureCanvasAgg(figure).get_renderer(), []
    for ring in (line for line in axes.lines if line.get_zorder() == 5.0 and line.get_marker() == "o"):
        (x, y), reach = axes.transData.transform(ring.get_xydata()[0]), 0.5 * ring.get_markersize() * figure.dpi / 72.0
        for text in names_in(axes):
            box = text.get_window_extent(renderer)
            if math.hypot(max(box.x0 - x, 0.0, x - box.x1), max(box.y0 - y, 0.0, y - box.y1)) <= reach:
                found.append(text.get_text())
    return found


def test_long_names_keep_off_clearance_joints():
    """Contract: in a flat array with twelve long names no name touches a joint."""
    mechanism = sd.read_case(EXAMPLES / "solar_array.toml", []).mechanism
    axes = sd.preview(mechanism.replace("A.clearance", 2e-4))
    assert sum("(clearance 0.1 mm)" in text for text in written(names_in(axes))) == 11
    assert not on_rings(axes)


@pytest.mark.parametrize("case", FILES, ids=lambda path: path.stem)
def test_names_of_all_parts(case):
    """Contract: all parts of every example have their names, without overlap, off clearance joints and inside the frame."""
    mechanism = sd.read_case(case, []).mechanism
    axes = sd.preview(mechanism)
    named = [
        *mechanism.bodies,
        *mechanism.joints,
        *mechanism.guides,
        *mechanism.components,
        *mechanism.rods,
        *mechanism.latches,
    ]
    shown = written(names_in(axes))
    assert sorted(text.split(" (clearance")[0] for text in shown) == sorted(
        [part.name for part in named] + [f"drive of {drive.body}" for drive in mechanism.drives]
    )
    loose = [joint for joint in (*mechanism.joints, *mechanism.guides) if joint.clearance is not None]
    once = "clearance" in axes.get_title(loc="right")
    assert sum("(clearance" in text for text in shown) == (0 if once else len(loose))
    assert once == (len(loose) > 3 and len({joint.clearance.clearance for joint in loose}) == 1)
    figure = axes.get_figure(root=True)
    renderer = FigureCanvasAgg(figure).get_renderer()
    boxes = [text.get_window_extent(renderer) for text in names_in(axes)]
    assert not [pair for pair in itertools.combinations(boxes, 2) if pair[0].overlaps(pair[1])]
    assert not on_rings(axes)
    frame = axes.get_window_extent(renderer)
    assert all(frame.x0 <= box.x0 and box.x1 <= frame.x1 and frame.y0 <= box.y0 and box.y1 <= frame.y1 for box in boxes)


def hostile():
    """Return a slider-crank whose names are markup, formulas and control characters."""
    plain = sd.slider_crank(crank=0.05, rod=0.12, angle=0.4)
    names = {"crank pin": r"$\frac{$", "slider pin": "<script>alert(1)</script>"}
    joints = tuple(dataclasses.replace(joint, name=names.get(joint.name, joint.name)) for joint in plain.joints)
    joints = tuple(dataclasses.replace(joint, name="a\x1b[31mb") if joint.name == "ground pin" else joint for joint in joints)
    return dataclasses.replace(plain, joints=joints).driven(speed=1.0)


def test_names_are_text():
    """Contract: names are drawn letter by letter, and an SVG is well-formed without a script."""
    shown = written(names_in(sd.preview(hostile())))
    assert r"$\frac{$" in shown
    assert "<script>alert(1)</script>" in shown
    assert not any("\x1b" in text for text in shown)
    drawn = svg(sd.preview(hostile()))
    tree = ElementTree.fromstring(drawn)
    assert tree.tag.endswith("svg")
    assert not [each for each in tree.iter() if str(each.tag).endswith("script")]
    assert "<script" not in drawn
    figure = kinematics(sd.ideal_kinematics(hostile(), until=1.0))[0].get_figure(root=True)
    figure.draw_without_rendering()


def test_omitted_names_are_counted():
    """Contract: a long array keeps the most important names, and gives the number of omitted ones."""
    long = sd.scissor(units=40).with_clearance("unit 33/pivot", sd.Clearance(1e-4)).driven(speed=1.0)
    axes = sd.preview(long)
    shown = written(names_in(axes))
    assert "unit 33/pivot (clearance 0.1 mm)" in shown
    answer = axes.get_title(loc="right")
    assert int(answer.split()[0]) == len(long.bodies) + len(long.joints) + len(long.guides) + 1 - len(shown)


def test_transmission_angle_of_a_four_bar():
    """Closed form: cos mu = (c^2 + r^2 - g^2 - k^2 + 2 g k cos th) / (2 c r), by the law of cosines in both triangles."""
    ground, crank, coupler, rocker = 0.2, 0.06, 0.18, 0.12
    ideal = sd.ideal_kinematics(
        sd.four_bar(ground=ground, crank=crank, coupler=coupler, rocker=rocker, angle=0.3).driven(speed=1.0), until=6.0
    )
    th = ideal["angle"].sel(body="crank").values
    cosine = (coupler**2 + rocker**2 - ground**2 - crank**2 + 2.0 * ground * crank * np.cos(th)) / (2.0 * coupler * rocker)
    assert np.allclose(ideal["transmission_angle"].sel(dyad="rocker pin").values, np.arccos(np.abs(cosine)), atol=1e-8)


def test_extremes_over_many_turns(capsys, tmp_path):
    """Closed form: the smallest transmission angle over 100 turns, reactions of one turn, and a warning of coarse instants."""
    crank = sd.four_bar(ground=0.2, crank=0.06, coupler=0.18, rocker=0.12).driven(speed=sd.rpm(6000))
    turn, turns = (sd.ideal_kinematics(crank, until=until) for until in (0.01, 1.0))
    smallest = math.acos((0.18**2 + 0.12**2 - (0.2 - 0.06) ** 2) / (2.0 * 0.18 * 0.12))
    assert float(turns["transmission_angle"].min()) == pytest.approx(smallest, rel=1e-4)
    np.testing.assert_allclose(turns["peak_reaction"], turn["peak_reaction"], rtol=1e-3)
    sd.write_case(crank, tmp_path / "fast.toml", run=sd.Options(until=10.0))
    assert status_of(["preview", str(tmp_path / "fast.toml")]) == 0
    answer = " ".join(capsys.readouterr().out.split())
    assert "bodies rotate by up to 7.2 deg between two instants, so that peaks are missed" in answer


def test_transmission_angle_of_a_slider_crank():
    """Closed form: the cosine of the transmission angle is the sine of the rod's inclination, k sin(th)/l."""
    ideal = sd.ideal_kinematics(sd.slider_crank(crank=0.05, rod=0.12).driven(speed=1.0), until=6.0)
    th = ideal["angle"].sel(body="crank").values
    assert np.allclose(np.cos(ideal["transmission_angle"].values[:, 0]), np.abs(0.05 * np.sin(th)) / 0.12, atol=1e-8)


def test_every_body_of_an_array_is_in_a_dyad():
    """Contract: an array of N units has N dyads behind its driven bar, also with a jack at the slider; a ring has none."""
    for units in (1, 2, 5):
        assert len(dyads(plan(sd.scissor(units=units).driven(speed=1.0)))) == units
    lift = sd.read_case(LIFT, []).mechanism
    assert [dyad.joint for dyad in dyads(plan(lift))] == ["unit 1/pivot", "unit 2/pivot", "unit 3/pivot"]
    assert not dyads(plan(sd.hoberman_ring(units=6).driven(speed=1.0)))


def test_transmission_angle_with_turned_axes():
    """Identity: the direction of a coupler's own axes does not change the transmission angle."""
    linkage = sd.four_bar(ground=0.2, crank=0.06, coupler=0.18, rocker=0.12).driven(speed=1.0)
    bar, turn = linkage.body("coupler"), 0.4
    cos, sin = math.cos(turn), math.sin(turn)
    points = {name: (cos * x - sin * y, sin * x + cos * y) for name, (x, y) in bar.points.items()}
    turned = dataclasses.replace(bar, points=points, angle=bar.angle - turn)
    other = linkage.with_parts({"bodies": tuple(turned if body is bar else body for body in linkage.bodies)})
    first, second = (sd.ideal_kinematics(each, until=1.0)["transmission_angle"].values for each in (linkage, other))
    np.testing.assert_allclose(second, first, rtol=1e-11)


def test_range_of_motion():
    """Closed form: a double rocker locks at the angles of the law of cosines, a lift with upright bars."""
    linkage = sd.four_bar(ground=0.2, crank=0.15, coupler=0.12, rocker=0.1).driven(speed=1.0)
    angle = math.acos((0.2**2 + 0.15**2 - 0.22**2) / (2.0 * 0.2 * 0.15))
    low, high, unit = motion_range(plan(linkage))
    assert (low, high) == pytest.approx((-angle, angle), abs=1e-6)
    assert unit == "rad"
    lift = sd.read_case(LIFT, []).mechanism
    assert motion_range(plan(lift))[1:] == (pytest.approx(1.0, abs=1e-6), "m")
    crank = sd.slider_crank(crank=0.05, rod=0.12).driven(speed=1.0)
    assert all(map(math.isnan, motion_range(plan(crank))[:2]))


def test_ideal_kinematics_marks_singular_positions():
    """Closed form: the paper's array at 250 rpm is flat after 40 ms, with transmission angle zero and a mark."""
    case = sd.read_case(Path(PAPER), ["drive.speed='250 rpm'"])
    ideal = sd.ideal_kinematics(case.mechanism, until=case.run.until)
    assert ideal["singular_time"].values == pytest.approx([0.04], abs=1e-8)
    assert ideal["singular_input"].values == pytest.approx([math.pi / 2], abs=1e-6)
    at = ideal.sel(time=0.04, method="nearest")
    assert float(at["transmission_angle"].sel(dyad="unit 2/pivot")) == pytest.approx(0.0, abs=1e-9)
    for axes in kinematics(ideal):
        assert any(np.allclose(line.get_xdata(), 40.0) for line in axes.lines if line.get_label() == "change point")


def test_preview_command(tmp_path, capsys):
    """Contract: the command prints its findings and writes the requested files."""
    picture, curves = tmp_path / "picture.svg", tmp_path / "curves.png"
    assert status_of(["preview", PAPER, "-o", str(picture), "--curves", str(curves), "--set", "drive.speed='250 rpm'"]) == 0
    answer = " ".join(capsys.readouterr().out.split())
    assert "closes as it is placed" in answer
    assert "goes from 30 to 105 deg" in answer
    assert "change point at t = 0.04 s (drive of 'unit 1/bar 1' at 90 deg)" in answer
    assert "transmission angle: 0 deg at joint 'unit 2/pivot'" in answer
    ElementTree.parse(picture)
    assert curves.read_bytes().startswith(b"\x89PNG")
    assert status_of(["preview", PAPER, "-o", str(tmp_path / "picture.gif")]) == 2


@pytest.mark.parametrize("command", ["preview", "check"])
def test_torque_of_a_servo_before_a_run(tmp_path, capsys, command):
    """Cross-check: the torque equals that of a drive on the reference; a limit below it gives a warning."""
    assert status_of(["new", "scissor", "--with", "servo"]) == 0
    case = tmp_path / "servo.toml"
    case.write_text(capsys.readouterr().out)
    mechanism = sd.read_case(case).mechanism
    (servo,) = mechanism.components
    driven = dataclasses.replace(mechanism.ideal(), components=()).driven(servo.reference)
    torque = float(np.abs(sd.simulate(driven, until=sd.read_case(case).run.until)["drive_torque"]).max())
    assert status_of([command, str(case)]) == 0
    answer = " ".join(capsys.readouterr().out.split())
    assert f"follows its reference with up to {short(torque, 'N m')}" in answer
    assert status_of([command, str(case), "--set", f"servo.controller.limit={0.5 * torque} N m"]) == 0
    assert "2 times its limit" in " ".join(capsys.readouterr().out.split())


def test_the_limit_of_a_servo_that_rises(tmp_path, capsys):
    """Closed form: a torque of 2 N m below a limit that rises to 8 N m in 0.4 s of 1 s is not held for 0.1 of the time."""
    wheel = sd.Body("wheel", 1.0, 0.5, {"pin": (0.0, 0.0)}, position=(0.0, 0.0), angle=0.0)
    made = sd.Mechanism((wheel,), (sd.Revolute("pin", ("wheel", "pin"), ("ground", "O")),), ground=(("O", (0.0, 0.0)),))
    for ramp in (0.0, 0.4):
        servo = sd.PID(100.0, 10.0, limit=8.0, ramp=ramp)
        held = made.controlled(servo, reference=sd.Polynomial((0.0, 0.0, 2.0)), body="wheel")
        sd.write_case(held, tmp_path / f"servo{ramp}.toml", run=Options(until=1.0))
        assert status_of(["check", str(tmp_path / f"servo{ramp}.toml")]) == 0
        answer = " ".join(capsys.readouterr().out.split())
        if ramp:
            assert "0.25 times its limit of 8 N m, which rises over 400 ms: it cannot hold for 10% of the time" in answer
        else:
            assert "0.25 of its limit of 8 N m." in answer


def test_preview_reports_assembly(tmp_path, capsys):
    """Contract: a press with its ram 2 mm too low is assembled, and the preview reports the moved bodies."""
    text = (EXAMPLES / "press.toml").read_text().replace("60, -150.788 mm", "60, -152.788 mm")
    case = tmp_path / "moved.toml"
    case.write_text(text)
    assert status_of(["preview", str(case)]) == 0
    answer = capsys.readouterr().out
    assert "Assembly moves the mass centre of body" in answer
    assert "and rotates body" in answer


@pytest.fixture(scope="module")
def lift():
    """Return the lift, whose gravity points along -x, without clearance."""
    return sd.read_case(LIFT, []).mechanism.ideal()


@pytest.fixture(scope="module")
def start(lift):
    return sd.simulate(lift, until=1e-9, samples=2)


@pytest.mark.parametrize("turns", [1, 2, 3])
def test_scene_is_turned_as_a_whole(lift, start, turns):
    """Cross-check: every point is that of the scene with gravity downwards, rotated about the origin."""
    plain = scene_of(start, dataclasses.replace(lift, gravity_direction=-0.5 * math.pi), np.array([0, 1]), [])
    standing = scene_of(start, dataclasses.replace(lift, gravity_direction=-0.5 * math.pi * (1 + turns)), np.array([0, 1]), [])
    turn = np.array([[0.0, -1.0], [1.0, 0.0]])
    turn = np.linalg.matrix_power(turn, turns).T
    assert [shape.name for shape in standing.shapes] == [shape.name for shape in plain.shapes]
    for now, before in zip(standing.shapes, plain.shapes, strict=True):
        assert np.allclose(now.points, before.points @ turn, atol=1e-12), now.name
    assert np.allclose(standing.pins, plain.pins @ turn, atol=1e-12)
    assert np.allclose(standing.supports, plain.supports @ turn, atol=1e-12)
    corners = np.array([plain.low, plain.high]) @ turn
    assert np.allclose([standing.low, standing.high], [corners.min(axis=0), corners.max(axis=0)], atol=1e-12)


def test_lift_stands_upright(lift, start):
    """Contract: the three units are above each other; the scale bar shows the directions of the axes of the case."""
    for axes in (sd.preview(lift, start=start), structure(start, lift, times=1)[0]):
        [scale] = [text.get_text() for text in axes.texts if text.get_gid() == SCALE_BAR]
        [bar] = [line for line in axes.lines if line.get_gid() == SCALE_BAR]
        assert scale == "0.2 m   x ↑, y ←"
        assert np.ptp(bar.get_xdata()) == pytest.approx(0.2)
        bars = [line.get_xydata() for line in axes.lines if line.get_color() in BAR_FILLS]
        height = [float(np.mean(np.asarray(bar)[:2, 1])) for bar in bars]
        assert np.allclose(height, np.repeat(np.array([1, 3, 5]) * 0.5 * math.sqrt(1.0 - 0.9397**2), 2), atol=1e-9)


def test_oblique_gravity_turns_nothing(lift):
    """Limit: a picture is rotated by multiples of 90 degrees only, and not without gravity."""
    assert upright_turns(lift) == 1
    assert upright_turns(dataclasses.replace(lift, gravity_direction=math.radians(200.0))) == 0
    assert upright_turns(dataclasses.replace(lift, gravity=0.0)) == 0


def test_drag_follows_the_pointer_in_the_turned_picture():
    """Contract: an upward pointer in the rotated picture moves the joint along the x axis of the case."""
    drag = Drag(open_case(LIFT), "pin", "unit 1/upper")
    reach = 0.03 * drag.size
    for part in (0.5, 1.0, 1.0):
        drag.move_target(0.0, part * reach)
    assert np.allclose(drag.present - drag.origin, [reach, 0.0], atol=1e-3 * drag.size)


RADIUS, RING = 4.1, 5.5
"""[pt] Radii of the circles that mark joints, with their lines: clearance joints in pictures, joints in films."""


@pytest.fixture(scope="module")
def anchored():
    """Return box, joint and other clearance joints of each name in a still of the ring [pt]."""
    case = sd.read_case(LIFT.with_name("ring.toml"))
    run = sd.simulate(case.mechanism, until=0.25, samples=4)
    axes = structure(run, case.mechanism)[0]  # of four instants
    dot = axes.get_figure(root=True).dpi / 72.0
    names = names_in(axes)
    places = np.array([axes.transData.transform(text.xy) for text in names]) / dot
    boxes = [text.get_window_extent() for text in names]
    return [
        (np.array([box.x0, box.y0]) / dot, np.array([box.x1, box.y1]) / dot, places[k], np.delete(places, k, axis=0))
        for k, box in enumerate(boxes)
    ]


def test_names_are_with_their_joints(anchored):
    """Contract: a name is nearest to its own joint, or has a leader that passes no other clearance joint."""
    assert len(anchored) == 3
    for low, high, place, others in anchored:
        near = np.clip(place, low, high)
        away = math.dist(near, place)
        if away > PLACING.leader_min:
            steps = np.linspace(0.0, 1.0, 200)[:, None]
            points = place + steps * (near - place)
            assert np.linalg.norm(points[:, None] - others, axis=2).min() > RADIUS
        else:
            assert away < np.linalg.norm(np.clip(others, low, high) - others, axis=1).min()


def test_names_of_a_preview_keep_off_lines():
    """Contract: no name in the previews of two examples covers a bar or a symbol."""
    for example in ("ring", "periodic"):
        axes = sd.preview(sd.read_case(LIFT.with_name(f"{example}.toml")).mechanism)
        names = names_in(axes)
        lines = [line for line in axes.lines if line.get_linewidth() > 0.5]  # leaders are thinner
        paths = [(line.get_transform().transform_path(line.get_path()), line.get_linestyle()) for line in lines]
        # nothing connects markers
        points = np.concatenate([path.interpolated(1 if style == "None" else 40).vertices for path, style in paths])
        for text in names:
            box = text.get_window_extent().padded(-1.5)
            assert not np.any(np.all((points > box.p0) & (points < box.p1), axis=1)), (example, text.get_text())


def test_names_of_a_film_keep_off_lines():
    """Contract: in every frame of half a revolution of a crank, no name covers a joint, a bar or another name."""
    angle = np.linspace(0.0, math.pi, 60)
    crank = 0.2 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    end = np.stack([crank[:, 0] + np.sqrt(0.25 - crank[:, 1] ** 2), 0.0 * angle], axis=1)
    fixed = np.zeros((60, 2))
    joints, names = np.stack([crank, end], axis=1), ["crank pin", "slider pin"]
    lines = [np.stack([fixed, crank], axis=1), np.stack([crank, end], axis=1)]
    every = name_offsets(names, joints, lines, fixed[:, None], (np.array([-0.4, -0.3]), np.array([0.8, 0.4])), instants=60)
    half = 0.5 * np.array([[PLACING.letter_width * len(name), PLACING.line_height] for name in names])
    hidden = 0
    for frame, found in enumerate(every):
        places = PLACING.region / 1.2 * np.stack([crank[frame], end[frame], fixed[frame]])
        boxes = [(places[k] + found[k] - half[k], places[k] + found[k] + half[k]) for k in range(2)]
        for low, high in boxes:
            assert np.all(np.linalg.norm(np.clip(places, low, high) - places, axis=1) > RING)
            for line in lines:
                points = (
                    PLACING.region
                    / 1.2
                    * (line[frame][0] + np.linspace(0.0, 1.0, 400)[:, None] * (line[frame][1] - line[frame][0]))
                )
                hidden += int(np.any(np.all((points > low) & (points < high), axis=1)))
        assert not any(np.all((a[0] < b[1]) & (b[0] < a[1])) for a, b in itertools.combinations(boxes, 2))
    assert hidden == 0
    assert np.all(np.linalg.norm(every, axis=2) < 60.0)
    jumps = (np.abs(np.diff(every, axis=0)) > 0.0).any(axis=2).sum(axis=0)
    assert np.all(jumps <= 3)


def test_names_of_crowded_joints():
    """Contract: names of six joints drawn two letters apart never overlap."""
    names = [f"unit {k}/pivot" for k in range(2, 8)]
    high = np.linspace(0.1, 0.4, 24)[:, None] * np.arange(1, 7)
    joints = np.stack([0.0 * high, high], axis=2)
    region = np.array([-2.0, -0.5]), np.array([2.0, 9.5])
    half = 0.5 * np.array([PLACING.letter_width * 12, PLACING.line_height])
    for longer in (200.0, 340.0):
        every = name_offsets(names, joints, [joints], np.empty((24, 0, 2)), region, longer=longer, instants=24)
        for places, found in zip(longer / 10.0 * joints, every, strict=True):
            apart = np.abs(places + found - (places + found)[:, None])
            assert not np.any(np.all(apart < 2.0 * half, axis=2) & ~np.eye(6, dtype=bool))


def test_names_of_a_still_film():
    """Limit: without motion names do not move, for any number of instants up to the number of frames."""
    joints = np.tile([[[0.0, 0.0], [0.3, 0.1]]], (40, 1, 1))
    region = np.array([-1.0, -1.0]), np.array([1.0, 1.0])
    for instants, count in ((5, 5), (40, 40), (90, 40)):
        found = name_offsets(["A", "B"], joints, [joints], np.empty((40, 0, 2)), region, instants=instants)
        assert found.shape == (count, 2, 2)
        assert np.all(found == found[0])


def test_rings_leave_room_between_joints():
    """Closed form: rings are half the distance of neighbours, within bounds; coinciding joints count once."""
    line = np.stack([np.arange(5.0), np.zeros(5)], axis=1)
    assert ring_size(line[None], 10.0, 8.0) == 5.0
    assert abs(ring_size(np.concatenate([line, line + 1e-6])[None], 10.0, 8.0) - 5.0) < 1e-4
    assert ring_size(line[None], 1.0, 8.0) == 3.5
    assert ring_size(line[None], 100.0, 8.0) == ring_size(line[None, :1], 10.0, 8.0) == 8.0


def test_names_stay_with_their_joints_and_in_the_picture():
    """Contract: in an array that closes, each name is nearest to its own joint and inside the picture."""
    gap = np.linspace(1.0, 0.25, 30)
    joints = np.stack([np.stack([k * gap, 0.0 * gap], axis=1) for k in range(3)], axis=1)
    region = np.array([-0.05, -0.5]), np.array([2.2, 0.5])
    every = name_offsets(
        ["unit 1/pivot", "unit 2/pivot", "unit 3/pivot"], joints, [joints], np.empty((30, 0, 2)), region, instants=30
    )
    scale, half = PLACING.region / 2.25, 0.5 * np.array([PLACING.letter_width * 12, PLACING.line_height])
    for places, found in zip(scale * joints, every, strict=True):
        for k in range(3):
            low, high = places[k] + found[k] - half, places[k] + found[k] + half
            away = np.linalg.norm(np.clip(places, low, high) - places, axis=1)
            assert np.argmin(away) == k
            assert np.all(low >= scale * region[0])


def test_placement_without_names():
    """Limit: without names the result is empty."""
    assert name_offsets([], np.empty((3, 0, 2)), [], np.empty((3, 0, 2)), (np.zeros(2), np.ones(2))).shape == (3, 0, 2)
