"""Measure cases per second of `simulate_many` on one thread, two threads and two duplicates of the process."""

from __future__ import annotations

import os
import threading
import time
import tracemalloc
from collections.abc import Iterator
from contextlib import contextmanager
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
SHORT = 2e-3  # [s] end of short runs, in which the compiled loop takes a tenth of the time
WAYS = ("simulate", "1 thread", "2 threads", "2 duplicates")


def grid(cases: int) -> dict[str, np.ndarray]:
    """Return clearances [m] and speeds [rad/s] of the paper's range, shuffled so that neighbours differ."""
    side = int(np.sqrt(cases))
    clearance, speed = np.meshgrid(np.linspace(0.05e-3, 0.5e-3, side), rpm(1) * np.linspace(100.0, 250.0, side))
    order = np.random.default_rng(1).permutation(clearance.size)
    return {"A.clearance": clearance.ravel()[order], "drive.speed": speed.ravel()[order]}


def measure(quick: bool = False) -> str:
    """Return the table of rates, their ratios, bit identity and memory."""
    cases, repeats = (64, 1) if quick else (400, 3)
    rows = []
    for kinetic, until in ((None, SHORT), (None, UNTIL), (0.1, UNTIL)):
        name = f"{name_of(kinetic)}, {until * 1e3:g} ms"
        rows.append(_row(name, array(kinetic, 2), until, cases, repeats))
    head = (
        "case",
        *(f"{way} [ms]" for way in WAYS),
        *(f"{way} [1/s]" for way in WAYS),
        *("threads / 1", "duplicates / 1", "integration [%]", "same bits", "peak [MB]"),
    )
    said = (
        f"Medians of {repeats} alternating repetitions of {cases} cases of the paper's array at 1e-8, clearance and speed "
        f"varied, {len(MEASURES)} measures. Integration: share of one thread's time in the compiled loop. In ms: processor "
        "time of a case, with that of duplicates; in cases per second: by the clock on the wall. Bits: whether one thread, two "
        "threads, two duplicates and `simulate` agree to the last one. Peak: Python memory of a batch on one thread.\n"
    )
    return f"{said}\n{table(head, rows)}"


def _row(name: str, mechanism: Mechanism, until: float, cases: int, repeats: int) -> tuple[str, ...]:
    over, single = grid(cases), max(4, cases // 20)
    rates: dict[str, list[float]] = {way: [] for way in WAYS}
    processor: dict[str, list[float]] = {way: [] for way in WAYS}
    shares, same = [], True

    def batch(threads: int) -> xr.Dataset:
        return simulate_many(mechanism, over, until=until, measures=MEASURES, threads=threads)

    for turn in range(repeats + 1):
        clocks = {"simulate": _clocks()}
        runs = [_one(mechanism, over, case, until) for case in range(single)]
        clocks["simulate"] = (_clocks() - clocks["simulate"]) / single
        batches: dict[str, xr.Dataset] = {}
        for way in WAYS[1:]:
            began = _clocks()
            if way == "2 threads":
                with another_thread():
                    batches[way] = batch(2)
            else:
                batches[way] = batch(int(way[0]))
            clocks[way] = (_clocks() - began) / cases
        if not turn:
            continue
        for way, (wall, used) in clocks.items():
            rates[way].append(1.0 / wall)
            processor[way].append(1e3 * used)
        first, *others = batches.values()
        shares.append(first.attrs["integration_seconds"] / first.attrs["seconds"])
        same = same and all(
            np.array_equal(first[key].values, other[key].values, equal_nan=True) for key in MEASURES for other in others
        )
        same = same and [float(run["peak_force"].max()) for run in runs] == first["peak_force"].values[:single, 0].tolist()
    tracemalloc.start()
    batch(1)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    ratios = (median(np.divide(rates[way], rates["1 thread"])) for way in WAYS[2:])
    times = (f"{median(values):.1f}" for values in processor.values())
    speeds = (f"{median(values):.0f}" for values in rates.values())
    return (
        *(name, *times, *speeds, *(f"{ratio:.2f}" for ratio in ratios)),
        *(f"{100 * median(shares):.0f}", "yes" if same else "no", f"{peak / 1e6:.1f}"),
    )


@contextmanager
def another_thread() -> Iterator[None]:
    """Keep a second thread waiting, so that this process is not duplicated."""
    done = threading.Event()
    waiting = threading.Thread(target=done.wait)
    waiting.start()
    try:
        yield
    finally:
        done.set()
        waiting.join()


def _clocks() -> np.ndarray:
    """Return the wall clock and the processor time of all threads, and of processes that have ended [s]."""
    return np.array([time.perf_counter(), sum(os.times()[:4])])


def _one(mechanism: Mechanism, over: dict[str, np.ndarray], case: int, until: float) -> xr.Dataset:
    changed = mechanism
    for address, values in over.items():
        changed = changed.replace(address, float(values[case]))
    return simulate(changed, until=until)


if __name__ == "__main__":
    command("batches", measure)
