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


def compute(case: PaperCase, *, trust: bool = True) -> xr.Dataset:
    """Simulate a case."""
    mechanism = described(case).mechanism
    simulated = constrain_contact(mechanism) if case.constrained else mechanism
    run = pass_on(simulate(simulated, **{**case.options.keywords, "trust": trust}))
    if run.attrs["status"] != "complete":
        raise ScissordynError(f"run '{case.name}' ({case.choice.words}): {run.attrs['cause']}")
    return with_contact(run, mechanism) if case.constrained else run


@lru_cache(1024)
def described(case: PaperCase) -> Case:
    """What a case describes, of parts that it shares with other cases on its drive."""
    if case.clearance is None:
        return case.described() if case == case.without_contact_laws else described(case.without_contact_laws)
    return case.described_on(described(case.ideal))


def fetch_runs(
    cases: Sequence[PaperCase], folder: Path, *, engine: Engine = None, progress: Progress | None = None
) -> dict[PaperCase, xr.Dataset]:
    """Runs from a folder; those missing or out of date are computed first."""
    return fetch(cases, compute, folder, engine=engine, progress=progress)
