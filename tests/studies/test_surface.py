"""Surfaces of responses between points, compared with brute force and known functions."""

import sys

import numpy as np
import pytest
from matplotlib.contour import ContourSet
from matplotlib.legend import Legend
from scipy.stats import qmc
from sklearn.gaussian_process import GaussianProcessRegressor

from scissordyn.plot.study import feasibility_map
from scissordyn.studies.answer.surface import Surface, surfaces
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
    unit = (x - x.min(axis=0)) / np.ptp(x, axis=0)
    for k in (0, 7, 15):
        kept = np.arange(16) != k
        process = GaussianProcessRegressor(found.process.kernel_, optimizer=None)
        process.fit(unit[kept], ((y - y.mean()) / y.std())[kept])
        assert found.left_out[k] == pytest.approx(y.mean() + y.std() * process.predict(unit[[k]])[0], rel=1e-6)


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


def test_maps_without_scikit_learn(monkeypatch):
    """Contract: without the package maps show the points alone."""
    for name in [name for name in sys.modules if name.split(".")[0] == "sklearn"]:
        monkeypatch.setitem(sys.modules, name, None)
    assert surfaces(result_of(*proportional(1000.0)), "peak_force") == (None, [])
