"""Case of the explorer: read from a case file, a saved run, or a point of a study or diagram, and changed by form fields."""

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

import scissordyn
from scissordyn.casefile.case_text import record_text
from scissordyn.casefile.code import AllowedCode, Code
from scissordyn.casefile.configuration import RecordTable, is_run, mechanism_of_record, read_configuration
from scissordyn.casefile.table import instance
from scissordyn.casefile.text import read_text
from scissordyn.config.file import read_case
from scissordyn.errors import InputError, command
from scissordyn.explore.field import Field, fields_of
from scissordyn.laws.catalogue import BY_KIND
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.options import Options
from scissordyn.model.walk import is_described, non_default_fields
from scissordyn.plot.scale import Scale, scale_of
from scissordyn.plugin.user_file import origin_of
from scissordyn.record.store import load
from scissordyn.run.inverse_dynamics import feed_forward
from scissordyn.warning import LISTED_MAX

if TYPE_CHECKING:
    import xarray as xr

    from scissordyn.studies.result import StudyResult


POINT_RADIUS, BEST_POINT_RADIUS = 3.0, 6.0  # Radii of a study's points and of the recommended point in the drawing [pixel]

Figure = dict[str, Any]

NO_VALUES: Mapping[str, str] = MappingProxyType({})  # Values of varied parameters if no parameter is varied


class Case:
    """Immutable case of the explorer; each change returns a new case."""

    saved: xr.Dataset | None = None  # Run of the case, if it was read from a file
    points: Points | None = None  # Points of the study or diagram from which the case was opened
    chosen: Mapping[str, str] = NO_VALUES  # Values of the varied parameters at that point, as text

    def __init__(self, name: str, source: str, code: Code, tree: dict[str, Any] | None = None) -> None:
        self.name, self.source, self.code = name, source, code
        self.tree = tomllib.loads(source) if tree is None else tree
        table: Any = instance(RecordTable, self.tree, {"folder": code.folder or Path(), "code": code})
        self.mechanism: Mechanism = mechanism_of_record(table, feed_forward)
        self.options: Options = table.run

    @classmethod
    def of(
        cls,
        name: str,
        mechanism: Mechanism,
        options: Options,
        allowed: Sequence[Path] = (),
        chosen: Mapping[str, str] = NO_VALUES,
    ) -> Case:
        """Return a case with a mechanism and options, for a point of a study or diagram.

        `allowed` are the files with user-defined code that may be executed, `chosen` the values of the varied parameters.
        """
        case = cls.from_stored_text(name, record_text(mechanism, options), allowed)
        case.chosen = chosen
        return case

    @classmethod
    def from_stored_text(cls, name: str, source: str, allowed: Sequence[Path]) -> Case:
        """Return the case whose text `source` a saved run stores; `allowed` are files whose code may be executed."""
        tree = tomllib.loads(source)
        return cls(name, source, AllowedCode([file for file in allowed if file.suffix == ".py"], tree.get("code", {})), tree)

    @cached_property
    def fields(self) -> dict[str, Field]:
        """Form fields of all tables of the case, by key."""
        return {field.key: field for field in fields_of(self.tree, self.code)}

    def field(self, key: str) -> Field:
        """Return the form field with a key; raise `InputError` if there is none."""
        if key not in self.fields:
            raise InputError(f"the case has no field '{key}'", "a field of the form")
        return self.fields[key]

    def changed(self, texts: Mapping[str, str]) -> Case:
        """Return the case with new texts in some fields."""
        tree = copy.deepcopy(self.tree)
        for key, text in texts.items():
            _write_value(tree, self.field(key), _value(text, self.field(key)))
        return self._with(tree)

    def with_horizon(self, wanted: bool) -> Case:
        """Return the case with or without the predictability horizon, which requires two runs."""
        return self._with({**self.tree, "run": {**self.tree.get("run", {}), "trust": wanted}})

    def _with(self, tree: dict[str, Any]) -> Case:
        """Return a copy of the case with other parsed tables."""
        return Case(self.name, self.source, self.code, tree)

    def text(self) -> str:
        """Return the case file with the changed values; comments and order are kept."""
        import tomlkit

        document = tomlkit.parse(self.source)
        _copy_changes(document, tomllib.loads(self.source), self.tree)
        document.pop("ideal", None)  # a record alone has this table
        return str(tomlkit.dumps(document))


def open_case(path: Path, allowed: Sequence[Path] = ()) -> Case:
    """Read the case of a case file, run, study or diagram; files that it names are read only if they are in `allowed`."""
    if path.suffix.lower() == ".db":
        return open_study_case(path, allowed)
    if path.suffix.lower() == ".nc":
        run = load(path)
        if {"value", "cycle"} <= set(run.dims) and "parameter" in run.attrs:
            return open_diagram_case(path, run, allowed)
        configuration = read_configuration(run)
        if configuration.options is None or not is_run(run):
            raise InputError(f"'{path}' is not a run", "a run of 'scissordyn run', or a case file")
        case = Case.from_stored_text(path.name, configuration.text, allowed)
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
                f"'{path}' refers to the file '{named}', which the explorer reads or executes only with permission",
                "a file without references, or the referenced files by name",
                command("scissordyn", "explore", path, "--allow", named),
            )
    read_case(path)  # reports errors with line numbers
    return Case(path.name, source, Code(path.parent), tree)


def _files(value: Any, key: str = "") -> Iterator[str]:
    """Yield the names of files that a case file refers to: Python code, and tables of time functions."""
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
    """Convert the text of a form field to a value of the case file; without unit it becomes a number."""
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


