"""Simulate a mechanism."""

from __future__ import annotations

import dataclasses
import json
import os
from collections.abc import Callable, Sequence

import xarray as xr

from scissordyn.errors import InputError
from scissordyn.model.mechanism import Mechanism
from scissordyn.simulation.configuration import read_configuration, write_configuration
from scissordyn.simulation.courses import check_tables
from scissordyn.simulation.dataset import to_dataset
from scissordyn.simulation.options import Options, StartKind
from scissordyn.simulation.trajectory import compute
from scissordyn.simulation.trust import TIGHTER, horizon
from scissordyn.simulation.warn import run_warnings

__all__ = ["replay", "simulate"]

TITLE = "scissordyn run"
"""Of what `simulate` returns: a map or a diagram has a configuration too, and is not run again from it."""


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
    """Simulate a mechanism and return everything that is known about its motion.

    Parameters
    ----------
    mechanism : Mechanism
    until : float
        End of the simulated time [s].
    start : {"concentric", "in-contact", "static"}
        Journals concentric with their bearings and moving as in the ideal mechanism; resting in contact along the line
        of the ideal reaction; or in static equilibrium under gravity, springs and loads, the drives held at t = 0.
    samples : int
        Instants at which the run is recorded; steps and events do not depend on it.
    rtol : float
        Error allowed in a step, relative to the speeds and to the hidden states of friction laws.
    atol : float
        Error in positions allowed in a step, as a fraction of the smallest clearance.
    method : str
        "auto" (explicit without friction, stiff with), "dop853", "dopri5", "rodas5p" or "rodas4p".
    most_steps : int
        The run ends unfinished after so many steps.
    trust : bool
        Repeat the run at a ten times tighter tolerance and report until when both agree.
    progress : callable, optional
        Called now and then with the simulated time [s].

    Returns
    -------
    Dataset
        Coordinates time, body, joint, axis, contact; every variable has units and a long name. Its attributes hold the
        configuration, versions, solver statistics, warnings, and a status: "complete", "interrupted" or "failed".

    Raises
    ------
    InputError
        If the mechanism cannot be assembled or an option is out of bounds. A run that breaks off raises nothing: it returns
        what it has, with the cause.
    """
    options = Options(until, start, samples, rtol, atol, method, most_steps)
    return _simulate(mechanism, options, trust, progress)


def replay(
    run: xr.Dataset,
    *,
    allow_code: str | os.PathLike[str] | Sequence[str | os.PathLike[str]] = (),
    progress: Callable[[float], None] | None = None,
) -> xr.Dataset:
    """Run a saved run again, from its attributes; the same versions give the same numbers bit for bit.

    Nothing that the run names is executed. If it used functions in a file of the user's own, that file must be allowed.

    Parameters
    ----------
    run : Dataset
    allow_code : path or sequence of path
        Python files that may be executed. A function is taken from the one with the digest that the run holds.
    progress : callable, optional

    Returns
    -------
    Dataset

    Raises
    ------
    InputError
        If it is no run of `simulate`, or uses a function that is in none of the allowed files.
    """
    configuration = read_configuration(run)
    if configuration.options is None or run.attrs.get("title") != TITLE:
        raise InputError(f"{run.attrs.get('title', 'a dataset without a title')!r:.60}", "a Dataset that simulate() made")
    mechanism = configuration.build_mechanism(allow_code)
    return _simulate(mechanism, configuration.options, configuration.trust, progress)


def _simulate(mechanism: Mechanism, options: Options, trust: bool, progress: Callable[[float], None] | None) -> xr.Dataset:
    check_tables(mechanism, options.until)
    path = compute(mechanism, options, progress)
    run = to_dataset(mechanism, options, path)
    run.attrs["warnings"] = json.dumps(run_warnings(mechanism, run, path.still))
    if trust and run.attrs["status"] == "complete":
        run.attrs["configuration"] = write_configuration(mechanism, options, trust=True)
        tight = dataclasses.replace(options, rtol=max(TIGHTER * options.rtol, 1e-14), atol=max(TIGHTER * options.atol, 1e-14))
        second = to_dataset(mechanism, tight, compute(mechanism, tight, progress))
        if second.attrs["status"] == "interrupted":
            cause = "interrupted while the run was repeated; the run itself is complete, and nothing is known of its horizon"
            return run.assign_attrs(status="interrupted", cause=cause)
        run.attrs["trusted_until"], run.attrs["trusted_contacts"] = horizon(run, second)
    return run
