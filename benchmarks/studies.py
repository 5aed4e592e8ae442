"""Cost of a study beside its integration: the store, blocks, tasks of dask, and a plan for ten million cases."""

from __future__ import annotations

import os
import resource
import sys
import tempfile
import time
from pathlib import Path

import scissordyn as sd
from benchmarks.measure import machine
from scissordyn.simulation.options import Options
from scissordyn.study.description import Factor, Study
from scissordyn.study.design import Design
from scissordyn.study.distribution import Interval
from scissordyn.study.engine import Cluster, Threads
from scissordyn.study.execute import execute
from scissordyn.study.store import Store

PAGE = Path(__file__).parents[1] / "docs" / "decisions" / "measured" / "studies.md"

TASKS = 2000
"""Empty tasks by which dask's cost of one is measured."""

WORKERS, PLANNED, BLOCK_SECONDS = 1000, 10_000_000, 3.0


def study(cases: int) -> Study:
    """Frictionless cases of the paper over clearance and speed."""
    arm = sd.scissor(units=2).with_clearance("A", sd.Clearance(0.5e-3)).driven(speed=sd.rpm(150))
    factors = (Factor("A.clearance", Interval(0.05e-3, 0.7e-3)), Factor("drive.speed", Interval(sd.rpm(50), sd.rpm(180))))
    return Study(arm, Options(0.05), factors, Design("random", cases), ("peak_force", "contact_count"))


def empty(task: int, stop: object = None) -> int:
    """A task without work."""
    return task


def measure(*, quick: bool = False, cases: int = 100_000) -> str:
    """The page."""
    cases = 400 if quick else cases
    head = ("engine", "cases", "seconds", "cases per second", "beside the integration", "peak memory [MiB]")
    lines = [f"| {' | '.join(head)} |", "|---|--:|--:|--:|--:|--:|"]
    rates = {}
    with tempfile.TemporaryDirectory() as folder:
        for threads in (1, 2):
            execute(study(16), Path(folder) / f"warm-{threads}.zarr", engine=Threads(threads))
            began = time.perf_counter()
            store = execute(study(cases), Path(folder) / f"{threads}.zarr", engine=Threads(threads))
            rates[f"{threads} threads"] = _row(lines, f"{threads} threads", store, cases, time.perf_counter() - began)
        for workers in (1, 2):
            with Cluster.local(workers) as cluster:
                execute(study(16), Path(folder) / f"warm-processes-{workers}.zarr", block=1, engine=cluster)
                began = time.perf_counter()
                store = execute(study(cases), Path(folder) / f"processes-{workers}.zarr", engine=cluster)
                rates[f"{workers} processes"] = _row(lines, f"{workers} processes", store, cases, time.perf_counter() - began)
                if workers == 2:
                    began = time.perf_counter()
                    for _ in cluster.each(empty, range(100 if quick else TASKS)):
                        pass
                    per_task = (time.perf_counter() - began) / (100 if quick else TASKS)
    gain = [f"{kind}: {rates[f'2 {kind}'] / rates[f'1 {kind}']:.2f}" for kind in ("threads", "processes")]
    return "\n".join([*lines, "", f"Two workers against one: {', '.join(gain)}.", "", _plan(rates["1 processes"], per_task)])


def _row(lines: list[str], name: str, store: Store, cases: int, seconds: float) -> float:
    times = store.times()
    beside = 1.0 - float(times["integration_seconds"].sum()) / float(times["seconds"].sum())
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    lines.append(f"| {name} | {cases} | {seconds:.1f} | {cases / seconds:.1f} | {beside:.0%} | {memory:.0f} |")
    return cases / seconds


def _plan(rate: float, per_task: float) -> str:
    """Ten million cases on a thousand workers, from the figures above."""
    block = int(rate * BLOCK_SECONDS)
    tasks = -(-PLANNED // block)
    work = PLANNED / rate / WORKERS
    arrays = len(("A.clearance", "drive.speed", "peak_force", "contact_count", "status", "cause"))
    slower = "the workers decide" if work > tasks * per_task else "the scheduler decides"
    dispatch, size = tasks * per_task, 8 * block / 1024
    return (
        f"A plan for {PLANNED:.0e} cases on {WORKERS} workers: {tasks} blocks of {block} cases, {BLOCK_SECONDS:g} s each.\n"
        f"One task costs {1e3 * per_task:.1f} ms, all of them {dispatch:.0f} s, against {work:.0f} s of work for each worker:\n"
        f"{slower} how long it takes. Two tasks for each worker are handed out, so the scheduler holds\n"
        f"{2 * WORKERS} at a time. The store has {arrays} arrays in {arrays * tasks} files of at most {size:.1f} KiB."
    )


if __name__ == "__main__":
    number = next((int(word) for word in sys.argv[1:] if word.isdigit()), 100_000)
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else float("nan")
    text = measure(quick="--quick" in sys.argv, cases=number)
    print(text, machine(), sep="\n\n")
    if "--write" in sys.argv:
        head = "# studies\n\nWritten by `python -m benchmarks.studies --write`"
        head += "" if number == 100_000 else f", here with {number} cases (`python -m benchmarks.studies {number} --write`)"
        about = "Frictionless cases of the paper, 50 ms simulated, tolerance 1e-8, random clearance and speed."
        about += f" Load of the machine before: {load:.1f}; figures are those of an idle machine only if it is below 0.5."
        PAGE.write_text(f"{head}.\n\n{about}\n\n{text}\n\n{machine()}\n")
