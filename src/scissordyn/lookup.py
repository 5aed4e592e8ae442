"""Find objects by name: public names of the package, keyword arguments, and modules of optional libraries."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from importlib import import_module
from typing import Any

from scissordyn.errors import InputError, did_you_mean


def describe_unexpected(signature: inspect.Signature, named: Mapping[str, Any]) -> str:
    """Return an error text about the first unknown keyword argument, with the most similar one and all known ones; or ""."""
    parameters = signature.parameters
    if any(parameter.kind is parameter.VAR_KEYWORD for parameter in parameters.values()):
        return ""
    unknown = next((key for key in named if key not in parameters), None)
    if unknown is None:
        return ""
    names = [key for key, parameter in parameters.items() if parameter.kind is not parameter.VAR_POSITIONAL and key != "self"]
    return f"got an unexpected keyword argument '{unknown}'{did_you_mean(unknown, names)}; expected {', '.join(names)}"


def library(name: str, extra: str, purpose: str) -> Any:
    """Import a module of an optional library; raise `InputError` with the extra to install if it is missing."""
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
    """Return the object of a public name, imported from its module."""
    if name not in homes:
        hint = "" if name.startswith("_") else did_you_mean(name, homes)  # programs ask for private names, users do not
        raise AttributeError(f"module '{package}' has no attribute '{name}'{hint}")
    return getattr(import_module(f"{package}.{homes[name]}"), name)
