"""The joints of a run that have clearance."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from scissordyn.errors import InputError

if TYPE_CHECKING:
    import xarray as xr


def clearance_joints(run: xr.Dataset) -> list[str]:
    """Names of the joints with clearance, in order."""
    if "clearance" not in run:
        return []
    return [str(name) for name in run["joint"].values[np.isfinite(run["clearance"].values)]]


def some_clearance_joints(run: xr.Dataset) -> list[str]:
    """The same of a run that has to have some."""
    found = clearance_joints(run)
    if not found:
        raise InputError(
            "a run without clearance joints",
            "a run of a mechanism with a clearance",
            'arm.with_clearance("A", Clearance(0.5e-3))',
        )
    return found
