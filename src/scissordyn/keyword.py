"""Keywords that a function or a class does not know: the error names the nearest one that it knows."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Mapping
from typing import Any, TypeVar

from scissordyn.errors import did_you_mean

MARK = "_suggests_keywords"

Called = TypeVar("Called")


def unexpected(signature: inspect.Signature, named: Mapping[str, Any]) -> str:
    """What is wrong with the first keyword that a signature has not, with the nearest one; "" if it has all."""
    parameters = signature.parameters
    if any(parameter.kind is parameter.VAR_KEYWORD for parameter in parameters.values()):
        return ""
    unknown = next((key for key in named if key not in parameters), None)
    if unknown is None:
        return ""
    names = [key for key, parameter in parameters.items() if parameter.kind is not parameter.VAR_POSITIONAL and key != "self"]
    near = did_you_mean(unknown, names)
    return f"got an unexpected keyword argument '{unknown}'{near or '; allowed: ' + ', '.join(names)}"


def knows_keywords(function: Called) -> Called:
    """A function that names the nearest keyword itself."""
    setattr(function, MARK, True)
    return function


def suggesting(called: Any) -> Any:
    """A public function, or a class, whose error about an unknown keyword names the nearest one."""
    if isinstance(called, type):
        initial = called.__dict__.get("__init__")
        if inspect.isfunction(initial) and not issubclass(called, BaseException) and not hasattr(initial, MARK):
            setattr(called, "__init__", _wrapped(initial, called.__name__))  # noqa: B010 - a type has no such attribute for mypy
        return called
    return _wrapped(called, called.__name__) if inspect.isfunction(called) and not hasattr(called, MARK) else called


def _wrapped(function: Any, name: str) -> Any:
    @functools.wraps(function)
    def suggested(*given: Any, **named: Any) -> Any:
        try:
            return function(*given, **named)
        except TypeError:
            text = unexpected(inspect.signature(function), named) if named else ""
            if not text:
                raise
            raise TypeError(f"{name}() {text}") from None

    return knows_keywords(suggested)
