"""What a page saves, as the content of files that the browser downloads; nothing is written on the server's side."""

from __future__ import annotations

import tempfile
import threading
from collections.abc import Callable
from pathlib import Path

import numpy as np

from scissordyn.errors import InputError
from scissordyn.explore.session import Session
from scissordyn.explore.worker import Outcome
from scissordyn.plot.animation import animate
from scissordyn.plot.file import svg
from scissordyn.plot.structure import structure
from scissordyn.run.store import save

__all__ = ["MOST_MADE", "saved", "slots"]

Made = tuple[str, str, bytes]
"""Name, type of content, and content of a file."""


MOST_MADE = 2
"""Files that are made at the same time, by all pages together: each keeps a processor busy."""

slots = threading.BoundedSemaphore(MOST_MADE)
"""One is taken while a file is made."""


def saved(session: Session, shown: Outcome | None, what: str, time: float) -> Made:
    """A file of what a page shows.

    Parameters
    ----------
    session : Session
    shown : Outcome or None
        The run that the page shows.
    what : {"case", "run", "picture", "film"}
    time : float
        The instant of the picture [s].

    Returns
    -------
    (str, str, bytes)
        Name, type and content.

    Raises
    ------
    InputError
        If there is no such thing yet.
    """
    return SAVED[what](session, shown, time)


def _stem(session: Session) -> str:
    return Path(session.opened.name).stem


def _case(session: Session, good: Outcome | None, time: float) -> Made:
    text = session.case.text()
    if text is None:
        raise InputError("a saved run has no case file", "Copy as Python")
    return f"{_stem(session)}.toml", "text/plain", text.encode()


def _run(session: Session, good: Outcome | None, time: float) -> Made:
    if good is None or good.run is None:
        raise InputError("no run yet", "a case that can be run")
    with tempfile.TemporaryDirectory(prefix="scissordyn-explore-") as folder:
        content = save(good.run, Path(folder) / "run.nc").read_bytes()
    return f"{_stem(session)}.nc", "application/x-netcdf", content


def _picture(session: Session, good: Outcome | None, time: float) -> Made:
    if good is None or good.run is None:
        raise InputError("no run yet", "a case that can be run")
    last = float(good.run["time"].values[-1])
    axes = structure(good.run, good.case.mechanism, times=[float(np.clip(time, 0.0, last))])
    figure = axes[0].get_figure(root=True)
    assert figure is not None
    return f"{_stem(session)}.svg", "image/svg+xml", svg(figure).encode()


def _film(session: Session, good: Outcome | None, time: float) -> Made:
    if good is None or good.run is None:
        raise InputError("no run yet", "a case that can be run")
    with tempfile.TemporaryDirectory(prefix="scissordyn-explore-") as folder:
        content = animate(good.run, good.case.mechanism, Path(folder) / "film.html").read_bytes()
    return f"{_stem(session)}.html", "text/html", content


SAVED: dict[str, Callable[[Session, Outcome | None, float], Made]] = {
    "case": _case,
    "run": _run,
    "picture": _picture,
    "film": _film,
}
"""What can be saved."""
