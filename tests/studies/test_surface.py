"""Surfaces of responses between points, compared with brute force and known functions."""

import numpy as np
import pytest
from matplotlib.contour import ContourSet
from matplotlib.legend import Legend
from scipy.stats import qmc
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import ConstantKernel, Matern, WhiteKernel

from scissordyn.plot.study import feasibility_map
from scissordyn.studies.answer.process import correlation
from scissordyn.studies.answer.response_map import surfaces
from scissordyn.studies.answer.surface import Surface
from scissordyn.studies.answer.verdict import by_point
from studies.test_answer import made_up, result_of
from studies.test_conclusion import proportional

NOT_LOGARITHMIC = np.array([False, False])  # No factor varies on a logarithmic scale


def points(count, seed=1):
    """Return points of a Sobol sequence on [1, 3] x [10, 20]."""
    drawn = qmc.Sobol(2, rng=np.random.default_rng(seed)).random(count)
    return np.array([1.0, 10.0]) + drawn * np.array([2.0, 10.0])


def smooth(x):
    """Return a smooth function with values between 1 and 3."""
    return 2.0 + np.sin(x[:, 0]) * np.cos(0.3 * x[:, 1])


def slopes(x):
    """Return the derivatives of `smooth`."""
    across, up = np.cos(x[:, 0]) * np.cos(0.3 * x[:, 1]), -0.3 * np.sin(x[:, 0]) * np.sin(0.3 * x[:, 1])
    return np.stack([across, up], axis=1)


@pytest.mark.parametrize("known", [False, True])
def test_equal_points_are_left_out_together(known):
    """Identity: a point that was computed twice has the same prediction without its data as one that was computed once.

    Each of equal values predicted the other, so that a surface of noise had no error.
    """
    x, lengths = points(16)[:12], NOT_LOGARITHMIC
    noise = np.random.default_rng(4).standard_normal(12)
    once, twice = (
        Surface(np.tile(x, (n, 1)), np.tile(noise, n), lengths, np.tile(slopes(x), (n, 1)) if known else None) for n in (1, 2)
    )
    assert max(once.predicted, twice.predicted) < 0.5
    assert twice.left_out[:12] == pytest.approx(twice.left_out[12:], rel=1e-6)


def test_prediction_of_a_smooth_function():
    """Closed form: 32 points predict others of sin x cos y to 2 %, and reproduce themselves."""
    x = points(32)
    found = Surface(x, smooth(x), NOT_LOGARITHMIC)
    new = points(256, 2)
    mean, deviation = found.predict(new)
    np.testing.assert_allclose(mean, smooth(new), rtol=0.02)
    np.testing.assert_allclose(found.predict(x)[0], smooth(x), rtol=1e-4)
    assert found.predicted > 0.99
    assert found.error < 0.01
    assert deviation.max() < 0.1


def test_points_left_out_are_those_of_brute_force():
    """Cross-check: predictions without a point equal those of a process fitted without it."""
    x = points(16)
    y = smooth(x) + 0.05 * np.random.default_rng(3).standard_normal(16)
    found = Surface(x, y, NOT_LOGARITHMIC)
    unit, process = (x - x.min(axis=0)) / np.ptp(x, axis=0), found.process
    kernel = ConstantKernel(process.variance) * Matern(process.lengths, nu=2.5)
    kernel += WhiteKernel(process.variance * process.noise[0])
    for k in (0, 7, 15):
        kept = np.arange(16) != k
        other = GaussianProcessRegressor(kernel, optimizer=None)
        other.fit(unit[kept], ((y - y.mean()) / y.std())[kept])
        mean, deviation = other.predict(unit[[k]], return_std=True)
        assert found.left_out[k] == pytest.approx(y.mean() + y.std() * mean[0], rel=1e-6)
    every = GaussianProcessRegressor(kernel, optimizer=None).fit(unit, (y - y.mean()) / y.std())
    mean, deviation = every.predict(unit + 0.05, return_std=True)
    np.testing.assert_allclose(process.predict(unit + 0.05), (mean, deviation), rtol=1e-6)


def test_correlations_of_derivatives_are_slopes_of_those_of_values():
    """Cross-check: central differences of scikit-learn's Matern kernel."""
    draw = np.random.default_rng(4)
    a, b, lengths, step = draw.random((5, 2)), draw.random((4, 2)), np.array([0.5, 1.7]), 1e-4
    values, shifts = Matern(lengths, nu=2.5), step * np.eye(2)
    found = correlation(a, b, lengths)
    np.testing.assert_allclose(found[0, :, 0], values(a, b), rtol=1e-12)
    for i in range(2):
        for other, own in ((found[1 + i, :, 0], 1.0), (found[0, :, 1 + i], -1.0)):
            np.testing.assert_allclose(
                other, own * (values(a + shifts[i], b) - values(a - shifts[i], b)) / (2.0 * step), atol=1e-6
            )
        for j in range(2):
            four = [p * q * values(a + p * shifts[i], b + q * shifts[j]) for p in (-1.0, 1.0) for q in (-1.0, 1.0)]
            np.testing.assert_allclose(found[1 + i, :, 1 + j], sum(four) / (4.0 * step**2), atol=1e-5)


