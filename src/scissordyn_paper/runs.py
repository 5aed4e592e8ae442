"""Compute the paper's runs, one stroke each, in parallel, and store them as files."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

import numpy as np
import xarray as xr

from scissordyn.casefile.case import Case
from scissordyn.errors import ScissordynError
from scissordyn.model.mechanism import Mechanism
from scissordyn.record.placement import Placement
from scissordyn.run.advance.interrupt import raise_if_interrupted
from scissordyn.run.engine import Engine
from scissordyn.run.inverse_dynamics import constrain_contact
from scissordyn.run.simulate import simulate
from scissordyn_paper.cache import Progress, fetch
from scissordyn_paper.cases import PaperCase
from scissordyn_paper.measures import JOINT


def compute(case: PaperCase, *, trust: bool = True) -> xr.Dataset:
    """Simulate a case and return its run; raise `ScissordynError` if the run fails."""
    mechanism = build_cached(case).mechanism
    simulated = constrain_contact(mechanism) if case.constrained else mechanism
    run = raise_if_interrupted(simulate(simulated, **{**case.options.keywords, "trust": trust}))
    if run.attrs["status"] != "complete":
        raise ScissordynError(f"run '{case.name}' ({case.choice.words}): {run.attrs['cause']}")
    return _with_contact(run, mechanism) if case.constrained else run


@lru_cache(1024)
def build_cached(case: PaperCase) -> Case:
    """Return mechanism and options of a case, which shares objects with other cases of the same drive to save time."""
    if case.clearance is None:
        return case.build() if case == case.without_contact_laws else build_cached(case.without_contact_laws)
    return case.build_from(build_cached(case.ideal))


def fetch_runs(
    cases: Sequence[PaperCase], folder: Path, *, engine: Engine = None, progress: Progress | None = None
) -> dict[PaperCase, xr.Dataset]:
    """Return the runs of cases from the files in a folder; compute missing and outdated runs first."""
    return fetch(cases, compute, folder, engine=engine, progress=progress)


def _with_contact(run: xr.Dataset, mechanism: Mechanism) -> xr.Dataset:
    """Add eccentricity and contact force of a constrained contact to its run, in the variables of a clearance joint."""
    joint = mechanism.joint(JOINT)
    assert joint.clearance is not None
    force = run["rod_force"].isel(rod=0).values
    highest = int(np.argmax(force))
    names = [*run["joint"].values.astype(str).tolist(), JOINT]
    whole = run.drop_dims("contact").reindex(joint=names)

    def here(values: np.ndarray, units: str, long_name: str) -> tuple[tuple[str, ...], np.ndarray, dict[str, str]]:
        full = np.full((values.shape[0], len(names), *values.shape[1:]), np.nan)
        full[:, -1] = values
        return ("time", "joint", "axis")[: full.ndim], full, {"units": units, "long_name": long_name}

    touching = np.zeros((force.size, len(names)), bool)
    touching[:, -1] = force > 0.0
    clearance = np.full(len(names), np.nan)
    clearance[-1] = joint.clearance.clearance
    placed = Placement.at(mechanism, run, slice(None))
    journal, bearing = placed.place(joint.journal), placed.place(joint.bearing)
    apart = journal - bearing
    reaction = whole["reaction"].transpose("time", "joint", "axis").copy(deep=True)
    reaction[:, -1] = -force[:, None] * apart / np.linalg.norm(apart, axis=1)[:, None]
    contact = (
        ("contact_start", 0.0, "s"),
        ("contact_duration", math.nan, "s"),
        ("peak_force", float(force[highest]), "N"),
        ("peak_time", float(run["time"].values[highest]), "s"),
        ("peak_normal_force", float(force[highest]), "N"),
        ("peak_normal_time", float(run["time"].values[highest]), "s"),
    )
    variables = {
        "eccentricity": here(apart, "m", "journal centre relative to the bearing centre"),
        "reaction": reaction,
        "normal_force": here(force, "N", "normal force of the constrained contact"),
        "in_contact": (
            ("time", "joint"),
            touching,
            {"units": "1", "long_name": "the normal force of the constrained contact is positive"},
        ),
        "clearance": (("joint",), clearance, {"units": "m", "long_name": "radial clearance"}),
        "contact_joint": (("contact",), np.array([JOINT]), {"long_name": "joint"}),
    }
    for name, value, unit in contact:
        variables[name] = (("contact",), np.array([value]), {"units": unit, "long_name": name.replace("_", " ")})
    return whole.assign(variables)
