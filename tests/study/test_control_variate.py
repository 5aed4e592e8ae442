"""Estimates from cheap and accurate runs: closed forms, limits, and how often their intervals hold the truth."""

import math

import numpy as np
import pytest
from scipy import stats

from scissordyn.study.answer.control_variate import (
    correlation,
    cost_ratio,
    fraction_by_margins,
    fraction_estimate,
    mean_estimate,
    quantile_estimates,
    split,
    unseen_outliers,
)

MEDIAN, SPREAD = 1.0, 0.5


def pairs(numbers: np.random.Generator, count: int, correlated: float) -> tuple[np.ndarray, np.ndarray]:
    """Lognormal responses of accurate and cheap runs."""
    z, noise = numbers.standard_normal((2, count))
    other = correlated * z + math.sqrt(1.0 - correlated**2) * noise
    return MEDIAN * np.exp(SPREAD * z), 1.3 * MEDIAN * np.exp(SPREAD * other)


def least_held(repetitions: int, less: float = 0.0) -> float:
    """How many 95 % intervals hold the truth at least: within 3 standard deviations, and less for small samples."""
    return repetitions * (0.95 - 3.0 * math.sqrt(0.95 * 0.05 / repetitions) - less)


def test_equal_runs_are_the_cheap_ones():
    """Limit: where cheap runs are accurate, the mean and the fraction are those of all cheap runs."""
    _, cheap = pairs(np.random.default_rng(1), 400, 0.9)
    found = mean_estimate(cheap[:20], cheap[:20], cheap)
    assert found.value == pytest.approx(cheap.mean(), rel=1e-12)
    assert found.correlation == pytest.approx(1.0)
    unseen = math.sqrt(unseen_outliers(20)) * cheap[:20].std(ddof=1)
    half = stats.t.ppf(0.975, 18) * math.hypot(cheap.std(ddof=1) / 20.0, unseen)
    assert found.high - found.value == pytest.approx(half, rel=1e-9)
    met = cheap < 1.5
    assert fraction_estimate(met[:20], met[:20], met).value == pytest.approx(met.mean(), rel=1e-12)


def test_a_linear_relation_is_removed():
    """Contract: of accurate = 2 + 3 cheap the mean is 2 + 3 times that of all cheap runs, whatever the pairs."""
    _, cheap = pairs(np.random.default_rng(2), 300, 0.9)
    found = mean_estimate(2.0 + 3.0 * cheap[:10], cheap[:10], cheap)
    assert found.value == pytest.approx(2.0 + 3.0 * cheap.mean(), rel=1e-12)


def test_useless_cheap_runs_do_no_harm():
    """Limit: with cheap runs that say nothing, or the same of all, the answer is that of the accurate runs."""
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
    """Limit: where no accurate run is, or every one is, the interval ends at 0 or 1."""
    met = np.full(20, met)
    found = fraction_estimate(met, met, np.full(200, met[0]))
    assert (found.high if met[0] else found.low) == float(met[0])
    assert 0.0 < found.width < 0.2


@pytest.mark.parametrize("correlated", [0.6, 0.95])
def test_intervals_cover(correlated):
    """Limit: of 200 repetitions 95 % hold the truth (within 3 standard deviations, and 2 % for small samples)."""
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


def test_the_split_of_a_budget():
    """Closed form: sqrt(rho^2/(1 - rho^2) w/w_cheap) cheap runs for each accurate one, and the variance is least there."""
    rho, accurate, cheap, budget = 0.9, 2.0, 0.02, 1000.0
    ratio = cost_ratio(rho, accurate, cheap)
    assert ratio == pytest.approx(math.sqrt(0.81 / 0.19 * 100.0))
    verified, screened = split(budget, rho, accurate, cheap)
    assert verified * accurate + screened * cheap <= budget
    assert screened / verified == pytest.approx(ratio, rel=0.02)

    def variance(m: float) -> float:
        n = (budget - m * accurate) / cheap
        return (1.0 - rho**2) / m + rho**2 / n

    assert variance(verified) <= min(variance(0.8 * verified), variance(1.2 * verified))
    assert cost_ratio(0.0, accurate, cheap) == cost_ratio(math.nan, accurate, cheap) == 1.0
    assert math.isnan(correlation(np.ones(5), np.arange(5.0)))


