"""A progress bar of the simulated time, on a terminal."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

__all__ = ["progress_bar"]


@contextmanager
def progress_bar(until: float) -> Iterator[Callable[[float], None] | None]:
    """A function of the simulated time that updates a bar on stderr; None without a terminal.

    Parameters
    ----------
    until : float
        End of the simulated time [s].
    """
    if not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        TextColumn("{task.percentage:3.0f} % of " + f"{until * 1e3:g} ms"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("preparing ", total=until)
        yield lambda time: bar.update(task, completed=time, description="simulating")
