"""The mechanism as a first drawing, as its case declares it: without kernels, and before the libraries of the page."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from scissordyn.plot.canvas import CANVAS, packed_scene

if TYPE_CHECKING:
    from scissordyn.explore.case import Case
    from scissordyn.model.mechanism import Mechanism

SCRIPT = (Path(__file__).parent / "assets" / "early.js").read_text(encoding="utf-8")


def declared(mechanism: Mechanism) -> xr.Dataset:
    """A mechanism with its bodies where they are declared to start; no constraint is solved."""
    bodies = mechanism.bodies
    angle, origin, centre = (
        np.array([getattr(body, name) for body in bodies]) for name in ("placed_angle", "placed_position", "centre")
    )
    cos, sin = np.cos(angle), np.sin(angle)
    across = np.stack([cos * centre[:, 0] - sin * centre[:, 1], sin * centre[:, 0] + cos * centre[:, 1]], axis=1)
    return xr.Dataset(
        {
            "position": (("time", "body", "axis"), np.repeat((origin + across)[None], 2, axis=0)),
            "angle": (("time", "body"), np.repeat(angle[None], 2, axis=0)),
        },
        {"time": np.zeros(2), "body": [body.name for body in bodies]},
    )


def early_script(case: Case) -> str:
    """The script that draws a case in the frame of the page, until the page itself has a run."""
    if case.saved is None:
        ideal = case.mechanism.ideal()
        scene = packed_scene(declared(ideal), ideal, note="as declared; its motion follows")
    else:
        scene = packed_scene(case.saved, case.mechanism, note="saved run")
    return f"{CANVAS.replace('export default { render };', '')}\nconst FIRST = {json.dumps(scene)};\n{SCRIPT}"


def early_motion(case: Case) -> str:
    """The motion of a case with ideal joints as a scene."""
    from scissordyn.errors import ScissordynError
    from scissordyn.explore.worker import brief, ideal_run

    if case.saved is not None:
        return ""
    try:
        run = ideal_run(brief(case))
    except ScissordynError:  # the run of the case says why
        return ""
    return packed_scene(run, case.mechanism.ideal(), note="ideal joints") if run.sizes["time"] > 1 else ""
