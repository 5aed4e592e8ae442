"""One case of a study as a run of its own."""

from __future__ import annotations

import xarray as xr

from scissordyn.model.address import changed_all
from scissordyn.run.simulate import simulate
from scissordyn.study.description import Study
from scissordyn.study.store import column

__all__ = ["replay_case"]


def replay_case(study: Study, results: xr.Dataset, case: int) -> tuple[xr.Dataset, int]:
    """Simulate a case again, with histories.

    Parameters
    ----------
    study : Study
    results : Dataset
        From `Store.results`.
    case : int

    Returns
    -------
    run : Dataset
        As from `simulate`. Its measures are those of member 0, bit for bit.
    member : int
        The case's member; the start of another one than 0 is perturbed in the study.
    """
    changes = {address: float(results[column(address)][case]) for address in study.addresses}
    run = simulate(changed_all(study.mechanism, changes), **{**study.options.keywords, "trust": False})
    return run, int(results["member"][case])
