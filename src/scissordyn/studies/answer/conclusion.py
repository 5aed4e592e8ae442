"""Answers of a study: at most five sentences, a table of requirements, the recommended point, trends and next steps."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from scissordyn.errors import command
from scissordyn.numeral import finite_or_none
from scissordyn.plot.scale import Scale, engineering, scale_of
from scissordyn.studies.answer.answers import Answers
from scissordyn.studies.answer.section import Section
from scissordyn.studies.answer.trend import SHARE_MIN, Trend, with_indicators
from scissordyn.studies.answer.verdict import FeasibleFraction, Recommendation
from scissordyn.studies.ask.description import Study
from scissordyn.studies.ask.design import Factor
from scissordyn.studies.ask.requirement import meaning
from scissordyn.studies.compute.table import column, number_scale
from scissordyn.tolerance import REPORTED_FRACTION
from scissordyn.warning import LISTED_MAX, RunWarning, warning

FORM_NAMES = {"power": "power law", "linear": "straight line"}  # Names of the forms of fitted trends, as tables print them
# [samples] smallest count that a suggested check of a point uses: 64 successes of 64 prove at least 94.4 %
CHECK_SAMPLES_MIN = 64

# Tolerance of all parameters in the check that a report suggests for a study without uncertain parameters
SUGGESTED_TOLERANCE = "+- 10 %"
INTERVAL_WIDTH_MAX = 0.2  # [-] largest width of a success fraction's confidence interval without a proposal of more points


@dataclass(frozen=True)
class Need:
    """Value of a chosen parameter at which a requirement is just met, by the trend of its response."""

    requirement: str
    parameter: str
    value: float  # NaN if all or no values meet the requirement
    text: str
    beyond: bool = False  # True if the value is outside the range of the data


@dataclass(frozen=True)
class Conclusion:
    """Answers of a study."""

    sentences: tuple[RunWarning, ...]  # Sentences about the requirements, the recommended point, and members
    requirements: Section  # Margins at the recommended point, fractions of the range with intervals, needed values
    point: Section  # Numbers of the recommended point
    trends: Section
    next: tuple[tuple[str, str], ...]  # Purpose and command
    facts: tuple[dict[str, Any], ...]  # Requirements, recommended point and trends as plain data

    def to_plain(self) -> list[dict[str, Any]]:
        """Return all answers as plain data for JSON."""
        steps = [{"kind": "next", "part": purpose, "numbers": {}, "command": typed} for purpose, typed in self.next]
        return [*(sentence.data for sentence in self.sentences), *self.facts, *steps]


def conclude(answers: Answers, store: str) -> Conclusion:
    """Return the answers of a study; `store` is the name of its file in suggested commands."""
    study, results, point = answers.study, answers.dataset, answers.recommendation
    needed: list[Need] = []
    if point is not None:
        middles = {factor.name: float(np.nanmedian(results[column(factor.name)].values)) for factor in study.uncertain}
        needed = needs(study, results, answers.fitted, with_indicators(study, {**point.numbers, **middles}))
    fractions = answers.fractions if study.requirements else []
    return Conclusion(
        tuple(_sentences(answers)),
        requirement_table(study, results, point, fractions, needed),
        point_table(study, answers.points, point) if point is not None and study.factors else Section(),
        trend_table(answers.fitted),
        tuple(_next_steps(answers, store, needed)),
        (*_facts_of_requirements(point, fractions, needed), *_facts_of_trends(answers.fitted)),
    )


# --- sentences ----------------------------------------------------------------------------------------------------------------


def _sentences(answers: Answers) -> Iterator[RunWarning]:
    study, point = answers.study, answers.recommendation
    if study.requirements:
        yield _verdict(answers)
    if point is not None:
        tightest = point.margins[0]
        about = {"point": point.point, "requirement": tightest.requirement, "margin": margin_text(tightest.margin)}
        kind = "only point" if study.points == 1 else "recommended" if point.probability > 0.0 else "nearest"
        yield warning(kind, "", "", **about)
        if np.isfinite(point.low):
            hits = round(point.probability * point.samples)
            about = {"hits": hits, "samples": point.samples, "fraction": point.probability, "low": point.low}
            kind = "samples" if study.points == 1 or not hits else "same samples"
            yield warning(kind, "", "", **about, high=point.high)
    if study.members > 1:
        yield agreement(study, answers.points)


def _verdict(answers: Answers) -> RunWarning:
    """Return whether, and at how many points, the requirements are met."""
    study, points, fraction = answers.study, answers.points, answers.fractions[-1]
    if answers.recommendation is None:
        return warning("undecided")
    interval = "" if np.isnan(fraction.low) else f" (95 % interval {fraction.low:.1%} to {fraction.high:.1%})"
    about = {"fraction": fraction.fraction, "interval": interval}
    if study.points == 1 and study.uncertain:
        return warning("probability", "", "", **about, trials=fraction.trials)
    always = (points["met"] == 1.0) & (points["complete"] == 1.0)
    met, partly = int(always.sum()), int(((points["met"] > 0.0) & ~always).sum())
    about |= {"tried": int((points["complete"] > 0.0).sum()), "met": met, "partly": partly}
    about["of"] = "points tried" if study.optimisation is not None else "range"
    return warning(
        "met" if met and not partly else "met and partly" if met else "partly" if partly else "nowhere", "", "", **about
    )


def agreement(study: Study, points: xr.Dataset) -> RunWarning:
    """Return the sentence that counts the points whose members disagree, in a response or on the requirements."""
    about = {"least": REPORTED_FRACTION, "differ": int(points["disagrees"].sum()), "tried": points.sizes["point"]}
    if not about["differ"]:
        return warning("members agree", "", "", **about)
    return warning("members differ", "", "", **about, undecided=int(points["undecided"].sum()))


# --- tables -------------------------------------------------------------------------------------------------------------------


def margin_text(margin: float) -> str:
    """Return a margin in percent of the bound."""
    return f"{margin:+.1%}" if math.isfinite(margin) else "not met" if margin < 0.0 else "met"


def requirement_table(
    study: Study,
    results: xr.Dataset,
    point: Recommendation | None,
    fractions: Sequence[FeasibleFraction],
    needed: Sequence[Need],
) -> Section:
    """Return the requirements: value and margin at the recommended point, the fraction that meets them, the needed value."""
    if not fractions:
        return Section()
    meanings = {requirement.label: meaning(results, requirement) for requirement in study.requirements}
    margins = {} if point is None else {margin.requirement: margin for margin in point.margins}
    limits = {need.requirement: need.text for need in needed}
    order = sorted(fractions, key=lambda fraction: margins[fraction.label].margin if fraction.label in margins else math.inf)
    columns: dict[str, Callable[[FeasibleFraction], str]] = {"requirement": lambda fraction: fraction.label}
    if any(meanings.values()):
        columns["meaning"] = lambda fraction: meanings.get(fraction.label, "")
    if margins:
        columns["value"] = lambda fraction: margins[fraction.label].text if fraction.label in margins else ""
        columns["margin"] = lambda fraction: margin_text(margins[fraction.label].margin) if fraction.label in margins else ""
    columns["met by"] = lambda fraction: f"{fraction.fraction:.1%}"
    sampled = any(np.isfinite(fraction.low) for fraction in fractions)
    if sampled:
        columns["95 % interval"] = lambda fraction: f"{fraction.low:.1%} to {fraction.high:.1%}"
    if limits:
        columns["needs, by its trend"] = lambda fraction: limits.get(fraction.label, "")
    notes = ["Value and margin, as a fraction of the bound, are those of the worst case of the point."] if margins else []
    whole = "points" if study.factors else "samples"
    notes += [f"'met by' is the fraction of {fractions[-1].trials} {whole}, without failed cases."]
    rows = [tuple(cell(fraction) for cell in columns.values()) for fraction in order]
    return Section(tuple(columns), rows, "Requirements", (" ".join(notes),))


def point_table(study: Study, points: xr.Dataset, point: Recommendation) -> Section:
    """Return each parameter's value at the recommended point, its range tried, and its range that meets all requirements."""
    always = np.flatnonzero((points["met"].values == 1.0) & (points["complete"].values == 1.0))
    rows = []
    for name in study.paths:
        scale = scale_of(points[name])
        tried, met = points[name].values, points[name].values[always]
        cells = [scale.with_unit(point.numbers[name]), _range_text(scale, tried)]
        rows.append((name, *cells, *([_range_text(scale, met)] if always.size else [])))
    head = ("parameter", "value", "tried", *(("all requirements met",) if always.size else ()))
    return Section(head, rows, f"Point {point.point}")


