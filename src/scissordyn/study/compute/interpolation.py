"""Interpolation of responses between runs by kriging, and what it says of cases that were not run.

A Gaussian process of scikit-learn: anisotropic Matern 5/2 correlation and noise, with the lengths and variances of largest
likelihood (Rasmussen and Williams, Gaussian Processes for Machine Learning, 2006, chapters 2 and 5). Between cheap runs it is
the third and cheapest model of an estimate, over all numbers that vary, chosen and uncertain. Runs are predicted in four
groups, each by an interpolation between runs of the others, which predicts a fourth of the further cases too: what it misses
there is what it misses of its group, in the mean. Nothing else is believed of it: `control_variate` takes this mean, and where
interpolation says little it changes little. Residuals of runs that are left out one by one would not do: they depend on each
other.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import xarray as xr

from scissordyn.study.answer.control_variate import Predicted
from scissordyn.study.answer.trend import CLEAR
from scissordyn.study.ask.description import Study
from scissordyn.study.ask.design import Design
from scissordyn.study.ask.requirement import Response, response_values
from scissordyn.study.compute.table import column

LEAST = 8  # Points from which a response is interpolated
MOST = 300  # Points up to which it is: the effort grows with their third power
STARTS = (0.3, 1.0)  # Correlation lengths of the unit cube from which the likelihood is climbed
PART = 4096  # Points that are predicted at once

LENGTHS = (0.05, 20.0)
NOISE = (1e-8, 1.0)
VARIANCES = (1e-2, 1e4)

FACTOR = 5.0  # Ratio of largest to smallest of positive values from which their logarithm is interpolated


class Kriging:
    """A response as a function of numbers, interpolated between points.

    Shapes: `x` (n, numbers), `values` (n,), `logarithmic` (numbers,), `left_out` (n,).
    """

    def __init__(self, x: np.ndarray, values: np.ndarray, logarithmic: np.ndarray) -> None:
        self._log = np.asarray(logarithmic, bool)
        terms = self._terms(x)
        self._low, self._width = terms.min(axis=0), np.maximum(np.ptp(terms, axis=0), 1e-300)
        self.of_logarithm = bool(values.min() > 0.0 and values.max() > FACTOR * values.min())
        y = np.log(values) if self.of_logarithm else np.asarray(values, float)
        self._shift, self._scale = float(y.mean()), float(y.std()) or 1.0
        self.process = _likeliest(self._unit(x), (y - self._shift) / self._scale)
        self._leave_out(values)

    def predict(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Response and standard deviation of the prediction.

        Shapes: `x` (m, numbers); returns `mean, deviation` (m,).
        """
        mean, deviation = self.process.predict(self._unit(x), return_std=True)
        y, deviation = self._shift + self._scale * mean, self._scale * deviation
        return (np.exp(y), np.exp(y) * deviation) if self.of_logarithm else (y, deviation)

    def expected(self, x: np.ndarray) -> np.ndarray:
        """Response at many points, without its uncertainty.

        Shapes: `x` (m, numbers).
        """
        parts = [self.process.predict(self._unit(part)) for part in np.array_split(x, max(1, x.shape[0] // PART))]
        y = self._shift + self._scale * np.concatenate(parts)
        return np.exp(y) if self.of_logarithm else y

    def _terms(self, x: np.ndarray) -> np.ndarray:
        return np.where(self._log, np.log(np.where(self._log, x, 1.0)), x)

    def _unit(self, x: np.ndarray) -> np.ndarray:
        return np.asarray((self._terms(x) - self._low) / self._width)

    def _leave_out(self, values: np.ndarray) -> None:
        """Predictions of each point by the others, in closed form (Rasmussen and Williams, equations 5.10 to 5.12)."""
        inverse = np.linalg.inv(self.process.L_ @ self.process.L_.T)
        y = self._shift + self._scale * (self.process.y_train_ - self.process.alpha_ / np.diag(inverse))
        self.left_out = np.exp(y) if self.of_logarithm else y
        errors = values - self.left_out
        spread = float(np.sum((values - values.mean()) ** 2))
        self.predicted = 1.0 - float(np.sum(errors**2)) / spread if spread > 0.0 else 0.0
        self.error = float(np.sqrt(np.mean(errors**2)) / max(float(np.mean(np.abs(values))), 1e-300))


def _likeliest(x: np.ndarray, y: np.ndarray) -> Any:
    """The process of the largest likelihood."""
    from sklearn.exceptions import ConvergenceWarning
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import ConstantKernel, Matern, WhiteKernel

    processes = []
    for start in STARTS:
        correlation = Matern([start] * x.shape[1], LENGTHS, nu=2.5)
        kernel = ConstantKernel(1.0, VARIANCES) * correlation + WhiteKernel(1e-4, NOISE)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ConvergenceWarning)  # a number at its bound: a length without influence
            processes.append(GaussianProcessRegressor(kernel, alpha=1e-10).fit(x, y))
    return max(processes, key=lambda process: process.log_marginal_likelihood_value_)


FEWEST = 32  # Runs between which is interpolated

GROUPS = 4

FITTED = 128  # Runs at most to which kriging is fitted: its effort grows with their third power
OTHERS = 2**16  # Cases that are predicted


class Interpolation:
    """Responses of cheap runs, what others say of each, and those of further cases of the same study.

    Shapes: `x` (n, numbers), `further` (m, numbers), `logarithmic` (numbers,).
    """

    def __init__(self, x: np.ndarray, further: np.ndarray, logarithmic: np.ndarray, runs: xr.Dataset) -> None:
        self._x, self._further, self._logarithmic, self._runs = x, further, logarithmic, runs
        self.response = cache(self._response)

    def unpredicted(self, wanted: Response) -> float:
        """Part of the variance of a response that the other runs do not predict; 1 where nothing is interpolated."""
        predicted = self.response(wanted)
        if predicted is None:
            return 1.0
        values = response_values(self._runs, wanted)
        return min(1.0, float(np.mean((values - predicted.of_runs) ** 2) / np.var(values)))

    def _response(self, wanted: Response) -> Predicted | None:
        """A response at the runs and at the further cases; None where it is not finite, or does not vary."""
        values = response_values(self._runs, wanted)
        if not np.all(np.isfinite(values)) or np.ptp(values) == 0.0:
            return None
        of_runs, others = [], []
        # parts that follow each other: every fourth point of a Sobol sequence fills a fourth of the cube alone
        parts = (np.array_split(np.arange(x.shape[0]), GROUPS) for x in (self._x, self._further))
        for here, there in zip(*parts, strict=True):
            fitted = np.setdiff1d(np.arange(values.size), here)[:FITTED]
            model = Kriging(self._x[fitted], values[fitted], self._logarithmic)
            of_runs.append(model.expected(self._x[here]))
            others.append(model.expected(self._further[there]))
        return Predicted(np.concatenate(of_runs), np.concatenate(others))


def between_points(study: Study, points: xr.Dataset, response: str) -> Kriging | None:
    """A response between the points of a study; None where they do not predict each other, or names vary."""
    names = study.paths
    if not names or any(factor.labels for factor in study.factors):
        return None
    x, values = np.stack([points[name].values for name in names], axis=1), points[response].values
    if np.isinf(values).any():  # points without a number would read as if the others went on there
        return None
    there = np.isfinite(values) & np.all(np.isfinite(x), axis=1)
    sizes = [np.unique(column_of[there]).size for column_of in x.T]
    if not max(LEAST, 2 * len(names) + 2) <= there.sum() <= MOST or min(sizes) < 2 or np.ptp(values[there]) == 0.0:
        return None
    model = Kriging(x[there], values[there], np.array([factor.logarithmic for factor in study.factors]))
    return model if model.predicted >= CLEAR else None


def interpolation(study: Study, results: xr.Dataset, cases: Sequence[int] | np.ndarray) -> Interpolation | None:
    """Interpolation between runs of a study; None where they are few, or where names vary, between which there is nothing."""
    varied = study.varied
    if len(cases) < max(FEWEST, 4 * len(varied)) or any(factor.labels for factor in varied):
        return None
    numbers = _evenly_spread(study).numbers(np.arange(OTHERS))
    runs = results.isel(case=np.asarray(cases))
    return Interpolation(
        np.stack([runs[column(name)].values for name in study.factor_names], axis=1),
        np.stack([numbers[name] for name in study.factor_names], axis=1),
        np.array([factor.logarithmic for factor in varied]),
        runs,
    )


def _evenly_spread(study: Study) -> Study:
    """The study with the further cases, a Sobol sequence over all numbers."""
    sampling = study.sampling
    if not study.factors:
        return replace(study, sampling=replace(sampling, kind="sobol", samples=OTHERS))
    return replace(
        study,
        design=Design("sobol", OTHERS, study.design.seed),
        sampling=sampling if sampling.common else replace(sampling, kind="sobol"),
    )
