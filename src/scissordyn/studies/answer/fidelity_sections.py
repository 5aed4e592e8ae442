"""Sections of a study that combine cheap and accurate runs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import xarray as xr

from scissordyn.plot.scale import scale_of
from scissordyn.studies.answer.answers import Answers
from scissordyn.studies.answer.fidelity import Corrected
from scissordyn.studies.answer.section import Section
from scissordyn.studies.ask.description import Study
from scissordyn.studies.compute.store import Store
from scissordyn.studies.estimate import Estimate
from scissordyn.warning import RunWarning, warning


def fidelity_sections(answers: Answers, verified: Answers) -> Iterator[Section]:
    """Yield the sections that combine cheap and accurate runs."""
    taken = [part.store.times() for part in (answers, verified)]
    times = [(float(spent["cases"].sum()), float(spent["seconds"].sum())) for spent in taken]
    cost = _cost(answers.study, (answers.store, verified.store), times)
    if answers.study.goals:
        points = answers.confirmed
        met_count, front_count = int((points["accurate violation"] <= 0.0).sum()), int(points["front"].sum())
        kind = "confirmed front" if len(answers.study.goals) > 1 else "confirmed"
        yield Section(lines=[warning(kind, "", "", tried=len(points), met=met_count, best=front_count)])
        yield _confirmed_table(answers, cost)
        return
    met_by_all = [number.estimate for number in answers.estimates if number.label == "all requirements"]
    head = ("number", "cheap alone", "accurate alone", "both", "correlation", "accurate runs saved")
    notes = (
        "Intervals of 95 %. The last column says how many times as many accurate runs alone give an interval of the same "
        f"width. All other tables come from cheap runs. {cost}",
    )
    rows = [_row(number) for number in answers.estimates]
    yield Section(head, rows, "Cheap and accurate runs", notes, [_met_by(estimate, times) for estimate in met_by_all])


def _met_by(combined: Estimate, times: Sequence[tuple[float, float]]) -> RunWarning:
    """Return the sentence on the fraction that meets all requirements, with the cost of accurate runs alone."""
    (_, cheap), (cases, accurate) = times
    saved = ""
    if np.isfinite(combined.saved) and cases and cheap + accurate > 0.0:
        longer = combined.saved * accurate / (cheap + accurate)
        saved = f"; accurate runs alone would take {combined.saved:.1f} times as many and {longer:.1f} times the time of both"
    about = {
        "fraction": combined.value,
        "low": combined.low,
        "high": combined.high,
        "cheap": combined.screened,
        "accurate": combined.verified,
    }
    return warning("cheap and accurate", "", "", **about, saved=saved)


def _row(number: Corrected) -> tuple[str, ...]:
    """Return the row of an estimate in the table of cheap and accurate runs."""
    estimate, scale = number.estimate, scale_of(xr.DataArray(number.estimate.value, attrs={"units": number.units}))

    def shown(value: float) -> str:
        if not np.isfinite(value):
            return "-"
        return f"{value:.1%}" if number.kind == "fraction" else scale.cells(value)[0]

    return (
        number.label if number.kind == "fraction" or not scale.unit else f"{number.label} [{scale.unit}]",
        shown(estimate.cheap),
        f"{shown(estimate.accurate)} ({shown(estimate.accurate_low)} to {shown(estimate.accurate_high)})",
        f"{shown(estimate.value)} ({shown(estimate.low)} to {shown(estimate.high)})",
        "-" if np.isnan(estimate.correlation) else f"{estimate.correlation:.2f}",
        f"{estimate.saved:.1f}" if np.isfinite(estimate.saved) else "-",
    )


def _confirmed_table(answers: Answers, cost: str) -> Section:
    table, names, goals = answers.confirmed, answers.study.paths, answers.study.goals
    confirmed_points = answers.optimum.points.isel(point=table.index.values)
    scales = {name: scale_of(confirmed_points[name]) for name in (*names, *(goal.label for goal in goals))}
    head = ["point", *(scales[name].label(name) for name in names)]
    for goal in goals:
        head += [f"{scales[goal.label].label(goal.label)}, cheap", "accurate"]
    rows = []
    for point, row in table.sort_values(f"accurate {goals[0].label}", ascending=not goals[0].maximise).iterrows():
        cells = [str(point), *(scales[name].cells(row[name])[0] for name in names)]
        for goal in goals:
            cells += scales[goal.label].cells(*(row[key] for key in (goal.label, f"accurate {goal.label}")))
        violated = row["accurate violation"]
        met = "met" if violated <= 0.0 else "failed" if not np.isfinite(violated) else f"violated by {violated:.1%}"
        rows.append((*cells, met, "yes" if row["front"] else "no"))
    title = "Search by cheap runs, confirmed by accurate ones"
    return Section((*head, "requirements, accurate", "best there"), rows, title, (cost,))


def _cost(study: Study, stores: tuple[Store, Store], times: Sequence[tuple[float, float]]) -> str:
    """Return a sentence with the number of cheap and of accurate runs, their computing times and options."""
    parts = []
    assert study.accurate is not None
    kinds = zip(("cheap", "accurate"), stores, times, (study.options, study.accurate.options), strict=True)
    for name, store, (cases, seconds), options in kinds:
        cost = f"{seconds / cases:.3g} s each" if cases else "not yet timed"
        accuracy = f"rtol = {options.rtol:g}, atol = {options.position_tolerance:g}"
        parts.append(f"{store.cases} {name} runs ({cost}, {accuracy}, {options.method})")
    return " and ".join(parts) + "."
