"""``scissordyn preview``: the assembled mechanism and its ideal kinematics, before any run."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from scissordyn.cli.option import CaseFile, Changes

if TYPE_CHECKING:
    import xarray as xr

    from scissordyn.model.mechanism import Mechanism

UNMOVED = 1e-6
"""Assembly is said to move nothing if it moves bodies by less than this fraction of the mechanism's size, or angle [rad]."""


def preview(
    case: CaseFile,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="FILE", help="Draw the assembled mechanism: .svg or .png.")
    ] = None,
    curves: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Draw output, transmission angles, torque and reactions with ideal joints."),
    ] = None,
    change: Changes = None,
) -> int:
    """Assemble a case, describe its motion with ideal joints, and draw it with its names."""
    from scissordyn.cli.servo import servo_demands, servo_lines
    from scissordyn.cli.show import console
    from scissordyn.config.file import read_case
    from scissordyn.model.commanded import commanded
    from scissordyn.run.ideal import ideal_kinematics

    for path in (output, curves):
        if path is not None:
            from scissordyn.plot.file import check_format

            check_format(path.suffix.lower().removeprefix("."))
    read = read_case(case, change or [])
    followed = commanded(read.mechanism)
    ideal = ideal_kinematics(followed, until=read.run.until)
    to = console()
    lines = (*_range(followed, ideal), *_forces(ideal), *servo_lines(servo_demands(read.mechanism, followed, ideal)))
    for line in (_assembled(read.mechanism, ideal), *lines):
        to.print(line, markup=False)
    for warning in json.loads(ideal.attrs["singular_warnings"]):
        to.print(f"Warning: {warning}.", markup=False)
    if ideal.attrs["status"] != "complete":
        to.print(f"The run with ideal joints {ideal.attrs['cause']}.", markup=False)
    for path in _drawn(read.mechanism, ideal, output, curves):
        to.print(str(path), markup=False)
    return 0


def _drawn(mechanism: Mechanism, ideal: xr.Dataset, output: Path | None, curves: Path | None) -> list[Path]:
    """Write the pictures that are asked for."""
    if output is None and curves is None:
        return []
    from scissordyn.plot.file import write
    from scissordyn.plot.kinematics import kinematics
    from scissordyn.plot.preview import preview as draw

    wanted = [] if output is None else [(draw(mechanism, start=ideal), output)]
    wanted += [] if curves is None else [(kinematics(ideal)[0], curves)]
    written = []
    for axes, path in wanted:
        figure = axes.get_figure(root=True)
        assert figure is not None
        written.append(write(figure, path))
    return written


def _assembled(mechanism: Mechanism, ideal: xr.Dataset) -> str:
    """How far assembly moved the bodies from where they are placed."""
    far, turned = ("", 0.0), ("", 0.0)
    now = ideal.isel(time=0)
    for body in mechanism.bodies:
        (px, py), (x, y) = body.placed_position, body.centre
        cos, sin = math.cos(body.placed_angle), math.sin(body.placed_angle)
        placed = px + cos * x - sin * y, py + sin * x + cos * y
        moved = math.dist(placed, now["position"].sel(body=body.name).values.tolist())
        turn = abs(math.remainder(float(now["angle"].sel(body=body.name)) - body.placed_angle, 2.0 * math.pi))
        far = max(far, (body.name, moved), key=lambda pair: pair[1])
        turned = max(turned, (body.name, turn), key=lambda pair: pair[1])
    said = []
    if far[1] > UNMOVED * mechanism.size:
        said.append(f"moves the mass centre of body '{far[0]}' by {1e3 * far[1]:.4g} mm")
    if turned[1] > UNMOVED:
        said.append(f"rotates body '{turned[0]}' by {math.degrees(turned[1]):.4g} deg")
    if not said:
        return "The mechanism closes as it is placed."
    return f"Assembly {' and '.join(said)}, more than any other body."


def _range(mechanism: Mechanism, ideal: xr.Dataset) -> list[str]:
    """The stroke of the only drive and where it locks."""
    import numpy as np

    low, high, unit = (ideal.attrs[f"range_{name}"] for name in ("low", "high", "unit"))
    if not unit:
        return [] if mechanism.drives else ["No drive prescribes the motion."]
    factor, sign = (180.0 / math.pi, "deg") if unit == "rad" else (1e3, "mm")
    name = f"Drive of '{mechanism.drives[0].body}'" if unit == "rad" else "Driven rod"
    locks = [f"{factor * place:.6g} {sign}" for place in (low, high) if math.isfinite(place)]
    stroke = ""
    if unit == "rad":
        angle = np.degrees(ideal["angle"].sel(body=mechanism.drives[0].body).values)
        stroke = f" goes from {angle[0]:.6g} to {angle[-1]:.6g} deg and" if angle.size else ""
    nowhere = "locks nowhere within a revolution" if unit == "rad" else "locks at no length"
    return [f"{name}{stroke} {'locks at ' + ' and '.join(locks) if locks else nowhere}."]


def _forces(ideal: xr.Dataset) -> list[str]:
    """Transmission angle, torque and reactions at their worst."""
    import numpy as np

    from scissordyn.kinematics.peak import smooth_peak
    from scissordyn.units import short

    lines, time = [], ideal["time"].values
    angle = np.degrees(ideal["transmission_angle"].values)
    if angle.size:
        i, k = np.unravel_index(int(np.argmin(angle)), angle.shape)
        smallest = round(float(angle[i, k]), 6)  # zero at a change point, whatever round-off says
        joint = ideal["dyad"].values[k]
        lines.append(f"Smallest transmission angle: {smallest:.4g} deg at joint '{joint}', at {short(time[i], 's')}.")
    for name, unit, subject in (("drive_torque", "N m", "driving torque"), ("rod_force", "N", "force in a rod")):
        if name in ideal and ideal[name].size:
            values = np.abs(ideal[name].values.reshape(time.size, -1)).max(axis=1)
            largest, when = smooth_peak(time, values)
            if np.isfinite(largest):
                lines.append(f"Largest {subject} with ideal joints: {short(largest, unit)} at {short(when, 's')}.")
    force = ideal["peak_reaction"].values
    if np.isfinite(force).any():
        most = int(np.nanargmax(force))
        worst, joint = short(float(force[most]), "N"), ideal["joint"].values[most]
        instant = short(float(ideal["peak_reaction_time"].values[most]), "s")
        lines.append(f"Largest reaction with ideal joints: {worst} at '{joint}', at {instant}.")
    return lines
