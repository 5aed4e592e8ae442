"""Measure cases per second of `simulate_many` on one thread and on two, and of single runs."""

from __future__ import annotations

import time
import tracemalloc
from statistics import median

import numpy as np
import xarray as xr

from benchmarks.cases import UNTIL, array, name_of
from benchmarks.measure import command, table
from scissordyn.model.mechanism import Mechanism
from scissordyn.run.batch import simulate_many
from scissordyn.run.simulate import simulate
from scissordyn.units import rpm

MEASURES = ("peak_force", "peak_drive_torque", "contact_count", "contact_fraction")


def grid(cases: int) -> dict[str, np.ndarray]:
    """Return clearances [m] and speeds [rad/s] of the paper's range, shuffled so that neighbours differ."""
    side = int(np.sqrt(cases))
    clearance, speed = np.meshgrid(np.linspace(0.05e-3, 0.5e-3, side), rpm(1) * np.linspace(100.0, 250.0, side))
    order = np.random.default_rng(1).permutation(clearance.size)
    return {"A.clearance": clearance.ravel()[order], "drive.speed": speed.ravel()[order]}


def measure(quick: bool = False) -> str:
    """Return the table of rates, their ratios, bit identity and memory."""
    cases, repeats = (16, 1) if quick else (400, 3)
    rows = []
    for kinetic in (None, 0.1):
        mechanism = array(kinetic, 2)
        rows.append(_row(name_of(kinetic), mechanism, cases, repeats))
    head = (
        "case",
        *(f"{name} [ms]" for name in ("simulate", "1 thread", "2 threads")),
        *(f"{name} [1/s]" for name in ("simulate", "1 thread", "2 threads")),
        *("ratio", "integration [%]", "same bits", "peak [MB]"),
    )
    said = (
        f"Medians of {repeats} alternating repetitions of {cases} cases: {UNTIL * 1e3:g} ms of the paper's array at 1e-8, "
        f"clearance and speed varied, {len(MEASURES)} measures. Integration: share of one thread's time in the compiled loop. "
        "In ms: processor time of a case, which other processes disturb little; in cases per second: by the clock on the wall. "
        "Bits: whether one thread, two threads and `simulate` agree to the last one. Peak: Python memory of a batch.\n"
    )
    return f"{said}\n{table(head, rows)}"


def _row(name: str, mechanism: Mechanism, cases: int, repeats: int) -> tuple[str, ...]:
    over, single = grid(cases), max(4, cases // 20)
    rates: dict[str, list[float]] = {"simulate": [], "1": [], "2": []}
    processor: dict[str, list[float]] = {"simulate": [], "1": [], "2": []}
    shares, same = [], True
    for turn in range(repeats + 1):
        clocks = {"simulate": _clocks()}
        runs = [_one(mechanism, over, case) for case in range(single)]
        clocks["simulate"] = (_clocks() - clocks["simulate"]) / single
        batches: dict[str, xr.Dataset] = {}
        for threads in ("1", "2"):
            began = _clocks()
            batches[threads] = simulate_many(mechanism, over, until=UNTIL, measures=MEASURES, threads=int(threads))
            clocks[threads] = (_clocks() - began) / cases
        if not turn:
            continue
        for key, (wall, used) in clocks.items():
            rates[key].append(1.0 / wall)
            processor[key].append(1e3 * used)
        shares.append(batches["1"].attrs["integration_seconds"] / batches["1"].attrs["seconds"])
        same = same and all(
            np.array_equal(batches["1"][key].values, batches["2"][key].values, equal_nan=True) for key in MEASURES
        )
        same = (
            same and [float(run["peak_force"].max()) for run in runs] == batches["1"]["peak_force"].values[:single, 0].tolist()
        )
    tracemalloc.start()
    simulate_many(mechanism, over, until=UNTIL, measures=MEASURES, threads=1)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    ratio = median(two / one for one, two in zip(rates["1"], rates["2"], strict=True))
    times = (f"{median(values):.1f}" for values in processor.values())
    speeds = (f"{median(values):.0f}" for values in rates.values())
    return name, *times, *speeds, f"{ratio:.2f}", f"{100 * median(shares):.0f}", "yes" if same else "no", f"{peak / 1e6:.1f}"


def _clocks() -> np.ndarray:
    """Return the wall clock and the processor time of all threads [s]."""
    return np.array([time.perf_counter(), time.process_time()])


def _one(mechanism: Mechanism, over: dict[str, np.ndarray], case: int) -> xr.Dataset:
    changed = mechanism
    for address, values in over.items():
        changed = changed.replace(address, float(values[case]))
    return simulate(changed, until=UNTIL)


if __name__ == "__main__":
    command("batches", measure)
