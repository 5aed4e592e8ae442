"""The points of a study or of a bifurcation diagram, as figures of the page; each opens as a run."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from scissordyn.errors import InputError, command
from scissordyn.explore.case import RunCase
from scissordyn.plot.scale import Scale, scale_of
from scissordyn.run.options import Options

if TYPE_CHECKING:
    import xarray as xr

    from scissordyn.study.result import StudyResult

MOST_FIGURES = 6
"""Responses that are drawn, those of requirements first."""

CYCLES = 4
"""A point of a diagram is run for so many periods of its drive."""

SMALL, LARGE = 3.0, 6.0
"""Radius of a point, and of the recommended one [pixel]."""

Figure = dict[str, Any]


@dataclass(frozen=True)
class Points:
    """What the page shows of many runs."""

    axes: Sequence[str]  # numbers that the points can be drawn over
    figures: Callable[[str], list[Figure]]  # over one of them
    opened: Callable[[int], RunCase]  # the case of a point
    first: int  # the point that is opened first
    note: str


def open_study_case(path: Path, allowed: Sequence[Path] = ()) -> RunCase:
    """The recommended point of a study as a case, with all its points."""
    from scissordyn.config.studies import open_study

    result = open_study(path, allow_code=list(allowed))
    if not (result.dataset["status"].values == 1).any():
        raise InputError(
            f"'{path}', a study without a complete case", "a study with results", command("scissordyn", "study", "resume", path)
        )
    return _with_points(_points_of_study(result))


def open_diagram_case(path: Path, diagram: xr.Dataset, allowed: Sequence[Path] = ()) -> RunCase:
    """The first point of a bifurcation diagram as a case, with all its points."""
    from scissordyn.run.configuration import read_configuration

    configuration = read_configuration(diagram)
    mechanism = configuration.build_mechanism([file for file in allowed if file.suffix == ".py"])
    parameter, values = str(diagram.attrs["parameter"]), diagram["value"].values
    usable = [str(name) for name in diagram if set(diagram[name].dims) == {"value", "cycle"}][:MOST_FIGURES]
    across = scale_of(diagram["value"])

    def opened(point: int) -> RunCase:
        at = mechanism.replace(parameter, float(values[point]))
        until = CYCLES * float(diagram.attrs["period"]) if "period" in diagram.attrs else 1.0
        return RunCase(
            f"{path.name}, {parameter} = {across.said(float(values[point]))}", at, configuration.options or Options(until)
        )

    def figures(_: str) -> list[Figure]:
        keys = np.repeat(np.arange(float(values.size)), diagram.sizes["cycle"])
        drawn = []
        for name in usable:
            scale = scale_of(diagram[name])
            y = scale.factor * diagram[name].transpose("value", "cycle").values.ravel()
            line = _scatter("", "blue", across.factor * values[keys.astype(int)], y, keys, np.full(keys.size, 1.6))
            drawn.append(_figure(name, name.replace("_", " "), scale, across.label(parameter), [line], []))
        return drawn

    note = f"{values.size} values of {parameter}; a click on a point runs the mechanism with its value"
    return _with_points(Points((parameter,), figures, opened, 0, note))


def _with_points(points: Points) -> RunCase:
    case = points.opened(points.first)
    case.points = points
    return case


def _points_of_study(result: StudyResult) -> Points:
    from scissordyn.study.answer.recommendation import recommended_point
    from scissordyn.study.answer.verdict import counts

    study, points = result.study, result.points
    factors = [factor.address for factor in study.factors]
    best = recommended_point(study, result.dataset) if study.requirements or study.optimisation else -1
    complete, failed, pending = counts(result.dataset)

    def opened(point: int) -> RunCase:
        case = _worst_case(result, point)
        options = replace(study.options, trust=False)
        return RunCase(f"point {point} of {Path(result.store.address).name}", result.mechanism(case), options)

    def figures(axis: str) -> list[Figure]:
        return _figures_of_study(result, axis, best)

    said = [f"{points.sizes['point']} points, {complete} cases complete"]
    said += [f"{failed} failed"] * bool(failed) + [f"{pending} pending"] * bool(pending)
    if study.requirements:
        said.append("green: all cases meet the requirements, orange: some, red: none")
    if best >= 0:
        said.append(f"the large point {best} is the recommended one")
    said.append("a click on a point opens it" + (", in its worst case" if study.per_point > 1 else ""))
    return Points(factors or ("case",), figures, opened, max(best, 0), "; ".join(said))


def _worst_case(result: StudyResult, point: int) -> int:
    """The case of a point that is farthest beyond a requirement, or nearest to it; the first one without requirements."""
    from scissordyn.study.answer.recommendation import least_margins

    study = result.study
    if not 0 <= point < result.points.sizes["point"]:
        raise InputError(f"point {point}", f"0 to {result.points.sizes['point'] - 1}", "a click on a point")
    rows = slice(point * study.per_point, (point + 1) * study.per_point)
    if not study.requirements:
        return rows.start
    least = np.nan_to_num(least_margins(study, result.dataset)[rows], nan=np.inf)
    return rows.start + int(np.argmin(least))


def _figures_of_study(result: StudyResult, axis: str, best: int) -> list[Figure]:
    study, points = result.study, result.points
    count = points.sizes["point"]
    if axis in points:
        across, x = scale_of(points[axis]), points[axis].values
        label = (
            across.label(axis)
            if not across.labels
            else f"{axis}: {', '.join(f'{k} {name}' for k, name in enumerate(across.labels))}"
        )
    else:
        across, x, label = Scale(1.0, ""), np.arange(float(count)), "point"
    met = points["met"].values if study.requirements else np.full(count, 1.0)
    sizes = np.where(np.arange(count) == best, LARGE, SMALL)
    groups = (("green", met == 1.0), ("orange", (met > 0.0) & (met < 1.0)), ("vermilion", met == 0.0))
    drawn = []
    for name in [str(name) for name in points if points[name].attrs.get("role") == "response"][:MOST_FIGURES]:
        scale = scale_of(points[name])
        of_all = study.per_point > 1 and f"worst {name}" in points
        y = scale.factor * points[f"worst {name}" if of_all else name].values
        # points of the same number stand beside each other
        lines = [
            _scatter(
                "",
                color if study.requirements else "blue",
                across.factor * x[chosen],
                y[chosen],
                np.flatnonzero(chosen),
                sizes[chosen],
            )
            for color, chosen in groups
            if chosen.any()
        ]
        levels = [scale.factor * one.bound for one in study.requirements if one.response.name == name]
        bounds = "; ".join(one.label for one in study.requirements if one.response.name == name)
        title = f"worst {bounds or name}" if of_all else bounds or name
        drawn.append(_figure(name, title, scale, label, lines, levels))
    return drawn


def _scatter(label: str, color: str, x: np.ndarray, y: np.ndarray, keys: np.ndarray, sizes: np.ndarray) -> dict[str, Any]:
    return {"label": label, "color": color, "style": "points", "x": x, "y": y, "keys": keys.astype(float), "sizes": sizes}


def _figure(name: str, title: str, scale: Scale, axis: str, lines: list[dict[str, Any]], levels: list[float]) -> Figure:
    x = np.concatenate([line["x"] for line in lines]) if lines else np.zeros(1)
    x = x[np.isfinite(x)] if np.isfinite(x).any() else np.zeros(1)
    room = 0.04 * float(np.ptp(x)) or 0.5
    return {
        "name": f"points {name}",
        "title": title,
        "unit": scale.unit,
        "axis": axis,
        "lines": lines,
        "levels": levels,
        "own": True,
        "high": 170,
        "full": [float(x.min()) - room, float(x.max()) + room],
    }
