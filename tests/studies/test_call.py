"""`sd.study` and its result: plain values as arguments, and answers that agree with the store."""

import os
import threading
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from scipy import stats
from tests.build import one_line_error

import scissordyn as sd
from scissordyn.cli.study import study as command
from scissordyn.config.studies import refine_study as refined_study
from scissordyn.model.record import to_plain
from scissordyn.studies.ask.description import OwnMeasure, Study
from scissordyn.studies.ask.design import Design, Factor, Sampling
from scissordyn.studies.ask.distribution import Distribution
from scissordyn.studies.ask.requirement import Goal, Requirement
from scissordyn.studies.compute.execute import execute
from scissordyn.studies.result import StudyResult
from studies.test_study import UNTIL, arm, rows

BOUND = 60e3  # [N] largest allowed force

# Ranges of the varied parameters, in SI units
VARIED = {"A.clearance": (0.05e-3, 0.4e-3), "drive.speed": (10.0, 20.0)}


def peak(run):
    """Return the largest force."""
    return float(run["normal_force"].max())


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    """Return a study of twelve points with two samples each."""
    return sd.study(
        arm(),
        VARIED,
        until=UNTIL,
        points=12,
        seed=1,
        uncertain={"A.damping.restitution": sd.Interval(0.6, 0.9)},
        samples=2,
        requirements={"peak_force": BOUND},
        store=tmp_path_factory.mktemp("call") / "panel.db",
    )


def test_one_call_is_the_study_by_hand(found, tmp_path):
    """Contract: description and store, except the times, are those made with the classes."""
    by_hand = Study(
        arm(),
        sd.Options(UNTIL),
        (Factor("A.clearance", sd.Interval(0.05e-3, 0.4e-3)), Factor("drive.speed", sd.Interval(10.0, 20.0))),
        Design("sobol", 12, seed=1),
        ("peak_force",),
        uncertain=(Factor("A.damping.restitution", sd.Interval(0.6, 0.9)),),
        sampling=Sampling(2, seed=1),
        requirements=(Requirement("peak_force", "<", BOUND),),
    )
    assert found.study == by_hand
    store = execute(by_hand, tmp_path / "hand.db", block=found.store.block)
    assert rows(store.path) == rows(found.store.path)


@pytest.mark.parametrize(
    ("given", "meant"),
    [
        ((1e-4, 2e-4), sd.Interval(1e-4, 2e-4)),
        ([1e-4, 2e-4], sd.Levels((1e-4, 2e-4))),
        ((1e-4, 2e-4, 3e-4), sd.Levels((1e-4, 2e-4, 3e-4))),
        (np.array([1e-4, 2e-4]), sd.Levels((1e-4, 2e-4))),
        (1e-4, sd.Levels((1e-4,))),
        (stats.norm(1e-4, 1e-5), Distribution("norm", {"loc": 1e-4, "scale": 1e-5})),
        ("0.1..0.4 mm, 4 values, log", sd.Interval(0.1e-3, 0.4e-3, 4, logarithmic=True)),
    ],
)
def test_meaning_of_ranges(given, meant):
    """Contract: a pair is a range, a list levels, a number one level, a text that of a study file."""
    (factor,) = asked({"A.clearance": given}).factors
    assert type(factor.variation) is type(meant)
    np.testing.assert_allclose(factor.variation.levels(), meant.levels(), rtol=1e-15)


