"""What a mechanism with some numbers would have shown, at the instants of a record."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

import numpy as np
import xarray as xr

from scissordyn.analysis.agreement import Measured
from scissordyn.errors import InputError, did_you_mean
from scissordyn.file.export import TimeColumn, time_columns
from scissordyn.model.mechanism import Mechanism
from scissordyn.plan.plan import plan
from scissordyn.run.advance.trajectory import compute, recorded
from scissordyn.run.answer.dataset import results
from scissordyn.run.options import Options

TURN = 2.0 * math.pi


class FailedRunError(Exception):
    """A run that did not reach the end of its record."""


KINEMATIC = {
    f"{rate}{name}"
    for rate, names in (("", ("position", "velocity", "acceleration", "angle")), ("angular_", ("velocity", "acceleration")))
    for name in names
} | {f"slider_{name}" for name in ("position", "velocity", "acceleration")}
"""Variables for which no energies need to be integrated."""


def motion(mechanism: Mechanism, options: Options, times: np.ndarray, *, monitor: bool = True) -> xr.Dataset:
    """A run of a mechanism, sampled at some instants."""
    try:
        tables = plan(mechanism)
        chosen = dataclasses.replace(options, until=float(times[-1]), samples=2, trust=False)
        path, record = recorded(tables, chosen, compute(tables, chosen, times=times, monitor=monitor))
    except InputError as error:
        raise FailedRunError(str(error)) from None
    if path.status == "interrupted":
        raise KeyboardInterrupt
    if path.status != "complete":
        raise FailedRunError(path.cause)
    return results(tables, "", path, record).dataset()


def columns_of(run: xr.Dataset, headings: Sequence[str]) -> list[TimeColumn]:
    columns = {column.heading: column for column in time_columns(run)}
    for heading in headings:
        if heading not in columns:
            raise InputError(f"no quantity '{heading}'{did_you_mean(heading, columns)}", "columns of a run of this case")
    return [columns[heading] for heading in headings]


def curves(run: xr.Dataset, columns: Sequence[TimeColumn]) -> np.ndarray:
    """Values of some columns, shape (instants, columns)."""
    return np.column_stack([column.of(run).astype(float) for column in columns])


def whole_turns(record: Measured, found: np.ndarray) -> np.ndarray:
    """Turns by which measured angles differ from those of a run at the first instant, in radians, shape (columns,)."""
    is_angle = np.array([unit == "rad" for unit in record.units])
    return np.where(is_angle, TURN * np.round((record.values[0] - found[0]) / TURN), 0.0)


def state_values(run: xr.Dataset) -> tuple[np.ndarray, np.ndarray]:
    """What a state is made of at the first and the last instant: of each body angle or place, and its rate."""
    names = ("angle", "angular_velocity", "position", "velocity")
    ends = [np.concatenate([run.variables[name].values[k].ravel() for name in names]) for k in (0, -1)]
    return ends[0], ends[1]
