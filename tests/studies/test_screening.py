"""Studies of cheap runs verified by accurate ones: estimates, pairing, budget, searches, resuming and reports."""

import math

import numpy as np
import pytest
from scipy import stats
from tests.build import one_line_error

import scissordyn as sd
from scissordyn.studies.compute.fidelity import verified_path
from scissordyn.studies.estimate import (
    correlation,
    cost_ratio,
    fraction_estimate,
    mean_estimate,
    quantile_estimates,
    split,
)
from studies.test_study import arm

MEDIAN, SPREAD = 1.0, 0.5  # Median and spread of a log-normal response


def pairs(numbers, count, correlated):
    """Return lognormal responses of accurate and cheap runs."""
    z, noise = numbers.standard_normal((2, count))
    other = correlated * z + math.sqrt(1.0 - correlated**2) * noise
    return MEDIAN * np.exp(SPREAD * z), 1.3 * MEDIAN * np.exp(SPREAD * other)


def least_held(repetitions, less=0.0):
    """Return the smallest accepted number of 95 % intervals that hold the truth: 3 standard deviations below the mean."""
    return repetitions * (0.95 - 3.0 * math.sqrt(0.95 * 0.05 / repetitions) - less)


def test_cheap_runs_that_are_accurate():
    """Limit: if cheap runs are accurate, mean and fraction are those of all cheap runs."""
    _, cheap = pairs(np.random.default_rng(1), 400, 0.9)
    found = mean_estimate(cheap[:20], cheap[:20], cheap)
    assert found.value == pytest.approx(cheap.mean(), rel=1e-12)
    assert found.correlation == pytest.approx(1.0)
    half = stats.t.ppf(0.975, 18) * cheap.std(ddof=1) / 20.0  # of 400 runs
    assert found.high - found.value == pytest.approx(half, rel=1e-9)
    met = cheap < 1.5
    assert fraction_estimate(met[:20], met[:20], met).value == pytest.approx(met.mean(), rel=1e-12)


def test_linear_relation_is_removed():
    """Limit: for accurate = 2 + 3 cheap the mean is 2 + 3 times that of all cheap runs."""
    _, cheap = pairs(np.random.default_rng(2), 300, 0.9)
    found = mean_estimate(2.0 + 3.0 * cheap[:10], cheap[:10], cheap)
    assert found.value == pytest.approx(2.0 + 3.0 * cheap.mean(), rel=1e-12)


def test_useless_cheap_runs_do_no_harm():
    """Limit: with constant cheap runs the answer is that of the accurate runs."""
    accurate, _ = pairs(np.random.default_rng(3), 30, 0.9)
    alone = stats.t.interval(0.95, 29, accurate.mean(), stats.sem(accurate))
    found = mean_estimate(accurate, np.ones(30), np.ones(500))
    assert (found.low, found.high) == pytest.approx(alone)
    assert math.isnan(found.correlation)
    met = accurate < 1.0
    found = fraction_estimate(met, np.ones(30, bool), np.ones(500, bool))
    assert found.value == pytest.approx(met.mean())
    assert found.width == pytest.approx(found.accurate_high - found.accurate_low, rel=0.05)
    assert found.saved == pytest.approx(1.0, abs=0.1)


def test_strata():
    """Closed form: the fraction is the sum over the strata of the cheap runs."""
    paired = np.array([1, 1, 1, 1, 0, 0, 0, 0, 0, 0], bool)
    accurate = np.array([1, 1, 1, 0, 1, 0, 0, 0, 0, 0], bool)
    cheap = np.concatenate([paired, np.ones(60, bool), np.zeros(30, bool)])
    found = fraction_estimate(accurate, paired, cheap)
    assert found.value == pytest.approx(0.64 * 3 / 4 + 0.36 * 1 / 6)
    assert (found.screened, found.verified) == (100, 10)
    assert found.low < found.value < found.high


@pytest.mark.parametrize("met", [False, True])
def test_ends_of_fractions(met):
    """Limit: if no accurate run or every one meets the bound, the interval ends at 0 or 1."""
    met = np.full(20, met)
    found = fraction_estimate(met, met, np.full(200, met[0]))
    assert (found.high if met[0] else found.low) == float(met[0])
    assert 0.0 < found.width < 0.2


