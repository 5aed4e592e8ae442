"""Progress bars on a terminal."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

DESCRIPTION = "{task.description}"
"""A column."""


@contextmanager
def bar(*columns: str, described: str, total: float | None) -> Iterator[Callable[..., None] | None]:
    """A function that updates a bar on stderr, with the keywords of rich's `Progress.update`; None without a terminal."""
    if not sys.stderr.isatty():
        yield None
        return
    from rich import progress
    from rich.console import Console

    shown = [progress.TextColumn(each, markup=False) if "{" in each else getattr(progress, each)() for each in columns]
    with progress.Progress(*shown, console=Console(stderr=True), transient=True) as drawn:
        task = drawn.add_task(described, total=total)
        yield lambda **changes: drawn.update(task, **changes)


@contextmanager
def progress_bar(until: float) -> Iterator[Callable[[float], None] | None]:
    """A function of the simulated time that updates a bar on stderr; None without a terminal."""
    percent = "{task.percentage:3.0f} % of " + f"{until * 1e3:g} ms"
    with bar(DESCRIPTION, "BarColumn", percent, "TimeRemainingColumn", described="preparing ", total=until) as update:
        yield None if update is None else lambda time: update(completed=time, description="simulating")
