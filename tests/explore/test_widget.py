"""The canvas as notebooks show it, an anywidget without a page around it, in Chromium."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

pytest.importorskip("anywidget", reason="the package anywidget is not installed")

import scissordyn as sd
from scissordyn.config.file import read_case

from .browser import CASE, chromium, missing

pytestmark = pytest.mark.skipif(bool(missing()), reason=missing())

MODEL = """async ([code, values]) => {
  const { default: widget } = await import(URL.createObjectURL(new Blob([code], { type: "text/javascript" })));
  window.sent = [];
  const heard = {};
  const model = {
    get: name => values[name], on: (name, reaction) => { heard[name] = reaction; }, save_changes: () => {},
    set: (name, value) => { values[name] = value; (heard[`change:${name}`] || (() => {}))(); },
    send: message => window.sent.push(message),
  };
  window.model = model;
  widget.render({ model, el: document.getElementById("output") });
}"""
"""What a notebook does with an anywidget."""

HERE = """root => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(
  () => done([root.handles(), root.names()]))))"""
"""What is drawn, after the next frame."""


@pytest.fixture(scope="module")
def output(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """A page with the widget of a run, which fails if it logs an error."""
    path = tmp_path_factory.mktemp("widget") / "case.toml"
    path.write_text(CASE)
    widget = sd.view(sd.simulate(read_case(path).mechanism, until=2e-3, samples=21))
    names = ("scene", "ghost", "draft", "selected", "theme", "movable")
    with chromium() as browser:
        page = browser.new_page(viewport={"width": 900, "height": 600})
        errors: list[str] = []
        page.on("console", lambda message: errors.append(message.text) if message.type == "error" else None)
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.set_content(f"<style>{widget._css}</style><div id=output></div>")
        page.evaluate(MODEL, [str(widget._esm), {name: getattr(widget, name) for name in names}])
        yield page
        assert not errors


def _seen(page: Any) -> tuple[dict[str, list[float]], dict[str, Any]]:
    """Joints in the window [pixel], and the names that are drawn."""
    box = page.locator("canvas").bounding_box()
    handles, names = page.locator(".sd-stage").evaluate(HERE)
    return {name: [box["x"] + x, box["y"] + y] for name, (x, y) in handles.items()}, names


def test_joint_is_not_dragged_in_a_notebook(output: Any) -> None:
    """Contract: nothing in a notebook assembles what is dragged: the drawing is panned, and no message is sent."""
    before, _ = _seen(output)
    start = before["unit 1/pivot"]
    output.mouse.move(*start)
    output.mouse.down()
    output.mouse.move(start[0] + 30.0, start[1] - 20.0, steps=5)
    output.mouse.up()
    after, _ = _seen(output)
    moved = np.array(after["unit 1/pivot"]) - start
    assert np.all(np.abs(moved) > 10.0)
    assert np.allclose(np.array(after["A"]) - before["A"], moved)
    assert output.evaluate("window.sent") == []


def test_keys_go_through_clearance_joints_and_frames(output: Any) -> None:
    """Contract: without a pointer the arrow keys choose each clearance joint in turn, and go from frame to frame."""
    canvas = output.locator("canvas")
    canvas.focus()
    chosen = []
    for _ in range(3):
        output.keyboard.press("ArrowDown")
        chosen.append(output.evaluate("window.model.get('selected')"))
    assert sorted(chosen[:2]) == ["A", "unit 1/pivot"]
    assert chosen[2] == chosen[0]
    output.keyboard.press("ArrowUp")
    assert output.evaluate("window.model.get('selected')") == chosen[1]
    output.keyboard.press("ArrowRight")
    output.keyboard.press("ArrowRight")
    output.keyboard.press("ArrowLeft")
    output.locator("canvas[data-frame='1']").wait_for()


def test_name_below_the_pointer_goes_with_its_joint(output: Any) -> None:
    """Contract: a click lets the view follow a joint; its name stays nowhere else, and goes when the pointer leaves."""
    before, _ = _seen(output)
    output.mouse.click(*before["O"])
    assert output.evaluate("window.model.get('selected')") == "O"
    after, names = _seen(output)
    assert np.linalg.norm(np.array(after["O"]) - before["O"]) > 40.0
    assert "O" not in [each["words"] for each in names["boxes"]]
    output.mouse.move(*after["O"])
    assert "O" in [each["words"] for each in _seen(output)[1]["boxes"]]
    output.mouse.move(5.0, 595.0)
    assert "O" not in [each["words"] for each in _seen(output)[1]["boxes"]]
