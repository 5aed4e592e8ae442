"""Replace one file of the package by another file, for `mutate`; all other files and stored kernels are unchanged.

``pytest -p tests.altered`` takes the file `ALTERED` of the environment from `ALTERED_FROM`.
"""

import os
from importlib.machinery import SourceFileLoader
from pathlib import Path
from types import CodeType
from typing import Any

# File to replace at its import, and the file that is compiled instead
FILE, SOURCE = os.environ["ALTERED"], os.environ["ALTERED_FROM"]

_as_it_is = SourceFileLoader.get_code


def get_code(loader: Any, name: str) -> CodeType | None:
    """Return the code of a module; compile the replaced module from its other file, and not from a stored compiled file."""
    if loader.path != FILE:
        return _as_it_is(loader, name)
    return compile(Path(SOURCE).read_bytes(), FILE, "exec", dont_inherit=True)


SourceFileLoader.get_code = get_code  # type: ignore[method-assign]
