"""Other codes in the comparisons: each model compared with an exact solution, and the report of missing codes."""

import re
from typing import Any

import pytest
from validation.case import Case, Code, Model, installed, scan
from validation.catalogue import CASES
from validation.page import codes_table, models_table

COMPILED = ("numbalsoda",), ("squeezer",)  # Packages and cases whose models compile for half a minute, for slow tests

# Models of other programs as test parameters
MODELS = [
    pytest.param(
        model, id=f"{case.name}-{k}", marks=pytest.mark.slow if model.package in COMPILED[0] or case.name in COMPILED[1] else ()
    )
    for case in CASES
    if case.models
    for k, model in enumerate(case.models())
]
ABSENT = "no_such_package_of_that_name"  # Name of a package that does not exist


def missing(setting: float) -> tuple[float, float]:
    """Run a code that is not installed."""
    raise ModuleNotFoundError(f"No module named '{ABSENT}' at {setting}")


def failing(setting: float) -> tuple[float, float]:
    """Run a code that fails at all but the smallest settings."""
    if setting > 1e-5:
        raise RuntimeError(f"diverges at {setting}")
    return setting, 1e-3


@pytest.mark.parametrize("model", MODELS)
def test_models_of_other_codes(model):
    """Cross-check: each model agrees with its closed form, second formulation or published number."""
    if not installed(model.package):
        pytest.skip(f"{model.package} is not installed")
    assert model.measure() <= model.allowed


def test_models_of_all_compared_codes():
    """Contract: a case that compares other codes checks a model of each of them."""
    for case in CASES:
        if case.codes is None:
            continue
        assert case.models is not None, case.name
        checked = {model.package for model in case.models()}
        others = {code.package for code in case.codes() if not code.name.startswith("scissordyn")}
        assert others <= checked, case.name


def test_codes_name_their_package():
    """Contract: a code of another package names it, so that a missing package is not taken for a failure."""
    for case in CASES:
        for one in [*(case.codes() if case.codes else ()), *(case.models() if case.models else ())]:
            first = one.name.split()[0].rstrip(",").lower()
            assert one.package == (first if first in ("exudyn", "numbalsoda") else ""), one.name


def constrained_slider(mbs: Any) -> int:
    """Return a slider of three coordinates, of which two are constrained."""
    from validation.exudyn_model import library
    from validation.slider_crank.equations import CRANK, ROD, SLIDER_MASS

    _, items = library()
    place = mbs.AddNode(items.NodeRigidBody2D(referenceCoordinates=[CRANK + ROD, 0.0, 0.0]))
    slider = mbs.AddObject(items.ObjectRigidBody2D(mass=SLIDER_MASS, inertia=1.0, nodeNumber=place))
    fixed = mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=mbs.AddNode(items.NodePointGround()), coordinate=0))
    for coordinate in (1, 2):
        guide = mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=place, coordinate=coordinate))
        mbs.AddObject(items.CoordinateConstraint(markerNumbers=[fixed, guide]))
    return int(mbs.AddMarker(items.MarkerBodyRigid(bodyNumber=slider)))


@pytest.mark.skipif(not installed("exudyn"), reason="exudyn is not installed")
def test_exudyn_needs_a_slider_without_constraints():
    """Second formulation: the slider with one coordinate agrees until the second contact, the constrained body does not.

    After one revolution the constrained body has an error of a twentieth of the clearance or more at any tolerance.
    """
    from validation.slider_crank.case import other
    from validation.slider_crank.exudyn_pin import Settings, exudyns
    from validation.slider_crank.models import until_second_contact

    short = Settings(longest=6e-6)
    assert until_second_contact(exudyns(1e-10, short)[1]) < 1e-7
    assert until_second_contact(exudyns(1e-10, short, constrained_slider)[1]) > 1e-5
    for tolerance in (1e-8, 1e-9, 1e-10):
        assert other(exudyns(tolerance, Settings(), constrained_slider))[0] > 0.05


@pytest.mark.skipif(not installed("exudyn"), reason="exudyn is not installed")
def test_exudyn_reaches_the_goal_of_the_slider_crank():
    """Second formulation: every compared setting can reach the goal of the comparison."""
    from validation.slider_crank.case import CASE, EXUDYN, other
    from validation.slider_crank.exudyn_pin import exudyns

    for chosen in EXUDYN:
        errors = [other(exudyns(one, chosen))[0] for one in (1e-8, 5e-9, 2e-9, 1e-9)]
        assert min(errors) <= CASE.goal, chosen


def test_report_of_missing_codes(tmp_path, monkeypatch):
    """Contract: table, list and picture of a scan distinguish a missing code from one that fails."""
    from validation import curves

    labels = []
    save = curves.Figure.savefig

    def saved(figure: Any, *given: object, **options: object) -> None:
        labels.extend(text.get_text() for text in figure.legends[0].get_texts())
        save(figure, *given, **options)

    monkeypatch.setattr(curves.Figure, "savefig", saved)
    codes = [
        Code("good", lambda setting: (setting, 1e-3), (1e-4,)),
        Code("absent", missing, (1e-4,), package=ABSENT),
        Code("broken", failing, (1e-4,)),
        Code("partly", failing, (1e-4, 1e-6)),
    ]
    assert scan(codes[1]).points == ()
    made = Case("made", "Made up", list, error="error [m]", goal=1e-3, codes=lambda: codes)
    text = codes_table(made, tmp_path / "curves.png")
    assert re.search(r"^\| absent +\| +tolerance \| +- \| +not installed \| +- \| +- \|$", text, re.MULTILINE)
    assert re.search(r"^\| broken +\| +tolerance \| +- \| +fails \| +- \| +- \|$", text, re.MULTILINE)
    assert "* absent: not installed." in text
    assert "* broken, tolerance: 0.0001: fails." in text
    assert "* partly, tolerance: 0.0001: fails; 1e-06: 1.0e-06, 1 ms." in text
    assert labels == ["good", "absent: not installed", "broken: fails", "partly", "goal"]
    assert "![Error over time of all codes and settings](curves.png)" in text
    assert (tmp_path / "curves.png").read_bytes().startswith(b"\x89PNG")


def test_report_of_wrong_models():
    """Contract: a wrong or failing model is counted and marked; a missing one is named, not counted."""
    models = [
        Model("right", "x", lambda: 1e-9, 1e-8),
        Model("wrong", "x", lambda: 1e-7, 1e-8),
        Model("broken", "x", lambda: failing(1.0)[0], 1e-8),
        Model("absent", "x", lambda: missing(1.0)[0], 1e-8, ABSENT),
    ]
    text, missed = models_table(models)
    assert missed == 2
    assert re.search(r"^\| right +\| +x \| +1.0e-09 \| +1e-08 \|$", text, re.MULTILINE)
    assert re.search(r"^\| wrong +\| +x \| +1.0e-07 \| +1e-08: missed \|$", text, re.MULTILINE)
    assert re.search(r"^\| broken +\| +x \| +fails \| +1e-08: missed \|$", text, re.MULTILINE)
    assert re.search(r"^\| absent +\| +x \| +not installed \| +1e-08 \|$", text, re.MULTILINE)
