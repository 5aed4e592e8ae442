"""The first drawing of the explorer: before the page's libraries, and without kernels."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("panel", reason="the package panel is not installed")

import scissordyn as sd
from scissordyn.explore.case import FileCase, open_case
from scissordyn.explore.drag import assembled
from scissordyn.explore.early import declared, early_motion
from scissordyn.explore.first import FirstRun

from .browser import CASE, Tab, chromium, missing, served

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*.toml"))
GUESSED = {"four_bar": 0.2, "lift": 1e-4, "press": 1e-6}
"""Examples that declare a guess of the position of some bodies, and how good it is [m]."""


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_declared_position_is_the_assembled_one(path: Path) -> None:
    """Cross-check: bodies of every example are drawn where the solver assembles them, but where the case declares a guess."""
    mechanism = open_case(path).mechanism
    first = declared(mechanism.ideal())
    solved, _ = assembled(mechanism)
    apart = first["position"].values[0] - solved["position"].sel(body=first["body"]).transpose("time", "body", "axis").values[0]
    assert np.abs(apart).max() < GUESSED.get(path.stem, 1e-12)


def test_first_drawing_moves_with_ideal_joints(tmp_path: Path) -> None:
    """Identity: the scene of the motion is that of the run with ideal joints; that of a saved run is the run."""
    (tmp_path / "case.toml").write_text(CASE)
    case = open_case(tmp_path / "case.toml")
    scene = json.loads(early_motion(case))
    assert (scene["note"], scene["joints"]) == ("ideal joints", [])
    case.saved = sd.simulate(case.mechanism, until=case.options.until, samples=21)
    assert early_motion(case) == ""


def test_page_that_has_ordered_a_run_keeps_it() -> None:
    """Contract: the run of the opened case does not take the place of one that a page has asked for."""
    import tomllib

    case = FileCase("case.toml", CASE, Path(), tomllib.loads(CASE))
    first = FirstRun(lambda: case)
    first.read()
    worker = first.adopt(lambda outcome: None, lambda number, fraction: None)
    assert worker is not None
    number = worker.order(case.changed({"drive.speed": "120 rpm"}))
    first.order()
    assert worker.number == number
    worker.close()


@pytest.mark.skipif(bool(missing()), reason=missing())
def test_mechanism_is_drawn_before_the_page(tmp_path: Path) -> None:
    """Contract: the drawing is there before the page has its bar, moves, and gives way to the run in the same turn."""
    case = tmp_path / "case.toml"
    case.write_text(CASE)
    with served(case) as url, chromium() as browser:
        tab = Tab(browser, "")
        tab.page.goto(url, wait_until="commit")
        early = tab.page.wait_for_function(
            "() => document.querySelector('#sd-early canvas[data-drawn]') && !window.scissordynShown", timeout=60_000
        )
        assert early.json_value()
        tab.ready(0, 240.0)
        assert tab.page.locator("canvas[data-run]").count() == 1
        assert tab.page.locator("#sd-early").count() == 0
        tab.close()
