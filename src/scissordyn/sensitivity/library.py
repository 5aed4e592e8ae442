"""Libraries of kernels in dual numbers, compiled for this processor at their first use and stored in the user's cache folder.

The time loop takes some seconds to compile; it is the same for all mechanisms. Kernels of elements take a tenth of a second.
"""

from __future__ import annotations

import ctypes
import hashlib
import os
import platform
import sys
import tempfile
import threading
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from pathlib import Path

import numpy as np

from scissordyn.compiler.c import FLAGS, compile_library, load_source
from scissordyn.compiler.kind import SourceError
from scissordyn.compiler.recipe import Recipe
from scissordyn.compiler.unit import Unit
from scissordyn.errors import InputError
from scissordyn.integrate.tableau import Tableau
from scissordyn.kernel import PACKAGE, Entry, digest_of, library, library_name
from scissordyn.mechanics.outputs import fill
from scissordyn.mechanics.system import Model
from scissordyn.plugin.element import RECIPES
from scissordyn.sensitivity.hard_replay import HardWatched, follow_hard
from scissordyn.sensitivity.replay import Watched, end, follow

DERIVATIVES = 8  # Number of derivatives of a dual number, one per parameter; 8 doubles fill the widest vector register

# Functions of the library: repeat the last step, without and with hard contacts, finish a run
FOLLOW, FOLLOW_HARD, END = Entry(follow), Entry(follow_hard), Entry(end)

KERNEL_SUBPACKAGES = ("compiler", "plugin", "laws", "control", "components", "mechanics", "integrate", "sensitivity")
"""Subpackages from which the library is compiled; its file name contains a digest of their sources."""

ADVANCE_SYMBOL = "run_advance_system_advance_systems"  # Name, in the package's library, of the function that makes steps


_LOADING = threading.Lock()  # held while a library is compiled, so that other threads wait for it


@dataclass(frozen=True)
class Library:
    """Compiled time loop in dual numbers, and the pointer to each element's kernel."""

    compiled: ctypes.CDLL
    pointers: Mapping[int, int]  # Pointer to a kernel in dual numbers by the pointer in the package's library
    doubles: tuple[type, ...]  # Types of named tuples whose arrays have no derivatives
    advance: int  # Pointer to the function that makes steps in doubles
    follow: int  # Pointer to the function that repeats them

    def lockstep(self, run: int, watched: int, integration: int, system: int, seed: int, most: int) -> int:
        """Make at most `most` steps of a run in doubles and repeat each in dual numbers.

        Return a status of `integrate.loop`, or minus a status of `replay.follow` if a step cannot be repeated.
        """
        function = self.compiled.lockstep
        function.argtypes, function.restype = [ctypes.c_void_p] * 7 + [ctypes.c_int64], ctypes.c_int64
        return int(function(self.advance, self.follow, run, watched, integration, system, seed, most))

    def fill(self, samples: int, system: int, maps: int, record: int, counted: np.ndarray) -> None:
        """Evaluate everything at the samples (`mechanics.outputs.fill`)."""
        function = getattr(self.compiled, fill.symbol)
        function.argtypes, function.restype = [ctypes.c_int64] * 4 + [ctypes.c_void_p, ctypes.c_int64], None
        function(samples, system, maps, record, counted.ctypes.data, len(counted))

    def end(self, integration: int, system: int) -> None:
        """Write the monitored values and their derivatives at the end of the run."""
        function = getattr(self.compiled, END.symbol)
        function.argtypes, function.restype = [ctypes.c_int64] * 2, None
        function(integration, system)


def library_for(pointers: Iterable[int], *, tables: bool, hard: bool) -> Library:
    """Return the library with dual-number versions of the kernels at `pointers`.

    With `tables`, the model's tables of lengths have derivatives too, with `hard` it repeats time steps with hard contacts.
    """
    wanted = sorted({pointer for pointer in pointers if pointer})
    if any(pointer not in RECIPES for pointer in wanted):
        raise InputError("a user-defined element without source text has no derivatives", "functions in a file")
    recipes = {pointer: RECIPES[pointer] for pointer in wanted}
    doubles: tuple[type, ...] = (Tableau, Watched, *([HardWatched] if hard else []), *([] if tables else [Model]))
    ours = {recipe for recipe in recipes.values() if str(recipe.function.__module__).startswith("scissordyn.")}
    with _LOADING:
        compiled, elements = _time_loop(doubles), _elements(tuple(sorted(ours, key=lambda recipe: recipe.symbol)))
    places = {
        pointer: _address(getattr(elements if recipe in ours else _user_defined(recipe), recipe.symbol))
        for pointer, recipe in recipes.items()
    }
    follow_symbol = (FOLLOW_HARD if hard else FOLLOW).symbol
    return Library(
        compiled, places, doubles, _address(getattr(library(), ADVANCE_SYMBOL)), _address(getattr(compiled, follow_symbol))
    )


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
def _time_loop(doubles: tuple[type, ...]) -> ctypes.CDLL:
    """Load the library that repeats steps; it calls kernels of elements by their pointers."""

    def source() -> str:
        unit = Unit(derivatives=DERIVATIVES, doubles=doubles)
        for entry in (FOLLOW_HARD if HardWatched in doubles else FOLLOW, END, fill):
            unit.entry(entry)
        return unit.text() + files("scissordyn.sensitivity").joinpath("lockstep.c").read_text(encoding="utf-8")

    return _loaded([kind.__name__ for kind in doubles], source)


@cache
def _elements(recipes: tuple[Recipe, ...]) -> ctypes.CDLL:
    """Load the library of the kernels of elements."""

    def source() -> str:
        unit = Unit(derivatives=DERIVATIVES)
        for recipe in recipes:
            unit.kernel(recipe)
        return unit.text()

    return _loaded([recipe.symbol for recipe in recipes], source)


def _loaded(marks: Iterable[str], source: Callable[[], str]) -> ctypes.CDLL:
    """Load a library from the cache folder; compile it if the package's sources or the processor have changed."""
    sources = sorted(
        path
        for subpackage in KERNEL_SUBPACKAGES
        for path in (PACKAGE / subpackage).rglob("*.[pc]*")
        if path.suffix in (".py", ".c")
    )
    digest = digest_of([path.relative_to(PACKAGE).as_posix() for path in sources])
    mark = "|".join((digest, *marks, *_flags(), _processor()))
    kept = cache_folder() / f"duals-{hashlib.sha256(mark.encode()).hexdigest()[:24]}{Path(library_name()).suffix}"
    if not kept.is_file():
        compile_library(source(), kept, (*FLAGS, *_flags()))
    return ctypes.CDLL(str(kept))


def _flags() -> tuple[str, ...]:
    """Return additional compiler flags: the library is used on this machine only, so it may use all its instructions."""
    return ("-O3", *(("-march=native",) if platform.machine() in ("x86_64", "AMD64") else ()))


def _processor() -> str:
    """Return a text that differs between processors with different instruction sets."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor()
    return next((line for line in lines if line.startswith("flags")), "")


def cache_folder() -> Path:
    """Return the user's cache folder for compiled libraries; a temporary folder if it cannot be created."""
    base = os.environ.get("LOCALAPPDATA") if sys.platform == "win32" else os.environ.get("XDG_CACHE_HOME")
    folder = Path(base) if base else Path.home() / ".cache"
    try:
        (folder / "scissordyn").mkdir(parents=True, exist_ok=True)
    except OSError:
        return Path(tempfile.mkdtemp(prefix="scissordyn-"))
    return folder / "scissordyn"
