"""Libraries of the formats of other programs, which are not installed with the package."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from scissordyn.errors import InputError

__all__ = ["library"]


def library(name: str, format_: str) -> Any:
    """A library that reads or writes a format.

    Parameters
    ----------
    name : str
        Of the package.
    format_ : str
        Named in the error.

    Returns
    -------
    module

    Raises
    ------
    InputError
        If it is not installed.
    """
    try:
        return import_module(name)
    except ImportError:
        raise InputError(
            f"{format_} needs the package {name}, which is not installed", "", "pip install 'scissordyn[exchange]'"
        ) from None
