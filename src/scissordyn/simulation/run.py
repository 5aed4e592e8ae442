"""Simulate a mechanism."""

from __future__ import annotations

import json
from collections.abc import Callable

import xarray as xr

from scissordyn.errors import InputError
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.record import from_plain
from scissordyn.simulation.dataset import to_dataset
from scissordyn.simulation.options import EventKind, Options, StartKind
from scissordyn.simulation.predictability import predictability
from scissordyn.simulation.time_functions import check_tables
from scissordyn.simulation.trajectory import compute
from scissordyn.simulation.warn import run_warnings

__all__ = ["replay", "simulate"]


def simulate(
    mechanism: Mechanism,
    *,
    until: float,
    start: StartKind = Options.start,
    samples: int = Options.samples,
    rtol: float = Options.rtol,
    atol: float = Options.atol,
    method: str = Options.method,
    most_steps: int = Options.most_steps,
    events: EventKind = Options.events,
    trust: bool = Options.trust,
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
    return _simulate(mechanism, Options(until, start, samples, rtol, atol, method, most_steps, events, trust), progress)


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
    return _simulate(from_plain(plain["mechanism"]), from_plain(plain["options"]), progress)


def _simulate(mechanism: Mechanism, options: Options, progress: Callable[[float], None] | None) -> xr.Dataset:
    check_tables(mechanism, options.until)
    path = compute(mechanism, options, progress, record_steps=options.trust)
    run = to_dataset(mechanism, options, path)
    found = [*path.warnings, *run_warnings(mechanism, run, path.immobile)]
    if options.trust:
        run.attrs.update(predictability(mechanism, options, path, run, progress).attributes)
    run.attrs["warnings"] = json.dumps(found)
    return run
