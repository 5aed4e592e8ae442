"""Interpolation between cheap runs as the third model of an estimate: limits, and how often intervals hold the truth."""

from __future__ import annotations

import math

import numpy as np
import pytest
import xarray as xr

import scissordyn as sd
from scissordyn.study.answer.control_variate import Predicted, cost_ratio, fraction_by_margins, mean_estimate, population_mean
from scissordyn.study.ask.requirement import Response
from scissordyn.study.compute.interpolation import FEWEST, GROUPS, Interpolation, interpolation

FORCE = Response("peak_force")


def curved(x: np.ndarray) -> np.ndarray:
    """A response with a jump, of the mean `MEAN`."""
    return np.asarray(np.exp(x[:, 0]) * (1.0 + x[:, 1] ** 2) + 0.2 * (x[:, 0] + x[:, 1] > 1.2))


MEAN = (math.e - 1.0) * 4.0 / 3.0 + 0.2 * 0.32


def between(x: np.ndarray, further: np.ndarray) -> Interpolation:
    """Between runs whose response is `curved`."""
    runs = xr.Dataset({"peak_force": (("case", "joint"), curved(x)[:, None], {"role": "measure"})}, {"joint": ["A"]})
    return Interpolation(x, further, np.zeros(2, bool), runs)


def test_a_perfect_prediction_is_the_mean_of_all_others() -> None:
    """Limit: of exact predictions the mean is that of the further cases; of ones that say nothing, that of the runs."""
    numbers = np.random.default_rng(1)
    cheap, others = numbers.standard_normal(100), numbers.standard_normal(5000)
    value, variance = population_mean(cheap, Predicted(cheap, others))
    assert value == pytest.approx(others.mean(), rel=1e-12)
    assert variance == pytest.approx(others.var(ddof=1) / 5000, rel=1e-9)
    for useless in (None, Predicted(np.ones(100), np.ones(5000))):
        assert population_mean(cheap, useless) == pytest.approx((cheap.mean(), cheap.var(ddof=1) / 100))
    value, variance = population_mean(cheap, Predicted(numbers.standard_normal(100), others))
    assert abs(value - cheap.mean()) < 0.05
    assert variance == pytest.approx(cheap.var(ddof=1) / 100, rel=0.1)


def test_no_run_predicts_itself() -> None:
    """Contract: what a run answers changes what is predicted of the other groups, and nothing of its own."""
    numbers = np.random.default_rng(2)
    x, further = numbers.random((40, 2)), numbers.random((80, 2))
    plain, changed = between(x, further), between(x, further)
    changed._runs["peak_force"][5] = 9.0
    before, after = plain.response(FORCE), changed.response(FORCE)
    own, there = np.arange(40) < 40 // GROUPS, np.arange(80) < 80 // GROUPS
    np.testing.assert_array_equal(before.of_runs[own], after.of_runs[own])
    np.testing.assert_array_equal(before.others[there], after.others[there])
    assert np.all(before.of_runs[~own] != after.of_runs[~own])


def test_intervals_cover() -> None:
    """Limit: of 40 repetitions 95 % hold the truth (within 3 standard deviations), with less than a third of the width."""
    numbers, held, narrower = np.random.default_rng(3), [0, 0], []
    truth = float(np.mean(curved(numbers.random((400_000, 2))) < 2.0))
    for _ in range(40):
        x = numbers.random((64, 2))
        predicted, cheap = between(x, numbers.random((20_000, 2))).response(FORCE), curved(x)
        accurate = cheap[:24] + 1e-3 * numbers.standard_normal(24)
        found, alone = mean_estimate(accurate, cheap[:24], cheap, predicted), mean_estimate(accurate, cheap[:24], cheap)
        held[0] += found.low <= MEAN <= found.high
        narrower.append(found.width / alone.width)
        margins = Predicted(2.0 - predicted.of_runs, 2.0 - predicted.others)
        fraction = fraction_by_margins(2.0 - accurate, 2.0 - cheap[:24], 2.0 - cheap, margins)
        held[1] += fraction.low <= truth <= fraction.high
    assert np.median(narrower) < 0.33
    assert min(held) >= 40 * (0.95 - 3.0 * math.sqrt(0.95 * 0.05 / 40))


def test_a_study_is_interpolated(tmp_path) -> None:
    """Contract: further cases are spread over all that varies as its runs are; few runs are not interpolated."""
    arm = sd.scissor(units=2).with_clearance("A", sd.Clearance(0.5e-3)).driven(speed=sd.rpm(150))
    found = sd.study(
        arm,
        {"A.clearance": (0.05e-3, 0.4e-3), "drive.speed": "100..200 rpm"},
        uncertain={"A.damping.restitution": "uniform(0.5, 0.9)"},
        common=False,
        until=0.002,
        points=48,
        design="random",
        seed=1,
        engine=1,
        requirements={"peak_force": 30e3},
        store=tmp_path / "study.db",
    )
    few, some = (interpolation(found.study, found.dataset, np.arange(size)) for size in (FEWEST - 1, 40))
    assert few is None
    assert some.unpredicted(FORCE) < 0.3
    low, high = np.array([0.05e-3, sd.rpm(100), 0.5]), np.array([0.4e-3, sd.rpm(200), 0.9])
    assert some._further.mean(axis=0) == pytest.approx(0.5 * (low + high), rel=1e-3)
    parts = np.floor(4.0 * (some._further - low) / (high - low)).astype(int)
    for part in np.array_split(parts, GROUPS):  # each of which one interpolation predicts
        np.testing.assert_array_equal(np.histogramdd(part, bins=4)[0], part.shape[0] / 64)


def test_cheap_runs_that_are_predicted_are_needed_less() -> None:
    """Closed form: with a hundredth of the variance left a tenth as many cheap runs for each accurate one."""
    assert cost_ratio(0.99, 10.0, 0.1, 0.01) == pytest.approx(0.1 * cost_ratio(0.99, 10.0, 0.1), rel=1e-12)
