"""Mechanisms with hard and compliant contacts, against compliant contact alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import xarray as xr

import scissordyn as sd
from scissordyn.config.file import read_case
from validation.case import Case, Check
from validation.hard_limit.case import sum_by_joint

__all__ = ["CASE"]

TOLERANCE = 1e-7
KIND = "second formulation"


def runs(name: str) -> tuple[xr.Dataset, xr.Dataset]:
    """Return runs of a zoo case with compliant contact, and with hard contact at every other clearance (guides first)."""
    case = read_case(sd.zoo[name].case_file, [])
    options = {**case.run.keywords, "samples": 2001}
    mixed = case.mechanism
    loose = [part for part in (*mixed.guides, *mixed.joints) if part.clearance is not None]
    for part in loose[::2]:
        assert part.clearance is not None
        mixed = mixed.with_clearance(part.name, replace(part.clearance, contact="hard"))
    found = (
        sd.simulate(case.mechanism, **{**options, "rtol": TOLERANCE, "atol": TOLERANCE}),
        sd.simulate(mixed, **options),
    )
    for run in found:
        if run.attrs["status"] != "complete":
            raise RuntimeError(run.attrs["cause"])
    return found


def impulses(label: str, soft: xr.Dataset, mixed: xr.Dataset) -> list[Check]:
    """Check the normal impulse of each joint or contact point, including contact forces that last."""
    reference, found = sum_by_joint(soft, "impulse"), sum_by_joint(mixed, "impulse")
    return [Check(f"{label}, {joint}: normal impulse [N s]", of, found[joint], 0.02, KIND) for joint, of in reference.items()]


def checks() -> list[Check]:
    """Check mixed contact against compliant contact alone."""
    soft, mixed = runs("solar-array")
    far = [1e3 * float(run["peak_track_deviation"][0]) for run in (soft, mixed)]
    apart = 1e3 * float(np.max(np.linalg.norm(soft["track_position"].values - mixed["track_position"].values, axis=-1)))
    made = [
        Check("array: largest deviation of the tip [mm]", *far, 0.01, KIND),
        Check("array: largest distance of both paths [mm]", 0.0, apart, 0.1 * far[0], KIND, relative=False),
        Check("array: friction [J]", *(float(run["friction_loss"][-1]) for run in (soft, mixed)), 0.01, KIND),
        *impulses("array", soft, mixed),
    ]
    soft, mixed = runs("clearance-guide")
    return [
        *made,
        Check("guide: work of the drive [J]", *(float(run["drive_work"][-1]) for run in (soft, mixed)), 0.02, KIND),
        Check("guide: friction [J]", *(float(run["friction_loss"][-1]) for run in (soft, mixed)), 0.02, KIND),
        Check(
            "guide: largest force of the pin [N]", *(float(np.nanmax(run["peak_force"])) for run in (soft, mixed)), 0.02, KIND
        ),
        *impulses("guide", soft, mixed),
    ]


CASE = Case("mixed_contact", "Contacts of both kinds", checks, quick=False)
