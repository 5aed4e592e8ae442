"""What the function at a kernel pointer is made of.

Whatever its slot, the kernel of an element is reached through
``double f(double *q, double *v, double *z, double *x, double *p, double *out)``: inputs, their rates, states, context,
parameters and further results. The time loop is thus the same for every element, also for those of a user.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Callable
from typing import Any, NamedTuple

SIGNATURE = "double *q, double *v, double *z, double *x, double *p, double *out"

ANSWER = "answer"  # Among the places of a kernel's results: the number that the call itself returns


class Recipe(NamedTuple):
    """A function, what it is handed, such as ``"q[0]"`` or ``"p[3]"``, and where its results go, such as ``"out[0]"``."""

    function: Callable[..., Any]
    handed: tuple[str, ...]
    targets: tuple[str, ...]

    @property
    def symbol(self) -> str:
        """Its name in a library."""
        text = f"{self.function.__module__} {self.function.__qualname__} {self.handed} {self.targets}"
        name = re.sub(r"\W", "_", self.function.__name__)
        return f"element_{name}_{hashlib.sha256(text.encode()).hexdigest()[:12]}"

    def python(self) -> Callable[..., float]:
        """The same as a function of six arrays in Python."""
        answer = ANSWER if ANSWER in self.targets else "0.0"
        body = f"    {', '.join(self.targets)} = kernel({', '.join(self.handed)})\n    return {answer}"
        scope: dict[str, Any] = {"kernel": self.function}
        exec(f"def called(q, v, z, x, p, out):\n{body}\n", scope)
        called: Callable[..., float] = scope["called"]
        return called
