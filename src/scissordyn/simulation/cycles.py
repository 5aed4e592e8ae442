"""Long periodic runs: what a stroboscopic map needs and statistics of every cycle, without a dense record."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import fields

import numpy as np
import xarray as xr

from scissordyn.errors import InputError
from scissordyn.mechanics.bodies import body_motion
from scissordyn.mechanics.outputs import record
from scissordyn.model.body import GROUND
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.record import to_plain
from scissordyn.simulation.configuration import read_configuration, write_configuration
from scissordyn.simulation.options import Options, StartKind
from scissordyn.simulation.stroboscope import Cycles, CycleState, drive_period, run_cycles

__all__ = ["DESCRIBED", "cycle", "per_cycle"]


def cycle(
    mechanism: Mechanism,
    *,
    cycles: int,
    period: float | None = None,
    keep: int | None = None,
    phase: float = 0.0,
    start: StartKind | xr.Dataset = "concentric",
    rtol: float = 1e-6,
    atol: float = 1e-6,
    method: str = "auto",
    most_steps: int = 1_000_000,
    progress: Callable[[float], None] | None = None,
) -> xr.Dataset:
    """Run a mechanism through many periods of its drive and record it once in each: its stroboscopic map.

    The state is taken at (k + phase) T on the same dense output as the samples of `simulate`; statistics of cycle k are
    over the time from k T to (k + 1) T. Steps end at every k T, so that a run can be continued from its result: cycles
    done in two calls are bit for bit those done in one.

    Parameters
    ----------
    mechanism : Mechanism
    cycles : int
        How many cycles to run.
    period : float, optional
        T [s]; that of the mechanism's drive if not given.
    keep : int, optional
        How many of the last cycles to return; all if not given.
    phase : float
        Where in the cycle the state is taken, in [0, 1).
    start : {"concentric", "in-contact", "static"} or Dataset
        As in `simulate`, or what an earlier call returned, to go on from there.
    rtol, atol : float
        As in `simulate`.
    method : str
        As in `simulate`.
    most_steps : int
        The run ends unfinished if a cycle takes more steps.
    progress : callable, optional
        Called after every cycle with the simulated time [s].

    Returns
    -------
    Dataset
        Dimensions cycle and joint (the loose joints), free and hidden (coordinates of the state). Variables that begin
        with "end" are the state to go on from. Attributes: status ("complete", "interrupted" or "failed"), cause, period,
        cycles_per_second, statistics, configuration. A run that breaks off in cycle k holds the cycles before k.

    Raises
    ------
    InputError
        If the mechanism cannot be assembled, has no period, or an option is out of bounds.
    """
    period = drive_period(mechanism) if period is None else period
    kind = start if isinstance(start, str) else _start_of(start)
    options = Options(period, kind, 2, rtol, atol, method, most_steps)
    found = run_cycles(
        mechanism,
        options,
        cycles=cycles,
        phase=phase,
        start=start if isinstance(start, str) else _state_of(start, mechanism, period),
        progress=progress,
    )
    return _to_dataset(mechanism, options, found, phase, cycles if keep is None else keep)


def _start_of(run: xr.Dataset) -> StartKind:
    """How an earlier run started, on which the choice of the method depends."""
    options = read_configuration(run).options if "end_state" in run else None
    if options is None:
        raise InputError("start = a dataset that holds no state to go on from", "a Dataset that cycle() made")
    return options.start


def _state_of(run: xr.Dataset, mechanism: Mechanism, period: float) -> CycleState:
    """The state that an earlier run ended in."""
    if not math.isclose(float(run.attrs["period"]), period, rel_tol=1e-12):
        raise InputError(f"start = cycles of {run.attrs['period']:g} s for cycles of {period:g} s", "the same period")
    if read_configuration(run).plain != to_plain(mechanism):
        raise InputError("start = cycles of another mechanism", "cycles of the same mechanism")
    parts = {field.name: run[f"end_{field.name}"].values.copy() for field in fields(CycleState) if field.name != "cycle"}
    return CycleState(int(run.attrs["end_cycle"]), **parts)


def stroboscopic_samples(mechanism: Mechanism, found: Cycles) -> dict[str, np.ndarray]:
    """What a stroboscopic map shows, at the samples.

    Parameters
    ----------
    mechanism : Mechanism
    found : Cycles

    Returns
    -------
    dict of ndarray
        "eccentricity", "eccentricity_rate" (cycles, nj, 2), "in_contact" (cycles, nj), "energy" (cycles,), and
        "slider_position", "slider_velocity", "slider_acceleration" (cycles,) if a guide on the ground leads the output body.
    """
    samples, system = found.samples, found.system.content
    rows = record(found.system, samples.time, samples.state, samples.mode, samples.memory)
    nj = system.radius.shape[0]
    place, rate = np.zeros((samples.time.size, nj, 2)), np.zeros((samples.time.size, nj, 2))
    for j in range(nj):
        part = slice(system.link_start[j], system.link_start[j + 1])
        column, form = system.link_column[part], system.link_row[:2, part]
        place[:, j], rate[:, j] = rows.X[:, column] @ form.T, rows.V[:, column] @ form.T
    values = {
        "eccentricity": place,
        "eccentricity_rate": rate,
        "in_contact": samples.mode[:, :nj] == 1,
        "energy": rows.kinetic + rows.potential + rows.elastic + rows.springs,
    }
    for guide in mechanism.guides:
        if guide.follower[0] != mechanism.output_body or guide.body != GROUND:
            continue
        motion = body_motion(found.layout, rows)
        k = [body.name for body in mechanism.bodies].index(mechanism.output_body)
        along = np.array([math.cos(guide.direction), math.sin(guide.direction)])
        values["slider_position"] = (motion.position[:, k] - np.array(guide.through)) @ along
        values["slider_velocity"] = motion.velocity[:, k] @ along
        values["slider_acceleration"] = motion.acceleration[:, k] @ along
        break
    return values


DESCRIBED = {
    "slider_position": (("cycle",), "m", "position of the slider along its guide"),
    "slider_velocity": (("cycle",), "m/s", "velocity of the slider along its guide"),
    "slider_acceleration": (("cycle",), "m/s^2", "acceleration of the slider along its guide"),
    "eccentricity": (("cycle", "joint", "axis"), "m", "journal centre relative to the bearing centre"),
    "eccentricity_rate": (("cycle", "joint", "axis"), "m/s", "rate of the eccentricity"),
    "in_contact": (("cycle", "joint"), "1", "journal and bearing in contact"),
    "energy": (("cycle",), "J", "kinetic, potential, elastic and spring energy"),
    "impacts": (("cycle", "joint"), "1", "contacts that started in the cycle"),
    "contact_share": (("cycle", "joint"), "1", "share of the cycle spent in contact"),
    "peak_force": (("cycle", "joint"), "N", "largest normal force in the cycle"),
    "drive_work": (("cycle",), "J", "work of the drives in the cycle"),
    "dissipated_energy": (("cycle",), "J", "energy dissipated in the cycle"),
    "steps": (("cycle",), "1", "integration steps in the cycle"),
}
"""Dimensions, unit and long name of what is recorded once per cycle."""

END = {
    "state": ("entry", "SI"),
    "mode": ("guard", "1"),
    "approach": ("guard", "m/s"),
    "force": ("guard", "N"),
    "total": ("quadrature", "J"),
    "stepping": ("stepping", "SI"),
}
"""Dimension and unit of each part of the state at the end."""


def per_cycle(mechanism: Mechanism, found: Cycles) -> dict[str, np.ndarray]:
    """Everything that is recorded once per cycle, by the names of `DESCRIBED`."""
    return {
        **stroboscopic_samples(mechanism, found),
        "impacts": found.impacts,
        "contact_share": found.contact_share,
        "peak_force": found.peak_force,
        "drive_work": found.work[:, 0],
        "dissipated_energy": found.work[:, 1] + found.work[:, 2] + found.work[:, 4],
        "steps": found.steps,
    }


def _to_dataset(mechanism: Mechanism, options: Options, found: Cycles, phase: float, keep: int) -> xr.Dataset:
    if isinstance(keep, bool) or not isinstance(keep, int) or keep < 1:
        raise InputError(f"keep = {keep!r}", "a whole number >= 1")
    n = found.layout.free
    variables = {}
    for name, values in per_cycle(mechanism, found).items():
        dims, units, long_name = DESCRIBED[name]
        variables[name] = (dims, values, {"units": units, "long_name": long_name})
    state = found.samples.state
    for name, dim, part in (
        ("free_position", "free", state[:, :n]),
        ("free_velocity", "free", state[:, n : 2 * n]),
        ("hidden_state", "hidden", state[:, 2 * n :]),
    ):
        units = {"free_position": "kg^0.5 m", "free_velocity": "kg^0.5 m/s"}.get(name, "SI")
        variables[name] = (("cycle", dim), part.copy(), {"units": units, "long_name": name.replace("_", " ")})
    first = max(0, found.samples.time.size - keep)
    coordinates = {
        "cycle": ("cycle", found.first + np.arange(found.samples.time.size), {"long_name": "cycle"}),
        "time": ("cycle", found.samples.time, {"units": "s", "long_name": "time of the sample"}),
        "joint": ("joint", [joint.name for joint in mechanism.contacts]),
        "axis": ("axis", ["x", "y"]),
    }
    run = xr.Dataset(variables, coords=coordinates).isel(cycle=slice(first, None))
    for field in fields(CycleState):
        if field.name != "cycle":
            dim, unit = END[field.name]
            about = {"units": unit, "long_name": f"{field.name} at the end, to go on from"}
            run[f"end_{field.name}"] = ((dim,), getattr(found.end, field.name), about)
    run.attrs = {
        "title": "scissordyn cycles",
        "status": found.status,
        "cause": found.cause,
        "period": options.until,
        "phase": phase,
        "end_cycle": found.end.cycle,
        "cycles_per_second": found.statistics["cycles_per_second"],
        "statistics": json.dumps(found.statistics),
        "configuration": write_configuration(mechanism, options),
    }
    return run