def _range_text(scale: Scale, values: np.ndarray) -> str:
    """Return values of a parameter as text: the names that occur, or the smallest and largest value with the unit."""
    values = values[np.isfinite(values)]
    if scale.labels:
        return ", ".join(scale.text(float(place)) for place in np.unique(values))
    low, high = (scale.text(float(end)) for end in (values.min(), values.max()))
    return f"{low if low == high else f'{low} to {high}'} {scale.unit}".rstrip()


def trend_table(fitted: Mapping[str, tuple[Trend, ...]]) -> Section:
    """Return the better trend of each response: exponents of power laws, or changes of straight lines over the range."""
    names = list(dict.fromkeys(name for forms in fitted.values() for name in forms[0].numbers))
    columns: list[tuple[str, ...]] = [("response", "form", *names, "R2", "error at points left out")]
    for name, forms in fitted.items():
        trend = forms[0]
        form = FORM_NAMES[trend.form] if trend.clear else "no clear trend"
        cells = {number: _effect_text(trend, k) if trend.clear else "" for k, number in enumerate(trend.numbers)}
        columns.append((name, form, *(cells.get(number, "") for number in names), f"{trend.r2:.2f}", f"{trend.error:.1%}"))
    note = (
        "Power law: the exponent of each parameter, or 'x' and the factor of the response. Straight line: the change of the "
        "response over the range of the parameter. After ±: half of the 95 % interval (jackknife over the points). R2 of a "
        "power law is that of the logarithms."
    )
    # the longer side of the table goes down the page
    head, *rows = columns if len(names) <= LISTED_MAX else zip(*columns, strict=True)
    return Section(head, rows, "Trends of the responses", (note,)) if len(columns) > 1 else Section()


