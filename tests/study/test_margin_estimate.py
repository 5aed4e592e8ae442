"""Fractions from the margins of cheap and accurate runs: limits, and how often their intervals hold the truth."""

import math

import numpy as np
import pytest

from scissordyn.study.answer.control_variate import fraction_by_margins, fraction_estimate


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
def test_intervals_cover(world, pairs, screened):
    """Limit: of 120 repetitions 95 % hold the truth (within 3 standard deviations, and 1 % for small samples)."""
    numbers = np.random.default_rng(3)
    truth = float(np.mean(world(numbers.standard_normal(400_000) - 0.4, numbers)[0] > 0.0))
    held, repetitions = 0, 120
    for _ in range(repetitions):
        accurate, cheap = world(numbers.standard_normal(screened) - 0.4, numbers)
        found = fraction_by_margins(accurate[:pairs], cheap[:pairs], cheap)
        held += found.low <= truth <= found.high
    assert held >= repetitions * (0.95 - 3.0 * math.sqrt(0.95 * 0.05 / repetitions) - 0.01)


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


def test_equal_runs_are_the_cheap_ones():
    """Limit: where cheap runs are accurate the fraction is that of all cheap runs."""
    cheap = np.random.default_rng(6).standard_normal(500)
    found = fraction_by_margins(cheap[:40], cheap[:40], cheap)
    assert found.value == pytest.approx(np.mean(cheap > 0.0), abs=1e-12)
