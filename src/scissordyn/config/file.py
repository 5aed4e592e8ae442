"""Read a case file."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from scissordyn.config.case import Case, CaseTable
from scissordyn.config.change import changed
from scissordyn.config.table import instance, located
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
        return instance(CaseTable, changed(tree, changes), {"folder": path.parent}).case()


def _parsed(path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(
            f"cannot read '{path}': {error.strerror}", "a case file", "scissordyn new scissor > case.toml"
        ) from None
    except UnicodeDecodeError:
        raise InputError(f"'{path}' is not a text file", "a case file in TOML, UTF-8") from None
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"'{path}' is not valid TOML: {error}", "a case file", "scissordyn new scissor > case.toml") from None
