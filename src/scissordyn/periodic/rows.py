"""Collect the results of many periodic runs in a Dataset with one row per case, as the cases finish."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from scissordyn.model.mechanism import Mechanism
from scissordyn.model.options import Options
from scissordyn.periodic.stroboscope import CYCLE_VARIABLES, run_cycles
from scissordyn.run.advance.driver import Snapshot
from scissordyn.run.engine import Outcome
from scissordyn.run.rows import COLUMNS, empty_columns, failed_row, store_row


@dataclass(frozen=True)
class CycleCase:
    """One periodic run, with all inputs that a worker needs."""

    at: int  # row of the case
    mechanism: Mechanism
    options: Options  # its `until` is the period
    cycles: int
    keep: int
    phase: float
    start: Snapshot | None = None  # replaces the start of the options


class CycleRow(NamedTuple):
    """Result of one case."""

    values: dict[str, Any]  # last cycles, by the names of `CYCLE_VARIABLES`, shorter if the run failed; and `CYCLE_COLUMNS`
    end: Snapshot


def run_case(case: CycleCase) -> CycleRow:
    """Compute the periodic run of one case; raise `KeyboardInterrupt` if the user interrupts it."""
    began, worked = time.perf_counter(), time.thread_time()
    run = run_cycles(case.mechanism, case.options, cycles=case.cycles, keep=case.keep, phase=case.phase, start=case.start)
    if run.status == "interrupted":
        raise KeyboardInterrupt
    about = {
        "status": run.status,
        "cause": run.cause,
        "warnings": "\n".join(run.warnings),
        "completed_cycles": run.samples.time.size,
        "total_steps": int(run.statistics["steps"]),
        "total_events": int(run.statistics["events"]),
        "seconds": time.perf_counter() - began,
        "processor_seconds": time.thread_time() - worked,
    }
    return CycleRow({name: values[case.cycles - case.keep :] for name, values in run.values.items()} | about, run.end)


CYCLE_COLUMNS: dict[str, tuple[str | int | float, dict[str, str]]] = {
    **COLUMNS,
    "completed_cycles": (0, {"units": "1", "long_name": "complete cycles"}),
    "total_steps": (0, {"units": "1", "long_name": "integration steps"}),
    "total_events": (0, {"units": "1", "long_name": "starts and ends of contacts"}),
    "seconds": (0.0, {"units": "s", "long_name": "computing time"}),
    "processor_seconds": (0.0, {"units": "s", "long_name": "processor time"}),
}
"""Columns of the row of a case in addition to its cycles: value before the case is computed, and attributes."""


def empty_rows(cases: Sequence[CycleCase], along: str, coordinates: Mapping[str, Any]) -> xr.Dataset:
    first = cases[0]
    return xr.Dataset(
        empty_columns(CYCLE_COLUMNS, along, len(cases)),
        coords={
            **coordinates,
            "cycle": ("cycle", np.arange(first.cycles - first.keep, first.cycles), {"long_name": "cycle"}),
            "joint": ("joint", np.array([joint.name for joint in first.mechanism.contacts], dtype=object)),
            "axis": ("axis", np.array(["x", "y"], dtype=object)),
        },
    )


def store_cycles(rows: xr.Dataset, along: str, outcome: Outcome[CycleCase, CycleRow]) -> None:
    """Store the outcome of a case in its row; cycles that were not reached stay NaN."""
    values = failed_row(outcome.cause) if outcome.value is None else outcome.value.values
    for name in (name for name in values if name not in rows):
        dims, units, long_name = CYCLE_VARIABLES[name]
        full = np.full((rows.sizes[along], rows.sizes["cycle"], *values[name].shape[1:]), np.nan)
        rows[name] = ((along, *dims), full, {"units": units, "long_name": long_name})
    store_row({name: rows[name].values for name in values}, outcome.task.at, values)
