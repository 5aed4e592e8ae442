"""What a page saves, as the content of files that the browser downloads; nothing is written on the server's side."""

from __future__ import annotations

import tempfile
import threading
from pathlib import Path

import numpy as np

from scissordyn.errors import InputError
from scissordyn.explore.figures import curves_as_csv
from scissordyn.explore.session import Session
from scissordyn.explore.worker import Outcome
from scissordyn.plot.animation import animate
from scissordyn.plot.file import svg
from scissordyn.plot.still import structure
from scissordyn.run.answer.summary import summary_of
from scissordyn.run.options import AUTO
from scissordyn.run.store import save

MOST_MADE = 2  # Files that are made at the same time, by all pages together: each keeps a processor busy
slots = threading.BoundedSemaphore(MOST_MADE)  # One is taken while a file is made

KINDS = {
    "case": ("toml", "text/plain"),
    "run": ("nc", "application/x-netcdf"),
    "curves": ("csv", "text/csv"),
    "picture": ("svg", "image/svg+xml"),
    "film": ("html", "text/html"),
}
"""What is saved: the end of its name, and its type."""


def saved(
    session: Session, shown: Outcome | None, what: str, time: float, joint: str, magnify: float
) -> tuple[str, str, bytes]:
    """A file of what a page shows: its name, type and content."""
    end, mime = KINDS[what]
    name = f"{Path(session.opened.name).stem}.{end}"
    if what == "case":
        return name, mime, session.case.text().encode()
    if shown is None or shown.run is None or shown.curves is None:
        raise InputError("no run yet", "a case that can be run")
    run, mechanism = shown.run, shown.case.mechanism
    if what == "curves":
        text = curves_as_csv(shown.curves, summary_of(shown.curves), joint, mechanism.output_body)
        return name, mime, text.encode()
    if what == "picture":
        instant = float(np.clip(time, 0.0, float(run["time"].values[-1])))
        return name, mime, svg(structure(run, mechanism, times=[instant], magnify=magnify)).encode()
    if shown.case.options.samples == AUTO:
        run = shown.curves
    with tempfile.TemporaryDirectory(prefix="scissordyn-explore-") as folder:
        path = Path(folder) / f"run.{end}"
        written = save(run, path) if what == "run" else animate(run, mechanism, path, magnify=magnify)
        return name, mime, written.read_bytes()
