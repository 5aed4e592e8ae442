"""Accessor ``run.scissordyn`` of xarray: mechanism, summary, citations and export of a run."""

from __future__ import annotations

import os
from pathlib import Path

import xarray as xr

from scissordyn.casefile.configuration import read_configuration
from scissordyn.file.export import export
from scissordyn.model.mechanism import Mechanism
from scissordyn.record.citations import Citations, citations
from scissordyn.record.summary import Summary, summary_of


@xr.register_dataset_accessor("scissordyn")  # type: ignore[no-untyped-call]
class RunAccessor:
    """Mechanism, summary, citations and exports of a run, from what it has recorded.

    Parameters
    ----------
    run : Dataset
    """

    def __init__(self, run: xr.Dataset) -> None:
        self._run = run

    @property
    def mechanism(self) -> Mechanism:
        """Mechanism of the run; raises `InputError` if it uses functions in a user's file."""
        return read_configuration(self._run).build_mechanism()

    def summary(self) -> Summary:
        """Return the summary: tracked points, actuators, largest force, span, work and predictability horizon."""
        return summary_of(self._run)

    def citations(self) -> Citations:
        """Return the publications of the run's mechanism, laws, components and methods; ``.bibtex`` is their BibTeX text."""
        return citations(self._run)

    def export(self, path: str | os.PathLike[str]) -> Path:
        """Write the run as a table (.csv or .parquet) or with all its arrays (.mat)."""
        return export(self._run, path)
