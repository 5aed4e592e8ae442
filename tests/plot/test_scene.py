"""Scenes and films of the structure: bodies in place, clearance joints magnified, and film files."""

import dataclasses
import html
import itertools
import json
import re
import subprocess

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.animation import FFMpegWriter
from PIL import Image

import scissordyn as sd
from scissordyn.plot.animation import Film
from scissordyn.plot.animation_scene import outline, scene_of
from scissordyn.plot.canvas import page
from scissordyn.plot.drawing import BAR_FILLS
from scissordyn.plot.still import structure
from scissordyn.plot.style import SIZES
from scissordyn.record.placement import Placement

from .made_up import CLEARANCE, INSTANTS, data_of, floats, made_up, mechanism_with

FRAMES = np.array([0, 400, 401, 1500, INSTANTS - 1])  # Indices of the samples that are drawn


@pytest.fixture(scope="module")
def scene(run, arm):
    """Return the scene of a made-up run with a spring from the ground to the slider."""
    sprung = dataclasses.replace(arm, components=(sd.Spring("rope", ("ground", "origin"), ("slider", "centre")),))
    return scene_of(run, sprung, FRAMES, ["A"])


def test_positions_of_bodies_and_pins(run, arm, scene):
    """Cross-check: each frame equals the placement of the static pictures."""
    shapes = {shape.name: shape for shape in scene.shapes}
    for frame, sample in enumerate(FRAMES.tolist()):
        placed = Placement.at(arm, run, [sample])
        for body in arm.bodies:
            points = shapes[body.name].points[frame]
            wanted = placed.points(body.name, outline(body))[0]
            if shapes[body.name].kind == "block":
                points = points.mean(axis=0, keepdims=True)
            np.testing.assert_allclose(points, wanted, atol=1e-13)
        np.testing.assert_allclose(
            scene.pins[frame], [placed.place(joint.bearing)[0] for joint in arm.ideal_joints], atol=1e-13
        )
        np.testing.assert_allclose(scene.clearance_joints[0].place[frame], placed.place(arm.joint("A").bearing)[0], atol=1e-13)
        np.testing.assert_allclose(shapes["rope"].points[frame, [0, -1]], [[0.0, 0.0], placed.centre("slider")[0]], atol=1e-13)


def test_bars_have_the_colours_of_stills(run, arm, scene):
    """Cross-check: each bar of a film and of a page has its colour in a still of the same run."""
    still = structure(run, arm)[0]
    where = {tuple(line.get_xydata()[0].round(9)): line.get_color() for line in still.lines if line.get_color() in BAR_FILLS}
    film, tones = Film(scene, 1.0), {shape["name"]: shape["tone"] for shape in data_of(page(scene, run, 1.0))["shapes"]}
    bars = 0
    for shape, artist in zip(scene.shapes, film.drawing.shapes, strict=True):
        if shape.kind == "bar":
            bars += 1
            assert artist.get_color() == where[tuple(shape.points[0, 0].round(9))]
            assert artist.get_color() == BAR_FILLS[tones[shape.name]]
    assert bars == len(where) >= 2


def test_everything_stays_inside_the_picture(scene):
    """Contract: every point of a body, pin or spring is inside the corners."""
    for shape in scene.shapes:
        if shape.kind != "guide":
            assert np.all((shape.points >= scene.low) & (shape.points <= scene.high))


def test_journals_are_magnified_by_one_factor(run, scene):
    """Closed form: drawn eccentricity over drawn clearance is eccentricity over clearance; the path ends at the journal."""
    joint = scene.clearance_joints[0]
    eccentricity = run["eccentricity"].sel(joint="A").values
    np.testing.assert_allclose(joint.journal / SIZES.magnified_clearance, eccentricity[FRAMES] / CLEARANCE, rtol=1e-12)
    np.testing.assert_array_equal(joint.path[joint.reached - 1], joint.journal)
    assert joint.gain == pytest.approx(SIZES.magnified_clearance * 10e-3 / CLEARANCE, rel=1e-12)


def test_contacts_between_frames_are_shown(run, arm):
    """Contract: with a frame every 8 ms and contacts of 0.3 ms, each frame has the largest force since the previous one."""
    frames = np.arange(0, INSTANTS, 320)
    joint = scene_of(run, arm, frames, ["A"]).clearance_joints[0]
    force, touching = run["normal_force"].sel(joint="A").values, run["in_contact"].sel(joint="A").values
    parts = [slice(0, 1), *(slice(a + 1, b + 1) for a, b in itertools.pairwise(frames.tolist()))]
    np.testing.assert_array_equal(joint.force, [force[part].max() for part in parts])
    np.testing.assert_array_equal(joint.touched, [touching[part].any() for part in parts])
    assert joint.touched[1:].all()
    assert not touching[frames].all()


