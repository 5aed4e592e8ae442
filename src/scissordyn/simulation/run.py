"""Simulate a mechanism."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable

import xarray as xr

from scissordyn.errors import InputError
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.record import from_plain
from scissordyn.simulation.dataset import to_dataset
from scissordyn.simulation.options import Options, StartKind
from scissordyn.simulation.predictability import TIGHTER, predictability_horizon
from scissordyn.simulation.time_functions import check_tables
from scissordyn.simulation.trajectory import compute
from scissordyn.simulation.warn import run_warnings

__all__ = ["replay", "simulate"]


def simulate(
    mechanism: Mechanism,
    *,
    until: float,
    start: StartKind = "concentric",
    samples: int = 2001,
    rtol: float = 1e-8,
    atol: float = 1e-8,
    method: str = "auto",
    most_steps: int = 50_000_000,
    trust: bool = False,
    progress: Callable[[float], None] | None = None,
) -> xr.Dataset:
    """Simulate a mechanism and return its motion, forces, contacts and energies.

    Parameters
    ----------
    mechanism : Mechanism
    until : float
        End of the simulated time [s].
    start : {"concentric", "in-contact", "static"}
        Journals concentric with their bearings and moving as in the ideal mechanism; resting in contact along the line
        of the ideal reaction; or in static equilibrium under gravity, springs and loads, the drives fixed at t = 0.
    samples : int
        Number of recorded instants, equally spaced; steps and events do not depend on it.
    rtol : float
        Error allowed in a step, relative to the speeds and to the internal states of friction laws.
    atol : float
        Error in positions allowed in a step, as a fraction of the smallest clearance.
    method : str
        "auto" (explicit without friction, stiff with), "dop853", "dopri5", "rodas5p" or "rodas4p".
    most_steps : int
        Largest number of steps; with more the run fails.
    trust : bool
        Repeat the run at a ten times tighter tolerance and report the time until which both agree.
    progress : callable, optional
        Called repeatedly with the simulated time [s].

    Returns
    -------
    Dataset
        Coordinates time, body, joint, axis, contact; every variable has units and a long name. Its attributes hold the
        configuration, versions, solver statistics, warnings, and a status: "complete", "interrupted" or "failed".

    Raises
    ------
    InputError
        If the mechanism cannot be assembled or an option is out of bounds. A failed run raises no error: its Dataset has
        the results up to the failure, and the cause.
    """
    options = Options(until, start, samples, rtol, atol, method, most_steps)
    return _simulate(mechanism, options, trust, progress)


def replay(run: xr.Dataset, *, progress: Callable[[float], None] | None = None) -> xr.Dataset:
    """Run a saved run again, from its attributes; the same versions give the same numbers bit for bit.

    Parameters
    ----------
    run : Dataset
    progress : callable, optional

    Returns
    -------
    Dataset
    """
    if "configuration" not in run.attrs:
        raise InputError("a dataset without the attribute 'configuration'", "a Dataset that simulate() made")
    plain = json.loads(run.attrs["configuration"])
    return _simulate(from_plain(plain["mechanism"]), from_plain(plain["options"]), plain.get("trust", False), progress)


def _simulate(mechanism: Mechanism, options: Options, trust: bool, progress: Callable[[float], None] | None) -> xr.Dataset:
    check_tables(mechanism, options.until)
    path = compute(mechanism, options, progress)
    run = to_dataset(mechanism, options, path)
    run.attrs["warnings"] = json.dumps(run_warnings(mechanism, run, path.immobile))
    if trust and run.attrs["status"] == "complete":
        tight = dataclasses.replace(options, rtol=max(TIGHTER * options.rtol, 1e-14), atol=max(TIGHTER * options.atol, 1e-14))
        second = to_dataset(mechanism, tight, compute(mechanism, tight, progress))
        run.attrs["trusted_until"], run.attrs["trusted_contacts"] = predictability_horizon(run, second)
        run.attrs["configuration"] = json.dumps({**json.loads(run.attrs["configuration"]), "trust": True})
    return run
