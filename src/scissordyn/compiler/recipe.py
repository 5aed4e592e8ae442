"""Describe the function behind a kernel pointer.

Every element's kernel is called as ``double f(double *q, double *v, double *z, double *x, double *p, double *out)``: inputs,
their rates, states, context, parameters and further results. The time loop is therefore the same for all elements, including
user-defined ones.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Callable
from typing import Any, NamedTuple

# Arguments in C of the function behind a kernel pointer: coordinates, rates, states, context, parameters, further results
SIGNATURE = "double *q, double *v, double *z, double *x, double *p, double *out"

ANSWER = "answer"  # Target of the result that the function returns; all other results are stored in arrays


class Recipe(NamedTuple):
    """Function behind a kernel pointer, and where its arguments and results are in the arrays of `SIGNATURE`."""

    function: Callable[..., Any]
    handed: tuple[str, ...]  # Arguments, such as "q[0]" or "p[3]"
    targets: tuple[str, ...]  # Targets of the results, such as "out[0]" or `ANSWER`

    @property
    def symbol(self) -> str:
        """Name of the function in a library."""
        text = f"{self.function.__module__} {self.function.__qualname__} {self.handed} {self.targets}"
        name = re.sub(r"\W", "_", self.function.__name__)
        return f"element_{name}_{hashlib.sha256(text.encode()).hexdigest()[:12]}"

    def python(self) -> Callable[..., float]:
        """Return the same function of six arrays in Python."""
        answer = ANSWER if ANSWER in self.targets else "0.0"
        body = f"    {', '.join(self.targets)} = kernel({', '.join(self.handed)})\n    return {answer}"
        scope: dict[str, Any] = {"kernel": self.function}
        exec(f"def called(q, v, z, x, p, out):\n{body}\n", scope)
        called: Callable[..., float] = scope["called"]
        return called
