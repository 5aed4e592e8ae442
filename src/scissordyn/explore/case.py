"""The case that the explorer changes: a case file, or what a saved run or a point of a study carries."""

from __future__ import annotations

import copy
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import xarray as xr

from scissordyn.config.case import RecordTable
from scissordyn.config.case_text import record_text
from scissordyn.config.code import AllowedCode, Code
from scissordyn.config.file import read_case
from scissordyn.config.table import instance
from scissordyn.config.text import read_text
from scissordyn.errors import InputError, command
from scissordyn.explore.field import Field, fields_of
from scissordyn.laws.catalogue import BY_KIND
from scissordyn.model.mechanism import Mechanism
from scissordyn.run.configuration import is_run, read_configuration
from scissordyn.run.options import Options
from scissordyn.run.store import load

if TYPE_CHECKING:
    from scissordyn.explore.points import Points


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
        self.mechanism: Mechanism = table.mechanism()
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
    def fields(self) -> list[Field]:
        """Every number of the tables."""
        return fields_of(self.tree, self.code)

    @cached_property
    def _by_key(self) -> dict[str, Field]:
        return {field.key: field for field in self.fields}

    def field(self, key: str) -> Field:
        """A field by its key."""
        if key not in self._by_key:
            raise InputError(f"no number '{key}' in this case", "a number of the form")
        return self._by_key[key]

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
        """The case with other tables; of a changed speed or clearance the plan is not made anew."""
        case = Case(self.name, self.source, self.code, tree)
        case.mechanism.borrow_plan(self.mechanism)
        return case

    def text(self) -> str:
        """The case file with the changed values in it; its comments and its order stay."""
        import tomlkit

        document = tomlkit.parse(self.source)
        _carry(document, tomllib.loads(self.source), self.tree)
        return str(tomlkit.dumps(document))


def open_case(path: Path, allowed: Sequence[Path] = ()) -> Case:
    """The case of a file; no other file is read unless it is allowed."""
    if path.suffix.lower() == ".db":
        from scissordyn.explore.points import open_study_case

        return open_study_case(path, allowed)
    if path.suffix.lower() == ".nc":
        run = load(path)
        if {"value", "cycle"} <= set(run.dims) and "parameter" in run.attrs:
            from scissordyn.explore.points import open_diagram_case

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
