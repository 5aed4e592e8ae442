"""Build the library of compiled kernels: ``python -m scissordyn.build [--c FILE]``."""

from __future__ import annotations

import os

os.environ["SCISSORDYN_ENGINE"] = "python"  # nothing is there yet that could run a kernel

import sys
from collections.abc import Iterable, Iterator
from importlib import import_module
from itertools import combinations
from pathlib import Path
from typing import Any

from scissordyn.compiler.c import compile_library
from scissordyn.compiler.unit import Unit
from scissordyn.component.catalogue import COMPONENTS
from scissordyn.component.compiled import recipes_of
from scissordyn.component.film.film import Film
from scissordyn.control.catalogue import CONTROLLERS
from scissordyn.errors import InputError
from scissordyn.kernel import ENTRIES
from scissordyn.laws.catalogue import DAMPING, ELASTIC, FRICTION
from scissordyn.library import PACKAGE, PATH, digest_of
from scissordyn.plugin.element import recipes

__all__ = ["library_source"]

ROOMS = ("plugin", "laws", "control", "component", "mechanics", "integrate")
LOOPS = "scissordyn.run.loop"
"""Where entries are."""


def _elements() -> Iterator[Any]:
    """Recipes of the kernels of all laws, controllers and components, for each set of states that a part may have."""
    for catalogue in (ELASTIC, DAMPING, FRICTION, CONTROLLERS):
        for element in catalogue.values():
            declared = element.declaration
            names = tuple(state.name for state in declared.states)
            # of a class whose states are a property each part has some of them
            for present in _subsets(names) if isinstance(getattr(element, "states", ()), property) else [names]:
                yield from recipes(declared, present).values()
    for component in (*COMPONENTS.values(), Film):
        yield from recipes_of(component).values()


def _subsets(names: tuple[str, ...]) -> Iterable[tuple[str, ...]]:
    return (part for count in range(len(names) + 1) for part in combinations(names, count))


def library_source() -> str:
    """The library in C."""
    names = [path.relative_to(PACKAGE).with_suffix("").as_posix() for room in ROOMS for path in (PACKAGE / room).rglob("*.py")]
    for module in (*sorted(f"scissordyn.{name.replace('/', '.')}" for name in names), LOOPS):
        import_module(module)
    unit = Unit()
    for entry in ENTRIES.values():
        unit.entry(entry)
    for recipe in _elements():
        unit.kernel(recipe)
    text = unit.text()
    files = sorted(Path(file).relative_to(PACKAGE).as_posix() for file in unit.files)
    marks = f'EXPORT const char SOURCES[] = "{" ".join(files)}";\nEXPORT const char DIGEST[] = "{digest_of(files)}";\n'
    return text + marks


def main(arguments: list[str]) -> int:
    """Write the library into the package, or its source to a file."""
    try:
        source = library_source()
        if arguments[:1] == ["--c"]:
            Path(arguments[1]).write_text(source, encoding="utf-8")
        else:
            compile_library(source, Path(arguments[0]) if arguments else PATH)
    except InputError as error:
        print(error, file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
