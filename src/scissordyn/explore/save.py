"""What a page saves, as the content of files that the browser downloads; nothing is written on the server's side."""

from __future__ import annotations

import csv
import io
import tempfile
import threading
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from scissordyn.errors import InputError
from scissordyn.explore.columns import UNITS, chosen_point, chosen_torques, columns
from scissordyn.explore.session import Session
from scissordyn.explore.worker import Outcome
from scissordyn.model.mechanism import Mechanism
from scissordyn.plot.animation import animate
from scissordyn.plot.file import svg
from scissordyn.plot.structure import structure
from scissordyn.run.answer.summary import summary_of
from scissordyn.run.options import AUTO
from scissordyn.run.store import save

Made = tuple[str, str, bytes]
"""Name, type of content, and content of a file."""


MOST_MADE = 2
"""Files that are made at the same time, by all pages together: each keeps a processor busy."""

slots = threading.BoundedSemaphore(MOST_MADE)
"""One is taken while a file is made."""


def saved(
    session: Session, shown: Outcome | None, fine: xr.Dataset | None, what: str, time: float, joint: str, magnify: float = 1.0
) -> Made:
    """A file of what a page shows."""
    if what == "case":
        return _case(session)
    if shown is None or shown.run is None:
        raise InputError("no run yet", "a case that can be run")
    if what == "curves":
        drawn = shown.run if fine is None else fine
        return f"{_stem(session)}.csv", "text/csv", curves_as_csv(drawn, shown.case.mechanism.output_body, joint).encode()
    if what == "picture":
        return _picture(session, shown.run, shown.case.mechanism, time, magnify)
    if shown.case.options.samples == AUTO and fine is not None:
        shown = replace(shown, run=fine)
    return _in_folder(session, what, shown, magnify)


def _stem(session: Session) -> str:
    return Path(session.opened.name).stem


def _case(session: Session) -> Made:
    text = session.case.text()
    if text is None:
        raise InputError("a saved run has no case file", "Copy as Python")
    return f"{_stem(session)}.toml", "text/plain", text.encode()


def _picture(session: Session, run: xr.Dataset, mechanism: Mechanism, time: float, magnify: float) -> Made:
    instant = float(np.clip(time, 0.0, float(run["time"].values[-1])))
    axes = structure(run, mechanism, times=[instant], magnify=magnify)
    figure = axes[0].get_figure(root=True)
    assert figure is not None
    return f"{_stem(session)}.svg", "image/svg+xml", svg(figure).encode()


def _in_folder(session: Session, what: str, shown: Outcome, magnify: float) -> Made:
    """What is written as a file and read again."""
    end, mime, write = FILES[what]
    with tempfile.TemporaryDirectory(prefix="scissordyn-explore-") as folder:
        content = write(shown.run, shown.case.mechanism, Path(folder) / f"made.{end}", magnify).read_bytes()
    return f"{_stem(session)}.{end}", mime, content


FILES: dict[str, tuple[str, str, Callable[[Any, Mechanism, Path, float], Path]]] = {
    "run": ("nc", "application/x-netcdf", lambda run, mechanism, path, magnify: save(run, path)),
    "film": ("html", "text/html", lambda run, mechanism, path, magnify: animate(run, mechanism, path, magnify=magnify)),
}
"""What is saved through a file: the end of its name, its type, and what writes it."""


def curves_as_csv(run: xr.Dataset, output: str, joint: str) -> str:
    """The curves of a run as the page draws them, with the instants of located peaks between the samples."""
    torques, _ = chosen_torques(run)
    point = chosen_point(summary_of(run))
    names = [source.name for source in torques]
    time, values = columns(run, joint, output, names, point.name if point else "")
    heads = {"time": "time [s]"} | _heads(names, joint, point.name if point else "", angular="slider_position" not in run)
    shown = {"time": time, **{name: values[name] for _, names in UNITS.values() for name in names if name in values}}
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(heads[name] for name in shown)
    writer.writerows(zip(*([repr(value) for value in column.tolist()] for column in shown.values()), strict=True))
    return text.getvalue()


HEADS = {
    "force": "force at {joint}",
    "metal": "normal force of the metal at {joint}",
    "friction": "friction force at {joint}",
    "slip": "slip speed at {joint}",
    "kinetic": "kinetic energy",
    "potential": "potential energy",
    "stored": "energy of springs",
    "work": "work of drives",
    "motor": "work of motors",
    "load": "work of loads",
    "dissipated": "dissipated energy",
    "track": "deviation of {point}",
}


def _heads(torques: list[str], joint: str, point: str, *, angular: bool) -> dict[str, str]:
    named = {name: head.format(joint=joint, point=point) for name, head in HEADS.items()}
    named |= dict(zip(UNITS["torque"][1], torques, strict=False))
    heads = {name: f"{named.get(name, name)} [{unit}]" for unit, names in UNITS.values() for name in names}
    return heads | {"output": "output angle [rad]" if angular else "slider displacement [m]"}
