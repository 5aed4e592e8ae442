"""The points of a study or of a bifurcation diagram, as figures of the page; each opens as a run."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from scissordyn.errors import InputError, command
from scissordyn.explore.case import Case
from scissordyn.plot.scale import Scale, scale_of
from scissordyn.run.options import Options

if TYPE_CHECKING:
    import xarray as xr

    from scissordyn.study.result import StudyResult

MOST_FIGURES = 6  # Responses that are drawn, those of requirements first
CYCLES = 4  # A point of a diagram is run for so many periods of its drive
SMALL, LARGE = 3.0, 6.0  # Radius of a point, and of the recommended one [pixel]

Figure = dict[str, Any]


@dataclass(frozen=True)
class Points:
    """What the page shows of many runs."""

    axes: Sequence[str]  # numbers that the points can be drawn over
    figures: Callable[[str], list[Figure]]  # over one of them
    opened: Callable[[int], Case]  # the case of a point
    note: str

    def case(self, point: int) -> Case:
        """The case that the page begins with."""
        case = self.opened(point)
        case.points = self
        return case


def open_study_case(path: Path, allowed: Sequence[Path] = ()) -> Case:
    """The recommended point of a study as a case, with all its points."""
    from scissordyn.config.studies import open_study
    from scissordyn.study.answer.verdict import recommended_point

    result = open_study(path, allow_code=list(allowed))
    study, points = result.study, result.points
    complete, failed, pending = result.counts.values()
    if not complete:
        raise InputError(
            f"'{path}', a study without a complete case", "a study with results", command("scissordyn", "study", "resume", path)
        )
    best = recommended_point(study, result.dataset) if study.requirements or study.optimisation else -1

    def opened(point: int) -> Case:
        mechanism = result.mechanism(_worst_case(result, point))
        columns = {factor.path: points[factor.path] for factor in study.factors if factor.path in points}
        chosen = {name: scale_of(column).with_unit(float(column.values[point])) for name, column in columns.items()}
        return Case.of(f"point {point} of {path.name}", mechanism, replace(study.options, trust=False), allowed, chosen)

    notes = [
        f"{points.sizes['point']} points, {complete} cases complete",
        f"{failed} failed" if failed else "",
        f"{pending} pending" if pending else "",
        "green: all cases meet the requirements, orange: some, red: none" if study.requirements else "",
        f"the large point {best} is the recommended one" if best >= 0 else "",
        "a click on a point opens it" + (", in its worst case" if study.per_point > 1 else ""),
    ]
    axes = [factor.path for factor in study.factors] or ("case",)
    return Points(axes, lambda axis: _figures(result, axis, best), opened, "; ".join(filter(None, notes))).case(max(best, 0))


def open_diagram_case(path: Path, diagram: xr.Dataset, allowed: Sequence[Path] = ()) -> Case:
    """The first point of a bifurcation diagram as a case, with all its points."""
    from scissordyn.run.configuration import read_configuration

    configuration = read_configuration(diagram)
    mechanism = configuration.build_mechanism([file for file in allowed if file.suffix == ".py"])
    parameter, values = str(diagram.attrs["parameter"]), diagram["value"].values
    usable = [str(name) for name in diagram if set(diagram[name].dims) == {"value", "cycle"}][:MOST_FIGURES]
    across = scale_of(diagram["value"])
    until = CYCLES * float(diagram.attrs["period"]) if "period" in diagram.attrs else 1.0

    def opened(point: int) -> Case:
        value, options = float(values[point]), configuration.options or Options(until)
        name, chosen = f"{path.name}, {parameter} = {across.with_unit(value)}", {parameter: across.with_unit(value)}
        return Case.of(name, mechanism.replace(parameter, value), options, allowed, chosen)

    def figures(_: str) -> list[Figure]:
        keys = np.repeat(np.arange(values.size), diagram.sizes["cycle"])
        drawn = []
        for name in usable:
            scale = scale_of(diagram[name])
            y = scale.factor * diagram[name].transpose("value", "cycle").values.ravel()
            line = _scatter("blue", across.factor * values[keys], y, keys, np.full(keys.size, 1.6))
            drawn.append(_figure(name, name.replace("_", " "), scale, across.label(parameter), [line], []))
        return drawn

    note = f"{values.size} values of {parameter}; a click on a point runs the mechanism with its value"
    return Points((parameter,), figures, opened, note).case(0)


def _worst_case(result: StudyResult, point: int) -> int:
    """The case of a point that is farthest beyond a requirement, or nearest to it; the first one without requirements."""
    from scissordyn.study.answer.verdict import least_margins

    study = result.study
    if not 0 <= point < result.points.sizes["point"]:
        raise InputError(f"point {point}", f"0 to {result.points.sizes['point'] - 1}", "a click on a point")
    rows = slice(point * study.per_point, (point + 1) * study.per_point)
    if not study.requirements:
        return rows.start
    least = np.nan_to_num(least_margins(study, result.dataset)[rows], nan=np.inf)
    return rows.start + int(np.argmin(least))


def _figures(result: StudyResult, axis: str, best: int) -> list[Figure]:
    study, points = result.study, result.points
    count = points.sizes["point"]
    across, x, label = Scale(1.0, ""), np.arange(float(count)), "point"
    if axis in points:
        across, x = scale_of(points[axis]), points[axis].values
        names = ", ".join(f"{k} {name}" for k, name in enumerate(across.labels))
        label = f"{axis}: {names}" if names else across.label(axis)
    met = points["met"].values if study.requirements else np.full(count, np.nan)
    sizes = np.where(np.arange(count) == best, LARGE, SMALL)
    colours = {"green": met == 1.0, "orange": (met > 0.0) & (met < 1.0), "vermilion": met == 0.0, "blue": np.isnan(met)}
    drawn = []
    for name in [str(name) for name in points if points[name].attrs.get("role") == "response"][:MOST_FIGURES]:
        scale = scale_of(points[name])
        of_all = study.per_point > 1 and f"worst {name}" in points
        y = scale.factor * points[f"worst {name}" if of_all else name].values
        lines = [
            _scatter(colour, across.factor * x[chosen], y[chosen], np.flatnonzero(chosen), sizes[chosen])
            for colour, chosen in colours.items()
            if chosen.any()
        ]
        required = [requirement for requirement in study.requirements if requirement.response.name == name]
        title = "; ".join(requirement.label for requirement in required) or name
        levels = [scale.factor * requirement.bound for requirement in required]
        drawn.append(_figure(name, f"worst {title}" if of_all else title, scale, label, lines, levels))
    return drawn


def _scatter(color: str, x: np.ndarray, y: np.ndarray, keys: np.ndarray, sizes: np.ndarray) -> dict[str, Any]:
    return {"label": "", "color": color, "style": "points", "x": x, "y": y, "keys": keys.astype(float), "sizes": sizes}


def _figure(name: str, title: str, scale: Scale, axis: str, lines: list[dict[str, Any]], levels: list[float]) -> Figure:
    x = np.concatenate([np.zeros(1 - bool(lines)), *(line["x"] for line in lines)])
    x = x[np.isfinite(x)] if np.isfinite(x).any() else np.zeros(1)
    room = 0.04 * float(np.ptp(x)) or 0.5
    about = {"name": f"points {name}", "title": title, "unit": scale.unit, "axis": axis, "lines": lines, "levels": levels}
    return about | {"own": True, "high": 170, "full": [float(x.min()) - room, float(x.max()) + room]}
