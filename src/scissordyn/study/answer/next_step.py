"""What to try after a study, as commands."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from scissordyn.errors import command
from scissordyn.study.answer.fact import Fact
from scissordyn.study.answer.recommendation import Recommendation
from scissordyn.study.answer.surface import predicted_point
from scissordyn.study.answer.trend import Need
from scissordyn.study.answer.verdict import by_point, counts, feasible_fraction
from scissordyn.study.ask.description import Factor, Study
from scissordyn.study.compute.table import column

Step = tuple[Fact, str]  # Why, and a command
CHECKED = 64  # Least number of samples with which a recommended point is checked: the interval of 64 of 64 begins at 94.4 %
TOLERANCE = "+- 10 %"  # Tolerance that is proposed where the study has no uncertain number
WIDE = 0.2  # Width of the interval of a fraction above which more points are proposed
PAST = 0.7  # The moved range ends at this fraction of what a requirement needs, or its inverse: an extrapolation is rough


def next_steps(
    study: Study, results: xr.Dataset, store: str, point: Recommendation | None, needs: Sequence[Need]
) -> list[Step]:
    """What to try next: why, and the command."""
    if counts(results)[2]:
        return [(Fact("pending"), command("scissordyn", "study", "resume", store))]
    if point is None:
        return []
    if not study.factors:
        more = str(max(4 * study.sampling.samples, CHECKED))
        return [(Fact("narrower"), _refine(store, "--samples", more))] if point.high - point.low > 0.5 * WIDE else []
    if point.probability > 0.0:
        return _met(study, results, store, point)
    return _not_met(study, results, store, point, needs)


def _met(study: Study, results: xr.Dataset, store: str, point: Recommendation) -> list[Step]:
    steps, samples = [], max(4 * study.sampling.samples, CHECKED)
    if not study.uncertain:
        loose = [
            f"--vary {factor.path}={value}" if factor.texts else f"--uncertain {factor.path}={value} {TOLERANCE}"
            for factor, value in _typed(study, results, point.numbers)
        ]
        words = [word for option in loose for word in option.split(" ", 1)]
        steps.append((Fact("tolerances"), _refine(store, *words, "--samples", str(CHECKED))))
    elif not point.low > 0.9:
        seed = str(study.sampling.seed + 1)
        again = _refine(store, *_fixed(study, results, point.numbers), "--samples", str(samples), "--seed", seed)
        steps.append((Fact("new samples"), again))
    fraction = feasible_fraction(study, results)[-1]
    if study.design.extendable and study.optimisation is None and fraction.high - fraction.low > WIDE:
        more = command("scissordyn", "study", "extend", store, "--points", 2 * study.design.points)
        steps.append((Fact("more points"), more))
    return steps


def _not_met(study: Study, results: xr.Dataset, store: str, point: Recommendation, needs: Sequence[Need]) -> list[Step]:
    need = next((need for need in needs if need.requirement == point.binding), None)
    binding = next(requirement for requirement in study.requirements if requirement.label == point.binding)
    steps = []
    if need is not None and need.extrapolated and math.isfinite(need.value):
        factor = next(factor for factor in study.factors if factor.path == need.number)
        values = results[column(need.number)].values
        low, high = float(np.nanmin(values)), float(np.nanmax(values))
        # towards the need, as far from the old range as it takes
        past = PAST if (need.value < low) == (need.value > 0.0) else 1.0 / PAST
        ends = sorted((need.value * past, low if need.value < low else high))
        text = f"{_number(results, factor, ends[0])}..{typed(results, factor, ends[1])}"
        steps.append((Fact("goes on", point.binding), _refine(store, "--vary", f"{need.number}={text}")))
    likely = predicted_point(study, by_point(study, results))
    if likely is not None:
        steps.insert(0, (Fact("interpolated"), _refine(store, *_fixed(study, results, likely))))
    if study.optimisation is None:
        goal = f"{'maximise' if binding.response.smallest else 'minimise'} {_goal_name(binding.response.name)}"
        steps.append((Fact("search"), _refine(store, "--goal", goal)))
    return steps


def _typed(study: Study, results: xr.Dataset, numbers: Mapping[str, Any]) -> list[tuple[Factor, str]]:
    return [(factor, typed(results, factor, numbers[factor.path])) for factor in study.factors]


def _fixed(study: Study, results: xr.Dataset, numbers: Mapping[str, Any]) -> list[str]:
    """Options that choose a point."""
    return [word for factor, value in _typed(study, results, numbers) for word in ("--vary", f"{factor.path}={value}")]


def _goal_name(name: str) -> str:
    """A response as a goal names it: without the word on what components exert."""
    return name.partition(" (")[0]


def _refine(store: str, *words: str) -> str:
    return command("scissordyn", "study", "refine", store, *words, "-o", "next.db")


def _number(results: xr.Dataset, factor: Factor, value: float) -> str:
    return f"{value / factor.scale:.6g}"


def typed(results: xr.Dataset, factor: Factor, value: float) -> str:
    """A number as it is typed in a study: in the unit in which the user wrote it, or in SI; a name in brackets."""
    if factor.labels:
        return f"[{factor.labels[int(value)]}]"
    unit = factor.unit or str(results[column(factor.path)].attrs.get("units", "1"))
    return f"{_number(results, factor, value)} {'' if unit == '1' else unit}".rstrip()