@pytest.mark.parametrize("correlated", [0.6, 0.95])
def test_intervals_cover(correlated):
    """Limit: in 200 repetitions 95 % of the intervals hold the truth (within 3 standard deviations and 2 %)."""
    numbers = np.random.default_rng(5)
    mean, below = MEDIAN * math.exp(0.5 * SPREAD**2), float(stats.norm.cdf(math.log(1.5) / SPREAD))
    held = {"mean": 0, "fraction": 0, "median": 0}
    narrower = []
    for _ in range(200):
        accurate, cheap = pairs(numbers, 300, correlated)
        some, paired = accurate[:24], cheap[:24]
        by_mean = mean_estimate(some, paired, cheap)
        by_fraction = fraction_estimate(some < 1.5, paired < 1.95, cheap < 1.95)
        held["mean"] += by_mean.low <= mean <= by_mean.high
        held["fraction"] += by_fraction.low <= below <= by_fraction.high
        narrower.append(by_fraction.width / (by_fraction.accurate_high - by_fraction.accurate_low))
    for _ in range(30):
        accurate, cheap = pairs(numbers, 300, correlated)
        (found,) = quantile_estimates(accurate[:24], cheap[:24], cheap, [0.5])
        held["median"] += found.low <= MEDIAN <= found.high
    assert min(held["mean"], held["fraction"]) >= least_held(200, 0.02)
    assert held["median"] >= least_held(30, 0.02)
    assert np.mean(narrower) < (0.95 if correlated < 0.9 else 0.8)


def test_quantiles_need_enough_runs():
    """Limit: a 95 % quantile of ten accurate runs has no upper end; its lower end is one of them."""
    accurate, cheap = pairs(np.random.default_rng(6), 200, 0.9)
    (found,) = quantile_estimates(accurate[:10], cheap[:10], cheap, [0.95])
    assert found.high == math.inf
    assert found.low in accurate[:10]


def test_split_of_a_budget():
    """Closed form: sqrt(rho^2/(1 - rho^2) w/w_cheap) cheap runs per accurate one minimise the variance."""
    rho, accurate, cheap, budget = 0.9, 2.0, 0.02, 1000.0
    ratio = cost_ratio(rho, accurate, cheap)
    assert ratio == pytest.approx(math.sqrt(0.81 / 0.19 * 100.0))
    verified, screened = split(budget, rho, accurate, cheap)
    assert verified * accurate + screened * cheap <= budget
    assert screened / verified == pytest.approx(ratio, rel=0.02)

    def variance(m):
        n = (budget - m * accurate) / cheap
        return (1.0 - rho**2) / m + rho**2 / n

    assert variance(verified) <= min(variance(0.8 * verified), variance(1.2 * verified))
    assert cost_ratio(0.0, accurate, cheap) == cost_ratio(math.nan, accurate, cheap) == 1.0
    assert math.isnan(correlation(np.ones(5), np.arange(5.0)))


RANGES = {"A.clearance": (0.05e-3, 0.4e-3), "drive.speed": "100..200 rpm"}  # Ranges of the varied parameters
CHEAP = {"rtol": 1e-3, "atol": 1e-3}  # Options of the cheap runs


def study(tmp_path, **options):
    """Return a study of the first contacts of an array."""
    given = {"until": 0.003, "seed": 1, "requirements": {"peak_force": 30e3}, "screen": CHEAP, "engine": 1, **options}
    return sd.study(arm(), RANGES, store=tmp_path / "study.db", **given)


def test_pairs(tmp_path):
    """Identity: accurate runs have the factors of the first points bit for bit, and the options of the case."""
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
    """Contract: cheap and accurate columns are those of both stores; report and reopened store agree."""
    found = study(tmp_path, points=64, verify=16, design="random")
    fraction, every, mean, median, _ = found.estimates
    assert fraction.estimate.cheap == found.requirements[0].fraction
    assert every.estimate.accurate == found.verified.feasible.fraction
    assert mean.estimate.cheap == pytest.approx(found.dataset["peak_force"].values.max(axis=1).mean())
    assert mean.estimate.correlation > 0.99
    assert mean.estimate.width < 0.7 * (mean.estimate.accurate_high - mean.estimate.accurate_low)
    assert median.kind == "quantile"
    again = sd.open_study(tmp_path / "study.db")
    assert repr(again.estimates) == repr(found.estimates)  # as text, in which NaN is equal to NaN
    text = found.report(tmp_path / "study.html").read_text()
    assert "Cheap and accurate runs" in text
    assert "from 64 cheap and 16 accurate runs" in text
    more = again.extend(80, engine=1)
    assert more.estimates[0].estimate.screened == 80
    assert more.resume(engine=1).estimates[0].estimate.verified == 16


