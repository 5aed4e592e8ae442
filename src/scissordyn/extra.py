"""Libraries that are installed with an extra of the package only."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from scissordyn.errors import InputError


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
