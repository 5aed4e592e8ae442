"""The table of the contacts of a run, as columns for the browser; a click on a row moves the animation there."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from scissordyn.numeral import decimals
from scissordyn.plot.scale import Scale, engineering
from scissordyn.run.answer.summary import kinds_left_out

if TYPE_CHECKING:
    import xarray as xr

COLUMNS = (
    ("contact_start", "start", "s"),
    ("approach_speed", "approach", "m/s"),
    ("impulse", "impulse", "N s"),
    ("peak_force", "peak force", "N"),
    ("contact_duration", "duration", "s"),
    ("rebound_speed", "rebound", "m/s"),
)

LONG = 10.0
"""Shorter times are in milliseconds [s]."""

SLOW = 0.2
"""Columns of smaller speeds are in mm/s [m/s]."""


def contact_table(run: xr.Dataset) -> dict[str, Any]:
    """The contacts of a run, in units that suit its numbers."""
    columns = []
    left_out = kinds_left_out(run)
    for name, title, unit in COLUMNS:
        if name in left_out:
            continue
        values = run[name].values
        finite = np.abs(values[np.isfinite(values)])
        scale = engineering(unit, finite) if unit in ("s", "N") else Scale(1.0, unit)
        if scale.unit == "s" and finite.max(initial=0.0) < LONG:  # contacts last for less than a digit of seconds
            scale = Scale(1e3, "ms")
        if scale.unit == "m/s" and finite.max(initial=1.0) < SLOW:
            scale = Scale(1e3, "mm/s")
        shown = scale.factor * values
        columns.append({"title": f"{title} [{scale.unit}]", "values": shown, "places": decimals(shown.tolist())})
    return {
        "joints": run["contact_joint"].values.astype(str).tolist(),
        "seconds": run["contact_start"].values.copy(),
        "columns": columns,
    }
