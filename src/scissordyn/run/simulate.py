"""Simulation of a mechanism, and repetition of a saved run."""

from __future__ import annotations

import json
import os
import threading
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated

from scissordyn.casefile.configuration import can_write_later, is_run, read_configuration, write_configuration
from scissordyn.equilibrium.bar_extremes import bar_extremes
from scissordyn.errors import InputError
from scissordyn.kinematics.branching import passing_warnings
from scissordyn.kinematics.closure import check_tables
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.options import AUTO, EndTime, EventKind, Options, SampleCount, StartKind
from scissordyn.plan.plan import plan
from scissordyn.record.dataset import results
from scissordyn.record.deferred import Deferred
from scissordyn.record.results import Results, Run
from scissordyn.record.trajectory import Trajectory
from scissordyn.record.warn import Extremes, contact_failures, run_warnings, warnings_of
from scissordyn.run.advance.checkpoint import Checkpoint, open_checkpoint
from scissordyn.run.deviation import deviation_variables
from scissordyn.run.ideal_path import can_deviate, ideal_path
from scissordyn.run.instants import add_recorded_samples, sample_times, select_samples
from scissordyn.run.predictability import compute_comparable, predictability
from scissordyn.run.sample_memory import check_samples
from scissordyn.run.trajectory import MODEL_FAILED, compute, immobile_at_start, record_trajectory
from scissordyn.run.trajectory_warnings import trajectory_warnings
from scissordyn.units import Meaning, checked
from scissordyn.warning import RunWarning, plain, warning

if TYPE_CHECKING:
    import xarray as xr


@checked
def simulate(
    mechanism: Annotated[Mechanism, Meaning("a mechanism", "read_case('case.toml').mechanism")],
    *,
    until: EndTime,
    start: StartKind = Options.start,
    samples: SampleCount = Options.samples,
    rtol: float = Options.rtol,
    atol: float | None = None,
    method: str = Options.method,
    most_steps: int = Options.most_steps,
    events: EventKind = Options.events,
    trust: bool = Options.trust,
    step: float | None = Options.step,
    progress: Callable[[float], None] | None = None,
    checkpoint: Annotated[Checkpoint | None, Meaning("a file for the state", "Checkpoint('run.checkpoint')")] = None,
) -> xr.Dataset:
    """Simulate a mechanism and return its motion, forces, contacts and energies.

    Parameters
    ----------
    mechanism : Mechanism
    until : float
        End of the simulated time [s].
    start : {"concentric", "in-contact", "static", "as-placed"}
        "concentric": journals at the centres of their bearings, with the velocities of the ideal mechanism. "in-contact":
        journals at rest in contact, along the line of the ideal reaction. "static": static equilibrium under gravity, springs
        and loads, with the drives fixed at t = 0. "as-placed": positions and velocities of the bodies as given, so that a
        journal can start anywhere in its bearing.
    samples : int or "auto"
        Number of equally spaced recorded instants; steps and events do not depend on it. "auto" adds the instants of the
        contacts, so that no curve misses its own peaks.
    rtol : float
        Error allowed in a step, relative to the speeds and to the internal states of friction laws.
    atol : float, optional
        Error in positions allowed in a step, as a fraction of the smallest clearance (of the largest body if there is none).
        The default is the value of `rtol`.
    method : str
        "auto", chosen by an estimate of stiffness, or "dop853", "dopri5", "rodas5p", "rodas4p".
    most_steps : int
        Largest number of steps; a run that needs more fails.
    events : {"auto", "located", "crossed"}
        "located": a step ends where a contact begins or ends. "crossed": a step passes the contact's begin or end if its error
        allows. "auto": crossed in mechanisms with many clearance joints, located in others.
    trust : bool
        Repeat the run at a much tighter tolerance and report the predictability horizon: the time until which both agree.
    step : float, optional
        Step of time stepping with hard contacts [s]; chosen if not given. With `trust` the second run has half the step.
        Without hard contacts every step has this size, whatever its error, and contacts begin and end at the ends of steps, as
        in programs without error control and event location.
    progress : callable, optional
        Called repeatedly with the simulated time [s].
    checkpoint : Checkpoint, optional
        File that regularly stores the state. If the file exists, the run continues from it; its results are those of a run
        without interruption, bit for bit.

    Returns
    -------
    Dataset
        Coordinates time, body, joint, axis, contact; every variable has units and a long name. Attributes hold the
        configuration, versions, solver statistics, warnings, and the status "complete", "interrupted" or "failed". Warnings
        report failed contact models, energy balances that do not close, and controllers at their limit.

    Raises
    ------
    InputError
        If the mechanism cannot be assembled, an option is out of bounds, or the checkpoint belongs to another run. A failed run
        raises no error: its Dataset has the results up to the failure, and the cause.

    Examples
    --------
    >>> import scissordyn as sd
    >>> joint = sd.Clearance(0.5e-3, friction=sd.LuGre(kinetic=0.05))
    >>> array = sd.scissor(units=2, angle=sd.degrees(30)).with_clearance("A", joint).driven(speed=sd.rpm(150))
    >>> run = sd.simulate(array, until=2e-3)
    >>> print(run.sizes["contact"], "contact,", f"{1e-3 * float(run['peak_force'].max()):.0f} kN")
    1 contact, 43 kN
    """
    from scissordyn.record.xarray_dataset import as_dataset  # imports xarray, which takes longer than most runs

    options = Options(until, start, samples, rtol, atol, method, most_steps, events, trust, step)
    return as_dataset(compute_results(mechanism, options, progress, checkpoint))


