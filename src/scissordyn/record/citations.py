"""Publications that a run has used: sources of its mechanism, laws, controllers and methods."""

from __future__ import annotations

import dataclasses
import inspect
import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from scissordyn.bibliography.reference import Reference, bibliography, references
from scissordyn.casefile.configuration import read_configuration
from scissordyn.components.film.film import Film
from scissordyn.laws.material import Material
from scissordyn.laws.oil import Oil
from scissordyn.model.clearance import Lubrication
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.options import TIME_STEPPING
from scissordyn.model.walk import declared, is_described
from scissordyn.plugin.element import Part

if TYPE_CHECKING:
    import xarray as xr

METHODS = {
    "dop853": "hairer1993",
    "dopri5": "hairer1993",
    "rodas5p": "steinebach2023",
    "rodas4p": "hairer1996",
    TIME_STEPPING: "jean1999",
}
"""Key of the publication about each integration method, by the method's name in the statistics of a run."""

FORMULATION, EQUILIBRIUM = "jalon1994", "kelley1998"  # Publications on the coordinates and on the search for an equilibrium


@dataclass(frozen=True)
class Citation:
    """Publication, and the parts of a run that it describes."""

    reference: Reference
    uses: tuple[str, ...]  # Described parts of the run, such as "friction law lugre"


@dataclass(frozen=True)
class Citations:
    """Publications on the mechanism, laws, components and methods of a run."""

    entries: tuple[Citation, ...]  # Publications of the package, mechanism, laws and controllers, components, and methods
    without: tuple[str, ...] = ()  # Parts without a publication as source, such as user-defined functions

    def __iter__(self) -> Iterator[Citation]:
        return iter(self.entries)

    def __len__(self) -> int:
        return len(self.entries)

    @property
    def bibtex(self) -> str:
        """BibTeX text of all publications; a comment before each names the parts of the run that it describes."""
        return "\n\n".join(f"% {'; '.join(entry.uses)}\n{entry.reference.bibtex}" for entry in self.entries) + "\n"

    def __str__(self) -> str:
        lines = [f"{', '.join(entry.uses)}:\n    {entry.reference.text}" for entry in self.entries]
        lines += [f"Without a publication: {', '.join(self.without)}."] if self.without else []
        return "\n".join(lines)


def citations(run: xr.Dataset) -> Citations:
    """Return the publications on a run, from the configuration and statistics in its attributes."""
    configuration = read_configuration(run)
    version = json.loads(run.attrs.get("versions", "{}")).get("scissordyn", "")
    package = dataclasses.replace(bibliography()["scissordyn"], version=str(version))  # with the version that computed the run
    uses_of: dict[Reference, list[str]] = {package: ["scissordyn"]}
    without: list[str] = []
    for use, source in _sources((configuration.mechanism, configuration.absent)):
        named = references(source)
        for reference in named:
            uses_of.setdefault(reference, []).append(use)
        if not named and source == "the user":
            without.append(use)
    start = configuration.options.start if configuration.options is not None else ""
    for key, use in _methods(run, start):
        uses_of.setdefault(bibliography()[key], []).append(use)
    entries = tuple(Citation(reference, tuple(dict.fromkeys(uses))) for reference, uses in uses_of.items())
    return Citations(entries, tuple(dict.fromkeys(without)))


def _sources(value: Any) -> Iterator[tuple[str, str]]:
    """Yield each part of a mechanism with the publication in its docstring."""
    if hasattr(value, "place") and hasattr(value, "file"):
        yield f"{value.place} {value.name} of {value.file or 'Python'}", "the user"
    elif is_described(value):
        yield from _source(value)
        for name in declared(type(value)):
            yield from _sources(getattr(value, name))
    elif isinstance(value, Mapping | tuple):
        for inner in value.values() if isinstance(value, Mapping) else value:
            yield from _sources(inner)


def _source(described: Any) -> Iterator[tuple[str, str]]:
    kind = type(described)
    if kind is Mechanism:
        yield "mechanism", described.source
    elif issubclass(kind, Part):
        yield f"{kind.slot.title} {kind.name}", kind.source
    elif issubclass(kind, Material | Oil):
        yield f"{kind.__name__.lower()} {described.name}", described.source
    elif kind is Lubrication:
        yield "film of oil", _of_docstring(Film)
    elif hasattr(kind, "declaration"):
        yield kind.declaration.section.replace("_", " "), _of_docstring(kind)


def _of_docstring(kind: type) -> str:
    """Return the section "References" of a class docstring."""
    section = re.search(r"^References\n-+\n(.+?)(?:\n\n|\Z)", inspect.getdoc(kind) or "", re.MULTILINE | re.DOTALL)
    return "; ".join(section[1].splitlines()) if section else ""


def _methods(run: xr.Dataset, start: str) -> Iterator[tuple[str, str]]:
    yield FORMULATION, "natural coordinates"
    method = json.loads(run.attrs.get("statistics", "{}")).get("method", "")
    if method in METHODS:
        yield METHODS[method], f"method {method}"
    if start == "static":
        yield EQUILIBRIUM, "static equilibrium"
