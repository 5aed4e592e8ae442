"""Libraries of kernels in dual numbers, three for the time loop and one for the kernels of elements.

A wheel has them compiled, for each level of vector instructions. Without them, in a checkout, they are compiled at their first
use and stored in the user's cache folder.
"""

from __future__ import annotations

import ctypes
import hashlib
import os
import platform
import sys
import tempfile
import threading
from collections.abc import Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from pathlib import Path

import numpy as np

from scissordyn.compiler.c import FLAGS, compile_library, load_source
from scissordyn.compiler.kind import SourceError
from scissordyn.compiler.recipe import Recipe
from scissordyn.compiler.unit import Unit
from scissordyn.components.recipes import catalogue_recipes
from scissordyn.errors import InputError
from scissordyn.integrate.tableau import Tableau
from scissordyn.kernel import PACKAGE, Entry, digest_of, library, library_name
from scissordyn.mechanics.outputs import fill
from scissordyn.mechanics.system import Model
from scissordyn.plugin.element import RECIPES
from scissordyn.sensitivity.hard_replay import HardWatched, follow_hard
from scissordyn.sensitivity.replay import Watched, end, follow

DERIVATIVES = 8  # Number of derivatives in a dual number, one per parameter; 8 doubles fill the widest vector register

# Functions of the library: repeat the last step, without and with hard contacts, finish a run
FOLLOW, FOLLOW_HARD, END = Entry(follow), Entry(follow_hard), Entry(end)

KERNEL_SUBPACKAGES = ("compiler", "plugin", "laws", "control", "components", "mechanics", "integrate", "sensitivity")
"""Subpackages from which the libraries are compiled; their file names contain a digest of the sources."""

INSTALLED = PACKAGE  # Folder of the compiled libraries in an installed wheel

# Name of the function that advances runs in the package's compiled library
ADVANCE_SYMBOL = "run_advance_system_advance_systems"

KINDS: Mapping[str, tuple[type, ...]] = {
    "loop": (Tableau, Watched, Model),  # The model's tables of lengths have no derivatives
    "loop_with_tables": (Tableau, Watched),
    "hard_loop": (Tableau, Watched, HardWatched),
    "elements": (),
}
"""Libraries, and types of named tuples whose arrays have no derivatives. The loops call kernels of elements by pointers.

One loop for all contacts would be slower: the compiler inlines a function that is called once.
"""

VECTOR_FLAGS = {8: ("-mavx512f", "-mavx512bw", "-mavx512dq", "-mavx512vl"), 4: ("-mavx2", "-mfma")}
"""C compiler flags of x86-64 processors, by the number of doubles in a vector; all other processors need none."""


