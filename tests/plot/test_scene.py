"""Stills and films of the structure: bodies in place, clearance joints and guides magnified, and film files."""

import base64
import dataclasses
import html
import itertools
import json
import math
import re
import shutil
import subprocess
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
import xarray as xr
from matplotlib.animation import FFMpegWriter
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba
from PIL import Image

import scissordyn as sd
from scissordyn.components.spring import Spring
from scissordyn.errors import InputError
from scissordyn.laws.elastic.linear import Linear
from scissordyn.model.body import Body, bar, point_mass
from scissordyn.model.clearance import Clearance, GuideClearance
from scissordyn.model.mechanism import Mechanism
from scissordyn.plot.animation import Film, animate
from scissordyn.plot.animation_scene import Scene, guides_for_contacts, outline, scene_of
from scissordyn.plot.canvas import pack_scene, page
from scissordyn.plot.drawing import BAR_FILLS, block_walls
from scissordyn.plot.joint import orbit
from scissordyn.plot.report import draw_all
from scissordyn.plot.still import structure
from scissordyn.plot.style import SIZES, SKY, VERMILION
from scissordyn.record.placement import Placement
from scissordyn.run.simulate import simulate
from scissordyn.warning import LISTED_MAX

from .made_up import CLEARANCE, CLEARANCE_JOINTS, INSTANTS, made_up, mechanism_with

FRAMES = np.array([0, 400, 401, 1500, INSTANTS - 1])
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")


@pytest.fixture(scope="module")
def scene(run: xr.Dataset, arm: Mechanism) -> Scene:
    """Return the scene of a made-up run with a spring from the ground to the slider."""
    sprung = dataclasses.replace(arm, components=(Spring("rope", ("ground", "origin"), ("slider", "centre")),))
    return scene_of(run, sprung, FRAMES, ["A"])


def test_positions_of_bodies_and_pins(run: xr.Dataset, arm: Mechanism, scene: Scene) -> None:
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


def test_bars_have_the_colours_of_stills(run: xr.Dataset, arm: Mechanism, scene: Scene) -> None:
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


def test_everything_stays_inside_the_picture(scene: Scene) -> None:
    """Contract: every point of a body, pin or spring is inside the corners."""
    for shape in scene.shapes:
        if shape.kind != "guide":
            assert np.all((shape.points >= scene.low) & (shape.points <= scene.high))


def test_journals_are_magnified_by_one_factor(run: xr.Dataset, scene: Scene) -> None:
    """Closed form: drawn eccentricity over drawn clearance is eccentricity over clearance; the path ends at the journal."""
    joint = scene.clearance_joints[0]
    eccentricity = run["eccentricity"].sel(joint="A").values
    np.testing.assert_allclose(joint.journal / SIZES.magnified_clearance, eccentricity[FRAMES] / CLEARANCE, rtol=1e-12)
    np.testing.assert_array_equal(joint.path[joint.reached - 1], joint.journal)
    assert joint.gain == pytest.approx(SIZES.magnified_clearance * 10e-3 / CLEARANCE, rel=1e-12)


def test_contacts_between_frames_are_shown(run: xr.Dataset, arm: Mechanism) -> None:
    """Contract: with a frame every 8 ms and contacts of 0.3 ms, each frame has the largest force since the previous one."""
    frames = np.arange(0, INSTANTS, 320)
    joint = scene_of(run, arm, frames, ["A"]).clearance_joints[0]
    force, touching = run["normal_force"].sel(joint="A").values, run["in_contact"].sel(joint="A").values
    parts = [slice(0, 1), *(slice(a + 1, b + 1) for a, b in itertools.pairwise(frames.tolist()))]
    np.testing.assert_array_equal(joint.force, [force[part].max() for part in parts])
    np.testing.assert_array_equal(joint.touched, [touching[part].any() for part in parts])
    assert joint.touched[1:].all()
    assert not touching[frames].all()


def test_film_moves_its_artists(scene: Scene) -> None:
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


def test_gif_has_every_frame(run: xr.Dataset, arm: Mechanism, tmp_path: Path) -> None:
    """Contract: number and duration of frames, and pictures that differ."""
    path = animate(run, arm, tmp_path / "film.gif", seconds=0.4, rate=10)
    with Image.open(path) as film:
        assert film.n_frames == 4
        assert film.info["duration"] == 100
        first = np.asarray(film.convert("RGB"), int)
        film.seek(3)
        assert np.abs(np.asarray(film.convert("RGB"), int) - first).max() > 100
    assert [found.name for found in tmp_path.iterdir()] == ["film.gif"]


