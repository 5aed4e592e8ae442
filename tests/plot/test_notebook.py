"""A run in a notebook: the page of a film in a frame."""

import html
import json
import re

import pytest

import scissordyn as sd


def test_notebook_shows_the_scene_of_a_run() -> None:
    """Identity: the frame has the page of a film with every joint, and the other run as its ghost; a name is no script."""
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
