"""Kriging compared with brute force and known functions, and as the third model of an estimate from cheap runs."""

from __future__ import annotations

import math

import numpy as np
import pytest
import xarray as xr
from matplotlib.contour import ContourSet
from matplotlib.legend import Legend
from scipy.stats import qmc
from sklearn.gaussian_process import GaussianProcessRegressor

import scissordyn as sd
from scissordyn.plot.study import feasibility_map
from scissordyn.studies.answer.estimate import (
    INTERPOLATION_RUNS_MIN,
    VALIDATION_GROUPS,
    Interpolation,
    Kriging,
    Predicted,
    cost_ratio,
    fraction_by_margins,
    interpolation,
    mean_estimate,
    population_mean,
)
from scissordyn.studies.answer.report import surfaces
from scissordyn.studies.answer.verdict import by_point
from scissordyn.studies.ask.requirement import Response
from studies.test_answer import made_up, result_of
from studies.test_conclusion import proportional
from studies.test_screening import least_held
from studies.test_study import arm

FORCE = Response("peak_force")


def curved(x: np.ndarray) -> np.ndarray:
    """Return a response with a jump, of the mean `MEAN`."""
    return np.asarray(np.exp(x[:, 0]) * (1.0 + x[:, 1] ** 2) + 0.2 * (x[:, 0] + x[:, 1] > 1.2))


MEAN = (math.e - 1.0) * 4.0 / 3.0 + 0.2 * 0.32


def between(x: np.ndarray, further: np.ndarray) -> Interpolation:
    """Return an interpolation between runs whose response is `curved`."""
    runs = xr.Dataset({"peak_force": (("case", "joint"), curved(x)[:, None], {"role": "measure"})}, {"joint": ["A"]})
    return Interpolation(x, further, np.zeros(2, bool), runs)


def test_mean_with_perfect_and_useless_predictions() -> None:
    """Limit: with exact predictions the mean is that of the further cases, with useless ones that of the runs."""
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
    """Contract: the result of a run changes the predictions of the other groups only."""
    numbers = np.random.default_rng(2)
    x, further = numbers.random((40, 2)), numbers.random((80, 2))
    plain, changed = between(x, further), between(x, further)
    changed._runs["peak_force"][5] = 9.0
    before, after = plain.response(FORCE), changed.response(FORCE)
    own, there = np.arange(40) < 40 // VALIDATION_GROUPS, np.arange(80) < 80 // VALIDATION_GROUPS
    np.testing.assert_array_equal(before.of_runs[own], after.of_runs[own])
    np.testing.assert_array_equal(before.others[there], after.others[there])
    assert np.all(before.of_runs[~own] != after.of_runs[~own])


def test_intervals_cover() -> None:
    """Limit: in 40 repetitions 95 % of the intervals hold the truth (within 3 standard deviations), at a third of the width."""
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
    assert min(held) >= least_held(40)


def test_interpolated_study(tmp_path) -> None:
    """Contract: further cases cover the ranges of the runs; few runs are not interpolated."""
    found = sd.study(
        arm(),
        {"A.clearance": (0.05e-3, 0.4e-3), "drive.speed": "100..200 rpm"},
        uncertain={"A.damping.restitution": "0.5..0.9"},
        common=False,
        until=0.002,
        points=48,
        design="random",
        seed=1,
        engine=1,
        requirements={"peak_force": 30e3},
        store=tmp_path / "study.db",
    )
    few, some = (interpolation(found.study, found.dataset, np.arange(size)) for size in (INTERPOLATION_RUNS_MIN - 1, 40))
    assert few is None
    assert some.unpredicted(FORCE) < 0.3
    low, high = np.array([0.05e-3, sd.rpm(100), 0.5]), np.array([0.4e-3, sd.rpm(200), 0.9])
    assert some._further.mean(axis=0) == pytest.approx(0.5 * (low + high), rel=1e-3)
    parts = np.floor(4.0 * (some._further - low) / (high - low)).astype(int)
    for part in np.array_split(parts, VALIDATION_GROUPS):  # each of which one interpolation predicts
        np.testing.assert_array_equal(np.histogramdd(part, bins=4)[0], part.shape[0] / 64)


def test_number_of_predicted_cheap_runs() -> None:
    """Closed form: with a hundredth of the variance left, a tenth as many cheap runs are needed for each accurate one."""
    assert cost_ratio(0.99, 10.0, 0.1, 0.01) == pytest.approx(0.1 * cost_ratio(0.99, 10.0, 0.1), rel=1e-12)


PLAIN = np.array([False, False])


def points(count: int, seed: int = 1) -> np.ndarray:
    """Return points of a Sobol sequence on [1, 3] x [10, 20]."""
    drawn = qmc.Sobol(2, rng=np.random.default_rng(seed)).random(count)
    return np.array([1.0, 10.0]) + drawn * np.array([2.0, 10.0])


def smooth(x: np.ndarray) -> np.ndarray:
    """Return a smooth function with values between 1 and 3."""
    return 2.0 + np.sin(x[:, 0]) * np.cos(0.3 * x[:, 1])


