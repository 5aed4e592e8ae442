"""Stills and films of the structure: bodies where they are, clearance joints and the channels of guides magnified."""

import base64
import dataclasses
import json
import math
import re
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba

from scissordyn.errors import InputError
from scissordyn.laws.elastic.linear import Linear
from scissordyn.model.body import Body, bar, point_mass
from scissordyn.model.clearance import Clearance, GuideClearance
from scissordyn.model.linkage import slider_crank
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.scissor import scissor
from scissordyn.plot.animation import Film, animate
from scissordyn.plot.animation_scene import GAP, guides_of, outline, scene_of
from scissordyn.plot.canvas import packed
from scissordyn.plot.joint import orbit
from scissordyn.plot.report import draw_all
from scissordyn.plot.series import MOST_JOINTS
from scissordyn.plot.still import structure
from scissordyn.plot.style import BLUE, GREEN, SKY, VERMILION
from scissordyn.run.answer.placement import Placement
from scissordyn.run.simulate import simulate

from .made_up import CLEARANCE, CLEARANCE_JOINTS, mechanism_with

GUIDE_CLEARANCE, WIDTH = 1e-4, 0.02


def magnified(run: xr.Dataset, mechanism: Mechanism, sample: int, joint: str) -> Axes:
    """The panel of a joint in a still of one sample."""
    return structure(run, mechanism, joint=joint, times=[float(run["time"][sample])])[1]


def test_bars_are_drawn_where_they_are(run: xr.Dataset, arm: Mechanism) -> None:
    """Closed form: at angle th bar 1 goes from the origin to L (cos th, sin th), bar 2 from the slider to its mirror image."""
    axes = structure(run, arm, times=[0.025])[0]
    theta = math.pi / 6 + 5.0 * math.pi * 0.025
    tip = 2.0 * np.array([math.cos(theta), math.sin(theta)])
    first, second = [np.array(line.get_xydata()) for line in axes.lines if line.get_color() in (BLUE, GREEN)][:2]
    np.testing.assert_allclose(first, [(0.0, 0.0), tip], atol=1e-12)
    np.testing.assert_allclose(second, [(0.0, tip[1]), (tip[0], 0.0)], atol=1e-12)
    assert axes.get_title(loc="left") == "t = 25 ms"
    assert [text.get_text() for text in axes.texts] == ["A"]
    assert len(axes.patches) == 3  # slider, and the two parts of the ground pin


def test_turned_frame(run: xr.Dataset, arm: Mechanism) -> None:
    """Closed form: a body turned by a quarter rotates its points by a quarter revolution about its mass centre."""
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
    """Identity: a bar is the line between its extreme points, a bent body the polygon of its points, a point mass a point."""
    np.testing.assert_array_equal(outline(bar("b", length=2.0, mass=1.0)), [[0.0, 0.0], [2.0, 0.0]])
    np.testing.assert_array_equal(outline(point_mass("p", mass=1.0)), [[0.0, 0.0]])
    bent = Body("k", 1.0, 1.0, {"a": (0.0, 0.0), "c": (2.0, 0.0), "b": (1.0, 0.5), "d": (1.0, -0.5)})
    corners = outline(bent).tolist()
    start = corners.index([0.0, 0.0])
    assert corners[start:] + corners[:start] == [[0.0, 0.0], [1.0, -0.5], [2.0, 0.0], [1.0, 0.5]]


def test_magnified_joint(run: xr.Dataset, arm: Mechanism) -> None:
    """Closed form: in units of R_J the clearance is 0.35, so a journal in contact overlaps the bearing by delta only."""
    sample = int(np.argmax(run["normal_force"].sel(joint="A").values))
    axes = magnified(run, arm, sample, "A")
    bearing, journal = axes.patches
    away = math.hypot(*journal.center)
    assert bearing.radius == 1.0 + GAP
    assert away == pytest.approx(GAP * (1.0 + run["indentation"].sel(joint="A").values[sample] / CLEARANCE), rel=1e-12)
    assert journal.get_edgecolor() == to_rgba(VERMILION)
    assert axes.get_title() == "A: contact\nclearance magnified 7 times"
    flying = magnified(run, arm, 0, "A")
    assert flying.patches[1].get_edgecolor() == to_rgba(SKY)
    with pytest.raises(InputError, match="joint 'O'"):
        magnified(run, arm, 0, "O")


