"""All pictures of a run at once."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from matplotlib.axes import Axes

from scissordyn.errors import InputError, did_you_mean
from scissordyn.model.mechanism import Mechanism
from scissordyn.plot.bending import bending
from scissordyn.plot.energy import energy
from scissordyn.plot.file import check_format, write
from scissordyn.plot.film import film
from scissordyn.plot.force import force
from scissordyn.plot.orbit import orbit
from scissordyn.plot.response import response
from scissordyn.plot.series import chosen_joints, clearance_pins
from scissordyn.plot.source import torque_sources
from scissordyn.plot.structure import structure
from scissordyn.plot.torque import torque
from scissordyn.plot.track import has_tracks, track
from scissordyn.run.answer.joint_force import clearance_joints

if TYPE_CHECKING:
    import xarray as xr

KINDS = ("response", "track", "force", "torque", "orbit", "film", "energy", "structure", "bending")
"""All pictures, in order."""

NEEDS = {
    "track": "a tracked point and a clearance joint",
    "force": "a clearance joint",
    "orbit": "a clearance joint with a journal",
    "torque": "a drive, an actuator or a motor",
    "film": "a lubricated joint",
    "bending": "bars that bend",
}
"""What a run must have for a picture."""


def check_kinds(only: Sequence[str] | None) -> None:
    """Raise `InputError` for a kind of picture that there is not."""
    for kind in only or ():
        if kind not in KINDS:
            raise InputError(f"picture '{kind}'{did_you_mean(kind, KINDS)}", ", ".join(KINDS), "--only force,orbit")


def draw_all(
    run: xr.Dataset,
    ideal: xr.Dataset | None,
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
    """Every picture that a run has data for: response, track, force, torque, orbit, energy, structure.

    Track needs a tracked point, force a clearance joint or guide, orbit a revolute clearance joint, torque a drive, an actuator
    or a motor, structure a mechanism. Nothing is written before all are drawn.
    """
    check_format(format)
    check_kinds(only)
    makers = _makers(run, ideal, mechanism, joints, magnify, bars, envelope)
    for kind in only or ():
        if kind not in makers:
            raise InputError(
                f"picture '{kind}' of this run", f"a run with {NEEDS.get(kind, 'its mechanism')}", f"--only {','.join(makers)}"
            )
    drawn = {kind: make() for kind, make in makers.items() if only is None or kind in only}
    target = Path(folder)
    try:
        target.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(
            f"cannot make the folder '{target}': {error.strerror or error}", "a folder that can be written"
        ) from None
    return [write(axes, target / f"{name}.{format}") for name, axes in drawn.items()]


def _makers(
    run: xr.Dataset,
    ideal: xr.Dataset | None,
    mechanism: Mechanism | None,
    joints: Sequence[str] | None,
    magnify: float,
    bars: str | None,
    envelope: bool,
) -> dict[str, Callable[[], list[Axes]]]:
    """What draws each picture that the run has data for."""
    has_clearance, pins = bool(clearance_joints(run)), clearance_pins(run)
    if joints is not None:
        chosen_joints(run, joints)
    turning = None if joints is None else [name for name in joints if name in pins]
    makers: dict[str, Callable[[], list[Axes]]] = {"response": lambda: response(run, ideal)}
    if has_tracks(run):
        makers["track"] = lambda: track(run)
    if has_clearance:
        makers["force"] = lambda: force(run, ideal, joint=joints)
    if torque_sources(run):
        makers["torque"] = lambda: torque(run, ideal)
    if pins and turning != []:
        makers["orbit"] = lambda: orbit(run, joint=turning)
    if "film" in run.dims:
        makers["film"] = lambda: film(run, joint=[name for name in joints or () if name in run["film"]] or None)
    makers["energy"] = lambda: energy(run)
    if mechanism is not None:
        makers["structure"] = lambda: structure(run, mechanism, joint=joints, magnify=magnify, bars=bars)
        if "beam" in run.dims:
            makers["bending"] = lambda: bending(run, mechanism, envelope=envelope)
    return makers
