"""Magnified deflections in the explorer: what is asked for, the factor that is chosen, and the drawing in a browser."""

import numpy as np
import pytest

import scissordyn as sd
from scissordyn.equilibrium.deflection import magnified_deflection
from scissordyn.explore.answers import cards
from scissordyn.explore.case import open_case
from scissordyn.explore.drag import Drag
from scissordyn.explore.page import magnification_of, read_magnification
from scissordyn.record.summary import summary_of

from .browser import Tab, served

CASE = """
[structure]
kind = "scissor"
units = 1
bar_length = "1 m"
angle = "30 deg"
bars = { section = "tube 30x30x2 mm", material = "steel", modes = 2 }

[drive]
speed = "200 rpm"

[run]
until = "15 ms"
samples = 16
"""
"""Case file with flexible bars and ideal joints."""


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    """Return the path of the case file."""
    written = tmp_path_factory.mktemp("magnified") / "bends.toml"
    written.write_text(CASE)
    return written


@pytest.mark.parametrize("given", ["much", None, True, 0.5, float("nan"), float("inf"), [2.0]])
def test_wish_is_a_number_or_auto(given):
    """Bad input: what a page may ask for is "auto", or a number from 1 on."""
    assert (read_magnification("auto"), read_magnification(20)) == ("auto", 20.0)
    with pytest.raises(sd.InputError, match="magnification"):
        read_magnification(given)


def test_factor_of_auto_shows_the_largest_deflection(path):
    """Contract: "auto" is 1, 2 or 5 times a power of ten; the largest deflection is then a 50th to a 20th of the mechanism."""
    case = sd.read_case(path)
    run = sd.simulate(case.mechanism, until=case.run.until, samples=case.run.samples)
    factor = magnification_of("auto", run, case.mechanism)
    assert f"{factor:e}"[0] in "125"
    assert float(f"{factor:.0e}") == factor
    shown = factor * float(abs(run["bar_largest_deflection"]).max()) / case.mechanism.size
    assert 0.02 * (1.0 - 1e-9) <= shown <= 0.05 * (1.0 + 1e-9)
    assert magnification_of(7.0, run, case.mechanism) == 7.0
    assert magnification_of("auto", run, sd.scissor(units=1)) == 1.0
    (card,) = (card for card in cards(summary_of(run)) if card["title"] == "largest stress")
    assert "of yield strength" in card["detail"]


def test_joints_of_bent_bars_are_dragged_and_their_lengths_not(path):
    """Contract: a joint of bars that bend moves with the numbers of the case; a cross-section has no length."""
    case = open_case(path)
    drag = Drag(case, "pin", "unit 1/pivot")
    drag.move_target(0.01, 0.02)
    assert drag.note.startswith("bar length 1.03")
    with pytest.raises(sd.InputError, match="'unit 1/bar 1' has no length to drag"):
        Drag(case, "length", "unit 1/bar 1")


def test_page_draws_bars_bent_and_magnified(browser, path):
    """Cross-check: the shapes on the canvas are those of `magnified_deflection` and change with a section."""
    case = sd.read_case(path)
    run = sd.simulate(case.mechanism, until=case.run.until, samples=case.run.samples)
    factor = magnification_of("auto", run, case.mechanism)
    script = "() => JSON.parse(window.scissordyn.shown.scene)"
    with served(path) as url:
        tab = Tab(browser, url)
        first = tab.run
        canvas = tab.page.locator("#sd-canvas canvas")
        plain = tab.page.evaluate(script)
        assert (canvas.get_attribute("data-magnified"), plain["magnification"]) == ("1", 1.0)
        assert max(shape["count"] for shape in plain["shapes"] if shape["kind"] == "bar") > 5
        tab.page.locator("select[data-id=magnify]").select_option("auto")
        tab.page.locator(f"canvas[data-magnified='{factor:g}']").wait_for(timeout=1e3 * tab.patience)
        drawn = tab.page.evaluate(script)
        assert drawn["magnification"] == factor
        assert _points(drawn) == pytest.approx(_expected(run, case.mechanism, factor), abs=1e-6)
        assert np.abs(_points(drawn) - _points(plain)).max() > 10.0 * float(abs(run["bar_largest_deflection"]).max())
        before = tab.curve("stress")
        tab.type("structure.bars.section", "tube 20x20x2 mm")
        assert tab.ready(first) > first
        assert tab.curve("stress") != before
        tab.page.wait_for_function(
            "run => { const at = JSON.parse(window.scissordyn.shown.scene); return at.run > run && at.magnification > 1; }",
            arg=first,
            timeout=1e3 * tab.patience,
        )
        tab.page.locator("select[data-id=magnify]").select_option("1")
        tab.page.locator("canvas[data-magnified='1']").wait_for(timeout=1e3 * tab.patience)
        tab.close()


def _points(scene):
    """Return all points of bars of a scene."""
    import base64

    bars = [shape for shape in scene["shapes"] if shape["kind"] == "bar"]
    return np.concatenate([np.frombuffer(base64.b64decode(bar["points"]), np.float32) for bar in bars])


def _expected(run, mechanism, factor):
    from scissordyn.plot.animation_scene import scene_of

    frames = np.arange(run.sizes["time"])
    scene = scene_of(magnified_deflection(run, mechanism, factor), mechanism, frames, [])
    return np.concatenate([shape.points.ravel() for shape in scene.shapes if shape.kind == "bar"])
