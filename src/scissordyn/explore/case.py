"""The case that the explorer changes: a case file, or what a saved run, a point of a study or of a diagram carries."""

from __future__ import annotations

import copy
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

import scissordyn
from scissordyn.casefile.case_text import record_text
from scissordyn.casefile.code import AllowedCode, Code
from scissordyn.casefile.configuration import RecordTable, is_run, read_configuration
from scissordyn.casefile.table import instance
from scissordyn.casefile.text import read_text
from scissordyn.config.file import read_case
from scissordyn.errors import InputError, command
from scissordyn.explore.field import Field, fields_of
from scissordyn.laws.catalogue import BY_KIND
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.options import Options
from scissordyn.model.walk import given, is_described
from scissordyn.plot.scale import Scale, scale_of
from scissordyn.plugin.user_file import origin_of
from scissordyn.record.store import load
from scissordyn.run.inverse_dynamics import feed_forward

if TYPE_CHECKING:
    from scissordyn.studies.result import StudyResult


MOST_FIGURES = 6  # Responses that are drawn, those of requirements first
CYCLES = 4  # A point of a diagram is run for so many periods of its drive
WIDTH = 110  # Of a line of Python
SMALL, LARGE = 3.0, 6.0  # Radius of a point, and of the recommended one [pixel]

Figure = dict[str, Any]

NOTHING: Mapping[str, str] = MappingProxyType({})


class Case:
    """A case, frozen: a change makes another one."""

    saved: xr.Dataset | None = None  # Its run, if that was read from a file
    points: Points | None = None  # Those of the study or the diagram that it was opened from
    chosen: Mapping[str, str] = NOTHING  # Of such a point: what varies between the points, as text

    def __init__(self, name: str, source: str, code: Code, tree: dict[str, Any] | None = None) -> None:
        self.name, self.source, self.code = name, source, code
        self.tree = tomllib.loads(source) if tree is None else tree
        table: Any = instance(RecordTable, self.tree, {"folder": code.folder or Path(), "code": code})
        self.mechanism: Mechanism = table.mechanism(feed_forward)
        self.options: Options = table.run

    @classmethod
    def of(
        cls,
        name: str,
        mechanism: Mechanism,
        options: Options,
        allowed: Sequence[Path] = (),
        chosen: Mapping[str, str] = NOTHING,
    ) -> Case:
        """The case of a point of a study or a diagram."""
        case = cls.carried(name, record_text(mechanism, options), allowed)
        case.chosen = chosen
        return case

    @classmethod
    def carried(cls, name: str, source: str, allowed: Sequence[Path]) -> Case:
        """The case that a run carries."""
        tree = tomllib.loads(source)
        return cls(name, source, AllowedCode([file for file in allowed if file.suffix == ".py"], tree.get("code", {})), tree)

    @cached_property
    def fields(self) -> dict[str, Field]:
        """Every number of the tables, by its key."""
        return {field.key: field for field in fields_of(self.tree, self.code)}

    def field(self, key: str) -> Field:
        """A field by its key."""
        if key not in self.fields:
            raise InputError(f"no number '{key}' in this case", "a number of the form")
        return self.fields[key]

    def changed(self, texts: Mapping[str, str]) -> Case:
        """The case with other numbers."""
        tree = copy.deepcopy(self.tree)
        for key, text in texts.items():
            _put(tree, self.field(key), _value(text, self.field(key)))
        return self._with(tree)

    def with_horizon(self, wanted: bool) -> Case:
        """The case with or without the predictability horizon, for which each run is computed twice."""
        return self._with({**self.tree, "run": {**self.tree.get("run", {}), "trust": wanted}})

    def _with(self, tree: dict[str, Any]) -> Case:
        """The case with other tables."""
        return Case(self.name, self.source, self.code, tree)

    def text(self) -> str:
        """The case file with the changed values in it; its comments and its order stay."""
        import tomlkit

        document = tomlkit.parse(self.source)
        _carry(document, tomllib.loads(self.source), self.tree)
        return str(tomlkit.dumps(document))


