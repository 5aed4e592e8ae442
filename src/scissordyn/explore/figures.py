"""The figures of the page, as plain data that curves.js draws: curves of a run over time, and the orbit of a journal."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from scissordyn.explore.columns import UNITS, chosen_point, chosen_torques, orbit, requirements, scaled
from scissordyn.plot.scale import engineering
from scissordyn.plot.series import predictability_horizon
from scissordyn.run.answer.joints import clearance_joints
from scissordyn.units import short

if TYPE_CHECKING:
    import xarray as xr

    from scissordyn.plot.source import TorqueSource
    from scissordyn.run.answer.summary import PointAnswer, Summary

NOW, PINNED = "blue", ("vermilion", "green", "purple")
"""Colours of the run that is shown and of pinned ones, the newest first, by their names in page.css."""

LABELS = {
    "metal": "metal alone",
    "stored": "springs",
    "work": "drives",
    "motor": "motors",
    "load": "loads",
}
"""Of lines whose column has another name."""

COLORS = ("blue", "orange", "green", "purple", "vermilion", "sky")
"""Of the lines of one figure, in order; those of energies stand for the same quantity in every picture."""

ENERGIES = ("blue", "green", "purple", "vermilion", "orange", "sky")

Figure = dict[str, Any]


def figures(run: xr.Dataset, summary: Summary, pins: Sequence[xr.Dataset], joint: str, output: str) -> dict[str, Any]:
    """What is drawn of a run beside its scene.

    Parameters
    ----------
    run : Dataset
    summary : Summary
        Of the run.
    pins : sequence of Dataset
        The newest last.
    joint : str
        Of force, slip and orbit; "" for a run without clearance joints.
    output : str
        The output body.

    Returns
    -------
    dict
        "figures" over time, "orbit" (None without one), "factor" from seconds to the time axis, "until" and "horizon" on it.
    """
    torques, more = chosen_torques(run)
    point = chosen_point(summary)
    of = (joint, output, [source.name for source in torques], point.name if point else "")
    scales, data = scaled(run, *of, None, torques)
    before = [scaled(pin, *of, scales)[1] for pin in reversed(pins)]
    time, horizon = scales["time"], predictability_horizon(run)
    levels = requirements(
        torques, point, {name: data[name] / scales["torque"].factor for name in UNITS["torque"][1] if name in data}
    )
    titles = _titles(run, joint, output, point)
    drawn = []
    for name, (_, names) in UNITS.items():
        lines = [column for column in names if column in data]
        if not lines:
            continue
        labels = [_label(torque) for torque in torques] if name == "torque" else [LABELS.get(line, line) for line in lines]
        colors = ENERGIES if name == "energy" else COLORS
        pinned = [(PINNED[k], pin) for k, pin in enumerate(before) if names[0] in pin]
        drawn.append(
            {
                "name": name,
                "title": f"{titles[name]}; {more} more are smaller" if name == "torque" and more else titles[name],
                "unit": scales[name].unit or "1",
                "axis": f"time [{time.unit}]",
                "lines": [
                    *(_line("", color, pin["time"], pin[names[0]], "dash") for color, pin in pinned),
                    *(
                        _line(
                            label if len(lines) > 1 or name == "torque" else "",
                            colors[names.index(line)],
                            data["time"],
                            data[line],
                        )
                        for label, line in zip(labels, lines, strict=True)
                    ),
                ],
                "levels": [scales[name].factor * level for level in levels.get(name, [])],
            }
        )
    return {
        "figures": drawn,
        "orbit": _orbit(run, pins, joint),
        "factor": time.factor,
        "until": time.factor * float(run["time"].values[-1]),
        "horizon": None if horizon is None else time.factor * horizon,
    }


def _line(label: str, color: str, x: np.ndarray, y: np.ndarray, style: str = "solid") -> dict[str, Any]:
    return {"label": label, "color": color, "x": x, "y": y, "style": style}


def _label(source: TorqueSource) -> str:
    return source.name if source.limit is None else f"{source.name}, limit {short(source.limit, 'N m')}"


def _titles(run: xr.Dataset, joint: str, output: str, point: PointAnswer | None) -> dict[str, str]:
    of_joint = f" at {joint}" if joint else ""
    bodies = run["body"].values.astype(str).tolist()
    body = output if output in bodies else bodies[-1]
    allowed = "" if point is None or point.tolerance is None else f"; allowed {short(point.tolerance, 'm')}"
    return {
        "output": "displacement of the slider" if "slider_position" in run else f"angle of {body}",
        "torque": "torque",
        "force": f"contact force{of_joint}",
        "slip": f"slip speed{of_joint}",
        "energy": "energy",
        "loss": "dissipated energy",
        "film": f"film thickness{of_joint}",
        "stress": "largest stress of the bars",
        "track": "" if point is None else f"deviation of {point.name}{allowed}",
    }


def _orbit(run: xr.Dataset, pins: Sequence[xr.Dataset], joint: str) -> Figure | None:
    plane = bool(run["plane_contact"].sel(joint=joint)) if joint and "plane_contact" in run else False
    if not joint or plane:
        return None
    clearance = float(run["clearance"].sel(joint=joint))
    scale = engineering("m", clearance)
    around = np.linspace(0.0, 2.0 * math.pi, 181)
    size = scale.factor * clearance
    now = orbit(run, joint, scale.factor)
    before = [orbit(pin, joint, scale.factor) for pin in reversed(pins) if joint in clearance_joints(pin)]
    largest = max(float(np.abs(path[axis]).max(initial=0.0)) for path in (now, *before) for axis in "xy")
    return {
        "name": "orbit",
        "title": f"journal orbit at {joint}",
        "unit": scale.unit,
        "axis": f"x [{scale.unit}]",
        "lines": [
            _line("", "faint", size * np.cos(around), size * np.sin(around), "dots"),
            *(_line("", PINNED[k], path["x"], path["y"], "dash") for k, path in enumerate(before)),
            _line("", "sky", now["x"], now["y"]),
        ],
        "levels": [],
        "reach": _rounded(1.1 * max(size, largest)),
    }


def _rounded(reach: float) -> float:
    """A length rounded up to two digits, so that an axis stays when a curve changes little."""
    if reach <= 0.0:
        return 1.0
    digit = 10.0 ** (math.floor(math.log10(reach)) - 1)
    return math.ceil(reach / digit) * digit
