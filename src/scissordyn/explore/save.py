"""What a page saves, as the content of files that the browser downloads; nothing is written on the server's side."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from scissordyn.errors import InputError
from scissordyn.explore.session import Session
from scissordyn.plot.animation import animate
from scissordyn.plot.file import svg
from scissordyn.plot.structure import structure
from scissordyn.simulation.store import save

__all__ = ["saved"]

Made = tuple[str, str, bytes]
"""Name, type of content, and content of a file."""


def saved(session: Session, what: str, time: float) -> Made:
    """A file of what a page shows.

    Parameters
    ----------
    session : Session
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
    return SAVED[what](session, time)


def _stem(session: Session) -> str:
    return Path(session.opened.name).stem


def _case(session: Session, time: float) -> Made:
    text = session.case.text()
    if text is None:
        raise InputError("a saved run has no case file", "Copy as Python")
    return f"{_stem(session)}.toml", "text/plain", text.encode()


def _run(session: Session, time: float) -> Made:
    good = session.good
    if good is None or good.run is None:
        raise InputError("no run yet", "a case that can be run")
    with tempfile.TemporaryDirectory(prefix="scissordyn-explore-") as folder:
        content = save(good.run, Path(folder) / "run.nc").read_bytes()
    return f"{_stem(session)}.nc", "application/x-netcdf", content


def _picture(session: Session, time: float) -> Made:
    good = session.good
    if good is None or good.run is None:
        raise InputError("no run yet", "a case that can be run")
    last = float(good.run["time"].values[-1])
    axes = structure(good.run, good.case.mechanism, times=[float(np.clip(time, 0.0, last))])
    figure = axes[0].get_figure(root=True)
    assert figure is not None
    return f"{_stem(session)}.svg", "image/svg+xml", svg(figure).encode()


def _film(session: Session, time: float) -> Made:
    good = session.good
    if good is None or good.run is None:
        raise InputError("no run yet", "a case that can be run")
    with tempfile.TemporaryDirectory(prefix="scissordyn-explore-") as folder:
        content = animate(good.run, good.case.mechanism, Path(folder) / "film.html").read_bytes()
    return f"{_stem(session)}.html", "text/html", content


SAVED: dict[str, Callable[[Session, float], Made]] = {"case": _case, "run": _run, "picture": _picture, "film": _film}
"""What can be saved."""
