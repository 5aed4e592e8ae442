"""Answers of a study of cheap and accurate runs: which number comes from which, and what both together say."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from scissordyn.plot.scale import Scale, scale_of
from scissordyn.study.answer.control_variate import (
    Estimate,
    Predicted,
    fraction_by_margins,
    fraction_estimate,
    mean_estimate,
    quantile_estimates,
)
from scissordyn.study.answer.fact import Fact, Section
from scissordyn.study.answer.verdict import answered
from scissordyn.study.ask.description import Study
from scissordyn.study.ask.requirement import Requirement, Response, response_unit, response_values
from scissordyn.study.compute.interpolation import OTHERS, Interpolation, interpolation
from scissordyn.study.compute.optimise import candidates, judged, nondominated
from scissordyn.study.compute.store import COMPLETE, Store
from scissordyn.study.compute.table import column

if TYPE_CHECKING:
    import pandas as pd

LEVELS = (0.5, 0.95)  # Of the quantiles
TINY = 1e-9  # Margin of a case that stands at the bound


@dataclass(frozen=True)
class Corrected:
    """A number of a study from cheap and accurate runs."""

    label: str
    kind: str  # One of "fraction", "mean", "quantile"
    units: str
    estimate: Estimate


def estimates(study: Study, cheap: xr.Dataset, accurate: xr.Dataset) -> list[Corrected]:
    """Fractions that meet the requirements, means and quantiles of the responses, each from both kinds of runs."""
    trials, size = _trials(study, cheap), _trials(study, accurate).shape[0]
    complete = _complete(cheap, trials)
    pairs = complete[:size] & _complete(accurate, trials[:size])
    single = trials.shape[1] == 1
    between = interpolation(study, cheap, trials[complete, 0]) if single else None

    def by_trial(results: xr.Dataset, values: np.ndarray) -> np.ndarray:
        rows = trials[: results.sizes["case"] // trials.shape[1]]
        return np.asarray(values[rows].mean(axis=1), float)

    def both(values: Callable[[xr.Dataset], np.ndarray]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        here, there = by_trial(cheap, values(cheap)), by_trial(accurate, values(accurate))
        return there[pairs], here[:size][pairs], here[complete]

    def met(requirements: Sequence[Requirement]) -> Estimate:
        if single:
            return fraction_by_margins(*both(partial(_margins, requirements)), _predicted_margins(between, requirements))
        return fraction_estimate(*both(lambda runs: np.all([requirement.met_in(runs) for requirement in requirements], axis=0)))

    numbers = [Corrected(response.label, "fraction", "1", met([response])) for response in study.requirements]
    if study.requirements:
        numbers.append(Corrected("all requirements", "fraction", "1", met(study.requirements)))
    for response in answered(study, cheap):
        three = both(partial(response_values, response=response))
        if not all(np.all(np.isfinite(estimate)) for estimate in three):
            continue
        units = response_unit(cheap, response)
        numbers.append(Corrected(f"mean {response.name}", "mean", units, mean_estimate(*three, _predicted(between, response))))
        if single:
            both_ends = zip(LEVELS, quantile_estimates(*three, LEVELS), strict=True)
            numbers += [
                Corrected(f"{level:.0%} quantile of {response.name}", "quantile", units, estimate)
                for level, estimate in both_ends
            ]
    return numbers


def _predicted(between: Interpolation | None, response: Response) -> Predicted | None:
    return between.response(response) if between is not None else None


def _predicted_margins(between: Interpolation | None, requirements: Sequence[Requirement]) -> Predicted | None:
    """The least margins by interpolation; None where one of the responses has none."""
    of_runs, others = [], []
    for requirement in requirements:
        response = _predicted(between, requirement.response)
        if response is None:
            return None
        of_runs.append(requirement.margin(response.of_runs))
        others.append(requirement.margin(response.others))
    return Predicted(np.min(of_runs, axis=0), np.min(others, axis=0))


def _margins(requirements: Sequence[Requirement], runs: xr.Dataset) -> np.ndarray:
    """The least margin of each case, positive where it meets all requirements."""
    margins = []
    for requirement in requirements:
        margin = requirement.margin_in(runs)
        margins.append(np.where(margin == 0.0, np.where(requirement.met_in(runs), TINY, -TINY), margin))
    return np.asarray(np.min(margins, axis=0))


def _trials(study: Study, results: xr.Dataset) -> np.ndarray:
    """Cases of each independent trial, shape (trials, cases of a trial)."""
    width = study.per_point if study.factors else study.members
    return np.arange(results.sizes["case"] // width * width).reshape(-1, width)


def _complete(results: xr.Dataset, trials: np.ndarray) -> np.ndarray:
    return np.asarray((results["status"].values[trials] == COMPLETE).all(axis=1))


def confirmed(study: Study, accurate: xr.Dataset, cheap: xr.Dataset) -> pd.DataFrame:
    """The points of a search that were run accurately."""
    import pandas as pd

    assert study.optimisation is not None
    names = [factor.path for factor in study.factors]
    tried = candidates(study, cheap).points
    numbers = np.stack([tried[name].values for name in names], axis=1)
    here = np.stack([study.cells(accurate[column(name)].values)[:, 0, 0] for name in names], axis=1)
    places = [int(np.flatnonzero((numbers == row).all(axis=1))[0]) for row in here]
    table = {name: here[:, k] for k, name in enumerate(names)}
    goals, violation = judged(study, accurate)
    for goal, values in zip(study.optimisation.goals, goals.T, strict=True):
        table[goal.label] = tried[goal.label].values[places]
        table[f"accurate {goal.label}"] = values
    table["violation"], table["accurate violation"] = tried["violation"].values[places], violation
    front, usable = np.zeros(len(here), bool), violation <= 0.0
    front[usable] = nondominated(goals[usable])
    return pd.DataFrame({**table, "front": front}, index=pd.Index(places, name="point"))


def fidelity(study: Study, cheap: xr.Dataset, accurate: xr.Dataset, stores: tuple[Store, Store]) -> Iterator[Section]:
    """What both kinds of runs say together."""
    taken = [store.times() for store in stores]
    times = [(float(spent["cases"].sum()), float(spent["seconds"].sum())) for spent in taken]
    cost = _cost(study, stores, times)
    if study.optimisation is not None:
        points = confirmed(study, accurate, cheap)
        met, best = int((points["accurate violation"] <= 0.0).sum()), int(points["front"].sum())
        kind = "confirmed front" if len(study.optimisation.goals) > 1 else "confirmed"
        yield Section(lines=[Fact(kind, numbers={"tried": len(points), "met": met, "best": best})])
        yield _confirmed_table(study, cheap, points, cost)
        return
    corrected = estimates(study, cheap, accurate)
    head = ("number", "cheap alone", "accurate alone", "both", "correlation", "accurate runs saved")
    saved = "The last column says how many times as many accurate runs alone have an interval of the same width."
    if any(number.estimate.interpolated for number in corrected):
        saved += f" Fractions and means predict {OTHERS} further cases by interpolation between the cheap runs."
    every = next((number.estimate for number in corrected if number.label == "all requirements"), None)
    yield Section(lines=[*([] if every is None else [_met_by(every, times)]), Fact("cheap")])
    notes = (f"Intervals of 95 %. {saved}", cost)
    yield Section(head, [_row(number) for number in corrected], "Cheap and accurate runs", notes)


def _met_by(both: Estimate, times: Sequence[tuple[float, float]]) -> Fact:
    """The fraction that meets all requirements, and what accurate runs alone would take for it."""
    (_, cheap), (cases, accurate) = times
    timed, spent = bool(np.isfinite(both.saved) and cases), cheap + accurate
    about = {
        "fraction": both.value,
        "low": both.low,
        "high": both.high,
        "cheap": both.screened,
        "accurate": both.verified,
        "interpolated": "them" if both.interpolated else None,
        "saved": both.saved if timed else None,
        "longer": both.saved * accurate / spent if timed and spent > 0.0 else None,
    }
    return Fact("both", "all requirements", about)


def _row(number: Corrected) -> tuple[str, ...]:
    """Of the table of both kinds of runs."""
    estimate, scale = number.estimate, scale_of(xr.DataArray(number.estimate.value, attrs={"units": number.units}))
    shown = partial(_shown, scale=None if number.kind == "fraction" else scale)
    return (
        number.label if number.kind == "fraction" or not scale.unit else f"{number.label} [{scale.unit}]",
        shown(estimate.cheap),
        f"{shown(estimate.accurate)} ({shown(estimate.accurate_low)} to {shown(estimate.accurate_high)})",
        f"{shown(estimate.value)} ({shown(estimate.low)} to {shown(estimate.high)})",
        "-" if np.isnan(estimate.correlation) else f"{estimate.correlation:.2f}",
        f"{estimate.saved:.1f}" if np.isfinite(estimate.saved) else "-",
    )


def _shown(value: float, scale: Scale | None) -> str:
    """A number in its unit, or as a fraction."""
    if not np.isfinite(value):
        return "-"
    return f"{value:.1%}" if scale is None else scale.cells(value)[0]


def _confirmed_table(study: Study, cheap: xr.Dataset, table: pd.DataFrame, cost: str) -> Section:
    assert study.optimisation is not None
    points = candidates(study, cheap).points
    labels = [goal.label for goal in study.optimisation.goals]
    signs = {goal.label: -1.0 if goal.maximise else 1.0 for goal in study.optimisation.goals}
    names = [factor.path for factor in study.factors]
    scales = {name: scale_of(points[name].isel(point=table.index.values)) for name in (*names, *labels)}
    head = ["point", *(scales[name].label(name) for name in names)]
    for label in labels:
        head += [f"{scales[label].label(label)}, cheap", "accurate"]
    rows = []
    for point, row in table.sort_values(f"accurate {labels[0]}").iterrows():
        cells = [str(point), *(scales[name].cells(row[name])[0] for name in names)]
        for label in labels:
            cells += scales[label].cells(*(signs[label] * row[key] for key in (label, f"accurate {label}")))
        violated = row["accurate violation"]
        met = "met" if violated <= 0.0 else "failed" if not np.isfinite(violated) else f"violated by {violated:.1%}"
        rows.append((*cells, met, "yes" if row["front"] else "no"))
    title = "Search by cheap runs, confirmed by accurate ones"
    return Section((*head, "requirements, accurate", "best there"), rows, title, (cost,))


def _cost(study: Study, stores: tuple[Store, Store], times: Sequence[tuple[float, float]]) -> str:
    """How many cases of each kind there are, and what those cost whose time is known."""
    parts = []
    assert study.accurate is not None
    kinds = zip(("cheap", "accurate"), stores, times, (study.options, study.accurate.options), strict=True)
    for name, store, (cases, seconds), options in kinds:
        cost = f"{seconds / cases:.3g} s each" if cases else "not yet timed"
        parts.append(f"{store.cases} {name} runs ({cost}, rtol = {options.rtol:g}, atol = {options.atol:g}, {options.method})")
    return " and ".join(parts) + "."