def asked(factors=VARIED, **options):
    """Return the study that a call describes, without computing it."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("scissordyn.config.studies.computed", lambda study, *_, **__: StudyResult(study, None))
        result = sd.study(arm(), factors, **{"until": UNTIL, "store": "never.db", **options})
    return result.study


class Seen:
    """Clearances of the cases that a measure has seen."""

    def __init__(self):
        self.clearances = set()

    def add(self, ended):
        self.clearances.add(ended.mechanism.joint("A").clearance.clearance)
        return 1.0


def test_a_measure_changes_this_process(duplicated, tmp_path):
    """Contract: a measure given as a Python object runs in the process that calls `study`, also on two threads."""
    values, seen = [1e-4, 2e-4, 3e-4], Seen()
    measures = {"seen of accumulators": seen.add}
    sd.study(arm(), {"A.clearance": values}, until=UNTIL, measures=measures, store=tmp_path / "seen.db", engine=2, block=1)
    assert seen.clearances == set(values)


def test_measures_requirements_and_goals():
    """Contract: names, functions and bounds have the meaning of a study file."""
    named = asked(measures=["contact_count", peak])
    assert named.measures == ("contact_count",)
    assert named.own_measures == (OwnMeasure("peak", peak),)
    united = asked(measures={"late [N] of accumulators": peak}).own_measures
    assert united == (OwnMeasure("late", peak, of="accumulators", units="N"),)
    bounds = asked(requirements={"peak_force": 5.0, "A.contact_count": "<= 50"}).requirements
    assert [(one.part, one.measure, one.sign, one.bound) for one in bounds] == [
        ("", "peak_force", "<", 5.0),
        ("A", "contact_count", "<=", 50.0),
    ]
    assert asked(requirements="peak_force < 5 kN").requirements[0].bound == 5e3
    search = asked(goals=["minimise peak_force", "maximise A.clearance"]).optimisation
    assert search is not None
    assert search.goals == (Goal("peak_force"), Goal("A.clearance", maximise=True))
    assert asked().design.kind == "grid"
    assert asked(points=3).design == Design("sobol", 3)


def test_cases_and_files(tmp_path, monkeypatch):
    """Contract: a mechanism, a case, a case file, a study file and the command line give the same stores."""
    monkeypatch.chdir(tmp_path)
    case = sd.write_case(arm(), "arm.toml", run=sd.Options(UNTIL))
    Path("study.toml").write_text(
        'case = "arm.toml"\nrequire = ["peak_force < 60 kN"]\n[vary]\n"A.clearance" = "0.1, 0.2 mm"\n'
    )
    asked_for = {"requirements": ["peak_force < 60 kN"], "block": 1}
    vary = {"A.clearance": "0.1, 0.2 mm"}
    stores = [
        sd.study(sd.read_case("arm.toml"), vary, store="case.db", **asked_for),
        sd.study("arm.toml", vary, store="file.db", **asked_for),
        sd.study("study.toml", store="study.db", block=1),
    ]
    assert command("study.toml", output="command.db", block=1) == 0
    contents = [rows(one.store.path) for one in stores]
    assert contents[0] == contents[1] == contents[2] == rows("command.db")
    assert case is not None
    plain = sd.study(arm(), {"A.clearance": [0.1e-3, 0.2e-3]}, until=UNTIL, measures=["peak_force"])
    np.testing.assert_array_equal(plain.dataset["peak_force"], stores[0].dataset["peak_force"])


def test_answers_are_those_of_the_cases(found):
    """Cross-check: fractions, best point and worst case, computed from the peaks."""
    peaks = found.dataset["peak_force"].max("joint").values.reshape(12, 2)
    assert found.counts == {"complete": 24, "failed": 0, "pending": 0}
    assert found.feasible.fraction == pytest.approx(np.mean(peaks < BOUND))
    assert 0.0 < found.feasible.low < found.feasible.fraction < found.feasible.high < 1.0
    best = int(np.argmin(peaks.max(axis=1)))
    assert found.best == {name: float(found.points[name][best]) for name in VARIED}
    assert to_plain(found.design) == to_plain(
        arm().replace("A.clearance", found.best["A.clearance"]).replace("drive.speed", found.best["drive.speed"])
    )
    worst = found.worst(1)[0]
    assert worst.value == peaks.max()
    assert float(found.replay(worst.case)["joint_peak_force"].max()) == pytest.approx(worst.value, rel=5e-3)
    columns = found.table[["A.peak_force [N]", "ideal joints.peak_force [N]"]].to_numpy()
    assert columns.max(axis=1).tolist() == peaks.ravel().tolist()
    assert f"{found.feasible.fraction:.0%} of the range" in repr(found)
    assert "peak_force" in found._repr_html_()
    assert "24 cases complete" in found._repr_html_()


def test_pictures(found, tmp_path):
    """Contract: each picture is drawn, also on given Axes; a report has the tables."""
    import matplotlib.pyplot as plt

    _, axes = plt.subplots()
    assert found.plot.map("peak_force", axes=axes) == [axes]
    assert len(found.plot.curves()) == 2
    assert len(found.plot.requirements()) == 1
    plt.close("all")
    assert "60 kN" in found.report(tmp_path / "r.html", figures=tmp_path / "figures").read_text()
    assert list((tmp_path / "figures").glob("*.png"))
    assert found.export(tmp_path / "r.csv").read_text().count("\n") == 25
    with pytest.raises(sd.InputError, match="a map of 'speed'"):
        found.plot.map("speed")


def test_extended_and_reopened_study(tmp_path):
    """Contract: an extended and reopened study is equal to one computed at once; reading executes nothing."""
    asked_for = {"until": UNTIL, "measures": {"peak [N]": peak}, "block": 2}
    whole = sd.study(arm(), VARIED, points=6, store=tmp_path / "whole.db", **asked_for)
    part = sd.study(arm(), VARIED, points=3, store=tmp_path / "part.db", **asked_for)
    assert part.counts["complete"] == 3
    assert part.extend(6) is part
    assert part.counts["complete"] == 6
    assert part.study == whole.study
    xr.testing.assert_identical(part.dataset.drop_attrs(deep=False), whole.dataset.drop_attrs(deep=False))
    opened = sd.open_study(tmp_path / "part.db")
    assert isinstance(opened.study.mechanism, str)
    assert opened.counts["complete"] == 6
    with pytest.raises(sd.InputError, match=r"for example sd\.open_study\('study\.db', measures=\{'peak'"):
        opened.resume()
    opened = sd.open_study(tmp_path / "part.db", measures={"peak [N]": peak})
    assert opened.extend(7).counts == {"complete": 7, "failed": 0, "pending": 0}
    assert to_plain(opened.mechanism(0)) == to_plain(part.mechanism(0))
    read = sd.study(arm(), VARIED, points=3, store=tmp_path / "part.db", compute=False, **asked_for)
    assert read.counts["complete"] == 7


def test_failed_cases_are_done_again(tmp_path):
    """Contract: causes are listed, and `retry` computes failed cases again."""
    file = tmp_path / "mine.py"
    file.write_text(
        f"from pathlib import Path\ndef flag(run):\n    assert Path({str(tmp_path / 'flag')!r}).exists(), 'no flag'\n"
        "    return 1.0\n"
    )
    asked_for = {"until": UNTIL, "measures": [f"flag = {file}:flag"], "store": tmp_path / "a.db"}
    broken = sd.study(arm(), {"A.clearance": [1e-4, 2e-4]}, **asked_for)
    assert broken.counts["failed"] == 2
    assert list(broken.causes.values()) == [[0, 1]]
    assert "no flag" in next(iter(broken.causes))
    (tmp_path / "flag").touch()
    assert sd.open_study(tmp_path / "a.db", allow_code=file).resume(retry=True).counts["complete"] == 2


def test_search(found, tmp_path):
    """Cross-check: the best point is the minimum of the feasible points tried; more generations continue the search."""
    search = found.optimise("minimise peak_force", store=tmp_path / "best.db", population=4, generations=2, risk="worst")
    peaks = search.dataset["peak_force"].max("joint").values.reshape(8, 2).max(axis=1)
    assert search.best["A.clearance"] == float(search.points["A.clearance"][int(np.argmin(peaks))])
    search.extend(3)
    assert search.study.points == 12
    assert sd.open_study(tmp_path / "best.db").counts["complete"] == 24
    both = found.optimise(
        "maximise A.clearance", "minimise drive.speed", store=tmp_path / "front.db", population=4, generations=2
    )
    tried = np.stack([-both.points["A.clearance"].values, both.points["drive.speed"].values], axis=1)
    met = (both.dataset["peak_force"].max("joint").values.reshape(8, 2).mean(axis=1) < BOUND).tolist()
    beaten = [any(np.all(other <= one) and np.any(other < one) for k, other in enumerate(tried) if met[k]) for one in tried]
    np.testing.assert_array_equal(both.front["maximise A.clearance"], both.front["A.clearance"])
    assert both.front.index.tolist() == [k for k in range(8) if met[k] and not beaten[k]]
    assert len(both.plot.front()) == 1
    with pytest.raises(sd.InputError, match=r"the best point for 2 goals.*for example result\.front"):
        _ = both.best


@pytest.mark.slow
def test_sensitivity():
    """Limit: a factor without effect has a small index, the clearance a large one."""
    result = sd.study(arm(), {**VARIED, "gravity": (9.8, 9.82)}, until=UNTIL, design="morris", points=8, measures="peak_force")
    one = result.sensitivity("peak_force")
    assert isinstance(one, xr.Dataset)
    assert float(one["effect"].sel(factor="gravity")) < 1e-3 * float(one["effect"].sel(factor="A.clearance"))
    assert list(result.sensitivity()) == ["peak_force"]
    assert len(result.plot.sensitivity()) == 1


def test_temporary_store():
    """Contract: without a store the results are in a temporary folder, which is removed with the result."""
    result = sd.study(arm(), {"A.clearance": [1e-4]}, until=UNTIL)
    file = Path(result.store.path)
    assert file.is_file()
    assert float(result.dataset["peak_force"][0, 0]) > 0.0
    del result
    assert not file.parent.exists()


@pytest.mark.parametrize("engine", [2, sd.Processes(1)])
def test_engines(engine, found):
    """Identity: every engine gives the same results, and leaves nothing running."""
    before = threading.active_count()
    here = sd.study(arm(), VARIED, until=UNTIL, points=2, seed=1, measures=["peak_force"], engine=engine)
    again = sd.study(arm(), VARIED, until=UNTIL, points=2, seed=1, measures=["peak_force"])
    np.testing.assert_array_equal(here.dataset["peak_force"], again.dataset["peak_force"])
    assert threading.active_count() <= before
    if isinstance(engine, sd.Processes):
        assert engine._pool is None


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"factors": {"A.clearence": (1e-4, 2e-4)}}, "did you mean 'clearance'"),
        ({"factors": {"A.clearance": (2e-4, 1e-4)}}, "'A.clearance' = (0.0002, 0.0001): a range from"),
        ({"factors": {"A.clearance": "0.1..0.4 kg"}}, "'kg' is not a unit of"),
        ({"factors": {"A.clearance": object()}}, "expected (1e-4, 4e-4), [50.0"),
        ({"factors": [("A.clearance", 1e-4)]}, "expected a mapping from parameter paths to values"),
        ({"factors": {}}, "nothing varies"),
        ({"factors": {"A.clearance": (-1.0, 1.0)}}, "'A.clearance' can be -1"),
        ({"members": 0}, "members = 0"),
        ({"until": None}, "the end time of the runs is missing; expected until"),
        ({"measures": ["peak_fource"]}, "did you mean 'peak_force'"),
        ({"measures": {"late": "text"}}, "measure 'late': 'text'; expected a function"),
        ({"measures": [lambda run: 1.0]}, "'<lambda>' as the name of a user-defined measure"),
        ({"requirements": {"peak_fource": 1.0}}, "did you mean 'peak_force'"),
        ({"requirements": {"peak_force": None}}, "requirement on 'peak_force': None; expected an upper bound in SI"),
        ({"requirements": {"peak_force": "500 N"}}, "'peak_force 500 N' is not a requirement"),
        ({"goals": "peak_force"}, "goal 'peak_force'; expected minimise or maximise"),
        ({"design": "sobel"}, "did you mean 'sobol'"),
        ({"samples": 2}, "2 samples without an uncertain parameter"),
        ({"engine": "fast"}, "engine = 'fast'; expected a number of threads"),
        ({"store": "s3://bucket"}, "a file on a disk"),
        ({"block": 0}, "block = 0"),
    ],
)
def test_refused_studies(options, says, tmp_path, monkeypatch):
    """Contract: wrong arguments give one line, and no store."""
    monkeypatch.chdir(tmp_path)
    with one_line_error(says):
        sd.study(arm(), **{"factors": VARIED, "until": UNTIL, "store": "a.db", **options})
    assert os.listdir(tmp_path) == []


def test_missing_answers(found):
    """Contract: the error about a missing answer says what to type."""
    plain = StudyResult(asked(measures=["peak_force"]), found.store)
    for ask, says in (
        (lambda: plain.feasible, "without requirements; .*for example requirements="),
        (lambda: plain.best, "without requirements"),
        (lambda: plain.plot.requirements(), "without requirements"),
        (lambda: found.front, "without goals; .*for example result.optimise"),
        (lambda: found.sensitivity(), "of a sobol design; .*design='saltelli'"),
        (lambda: found.mechanism(24), "case 24; expected 0 to 23"),
        (lambda: found.optimise(store="never.db"), "an optimisation without a goal"),
    ):
        with pytest.raises(sd.InputError, match=says):
            ask()
    with pytest.raises(sd.InputError, match="study: case = 3; expected a mechanism"):
        sd.study(3, VARIED)
    with pytest.raises(sd.InputError, match="no study at"):
        sd.open_study("never.db")


def test_recommendation_and_refinement(found, tmp_path, capsys):
    """Contract: `best` is the recommended point; `refine` computes that point with other samples, or searches the ranges."""
    one = found.recommend()
    assert one.numbers == found.best
    assert one.samples == 2
    assert set(found.trends) == {"peak_force"}
    texts = [f"{address}={value!r} {'m' if 'clearance' in address else 'rad/s'}" for address, value in one.numbers.items()]
    again = tmp_path / "again.db"
    assert command("refine", found.store.path, output=str(again), vary=texts, samples=4, seed=5, threads=1) == 0
    refined = sd.open_study(again)
    assert refined.study.cases == 4
    assert refined.recommend().numbers == one.numbers
    assert refined.study.requirements == found.study.requirements
    assert not set(refined.dataset["A.damping.restitution"].values) & set(found.dataset["A.damping.restitution"].values)
    assert "of 4 samples" in " ".join(capsys.readouterr().out.split())
    loose, search = tmp_path / "loose.db", tmp_path / "search.db"
    uncertain = ["A.clearance=0.1..0.2 mm"]
    assert command("refine", found.store.path, output=str(loose), uncertain=uncertain, points=3, threads=1) == 0
    described = sd.open_study(loose).study
    assert [each.path for each in described.factors] == ["drive.speed"]
    assert [each.path for each in described.uncertain] == ["A.damping.restitution", "A.clearance"]
    assert (described.design.kind, described.points, described.cases) == ("sobol", 3, 6)
    searched = refined_study(found.built(), uncertain={"A.clearance": "0.1..0.2 mm"}, goals=["minimise A.clearance"])
    assert searched.optimisation is not None
    assert searched.optimisation.goals == (Goal("A.clearance"),)
    with pytest.raises(sd.InputError, match="--samples without refine"):
        command("status", found.store.path, samples=3)
    with pytest.raises(sd.InputError, match="without a new store"):
        command("refine", found.store.path, samples=3)
    with pytest.raises(sd.InputError, match="goal 'peak_force'"):
        command("refine", found.store.path, output=str(search), goal=["peak_force"])