def open_case(path: Path, allowed: Sequence[Path] = ()) -> Case:
    """The case of a file; no other file is read unless it is allowed."""
    if path.suffix.lower() == ".db":
        return open_study_case(path, allowed)
    if path.suffix.lower() == ".nc":
        run = load(path)
        if {"value", "cycle"} <= set(run.dims) and "parameter" in run.attrs:
            return open_diagram_case(path, run, allowed)
        configuration = read_configuration(run)
        if configuration.options is None or not is_run(run):
            raise InputError(f"'{path}' is not a run", "a run of 'scissordyn run', or a case file")
        case = Case.carried(path.name, configuration.text, allowed)
        case.saved = run if run.sizes["time"] > 1 else None
        return case
    source = read_text(path, "a case file in TOML", f"scissordyn new scissor > {command(path)}")
    try:
        tree = tomllib.loads(source)
    except ValueError:
        tree = {}
    may = {file.resolve() for file in allowed}
    for named in _files(tree):
        if (path.parent / named).resolve() not in may:
            raise InputError(
                f"'{path}' names the file '{named}', which the explorer does not read or execute unasked",
                "the given file alone, or further files by name",
                command("scissordyn", "explore", path, "--allow", named),
            )
    read_case(path)  # its errors name the line
    return Case(path.name, source, Code(path.parent), tree)


def _files(value: Any, key: str = "") -> Iterator[str]:
    """Names of files in a case file: Python functions and classes, and tables."""
    if isinstance(value, Mapping):
        for name, inner in value.items():
            yield from _files(inner, name)
    elif isinstance(value, list):
        for inner in value:
            yield from _files(inner, key)
    elif isinstance(value, str) and ".py:" in value:
        yield value.rpartition(":")[0]
    elif isinstance(value, str) and key == "table":
        yield value


def _value(text: str, field: Field) -> Any:
    """A text of the form as the value of a case file: a plain number where there is no unit."""
    text = text.strip()
    if field.choices and text.isdecimal():
        return int(text)
    if field.quantity.unit != "1" or len(field.value) != 1:
        return text
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return text


def _put(tree: dict[str, Any], field: Field, value: Any) -> None:
    """Write a value at the place of a field, whose tables need not be there yet."""
    here: Any = tree
    *path, last = field.place
    for key in path:
        inner = here[key] if isinstance(key, int) else here.setdefault(key, {})
        if (key in BY_KIND or key == "controller") and not (isinstance(inner, dict) and inner):
            inner = here[key] = {"name" if key == "controller" else "law": field.law}
        here = inner
    here[last] = value


def _carry(document: Any, before: Any, after: Any) -> None:
    """Write what has changed between two trees into a document of the same shape."""
    keys = range(len(after)) if isinstance(after, list) else list(after)
    for key in keys:
        new = isinstance(before, Mapping) and key not in before
        if not new and type(before[key]) is type(after[key]) and isinstance(after[key], dict | list):
            _carry(document[key], before[key], after[key])
        elif new or before[key] != after[key]:
            document[key] = after[key]


def python_of(case: Case) -> str:
    """Python that describes the mechanism of a case and simulates it; its numbers are those of the case bit for bit."""
    from rich.pretty import pretty_repr

    imports: dict[str, str] = {}
    body = pretty_repr(_code(case.mechanism, imports), max_width=WIDTH)
    options = [f"{field.name}={value!r}" for field, value in given(case.options)]
    lines = ["import scissordyn as sd", *(f"from {module} import {name}" for name, module in sorted(imports.items()))]
    return "\n".join([*lines, "", f"mechanism = {body}", f"run = sd.simulate(mechanism, {', '.join(options)})", ""])


def _code(value: Any, imports: dict[str, str]) -> Any:
    """A value as an object whose representation is Python: a description is a call with what is not its default."""
    if is_described(value):
        arguments = [(field.name, _code(inner, imports)) for field, inner in given(value)]
        return type(_name(type(value), imports), (), {"__rich_repr__": lambda _: iter(arguments)})()
    if isinstance(value, tuple):
        return tuple(_code(item, imports) for item in value)
    if isinstance(value, Mapping):
        return {key: _code(item, imports) for key, item in value.items()}
    if value is None or isinstance(value, str | int | float):
        return value
    raise InputError(
        f"'{getattr(value, '__name__', value)}', a function of yours, in the case",
        "a case without functions of your own",
        "Save run",
    )


def _name(kind: type, imports: dict[str, str]) -> str:
    if getattr(scissordyn, kind.__name__, None) is kind:
        return f"sd.{kind.__name__}"
    if origin_of(kind) is not None:
        raise InputError(f"the class '{kind.__name__}' of yours in the case", "a case without classes of your own", "Save run")
    imports[kind.__name__] = kind.__module__
    return kind.__name__


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
    from scissordyn.studies.answer.verdict import recommended_point

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
    from scissordyn.studies.answer.verdict import least_margins

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