def test_prediction_of_a_smooth_function() -> None:
    """Closed form: 32 points predict others of sin x cos y to 2 %, and reproduce themselves."""
    x = points(32)
    found = Kriging(x, smooth(x), PLAIN)
    new = points(256, 2)
    mean, deviation = found.predict(new)
    np.testing.assert_allclose(mean, smooth(new), rtol=0.02)
    np.testing.assert_allclose(found.predict(x)[0], smooth(x), rtol=1e-4)
    assert found.predicted > 0.99
    assert found.error < 0.01
    assert deviation.max() < 0.1


def test_points_left_out_are_those_of_brute_force() -> None:
    """Cross-check: predictions without a point equal those of a process fitted without it."""
    x = points(16)
    y = smooth(x) + 0.05 * np.random.default_rng(3).standard_normal(16)
    found = Kriging(x, y, PLAIN)
    unit = (x - x.min(axis=0)) / np.ptp(x, axis=0)
    for k in (0, 7, 15):
        kept = np.arange(16) != k
        process = GaussianProcessRegressor(found.process.kernel_, optimizer=None, alpha=1e-10)
        process.fit(unit[kept], ((y - y.mean()) / y.std())[kept])
        assert found.left_out[k] == pytest.approx(y.mean() + y.std() * process.predict(unit[[k]])[0], rel=1e-6)


def test_intervals_cover_noise() -> None:
    """Closed form: about 95 % of further noisy points are within 1.96 standard deviations."""
    hits = 0
    for seed in range(6):
        x, noise = points(64, seed), 0.1 * np.random.default_rng(seed).standard_normal(64)
        y = smooth(x) + noise
        mean, deviation = Kriging(x[:32], y[:32], PLAIN).predict(x[32:])
        hits += int(np.sum(np.abs(y[32:] - mean) < 1.96 * deviation))
    assert 0.90 * 192 <= hits <= 0.99 * 192


def test_noise_is_not_predicted_and_far_points_are_uncertain() -> None:
    """Limit: noise has no predicted share; outside the data the deviation grows."""
    x = points(32)
    assert Kriging(x, 1.0 + np.random.default_rng(5).random(32), PLAIN).predicted < 0.3
    found = Kriging(x, smooth(x), PLAIN)
    assert found.predict(np.array([[8.0, 60.0]]))[1][0] > 10.0 * found.predict(x)[1].max()


def test_powers_are_interpolated_by_logarithms() -> None:
    """Closed form: x^3 y^-1 over two decades is a plane in logarithms, predicted to 1 %."""
    drawn = qmc.Sobol(2, rng=np.random.default_rng(1)).random(32)
    x = np.array([0.1, 1.0]) * np.array([100.0, 5.0]) ** drawn
    values = x[:, 0] ** 3 / x[:, 1]
    found = Kriging(x, values, np.array([True, True]))
    assert found.of_logarithm
    np.testing.assert_allclose(found.predict(x * 1.01)[0], values * 1.01**2, rtol=0.02)


def test_maps_of_few_points_are_filled() -> None:
    """Closed form: with peak force 4e6 c the line of 1000 N is at 0.25 mm, and the field is a plane."""
    described, found = proportional(1000.0)
    points = by_point(described, found)
    field, bounds = surfaces(result_of(described, found), "peak_force")
    assert field is not None
    np.testing.assert_allclose(field.mean, np.tile(4e6 * field.x, (field.y.size, 1)), rtol=0.01)
    assert field.x.min() == points["A.clearance"].values.min()
    assert [bound.label for bound in bounds] == ["peak_force < 500 N"]
    (axes,) = feasibility_map(points, colour="peak_force", field=field, bounds=bounds)
    assert "kriging" in axes.get_title(loc="left")
    lines = [one for one in axes.collections if isinstance(one, ContourSet) and not one.filled]
    across = np.concatenate([path.vertices[:, 0] for one in lines for path in one.get_paths()])
    np.testing.assert_allclose(across, 0.25, rtol=0.01)
    assert surfaces(result_of(described, found), "met")[0] is None
    noise = made_up(described, 100.0 + np.random.default_rng(1).random(24))
    assert surfaces(result_of(described, noise), "peak_force") == (None, [])


def test_legends_of_lines_and_marks() -> None:
    """Contract: a picture has legends of the requirement's line and of the marks."""
    described, found = proportional(1000.0)
    points = by_point(described, found)
    points["disagrees"] = points["disagrees"].copy(data=np.arange(24) == 3)
    field, bounds = surfaces(result_of(described, found), "peak_force")
    (axes,) = feasibility_map(points, colour="peak_force", field=field, bounds=bounds)
    figure = axes.get_figure(root=True)
    assert figure is not None
    legends = [one for one in (*axes.get_children(), *figure.legends) if isinstance(one, Legend)]
    texts = [text.get_text() for one in legends for text in one.get_texts()]
    assert "members disagree" in texts
    assert "peak_force < 500 N" in texts
