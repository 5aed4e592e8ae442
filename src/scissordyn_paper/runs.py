"""The paper's runs: one stroke each, computed beside each other and stored as files."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

import xarray as xr

from scissordyn.config.case import Case
from scissordyn.errors import ScissordynError
from scissordyn.run.advance.interrupt import pass_on
from scissordyn.run.constrained_contact import constrain_contact
from scissordyn.run.engine import Engine
from scissordyn.run.simulate import simulate
from scissordyn_paper.cache import Progress, fetch
from scissordyn_paper.cases import PaperCase
from scissordyn_paper.constrained_contact import with_contact

NEIGHBOUR = 1e-12
"""Members of an ensemble differ by this fraction of the clearance: far below tolerances of manufacture and integration."""


def compute(case: PaperCase, *, trust: bool = True, member: int = 0) -> xr.Dataset:
    """Simulate a case."""
    described = _described(case)
    mechanism = described.mechanism
    if member and case.clearance is not None:
        mechanism = mechanism.replace("A.clearance", case.clearance * (1.0 + member * NEIGHBOUR))
    simulated = constrain_contact(mechanism) if case.constrained else mechanism
    run = pass_on(simulate(simulated, **{**described.run.keywords, "trust": trust}))
    if run.attrs["status"] != "complete":
        raise ScissordynError(f"run '{case.name}' ({case.choice.words}): {run.attrs['cause']}")
    return with_contact(run, mechanism) if case.constrained else run


@lru_cache(64)
def _described(case: PaperCase) -> Case:
    """What a case describes, once for all members of an ensemble, of parts that it shares with other cases on its drive."""
    if case.clearance is None:
        return case.described() if case == case.without_contact_laws else _described(case.without_contact_laws)
    return case.described_on(_described(case.ideal))


def fetch_runs(
    cases: Sequence[PaperCase], folder: Path, *, engine: Engine = None, progress: Progress | None = None
) -> dict[PaperCase, xr.Dataset]:
    """Runs from a folder; those missing or out of date are computed first."""
    return fetch(cases, compute, folder, engine=engine, progress=progress)