_LOADING = threading.Lock()  # lock held while a library of derivatives is compiled, so that other threads wait for it


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

    def follow_once(self, watched: int, integration: int, system: int, seed: np.ndarray) -> None:
        """Prepare the repetition of the first step."""
        kind = ctypes.CFUNCTYPE(ctypes.c_int64, *[ctypes.c_int64] * 3, ctypes.c_void_p, ctypes.c_int64)
        kind(self.follow)(watched, integration, system, seed.ctypes.data, len(seed))

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

    With `tables`, the model's tables of lengths have derivatives too. With `hard`, it repeats time steps with hard contacts,
    and the tables always have derivatives.
    """
    wanted = sorted({pointer for pointer in pointers if pointer})
    if any(pointer not in RECIPES for pointer in wanted):
        raise InputError("a user-defined element without source text has no derivatives", "functions in a file")
    kind = "hard_loop" if hard else "loop_with_tables" if tables else "loop"
    with _LOADING:
        compiled, elements = _loaded(kind), _loaded("elements")
    places = {}
    for pointer in wanted:
        recipe = RECIPES[pointer]
        built_in = str(recipe.function.__module__).startswith("scissordyn.")
        places[pointer] = _address(getattr(elements if built_in else _user_defined(recipe), recipe.symbol))
    follow_symbol = (FOLLOW_HARD if hard else FOLLOW).symbol
    return Library(
        compiled, places, KINDS[kind], _address(getattr(library(), ADVANCE_SYMBOL)), _address(getattr(compiled, follow_symbol))
    )


def _address(function: object) -> int:
    return ctypes.cast(function, ctypes.c_void_p).value or 0  # type: ignore[arg-type]


@cache
def _user_defined(recipe: Recipe) -> ctypes.CDLL:
    unit = Unit(derivatives=DERIVATIVES)
    unit.kernel(recipe)
    try:
        return load_source(unit.text(), *_flags(vector_width()))
    except SourceError as error:
        raise InputError(f"a user-defined element has no derivatives: {error.what}", error.expected) from None


@cache
def _loaded(kind: str) -> ctypes.CDLL:
    """Load a library from the package or the cache folder; compile it if sources have changed."""
    width = vector_width()
    name = file_name(kind, width)
    if (INSTALLED / name).is_file():
        return ctypes.CDLL(str(INSTALLED / name))
    kept = cache_folder() / name
    if not kept.is_file():
        compile_library(source_of(kind), kept, (*FLAGS, *_flags(width)))
    return ctypes.CDLL(str(kept))


def compile_all(folder: Path, target: str = "") -> None:
    """Compile the libraries for all processors of this architecture, or of another machine; several at a time."""
    architecture = target.partition("-")[0] or platform.machine()
    widths = tuple(VECTOR_FLAGS) if architecture in ("x86_64", "AMD64") else (2,)
    sources = {kind: source_of(kind) for kind in KINDS}
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        begun = [
            pool.submit(
                compile_library, source, folder / file_name(kind, width, target), (*FLAGS, *_flags(width)), target=target
            )
            for kind, source in sources.items()
            for width in widths
        ]
    for compilation in begun:
        compilation.result()


def source_of(kind: str) -> str:
    """Return the source of a library in C."""
    unit = Unit(derivatives=DERIVATIVES, doubles=KINDS[kind])
    if kind == "elements":
        for recipe in catalogue_recipes():
            unit.kernel(recipe)
        return unit.text()
    for entry in (FOLLOW_HARD if kind == "hard_loop" else FOLLOW, END, fill):
        unit.entry(entry)
    return unit.text() + files("scissordyn.sensitivity").joinpath("lockstep.c").read_text(encoding="utf-8")


def file_name(kind: str, width: int, target: str = "") -> str:
    """Return the name of a library's file; it contains a digest of the package's sources."""
    sources = sorted(
        path.relative_to(PACKAGE).as_posix()
        for subpackage in KERNEL_SUBPACKAGES
        for path in (PACKAGE / subpackage).rglob("*.[pc]*")
        if path.suffix in (".py", ".c")
    )
    mark = "|".join((digest_of(sources), *FLAGS, *_flags(width)))
    return f"_duals_{kind}_{width}_{hashlib.sha256(mark.encode()).hexdigest()[:16]}{Path(library_name(target)).suffix}"


def vector_width() -> int:
    """Return the number of doubles in the widest vectors of this processor."""
    return int(library().vector_width())


def _flags(width: int) -> tuple[str, ...]:
    """Return additional compiler flags."""
    return ("-O3", *VECTOR_FLAGS.get(width, ()))


def cache_folder() -> Path:
    """Return the user's cache folder for compiled libraries; a temporary folder if it cannot be created."""
    base = os.environ.get("LOCALAPPDATA") if sys.platform == "win32" else os.environ.get("XDG_CACHE_HOME")
    folder = Path(base) if base else Path.home() / ".cache"
    try:
        (folder / "scissordyn").mkdir(parents=True, exist_ok=True)
    except OSError:
        return Path(tempfile.mkdtemp(prefix="scissordyn-"))
    return folder / "scissordyn"
