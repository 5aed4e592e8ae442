"""Two runs in one picture."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes

from scissordyn.plot.contact import force_curve, torque_sources
from scissordyn.plot.picture import picture
from scissordyn.plot.scale import DEGREES, engineering
from scissordyn.plot.series import finish, largest_forces, time_scale
from scissordyn.plot.style import BLUE, LINE, VERMILION, Canvas, legend, literal, panels
from scissordyn.run.answer.joint_force import clearance_joints

if TYPE_CHECKING:
    import xarray as xr

JOINTS = 3  # Most joints whose forces are compared, those with the largest forces

SECOND: dict[str, Any] = {"color": VERMILION, "linewidth": LINE, "linestyle": (0, (5, 1.5)), "zorder": 3.0}
"""The second run is dashed and on top, so that both are visible where they agree."""

WORKS = ("drive_work", "motor_work", "load_work")


def shared_curves(runs: Sequence[xr.Dataset]) -> Iterator[tuple[str, list[xr.DataArray]]]:
    """Quantities over time that all runs have, with their curves: output, torques, forces, energy, work."""
    if all("slider_position" in run for run in runs):
        yield "displacement", [run["slider_position"] for run in runs]
    torques = [{source.name: source.curve for source in torque_sources(run)} for run in runs]
    for name in _shared([list(curves) for curves in torques]):
        yield name, [curves[name] for curves in torques]
    if not all("slider_position" in run for run in runs):
        for body in _shared([run["body"].values.astype(str).tolist() for run in runs])[-1:]:
            yield f"angle of {body}", [run["angle"].sel(body=body) for run in runs]
    joints = _shared([clearance_joints(run) for run in runs])
    largest = [largest_forces(run) for run in runs]
    peaks = [max(curves[joint] for curves in largest) for joint in joints]
    chosen = {joints[k] for k in np.argsort(-np.array(peaks), kind="stable")[:JOINTS]}
    for joint in joints:
        if joint in chosen:
            yield f"force at {joint}", [force_curve(run, joint) for run in runs]
    for variable, name in (("kinetic_energy", "kinetic energy"), ("dissipated_energy", "dissipated")):
        if all(variable in run and np.any(run[variable].values) for run in runs):
            yield name, [run[variable] for run in runs]
    if all(set(WORKS) <= set(run.variables) and any(np.any(run[name].values) for name in WORKS) for run in runs):
        yield "work", [sum((run[name] for name in WORKS[1:]), run[WORKS[0]]).assign_attrs(units="J") for run in runs]


def _shared(names: Sequence[Sequence[str]]) -> list[str]:
    return [name for name in names[0] if all(name in other for other in names[1:])]


@picture("One for each of `shared_curves`.")
def comparison(
    run: xr.Dataset, other: xr.Dataset, *, labels: tuple[str, str] = ("first run", "second run"), axes: Canvas = None
) -> list[Axes]:
    """Output, torque, contact forces and energies of two runs, each pair of curves in one panel.

    Parameters
    ----------
    run, other : Dataset
    labels : (str, str)
        Names of the runs in the legend.
    """
    curves = list(shared_curves([run, other]))
    drawn = panels(axes, len(curves), size=(8.5, 0.8 + 1.75 * len(curves)))
    longer = max(run, other, key=lambda part: float(part["time"].values[-1]))
    time = time_scale(longer)
    for panel, (name, pair) in zip(drawn, curves, strict=True):
        unit = pair[0].attrs["units"]
        scale = DEGREES if unit == "rad" else engineering(unit, *(curve.values for curve in pair))
        for curve, label, look in zip(pair, labels, ({"color": BLUE, "linewidth": LINE}, SECOND), strict=True):
            panel.plot(time.factor * curve["time"].values, scale.factor * curve.values, label=literal(label), **look)
        panel.set_ylabel(scale.label(literal(name)).replace(" [", "\n["))
    finish(drawn, longer, time)
    legend(drawn, above=axes is None)
    return drawn
