"""What interpolation between cheap runs says of cases that were not run: the third and cheapest model of an estimate.

Kriging of each response over all numbers that vary, chosen and uncertain. Runs are predicted in four groups, each by an
interpolation between runs of the others, which predicts a fourth of the further cases too: what it misses there is what it
misses of its group, in the mean. Nothing else is believed of it: `control_variate` takes this mean, and where interpolation
says little it changes little. Residuals of runs that are left out one by one would not do: they depend on each other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np
import xarray as xr

from scissordyn.study.answer.control_variate import Predicted
from scissordyn.study.ask.description import Study
from scissordyn.study.ask.design import Design
from scissordyn.study.ask.requirement import Response, response_values
from scissordyn.study.compute.kriging import Kriging
from scissordyn.study.compute.table import column

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


def interpolation(study: Study, results: xr.Dataset, cases: Sequence[int] | np.ndarray) -> Interpolation | None:
    """Interpolation between runs of a study; None where they are few, or where names vary, between which there is nothing."""
    varied = (*study.factors, *study.uncertain)
    if len(cases) < max(FEWEST, 4 * len(varied)) or any(factor.labels for factor in varied):
        return None
    numbers = _evenly_spread(study).numbers(np.arange(OTHERS)).values
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