_FUNCTIONS_BY_TITLE = {
    "scissordyn batch": "simulate_many(...)",
    "scissordyn bifurcation": "bifurcation(...)",
    "scissordyn cycles": "cycle(...)",
}
"""Function that makes a Dataset, by the attribute `title` of the Dataset."""


@checked
def replay(
    run: xr.Dataset,
    *,
    allow_code: str | os.PathLike[str] | Sequence[str | os.PathLike[str]] = (),
    progress: Callable[[float], None] | None = None,
    checkpoint: Checkpoint | None = None,
) -> xr.Dataset:
    """Run a saved run again, from its attributes; the same versions give the same numbers bit for bit.

    Code that the saved run refers to is not executed. If the run used functions in a user's file, that file must be allowed.

    Parameters
    ----------
    run : Dataset
    allow_code : path or sequence of path
        Python files that may be executed. A function is taken from the file whose digest the run holds.
    progress : callable, optional
    checkpoint : Checkpoint, optional
        As for `simulate`.

    Returns
    -------
    Dataset

    Raises
    ------
    InputError
        If `run` was not made by `simulate`, or uses a function that is in none of the allowed files.
    """
    from scissordyn.record.xarray_dataset import as_dataset  # imports xarray, which takes longer than most runs

    return as_dataset(replay_results(run, allow_code=allow_code, progress=progress, checkpoint=checkpoint))


def replay_results(
    run: Run,
    *,
    allow_code: str | os.PathLike[str] | Sequence[str | os.PathLike[str]],
    progress: Callable[[float], None] | None,
    checkpoint: Checkpoint | None,
) -> Results:
    """Return the `Results` of `replay`, before they become a Dataset."""
    configuration = read_configuration(run)
    if configuration.options is None or not is_run(run):
        title = run.attrs.get("title", "a dataset without a title")
        raise InputError(f"replay of {title!r:.60}", "a Dataset that simulate() made", _FUNCTIONS_BY_TITLE.get(str(title), ""))
    mechanism = configuration.build_mechanism(allow_code)
    return compute_results(mechanism, configuration.options, progress, checkpoint)


def compute_results(
    mechanism: Mechanism,
    options: Options,
    progress: Callable[[float], None] | None = None,
    checkpoint: Checkpoint | None = None,
    *,
    curves: bool = False,
) -> Results:
    """Return the `Results` of `simulate`, before they become a Dataset; `curves` adds finer curves without a checkpoint."""
    tables = plan(mechanism)
    check_tables(tables, options.until)
    check_samples(tables, options.count)
    configuration = Deferred(lambda: write_configuration(mechanism, options), threading.RLock())
    if checkpoint is not None or not can_write_later(mechanism):
        configuration()
    keeper = None if checkpoint is None else open_checkpoint(checkpoint, configuration())
    ideal = ideal_path(tables, options) if tables.mechanism.tracks and can_deviate(mechanism) else None
    records = options.samples == AUTO or (curves and keeper is None)
    states = None
    if options.trust:
        path, states = compute_comparable(tables, options, progress, curves=records, ideal=ideal, keeper=keeper)
    else:
        times = sample_times(options, curves=records)
        path = compute(tables, options, progress, times=times, curves=True, ideal=ideal, keeper=keeper)

    def make_results(path: Trajectory) -> Results:
        path, record = record_trajectory(tables, options, path, progress, ideal=ideal)
        run = results(tables, configuration, path, record)
        run.variables |= bar_extremes(path, record, run.variables)
        if run.attrs["status"] == "failed":
            failures = [str(failure) for failure in contact_failures(tables, run)]
            run.attrs["cause"] = "; ".join(failures if failures and MODEL_FAILED in path.cause else [path.cause, *failures])
        if ideal is not None:
            run.variables.update(deviation_variables(run, path, ideal, options))

        unwarned = Results(run.variables, run.attrs)  # without the warnings: a run that refers to itself is freed late

        def make_warnings() -> list[RunWarning]:
            warnings = [*plain(path.warnings), *Extremes(tables).add(path).warnings()]
            warnings += run_warnings(tables, unwarned, immobile_at_start(path))
            warnings += plain(passing_warnings(tables, unwarned, options.until)) + trajectory_warnings(path, record, options)
            return warnings + ([] if ideal is None else plain(ideal.warnings))

        _add_warnings(run, Deferred(make_warnings, path.system.lock))
        return run

    sampled = (
        add_recorded_samples(path)
        if options.samples == AUTO
        else select_samples(path, sample_times(options))
        if records
        else path
    )
    run = make_results(sampled)
    if records and options.samples != AUTO and path.status == "complete":
        equal = sample_times(replace(options, samples=AUTO))
        run.make_finer = lambda: make_results(add_recorded_samples(select_samples(path, equal)))
    if states is not None:
        run.attrs.update(predictability(options, path, states, run, progress, keeper))
    if keeper is not None and keeper.problem:
        warnings = [*warnings_of(run), warning("checkpoints", problem=keeper.problem)]
        _add_warnings(run, Deferred(lambda: warnings, path.system.lock))
    if keeper is not None and run.attrs["status"] != "interrupted":
        keeper.finish()
    return run


def _add_warnings(run: Results, warnings: Deferred[list[RunWarning]]) -> None:
    """Write warnings as attributes of a run, each once, as sentences and as data; they are computed when they are read."""

    def unique() -> list[RunWarning]:
        return list({str(item): item for item in warnings()}.values())

    lock = threading.RLock()
    run.attrs["warnings"] = Deferred(lambda: json.dumps([str(item) for item in unique()]), lock)
    run.attrs["warning_data"] = Deferred(lambda: json.dumps([item.data for item in unique()]), lock)