def test_uncertain_samples(tmp_path):
    """Contract: at one point with uncertain factors the trials are its samples."""
    found = sd.study(
        arm(),
        uncertain={"A.clearance": sd.Interval(0.05e-3, 0.4e-3)},
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


def test_budget(tmp_path):
    """Contract: a budget decides both numbers of points; the same call again computes nothing."""
    found = study(tmp_path, points=1, design="random", budget=1.5)
    sizes = found.dataset.sizes["case"], found.verified.dataset.sizes["case"]
    assert sizes[0] >= sizes[1] >= 8
    times = found.store.times()["seconds"].copy()
    again = study(tmp_path, points=1, design="random", budget=1.5)
    assert (again.dataset.sizes["case"], again.verified.dataset.sizes["case"]) == sizes
    np.testing.assert_array_equal(again.store.times()["seconds"], times)


def test_search(tmp_path):
    """Contract: the front of a search by cheap runs is run accurately; further generations keep these runs."""
    goals = ["minimise peak_force", "maximise drive.speed"]
    found = study(tmp_path, goals=goals, population=8, generations=2, verify=8, requirements={"peak_force": 300e3})
    table = found.confirmed
    assert 1 <= len(table) <= 8
    assert set(table.index) <= set(found.front.index)
    peak = found.verified.dataset["peak_force"].values.max(axis=1)
    np.testing.assert_array_equal(table["accurate minimise peak_force"], peak)
    assert (table["accurate violation"] <= 0.0)[table["front"]].all()
    assert (table["maximise drive.speed"] == table["drive.speed"]).all()
    more = study(tmp_path, goals=goals, population=8, generations=3, verify=8, requirements={"peak_force": 300e3})
    assert set(table["A.clearance"]) <= set(more.confirmed["A.clearance"])
    assert "confirmed by accurate" in more.report(tmp_path / "search.html").read_text()


@pytest.mark.parametrize("goal", ["minimise peak_force", "maximise peak_force"])
def test_best_point_of_one_goal(tmp_path, goal):
    """Contract: with one goal the best point is the best of the accurate runs."""
    found = study(tmp_path, goals=goal, population=6, generations=2, verify=8)
    table = found.confirmed[found.confirmed["accurate violation"] == found.confirmed["accurate violation"].min()]
    values = table[f"accurate {goal}"]
    assert values.min() > 0.0
    best = values.idxmax() if goal.startswith("maximise") else values.idxmin()
    assert found.best["A.clearance"] == table["A.clearance"][best]


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
def test_refused_screening(tmp_path, options, said):
    """Contract: unsuitable designs, unknown options and budgets without cheap runs are refused in one line."""
    with one_line_error(said):
        study(tmp_path, **options)
    assert not (tmp_path / "study.db").exists()


def test_without_accurate_runs(tmp_path):
    """Contract: a study of one kind of runs has no estimates, and the error says why."""
    found = study(tmp_path, points=8, design="random", screen=None)
    assert found.verified is None
    with pytest.raises(sd.InputError, match="without accurate runs"):
        found.estimates  # noqa: B018
    assert verified_path("a/b.db") == "a/b.verified.db"


def test_study_file(tmp_path):
    """Contract: the table [screen] gives the study of the Python call."""
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
    """Limit: in 200 studies of 120 cheap and 24 accurate runs, 95 % of the intervals hold the result of all accurate runs."""
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
    held = {"mean": 0, "fraction": 0}
    for here, there in zip(cheap, accurate[:, :accurate_runs], strict=True):
        pairs = here[:accurate_runs]
        mean = mean_estimate(there, pairs, here)
        fraction = fraction_estimate(there < bound, pairs < bound, here < bound)
        held["mean"] += mean.low <= accurate.mean() <= mean.high
        held["fraction"] += fraction.low <= (accurate < bound).mean() <= fraction.high
    assert min(held.values()) >= least_held(studies)
