"""Build the library of compiled kernels: ``python -m scissordyn.build [--c FILE] [--target MACHINE] [FOLDER]``.

With ``--derivatives`` it also builds the libraries in dual numbers, which otherwise are compiled at their first use.
"""

from __future__ import annotations

import os

os.environ["SCISSORDYN_ENGINE"] = "python"  # kernels run as Python functions, because the library may not exist

import argparse
import sys
from importlib import import_module
from pathlib import Path

from scissordyn.compiler.c import compile_library
from scissordyn.compiler.unit import Unit
from scissordyn.components.recipes import catalogue_recipes
from scissordyn.errors import InputError
from scissordyn.kernel import ENTRIES, PACKAGE, digest_of, library_name
from scissordyn.sensitivity.library import compile_all

KERNEL_SUBPACKAGES = ("plugin", "laws", "control", "components", "mechanics", "integrate", "plan")  # subpackages with kernels
VECTOR_WIDTH = PACKAGE / "compiler" / "vector_width.c"  # function that asks the processor
LOOP_MODULE = "scissordyn.run.advance.system"  # module with the entry functions of the time loop


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
    for recipe in catalogue_recipes():
        unit.kernel(recipe)
    text = unit.text()
    text += VECTOR_WIDTH.read_text(encoding="utf-8")
    files = sorted(Path(file).relative_to(PACKAGE).as_posix() for file in (*unit.files, str(VECTOR_WIDTH)))
    marks = f'EXPORT const char SOURCES[] = "{" ".join(files)}";\nEXPORT const char DIGEST[] = "{digest_of(files)}";\n'
    return text + marks


def main() -> int:
    """Write the libraries, or the source of the first, into the package, another folder or a file."""
    parser = argparse.ArgumentParser(prog="python -m scissordyn.build", description="Build the library of compiled kernels.")
    parser.add_argument("folder", nargs="?", type=Path, default=PACKAGE, help="target folder; the package itself by default")
    parser.add_argument("--c", type=Path, metavar="FILE", help="write the source in C alone")
    parser.add_argument("--target", default="", metavar="MACHINE", help="another machine, for example aarch64-linux-gnu")
    parser.add_argument("--derivatives", action="store_true", help="also build the libraries in dual numbers")
    options = parser.parse_args()
    try:
        if options.c:
            options.c.write_text(library_source(), encoding="utf-8", newline="\n")
        else:
            compile_library(library_source(), options.folder / library_name(options.target), target=options.target)
            if options.derivatives:
                compile_all(options.folder, options.target)
    except InputError as error:
        print(error, file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
