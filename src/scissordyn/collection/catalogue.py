"""Zoo of mechanisms with sources and reference values, from folders of this package and of other installed packages."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property
from importlib.metadata import entry_points
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, get_args

import numpy as np

from scissordyn.bibliography.reference import Reference, references
from scissordyn.casefile.case import Case
from scissordyn.casefile.quantity import read_quantity
from scissordyn.casefile.table import About, Context, Table, add_prefix, dataclass_reader, instance, reader
from scissordyn.casefile.text import read_text
from scissordyn.config.file import folder_of_examples, in_file, parse_toml, read_case
from scissordyn.errors import InputError, did_you_mean
from scissordyn.model.mechanism import Mechanism
from scissordyn.run.simulate import simulate
from scissordyn.tolerance import DATA_TOL
from scissordyn.units import Quantity

if TYPE_CHECKING:
    import xarray as xr


DECLARATION, CASE = "zoo.toml", "case.toml"  # Names of the two files that describe a mechanism of the zoo

Kind = Literal["benchmark", "clearance joints", "linkage", "scissor structure", "deployable", "machine", "toy"]


Origin = Literal["closed form", "published", "second formulation", "this program"]  # Origin of a reference value


@reader(lambda: {"type": "object"})
def _where(given: Any, _: Context) -> Mapping[str, str | int]:
    if not isinstance(given, Mapping) or not all(isinstance(value, str | int) for value in given.values()):
        raise InputError("not a table of names or indices", 'a name along each dimension, { body = "slider", axis = "x" }')
    return dict(given)


@dataclass(frozen=True)
class ReferenceValue:
    """Reference value of a result: the variable and instant in a run, the value with its tolerance, and its origin."""

    what: Annotated[str, About("the quantity, in words", examples=["slider after 3 ms"])]
    variable: Annotated[str, About("variable of the run", examples=["position"])]
    value: Annotated[str, About("with its unit", examples=["165.2 mm"])]
    tolerance: Annotated[str, About("largest difference, with its unit", examples=["1 um"])]
    origin: Annotated[Origin, About("the kind of source", examples=get_args(Origin)[:1])]
    reason: Annotated[str, About("formula, publication or program", examples=["r cos a + l cos b"])]
    # Labels, or indices from 0, along the dimensions of the variable except time
    where: Annotated[Mapping[str, str | int], _where, About("names along its dimensions")] = field(default_factory=dict)
    # Instant of a sample; empty for a variable without time
    at: Annotated[str, About('an instant, "start", "end", "largest" or "smallest"', examples=["3 ms"])] = ""
    ideal: Annotated[bool, About("true for a run with ideal joints")] = True

    def measure(self, run: xr.Dataset) -> ComparedValue:
        """Read the variable of a run at the instant of this reference value, and compare both."""
        with add_prefix(f"number '{self.what}'"):
            if self.variable not in run:
                near = did_you_mean(self.variable, map(str, run.variables))
                raise InputError(f"the run has no variable '{self.variable}'{near}", "a variable of the run")
            values = self._selected(run)
            unit = str(values.attrs.get("units", "1"))
            expected, tolerance = (_read(text, unit) for text in (self.value, self.tolerance))
            if values.ndim:
                raise InputError(
                    f"'{self.variable}' has the dimensions {', '.join(map(str, values.dims))}", "a label for each in `where`"
                )
            return ComparedValue(self, float(values), expected, tolerance, unit)

    def _selected(self, run: xr.Dataset) -> xr.DataArray:
        values = run[self.variable]
        for dim, chosen in self.where.items():
            if dim not in values.dims:
                raise InputError(f"'{self.variable}' has no dimension '{dim}'", ", ".join(map(str, values.dims)))
            labels = [] if isinstance(chosen, int) else values[dim].values.astype(str).tolist()
            index = chosen if isinstance(chosen, int) else labels.index(chosen) if chosen in labels else -1
            if not 0 <= index < values.sizes[dim]:
                allowed = ", ".join(labels) or f"0 to {values.sizes[dim] - 1}"
                raise InputError(f"unknown {dim} '{chosen}'{did_you_mean(str(chosen), labels)}", allowed)
            values = values.isel({dim: index})
        if "time" not in values.dims:
            return values
        if self.at in ("largest", "smallest"):
            reduced = values.max("time") if self.at == "largest" else values.min("time")
            return reduced.assign_attrs(values.attrs)
        return values.isel(time=_instant(run["time"].values, self.at))


@dataclass(frozen=True)
class ComparedValue:
    """Value found in a run, with the reference value and its tolerance."""

    number: ReferenceValue
    found: float  # Value of the run, in the unit of the variable
    expected: float
    tolerance: float
    unit: str

    @property
    def difference(self) -> float:
        """Value of the run minus reference value, in the unit of the variable."""
        return self.found - self.expected

    @property
    def met(self) -> bool:
        """True if the difference is within the tolerance."""
        return math.isfinite(self.found) and abs(self.difference) <= self.tolerance


def _read(text: str, unit: str) -> float:
    """Convert a text such as "3 mm" to SI units; a number without a unit is allowed for a quantity without dimension."""
    value: float | str = text
    if unit == "1":
        with suppress(ValueError):
            value = float(text)
    try:
        return read_quantity(value, Quantity(unit))
    except InputError as error:
        raise InputError(f"'{text}': {error.what}", error.expected or f"a number in {unit}") from None


def _instant(times: np.ndarray, at: str) -> int:
    """Return the index of the sample at an instant: "start", "end" or a time with a unit."""
    if at in ("start", "end"):
        return 0 if at == "start" else len(times) - 1
    wanted = read_quantity(at, Quantity("s"))
    index = int(np.argmin(np.abs(times - wanted)))
    if abs(times[index] - wanted) > DATA_TOL * (times[-1] - times[0]) / max(len(times) - 1, 1):
        raise InputError(f"at = '{at}' is between two samples", f"the instant of a sample, such as {times[index]:.9g} s")
    return index


@dataclass(frozen=True)
class Entry:
    """Mechanism of the zoo: its case file, description, source and reference values."""

    name: str  # Name in ``sd.zoo[name]`` and ``scissordyn zoo NAME``
    title: str  # Short description
    kind: str
    about: str  # Origin of the parameters
    licence: str  # Licence of the files, as an SPDX expression; facts of a source are not subject to it
    numbers: tuple[ReferenceValue, ...]
    case_file: Path
    package: str = "scissordyn"  # Package that contains the entry

    @property
    def text(self) -> str:
        """Text of the case file."""
        return read_text(self.case_file, "a case file in TOML")

    @cached_property
    def case(self) -> Case:
        """Mechanism and options of the case file."""
        return read_case(self.case_file)

    @property
    def mechanism(self) -> Mechanism:
        """Mechanism that the case file describes."""
        return self.case.mechanism

    @property
    def references(self) -> tuple[Reference, ...]:
        """Publications that describe the mechanism."""
        return references(self.mechanism.source)

    def simulate(self, *, ideal: bool = False) -> xr.Dataset:
        """Simulate the mechanism with the options of its case file; with `ideal`, without clearance in its joints."""
        return simulate(self.mechanism.ideal() if ideal else self.mechanism, **self.case.run.keywords)

    def check(self) -> tuple[ComparedValue, ...]:
        """Simulate the mechanism and compare the results with its reference values."""
        runs = {ideal: self.simulate(ideal=ideal) for ideal in {number.ideal for number in self.numbers}}
        for run in runs.values():
            if run.attrs["status"] != "complete":
                raise InputError(f"the run of '{self.name}' is {run.attrs['status']}: {run.attrs['cause']}", "a complete run")
        return tuple(number.measure(runs[number.ideal]) for number in self.numbers)


class _EntryTable(Table):
    """Keys of a file `zoo.toml`."""

    title: Annotated[str, About("a short description", examples=["Slider-crank with a clearance joint"])]
    kind: Annotated[Kind, About("the kind of mechanism", examples=["linkage"])]
    about: Annotated[str, About("origin of the parameters", examples=["Lengths of the original."])]
    licence: Annotated[str, About("licence of the files", examples=["BSD-3-Clause"])] = "BSD-3-Clause"
    example: Annotated[str | None, About("the example of the package that is used as case file", examples=["press"])] = None
    number: Annotated[list[Annotated[ReferenceValue, dataclass_reader(ReferenceValue)]], About("reference values of results")]


def read_entry(folder: Path, package: str) -> Entry:
    """Read the entry of the zoo in a folder; raise `InputError` for a wrong declaration or a missing case file."""
    path = folder / DECLARATION
    text = read_text(path, "the declaration of a mechanism in TOML")
    tree = parse_toml(text, path)
    with in_file(path, text, tree):
        table = instance(_EntryTable, tree, {"folder": folder})
    file = folder / CASE if table.example is None else folder_of_examples() / f"{table.example}.toml"
    if not file.is_file():
        raise InputError(
            f"{path}: the case file '{file}' does not exist",
            f"{CASE} in the folder, or the key `example` with the name of an example",
        )
    return Entry(folder.name, table.title, table.kind, table.about, table.licence, tuple(table.number), file, package)


ENTRY_POINT_GROUP = "scissordyn.zoo"  # Entry points of other packages that add folders with mechanisms

ENTRIES_FOLDER = Path(__file__).parent / "entries"  # Folder with the entries of this package


class Zoo(Mapping[str, Entry]):
    """Named mechanisms with sources and reference values, for example ``sd.zoo["flores slider-crank"]``.

    Spaces, hyphens, underscores and capital letters are equivalent. Another package adds mechanisms by an entry point of the
    group "scissordyn.zoo". The entry point names a folder (a path) that has a folder with ``zoo.toml`` and ``case.toml`` for
    each mechanism.
    """

    @cached_property
    def _folders(self) -> dict[str, tuple[Path, str]]:
        return self._searched[0]

    @property
    def problems(self) -> tuple[str, ...]:
        """Error messages about folders of other packages; the zoo leaves out their mechanisms."""
        return self._searched[1]

    @cached_property
    def _searched(self) -> tuple[dict[str, tuple[Path, str]], tuple[str, ...]]:
        by_name = {folder.name: (folder, "scissordyn") for folder in _entries(ENTRIES_FOLDER)}
        wrong = []
        for point in entry_points(group=ENTRY_POINT_GROUP):
            package = point.dist.name if point.dist is not None else point.name
            try:
                folders = _entries(Path(point.load()))
            except Exception as error:  # an error of another package must not hide the mechanisms of the others
                wrong.append(f"{package}: {type(error).__name__}: {error}")
                continue
            for folder in folders:
                if folder.name in by_name:
                    wrong.append(f"{package}: '{folder.name}' is the name of a mechanism of {by_name[folder.name][1]}")
                else:
                    by_name[folder.name] = (folder, package)
        return dict(sorted(by_name.items())), tuple(wrong)

    def __getitem__(self, name: str) -> Entry:
        names = {_plain(entry): entry for entry in self._folders}
        if _plain(str(name)) not in names:
            near = did_you_mean(str(name), self._folders)
            raise InputError(f"unknown mechanism '{name}' in the zoo{near}", ", ".join(self._folders), "scissordyn zoo")
        folder, package = self._folders[names[_plain(str(name))]]
        return read_entry(folder, package)

    def __contains__(self, name: object) -> bool:
        return isinstance(name, str) and _plain(name) in map(_plain, self._folders)

    def __iter__(self) -> Iterator[str]:
        return iter(self._folders)

    def __len__(self) -> int:
        return len(self._folders)

    def __repr__(self) -> str:
        return f"<zoo of {len(self)} mechanisms: {', '.join(self)}>"


def _plain(name: str) -> str:
    return re.sub(r"[\s_-]+", "-", name.strip()).lower()


def _entries(folder: Path) -> list[Path]:
    entries = sorted(path.parent for path in folder.glob(f"*/{DECLARATION}"))
    if not entries:
        raise InputError(
            f"'{folder}' has no subfolder with a file {DECLARATION}", "a folder with a subfolder for each mechanism"
        )
    return entries


zoo = Zoo()
"""Mechanisms of this package and of other installed packages."""