def test_film_moves_its_artists(scene):
    """Contract: the lines of a frame are the scene's, and the title gives the time."""
    film = Film(scene, 120.0)
    film.show(3)
    for artist, shape in zip(film.drawing.shapes, scene.shapes, strict=True):
        if shape.kind == "bar":
            np.testing.assert_array_equal(artist.get_xydata(), shape.points[3])
    np.testing.assert_array_equal(film.drawing.pins.get_xydata(), scene.pins[3])
    assert film.axes.get_title(loc="left") == "t = 37.5 ms   (120× slower)"
    film.show(0)
    assert film.axes.get_title(loc="left").startswith("t = 0 ms")


def test_gif_has_every_frame(run, arm, tmp_path):
    """Contract: number and duration of frames, and pictures that differ."""
    path = sd.animate(run, arm, tmp_path / "film.gif", seconds=0.4, rate=10)
    with Image.open(path) as film:
        assert film.n_frames == 4
        assert film.info["duration"] == 100
        first = np.asarray(film.convert("RGB"), int)
        film.seek(3)
        assert np.abs(np.asarray(film.convert("RGB"), int) - first).max() > 100
    assert [found.name for found in tmp_path.iterdir()] == ["film.gif"]


@pytest.mark.skipif(not FFMpegWriter.isAvailable(), reason="no ffmpeg on this machine: apt-get install ffmpeg")
def test_mp4_is_a_film(run, arm, tmp_path):
    """Contract: ffmpeg reads back codec, rate and duration."""
    path = sd.animate(run, arm, tmp_path / "film.mp4", seconds=0.4, rate=10)
    report = subprocess.run(["ffmpeg", "-i", str(path)], capture_output=True, text=True, check=False, timeout=60).stderr
    assert "Video: h264" in report
    assert "yuv420p" in report
    assert "10 fps" in report
    assert "Duration: 00:00:00.40" in report


def test_mp4_without_ffmpeg_is_refused(run, arm, tmp_path, monkeypatch):
    """Contract: the error says what is missing and what to do."""
    monkeypatch.setattr(FFMpegWriter, "isAvailable", classmethod(lambda cls: False))
    with pytest.raises(sd.InputError, match=r"the program ffmpeg is not installed.*film\.html"):
        sd.animate(run, arm, tmp_path / "film.mp4")
    assert not list(tmp_path.iterdir())


def test_failing_ffmpeg(run, arm, tmp_path):
    """Contract: an ffmpeg that ends with an error gives one line and leaves no file."""
    broken = tmp_path / "bin" / "ffmpeg"
    broken.parent.mkdir()
    broken.write_text("#!/bin/sh\ncat >/dev/null\nexit 3\n")
    broken.chmod(0o755)
    with mpl.rc_context({"animation.ffmpeg_path": str(broken)}), pytest.raises(sd.InputError, match=r"exit status 3"):
        sd.animate(run, arm, tmp_path / "film.mp4", seconds=0.2, rate=10)
    assert [found.name for found in tmp_path.iterdir()] == ["bin"]


def test_pages_are_self_contained(run, scene):
    """Contract: nothing is fetched, the page is reproducible, and every point is there in single precision."""
    text = page(scene, run, 6.0)
    assert text == page(scene, run, 6.0)
    assert not re.search(r"https?:|src=|href=|@import|url\(|import ", text)
    film = data_of(text)
    np.testing.assert_allclose(floats(film["time"]), scene.time, rtol=1e-6)
    assert film["seconds"] == 6.0
    assert len(film["shapes"]) == len(scene.shapes)
    for drawn, shape in zip(film["shapes"], scene.shapes, strict=True):
        points = floats(drawn["points"]).reshape(len(scene.time), drawn["count"], 2)
        np.testing.assert_allclose(points, np.broadcast_to(shape.points, points.shape), rtol=1e-6, atol=1e-7)


def test_names_cannot_break_a_page(run):
    """Contract: a joint named like the end of a script is text."""
    name = "</script><b>&"
    arm = mechanism_with(())
    joints = tuple(dataclasses.replace(joint, name=name) if joint.name == "A" else joint for joint in arm.joints)
    arm = dataclasses.replace(arm, joints=joints).with_clearance(name, sd.Clearance(CLEARANCE))
    named = run.assign_coords(joint=[name if old == "A" else old for old in run["joint"].values.tolist()])
    scene = scene_of(named, arm, FRAMES, [name])
    text = page(scene, named, float(scene.time[-1] - scene.time[0]))
    assert "<b>" not in text
    assert data_of(text)["joints"][0]["name"] == name
    assert text.count("</script>") == 3
    assert "real time" in text