@pytest.mark.skipif(not FFMpegWriter.isAvailable(), reason="no ffmpeg on this machine: apt-get install ffmpeg")
def test_mp4_is_a_film(run: xr.Dataset, arm: Mechanism, tmp_path: Path) -> None:
    """Contract: ffmpeg reads back codec, rate and duration."""
    path = animate(run, arm, tmp_path / "film.mp4", seconds=0.4, rate=10)
    report = subprocess.run(["ffmpeg", "-i", str(path)], capture_output=True, text=True, check=False, timeout=60).stderr
    assert "Video: h264" in report
    assert "yuv420p" in report
    assert "10 fps" in report
    assert "Duration: 00:00:00.40" in report


def test_mp4_without_ffmpeg_is_refused(
    run: xr.Dataset, arm: Mechanism, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Contract: the error says what is missing and what to do."""
    monkeypatch.setattr(FFMpegWriter, "isAvailable", classmethod(lambda cls: False))
    with pytest.raises(InputError, match=r"the program ffmpeg is not installed.*film\.html"):
        animate(run, arm, tmp_path / "film.mp4")
    assert not list(tmp_path.iterdir())


def test_failing_ffmpeg(run: xr.Dataset, arm: Mechanism, tmp_path: Path) -> None:
    """Contract: an ffmpeg that ends with an error gives one line and leaves no file."""
    broken = tmp_path / "bin" / "ffmpeg"
    broken.parent.mkdir()
    broken.write_text("#!/bin/sh\ncat >/dev/null\nexit 3\n")
    broken.chmod(0o755)
    with mpl.rc_context({"animation.ffmpeg_path": str(broken)}), pytest.raises(InputError, match=r"exit status 3"):
        animate(run, arm, tmp_path / "film.mp4", seconds=0.2, rate=10)
    assert [found.name for found in tmp_path.iterdir()] == ["bin"]


def data_of(text: str) -> dict:
    found = re.search(r'<script type="application/json" id="scene">(.*?)</script>', text, re.DOTALL)
    return json.loads(found[1])


def floats(pack_scene: str) -> np.ndarray:
    """Return packed numbers of a page."""
    return np.frombuffer(base64.b64decode(pack_scene), np.float32)


def test_pages_are_self_contained(run: xr.Dataset, scene: Scene) -> None:
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


def test_names_cannot_break_a_page(run: xr.Dataset) -> None:
    """Contract: a joint named like the end of a script is text."""
    name = "</script><b>&"
    arm = mechanism_with(())
    joints = tuple(dataclasses.replace(joint, name=name) if joint.name == "A" else joint for joint in arm.joints)
    arm = dataclasses.replace(arm, joints=joints).with_clearance(name, Clearance(CLEARANCE))
    named = run.assign_coords(joint=[name if old == "A" else old for old in run["joint"].values.tolist()])
    scene = scene_of(named, arm, FRAMES, [name])
    text = page(scene, named, float(scene.time[-1] - scene.time[0]))
    assert "<b>" not in text
    assert data_of(text)["joints"][0]["name"] == name
    assert text.count("</script>") == 3
    assert "real time" in text


@pytest.mark.skipif(CHROMIUM is None, reason="no chromium on this machine: apt-get install chromium")
def test_browser_shows_a_frame(run: xr.Dataset, scene: Scene, tmp_path: Path) -> None:
    """Contract: a page opened at a frame shows its time and draws it without an error."""
    (tmp_path / "film.html").write_text(page(scene, run, 6.0), encoding="utf-8")
    flags = "--headless --no-sandbox --disable-gpu --no-first-run --disable-background-networking"
    flags += " --disable-component-update --disable-sync --virtual-time-budget=2000 --dump-dom"
    command = [str(CHROMIUM), *flags.split(), f"--user-data-dir={tmp_path / 'profile'}", f"file://{tmp_path}/film.html#3"]
    shown = subprocess.run(command, capture_output=True, text=True, check=True, timeout=120).stdout
    assert re.search(r"<output[^>]*>t = 37.5 ms</output>", shown)
    assert re.search(r'<canvas[^>]*data-frame="3"', shown)


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
def test_refused_films(run: xr.Dataset, arm: Mechanism, tmp_path: Path, name: str, options: dict, says: str) -> None:
    """Contract: wrong arguments give an error of one line, and no file."""
    with pytest.raises(InputError) as caught:
        animate(run, arm, tmp_path / name, **options)
    assert says in str(caught.value)
    assert not list(tmp_path.iterdir())


def test_runs_without_clearance_joints_and_short_ones(
    ideal: xr.Dataset, run: xr.Dataset, arm: Mechanism, tmp_path: Path
) -> None:
    """Limit: a film without clearance joints, of two samples, and of one sample, which is refused."""
    path = animate(ideal.isel(time=[0, -1]), mechanism_with(()), tmp_path / "film.html", seconds=2.0)
    film = data_of(path.read_text(encoding="utf-8"))
    assert (film["joints"], floats(film["time"]).size, film["seconds"]) == ([], 2, 2.0)
    with pytest.raises(InputError, match="fewer than two samples"):
        animate(run.isel(time=[0]), arm, tmp_path / "short.html")


def test_page_shows_all_clearance_joints(tmp_path: Path) -> None:
    """Contract: every clearance joint has a ring and a magnified view, the chosen ones first."""
    names = ("unit 1/pivot", "A")
    many, mechanism = made_up(names), mechanism_with(names)
    film = data_of(animate(many, mechanism, tmp_path / "film.html", seconds=1.0).read_text(encoding="utf-8"))
    assert {joint["name"] for joint in film["joints"]} == set(names)
    chosen = animate(many, mechanism, tmp_path / "one.html", seconds=1.0, joints=["A"]).read_text(encoding="utf-8")
    assert [joint["name"] for joint in data_of(chosen)["joints"]] == ["A", "unit 1/pivot"]


def test_film_names_its_joints_and_counts_the_others() -> None:
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


def test_notebook_shows_the_scene_of_a_run() -> None:
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


GUIDE_CLEARANCE, WIDTH = 1e-4, 0.02


def magnified(run: xr.Dataset, mechanism: Mechanism, sample: int, joint: str) -> Axes:
    """Return the panel of a joint in a film that begins at one sample."""
    guides = [guide.name for guide in mechanism.guides if guide.name == joint]
    film = Film(
        scene_of(run, mechanism, np.array([sample, -1]), [joint] if not guides else [], guides=guides, between=False), 1.0
    )
    return film.panels[0]


def test_positions_of_bars(run: xr.Dataset, arm: Mechanism) -> None:
    """Closed form: bar 1 goes from the origin to L (cos th, sin th), bar 2 from the slider to its mirror image."""
    axes = structure(run, arm, times=[0.025])[0]
    theta = math.pi / 6 + 5.0 * math.pi * 0.025
    tip = 2.0 * np.array([math.cos(theta), math.sin(theta)])
    first, second = [np.array(line.get_xydata()) for line in axes.lines if line.get_color() in BAR_FILLS][:2]
    np.testing.assert_allclose(first, [(0.0, 0.0), tip], atol=1e-12)
    np.testing.assert_allclose(second, [(0.0, tip[1]), (tip[0], 0.0)], atol=1e-12)
    assert axes.get_title(loc="left") == "t = 25 ms"
    assert [text.get_text() for text in axes.texts] == ["0.5 m", "A"]
    assert len(axes.patches) == 3  # slider, and the two parts of the ground pin


def test_turned_frame(run: xr.Dataset, arm: Mechanism) -> None:
    """Closed form: a quarter turn of a body rotates its points about its mass centre."""
    placed = Placement.at(arm, run, [0])
    turned = placed.angles.copy()
    turned[:, placed.index["unit 1/bar 1"]] = math.pi / 2
    quarter = dataclasses.replace(placed, angles=turned)
    middle = placed.centre("unit 1/bar 1")
    np.testing.assert_allclose(quarter.place(("unit 1/bar 1", "end")), np.add(middle, [[0.0, 1.0]]), atol=1e-15)
    aside = quarter.points("unit 1/bar 1", np.array([[1.0, 0.5]]))
    np.testing.assert_allclose(aside, [np.add(middle, [[-0.5, 0.0]])], atol=1e-15)
    np.testing.assert_array_equal(quarter.place(("ground", "origin")), [[0.0, 0.0]])


def test_outlines() -> None:
    """Contract: a bar is the line between its extreme points, a bent body a polygon, a point mass a point."""
    np.testing.assert_array_equal(outline(bar("b", length=2.0, mass=1.0)), [[0.0, 0.0], [2.0, 0.0]])
    np.testing.assert_array_equal(outline(point_mass("p", mass=1.0)), [[0.0, 0.0]])
    bent = Body("k", 1.0, 1.0, {"a": (0.0, 0.0), "c": (2.0, 0.0), "b": (1.0, 0.5), "d": (1.0, -0.5)})
    corners = outline(bent).tolist()
    start = corners.index([0.0, 0.0])
    assert corners[start:] + corners[:start] == [[0.0, 0.0], [1.0, -0.5], [2.0, 0.0], [1.0, 0.5]]


def test_magnified_joint(run: xr.Dataset, arm: Mechanism) -> None:
    """Closed form: in units of R_J the clearance is 0.35, so that a journal in contact overlaps the bearing by delta only."""
    sample = int(np.argmax(run["normal_force"].sel(joint="A").values))
    axes = magnified(run, arm, sample, "A")
    bearing, journal = axes.patches
    away = math.hypot(*journal.center)
    assert bearing.radius == 1.0 + SIZES.magnified_clearance
    assert away == pytest.approx(
        SIZES.magnified_clearance * (1.0 + run["indentation"].sel(joint="A").values[sample] / CLEARANCE), rel=1e-12
    )
    assert journal.get_edgecolor() == to_rgba(VERMILION)
    assert axes.get_xlabel() == "clearance magnified 7\ntimes"
    flying = magnified(run, arm, 0, "A")
    assert flying.patches[1].get_edgecolor() == to_rgba(SKY)
    with pytest.raises(InputError, match="joint 'O'"):
        structure(run, arm, joint="O")


def test_instants_are_numbered_on_the_orbit(run: xr.Dataset, arm: Mechanism) -> None:
    """Contract: each number's mark is at the journal's place at its instant, and a turned picture turns it with the bars."""
    samples = [100, 900, 1700]
    drawn = structure(run, arm, times=[float(run["time"][k]) for k in samples])
    assert [axes.get_title(loc="left")[:2] for axes in drawn[:3]] == ["1:", "2:", "3:"]
    marks = [line.get_xydata()[0] for line in drawn[3].lines if line.get_zorder() == 5.0]
    place = 1e3 * run["eccentricity"].sel(joint="A").values[samples]
    directions = [np.arctan2(*mark) for mark in marks]
    np.testing.assert_allclose(np.sort(directions), np.sort(np.arctan2(*place.T)), atol=1e-12)
    assert {text.get_text() for text in drawn[3].texts} >= {"1", "2", "3"}
    upwards = dataclasses.replace(arm, gravity=9.81, gravity_direction=math.pi)
    turned = [line.get_xydata()[0] for line in structure(run, upwards, times=[0.001])[1].lines if line.get_label() == "start"]
    first = 1e3 * run["eccentricity"].sel(joint="A").values[0]
    np.testing.assert_allclose(turned, [[-first[1], first[0]]], atol=1e-12)
    assert "x ↑, y ←" in structure(run, upwards, times=1)[0].texts[0].get_text()


@pytest.mark.parametrize("joint", ["A", None])
def test_rings_of_stills_show_contact(run: xr.Dataset, arm: Mechanism, joint: str | None) -> None:
    """Contract: the ring of a joint in a still has the colour of `in_contact` at its sample."""
    touched = run["in_contact"].sel(joint="A").values.astype(bool)
    samples = [int(np.argmax(touched)), int(np.argmin(touched))]
    drawn = structure(run, arm, joint=joint, times=[float(run["time"][k]) for k in samples])
    stills = [axes for axes in drawn if "t =" in axes.get_title(loc="left")]
    rings = [
        line.get_color() for axes in stills for line in axes.lines if line.get_markersize() > 5.0 and line.get_zorder() == 5.0
    ]
    assert touched[samples].tolist() == [True, False]
    assert rings == [VERMILION, SKY]


def test_structure_at_chosen_instants(two_joints: xr.Dataset) -> None:
    """Contract: one panel per instant and clearance joint, with the same axes for all structures."""
    drawn = structure(two_joints, mechanism_with(tuple(CLEARANCE_JOINTS)), times=[0.0, 0.0300004])
    assert [axes.get_title(loc="left") for axes in drawn[:2]] == ["1: t = 0 ms", "2: t = 30 ms"]
    assert len(drawn) == 4
    assert drawn[0].get_xlim() == drawn[1].get_xlim()
    with pytest.raises(InputError, match="times"):
        structure(two_joints, mechanism_with(tuple(CLEARANCE_JOINTS)), times=0)


def test_stills_name_the_joints_that_they_magnify() -> None:
    """Contract: the clearance joints with the largest forces are magnified and named, the others have a ring only."""
    arm = sd.scissor(units=4)
    names = [joint.name for joint in arm.joints]
    for name in names:
        arm = arm.with_clearance(name, Clearance(CLEARANCE))
    started = simulate(arm.driven(speed=1.0), until=1e-4, samples=2)
    drawn = structure(started, arm, times=1)
    titles = [axes.get_title().replace("joint ", "").split("\n")[0] for axes in drawn[1:]]
    shown = {text.get_text() for text in drawn[0].texts if text.get_text()}
    assert len(titles) == LISTED_MAX
    assert shown & set(names) == set(titles)
    figure = drawn[0].get_figure(root=True)
    assert figure.get_supxlabel() == f"{len(names) - LISTED_MAX} more clearance joints with smaller forces"


def test_height_of_wide_structures() -> None:
    """Contract: structures of six and twenty units are at least 0.7 in high, with titles inside the figure."""
    for units in (6, 20):
        arm = sd.scissor(units=units, bar_length=2.0, bar_mass=5.68, slider_mass=5.0, angle=math.radians(30.0))
        arm = arm.with_clearance("all", Clearance(5e-4))
        drawn = structure(simulate(arm, until=1e-4, samples=2), arm, times=2)
        figure = drawn[0].get_figure(root=True)
        figure.draw_without_rendering()
        assert drawn[0].bbox.height > 0.7 * figure.dpi
        assert max(axes.title.get_window_extent().y1 for axes in drawn) <= figure.bbox.y1 + 1.0


@pytest.fixture(scope="module")
def linkage() -> Mechanism:
    """Return a slider-crank at rest whose slider falls on the lower guide surface."""
    linkage = sd.slider_crank(slider_inertia=2e-5, gravity=9.81, angle=0.5).driven(speed=0.1)
    return linkage.with_clearance("guide", GuideClearance(GUIDE_CLEARANCE, 0.04, WIDTH, stiffness=Linear(1e6)))


@pytest.fixture(scope="module")
def fallen(linkage: Mechanism) -> xr.Dataset:
    return simulate(linkage, until=0.05, samples=501)


def test_corners_reach_the_guide_surfaces_in_contact(fallen: xr.Dataset, linkage: Mechanism) -> None:
    """Closed form: in units of W/2 the surfaces are at 1.35, and each drawn corner is 0.35 delta/c beyond its surface."""
    below = fallen["indentation"].sel(joint="guide/corner 1")
    sample = int(np.argmax(below.values))
    axes = magnified(fallen, linkage, sample, "guide")
    right, left = sorted(float(line.get_ydata()[0]) for line in axes.lines if line.get_linestyle() == "-")
    assert (right, left) == (pytest.approx(-1.0 - SIZES.magnified_clearance), pytest.approx(1.0 + SIZES.magnified_clearance))
    block = axes.patches[-1]
    tips = block.get_xy()[:4]
    for number, side in ((1, -1), (2, -1), (3, 1), (4, 1)):
        delta = float(fallen["indentation"].sel(joint=f"guide/corner {number}").values[sample])
        wanted = side * (1.0 + SIZES.magnified_clearance + SIZES.magnified_clearance * delta / GUIDE_CLEARANCE)
        assert np.min(np.abs(tips[:, 1] - wanted)) < 1e-12
    assert block.get_edgecolor() == to_rgba(VERMILION)
    gain = SIZES.magnified_clearance * 0.5 * WIDTH / GUIDE_CLEARANCE
    assert axes.get_xlabel().replace("\n", " ") == f"clearance magnified {gain:.2g} times"


def test_panel_of_a_guide(fallen: xr.Dataset, linkage: Mechanism, tmp_path) -> None:
    """Contract: four corners share a panel; there is no orbit without a journal; an ideal guide is refused."""
    assert guides_for_contacts(linkage, ["guide/corner 2", "guide/corner 1", "slider pin"]) == ["guide", "slider pin"]
    assert len(structure(fallen, linkage, times=2)) == 3
    drawn = draw_all(fallen, None, tmp_path, linkage)
    assert [path.stem for path in drawn] == ["response", "force", "torque", "energy", "structure"]
    with pytest.raises(InputError, match="without clearance joints"):
        orbit(fallen)
    with pytest.raises(InputError, match="'guide' is ideal"):
        scene_of(fallen, linkage.ideal(), np.array([0]), [], guides=["guide"])


def test_film_shows_the_channel_of_a_guide(fallen: xr.Dataset, linkage: Mechanism, tmp_path: Path) -> None:
    """Cross-check: block and contacts of each frame are those of the still and of the page."""
    frames = np.array([0, 150, 500])
    film = Film(scene_of(fallen, linkage, frames, [], guides=["guide"]), 1.0)
    stills = structure(fallen, linkage, times=fallen["time"].values[frames])[-1]
    outlines = [line.get_xydata() for line in stills.lines if line.get_zorder() == 2.5]
    for frame, outline_ in enumerate(outlines):
        film.show(frame)
        assert np.allclose(film.joints[0].block.get_xy(), outline_)
    assert len(outlines) == 3
    begins = [0, 1, 151]
    names = [point.name for point in linkage.contact_points]
    touched = np.logical_or.reduceat(fallen["in_contact"].sel(joint=names).values, begins).any(axis=1)
    view = film.scene.channels[0]
    assert view.touching.any(axis=1).tolist() == touched.tolist()
    peaks = fallen["peak_force"].values[(fallen["contact_start"] + fallen["peak_time"]).values > fallen["time"].values[150]]
    assert view.force[2] == max(float(fallen["normal_force"].sel(joint=names)[151:].max()), *peaks.tolist())
    text = animate(fallen, linkage, tmp_path / "film.html", seconds=1.0).read_text(encoding="utf-8")
    (drawn,) = data_of(text)["channels"]
    assert drawn["name"] == "guide"
    assert len(drawn["surfaces"]) == 2
    block = floats(drawn["block"]).reshape(-1, drawn["count"], 2)
    # the film begins and ends where the run does
    assert np.allclose(block[[0, -1]], film.scene.channels[0].block[[0, -1]], rtol=1e-6, atol=1e-9)


def test_ring_on_a_pole_is_hollow(linkage: Mechanism) -> None:
    """Contract: film and page do not fill a ring around a pole; a block in a channel is filled."""
    ring = GuideClearance(GUIDE_CLEARANCE, 0.04, WIDTH, stiffness=Linear(1e6), around=True)
    for mechanism, hollow in ((linkage, False), (linkage.ideal().with_clearance("guide", ring), True)):
        run = simulate(mechanism, until=1e-3, samples=3)
        scene = scene_of(run, mechanism, np.arange(3), [], guides=["guide"])
        assert (Film(scene, 1.0).joints[0].block.get_facecolor()[3] == 0.0) is hollow
        [drawn] = json.loads(pack_scene(scene, run))["channels"]
        assert drawn["hollow"] is hollow
        walls = block_walls(scene.channels[0], 0)
        assert len(walls) == (2 if hollow else 1)
        pole = max(scene.channels[0].surfaces.values())
        assert not hollow or all(np.all(np.abs(wall[:, 1]) > pole - 1e-9) for wall in walls)


def test_title_of_a_film_is_inside(fallen: xr.Dataset, linkage: Mechanism) -> None:
    """Contract: the title stays in the figure when equal scales move the panel after the first layout."""
    scene = scene_of(fallen, linkage, np.arange(3), [], guides=["guide"])
    for height in (0.8, 0.9, 1.0, 1.2):
        film = Film(dataclasses.replace(scene, low=np.array([0.0, 0.0]), high=np.array([1.0, height])), 1.0)
        title = film.axes._left_title.get_window_extent()
        assert title.y1 <= film.figure.bbox.height