@pytest.mark.parametrize("joint", ["A", None])
def test_rings_say_contact_or_flight(run: xr.Dataset, arm: Mechanism, joint: str | None) -> None:
    """Invariant: the ring of a joint in a still has the colour that `in_contact` of its sample says."""
    touched = run["in_contact"].sel(joint="A").values.astype(bool)
    samples = [int(np.argmax(touched)), int(np.argmin(touched))]
    drawn = structure(run, arm, joint=joint, times=[float(run["time"][k]) for k in samples])
    stills = [axes for axes in drawn if axes.get_title(loc="left").startswith("t =")]
    rings = [
        line.get_color() for axes in stills for line in axes.lines if line.get_markersize() > 5.0 and line.get_zorder() == 5.0
    ]
    assert touched[samples].tolist() == [True, False]
    assert rings == [VERMILION, SKY]


def test_structure_at_chosen_instants(two_joints: xr.Dataset) -> None:
    """Contract: a panel per instant and per clearance joint, all structures on the same axes."""
    drawn = structure(two_joints, mechanism_with(tuple(CLEARANCE_JOINTS)), times=[0.0, 0.0300004])
    assert [axes.get_title(loc="left") for axes in (drawn[0], drawn[3])] == ["t = 0 ms", "t = 30 ms"]
    assert len(drawn) == 6
    assert drawn[0].get_xlim() == drawn[3].get_xlim()
    with pytest.raises(InputError, match="times"):
        structure(two_joints, mechanism_with(tuple(CLEARANCE_JOINTS)), times=0)


def test_stills_name_the_joints_that_they_magnify() -> None:
    """Contract: of many clearance joints those with the largest forces are magnified and named, the others only ringed."""
    arm = scissor(units=4)
    names = [joint.name for joint in arm.joints]
    for name in names:
        arm = arm.with_clearance(name, Clearance(CLEARANCE))
    started = simulate(arm.driven(speed=1.0), until=1e-4, samples=2)
    drawn = structure(started, arm, times=1)
    titles = [axes.get_title().split(":")[0] for axes in drawn[1:]]
    shown = {text.get_text() for text in drawn[0].texts if text.get_text()}
    assert len(titles) == MOST_JOINTS
    assert shown & set(names) == set(titles)
    figure = drawn[0].get_figure(root=True)
    assert figure.get_supxlabel() == f"{len(names) - MOST_JOINTS} more clearance joints with smaller forces"


def test_wide_structure_has_room_beside_its_joints() -> None:
    """Limit: of six and of twenty units the structure is drawn at least 0.7 in high, and each title within the figure."""
    for units in (6, 20):
        arm = scissor(units=units, bar_length=2.0, bar_mass=5.68, slider_mass=5.0, angle=math.radians(30.0))
        arm = arm.with_clearance("all", Clearance(5e-4))
        drawn = structure(simulate(arm, until=1e-4, samples=2), arm, times=2)
        figure = drawn[0].get_figure(root=True)
        figure.draw_without_rendering()
        assert drawn[0].bbox.height > 0.7 * figure.dpi
        assert max(axes.title.get_window_extent().y1 for axes in drawn) <= figure.bbox.y1 + 1.0


@pytest.fixture(scope="module")
def linkage() -> Mechanism:
    """A slider-crank at rest whose slider falls on the lower guide surface."""
    linkage = slider_crank(slider_inertia=2e-5, gravity=9.81, angle=0.5).driven(speed=0.1)
    return linkage.with_clearance("guide", GuideClearance(GUIDE_CLEARANCE, 0.04, WIDTH, stiffness=Linear(1e6)))


@pytest.fixture(scope="module")
def fallen(linkage: Mechanism) -> xr.Dataset:
    return simulate(linkage, until=0.05, samples=501)


def test_corners_reach_the_guide_surfaces_in_contact(fallen: xr.Dataset, linkage: Mechanism) -> None:
    """Closed form: in units of W/2 the surfaces are at 1.35, and each drawn corner is beyond its surface by 0.35 delta/c."""
    below = fallen["indentation"].sel(joint="guide/corner 1")
    sample = int(np.argmax(below.values))
    axes = magnified(fallen, linkage, sample, "guide/corner 1")
    right, left = sorted(float(line.get_ydata()[0]) for line in axes.lines if line.get_linestyle() == "-")
    assert (right, left) == (pytest.approx(-1.0 - GAP), pytest.approx(1.0 + GAP))
    block = axes.patches[-1]
    tips = block.get_xy()[:4]
    for number, side in ((1, -1), (2, -1), (3, 1), (4, 1)):
        delta = float(fallen["indentation"].sel(joint=f"guide/corner {number}").values[sample])
        wanted = side * (1.0 + GAP + GAP * delta / GUIDE_CLEARANCE)
        assert np.min(np.abs(tips[:, 1] - wanted)) < 1e-12
    assert block.get_edgecolor() == to_rgba(VERMILION)
    assert "in contact" in axes.get_title()
    assert axes.get_title().endswith(f"clearance magnified {GAP * 0.5 * WIDTH / GUIDE_CLEARANCE:.2g} times")