def _effect_text(trend: Trend, k: int) -> str:
    slope, half, effect = float(trend.slopes[k]), float(trend.intervals[k]), float(trend.effects[k])
    if trend.form == "power":
        return f"{slope:.2f} ± {half:.2f}" if trend.logarithmic[k] else f"x {math.exp(effect):.3g}"
    wide = half * float(np.ptp(trend.ranges[k]))
    scale = engineering(trend.units, effect, wide)
    return f"{effect * scale.factor:+.3g} ± {wide * scale.factor:.2g} {scale.unit}".rstrip()


def needs(study: Study, results: xr.Dataset, fitted: Mapping[str, tuple[Trend, ...]], numbers: dict[str, float]) -> list[Need]:
    """Find the value of the chosen parameter with the strongest effect at which each requirement is just met."""
    chosen = {factor.path for factor in study.factors}
    needs = []
    for requirement in study.requirements:
        trend, *others = fitted.get(requirement.response.name, ()) or (None,)
        if trend is None or not trend.clear:
            continue
        effects = np.where([name in chosen for name in trend.numbers] & trend.significant, np.abs(trend.effects), 0.0)
        if not effects.any():
            continue
        k = int(np.argmax(effects))
        name, (first, last) = trend.numbers[k], map(float, trend.ranges[k])
        value = trend.parameter_at_bound(name, requirement.bound, numbers)
        if math.isnan(value):
            ends = np.array([trend.value({**numbers, name: end}) for end in (first, last)])
            needs.append(Need(requirement.label, name, value, f"{'any' if requirement.met(ends).all() else 'no'} {name}"))
            continue
        side = "at most" if requirement.sign.startswith("<") == (float(trend.slopes[k]) > 0.0) else "at least"
        scale = number_scale(study, results, name, first, last)
        text = f"{name} {side} {_rounded(scale, value)}"
        beyond = not first <= value <= last
        if beyond:
            text += f", extrapolated from {float(scale.text(first, 3)):g} to {_rounded(scale, last, 3)}"
        other = next((form for form in others if beyond and trend.predicted - form.predicted < SHARE_MIN), None)
        if other is not None:
            second = other.parameter_at_bound(name, requirement.bound, numbers)
            text += f"; by a {FORM_NAMES[other.form]} {'no value' if math.isnan(second) else _rounded(scale, second)}"
        needs.append(Need(requirement.label, name, value, text, beyond))
    return needs


def _rounded(scale: Scale, value: float, digits: int = 2) -> str:
    """Return a rounded value with its unit, without a power of ten for thousands."""
    return f"{float(scale.text(value, digits)):g} {scale.unit}".rstrip()


def _facts_of_requirements(
    point: Recommendation | None, fractions: Sequence[FeasibleFraction], needed: Sequence[Need]
) -> Iterator[dict[str, Any]]:
    margins = {} if point is None else {margin.requirement: margin for margin in point.margins}
    values = {need.requirement: {"number": need.parameter, "needs": need.value} for need in needed}
    for fraction in fractions:
        numbers: dict[str, Any] = {"fraction": fraction.fraction, "low": fraction.low, "high": fraction.high}
        if fraction.label in margins:
            numbers |= {"value": margins[fraction.label].value, "margin": margins[fraction.label].margin}
        numbers |= values.get(fraction.label, {})
        finite = {name: finite_or_none(value) for name, value in numbers.items()}
        yield {"kind": "requirement", "part": fraction.label, "numbers": finite}
    if point is not None:
        yield {"kind": "point", "part": str(point.point), "numbers": dict(point.numbers)}


