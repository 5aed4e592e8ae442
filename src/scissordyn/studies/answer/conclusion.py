"""Answers of a study: where the requirements are met, the binding requirement, trends of responses, and next steps."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr
from scipy.stats import qmc

from scissordyn.errors import command
from scissordyn.plot.scale import scale_of
from scissordyn.studies.answer.estimate import Kriging
from scissordyn.studies.answer.fact import Fact, Section
from scissordyn.studies.answer.trend import SHARE_MIN, Trend, with_indicators
from scissordyn.studies.answer.verdict import Recommendation, answered, case_values
from scissordyn.studies.ask.description import Study
from scissordyn.studies.ask.design import Factor, quantiles
from scissordyn.studies.ask.requirement import Requirement, meaning
from scissordyn.studies.compute.store import COMPLETE
from scissordyn.studies.compute.table import column, number_scale
from scissordyn.units import counted
from scissordyn.warning import LISTED_MAX

if TYPE_CHECKING:
    from scissordyn.studies.result import StudyResult

NAMED = (1.0, 2.0, -1.0, 0.5)  # Exponents that have words of their own
OTHER_FORM = {"power": "a straight line", "linear": "a power law"}  # Name of the other form of trend
Step = tuple[Fact, str]  # Why, and a command
CHECK_SAMPLES_MIN = 64  # [samples] that check a recommended point: the interval of 64 successes of 64 begins at 94.4 %
TOLERANCE = "+- 10 %"  # Tolerance that is proposed where the study has no uncertain number
INTERVAL_WIDTH_MAX = 0.2  # [-] width of the interval of a fraction above which more points are proposed
SEARCH_POINTS = 4096  # [points] at which the interpolation is searched for one that meets the requirements
# [-] the moved range ends at this fraction of what a requirement needs, or its inverse: an extrapolation is rough
EXTRAPOLATION_FRACTION = 0.7


@dataclass(frozen=True)
class Conclusion:
    """Results of a study as facts, in the order in which they are read."""

    verdict: tuple[Fact, ...]  # Points that meet the requirements; the point to build; its probability
    margins: Section | None  # Margins of the point to build
    trends: tuple[Fact, ...]  # Trend of each response, and values that the requirements need
    next: tuple[Step, ...]

    def to_plain(self) -> list[dict[str, Any]]:
        """Return all facts as plain data for JSON."""
        steps = [{**fact.to_plain(), "command": command} for fact, command in self.next]
        return [*(fact.to_plain() for fact in (*self.verdict, *self.trends)), *steps]


def conclude(result: StudyResult, store: str) -> Conclusion:
    """Collect the results of a study as facts; `store` is the name of its file in suggested commands."""
    study, results, point = result.study, result.dataset, result.recommendation
    needed: list[Fact] = []
    if point is not None:
        middles = {factor.name: float(np.nanmedian(results[column(factor.name)].values)) for factor in study.uncertain}
        needed = needs(study, results, result.fitted, with_indicators(study, {**point.numbers, **middles}))
    facts = [_trend(results, both[0], study) for both in result.fitted.values()]
    facts += [*_without_number(study, results), *needed]
    steps = tuple(_next_steps(result, store, needed))
    if point is None:
        return Conclusion((Fact("unknown"),) if study.requirements else (), None, tuple(facts), steps)
    return Conclusion((_verdict(result), *_point(study, results, point)), _margins(study, results, point), tuple(facts), steps)


def _verdict(result: StudyResult) -> Fact:
    """Say whether and at which points the requirements are met."""
    study, points, fraction = result.study, result.points, result.fractions[-1]
    about: dict[str, Any] = {"fraction": fraction.fraction}
    about |= {name: None if math.isnan(end) else end for name, end in (("low", fraction.low), ("high", fraction.high))}
    if study.points == 1 and study.uncertain:
        return Fact("probability", numbers={**about, "trials": fraction.trials})
    always = (points["met"] == 1.0) & (points["complete"] == 1.0)
    whole, part = int(always.sum()), int(((points["met"] > 0.0) & ~always).sum())
    about |= {"tried": int((points["complete"] > 0.0).sum()), "partly": part or None}
    about["of"] = "points tried" if study.optimisation is not None else "range"
    if not whole:
        return Fact("met in part" if part else "met nowhere", numbers=about)
    there = points.isel(point=np.flatnonzero(always.values))
    factors = study.paths
    part_of = {name: float(np.ptp(there[name].values) / (np.ptp(points[name].values) or 1.0)) for name in factors}
    narrow = sorted(part_of, key=part_of.__getitem__)[:LISTED_MAX]
    where = tuple(_region(there, points, name) for name in part_of if name in narrow)
    wider = len(part_of) - len(where)
    return Fact(
        "met", numbers={**about, "always": whole, "where": where, "wider": counted(wider, "parameter") if wider else None}
    )


def _region(there: xr.Dataset, points: xr.Dataset, parameter: str) -> Fact:
    """Return the fact of the range of a parameter, or of the names, for which requirements are met."""
    scale = scale_of(points[parameter])
    if scale.labels:
        places = (np.unique(some[parameter].values) for some in (there, points))
        met, tried = (", ".join(scale.text(float(place)) for place in these) for these in places)
        return Fact("met names", parameter, {"names": met, "tried": None if met == tried else tried})
    first, last, least, most = (
        float(end) for some in (there, points) for end in (some[parameter].min(), some[parameter].max())
    )
    kind = "met value" if scale.text(first) == scale.text(last) else "met range"
    return Fact(kind, parameter, {"first": first, "last": last, "least": least, "most": most}, scale)


def _point(study: Study, results: xr.Dataset, point: Recommendation) -> tuple[Fact, ...]:
    """Return facts of the recommended or nearest point, with its probability of meeting the requirements."""
    if not study.factors:
        return (Fact("least margin", point.binding, {"margin": margin_text(point.margins[0].margin)}),)
    several = study.points > 1
    kind = ("recommended" if point.probability > 0.0 else "nearest") if several else "only point"
    about: dict[str, Any] = {"point": point.point, "where": _values(study, results, point.numbers)}
    facts = [Fact(kind, point.binding, {**about, "margin": margin_text(point.margins[0].margin)})]
    if np.isfinite(point.low):
        hits = round(point.probability * point.samples)
        about = {"hits": hits, "samples": point.samples, "fraction": point.probability, "low": point.low, "high": point.high}
        facts.append(Fact("samples", numbers={**about, "chosen": "decide" if several and hits else None}))
    return tuple(facts)


def _values(study: Study, results: xr.Dataset, numbers: Mapping[str, Any]) -> tuple[Fact, ...]:
    """Return facts of parameter values or names."""
    return tuple(
        Fact("name", parameter, {"value": value})
        if isinstance(value, str)
        else Fact("value", parameter, {"value": value}, number_scale(study, results, parameter, value))
        for parameter, value in numbers.items()
    )


def numbers_text(study: Study, results: xr.Dataset, numbers: Mapping[str, Any]) -> str:
    """Return the parameters of a case with their units; of many parameters, those that deviate most from their mean."""

    def distance(name: str) -> float:
        values = results[column(name)].values
        return 0.0 if isinstance(numbers[name], str) else abs(numbers[name] - np.mean(values)) / (float(np.std(values)) or 1.0)

    kept = set(sorted(numbers, key=distance, reverse=True)[:LISTED_MAX])
    text = ", ".join(map(str, _values(study, results, {name: numbers[name] for name in numbers if name in kept})))
    return text if len(kept) == len(numbers) else f"{text}, and {len(numbers) - len(kept)} nearer to their means"


def _few(names: Sequence[str]) -> str:
    more = len(names) - LISTED_MAX
    return ", ".join(names) if more < 2 else f"{', '.join(names[:LISTED_MAX])} and {more} more"


def margin_text(margin: float) -> str:
    """Return a margin in percent of the bound."""
    return f"{margin:+.1%}" if math.isfinite(margin) else "not met" if margin < 0.0 else "met"


def _margins(study: Study, results: xr.Dataset, point: Recommendation) -> Section:
    meanings = {requirement.label: meaning(results, requirement) for requirement in study.requirements}
    explained, rows = any(meanings.values()), []
    for margin in point.margins:
        means = (meanings[margin.requirement],) if explained else ()
        rows.append((margin.requirement, *means, margin.text, margin_text(margin.margin)))
    note = "Worst case of the point; the margin is a fraction of the bound, negative where the requirement is not met."
    head = ("requirement", *(("meaning",) if explained else ()), "value there", "margin")
    return Section(head, rows, f"Point {point.point}", (note,))


def _trend(results: xr.Dataset, trend: Trend, study: Study) -> Fact:
    about: dict[str, Any] = {"r2": trend.r2, "error": trend.error}
    if not trend.clear:
        return Fact("no trend", trend.response, {**about, "numbers": _few(trend.numbers)})
    effects = np.abs(trend.effects)
    if trend.form == "linear":  # of the response in the middle of the ranges
        middle = dict(zip(trend.numbers, trend.ranges.mean(axis=1).tolist(), strict=True))
        effects = effects / max(abs(trend.value(middle)), 1e-300)
    order = [int(k) for k in np.argsort(-effects) if trend.significant[k] and effects[k] > SHARE_MIN]
    if not order:
        return Fact("constant", trend.response, about)
    little = _few([name for k, name in enumerate(trend.numbers) if k not in order])
    how = tuple(_power(trend, k) if trend.form == "power" else _line(results, study, trend, k) for k in order)
    return Fact("trend", trend.response, {**about, "how": how, "little": little or None})


def _without_number(study: Study, results: xr.Dataset) -> list[Fact]:
    """Return facts of responses without a trend because they have no value in some cases."""
    facts = []
    for response in answered(study, results):
        values = case_values(study, results, response)
        if missing := int(np.isinf(values).sum()):
            cases = counted(int(np.sum(~np.isnan(values))), "case")
            facts.append(Fact("no number", response.name, {"missing": missing, "cases": cases}))
    return facts


def _power(trend: Trend, k: int) -> Fact:
    name, slope, half = trend.numbers[k], float(trend.slopes[k]), float(trend.intervals[k])
    verb = "rises" if slope > 0.0 else "falls"
    if not trend.logarithmic[k]:
        return Fact("factor", name, {"verb": verb, "factor": math.exp(abs(float(trend.effects[k])))})
    named = next((value for value in NAMED if abs(slope - value) <= max(min(half, 0.1), 0.05)), None)
    kind = "exponent" if named is None else f"exponent {named:g}"
    return Fact(kind, name, {"verb": verb, "slope": slope, "half": half})


def _line(results: xr.Dataset, study: Study, trend: Trend, k: int) -> Fact:
    """Describe the slope of a straight line over a parameter."""
    name, change = trend.numbers[k], float(trend.effects[k])
    first, last = (float(end) for end in trend.ranges[k])
    shown = scale_of(xr.DataArray(change, attrs={"units": trend.units})).with_unit(abs(change), 3)
    about = {"verb": "rises" if change > 0.0 else "falls", "change": shown, "effect": change, "first": first, "last": last}
    if name not in study.factor_names:
        return Fact("line of a name", name, about)
    return Fact("line", name, about, number_scale(study, results, name, first, last))


def needs(study: Study, results: xr.Dataset, fitted: Mapping[str, tuple[Trend, ...]], numbers: dict[str, float]) -> list[Fact]:
    """Find the value of the chosen parameter with the strongest effect at which each requirement is just met."""
    chosen = {factor.path for factor in study.factors}
    facts = []
    for requirement in study.requirements:
        trend, *others = fitted.get(requirement.response.name, ()) or (None,)
        if trend is None or not trend.clear:
            continue
        able = np.where([name in chosen for name in trend.numbers] & trend.significant, np.abs(trend.effects), 0.0)
        if not able.any():
            continue
        k = int(np.argmax(able))
        name, (first, last) = trend.numbers[k], map(float, trend.ranges[k])
        value = trend.reached(name, requirement.bound, numbers)
        upper = requirement.sign.startswith("<") == (float(trend.slopes[k]) > 0.0)
        about: dict[str, Any] = {
            "number": name,
            "side": "at most" if upper else "at least",
            "value": value,
            "first": first,
            "last": last,
            "others": "as" if len(study.factor_names) > 1 else None,
            **_failing(study, results, requirement, name, value, upper),
        }
        beyond = not first <= value <= last
        kind = "need beyond" if beyond else "need"
        if math.isnan(value):
            ends = np.array([trend.value({**numbers, name: end}) for end in (first, last)])
            kind = "met everywhere" if requirement.met(ends).all() else "not enough"
        other = next((form for form in others if beyond and trend.predicted - form.predicted < SHARE_MIN), None)
        if other is not None:
            form, second = OTHER_FORM[trend.form], other.reached(name, requirement.bound, numbers)
            about |= {"lacking": form} if math.isnan(second) else {"form": form, "other": second}
        facts.append(Fact(kind, requirement.label, about, number_scale(study, results, name, first, last)))
    return facts


def _failing(
    study: Study, results: xr.Dataset, requirement: Requirement, name: str, value: float, upper: bool
) -> dict[str, Any]:
    """Count the points on the permitted side of a parameter value, and those of them with a case that fails."""
    failing = there = np.zeros(0)
    if name in study.factor_names and math.isfinite(value):
        numbers, complete = results[column(name)].values, results["status"].values == COMPLETE
        right = complete & ((numbers <= value) if upper else (numbers >= value))
        point = np.arange(numbers.size) // study.per_point
        failing, there = np.unique(point[right & ~requirement.met_in(results)]), np.unique(point[right])
    return {"failing": failing.size or None, "points": counted(there.size, "point")}


def trend_table(study: Study, fitted: Mapping[str, tuple[Trend, ...]]) -> Section:
    """Return the exponents of the power laws with their 95 % intervals and quality of fit; empty if no trend is a power law."""
    columns: list[tuple[str, ...]] = [("response", *study.factor_names, "R2", "error at points left out")]
    for name, both in fitted.items():
        law = next((trend for trend in both if trend.form == "power"), None)
        if law is not None:
            cells = dict(zip(law.numbers, zip(law.slopes, law.intervals, law.logarithmic, strict=True), strict=True))
            texts = [
                f"{cells[parameter][0]:.2f} ± {cells[parameter][1]:.2f}" if parameter in cells and cells[parameter][2] else "-"
                for parameter in study.factor_names
            ]
            columns.append((name, *texts, f"{law.r2:.2f}", f"{law.error:.1%}"))
    note = "Exponents of power laws by least squares; intervals by the jackknife over the points. R2 is that of the logarithms."
    # the longer side of the table goes down the page
    head, *rows = columns if len(study.factor_names) <= LISTED_MAX else zip(*columns, strict=True)
    return Section(head, rows, "Exponents", (note,)) if len(columns) > 1 else Section()


def _next_steps(result: StudyResult, store: str, needed: Sequence[Fact]) -> list[Step]:
    """Suggest next steps, each with its reason and command."""
    study, point = result.study, result.recommendation
    if result.counts["pending"]:
        return [(Fact("pending"), command("scissordyn", "study", "resume", store))]
    if point is None:
        return []

    def refine(*words: str) -> str:
        return command("scissordyn", "study", "refine", store, *words, "-o", "next.db")

    if not study.factors:
        more = str(max(4 * study.sampling.samples, CHECK_SAMPLES_MIN))
        wide = point.high - point.low > 0.5 * INTERVAL_WIDTH_MAX
        return [(Fact("narrower"), refine("--samples", more))] if wide else []
    return _met(result, store, point, refine) if point.probability > 0.0 else _not_met(result, point, needed, refine)


def _met(result: StudyResult, store: str, point: Recommendation, refine: Callable[..., str]) -> list[Step]:
    study, results = result.study, result.dataset
    steps, samples = [], str(max(4 * study.sampling.samples, CHECK_SAMPLES_MIN))
    if not study.uncertain:
        loose = []
        for factor in study.factors:
            text = f"{factor.path}={typed(results, factor, point.numbers[factor.path])}"
            loose += ["--vary", text] if factor.texts else ["--uncertain", f"{text} {TOLERANCE}"]
        steps.append((Fact("tolerances"), refine(*loose, "--samples", str(CHECK_SAMPLES_MIN))))
    elif not point.low > 0.9:
        seed = str(study.sampling.seed + 1)
        fixed = _fixed(study, results, point.numbers)
        steps.append((Fact("new samples"), refine(*fixed, "--samples", samples, "--seed", seed)))
    fraction = result.fractions[-1]
    if study.design.extendable and study.optimisation is None and fraction.high - fraction.low > INTERVAL_WIDTH_MAX:
        more = command("scissordyn", "study", "extend", store, "--points", 2 * study.design.points)
        steps.append((Fact("more points"), more))
    return steps


def _not_met(result: StudyResult, point: Recommendation, needed: Sequence[Fact], refine: Callable[..., str]) -> list[Step]:
    study, results, steps = result.study, result.dataset, list[Step]()
    if (likely := _interpolated_point(result)) is not None:
        steps.append((Fact("interpolated"), refine(*_fixed(study, results, likely))))
    need = next((need for need in needed if need.part == point.binding and need.kind == "need beyond"), None)
    if need is not None:
        name, value = need.numbers["number"], need.numbers["value"]
        factor = next(factor for factor in study.factors if factor.path == name)
        values = results[column(name)].values
        low, high = float(np.nanmin(values)), float(np.nanmax(values))
        # towards the need, as far from the old range as it takes
        past = EXTRAPOLATION_FRACTION if (value < low) == (value > 0.0) else 1.0 / EXTRAPOLATION_FRACTION
        ends = sorted((value * past, low if value < low else high))
        text = f"{ends[0] / factor.scale:.6g}..{typed(results, factor, ends[1])}"
        steps.append((Fact("goes on", point.binding), refine("--vary", f"{name}={text}")))
    if study.optimisation is None:
        binding = next(requirement for requirement in study.requirements if requirement.label == point.binding).response
        name = binding.name.partition(" (")[0]  # without the word on what components exert
        steps.append((Fact("search"), refine("--goal", f"{'maximise' if binding.smallest else 'minimise'} {name}")))
    return steps


def _interpolated_point(result: StudyResult) -> dict[str, float] | None:
    """Interpolate the point with the largest least margin within the ranges; None unless it probably meets all requirements."""
    study, names, models = result.study, result.study.paths, list[Kriging]()
    for requirement in study.requirements:
        model = result.between(requirement.response.name)
        if model is None:
            return None
        models.append(model)
    drawn = qmc.Sobol(len(names), rng=np.random.default_rng(0)).random(SEARCH_POINTS)
    at = quantiles([factor.variation for factor in study.factors], drawn)
    tried = np.stack([result.points[name].values for name in names], axis=1)
    at = np.clip(at, np.nanmin(tried, axis=0), np.nanmax(tried, axis=0))  # nothing is extrapolated
    every = zip(study.requirements, models, strict=True)
    margins = [requirement.margin(model.predict(at)[0]) for requirement, model in every]
    least = np.min(margins, axis=0)
    best = int(np.argmax(least))
    return dict(zip(names, at[best].tolist(), strict=True)) if least[best] > 0.0 else None


def _fixed(study: Study, results: xr.Dataset, numbers: Mapping[str, Any]) -> list[str]:
    """Return the command options that fix all parameters of a point."""
    texts = (f"{factor.path}={typed(results, factor, numbers[factor.path])}" for factor in study.factors)
    return [word for text in texts for word in ("--vary", text)]


def typed(results: xr.Dataset, factor: Factor, value: float) -> str:
    """Return a value as text for a study: in the user's unit, or in SI; a name in brackets."""
    if factor.labels:
        return f"[{factor.labels[int(value)]}]"
    unit = factor.unit or str(results[column(factor.path)].attrs.get("units", "1"))
    return f"{value / factor.scale:.6g} {'' if unit == '1' else unit}".rstrip()
