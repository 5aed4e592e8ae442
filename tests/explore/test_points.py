"""The points of a study and of a bifurcation diagram in the explorer."""

import numpy as np
import pytest

import scissordyn as sd

pytest.importorskip("tomlkit", reason="the package tomlkit is not installed")

from scissordyn.explore.case import open_case

from .heard import Heard, until


@pytest.fixture(scope="module")
def store(crank, tmp_path_factory):
    """Return the path of a study of a slider-crank over clearance and speed; half of the points meet its requirement."""
    path = tmp_path_factory.mktemp("points") / "study.db"
    vary = {"slider pin.clearance": [2e-4, 5e-4], "drive.speed": [10.0, 20.0, 30.0]}
    sd.study(crank.driven(speed=20.0), vary, until=0.05, store=path, requirements={"peak_force": 100.0}, engine=1)
    return path


def test_study_is_shown_with_its_requirement_and_opened_by_a_point(store):
    """Cross-check: the points are those of the study itself; a point that is opened has its numbers and its force."""
    result = sd.open_study(store)
    case = open_case(store)
    assert case.points is not None
    (figure,) = case.points.figures("drive.speed")
    keys = np.concatenate([line["keys"] for line in figure["lines"]]).astype(int)
    values = np.concatenate([line["y"] for line in figure["lines"]])[np.argsort(keys)]
    wanted = result.points["peak_force"].values
    assert wanted.size == 6
    np.testing.assert_allclose(values / values.max(), wanted / wanted.max(), rtol=1e-12)
    (level,) = figure["levels"]
    assert level / values.max() == pytest.approx(100.0 / wanted.max(), rel=1e-12)
    met = {line["color"]: set(line["keys"].astype(int)) for line in figure["lines"]}
    assert met.get("green", set()) == set(np.flatnonzero(wanted < 100.0))
    best = result.recommend().point
    large = [int(key) for line in figure["lines"] for key, size in zip(line["keys"], line["sizes"], strict=True) if size > 4.0]
    assert large == [best]

    heard = Heard(case)
    session = heard.page.session
    assert best == 0
    assert heard.of("form")[0]["chosen"] == {"slider pin.clearance": "0.2 mm", "drive.speed": "10 rad/s"}
    assert heard.of("points")[0]["axes"] == list(result.study.factor_names)
    heard.say("open", point=4)
    until(lambda: not session.computing)
    good = session.good
    assert good is not None
    assert good.run is not None
    assert good.case.mechanism == result.mechanism(4)
    assert float(good.run["peak_force"].values.max()) == pytest.approx(float(wanted[4]), rel=1e-9)
    heard.say("undo")
    assert session.case is case
    heard.say("open", point=99)
    heard.say("axis", name="nothing")
    assert [message["text"][:8] for message in heard.of("said")] == ["no point", "cannot d"]
    heard.page.close()


def test_diagram_is_shown_and_opened_by_a_point(crank, tmp_path):
    """Identity: all cycles of a diagram over its parameter; a point has the mechanism with its value."""
    driven = crank.driven(speed=100.0)
    diagram = sd.bifurcation(
        driven,
        over="slider pin.clearance",
        values=[1e-4, 3e-4],
        cycles=3,
        keep=2,
        rtol=1e-5,
        atol=1e-5,
        store=tmp_path / "d.nc",
    )
    case = open_case(tmp_path / "d.nc")
    assert case.points is not None
    figures = {figure["name"]: figure for figure in case.points.figures("")}
    line = figures["points slider_velocity"]["lines"][0]
    wanted = diagram["slider_velocity"].transpose("value", "cycle").values.ravel()
    np.testing.assert_allclose(line["y"] / np.abs(line["y"]).max(), wanted / np.abs(wanted).max(), rtol=1e-12)
    assert line["keys"].tolist() == [0.0, 0.0, 1.0, 1.0]
    assert case.mechanism == driven.replace("slider pin.clearance", 1e-4)
    assert case.points.case_at(1).mechanism == driven.replace("slider pin.clearance", 3e-4)