def _blurred(z, numbers):
    return z, z + 0.02 * numbers.standard_normal(z.size)


def _biased(z, numbers):
    return z, 1.4 * z - 0.3 + 0.05 * numbers.standard_normal(z.size)


def _with_strangers(z, numbers):
    cheap = z + 0.02 * numbers.standard_normal(z.size)
    return z, np.where(numbers.random(z.size) < 0.02, numbers.standard_normal(z.size) - 0.4, cheap)


def _worse_far_away(z, numbers):
    return z, z + (0.01 + 0.3 * np.abs(z)) * numbers.standard_normal(z.size)


def _whole_numbers(z, numbers):
    cheap = np.round(3.0 * z)
    return cheap + numbers.integers(-1, 2, z.size) + 0.5, cheap + 0.5


WORLDS = [_blurred, _biased, _with_strangers, _worse_far_away, _whole_numbers]


@pytest.mark.parametrize("world", WORLDS)
@pytest.mark.parametrize(("pairs", "screened"), [(16, 200), (48, 800)])
def test_intervals_of_margins_cover(world, pairs, screened):
    """Limit: of 120 repetitions 95 % hold the truth (within 3 standard deviations, and 1 % for small samples)."""
    numbers = np.random.default_rng(3)
    truth = float(np.mean(world(numbers.standard_normal(400_000) - 0.4, numbers)[0] > 0.0))
    held, repetitions = 0, 120
    for _ in range(repetitions):
        accurate, cheap = world(numbers.standard_normal(screened) - 0.4, numbers)
        found = fraction_by_margins(accurate[:pairs], cheap[:pairs], cheap)
        held += found.low <= truth <= found.high
    assert held >= least_held(repetitions, 0.01)


def test_margins_say_more_than_yes_and_no():
    """Limit: where runs differ little, the interval is hardly wider than that of the cheap runs alone."""
    numbers = np.random.default_rng(4)
    accurate, cheap = _blurred(numbers.standard_normal(6000) - 0.4, numbers)
    by_margins = fraction_by_margins(accurate[:96], cheap[:96], cheap)
    by_strata = fraction_estimate(accurate[:96] > 0.0, cheap[:96] > 0.0, cheap > 0.0)
    alone = 2.0 * 1.96 * math.sqrt(by_margins.value * (1.0 - by_margins.value) / 6000)
    assert alone < by_margins.width < 1.25 * alone
    assert by_margins.width < 0.6 * by_strata.width
    assert by_margins.saved > 2.5 * by_strata.saved


@pytest.mark.parametrize(
    "spoilt",
    [
        lambda accurate, cheap: (accurate[:15], cheap[:15]),
        lambda accurate, cheap: (np.append(accurate[:40], np.inf), np.append(cheap[:40], 1.0)),
        lambda accurate, cheap: (cheap[40:80], cheap[:40]),
        lambda accurate, cheap: (np.where(np.arange(40) % 2 == 0, -1e-3, 1e-1 * cheap[:40]), cheap[:40]),
    ],
    ids=["few", "infinite", "unlike", "contradicted"],
)
def test_where_margins_say_nothing(spoilt):
    """Limit: few pairs, infinite margins, weak correlation or pairs that contradict leave the estimate of yes and no."""
    numbers = np.random.default_rng(5)
    accurate, paired = spoilt(*_blurred(np.abs(numbers.standard_normal(400)), numbers))
    cheap = np.append(paired, np.abs(numbers.standard_normal(300)))
    found = fraction_by_margins(accurate, paired, cheap)
    assert found == fraction_estimate(accurate > 0.0, paired > 0.0, cheap > 0.0)


def test_margins_of_equal_runs_are_the_cheap_ones():
    """Limit: where cheap runs are accurate the fraction is that of all cheap runs."""
    cheap = np.random.default_rng(6).standard_normal(500)
    found = fraction_by_margins(cheap[:40], cheap[:40], cheap)
    assert found.value == pytest.approx(np.mean(cheap > 0.0), abs=1e-12)
