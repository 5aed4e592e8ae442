"""The words that pictures have in common: what means the same in all of them stands here once."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable
from typing import TypeVar

COMMON = {
    "run": "run : Dataset",
    "ideal": "ideal : Dataset, optional\n    The run of the ideal mechanism, drawn dashed.",
    "mechanism": "mechanism : Mechanism, optional\n    The one that was run; the one that the run holds if not given.",
    "joint": "joint : str or sequence of str, optional\n    One joint or several; those with the largest forces if not given.",
    "start": "start, end : float, optional\n    Part of the run to draw [s]; the whole run if not given.",
    "axes": "axes : Axes or iterable of Axes, optional\n    {} A new figure if not given.",
}
"""Parameters by name, for pictures that do not describe them themselves."""

SECTION = re.compile(r"\n\n(Parameters|Returns|Raises)\n-+\n")
ENTRY = re.compile(r"(?m)^(?=\w)")

Draw = TypeVar("Draw", bound=Callable[..., object])


def picture(axes: str = "One.") -> Callable[[Draw], Draw]:
    """Complete the docstring of a picture by the parameters that all share, what `axes` are, and what is returned."""

    def completed(draw: Draw) -> Draw:
        summary, *parts = SECTION.split(inspect.cleandoc(draw.__doc__ or ""))
        sections = {"Parameters": "", "Returns": "list of Axes", **dict(zip(parts[::2], parts[1::2], strict=True))}
        special = {entry.split(" ")[0].strip(","): entry.strip() for entry in ENTRY.split(sections["Parameters"]) if entry}
        described = COMMON | {"axes": COMMON["axes"].format(axes)} | special
        names = [name for name in inspect.signature(draw).parameters if name in described]
        sections["Parameters"] = "\n".join(described[name] for name in names)
        written = [f"{title}\n{'-' * len(title)}\n{text}" for title, text in sections.items()]
        draw.__doc__ = "\n\n".join([summary, *written])
        return draw

    return completed