def _write_value(tree: dict[str, Any], field: Field, value: Any) -> None:
    """Write the value of a field to the parsed tables; missing tables are created."""
    here: Any = tree
    *path, last = field.place
    for key in path:
        inner = here[key] if isinstance(key, int) else here.setdefault(key, {})
        if (key in BY_KIND or key == "controller") and not (isinstance(inner, dict) and inner):
            inner = here[key] = {"name" if key == "controller" else "law": field.law}
        here = inner
    here[last] = value


def _copy_changes(document: Any, before: Any, after: Any) -> None:
    """Apply the differences between two parsed trees to a TOML document with comments."""
    keys = range(len(after)) if isinstance(after, list) else list(after)
    for key in keys:
        new = isinstance(before, Mapping) and key not in before
        if not new and type(before[key]) is type(after[key]) and isinstance(after[key], dict | list):
            _copy_changes(document[key], before[key], after[key])
        elif new or before[key] != after[key]:
            document[key] = after[key]


def python_of(case: Case) -> str:
    """Return Python code that builds the mechanism of a case and simulates it, with bit-identical values."""
    width = 110  # line length of generated Python
    from rich.pretty import pretty_repr

    imports: dict[str, str] = {}
    body = pretty_repr(_code(case.mechanism, imports), max_width=width)
    options = [f"{field.name}={value!r}" for field, value in non_default_fields(case.options)]
    lines = ["import scissordyn as sd", *(f"from {module} import {name}" for name, module in sorted(imports.items()))]
    return "\n".join([*lines, "", f"mechanism = {body}", f"run = sd.simulate(mechanism, {', '.join(options)})", ""])


def _code(value: Any, imports: dict[str, str]) -> Any:
    """Return an object whose `repr` is Python code for a value; a dataclass becomes a call without default values."""
    if is_described(value):
        arguments = [(field.name, _code(inner, imports)) for field, inner in non_default_fields(value)]
        return type(_name(type(value), imports), (), {"__rich_repr__": lambda _: iter(arguments)})()
    if isinstance(value, tuple):
        return tuple(_code(item, imports) for item in value)
    if isinstance(value, Mapping):
        return {key: _code(item, imports) for key, item in value.items()}
    if value is None or isinstance(value, str | int | float):
        return value
    raise InputError(
        f"the case contains the user-defined function '{getattr(value, '__name__', value)}'",
        "a case without user-defined functions",
        "Save run",
    )


def _name(kind: type, imports: dict[str, str]) -> str:
    if getattr(scissordyn, kind.__name__, None) is kind:
        return f"sd.{kind.__name__}"
    if origin_of(kind) is not None:
        raise InputError(
            f"the case contains the user-defined class '{kind.__name__}'", "a case without user-defined classes", "Save run"
        )
    imports[kind.__name__] = kind.__module__
    return kind.__name__


@dataclass(frozen=True)
class Points:
    """Points of a study or a diagram, from which the user opens cases on the page."""

    axes: Sequence[str]  # Parameters that can be the horizontal axis
    figures: Callable[[str], list[Figure]]  # Figures of all points over one of these parameters
    case_at: Callable[[int], Case]  # Function that returns the case of a point by its index
    note: str  # Text below the figures

    def case(self, point: int) -> Case:
        """Return the case with which the page opens: that of a point, together with all points."""
        case = self.case_at(point)
        case.points = self
        return case


def open_study_case(path: Path, allowed: Sequence[Path] = ()) -> Case:
    """Return the case at the recommended point of a study, or at its first point; it contains all points of the study."""
    from scissordyn.config.studies import open_study
    from scissordyn.studies.answer.verdict import recommended_point

    result = open_study(path, allow_code=list(allowed))
    study, points = result.study, result.points
    complete, failed, pending = result.counts.values()
    if not complete:
        raise InputError(
            f"the study '{path}' has no complete case", "a study with results", command("scissordyn", "study", "resume", path)
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
        "click a point to open it" + (", in its worst case" if study.per_point > 1 else ""),
    ]
    axes = [factor.path for factor in study.factors] or ("case",)
    return Points(axes, lambda axis: _figures(result, axis, best), opened, "; ".join(filter(None, notes))).case(max(best, 0))


def open_diagram_case(path: Path, diagram: xr.Dataset, allowed: Sequence[Path] = (), periods: int = 4) -> Case:
    """Return the case at the first point of a bifurcation diagram; it contains all points of the diagram.

    `periods`: duration of the run of a point, in periods of the drive.
    """
    configuration = read_configuration(diagram)
    mechanism = configuration.build_mechanism([file for file in allowed if file.suffix == ".py"])
    parameter, values = str(diagram.attrs["parameter"]), diagram["value"].values
    usable = [str(name) for name in diagram if set(diagram[name].dims) == {"value", "cycle"}][:LISTED_MAX]
    across = scale_of(diagram["value"])
    until = periods * float(diagram.attrs["period"]) if "period" in diagram.attrs else 1.0

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

    note = f"{values.size} values of {parameter}; click a point to run the mechanism with its value"
    return Points((parameter,), figures, opened, note).case(0)


def _worst_case(result: StudyResult, point: int) -> int:
    """Return the case of a point with the smallest margin to any requirement; the first case without requirements."""
    from scissordyn.studies.answer.verdict import least_margins

    study = result.study
    if not 0 <= point < result.points.sizes["point"]:
        raise InputError(f"no point {point} in the study", f"0 to {result.points.sizes['point'] - 1}", "a click on a point")
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
    sizes = np.where(np.arange(count) == best, BEST_POINT_RADIUS, POINT_RADIUS)
    colours = {"green": met == 1.0, "orange": (met > 0.0) & (met < 1.0), "vermilion": met == 0.0, "blue": np.isnan(met)}
    drawn = []
    for name in [str(name) for name in points if points[name].attrs.get("role") == "response"][:LISTED_MAX]:
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
