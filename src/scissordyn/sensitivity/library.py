"""Library of kernels in dual numbers, compiled at its first use for this processor and kept in a folder of the user."""

from __future__ import annotations

import ctypes
import hashlib
import os
import platform
import sys
import tempfile
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from pathlib import Path

from scissordyn.compiler.c import FLAGS, compile_library, load_source
from scissordyn.compiler.kind import SourceError
from scissordyn.compiler.recipe import Recipe
from scissordyn.compiler.unit import Unit
from scissordyn.errors import InputError
from scissordyn.integrate.tableau import Tableau
from scissordyn.kernel import PACKAGE, Entry, digest_of, library, library_name
from scissordyn.mechanics.system import Model
from scissordyn.plugin.element import RECIPES
from scissordyn.sensitivity.replay import Watched, end, follow

DERIVATIVES = 8  # Parameters of one pass; 64 bytes, the widest vector of today's processors

FOLLOW, END = Entry(follow), Entry(end)

ROOMS = ("compiler", "plugin", "laws", "control", "components", "mechanics", "integrate", "sensitivity")
"""Rooms whose files determine the library."""

ADVANCE = "run_advance_system_advance_systems"  # Function of the package's library that makes steps in doubles


@dataclass(frozen=True)
class Library:
    """Compiled kernels in dual numbers, and where each element's kernel is."""

    compiled: ctypes.CDLL
    pointers: Mapping[int, int]  # Pointer in this library by the pointer in the package's library
    doubles: tuple[type, ...]  # Named tuples whose floats have no derivatives
    advance: int  # Pointer to the function that makes steps in doubles

    def lockstep(self, run: int, watched: int, integration: int, system: int, seed: int, most: int) -> int:
        """Make at most that many steps of a run, and repeat each of them; return the status (`loop`, or minus `replay`)."""
        function = self.compiled.lockstep
        function.argtypes, function.restype = [ctypes.c_void_p] * 6 + [ctypes.c_int64], ctypes.c_int64
        return int(function(self.advance, run, watched, integration, system, seed, most))

    def end(self, integration: int, system: int) -> None:
        """Write the monitored values at the end."""
        function = getattr(self.compiled, END.symbol)
        function.argtypes, function.restype = [ctypes.c_int64] * 2, None
        function(integration, system)


def library_for(pointers: Iterable[int], *, tables: bool) -> Library:
    """Return the library with the kernels at some pointers; with `tables`, also the tables of lengths have derivatives."""
    wanted = sorted({pointer for pointer in pointers if pointer})
    if any(pointer not in RECIPES for pointer in wanted):
        raise InputError("a user-defined element without source text has no derivatives", "functions in a file")
    recipes = {pointer: RECIPES[pointer] for pointer in wanted}
    doubles: tuple[type, ...] = (Tableau, Watched) if tables else (Tableau, Watched, Model)
    ours = {recipe for recipe in recipes.values() if str(recipe.function.__module__).startswith("scissordyn.")}
    compiled = _loaded(tuple(sorted(ours, key=lambda recipe: recipe.symbol)), doubles)
    places = {
        pointer: _address(getattr(compiled if recipe in ours else _user_defined(recipe), recipe.symbol))
        for pointer, recipe in recipes.items()
    }
    return Library(compiled, places, doubles, _address(getattr(library(), ADVANCE)))


def _address(function: object) -> int:
    return ctypes.cast(function, ctypes.c_void_p).value or 0  # type: ignore[arg-type]


@cache
def _user_defined(recipe: Recipe) -> ctypes.CDLL:
    unit = Unit(derivatives=DERIVATIVES)
    unit.kernel(recipe)
    try:
        return load_source(unit.text(), *_flags())
    except SourceError as error:
        raise InputError(f"a user-defined element has no derivatives: {error.what}", error.expected) from None


@cache
def _loaded(recipes: tuple[Recipe, ...], doubles: tuple[type, ...]) -> ctypes.CDLL:
    """Return the library, which is compiled unless the folder has one of the same sources for the same processor."""
    files_of_rooms = sorted(
        path for room in ROOMS for path in (PACKAGE / room).rglob("*.[pc]*") if path.suffix in (".py", ".c")
    )
    digest = digest_of([path.relative_to(PACKAGE).as_posix() for path in files_of_rooms])
    marks = (digest, *(recipe.symbol for recipe in recipes), *(kind.__name__ for kind in doubles), *_flags(), _processor())
    name = f"duals-{hashlib.sha256('|'.join(marks).encode()).hexdigest()[:24]}{Path(library_name()).suffix}"
    kept = cache_folder() / name
    if not kept.is_file():
        compile_library(_source(recipes, doubles), kept, (*FLAGS, *_flags()))
    return ctypes.CDLL(str(kept))


def _source(recipes: tuple[Recipe, ...], doubles: tuple[type, ...]) -> str:
    unit = Unit(derivatives=DERIVATIVES, doubles=doubles)
    for entry in (FOLLOW, END):
        unit.entry(entry)
    for recipe in recipes:
        unit.kernel(recipe)
    return unit.text() + files("scissordyn.sensitivity").joinpath("lockstep.c").read_text(encoding="utf-8")


def _flags() -> tuple[str, ...]:
    """Return additional flags of the compiler: the library stays on this machine, so it may use all instructions."""
    return ("-O3", *(("-march=native",) if platform.machine() in ("x86_64", "AMD64") else ()))


def _processor() -> str:
    """Return what tells processors with other instructions apart."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor()
    return next((line for line in lines if line.startswith("flags")), "")


def cache_folder() -> Path:
    """Return the folder of the user in which compiled libraries are kept, or a temporary one."""
    base = os.environ.get("LOCALAPPDATA") if sys.platform == "win32" else os.environ.get("XDG_CACHE_HOME")
    folder = Path(base) if base else Path.home() / ".cache"
    try:
        (folder / "scissordyn").mkdir(parents=True, exist_ok=True)
    except OSError:
        return Path(tempfile.mkdtemp(prefix="scissordyn-"))
    return folder / "scissordyn"