def test_derivatives_replace_points():
    """Known function: 16 points with derivatives predict others as well as 32 without; the error of left-out points says so."""
    new = points(256, 2)

    def error(count, *, derivatives):
        x = points(count)
        found = Surface(x, smooth(x), NOT_LOGARITHMIC, slopes(x) if derivatives else None)
        return float(np.sqrt(np.mean((found.predict(new)[0] - smooth(new)) ** 2))), found.error

    known, few = error(16, derivatives=True), error(16, derivatives=False)
    assert known[0] < min(0.3 * few[0], error(32, derivatives=False)[0])
    assert known[1] < 0.3 * few[1]


def test_points_left_out_without_their_derivatives():
    """Cross-check: the closed form of left-out points against conditional means of the other points' data."""
    x = points(8)
    known = slopes(x)
    known[4] = np.nan  # derivatives that are not valid
    found = Surface(x, smooth(x), NOT_LOGARITHMIC, known)
    process = found.process
    matrix, of_point = process._matrix(np.concatenate([process.lengths, process.noise])), np.nonzero(process.is_observed)[1]
    for k in (0, 4):
        own, rest = np.flatnonzero(of_point == k), np.flatnonzero(of_point != k)
        mean = matrix[own[:1]][:, rest] @ np.linalg.solve(matrix[np.ix_(rest, rest)], process.data[rest])
        assert found.left_out[k] == pytest.approx(smooth(x).mean() + smooth(x).std() * mean[0], rel=1e-6)


def test_wrong_derivatives_are_noise():
    """Limit: derivatives that do not belong to the values leave the surface of the values."""
    x, new = points(32), points(64, 2)
    alone = Surface(x, smooth(x), NOT_LOGARITHMIC).predict(new)[0]
    wrong = 10.0 * np.random.default_rng(6).standard_normal(x.shape)
    np.testing.assert_allclose(Surface(x, smooth(x), NOT_LOGARITHMIC, wrong).predict(new)[0], alone, atol=0.02)


def test_intervals_cover_noise():
    """Closed form: about 95 % of further noisy points are within 1.96 standard deviations."""
    hits = 0
    for seed in range(6):
        x, noise = points(64, seed), 0.1 * np.random.default_rng(seed).standard_normal(64)
        y = smooth(x) + noise
        mean, deviation = Surface(x[:32], y[:32], NOT_LOGARITHMIC).predict(x[32:])
        hits += int(np.sum(np.abs(y[32:] - mean) < 1.96 * deviation))
    assert 0.90 * 192 <= hits <= 0.99 * 192


def test_noise_is_not_predicted_and_far_points_are_uncertain():
    """Limit: noise has no predicted share; outside the data the deviation grows."""
    x = points(32)
    assert Surface(x, 1.0 + np.random.default_rng(5).random(32), NOT_LOGARITHMIC).predicted < 0.3
    found = Surface(x, smooth(x), NOT_LOGARITHMIC)
    assert found.predict(np.array([[8.0, 60.0]]))[1][0] > 10.0 * found.predict(x)[1].max()


def test_powers_are_interpolated_by_logarithms():
    """Closed form: x^3 y^-1 over two decades is a plane in logarithms, predicted to 1 %."""
    drawn = qmc.Sobol(2, rng=np.random.default_rng(1)).random(32)
    x = np.array([0.1, 1.0]) * np.array([100.0, 5.0]) ** drawn
    values = x[:, 0] ** 3 / x[:, 1]
    found = Surface(x, values, np.array([True, True]))
    assert found.of_logarithm
    known = values[:, None] * np.array([3.0, -1.0]) / x
    few = Surface(x[:6], values[:6], np.array([True, True]), known[:6])
    np.testing.assert_allclose(few.predict(x[6:])[0], values[6:], rtol=0.05)
    np.testing.assert_allclose(found.predict(x * 1.01)[0], values * 1.01**2, rtol=0.02)


def test_maps_of_few_points_are_filled():
    """Closed form: with peak force 4e6 c the line of 1000 N is at 0.25 mm, and the field is a plane."""
    described, found = proportional(1000.0)
    points = by_point(described, found)
    field, bounds = surfaces(result_of(described, found), "peak_force")
    assert field is not None
    np.testing.assert_allclose(field.mean, np.tile(4e6 * field.x, (field.y.size, 1)), rtol=0.01)
    assert field.x.min() == points["A.clearance"].values.min()
    assert [bound.label for bound in bounds] == ["peak_force < 500 N"]
    (axes,) = feasibility_map(points, colour="peak_force", field=field, bounds=bounds)
    assert "interpolated" in axes.get_title(loc="left")
    lines = [one for one in axes.collections if isinstance(one, ContourSet) and not one.filled]
    across = np.concatenate([path.vertices[:, 0] for one in lines for path in one.get_paths()])
    np.testing.assert_allclose(across, 0.25, rtol=0.01)
    assert surfaces(result_of(described, found), "met")[0] is None
    noise = made_up(described, 100.0 + np.random.default_rng(1).random(24))
    assert surfaces(result_of(described, noise), "peak_force") == (None, [])


def test_legends_of_lines_and_marks():
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
