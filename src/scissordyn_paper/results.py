"""The data of the report."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import xarray as xr

from scissordyn_paper.cases import PaperCase
from scissordyn_paper.controlled import ControlledRun


@dataclass(frozen=True)
class Results:
    """All runs."""

    runs: Mapping[PaperCase, xr.Dataset]  # The paper's single strokes, and those that start in contact
    settled: Mapping[PaperCase, xr.Dataset]  # Under the periodic drive, as of `periodic.examine`
    controlled: Mapping[ControlledRun, xr.Dataset]
    diagram: xr.Dataset  # Over the clearance, under the periodic drive
