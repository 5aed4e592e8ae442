"""Build the library of compiled kernels: ``python -m scissordyn.build [--c FILE] [--target MACHINE] [FOLDER]``."""

from __future__ import annotations

import os

os.environ["SCISSORDYN_ENGINE"] = "python"  # kernels run as Python functions, because the library may not exist

import argparse
import sys
from collections.abc import Iterable, Iterator
from importlib import import_module
from itertools import combinations
from pathlib import Path
from typing import Any

from scissordyn.compiler.c import compile_library
from scissordyn.compiler.unit import Unit
from scissordyn.components.catalogue import COMPONENTS
from scissordyn.components.declaration import recipes_of
from scissordyn.components.film.film import Film
from scissordyn.control.catalogue import CONTROLLERS
from scissordyn.errors import InputError
from scissordyn.kernel import ENTRIES, PACKAGE, digest_of, library_name
from scissordyn.laws.catalogue import DAMPING, ELASTIC, FRICTION
from scissordyn.plugin.element import recipes

KERNEL_SUBPACKAGES = ("plugin", "laws", "control", "components", "mechanics", "integrate", "plan")  # subpackages with kernels
LOOP_MODULE = "scissordyn.run.advance.system"  # module with the entry functions of the time loop


def _elements() -> Iterator[Any]:
    """Yield the recipes of the kernels of all laws, controllers and components, for each set of states that they may have."""
    for catalogue in (ELASTIC, DAMPING, FRICTION, CONTROLLERS):
        for element in catalogue.values():
            declared = element.declaration
            names = tuple(state.name for state in declared.states)
            # if `states` is a property, an instance may have only some of the declared states
            for present in _subsets(names) if isinstance(getattr(element, "states", ()), property) else [names]:
                yield from recipes(declared, present).values()
    for component in (*COMPONENTS.values(), Film):
        yield from recipes_of(component).values()


def _subsets(names: tuple[str, ...]) -> Iterable[tuple[str, ...]]:
    return (part for count in range(len(names) + 1) for part in combinations(names, count))


def library_source() -> str:
    """Return the source of the library in C."""
    names = [
        path.relative_to(PACKAGE).with_suffix("").as_posix()
        for subpackage in KERNEL_SUBPACKAGES
        for path in (PACKAGE / subpackage).rglob("*.py")
    ]
    for module in (*sorted(f"scissordyn.{name.replace('/', '.')}" for name in names), LOOP_MODULE):
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


def main() -> int:
    """Write the library, or its source, into the package, another folder or a file."""
    parser = argparse.ArgumentParser(prog="python -m scissordyn.build", description="Build the library of compiled kernels.")
    parser.add_argument("folder", nargs="?", type=Path, default=PACKAGE, help="target folder; the package itself by default")
    parser.add_argument("--c", type=Path, metavar="FILE", help="write the source in C alone")
    parser.add_argument("--target", default="", metavar="MACHINE", help="another machine, for example aarch64-linux-gnu")
    options = parser.parse_args()
    try:
        if options.c:
            options.c.write_text(library_source(), encoding="utf-8", newline="\n")
        else:
            compile_library(library_source(), options.folder / library_name(options.target), target=options.target)
    except InputError as error:
        print(error, file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
