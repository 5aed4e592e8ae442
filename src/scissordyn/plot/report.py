"""Write all pictures of a run as files."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from matplotlib.axes import Axes

from scissordyn.errors import InputError, did_you_mean
from scissordyn.model.mechanism import Mechanism
from scissordyn.plot.contact import torque_sources
from scissordyn.plot.file import check_format, content_of, write_content
from scissordyn.plot.joint import film, force, orbit
from scissordyn.plot.over_time import energy, has_tracks, response, torque, track
from scissordyn.plot.processes import make_all
from scissordyn.plot.series import chosen_joints, clearance_pins
from scissordyn.plot.still import bending, structure
from scissordyn.record.joint_force import clearance_joints
from scissordyn.record.results import Run

KINDS = {
    "response": "",
    "track": "a tracked point and a clearance joint",
    "force": "a clearance joint",
    "torque": "a drive, an actuator or a motor",
    "orbit": "a clearance joint with a journal",
    "film": "a lubricated joint",
    "energy": "",
    "structure": "its mechanism",
    "bending": "bars that bend",
}
"""Names of all pictures of a report in order, each with what a run must contain for it; "" if nothing."""


def check_kinds(only: Sequence[str] | None) -> None:
    """Raise `InputError` for an unknown kind of picture."""
    for kind in only or ():
        if kind not in KINDS:
            raise InputError(f"unknown picture '{kind}'{did_you_mean(kind, KINDS)}", ", ".join(KINDS), "--only force,orbit")


def draw_all(
    run: Run,
    ideal: Run | None,
    folder: str | os.PathLike[str],
    mechanism: Mechanism | None,
    format: str = "png",
    *,
    only: Sequence[str] | None = None,
    joints: Sequence[str] | None = None,
    magnify: float = 1.0,
    bars: str | None = None,
    envelope: bool = False,
) -> list[Path]:
    """Write every picture of `KINDS` for which the run has data. Nothing is written before all pictures are drawn."""
    check_format(format)
    check_kinds(only)
    pins = clearance_pins(run)
    if joints is not None:
        chosen_joints(run, joints)
    turning = None if joints is None else [name for name in joints if name in pins]
    oiled = [name for name in joints or () if name in run["film"].values] if "film" in run.sizes else []
    kinds: dict[str, tuple[bool, Callable[[], list[Axes]]]] = {
        "response": (True, lambda: response(run, ideal)),
        "track": (has_tracks(run), lambda: track(run)),
        "force": (bool(clearance_joints(run)), lambda: force(run, ideal, joint=joints)),
        "torque": (bool(torque_sources(run)), lambda: torque(run, ideal)),
        "orbit": (bool(pins) and turning != [], lambda: orbit(run, joint=turning)),
        "film": ("film" in run.sizes, lambda: film(run, joint=oiled or None)),
        "energy": (True, lambda: energy(run)),
        "structure": (mechanism is not None, lambda: structure(run, mechanism, joint=joints, magnify=magnify, bars=bars)),
        "bending": (mechanism is not None and "beam" in run.sizes, lambda: bending(run, mechanism, envelope=envelope)),
    }
    makers = {kind: make for kind, (has_data, make) in kinds.items() if has_data}
    for kind in only or ():
        if kind not in makers:
            raise InputError(
                f"picture '{kind}': the run lacks the data", f"a run with {KINDS[kind]}", f"--only {','.join(makers)}"
            )
    # as files, so that only one figure is in memory
    chosen = [kind for kind in makers if only is None or kind in only]
    contents = make_all({kind: partial(_content, makers[kind], format) for kind in chosen})
    target = Path(folder)
    try:
        target.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        text = f"cannot make the folder '{target}': {error.strerror or error}"
        raise InputError(text, "a folder that can be written") from None
    return [write_content(content, target / f"{name}.{format}") for name, content in contents.items()]


def _content(make: Callable[[], list[Axes]], format: str) -> bytes:
    return content_of(make(), format)
