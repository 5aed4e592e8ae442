"""Long periodic runs: one stroboscopic sample and statistics per cycle, without samples in between."""

from __future__ import annotations

import json
import math
from collections.abc import Callable

import numpy as np
import xarray as xr

from scissordyn.casefile.configuration import number_attribute, read_configuration, write_configuration
from scissordyn.errors import InputError
from scissordyn.kinematics.branching import drive_warnings
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.options import Options, StartKind
from scissordyn.periodic.stroboscope import CYCLE_VARIABLES, Cycles, run_cycles
from scissordyn.plan.acting import states_of
from scissordyn.plan.plan import Plan
from scissordyn.run.advance.driver import Snapshot
from scissordyn.run.stops import drive_period
from scissordyn.units import checked


@checked
def cycle(
    mechanism: Mechanism,
    *,
    cycles: int,
    period: float | None = None,
    keep: int | None = None,
    phase: float = 0.0,
    start: StartKind | xr.Dataset = "concentric",
    rtol: float = 1e-6,
    atol: float | None = None,
    method: str = "auto",
    most_steps: int = 1_000_000,
    progress: Callable[[float], None] | None = None,
) -> xr.Dataset:
    """Run a mechanism through many periods of its drive and record its state once per period (stroboscopic map).

    The state is taken at (k + phase) T on the same dense output as the samples of `simulate`. Statistics of cycle k cover the
    time from k T to (k + 1) T. Steps end at every k T, so that a later call can continue the run: two calls give the same
    cycles as one, bit for bit.

    Parameters
    ----------
    mechanism : Mechanism
    cycles : int
        Number of cycles.
    period : float, optional
        T [s]; by default the period of the mechanism's drive.
    keep : int, optional
        Number of last cycles to return; by default all. Energies and largest forces are computed in these cycles only; the
        earlier cycles take about a quarter less time.
    phase : float
        Phase of the samples in the cycle, in [0, 1).
    start : {"concentric", "in-contact", "static"} or Dataset
        As in `simulate`, or the result of an earlier call, which is continued.
    rtol, atol : float
        As in `simulate`.
    method : str
        As in `simulate`.
    most_steps : int
        Largest number of steps of a cycle; a run that needs more fails.
    progress : callable, optional
        Called after every cycle with the simulated time [s].

    Returns
    -------
    Dataset
        Dimensions cycle and joint (the clearance joints), free and internal (coordinates of the state; internal states are
        named after their joint or component). Variables whose names begin with "end" are the final state, from which the run
        can be continued. Values are in SI units; a variable whose entries have different units has no attribute "units".
        Attributes: status ("complete", "interrupted" or "failed"), cause, period, cycles_per_second, statistics, configuration,
        warnings. A run that fails in cycle k has the cycles before it. Warnings concern laws outside their range and
        controllers at their limits in the returned cycles, and singular positions that the drives lead through in a period.
        Motion that the drives do not determine is not searched for singular positions.

    Raises
    ------
    InputError
        If the mechanism cannot be assembled, has no period, or an option is out of bounds.
    """
    period = drive_period(mechanism) if period is None else period
    kind = start if isinstance(start, str) else _start_option(start)
    options = Options(period, kind, 2, rtol, atol, method, most_steps)
    begin = None if isinstance(start, str) else _final_state(start, mechanism, period)
    run = run_cycles(mechanism, options, cycles=cycles, keep=keep, phase=phase, start=begin, progress=progress)
    return _to_dataset(run, options, phase, cycles if keep is None else keep)


def _start_option(run: xr.Dataset) -> StartKind:
    """Return the `start` option of an earlier run; the automatic choice of the method depends on it."""
    options = read_configuration(run).options if "end_y" in run else None
    if options is None:
        raise InputError("start: the dataset has no final state", "a Dataset that cycle() returned")
    return options.start


