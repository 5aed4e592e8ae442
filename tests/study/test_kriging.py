"""Kriging against brute force and known functions."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.contour import ContourSet
from matplotlib.legend import Legend
from scipy.stats import qmc
from sklearn.gaussian_process import GaussianProcessRegressor

from scissordyn.plot.study import feasibility_map
from scissordyn.study.answer.surface import Surfaces
from scissordyn.study.answer.verdict import by_point
from scissordyn.study.compute.interpolation import Kriging
from study.test_answer import made_up
from study.test_conclusion import proportional

PLAIN = np.array([False, False])


def points(count: int, seed: int = 1) -> np.ndarray:
    """Of a Sobol sequence on [1, 3] x [10, 20]."""
    drawn = qmc.Sobol(2, rng=np.random.default_rng(seed)).random(count)
    return np.array([1.0, 10.0]) + drawn * np.array([2.0, 10.0])


def smooth(x: np.ndarray) -> np.ndarray:
    """Between 1 and 3."""
    return 2.0 + np.sin(x[:, 0]) * np.cos(0.3 * x[:, 1])


def test_a_smooth_function_is_predicted() -> None:
    """Closed form: 32 points predict others of sin x cos y to 2 %, and what they were given themselves."""
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
    """Cross-check: the closed form is what a process with the same correlation predicts without the point."""
    x = points(16)
    y = smooth(x) + 0.05 * np.random.default_rng(3).standard_normal(16)
    found = Kriging(x, y, PLAIN)
    unit = (x - x.min(axis=0)) / np.ptp(x, axis=0)
    for k in (0, 7, 15):
        kept = np.arange(16) != k
        process = GaussianProcessRegressor(found.process.kernel_, optimizer=None, alpha=1e-10)
        process.fit(unit[kept], ((y - y.mean()) / y.std())[kept])
        guess, deviation = process.predict(unit[[k]], return_std=True)
        assert found.left_out[k, 0] == pytest.approx(y.mean() + y.std() * guess[0], rel=1e-6)
        assert found.left_out[k, 1] == pytest.approx(y.std() * deviation[0], rel=1e-4)


def test_intervals_cover_noise() -> None:
    """Closed form: about 95 % of noisy points left out are within 1.96 standard deviations."""
    hits = 0
    for seed in range(6):
        x = points(32, seed)
        y = smooth(x) + 0.1 * np.random.default_rng(seed).standard_normal(32)
        left_out = Kriging(x, y, PLAIN).left_out
        hits += int(np.sum(np.abs(y - left_out[:, 0]) < 1.96 * left_out[:, 1]))
    assert 0.90 * 192 <= hits <= 0.99 * 192


def test_noise_is_not_predicted_and_far_points_are_uncertain() -> None:
    """Closed form: pure noise has no predicted share; beyond the data the deviation grows."""
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
    """Closed form: peak force 4e6 c over clearance and speed; the line of 1000 N is at 0.25 mm, and the field is the plane."""
    described, found = proportional(1000.0)
    points = by_point(described, found)
    field, bounds = Surfaces(described, points).of_map("peak_force")
    assert field is not None
    np.testing.assert_allclose(field.mean, np.tile(4e6 * field.x, (field.y.size, 1)), rtol=0.01)
    assert field.x.min() == points["A.clearance"].values.min()
    assert [bound.label for bound in bounds] == ["peak_force < 500 N"]
    (axes,) = feasibility_map(points, colour="peak_force", field=field, bounds=bounds)
    assert "kriging" in axes.get_title(loc="left")
    lines = [one for one in axes.collections if isinstance(one, ContourSet) and not one.filled]
    across = np.concatenate([path.vertices[:, 0] for one in lines for path in one.get_paths()])
    np.testing.assert_allclose(across, 0.25, rtol=0.01)
    assert Surfaces(described, points).of_map("met")[0] is None
    noise = made_up(described, 100.0 + np.random.default_rng(1).random(24))
    assert Surfaces(described, by_point(described, noise)).of_map("peak_force") == (None, [])


def test_members_that_disagree_are_marked_beside_the_lines() -> None:
    """Contract: a picture has both legends, that of the requirement's line and that of the marks."""
    described, found = proportional(1000.0)
    points = by_point(described, found)
    points["disagrees"] = points["disagrees"].copy(data=np.arange(24) == 3)
    field, bounds = Surfaces(described, points).of_map("peak_force")
    (axes,) = feasibility_map(points, colour="peak_force", field=field, bounds=bounds)
    figure = axes.get_figure(root=True)
    assert figure is not None
    legends = [one for one in (*axes.get_children(), *figure.legends) if isinstance(one, Legend)]
    texts = [text.get_text() for one in legends for text in one.get_texts()]
    assert "members disagree" in texts
    assert "peak_force < 500 N" in texts
