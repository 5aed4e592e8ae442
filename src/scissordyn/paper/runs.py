"""The paper's runs: computed side by side, each once, and kept as files."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Sequence
from functools import cache, partial
from importlib.metadata import version
from pathlib import Path

import xarray as xr

import scissordyn
from scissordyn.errors import InputError, ScissordynError
from scissordyn.paper.cases import PaperCase
from scissordyn.paper.held import with_contact
from scissordyn.simulation.hold import hold_contact
from scissordyn.simulation.run import simulate
from scissordyn.simulation.store import load, save
from scissordyn.study.runner import run_cases

__all__ = ["Progress", "compute", "fetch_runs", "provenance"]

Progress = Callable[[str, int, int], None]
"""What is done, how many of it, out of how many."""

NEIGHBOUR = 1e-12
"""Members of an ensemble differ by this fraction of the clearance: far below any tolerance of manufacture or integration."""

NUMERICAL_SOURCES = (
    *(f"{room}/**/*.py" for room in ("laws", "control", "mechanics", "integrate", "model", "simulation", "analysis")),
    *(f"paper/{name}.py" for name in ("cases", "findings", "held", "measures", "statements")),
)


@cache
def provenance() -> str:
    """Versions, and a digest of the sources that the numbers depend on, as JSON; equal means equal numbers."""
    package = Path(scissordyn.__file__).parent
    digest = hashlib.sha256()
    for pattern in NUMERICAL_SOURCES:
        for path in sorted(package.glob(pattern)):
            digest.update(str(path.relative_to(package)).encode())
            digest.update(path.read_bytes())
    versions = {name: version(name) for name in ("scissordyn", "numpy", "scipy", "numba", "xarray")}
    return json.dumps({**versions, "sources": digest.hexdigest()[:16]})


def compute(case: PaperCase, *, trust: bool = True, member: int = 0) -> xr.Dataset:
    """Simulate a case.

    Parameters
    ----------
    case : PaperCase
    trust : bool
        Whether to run twice and find the trust horizon.
    member : int
        Of an ensemble whose clearances differ by `member` times 1e-12 of themselves; 0 is the case itself.

    Returns
    -------
    Dataset
        With its case file in the attribute "case" and where it comes from in "provenance".

    Raises
    ------
    ScissordynError
        If the run breaks off: a statement about half a run would be about another run.
    """
    described = case.described()
    mechanism = described.mechanism
    if member and case.clearance is not None:
        mechanism = mechanism.replace("A.clearance", case.clearance * (1.0 + member * NEIGHBOUR))
    simulated = hold_contact(mechanism) if case.held else mechanism
    run = simulate(simulated, **{**described.run.keywords, "trust": trust})
    if run.attrs["status"] != "complete":
        raise ScissordynError(f"run '{case.name}' ({case.choice.words}): {run.attrs['cause']}")
    if case.held:
        run = with_contact(run, mechanism)
    return run.assign_attrs(case=case.toml, provenance=provenance())


def fetch_runs(
    cases: Sequence[PaperCase], folder: Path, *, workers: int | None = None, progress: Progress | None = None
) -> dict[PaperCase, xr.Dataset]:
    """Runs from a folder, where those that are missing or out of date are computed first.

    Parameters
    ----------
    cases : sequence of PaperCase
        Of one choice.
    folder : Path
        Holds a NetCDF file for each run, written whole or not at all.
    workers : int, optional
        Processes; one per processor if not given.
    progress : callable, optional

    Returns
    -------
    dict of PaperCase to Dataset
    """
    folder.mkdir(parents=True, exist_ok=True)
    found = {case: run for case in dict.fromkeys(cases) if (run := _stored(case, folder)) is not None}
    missing = [case for case in dict.fromkeys(cases) if case not in found]
    told = None if progress is None else partial(progress, "runs")
    for result in run_cases(partial(_compute_and_save, folder), missing, workers=workers, progress=told):
        if result.error:
            raise ScissordynError(result.error)
        found[missing[result.index]] = load(_path(missing[result.index], folder))
    return {case: found[case] for case in dict.fromkeys(cases)}


def _path(case: PaperCase, folder: Path) -> Path:
    return folder / f"{case.name}.nc"


def _stored(case: PaperCase, folder: Path) -> xr.Dataset | None:
    """The run of that very case file by this very version, if it is there."""
    try:
        run = load(_path(case, folder))
    except InputError:
        return None
    return run if (run.attrs.get("case"), run.attrs.get("provenance")) == (case.toml, provenance()) else None


def _compute_and_save(folder: Path, case: PaperCase) -> str:
    return str(save(compute(case), _path(case, folder)))
