"""One file of the package read from elsewhere, for `mutate`: the rest, and all kernels that are kept, stay as they are.

``pytest -p tests.altered`` takes the file `ALTERED` of the environment from `ALTERED_FROM`.
"""

import os
from importlib.machinery import SourceFileLoader
from pathlib import Path
from types import CodeType
from typing import Any

FILE, SOURCE = os.environ["ALTERED"], os.environ["ALTERED_FROM"]

_as_it_is = SourceFileLoader.get_code


def get_code(loader: Any, name: str) -> CodeType | None:
    """The code of a module, without compiled files for the one that is altered."""
    if loader.path != FILE:
        return _as_it_is(loader, name)
    return compile(Path(SOURCE).read_bytes(), FILE, "exec", dont_inherit=True)


SourceFileLoader.get_code = get_code  # type: ignore[method-assign]
