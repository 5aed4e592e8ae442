"""Data from which the report is written."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import xarray as xr

from scissordyn.units import degrees
from scissordyn_paper.cases import Choice, PaperCase
from scissordyn_paper.controlled import ControlledRun

BEST_OF = 20_000  # Number of parameter sets of which `BEST` has the most agreeing checks
BEST = Choice(
    driven_bar="slider",
    angle=degrees(45),
    restitution=0.77274488825351,
    bearing_length=0.02,
    damping="zhiying-qishao",
    journal_radius=0.005099560673313823,
    gravity=0.0,
    slip="contact-points",
    static=1.2,
    stribeck_speed=0.0014073220498191914,
    bristle_stiffness=28369.97972677553,
    bristle_damping=121.2315653426493,
    damping_speed=1e6,
    tolerance=1e-6,
    method="dopri5",
    step=2e-5,
)
"""Parameter set with the most agreeing checks on average over neighbours; its answers depend on all digits."""


@dataclass(frozen=True)
class Results:
    """Runs and bifurcation diagram of the report."""

    runs: Mapping[PaperCase, xr.Dataset]  # Single strokes of the paper, and strokes that start in contact
    settled: Mapping[PaperCase, xr.Dataset]  # Motions under the periodic drive, from `periodic.examine`
    controlled: Mapping[ControlledRun, xr.Dataset]  # Runs of the manoeuvres with and without control
    diagram: xr.Dataset  # Bifurcation diagram over the clearance, under the periodic drive
