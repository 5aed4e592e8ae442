"""Every kernel as plain Python, for `mutate`: a changed kernel is tried in seconds instead of the minutes that compiling takes.

``pytest -p tests.plain`` with NUMBA_DISABLE_JIT=1 puts, before anything else of the package is imported, a plain road in the
place of each that leads through machine code: kernels stay functions, an address names what it belongs to, a record
shows its fields. The arithmetic is the same, in the same order.
"""

from __future__ import annotations

import math
import os
import weakref
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

os.environ["NUMBA_DISABLE_JIT"] = "1"

import numpy as np

from scissordyn import jit

HANDLES: weakref.WeakValueDictionary[int, Any] = weakref.WeakValueDictionary()
CALLED: dict[int, Callable[..., None]] = {}


def kernel(*, inline: bool = False) -> Callable[[Any], Any]:
    """The function itself."""
    return lambda function: function


def callback(function: Callable[..., None], signature: Any, *, stored: bool) -> SimpleNamespace:
    """A number by which `call_kernel` finds the function."""
    CALLED[len(CALLED) + 1] = function
    return SimpleNamespace(address=len(CALLED))


def call_kernel(address: int, *arrays: np.ndarray) -> None:
    """Call what `callback` was given."""
    CALLED[int(address)](*arrays)


class Handle(jit.Handle):
    """A handle that can be found by its address."""

    def __init__(self, content: Any) -> None:
        super().__init__(content)
        HANDLES[self.address] = self
        self.shown = None, None

    def open(self) -> Any:
        """The content, its records with attributes as kernels read them."""
        if self.shown[0] is not self.content:
            self.shown = self.content, shown(self.content)
        return self.shown[1]


def shown(content: Any) -> Any:
    """A tuple of arrays with attributes in the place of named columns."""
    if isinstance(content, tuple):
        return type(content)(*(shown(part) for part in content))
    return content.view(np.recarray) if isinstance(content, np.ndarray) and content.dtype.names else content


def opener(described: type) -> Callable[[int], Any]:
    """From an address to the tuple."""
    return lambda address: HANDLES[int(address)].open()


def floor(x: float) -> float:
    """As in kernels, which have no integers without an end."""
    return float(np.floor(x)) if not math.isfinite(x) else _floor(x)


_floor, math.floor = math.floor, floor  # type: ignore[assignment]
np.seterr(all="ignore")  # numbers divide as in kernels
jit.kernel, jit.callback, jit.Handle, jit.opener = kernel, callback, Handle, opener  # type: ignore[misc, assignment]

from scissordyn.component import compiled as component_code
from scissordyn.integrate import integration

component_code.call_kernel = call_kernel  # type: ignore[assignment]
integration.make_problem = lambda functions: integration.Problem(**functions)

from scissordyn.integrate import advance
from scissordyn.run import compiled

compiled.compiled_loop = lambda: advance.advance_all
compiled.loop_is_on_disk = lambda: True
