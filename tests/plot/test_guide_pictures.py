"""Stills and films of guides with clearance: their channel, the corners of the block and its contacts."""

import dataclasses
import json

import numpy as np
import pytest
from matplotlib.colors import to_rgba

import scissordyn as sd
from scissordyn.laws.elastic.linear import Linear
from scissordyn.plot.animation import Film
from scissordyn.plot.animation_scene import guides_for_contacts, scene_of
from scissordyn.plot.canvas import pack_scene
from scissordyn.plot.drawing import block_walls
from scissordyn.plot.joint import orbit
from scissordyn.plot.report import draw_all
from scissordyn.plot.still import structure
from scissordyn.plot.style import SIZES, VERMILION

from .made_up import data_of, floats, magnified

GUIDE_CLEARANCE, WIDTH = 1e-4, 0.02  # Clearance and width of the block of a clearance guide [m]


@pytest.fixture(scope="module")
def linkage():
    """Return a slider-crank at rest whose slider falls on the lower guide surface."""
    linkage = sd.slider_crank(slider_inertia=2e-5, gravity=9.81, angle=0.5).driven(speed=0.1)
    return linkage.with_clearance("guide", sd.GuideClearance(GUIDE_CLEARANCE, 0.04, WIDTH, stiffness=Linear(1e6)))


@pytest.fixture(scope="module")
def fallen(linkage):
    return sd.simulate(linkage, until=0.05, samples=501)


def test_corners_reach_the_guide_surfaces_in_contact(fallen, linkage):
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


def test_panel_of_a_guide(fallen, linkage, tmp_path):
    """Contract: four corners share a panel; there is no orbit without a journal; an ideal guide is refused."""
    assert guides_for_contacts(linkage, ["guide/corner 2", "guide/corner 1", "slider pin"]) == ["guide", "slider pin"]
    assert len(structure(fallen, linkage, times=2)) == 3
    drawn = draw_all(fallen, None, tmp_path, linkage)
    assert [path.stem for path in drawn] == ["response", "force", "torque", "energy", "structure"]
    with pytest.raises(sd.InputError, match="without clearance joints"):
        orbit(fallen)
    with pytest.raises(sd.InputError, match="'guide' is ideal"):
        scene_of(fallen, linkage.ideal(), np.array([0]), [], guides=["guide"])


def test_film_shows_the_channel_of_a_guide(fallen, linkage, tmp_path):
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
    text = sd.animate(fallen, linkage, tmp_path / "film.html", seconds=1.0).read_text(encoding="utf-8")
    (drawn,) = data_of(text)["channels"]
    assert drawn["name"] == "guide"
    assert len(drawn["surfaces"]) == 2
    block = floats(drawn["block"]).reshape(-1, drawn["count"], 2)
    # the film begins and ends where the run does
    assert np.allclose(block[[0, -1]], film.scene.channels[0].block[[0, -1]], rtol=1e-6, atol=1e-9)


def test_ring_on_a_pole_is_hollow(linkage):
    """Contract: film and page do not fill a ring around a pole; a block in a channel is filled."""
    ring = sd.GuideClearance(GUIDE_CLEARANCE, 0.04, WIDTH, stiffness=Linear(1e6), around=True)
    for mechanism, hollow in ((linkage, False), (linkage.ideal().with_clearance("guide", ring), True)):
        run = sd.simulate(mechanism, until=1e-3, samples=3)
        scene = scene_of(run, mechanism, np.arange(3), [], guides=["guide"])
        assert (Film(scene, 1.0).joints[0].block.get_facecolor()[3] == 0.0) is hollow
        [drawn] = json.loads(pack_scene(scene, run))["channels"]
        assert drawn["hollow"] is hollow
        walls = block_walls(scene.channels[0], 0)
        assert len(walls) == (2 if hollow else 1)
        pole = max(scene.channels[0].surfaces.values())
        assert not hollow or all(np.all(np.abs(wall[:, 1]) > pole - 1e-9) for wall in walls)


def test_title_of_a_film_is_inside(fallen, linkage):
    """Contract: the title stays in the figure when equal scales move the panel after the first layout."""
    scene = scene_of(fallen, linkage, np.arange(3), [], guides=["guide"])
    for height in (0.8, 0.9, 1.0, 1.2):
        film = Film(dataclasses.replace(scene, low=np.array([0.0, 0.0]), high=np.array([1.0, height])), 1.0)
        title = film.axes._left_title.get_window_extent()
        assert title.y1 <= film.figure.bbox.height
