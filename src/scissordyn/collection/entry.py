"""A mechanism of the zoo: a folder with a declaration, and with a case file unless that is one of the examples."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Any, Literal, get_args

from scissordyn.bibliography.reference import Reference, references
from scissordyn.collection.number import Found, Number, Origin
from scissordyn.config.case import Case
from scissordyn.config.file import folder_of_examples, in_file, parsed, read_case
from scissordyn.config.table import About, Context, PlacedError, Table, instance, reader
from scissordyn.config.text import read_text
from scissordyn.errors import InputError
from scissordyn.model.mechanism import Mechanism
from scissordyn.run.simulate import simulate

if TYPE_CHECKING:
    import xarray as xr

DECLARATION, CASE = "zoo.toml", "case.toml"  # Files of an entry's folder

Kind = Literal["benchmark", "clearance joints", "linkage", "scissor structure", "deployable", "machine", "toy"]


@dataclass(frozen=True)
class Entry:
    """A named mechanism with its source and the numbers that a right program gives."""

    name: str  # As ``sd.zoo[name]`` and ``scissordyn zoo NAME`` have it
    title: str  # What it is; `about` says where its parameters are from
    kind: str
    about: str
    licence: str  # Of the files, as an SPDX expression; facts and figures of a source are not subject to it
    numbers: tuple[Number, ...]
    case_file: Path
    package: str = "scissordyn"  # That it comes with

    @property
    def text(self) -> str:
        """The case file."""
        return read_text(self.case_file, "a case file in TOML")

    @cached_property
    def case(self) -> Case:
        """Mechanism and options of the simulation."""
        return read_case(self.case_file)

    @property
    def mechanism(self) -> Mechanism:
        """The mechanism."""
        return self.case.mechanism

    @property
    def references(self) -> tuple[Reference, ...]:
        """Who describes it."""
        return references(self.mechanism.source)

    def simulate(self, *, ideal: bool = False) -> xr.Dataset:
        """Run it as its case file says."""
        return simulate(self.mechanism.ideal() if ideal else self.mechanism, **self.case.run.keywords)

    def check(self) -> tuple[Found, ...]:
        """Run it, and compare its numbers with what they should be."""
        runs = {ideal: self.simulate(ideal=ideal) for ideal in {number.ideal for number in self.numbers}}
        for run in runs.values():
            if run.attrs["status"] != "complete":
                raise InputError(f"'{self.name}' {run.attrs['status']}: {run.attrs['cause']}", "a run that is complete")
        return tuple(number.measure(runs[number.ideal]) for number in self.numbers)


@reader(lambda: {"type": "object"})
def _where(given: Any, _: Context) -> Mapping[str, str | int]:
    if not isinstance(given, Mapping) or not all(isinstance(value, str | int) for value in given.values()):
        raise InputError("not a table of names", '{ body = "slider", axis = "x" }')
    return dict(given)


class _NumberTable(Table):
    """A number that a right program gives."""

    what: Annotated[str, About("what it is, in words", examples=["slider after 3 ms"])]
    variable: Annotated[str, About("variable of the run", examples=["position"])]
    where: Annotated[Mapping[str, str | int], _where, About("names along its dimensions")] = MappingProxyType({})
    at: Annotated[str, About('an instant, "start", "end", "largest" or "smallest"', examples=["3 ms"])] = ""
    value: Annotated[str, About("with its unit", examples=["165.2 mm"])]
    tolerance: Annotated[str, About("largest difference, with its unit", examples=["1 um"])]
    origin: Annotated[Origin, About("who says so", examples=get_args(Origin)[:1])]
    reason: Annotated[str, About("formula, publication or program", examples=["r cos a + l cos b"])]
    ideal: Annotated[bool, About("whether of the mechanism with ideal joints")] = True


class _EntryTable(Table):
    """The declaration of an entry."""

    title: Annotated[str, About("what it is", examples=["Slider-crank with a clearance joint"])]
    kind: Annotated[Kind, About("what kind of mechanism", examples=["linkage"])]
    about: Annotated[str, About("where it is from", examples=["Lengths of the original."])]
    licence: Annotated[str, About("of the files", examples=["BSD-3-Clause"])] = "BSD-3-Clause"
    example: Annotated[str | None, About("the example that is its case file", examples=["press"])] = None
    number: Annotated[list[_NumberTable], About("numbers that a right program gives")]


def read_entry(folder: Path, package: str) -> Entry:
    """The entry that a folder describes."""
    path = folder / DECLARATION
    text = read_text(path, "the declaration of a mechanism in TOML")
    tree = parsed(text, path)
    try:
        table = instance(_EntryTable, tree, {"folder": folder})
    except PlacedError as error:
        raise in_file(error, path, text, tree, tree) from None
    file = folder / CASE if table.example is None else folder_of_examples() / f"{table.example}.toml"
    if not file.is_file():
        raise InputError(f"{path}: no case file '{file}'", f"{CASE} in its folder, or the name of an example as `example`")
    numbers = tuple(Number(**{key: getattr(row, key) for key in _NumberTable.declared_keys()}) for row in table.number)
    return Entry(folder.name, table.title, table.kind, table.about, table.licence, numbers, file, package)