def test_a_guide_is_one_panel(fallen: xr.Dataset, linkage: Mechanism, tmp_path) -> None:
    """Contract: four corners make one panel; there is no orbit without a journal; an ideal guide is refused."""
    assert guides_of(linkage, ["guide/corner 2", "guide/corner 1", "slider pin"]) == ["guide", "slider pin"]
    assert len(structure(fallen, linkage, times=2)) == 4
    drawn = draw_all(fallen, None, tmp_path, linkage)
    assert [path.stem for path in drawn] == ["response", "force", "torque", "energy", "structure"]
    with pytest.raises(InputError, match="without clearance joints"):
        orbit(fallen)
    with pytest.raises(InputError, match="'guide' is ideal"):
        scene_of(fallen, linkage.ideal(), np.array([0]), [], guides=["guide"])


def test_film_shows_the_channel_of_a_guide(fallen: xr.Dataset, linkage: Mechanism, tmp_path: Path) -> None:
    """Cross-check: block and contacts of each frame are those of the still, and a page has the same."""
    frames = np.array([0, 150, 500])
    film = Film(scene_of(fallen, linkage, frames, [], guides=["guide"]), 1.0)
    for frame, sample in enumerate(frames):
        film.show(frame)
        still = magnified(fallen, linkage, int(sample), "guide/corner 1")
        assert np.allclose(film.joints[0].block.get_xy(), still.patches[-1].get_xy())
    begins = [0, 1, 151]
    names = [point.name for point in linkage.contact_points]
    touched = np.logical_or.reduceat(fallen["in_contact"].sel(joint=names).values, begins).any(axis=1)
    view = film.scene.channels[0]
    assert view.touching.any(axis=1).tolist() == touched.tolist()
    peaks = fallen["peak_force"].values[(fallen["contact_start"] + fallen["peak_time"]).values > fallen["time"].values[150]]
    assert view.force[2] == max(float(fallen["normal_force"].sel(joint=names)[151:].max()), *peaks.tolist())
    text = animate(fallen, linkage, tmp_path / "film.html", seconds=1.0).read_text(encoding="utf-8")
    found = re.search('<script type="application/json" id="scene">(.*?)</script>', text, re.DOTALL)
    (drawn,) = json.loads(found[1])["channels"]
    assert drawn["name"] == "guide"
    assert len(drawn["surfaces"]) == 2
    block = np.frombuffer(base64.b64decode(drawn["block"]), np.float32).reshape(-1, drawn["count"], 2)
    # the film begins and ends where the run does
    assert np.allclose(block[[0, -1]], film.scene.channels[0].block[[0, -1]], rtol=1e-6, atol=1e-9)


def test_a_ring_on_a_pole_is_hollow(linkage: Mechanism) -> None:
    """Contract: film and page leave the pole inside a ring to be seen; a block in a channel is filled."""
    ring = GuideClearance(GUIDE_CLEARANCE, 0.04, WIDTH, stiffness=Linear(1e6), around=True)
    for mechanism, hollow in ((linkage, False), (linkage.ideal().with_clearance("guide", ring), True)):
        run = simulate(mechanism, until=1e-3, samples=3)
        scene = scene_of(run, mechanism, np.arange(3), [], guides=["guide"])
        assert (Film(scene, 1.0).joints[0].block.get_facecolor()[3] == 0.0) is hollow
        [drawn] = json.loads(packed(scene, run))["channels"]
        assert drawn["hollow"] is hollow


def test_the_time_above_a_film_is_inside_it(fallen: xr.Dataset, linkage: Mechanism) -> None:
    """Contract: equal scales move the panel after the first layout; the text above it stays in the figure."""
    scene = scene_of(fallen, linkage, np.arange(3), [], guides=["guide"])
    for height in (0.8, 0.9, 1.0, 1.2):
        film = Film(dataclasses.replace(scene, low=np.array([0.0, 0.0]), high=np.array([1.0, height])), 1.0)
        title = film.axes._left_title.get_window_extent()
        assert title.y1 <= film.figure.bbox.height
