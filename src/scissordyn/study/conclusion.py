"""The first page of a study: whether and where the requirements are met, what binds, what the responses go with, what to do."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from scissordyn.plot.scale import Scale, scale_of
from scissordyn.study.answer import answered, by_point, case_values, feasible_fraction
from scissordyn.study.description import Study
from scissordyn.study.next_step import next_steps
from scissordyn.study.recommendation import Recommendation, recommended
from scissordyn.study.summary import Table, meaning
from scissordyn.study.table import column
from scissordyn.study.trend import Need, Trend, needed, trends, with_indicators
from scissordyn.units import counted

NEGLIGIBLE = 0.05
"""Change of a response over the whole range of a number, as a fraction, that is not worth a word."""

NAMED = {
    1.0: "proportional to",
    2.0: "proportional to the square of",
    -1.0: "inversely proportional to",
    0.5: "proportional to the root of",
}
"""Exponents that have a name."""


@dataclass(frozen=True)
class Conclusion:
    """What a study says, in the order in which it is wanted."""

    # Whether and where the requirements are met; the recommended point, or the nearest one; its probability
    verdict: tuple[str, ...]
    margins: Table | None  # Of that point
    trends: tuple[str, ...]  # A sentence for each response, and what requirements need
    next: tuple[tuple[str, str], ...]  # Why, and a command


def conclude(study: Study, results: xr.Dataset, address: str) -> Conclusion:
    """What a study says."""
    found = trends(study, results)
    one = recommended(study, results) if study.requirements else None
    needs: list[Need] = []
    if one is not None:
        numbers = {**one.numbers, **{each.name: _middle(results, each.name) for each in study.uncertain}}
        needs = needed(study, results, found, with_indicators(study, numbers))
    sentences = [_trend_sentence(results, both[0], study) for both in found.values()]
    sentences += _without_number(study, results)
    sentences += [_need_sentence(results, study, need, found) for need in needs]
    steps = next_steps(study, results, address, one, needs)
    said = () if one is None else (_verdict(study, results), *_point(study, results, one))
    if not said and study.requirements:
        said = ("No case is complete: nothing is known of the requirements.",)
    return Conclusion(said, None if one is None else _margins(study, results, one), tuple(sentences), tuple(steps))


def _middle(results: xr.Dataset, address: str) -> float:
    return float(np.nanmedian(results[column(address)].values))


def _verdict(study: Study, results: xr.Dataset) -> str:
    """Whether and where the requirements are met."""
    fraction = feasible_fraction(study, results)[-1]
    interval = "" if np.isnan(fraction.low) else f" (95 % interval {fraction.low:.1%} to {fraction.high:.1%})"
    if study.points == 1 and study.uncertain:
        return (
            f"All requirements are met with a probability of {fraction.fraction:.1%}{interval}, by {fraction.trials} samples."
        )
    points = by_point(study, results)
    known = int((points["complete"] > 0.0).sum())
    always = (points["met"] == 1.0) & (points["complete"] == 1.0)
    whole, part = int(always.sum()), int(((points["met"] > 0.0) & ~always).sum())
    partly = f", and in part of the cases at {part} more" if part else ""
    whole_of = "points tried" if study.optimisation is not None else "range"
    share = f"; by {fraction.fraction:.1%} of the {whole_of}{interval}"
    if not whole:
        if part:
            return f"All requirements are met in every case at none of {known} points{partly.replace(' more', '')}{share}."
        most = f"; the fraction of the range that meets them is at most {fraction.high:.1%} (95 %)"
        upper = "" if np.isnan(fraction.high) else most
        return f"All requirements together are met nowhere: at none of {known} points{upper}."
    places = [
        _region(results, points.isel(point=np.flatnonzero(always.values)), points, each.address) for each in study.factors
    ]
    return f"All requirements are met at {whole} of {known} points{partly}{share}. Those points have {'; '.join(places)}."


def _region(results: xr.Dataset, there: xr.Dataset, points: xr.Dataset, address: str) -> str:
    """Over what range of a number, or with which names, requirements are met."""
    scale = scale_of(points[address])
    if scale.labels:
        found = (np.unique(each[address].values) for each in (there, points))
        met, tried = (", ".join(scale.text(float(place)) for place in places) for places in found)
        return f"{address} = {met}" + ("" if met == tried else f" (of {tried})")
    ends = [float(each) for each in (there[address].min(), there[address].max())]
    low, high = (scale.text(end) for end in ends)
    unit = f" {scale.unit}" if scale.unit else ""
    where = f"{address} = {low}{unit}" if low == high else f"{address} {low} to {high}{unit}"
    studied = [scale.text(float(each)) for each in (points[address].min(), points[address].max())]
    return f"{where} (of {studied[0]} to {studied[1]})"


def _point(study: Study, results: xr.Dataset, one: Recommendation) -> tuple[str, ...]:
    """The recommended point, or the nearest, and how surely it meets the requirements."""
    if not study.factors:
        return (f"The requirement that binds: {one.binding}.",)
    what = "Recommended" if one.probability > 0.0 else "Nearest to meeting them"
    several = study.points > 1
    what = f"{what}: point {one.point}" if several else "The only point"
    said = [f"{what}, {numbers_text(study, results, one.numbers)}. What binds: {one.binding}."]
    if np.isfinite(one.low):
        hit = round(one.probability * one.samples)
        caution = " It was chosen by the same samples; new ones decide." if several and hit else ""
        said.append(
            f"It meets all requirements in {hit} of {one.samples} samples of the uncertain numbers: probability "
            f"{one.probability:.0%} (95 % interval {one.low:.1%} to {one.high:.1%}).{caution}"
        )
    return tuple(said)


def numbers_text(study: Study, results: xr.Dataset, numbers: Mapping[str, Any]) -> str:
    """Numbers with their units: ``A.clearance = 0.12 mm, drive.speed = 100 rpm``."""
    return ", ".join(f"{address} = {_value(results, study, address, value)}" for address, value in numbers.items())


def _scale(results: xr.Dataset, study: Study, address: str, *values: float) -> Scale:
    shown = next((each.shown for each in (*study.factors, *study.uncertain) if each.name == address), {})
    found = results[column(address)]
    return scale_of(xr.DataArray(list(values), attrs={"units": found.attrs.get("units", "1"), **shown}))


def _value(results: xr.Dataset, study: Study, address: str, value: float | str) -> str:
    return value if isinstance(value, str) else _scale(results, study, address, value).said(value)


def margin_text(margin: float) -> str:
    """A margin as a fraction of the bound."""
    return f"{margin:+.1%}" if math.isfinite(margin) else "not met" if margin < 0.0 else "met"


def _margins(study: Study, results: xr.Dataset, one: Recommendation) -> Table:
    rows = []
    meanings = {each.label: meaning(results, each) for each in study.requirements}
    explained = any(meanings.values())
    for each in one.margins:
        means = (meanings[each.requirement],) if explained else ()
        rows.append((each.requirement, *means, each.text, margin_text(each.margin)))
    note = "Worst case of the point; the margin is a fraction of the bound, negative where the requirement is not met."
    head = ("requirement", *(("meaning",) if explained else ()), "value there", "margin")
    return Table(head, rows, f"Point {one.point}", (note,))


def _trend_sentence(results: xr.Dataset, trend: Trend, study: Study) -> str:
    quality = f"R2 {trend.r2:.2f}, {trend.error:.1%} error at points left out of the fit"
    if not trend.clear:
        return f"{trend.response}: no clear trend with {_listed(trend.numbers)} ({quality})."
    effects = np.abs(trend.effects) if trend.form == "power" else np.abs(trend.effects) / max(_typical(trend), 1e-300)
    order = [k for k in np.argsort(-effects) if trend.significant[k] and effects[k] > NEGLIGIBLE]
    rest = [name for k, name in enumerate(trend.numbers) if k not in order]
    words: Callable[[Trend, int], str] = _power if trend.form == "power" else _line(results, study)
    said = ", ".join(words(trend, int(k)) for k in order) or "nearly constant"
    little = f"; hardly depends on {_listed(tuple(rest))}" if rest and order else ""
    return f"{trend.response}: {said}{little} ({quality})."


def _without_number(study: Study, results: xr.Dataset) -> list[str]:
    """Responses that have no trend because some cases have no number of them."""
    said = []
    for response in answered(study, results):
        values = case_values(study, results, response)
        missing, complete = np.isinf(values), int(np.sum(~np.isnan(values)))
        if missing.any():
            said.append(
                f"{response.name}: no number in {int(missing.sum())} of {counted(complete, 'case')}, which count as not met; "
                f"no trend is fitted to the others."
            )
    return said


def _typical(trend: Trend) -> float:
    """Size of the response of a linear trend: in the middle of the ranges."""
    middle = dict(zip(trend.numbers, trend.ranges.mean(axis=1).tolist(), strict=True))
    return abs(trend.value(middle))


def _listed(names: tuple[str, ...]) -> str:
    return ", ".join(names)


def _power(trend: Trend, k: int) -> str:
    name, slope, wide = trend.numbers[k], float(trend.slopes[k]), float(trend.intervals[k])
    if not trend.logarithmic[k]:
        return f"{'rises' if slope > 0.0 else 'falls'} with {name} by a factor of {math.exp(abs(float(trend.effects[k]))):.3g}"
    exponent = f"exponent {slope:.2f} ± {wide:.2f}"
    named = next((text for value, text in NAMED.items() if abs(slope - value) <= max(min(wide, 0.1), 0.05)), None)
    if named is not None:
        return f"about {named} {name} ({exponent})"
    return f"{'rises' if slope > 0.0 else 'falls'} with {name} ({exponent})"


def _line(results: xr.Dataset, study: Study) -> Callable[[Trend, int], str]:
    """How a straight line goes with a number, in units that the user reads."""

    def words(trend: Trend, k: int) -> str:
        name, change = trend.numbers[k], float(trend.effects[k])
        low, high = (float(end) for end in trend.ranges[k])
        scale = scale_of(xr.DataArray(change, attrs={"units": trend.units}))
        if name not in study.addresses:
            return f"{'rises' if change > 0.0 else 'falls'} by {scale.said(abs(change), 3)} with {name}"
        over = _scale(results, study, name, low, high)
        unit = f" {over.unit}" if over.unit else ""
        return (
            f"{'rises' if change > 0.0 else 'falls'} linearly with {name}, by {scale.text(abs(change), 3)} {scale.unit} "
            f"from {over.text(low, 3)} to {over.text(high, 3)}{unit}"
        ).replace("  ", " ")

    return words


def _need_sentence(results: xr.Dataset, study: Study, need: Need, found: dict[str, tuple[Trend, ...]]) -> str:
    """What a requirement needs of a number; said to be extrapolated where it is."""
    response = next(one.response.name for one in study.requirements if one.label == need.requirement)
    trend = found[response][0]
    low, high = trend.ranges[trend.numbers.index(need.number)]
    scale = _scale(results, study, need.number, float(low), float(high))
    unit = f" {scale.unit}" if scale.unit else ""
    if math.isnan(need.value):
        if need.everywhere:
            said = f"{need.requirement}: by this trend met at every {need.number} of the range"
        else:
            said = f"{need.requirement}: by this trend no {need.number} in or near the range is enough"
    else:
        said = (
            f"{need.requirement} needs {need.number} of {_side(study, need, trend)} about {_rounded(scale, need.value)}{unit}"
        )
    others = ", the other numbers as at the point above" if len(study.addresses) > 1 else ""
    if need.failing:
        others += f"; cases miss it at {need.failing} of {counted(need.points, 'point')} on that side"
    if not need.extrapolated or math.isnan(need.value):
        return f"{said}{others}."
    beyond = f"extrapolated: the data reach from {scale.text(float(low), 3)} to {scale.text(float(high), 3)}{unit}"
    other = ""
    if need.other is not None:
        form = "a straight line" if trend.form == "power" else "a power law"
        other = f"; {form} fits as well and gives " + (
            "no such value" if math.isnan(need.other) else f"{_rounded(scale, need.other)}{unit}"
        )
    return f"{said}{others} ({beyond}{other})."


def _side(study: Study, need: Need, trend: Trend) -> str:
    """On which side of a value a requirement is met."""
    upper = next(one.sign.startswith("<") for one in study.requirements if one.label == need.requirement)
    rises = float(trend.slopes[trend.numbers.index(need.number)]) > 0.0
    return "at most" if upper == rises else "at least"


def _rounded(scale: Scale, value: float) -> str:
    """Two digits, without a power of ten where none is needed."""
    return f"{float(scale.text(value, 2)):g}"


def trend_table(study: Study, results: xr.Dataset) -> Table | None:
    """Exponents of the power laws with their 95 % intervals, and how well they fit; None without any."""
    rows, head = [], ("response", *study.addresses, "R2", "error at points left out")
    for name, both in trends(study, results).items():
        law = next((one for one in both if one.form == "power"), None)
        if law is not None:
            cells = dict(zip(law.numbers, zip(law.slopes, law.intervals, law.logarithmic, strict=True), strict=True))
            texts = [
                f"{cells[each][0]:.2f} ± {cells[each][1]:.2f}" if each in cells and cells[each][2] else "-"
                for each in study.addresses
            ]
            rows.append((name, *texts, f"{law.r2:.2f}", f"{law.error:.1%}"))
    note = "Exponents of power laws by least squares; intervals by the jackknife over the points. R2 is that of the logarithms."
    return Table(head, rows, "Exponents", (note,)) if rows else None
