"""Answers of a study, section by section, for the terminal, a report and a notebook."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from scissordyn.errors import command
from scissordyn.plot.scale import scale_of
from scissordyn.studies.answer.conclusion import conclude, margin_text, numbers_text, trend_table
from scissordyn.studies.answer.fact import Fact, Section
from scissordyn.studies.answer.fidelity import fidelity
from scissordyn.studies.answer.trend import rankings, sensitivities
from scissordyn.studies.answer.verdict import answered, case_values
from scissordyn.studies.ask.description import Study
from scissordyn.studies.ask.design import Factor
from scissordyn.studies.ask.distribution import Distribution, Empirical, Levels, Names
from scissordyn.studies.ask.requirement import meaning, response_unit
from scissordyn.studies.compute.table import number_scale
from scissordyn.tolerance import REPORTED_FRACTION
from scissordyn.units import counted
from scissordyn.warning import LISTED_MAX

if TYPE_CHECKING:
    from scissordyn.studies.result import StudyResult


def page(result: StudyResult, store: str, most: int) -> Iterator[Section]:
    """Yield the sections that are not empty; lists have at most `most` rows, and commands contain the name `store`."""
    return (part for part in _sections(result, store, most) if part.lines or part.rows)


def _sections(result: StudyResult, store: str, most: int) -> Iterator[Section]:
    study, results, points = result.study, result.dataset, result.points
    yield damage_section(result, store)
    if (verified := result.verified) is not None:
        yield from fidelity(result, verified)
    conclusion = result.conclusion if store == result.store.path else conclude(result, store)
    yield Section(lines=conclusion.verdict)
    if conclusion.margins is not None:
        yield conclusion.margins
    yield Section(title="Trends of the responses", lines=conclusion.trends)
    yield Section(("", "command"), [(str(why), what) for why, what in conclusion.next], "Next steps")
    cases = "{complete} cases complete, {failed} failed, {pending} pending".format(**result.counts)
    lines = (f"{design_size(study)}: {cases}.", *filter(None, [agreement(study, points)]))
    yield replace(varied_numbers(study, results), title="Computed cases", lines=lines)
    yield response_ranges(study, results, points)
    if study.requirements:
        yield requirement_fractions(result)
    if study.optimisation is not None:
        yield best_points(result, most)
    yield trend_table(study, result.fitted)
    indices, left_out = result.indices
    yield from (*sensitivities(indices), *rankings(study, results, result.fitted))
    yield Section(title="Responses without indices", lines=[f"{name}: {why}." for name, why in left_out.items()])
    worst = [
        (case.requirement, case.text, margin_text(case.margin), numbers_text(study, results, case.numbers), case.case)
        for case in (result.worst() if study.requirements else ())
    ]
    notes = ("The margin is a fraction of the bound, negative where the requirement is not met.",)
    head = ("requirement", "value", "margin", "parameters", "command")
    yield Section(head, [(*cells, replay_command(store, case)) for *cells, case in worst], "Worst cases", notes)
    yield from cause_sections(result, store, most)


def cause_sections(result: StudyResult, store: str, most: int) -> Iterator[Section]:
    """Return sections of failed cases by cause and complete cases by warning, with a command that replays one of each."""
    for title, what, groups in (("Failed cases", "cause", result.causes), ("Warnings", "warning", result.warnings)):
        rows = [(str(len(cases)), text, replay_command(store, cases[0])) for text, cases in groups.items()]
        notes = ("In the words of the first case.", *([f"{len(rows) - most} more."] if len(rows) > most else []))
        if rows:
            yield Section(("cases", what, "command"), rows[:most], title, notes)


def damage_section(result: StudyResult, store: str) -> Section:
    """Return the section of damaged rows, with the command that computes them again."""
    if not result.damage:
        return Section()
    return Section(("", "command"), [(result.damage, command("scissordyn", "study", "resume", store))])


def replay_command(store: str, case: int) -> str:
    """Return the command that simulates a case again, with its histories."""
    return command("scissordyn", "study", "replay", store, case)


def design_size(study: Study) -> str:
    """Return the numbers of points, samples and members in words."""
    parts = [f"{counted(study.points, 'point')} ({study.design.kind})"] if study.factors else []
    if study.uncertain:
        of_each = " of each" if study.factors else ""
        parts.append(f"{counted(study.sampling.samples, 'sample')}{of_each} ({study.sampling.kind})")
    if study.members > 1:
        parts.append(f"{study.members} members of each")
    return ", ".join(parts)


def varied_numbers(study: Study, results: xr.Dataset) -> Section:
    """Return the section of the parameters that vary, with their ranges or distributions."""
    rows = [(factor.path, "chosen", _over(study, results, factor)) for factor in study.factors]
    rows += [(factor.name, "uncertain", _over(study, results, factor)) for factor in study.uncertain]
    return Section(("number", "role", "values"), rows)


def _over(study: Study, results: xr.Dataset, factor: Factor) -> str:
    """Return the values of a factor as in a study file."""
    variation = factor.variation
    ends = [end for end in variation.ends if np.isfinite(end) and end]
    typical = variation.quantile(np.array([0.5])) if isinstance(variation, Distribution) or not ends else ends
    scale = number_scale(study, results, factor.name, *typical)
    unit = f" {scale.unit}" if scale.unit else ""
    if isinstance(variation, Levels | Names):
        values = [scale.text(value, 6) for value in variation.levels()]
        shown = values if len(values) <= LISTED_MAX else [*values[:LISTED_MAX], f"... {values[-1]}"]
        return f"{', '.join(shown)}{unit}"
    if isinstance(variation, Distribution):
        return f"{variation.text(lambda value: scale.text(value, 6))}{unit}"
    low, high = (scale.text(end, 6) for end in variation.ends)
    about = f"{len(variation.values)} measured values, " if isinstance(variation, Empirical) else ""
    return f"{about}{low} to {high}{unit}" + (", log" if factor.logarithmic else "")


def agreement(study: Study, points: xr.Dataset) -> Fact | None:
    """Say at which points ensemble members disagree; None without members."""
    if study.members == 1:
        return None
    count, differ = points.sizes["point"], int(points["disagrees"].sum())
    if not differ:
        return Fact("agree", numbers={"least": REPORTED_FRACTION})
    undecided = int(points["undecided"].sum()) or "none" if study.requirements else None
    tried = counted(count, "point")
    about = {"least": REPORTED_FRACTION, "differ": differ, "tried": tried, "fraction": _percent(differ / count)}
    return Fact("disagree", numbers={**about, "undecided": undecided})


def response_ranges(study: Study, results: xr.Dataset, points: xr.Dataset) -> Section:
    """Return smallest, median and largest value of each response over complete cases, and the spread of members."""
    rows = []
    for response in answered(study, results):
        values = case_values(study, results, response)
        if np.isfinite(values).any():
            ends = np.nanquantile(values, [0.0, 0.5, 1.0], method="closest_observation")
            scale = scale_of(xr.DataArray(ends, attrs={"units": response_unit(results, response)}))
            shown = [text if math.isfinite(end) else "none" for end, text in zip(ends, scale.cells(*ends), strict=True)]
            spread = [_percent(float(np.nanmax(points[f"spread {response.name}"].values)))] if study.members > 1 else []
            rows.append((response.name, *shown, scale.unit or "1", *spread))
    members = ("largest spread of members",) if study.members > 1 else ()
    return Section(("response", "smallest", "median", "largest", "unit", *members), rows)


def requirement_fractions(result: StudyResult) -> Section:
    """Return the section of the fractions of the range that meet each requirement, and all of them."""
    study = result.study
    meanings = [*(meaning(result.dataset, requirement) for requirement in study.requirements), ""]
    rows, explained, sampled = [], any(meanings), False
    for fraction, text in zip(result.fractions, meanings, strict=True):
        sampled |= np.isfinite(fraction.low)
        interval = "no sample" if np.isnan(fraction.low) else f"{fraction.low:.1%} to {fraction.high:.1%}"
        rows.append(
            (fraction.label, *((text,) if explained else ()), f"{fraction.fraction:.1%}", interval, str(fraction.trials))
        )
    head = ("requirement", *(("meaning",) if explained else ()), "met by", "95 % interval", "trials")
    note = "Interval of Clopper and Pearson." if sampled else f"The points of the design '{study.design.kind}' are no sample."
    return Section(head, rows, "Requirements", (f"{note} Failed cases are left out.",))


def best_points(result: StudyResult, most: int) -> Section:
    """Return the section of the Pareto front of a search, or of the best point of one goal."""
    search, best, tried = result.study.optimisation, result.optimum.best, result.optimum.points
    assert search is not None
    rows = np.flatnonzero(tried["front"].values) if best < 0 else np.array([best])
    signs = {**dict.fromkeys(result.study.paths, 1.0), **{goal.label: goal.sign for goal in search.goals}}
    scales = {name: scale_of(tried[name].isel(point=rows)) for name in signs}
    columns = [scales[name].cells(*(sign * tried[name].values[rows[:most]]), digits=5) for name, sign in signs.items()]
    shown = [(str(row), *cells) for row, *cells in zip(rows[:most], *columns, strict=True)]
    notes = [f"{counted(tried.sizes['point'], 'point')} tried; measure of risk: {search.risk}."]
    if len(rows) > most:
        notes.append(f"{counted(len(rows) - most, 'more point')} of the front in the store.")
    if best >= 0 and float(tried["violation"][best]) > 0.0:
        notes.append("No point meets all requirements; this is the one that violates them least.")
    head = ("point", *(scale.label(name) for name, scale in scales.items()))
    return Section(head, shown, "Pareto front" if best < 0 else "Best point", tuple(notes))


def _percent(fraction: float) -> str:
    """Return a fraction in percent; a fraction above 0 is never written as 0."""
    return f"{fraction:.1%}" if fraction == 0.0 or fraction >= 1e-3 else "below 0.1%"