def _final_state(run: xr.Dataset, mechanism: Mechanism, period: float) -> Snapshot:
    """Return the final state of an earlier run; raise `InputError` if its period or mechanism differs."""
    before = number_attribute(run, "period")
    if not math.isclose(before, period, rel_tol=1e-12):
        raise InputError(f"start: the earlier cycles last {before:g} s, those of this run {period:g} s", "the same period")
    configuration = read_configuration(run)
    if configuration.text != write_configuration(mechanism, configuration.options):
        raise InputError("start: the earlier cycles belong to another mechanism", "cycles of the same mechanism")
    return Snapshot.from_plain({str(name)[4:]: part.values for name, part in run.data_vars.items() if str(name)[:4] == "end_"})


FREE_UNITS = {"free_position": "kg^0.5 m", "free_velocity": "kg^0.5 m/s"}
"""Units of the free coordinates; an internal state has the unit of its law or component."""

END_UNITS = {"counts": "1", "mode": "1", "history_length": "1", "reference": "rad", "total": "J"}
"""Units of those parts of the final state whose entries all have the same unit."""


def recorded_names(mechanism: Mechanism) -> tuple[str, ...]:
    """Return the names of the variables that `cycle` records once per cycle of this mechanism."""
    absent = [name for name in CYCLE_VARIABLES if name.startswith("slider_")] if mechanism.output_guide is None else []
    absent += [name for name, (dims, _, _) in CYCLE_VARIABLES.items() if "joint" in dims and not mechanism.contacts]
    absent += [] if mechanism.contact_points else ["united_contact_fraction"]
    return tuple(name for name in CYCLE_VARIABLES if name not in absent)


def _internal_states(plan: Plan) -> np.ndarray:
    """Return the label of each internal state, for example "A: bristle_deflection"."""
    states = [f"{contact.name}: {state.name}" for contact in plan.contacts for state in states_of(contact)]
    states += [f"{part.name}: {state.name}" for part in plan.acting for state in part.states]
    return np.array(states, dtype=str)


def _to_dataset(cycles: Cycles, options: Options, phase: float, keep: int) -> xr.Dataset:
    plan, n, variables = cycles.plan, cycles.plan.coordinates.free, {}
    for name, values in cycles.values.items():
        dims, units, long_name = CYCLE_VARIABLES[name]
        variables[name] = (dims, values, {"units": units, "long_name": long_name})
    state = cycles.samples.state
    for name, dim, part in (
        ("free_position", "free", state[:, :n]),
        ("free_velocity", "free", state[:, n : 2 * n]),
        ("internal_state", "internal", state[:, 2 * n :]),
    ):
        about = {"units": FREE_UNITS[name]} if name in FREE_UNITS else {}
        variables[name] = (("cycle", dim), part.copy(), {**about, "long_name": name.replace("_", " ")})
    clearance = np.array([contact.clearance.clearance for contact in plan.contacts if contact.clearance is not None])
    variables["clearance"] = (("joint",), clearance, {"units": "m", "long_name": "radial clearance"})
    first = max(0, cycles.samples.time.size - keep)
    coordinates = {
        "cycle": ("cycle", cycles.first + np.arange(cycles.samples.time.size), {"long_name": "cycle"}),
        "time": ("cycle", cycles.samples.time, {"units": "s", "long_name": "time of the sample"}),
        "joint": ("joint", [joint.name for joint in plan.contacts]),
        "axis": ("axis", ["x", "y"]),
        "internal": ("internal", _internal_states(plan), {"long_name": "internal state, in SI units"}),
    }
    run = xr.Dataset(variables, coords=coordinates).isel(cycle=slice(first, None))
    for name, part in cycles.end.plain().items():
        dims = tuple(f"end_{name}_{axis}" for axis in range(part.ndim))
        about = {"units": END_UNITS[name]} if name in END_UNITS else {}
        run[f"end_{name}"] = (dims, part, {**about, "long_name": f"{name} at the end of the run, in SI units"})
    run.attrs = {
        "title": "scissordyn cycles",
        "status": cycles.status,
        "cause": cycles.cause,
        "period": options.until,
        "phase": phase,
        "end_cycle": cycles.first + cycles.samples.time.size,
        "cycles_per_second": cycles.statistics["cycles_per_second"],
        "statistics": json.dumps(cycles.statistics),
        "warnings": json.dumps([*cycles.warnings, *drive_warnings(plan, options.until)]),
        "configuration": write_configuration(plan.mechanism, options),
    }
    return run
