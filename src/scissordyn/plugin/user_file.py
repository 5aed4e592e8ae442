"""Functions and classes in a file that the user names (``my_laws.py:soft``), and where a class of the user's is from.

So it can be had again: from its file, in a saved run, in another process.
"""

from __future__ import annotations

import hashlib
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

from scissordyn.errors import InputError, did_you_mean

DIGEST = "__digest__"  # What a module is asked for: the digest of the text that was executed

SAMPLES = {"component": "my_components.py:Rubber", "controller": "my_controllers.py:servo", "measure": "my_measures.py:late"}
"""What the reference of anything but a law looks like, by its kind."""


def split_reference(kind: str, reference: str, folder: Path | None = None) -> tuple[Path, str]:
    """The file and the function or class that ``"file.py:name"`` names."""
    file, _, name = reference.rpartition(":")
    if not file.endswith(".py") or not name.isidentifier():
        what, sample = "class" if kind == "component" else "function", SAMPLES.get(kind, "my_laws.py:soft")
        raise InputError(f"'{reference}' as a {kind} in a file", f"a Python file and a {what} in it", f"'{sample}'")
    path = ((folder or Path.cwd()) / Path(file).expanduser()).resolve()
    if not path.is_file():
        raise InputError(f"no file '{path}' for the {kind} '{name}'", "a Python file that exists")
    return path, name


def _digest(source: bytes) -> str:
    return hashlib.sha256(source).hexdigest()[:16]


def file_digest(path: Path) -> str:
    """A digest of a file's bytes."""
    return _digest(path.read_bytes())


def made_in(described: type) -> tuple[str, str] | None:
    """Where a class of the user's can be had again: file and name, and the digest of the file."""
    module = sys.modules.get(described.__module__)
    file = Path(getattr(module, "__file__", None) or "")
    if "." in described.__module__ or described.__module__ == "__main__" or not described.__qualname__.isidentifier():
        return None
    if file.suffix != ".py" or not file.is_file():
        return None
    return f"{file.resolve()}:{described.__name__}", getattr(module, DIGEST, "") or file_digest(file)


@cache
def _module(path: Path, source: bytes) -> ModuleType:
    """The file, executed once for each of its contents."""
    module = ModuleType(f"{path.stem}_{_digest(source)}")
    module.__file__ = str(path)
    setattr(module, DIGEST, _digest(source))
    sys.modules[module.__name__] = module  # where dataclasses look up what the annotations of a class mean
    try:
        # from the text itself: byte code kept beside a file is told apart by its time stamp and size only
        exec(compile(source, str(path), "exec", dont_inherit=True), module.__dict__)
    except Exception as error:
        del sys.modules[module.__name__]
        where = f", line {error.lineno}" if isinstance(error, SyntaxError) else ""
        raise InputError(f"'{path}' cannot be read as Python: {type(error).__name__}{where}: {error}") from None
    return module


def load_function(kind: str, reference: str, digest: str = "") -> Callable[..., Any]:
    """The function or class that ``"file.py:name"`` names."""
    path, name = split_reference(kind, reference)
    source = path.read_bytes()  # once: what is executed is what was compared
    if digest and _digest(source) != digest:
        raise InputError(f"'{path}' has changed since the {kind} '{name}' was described", "the same file, or a new description")
    module = _module(path, source)
    if not callable(getattr(module, name, None)):
        functions = [key for key, value in vars(module).items() if callable(value) and not key.startswith("_")]
        raise InputError(f"no {kind} '{name}' in '{path}'{did_you_mean(name, functions)}", ", ".join(functions))
    function: Callable[..., Any] = getattr(module, name)
    return function


_KNOWN: dict[tuple[str, str], type] = {}  # The classes that this process has made, by file and digest


def note_origin(made: Any, described: type) -> None:
    """Keep where a class is from, if it is in a file, also for pickles of its instances, which other processes get."""
    made.origin = origin = made_in(described)  # also None, lest that of a base is inherited
    if origin is not None:
        made.__reduce__ = _reduced
        _KNOWN[origin] = made


def origin_of(described: type) -> tuple[str, str] | None:
    """File and name, and the digest of the file; None for a class of the package, or of no file."""
    origin: tuple[str, str] | None = vars(described).get("origin")
    return origin


def class_in(kind: str, reference: str, folder: Path) -> tuple[Any, str]:
    """What ``"file.py:name"`` names, if it is a class, or None, and its absolute name; the file is executed."""
    path, name = split_reference(kind, reference, folder)
    loaded = load_function(kind, f"{path}:{name}")
    return loaded if isinstance(loaded, type) else None, f"{path}:{name}"


def _reduced(part: Any) -> Any:
    return _empty, type(part).origin, part.__dict__


def _empty(reference: str, digest: str) -> Any:
    """An instance whose fields the pickle puts in."""
    described: Any = _KNOWN.get((reference, digest)) or load_function("class", reference, digest)
    return described.__new__(described)