def _facts_of_trends(fitted: Mapping[str, tuple[Trend, ...]]) -> Iterator[dict[str, Any]]:
    for name, forms in fitted.items():
        trend = forms[0]
        slopes = dict(zip(trend.numbers, trend.slopes.tolist(), strict=True))
        numbers = {"form": trend.form, "clear": trend.clear, "slopes": slopes, "r2": trend.r2, "error": trend.error}
        yield {"kind": "trend", "part": name, "numbers": numbers}


# --- next steps ---------------------------------------------------------------------------------------------------------------


def _next_steps(answers: Answers, store: str, needed: Sequence[Need]) -> list[tuple[str, str]]:
    """Return next steps, each with its purpose and command."""
    study, point = answers.study, answers.recommendation
    if answers.counts["pending"]:
        return [("compute pending cases", command("scissordyn", "study", "resume", store))]
    if point is None:
        return []

    def refine(*words: str) -> str:
        return command("scissordyn", "study", "refine", store, *words, "-o", "next.db")

    if not study.factors:
        more = str(max(4 * study.sampling.samples, CHECK_SAMPLES_MIN))
        wide = point.high - point.low > 0.5 * INTERVAL_WIDTH_MAX
        return [("narrow the interval", refine("--samples", more))] if wide else []
    return (
        _steps_if_met(answers, store, point, refine)
        if point.probability > 0.0
        else _steps_if_not_met(answers, point, needed, refine)
    )


def _steps_if_met(answers: Answers, store: str, point: Recommendation, refine: Callable[..., str]) -> list[tuple[str, str]]:
    study, results = answers.study, answers.dataset
    steps, fixed = [], [command_value(results, factor, point.numbers[factor.path]) for factor in study.factors]
    if not study.uncertain:
        loose = []
        for factor, text in zip(study.factors, fixed, strict=True):
            loose += (
                ["--vary", f"{factor.path}={text}"]
                if factor.texts
                else ["--uncertain", f"{factor.path}={text} {SUGGESTED_TOLERANCE}"]
            )
        steps.append(("check the point with tolerances", refine(*loose, "--samples", str(CHECK_SAMPLES_MIN))))
    elif not point.low > 0.9:
        samples, seed = str(max(4 * study.sampling.samples, CHECK_SAMPLES_MIN)), str(study.sampling.seed + 1)
        words = [
            word for factor, text in zip(study.factors, fixed, strict=True) for word in ("--vary", f"{factor.path}={text}")
        ]
        steps.append(("check the point with new samples", refine(*words, "--samples", samples, "--seed", seed)))
    fraction = answers.fractions[-1]
    if study.design.extendable and study.optimisation is None and fraction.high - fraction.low > INTERVAL_WIDTH_MAX:
        more = command("scissordyn", "study", "extend", store, "--points", 2 * study.design.points)
        steps.append(("narrow the interval of the fraction", more))
    return steps


def _steps_if_not_met(
    answers: Answers, point: Recommendation, needed: Sequence[Need], refine: Callable[..., str]
) -> list[tuple[str, str]]:
    study, results, steps = answers.study, answers.dataset, list[tuple[str, str]]()
    need = next((need for need in needed if need.requirement == point.binding and need.beyond), None)
    if need is not None:
        factor = next(factor for factor in study.factors if factor.path == need.parameter)
        values = results[column(need.parameter)].values
        low, high = float(np.nanmin(values)), float(np.nanmax(values))
        near = low if need.value < low else high
        # the needed value is in the middle of the new range, of the logarithms if they exist
        far = need.value**2 / near if need.value * near > 0.0 else 2.0 * need.value - near
        first, last = sorted((far, near))
        text = f"{first / factor.scale:.6g}..{command_value(results, factor, last)}"
        steps.append((f"reach {point.binding} if the trend continues", refine("--vary", f"{need.parameter}={text}")))
    if study.optimisation is None:
        binding = next(requirement for requirement in study.requirements if requirement.label == point.binding).response
        name = binding.name.partition(" (")[0]  # without the word on what components exert
        goal = f"{'maximise' if binding.smallest else 'minimise'} {name}"
        steps.append(("search the same ranges for a point that meets them", refine("--goal", goal)))
    return steps


def command_value(results: xr.Dataset, factor: Factor, value: float) -> str:
    """Return a value as it is typed in a command: in the user's unit or the SI unit; a name in brackets."""
    if factor.labels:
        return f"[{factor.labels[int(value)]}]"
    unit = factor.unit or str(results[column(factor.path)].attrs.get("units", "1"))
    return f"{value / factor.scale:.6g} {'' if unit == '1' else unit}".rstrip()