def test_browser_shows_a_frame(run, scene, tmp_path, browser):
    """Contract: a page opened at a frame shows its time and draws it without an error."""
    (tmp_path / "film.html").write_text(page(scene, run, 6.0), encoding="utf-8")
    shown, errors = browser.new_page(), list[str]()
    shown.on("pageerror", lambda error: errors.append(str(error)))
    shown.goto(f"file://{tmp_path}/film.html#3")
    shown.wait_for_selector('canvas[data-frame="3"]')
    assert shown.text_content("output") == "t = 37.5 ms"
    shown.close()
    assert not errors


@pytest.mark.parametrize(
    ("name", "options", "says"),
    [
        ("film.gfi", {}, "did you mean 'gif'"),
        ("film", {}, "ends in .gif, .mp4 or .html"),
        ("no/folder/film.html", {}, "cannot write"),
        ("film.html", {"joints": ["B"]}, "joint 'B'"),
        ("film.html", {"seconds": 0.0}, "seconds > 0"),
        ("film.html", {"rate": 0}, "rate >= 1"),
    ],
)
def test_refused_films(run, arm, tmp_path, name, options, says):
    """Contract: wrong arguments give an error of one line, and no file."""
    with pytest.raises(sd.InputError) as caught:
        sd.animate(run, arm, tmp_path / name, **options)
    assert says in str(caught.value)
    assert not list(tmp_path.iterdir())


def test_runs_without_clearance_joints_and_short_ones(ideal, run, arm, tmp_path):
    """Limit: a film without clearance joints, of two samples, and of one sample, which is refused."""
    path = sd.animate(ideal.isel(time=[0, -1]), mechanism_with(()), tmp_path / "film.html", seconds=2.0)
    film = data_of(path.read_text(encoding="utf-8"))
    assert (film["joints"], floats(film["time"]).size, film["seconds"]) == ([], 2, 2.0)
    with pytest.raises(sd.InputError, match="fewer than two samples"):
        sd.animate(run.isel(time=[0]), arm, tmp_path / "short.html")


def test_page_shows_all_clearance_joints(tmp_path):
    """Contract: every clearance joint has a ring and a magnified view, the chosen ones first."""
    names = ("unit 1/pivot", "A")
    many, mechanism = made_up(names), mechanism_with(names)
    film = data_of(sd.animate(many, mechanism, tmp_path / "film.html", seconds=1.0).read_text(encoding="utf-8"))
    assert {joint["name"] for joint in film["joints"]} == set(names)
    chosen = sd.animate(many, mechanism, tmp_path / "one.html", seconds=1.0, joints=["A"]).read_text(encoding="utf-8")
    assert [joint["name"] for joint in data_of(chosen)["joints"]] == ["A", "unit 1/pivot"]


def test_film_names_its_joints_and_counts_the_others():
    """Contract: names follow their joints in each frame; a film of fewer joints gives the number of omitted ones."""
    names = ("unit 1/pivot", "A")
    many, mechanism = made_up(names), mechanism_with(names)
    film = Film(scene_of(many, mechanism, FRAMES, ["A", "unit 1/pivot"], shown=1), 1.0)
    film.show(3)
    placed = Placement.at(mechanism, many, FRAMES).place(mechanism.joint("A").bearing)
    assert [name.get_text() for name in film.names] == ["A"]
    assert np.allclose(film.names[0].xy, placed[3])
    assert len(film.drawing.rings) == 2
    assert film.figure.get_supxlabel() == "1 more clearance joint with smaller forces"


def test_notebook_shows_the_scene_of_a_run():
    """Contract: the notebook frame has the page of a film with every joint, and the other run as a ghost."""
    linkage = sd.slider_crank(crank=0.05, rod=0.12, angle=0.4).driven(speed=sd.rpm(60))
    run = sd.simulate(linkage.with_clearance("slider pin", sd.Clearance(5e-4)), until=1e-2, samples=11)
    other = sd.simulate(linkage, until=1e-2, samples=5)
    shown = sd.view(run, ghost=other)
    frame = re.fullmatch(r'<iframe srcdoc="([^"]*)" style="[^"]*"></iframe>', shown._repr_html_())
    assert html.unescape(frame[1]) == shown.html
    scene, ghost = (re.search(rf'id="{name}">(.*?)</script>', shown.html) for name in ("scene", "ghost"))
    assert [joint["name"] for joint in json.loads(scene[1])["joints"]] == ["slider pin"]
    assert json.loads(ghost[1])["joints"] == []
    assert "http" not in shown.html.replace("http://www.w3.org", "")
    with pytest.raises(sd.InputError, match="fewer than two samples"):
        sd.view(run.isel(time=[0]))
