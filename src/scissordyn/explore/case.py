"""The case that the explorer changes: a case file, or a saved run. No other file is read."""

from __future__ import annotations

import copy
import dataclasses
import tomllib
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import xarray as xr

from scissordyn.config.case import CaseTable
from scissordyn.config.file import read_case
from scissordyn.config.quantity import read_numbers, read_quantity
from scissordyn.config.table import instance
from scissordyn.config.text import read_text
from scissordyn.errors import InputError, command
from scissordyn.explore.field import Field, fields_of_mechanism, fields_of_tree
from scissordyn.laws.catalogue import BY_KIND
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.walk import replaced
from scissordyn.run.configuration import is_run, read_configuration
from scissordyn.run.options import Options
from scissordyn.run.store import load

if TYPE_CHECKING:
    from scissordyn.explore.points import Points


class Case(ABC):
    """A case, frozen: a change makes another one."""

    name: str
    mechanism: Mechanism
    options: Options
    saved: xr.Dataset | None = None
    """Its run, if that was read from a file."""
    points: Points | None = None
    """Those of the study or the diagram that it was opened from."""

    @property
    @abstractmethod
    def fields(self) -> list[Field]:
        """Every number of the case."""

    @abstractmethod
    def changed(self, texts: Mapping[str, str]) -> Case:
        """The case with other numbers."""

    @abstractmethod
    def with_horizon(self, wanted: bool) -> Case:
        """The case with or without the predictability horizon, for which each run is computed twice."""

    @abstractmethod
    def text(self) -> str | None:
        """The case as a case file; None where there is none."""

    def field(self, key: str) -> Field:
        """A field by its key."""
        found = self._by_key.get(key)
        if found is None:
            raise InputError(f"no number '{key}' in this case", "a number of the form")
        return found

    @cached_property
    def _by_key(self) -> dict[str, Field]:
        return {field.key: field for field in self.fields}


class FileCase(Case):
    """A case file, with changes."""

    def __init__(self, name: str, source: str, folder: Path, tree: dict[str, Any]) -> None:
        self.name, self.source, self.folder, self.tree = name, source, folder, tree
        read = instance(CaseTable, tree, {"folder": folder}).case()
        self.mechanism, self.options = read.mechanism, read.run

    @cached_property
    def fields(self) -> list[Field]:
        """Every number of the file's tables."""
        return fields_of_tree(self.tree, self.folder)

    def changed(self, texts: Mapping[str, str]) -> FileCase:
        """See `Case.changed`."""
        tree = copy.deepcopy(self.tree)
        for key, text in texts.items():
            _put(tree, self.field(key), _value(text, self.field(key)))
        return FileCase(self.name, self.source, self.folder, tree)

    def with_horizon(self, wanted: bool) -> FileCase:
        """See `Case.with_horizon`."""
        tree = copy.deepcopy(self.tree)
        tree.setdefault("run", {})["trust"] = wanted
        return FileCase(self.name, self.source, self.folder, tree)

    def text(self) -> str:
        """The file with the changed values in it; its comments and its order stay."""
        import tomlkit

        document = tomlkit.parse(self.source)
        _carry(document, tomllib.loads(self.source), self.tree)
        return str(tomlkit.dumps(document))


class RunCase(Case):
    """The case of a saved run."""

    def __init__(self, name: str, mechanism: Mechanism, options: Options, saved: xr.Dataset | None = None) -> None:
        self.name, self.mechanism, self.options, self.saved = name, mechanism, options, saved

    @cached_property
    def fields(self) -> list[Field]:
        """Every declared number of the mechanism and of the options."""
        return fields_of_mechanism(self.mechanism, self.options)

    def changed(self, texts: Mapping[str, str]) -> RunCase:
        """See `Case.changed`."""
        parts: dict[str, Any] = {"mechanism": self.mechanism, "options": self.options}
        for key, text in texts.items():
            field = self.field(key)
            given = _value(text, field)
            value: Any
            if len(field.value) == 2:
                value = read_numbers(given, field.quantity.unit)
                if len(value) != 2:
                    raise InputError(f"{field.name}: {len(value)} numbers", "two numbers and their unit")
            else:
                value = read_quantity(given, field.quantity, field.text)
            top, *path = field.place
            parts[str(top)] = replaced(parts[str(top)], path, value)
        return RunCase(self.name, parts["mechanism"], parts["options"])

    def with_horizon(self, wanted: bool) -> RunCase:
        """See `Case.with_horizon`."""
        return RunCase(self.name, self.mechanism, dataclasses.replace(self.options, trust=wanted))

    def text(self) -> str | None:
        """None: a saved run has no case file."""
        return None


def open_case(path: Path, allowed: Sequence[Path] = ()) -> Case:
    """The case of a file."""
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
        mechanism = configuration.build_mechanism([file for file in allowed if file.suffix == ".py"])
        return RunCase(path.name, mechanism, configuration.options, run if run.sizes["time"] > 1 else None)
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
    return FileCase(path.name, source, path.parent, tree)


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
        known = key in before if isinstance(before, Mapping) else True
        if known and type(before[key]) is type(after[key]) and isinstance(after[key], dict | list):
            _carry(document[key], before[key], after[key])
        elif not known or before[key] != after[key]:
            document[key] = after[key]
