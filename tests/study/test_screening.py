"""Studies of cheap runs that accurate ones verify: pairing, estimates, budget, searches, resuming, reports."""

import numpy as np
import pytest

import scissordyn as sd
from scissordyn.errors import InputError
from scissordyn.study.answer.control_variate import fraction_by_margins, fraction_estimate, mean_estimate
from scissordyn.study.answer.fidelity import verified_path
from study.test_control_variate import least_held
from study.test_study import arm

RANGES = {"A.clearance": (0.05e-3, 0.4e-3), "drive.speed": "100..200 rpm"}
CHEAP = {"rtol": 1e-3, "atol": 1e-3}


def study(tmp_path, **options):
    """A study of the first contacts of an array."""
    given = {"until": 0.003, "seed": 1, "requirements": {"peak_force": 30e3}, "screen": CHEAP, "engine": 1, **options}
    return sd.study(arm(), RANGES, store=tmp_path / "study.db", **given)


def test_pairs(tmp_path):
    """Identity: accurate runs have the numbers of the first points bit for bit, and the options of the case."""
    found = study(tmp_path, points=40, verify=10, design="random")
    accurate = found.verified
    assert found.study.options.rtol == 1e-3
    assert accurate.study.options.rtol == 1e-8
    assert (found.dataset.sizes["case"], accurate.dataset.sizes["case"]) == (40, 10)
    for address in RANGES:
        name = next(each for each in found.dataset if found.dataset[each].attrs.get("address") == address)
        np.testing.assert_array_equal(found.dataset[name][:10], accurate.dataset[name])
    peak, cheap = accurate.dataset["peak_force"].values.max(axis=1), found.dataset["peak_force"].values[:10].max(axis=1)
    assert 1e-9 < np.max(np.abs(peak / cheap - 1.0)) < 0.1


def test_estimates_and_report(tmp_path):
    """Contract: cheap and accurate columns are those of both stores; terminal, report and a reopened store say the same."""
    found = study(tmp_path, points=64, verify=16, design="random")
    fraction, every, mean, median, _ = found.estimates
    assert fraction.estimate.cheap == found.requirements[0].fraction
    assert every.estimate.accurate == found.verified.feasible.fraction
    assert mean.estimate.cheap == pytest.approx(found.dataset["peak_force"].values.max(axis=1).mean())
    assert mean.estimate.correlation > 0.99
    assert mean.estimate.width < 0.7 * (mean.estimate.accurate_high - mean.estimate.accurate_low)
    assert median.kind == "quantile"
    again = sd.open_study(tmp_path / "study.db")
    assert again.estimates == found.estimates
    text = found.report(tmp_path / "study.html").read_text()
    assert "Cheap and accurate runs" in text
    assert "64 points with cheap runs, an interpolation between them and 16 accurate runs" in text
    more = again.extend(80, engine=1)
    assert more.estimates[0].estimate.screened == 80
    assert more.resume(engine=1).estimates[0].estimate.verified == 16


def test_uncertain_samples(tmp_path):
    """Contract: of one point with uncertain numbers the trials are its samples."""
    found = sd.study(
        arm(),
        uncertain={"A.clearance": sd.Uniform(0.05e-3, 0.4e-3)},
        until=0.002,
        samples=24,
        sampling="random",
        requirements={"peak_force": 30e3},
        screen=CHEAP,
        verify=8,
        store=tmp_path / "one.db",
        engine=1,
    )
    assert (found.estimates[0].estimate.screened, found.estimates[0].estimate.verified) == (24, 8)


def test_a_budget(tmp_path):
    """Limit: a budget decides both numbers of points; the same call again computes nothing, and keeps to them."""
    found = study(tmp_path, points=1, design="random", budget=1.5)
    sizes = found.dataset.sizes["case"], found.verified.dataset.sizes["case"]
    assert sizes[0] >= sizes[1] >= 8
    times = found.store.times()["seconds"].copy()
    again = study(tmp_path, points=1, design="random", budget=1.5)
    assert (again.dataset.sizes["case"], again.verified.dataset.sizes["case"]) == sizes
    np.testing.assert_array_equal(again.store.times()["seconds"], times)


def test_a_search(tmp_path):
    """Contract: the front of a search by cheap runs is run accurately; further generations keep what was."""
    goals = ["minimise peak_force", "maximise drive.speed"]
    found = study(tmp_path, goals=goals, population=8, generations=2, verify=8)
    table = found.confirmed
    assert 1 <= len(table) <= 8
    assert set(table.index) <= set(found.front.index)
    peak = found.verified.dataset["peak_force"].values.max(axis=1)
    np.testing.assert_array_equal(table["accurate minimise peak_force"], peak)
    assert (table["accurate violation"] <= 0.0)[table["front"]].all()
    more = study(tmp_path, goals=goals, population=8, generations=3, verify=8)
    assert set(table["A.clearance"]) <= set(more.confirmed["A.clearance"])
    assert "confirmed by accurate" in more.report(tmp_path / "search.html").read_text()


