"""What is looked up by its name: public names and keywords, with the nearest one for another; libraries of extras."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Mapping
from importlib import import_module
from typing import Any, TypeVar

from scissordyn.errors import InputError, did_you_mean

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


def library(name: str, extra: str, purpose: str) -> Any:
    """A module of a library of an extra."""
    try:
        return import_module(name)
    except ImportError as error:
        missing = error.name or name
        raise InputError(
            f"{purpose} needs the package {missing}, which is not installed",
            f"the extra '{extra}'",
            f"pip install 'scissordyn[{extra}]'",
        ) from None


def public(package: str, name: str, homes: Mapping[str, str]) -> Any:
    """What a package has under a public name, imported from the home of that name: it suggests keywords."""
    if name not in homes:
        raise AttributeError(f"module '{package}' has no attribute '{name}'{did_you_mean(name, homes)}")
    home = import_module(f"{package}.{homes[name]}")
    member = getattr(home, name)
    value = suggesting(member)
    if value is not member:
        setattr(home, name, value)  # where others find it by its name, as pickle does
    return value
