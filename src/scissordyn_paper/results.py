"""The data of the report."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import xarray as xr

from scissordyn_paper.cases import PaperCase
from scissordyn_paper.controlled import ControlledRun

__all__ = ["Results"]


@dataclass(frozen=True)
class Results:
    """All runs.

    Parameters
    ----------
    runs : mapping of PaperCase to Dataset
        The paper's single strokes, and those that start in contact.
    settled : mapping of PaperCase to Dataset
        Under the periodic drive, as of `periodic.examine`.
    controlled : mapping of ControlledRun to Dataset
    diagram : Dataset
        Over the clearance, under the periodic drive.
    """

    runs: Mapping[PaperCase, xr.Dataset]
    settled: Mapping[PaperCase, xr.Dataset]
    controlled: Mapping[ControlledRun, xr.Dataset]
    diagram: xr.Dataset
