"""Answers of a study, section by section, for the terminal, a report and a notebook."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr

from scissordyn.errors import command
from scissordyn.plot.scale import scale_of
from scissordyn.studies.answer.answers import Answers
from scissordyn.studies.answer.conclusion import conclude, margin_text
from scissordyn.studies.answer.fidelity_sections import fidelity_sections
from scissordyn.studies.answer.section import Section
from scissordyn.studies.answer.trend import rankings, sensitivities
from scissordyn.studies.answer.verdict import case_values, study_responses
from scissordyn.studies.ask.description import Study
from scissordyn.studies.ask.design import Factor
from scissordyn.studies.ask.distribution import Distribution, Empirical, Levels, Names
from scissordyn.studies.ask.requirement import beyond_text, response_unit
from scissordyn.studies.compute.slopes import NO_SLOPE
from scissordyn.studies.compute.table import SLOPE_BY, SLOPE_OF, SLOPES, column, number_scale
from scissordyn.units import counted
from scissordyn.warning import LISTED_MAX


def page(answers: Answers, store: str, most: int) -> Iterator[Section]:
    """Yield the answers of a study as sections; tables have at most `most` rows, and commands contain the name `store`."""
    return (part for part in _sections(answers, store, most) if part.lines or part.rows)


def _sections(answers: Answers, store: str, most: int) -> Iterator[Section]:
    study, results, points = answers.study, answers.dataset, answers.points
    yield damage_section(answers, store)
    if (verified := answers.verified) is not None:
        yield from fidelity_sections(answers, verified)
    conclusion = conclude(answers, store)
    yield Section(lines=conclusion.sentences)
    yield from (conclusion.point, conclusion.requirements, conclusion.trends)
    yield Section(("to", "command"), conclusion.next, "Next steps")
    cases = "{complete} cases complete, {failed} failed, {pending} pending".format(**answers.counts)
    yield replace(varied_numbers(study, results), title="Computed cases", lines=(f"{design_size(study)}: {cases}.",))
    yield response_ranges(study, results, points)
    if study.optimisation is not None:
        yield best_points(answers, most)
    indices, left_out = answers.indices
    yield from (*sensitivities(indices), *rankings(study, results, answers.fitted))
    yield Section(title="Responses without indices", lines=[f"{name}: {why}." for name, why in left_out.items()])
    worst = [
        (case.requirement, case.text, margin_text(case.margin), numbers_text(study, results, case.numbers), case.case)
        for case in (answers.worst() if study.requirements else ())
    ]
    notes = ("The margin is a fraction of the bound, negative where the requirement is not met.",)
    head = ("requirement", "value", "margin", "parameters", "command")
    yield Section(head, [(*cells, replay_command(store, case)) for *cells, case in worst], "Worst cases", notes)
    if study.gradients:
        yield derivatives_known(answers)
    yield from cause_sections(answers, store, most)


def derivatives_known(answers: Answers) -> Section:
    """Return how many points have valid derivatives, by response and number, and the reasons why others have none."""
    derived, complete = answers.points[SLOPES], int((answers.points["complete"] > 0.0).sum())
    rows = [
        (str(name), str(by), f"{int(derived.sel({SLOPE_OF: name, SLOPE_BY: by}).notnull().sum())} of {complete}")
        for name in derived[SLOPE_OF].values
        for by in derived[SLOPE_BY].values
    ]
    notes = [
        f"{counted(len(cases), 'point')}: {text}." for text, cases in answers.warnings.items() if text.startswith(NO_SLOPE)
    ]
    head = ("response", "number", "points with derivatives")
    return Section(head, rows, "Derivatives for trends and maps", tuple(notes))


def cause_sections(answers: Answers, store: str, most: int) -> Iterator[Section]:
    """Yield sections of failed cases by cause and complete cases by warning, with a command that replays one of each."""
    for title, what, groups in (("Failed cases", "cause", answers.causes), ("Warnings", "warning", answers.warnings)):
        rows = [
            (str(len(cases)), text, replay_command(store, cases[0]))
            for text, cases in groups.items()
            if not text.startswith(NO_SLOPE)
        ]
        notes = ("The numbers are those of the first case.", *([f"{len(rows) - most} more."] if len(rows) > most else []))
        if rows:
            yield Section(("cases", what, "command"), rows[:most], title, notes)


def damage_section(answers: Answers, store: str) -> Section:
    """Return the section of damaged rows, with the command that computes them again."""
    if not answers.damage:
        return Section()
    return Section(("", "command"), [(answers.damage, command("scissordyn", "study", "resume", store))])


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
    """Return the section that lists the varied parameters with their ranges or distributions."""
    rows = [(factor.path, "chosen", _values_text(study, results, factor)) for factor in study.factors]
    rows += [(factor.name, "uncertain", _values_text(study, results, factor)) for factor in study.uncertain]
    return Section(("parameter", "role", "values"), rows)


def _values_text(study: Study, results: xr.Dataset, factor: Factor) -> str:
    variation = factor.variation
    ends = [end for end in variation.ends if np.isfinite(end) and end]
    typical = variation.quantile(np.array([0.5])) if isinstance(variation, Distribution) or not ends else ends
    scale = number_scale(study, results, factor.name, *typical)
    unit = f" {scale.unit}" if scale.unit else ""
    if isinstance(variation, Levels | Names):
        values = [scale.text(value) for value in variation.levels()]
        shown = values if len(values) <= LISTED_MAX else [*values[:LISTED_MAX], f"... {values[-1]}"]
        return f"{', '.join(shown)}{unit}"
    if isinstance(variation, Distribution):
        return f"{variation.text(scale.text)}{unit}"
    low, high = (scale.text(end) for end in variation.ends)
    about = f"{len(variation.values)} measured values, " if isinstance(variation, Empirical) else ""
    return f"{about}{low} to {high}{unit}" + (", log" if factor.logarithmic else "")


def numbers_text(study: Study, results: xr.Dataset, numbers: Mapping[str, Any]) -> str:
    """Return the parameters of a case with their units; of many parameters, those that deviate most from their mean."""

    def distance(name: str) -> float:
        values = results[column(name)].values
        return 0.0 if isinstance(numbers[name], str) else abs(numbers[name] - np.mean(values)) / (float(np.std(values)) or 1.0)

    def text(name: str) -> str:
        value = numbers[name]
        return value if isinstance(value, str) else number_scale(study, results, name, value).with_unit(value)

    kept = set(sorted(numbers, key=distance, reverse=True)[:LISTED_MAX])
    shown = ", ".join(f"{name} = {text(name)}" for name in numbers if name in kept)
    return shown if len(kept) == len(numbers) else f"{shown}, and {len(numbers) - len(kept)} nearer to their means"


def response_ranges(study: Study, results: xr.Dataset, points: xr.Dataset) -> Section:
    """Return smallest, median and largest value of each response over complete cases, and the spread of members."""
    rows, missing, notes = [], False, list[str]()
    for response in study_responses(study, results):
        values = case_values(study, results, response)
        beyond = beyond_text(results[response.measure])
        if np.isposinf(values).all() and beyond:
            notes.append(f"{response.name}: not reached within {beyond} in any case.")
        if np.isfinite(values).any():
            ends = np.array([np.nanmin(values), np.nanmedian(values), np.nanmax(values)])
            scale = scale_of(xr.DataArray(ends, attrs={"units": response_unit(results, response)}))
            none = f"over {beyond.split()[0]}" if beyond else "none"
            shown = [text if math.isfinite(end) else none for end, text in zip(ends, scale.cells(*ends), strict=True)]
            spread = [_percent(float(np.nanmax(points[f"spread {response.name}"].values)))] if study.members > 1 else []
            without = int(np.isinf(values).sum())
            missing |= without > 0
            if without and not beyond:
                notes.append("Cases without a value do not meet a requirement, and no trend is fitted to the others.")
            rows.append((response.name, *shown, scale.unit, *spread, str(without)))
    members = ("largest spread of members",) if study.members > 1 else ()
    head = ("response", "smallest", "median", "largest", "unit", *members)
    if not missing:
        return Section(head, [row[:-1] for row in rows], notes=tuple(notes))
    return Section((*head, "cases without a value"), rows, notes=tuple(dict.fromkeys(notes)))


def best_points(answers: Answers, most: int) -> Section:
    """Return the section of the Pareto front of a search, or of the best point of one goal."""
    search, best, tried = answers.study.optimisation, answers.optimum.best, answers.optimum.points
    assert search is not None
    rows = np.flatnonzero(tried["front"].values) if best < 0 else np.array([best])
    names = (*answers.study.paths, *(goal.label for goal in search.goals))
    scales = {name: scale_of(tried[name].isel(point=rows)) for name in names}
    columns = [scale.cells(*tried[name].values[rows[:most]], digits=4) for name, scale in scales.items()]
    shown = [(str(row), *cells) for row, *cells in zip(rows[:most], *columns, strict=True)]
    notes = [f"{counted(tried.sizes['point'], 'point')} tried; measure of risk: {search.risk}."]
    notes += _about_search(answers.store.search()) if search.method == "gradient" else []
    if len(rows) > most:
        notes.append(f"{counted(len(rows) - most, 'more point')} of the front in the store.")
    if best >= 0 and float(tried["violation"][best]) > 0.0:
        notes.append("No point meets all requirements; this is the one that violates them least.")
    head = ("point", *(scale.label(name) for name, scale in scales.items()))
    return Section(head, shown, "Pareto front" if best < 0 else "Best point", tuple(notes))


def _about_search(ended: Mapping[str, Any]) -> list[str]:
    """Return lines on a search along derivatives."""
    if not ended:
        return ["The search along derivatives has not ended."]
    lines = [f"Search along derivatives: {counted(ended['gradients'], 'further run')} with exact derivatives."]
    if ended["differences"]:
        lines.append(f"{counted(ended['differences'], 'gradient')} by differences of points: {'; '.join(ended['reasons'])}.")
    if ended["failure"]:
        return [*lines, f"The search has ended without an optimum ({ended['failure']}): try other ranges."]
    return lines if ended["converged"] else [*lines, "The search has not converged: more generations continue it."]


def _percent(fraction: float) -> str:
    """Return a fraction in percent; a fraction above 0 is never written as 0."""
    return f"{fraction:.1%}" if fraction == 0.0 or fraction >= 1e-3 else "below 0.1%"