def test_the_best_of_one_goal_is_an_accurate_one(tmp_path):
    """Contract: with one goal the best point is the best of the accurate runs."""
    found = study(tmp_path, goals="minimise peak_force", population=6, generations=2, verify=8)
    table = found.confirmed.sort_values(["accurate violation", "accurate minimise peak_force"])
    assert found.best["A.clearance"] == table["A.clearance"].iloc[0]


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"points": 16, "design": "latin-hypercube"}, "not a sample"),
        ({"design": "grid"}, "not a sample"),
        ({"points": 16, "screen": {"tolerance": 1e-3}}, "options of its runs"),
        ({"points": 16, "verify": 2}, "verify"),
        ({"points": 16, "screen": None, "budget": 60.0}, "without cheap and accurate"),
        ({"goals": "minimise peak_force", "budget": 60.0}, "budget of an optimisation"),
    ],
)
def test_what_cannot_be(tmp_path, options, said):
    """Limit: designs whose first points are no sample, unknown options and budgets without a split are refused in one line."""
    with pytest.raises(InputError, match=said) as error:
        study(tmp_path, **options)
    assert "\n" not in str(error.value)
    assert not (tmp_path / "study.db").exists()


def test_without_accurate_runs(tmp_path):
    """Limit: a study of one kind of runs has no estimates of both, and says what it lacks."""
    found = study(tmp_path, points=8, design="random", screen=None)
    assert found.verified is None
    with pytest.raises(InputError, match="without accurate runs"):
        found.estimates  # noqa: B018
    assert verified_path("a/b.db") == "a/b.verified.db"


def test_a_study_file(tmp_path):
    """Contract: the table [screen] gives the same study as Python does, and --budget is a time."""
    sd.write_case(arm(), tmp_path / "case.toml")
    text = """
case = "case.toml"
set = ["run.until=3 ms"]
require = ["peak_force < 30 kN"]
[vary]
"A.clearance" = "0.05..0.4 mm"
"drive.speed" = "100..200 rpm"
[design]
kind = "random"
points = 12
seed = 1
[screen]
set = ["run.rtol=1e-3", "run.atol=1e-3"]
verify = 8
"""
    (tmp_path / "study.toml").write_text(text)
    by_file = sd.study(tmp_path / "study.toml", store=tmp_path / "file.db", engine=1)
    by_call = study(tmp_path, points=12, verify=8, design="random")
    np.testing.assert_array_equal(by_file.dataset["peak_force"], by_call.dataset["peak_force"])
    np.testing.assert_array_equal(by_file.verified.dataset["peak_force"], by_call.verified.dataset["peak_force"])


@pytest.mark.slow
def test_two_hundred_studies_cover():
    """Limit: of 200 studies of an array, 120 cheap and 24 accurate runs each, 95 % hold what all accurate runs give."""
    studies, cheap_runs, accurate_runs = 200, 120, 24
    numbers = np.random.default_rng(7)
    count = studies * cheap_runs
    over = {"A.clearance": numbers.uniform(0.05e-3, 0.4e-3, count), "drive.speed": numbers.uniform(10.0, 21.0, count)}
    force = {}
    for tolerance in (1e-3, 1e-8):
        runs = sd.simulate_many(arm(), over, until=0.003, measures=["peak_force"], rtol=tolerance, atol=tolerance)
        assert (runs["status"] == "complete").all()
        force[tolerance] = runs["peak_force"].values.max(axis=1).reshape(studies, cheap_runs)
    cheap, accurate = force[1e-3], force[1e-8]
    assert 0.9 < np.corrcoef(cheap.ravel(), accurate.ravel())[0, 1] < 1.0 - 1e-9
    bound = 40e3
    held = {"mean": 0, "fraction": 0, "margins": 0}
    widths = []
    for here, there in zip(cheap, accurate[:, :accurate_runs], strict=True):
        pairs = here[:accurate_runs]
        mean = mean_estimate(there, pairs, here)
        fraction = fraction_estimate(there < bound, pairs < bound, here < bound)
        margins = fraction_by_margins(1.0 - there / bound, 1.0 - pairs / bound, 1.0 - here / bound)
        held["mean"] += mean.low <= accurate.mean() <= mean.high
        for name, found in (("fraction", fraction), ("margins", margins)):
            held[name] += found.low <= (accurate < bound).mean() <= found.high
        widths.append(margins.width / fraction.width)
    assert np.median(widths) < 0.95
    assert min(held.values()) >= least_held(studies)
