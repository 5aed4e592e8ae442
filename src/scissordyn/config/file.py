"""Read a case file."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

from scissordyn.config.address import addressed, sorted_changes
from scissordyn.config.case import Case, CaseTable
from scissordyn.config.change import changed
from scissordyn.config.table import instance, located
from scissordyn.config.text import read_text
from scissordyn.errors import InputError

__all__ = ["read_case"]


def read_case(path: Path, changes: Iterable[str] = ()) -> Case:
    """The case that a TOML file describes.

    Parameters
    ----------
    path : Path
    changes : iterable of str, optional
        Values to change first, see `changed`.

    Returns
    -------
    Case

    Raises
    ------
    InputError
        For the first error, with its place in the file.
    """
    tree = _parsed(path)
    with located(str(path)):
        of_file, of_parts = sorted_changes(tree, changes, CaseTable.model_fields.keys())
        case = instance(CaseTable, changed(tree, of_file), {"folder": path.parent}).case()
        return replace(case, mechanism=addressed(case.mechanism, of_parts)) if of_parts else case


def _parsed(path: Path) -> dict[str, Any]:
    text = read_text(path, "a case file in TOML", "scissordyn new scissor > case.toml")
    try:
        return tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise InputError(f"'{path}' is not valid TOML: {error}", "a case file", "scissordyn new scissor > case.toml") from None
