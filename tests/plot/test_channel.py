"""The block of a clearance guide in its magnified channel, on a real run."""

import base64
import dataclasses
import json
import re
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure

from scissordyn.errors import InputError
from scissordyn.laws.elastic.linear import Linear
from scissordyn.model.guide_clearance import GuideClearance
from scissordyn.model.linkage import slider_crank
from scissordyn.model.mechanism import Mechanism
from scissordyn.plot.animation import Film, animate
from scissordyn.plot.animation_scene import GAP, channel_of, guides_of, scene_of
from scissordyn.plot.canvas import packed
from scissordyn.plot.joint import orbit
from scissordyn.plot.report import draw_all
from scissordyn.plot.still import magnified, structure
from scissordyn.plot.style import VERMILION
from scissordyn.run.simulate import simulate

CLEARANCE, WIDTH = 1e-4, 0.02


@pytest.fixture(scope="module")
def linkage() -> Mechanism:
    """A slider-crank at rest whose slider falls on the lower guide surface."""
    linkage = slider_crank(slider_inertia=2e-5, gravity=9.81, angle=0.5).driven(speed=0.1)
    return linkage.with_clearance("guide", GuideClearance(CLEARANCE, 0.04, WIDTH, stiffness=Linear(1e6)))


@pytest.fixture(scope="module")
def fallen(linkage: Mechanism) -> xr.Dataset:
    return simulate(linkage, until=0.05, samples=501)


def test_corners_reach_the_guide_surfaces_in_contact(fallen: xr.Dataset, linkage: Mechanism) -> None:
    """Closed form: in units of W/2 the surfaces are at 1.35, and each drawn corner is beyond its surface by 0.35 delta/c."""
    below = fallen["indentation"].sel(joint="guide/corner 1")
    sample = int(np.argmax(below.values))
    axes = magnified(fallen, linkage, sample, "guide", axes=Figure().subplots())
    right, left = sorted(float(line.get_ydata()[0]) for line in axes.lines if line.get_linestyle() == "-")
    assert (right, left) == (pytest.approx(-1.0 - GAP), pytest.approx(1.0 + GAP))
    block = axes.patches[-1]
    tips = block.get_xy()[:4]
    for number, side in ((1, -1), (2, -1), (3, 1), (4, 1)):
        delta = float(fallen["indentation"].sel(joint=f"guide/corner {number}").values[sample])
        wanted = side * (1.0 + GAP + GAP * delta / CLEARANCE)
        assert np.min(np.abs(tips[:, 1] - wanted)) < 1e-12
    assert block.get_edgecolor() == to_rgba(VERMILION)
    assert "in contact" in axes.get_title()
    assert axes.get_title().endswith(f"clearance magnified {GAP * 0.5 * WIDTH / CLEARANCE:.2g} times")


def test_a_guide_is_one_panel(fallen: xr.Dataset, linkage: Mechanism, tmp_path) -> None:
    """Contract: four corners make one panel; there is no orbit without a journal; an ideal guide is refused."""
    assert guides_of(linkage, ["guide/corner 2", "guide/corner 1", "slider pin"]) == ["guide", "slider pin"]
    assert len(structure(fallen, linkage, times=2)) == 4
    drawn = draw_all(fallen, None, tmp_path, linkage)
    assert [path.stem for path in drawn] == ["response", "force", "torque", "energy", "structure"]
    with pytest.raises(InputError, match="without clearance joints"):
        orbit(fallen)
    with pytest.raises(InputError, match="'guide' is ideal"):
        channel_of(fallen, linkage.ideal(), [0], "guide")


def test_film_shows_the_channel_of_a_guide(fallen: xr.Dataset, linkage: Mechanism, tmp_path: Path) -> None:
    """Cross-check: block and contacts of each frame are those of the still, and a page has the same."""
    frames = np.array([0, 150, 500])
    film = Film(scene_of(fallen, linkage, frames, [], guides=["guide"]), 1.0)
    for frame, sample in enumerate(frames):
        film.show(frame)
        still = magnified(fallen, linkage, int(sample), "guide", axes=Figure().subplots())
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
    ring = GuideClearance(CLEARANCE, 0.04, WIDTH, stiffness=Linear(1e6), around=True)
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
