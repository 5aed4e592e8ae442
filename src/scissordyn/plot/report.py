"""All pictures of a run at once."""

from __future__ import annotations

import os
from pathlib import Path

import xarray as xr
from matplotlib.axes import Axes

from scissordyn.errors import InputError
from scissordyn.model.mechanism import Mechanism
from scissordyn.plot.energy import energy
from scissordyn.plot.file import check_format, write
from scissordyn.plot.force import force
from scissordyn.plot.orbit import orbit
from scissordyn.plot.response import response
from scissordyn.plot.series import clearance_joints, clearance_pins
from scissordyn.plot.structure import structure
from scissordyn.plot.torque import torque

__all__ = ["draw_all"]


def draw_all(
    run: xr.Dataset, ideal: xr.Dataset | None, folder: str | os.PathLike[str], mechanism: Mechanism, format: str = "png"
) -> list[Path]:
    """Every picture that a run has data for: response, force, torque, orbit, energy, structure.

    Force needs a clearance joint or guide, orbit a revolute clearance joint, torque a drive. Nothing is written before all are
    drawn.

    Parameters
    ----------
    run : Dataset
    ideal : Dataset or None
        The run of the ideal mechanism, drawn dashed.
    folder : path
        Target folder; created if missing.
    mechanism : Mechanism
        The one that was run.
    format : {"png", "svg"}

    Returns
    -------
    list of Path

    Raises
    ------
    InputError
        If the format is another one, or the folder cannot be written.
    """
    check_format(format)
    drawn: dict[str, list[Axes]] = {"response": response(run, ideal)}
    has_clearance = bool(clearance_joints(run))
    if has_clearance:
        drawn["force"] = force(run, ideal)
    if "drive_torque" in run:
        drawn["torque"] = torque(run, ideal)
    if clearance_pins(run):
        drawn["orbit"] = orbit(run)
    drawn["energy"] = energy(run)
    drawn["structure"] = structure(run, mechanism)
    target = Path(folder)
    try:
        target.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(
            f"cannot make the folder '{target}': {error.strerror or error}", "a folder that can be written"
        ) from None
    written = []
    for name, axes in drawn.items():
        figure = axes[0].get_figure(root=True)
        assert figure is not None
        written.append(write(figure, target / f"{name}.{format}"))
    return written
