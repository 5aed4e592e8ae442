"""Load functions and classes from a user's file (``my_laws.py:soft``), and record the origin of user-defined classes.

From the origin, a saved run or another process can load the class again.
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

DIGEST_ATTRIBUTE = "__digest__"  # Attribute of a loaded module: digest of the source text that was executed

EXAMPLES = {"component": "my_components.py:Rubber", "controller": "my_controllers.py:servo", "measure": "my_measures.py:late"}
"""References to user-defined elements that error texts show, by kind; other kinds are laws."""


def split_reference(kind: str, reference: str, folder: Path | None = None) -> tuple[Path, str]:
    """Split a reference ``"file.py:name"`` into the path of the file and the name of the function or class."""
    file, _, name = reference.rpartition(":")
    if not file.endswith(".py") or not name.isidentifier():
        what, sample = "class" if kind == "component" else "function", EXAMPLES.get(kind, "my_laws.py:soft")
        raise InputError(f"'{reference}' does not name a {kind} in a file", f"a Python file and a {what} in it", f"'{sample}'")
    path = ((folder or Path.cwd()) / Path(file).expanduser()).resolve()
    if not path.is_file():
        raise InputError(f"the file '{path}' of the {kind} '{name}' does not exist", "an existing Python file")
    return path, name


def _digest(source: bytes) -> str:
    return hashlib.sha256(source).hexdigest()[:16]


def file_digest(path: Path) -> str:
    """Return a digest of a file's content."""
    return _digest(path.read_bytes())


def _origin_in_file(described: type) -> tuple[str, str] | None:
    """Find the file that defines a class; return the reference "file.py:name" and the file's digest, or None."""
    module = sys.modules.get(described.__module__)
    file = Path(getattr(module, "__file__", None) or "")
    if "." in described.__module__ or described.__module__ == "__main__" or not described.__qualname__.isidentifier():
        return None
    if file.suffix != ".py" or not file.is_file():
        return None
    return f"{file.resolve()}:{described.__name__}", getattr(module, DIGEST_ATTRIBUTE, "") or file_digest(file)


@cache
def _module(path: Path, source: bytes) -> ModuleType:
    """Execute a file as a module; the same content is executed only once."""
    module = ModuleType(f"{path.stem}_{_digest(source)}")
    module.__file__ = str(path)
    setattr(module, DIGEST_ATTRIBUTE, _digest(source))
    sys.modules[module.__name__] = module  # dataclasses resolve the annotations of a class through sys.modules
    try:
        # executes the text itself, because cached byte code is identified only by time stamp and size
        exec(compile(source, str(path), "exec", dont_inherit=True), module.__dict__)
    except Exception as error:
        del sys.modules[module.__name__]
        where = f", line {error.lineno}" if isinstance(error, SyntaxError) else ""
        raise InputError(f"'{path}' cannot be read as Python: {type(error).__name__}{where}: {error}") from None
    return module


def load_function(kind: str, reference: str, digest: str = "") -> Callable[..., Any]:
    """Execute a user's file and return the function or class that ``"file.py:name"`` names.

    If `digest` is given, raise `InputError` unless the file's digest is equal.
    """
    path, name = split_reference(kind, reference)
    source = path.read_bytes()  # read once, so that the compared text is executed
    if digest and _digest(source) != digest:
        raise InputError(
            f"'{path}' has changed since the {kind} '{name}' was loaded", "the file as it was, or a case that loads it again"
        )
    module = _module(path, source)
    if not callable(getattr(module, name, None)):
        defined = ((key, value) for key, value in vars(module).items() if getattr(value, "__module__", "") == module.__name__)
        functions = [key for key, value in defined if callable(value) and not key.startswith("_")]
        raise InputError(f"unknown {kind} '{name}' in '{path}'{did_you_mean(name, functions)}", ", ".join(functions))
    function: Callable[..., Any] = getattr(module, name)
    return function


_CLASSES: dict[tuple[str, str], type] = {}  # User-defined classes that this process has loaded, by reference and digest


def note_origin(cls: Any, described: type) -> None:
    """Record the file that defines a class, so that other processes can unpickle its instances."""
    cls.origin = origin = _origin_in_file(
        described
    )  # set even if None, so that the class does not inherit the origin of its base
    if origin is not None:
        cls.__reduce__ = lambda part: (_empty, type(part).origin, part.__dict__)
        _CLASSES[origin] = cls


def origin_of(described: type) -> tuple[str, str] | None:
    """Return the reference and digest that `note_origin` recorded for a class; None if it recorded none."""
    origin: tuple[str, str] | None = vars(described).get("origin")
    return origin


def class_in(kind: str, reference: str, folder: Path) -> tuple[Any, str]:
    """Execute a file; return the class that ``"file.py:name"`` names and its reference with an absolute path.

    The class is None if the name refers to something else, such as a function.
    """
    path, name = split_reference(kind, reference, folder)
    loaded = load_function(kind, f"{path}:{name}")
    return loaded if isinstance(loaded, type) else None, f"{path}:{name}"


def _empty(reference: str, digest: str) -> Any:
    """Return an instance of a user-defined class without field values, for unpickling."""
    described: Any = _CLASSES.get((reference, digest)) or load_function("class", reference, digest)
    return described.__new__(described)
