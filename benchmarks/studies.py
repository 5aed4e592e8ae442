"""Measure the cost of a study besides its integration: storage, blocks, tasks of dask, and memory.

It ends with a plan for ten million cases. With ``--folder`` the studies and their times are kept there, and the same command
continues an interrupted measurement.
"""

from __future__ import annotations

import argparse
import json
import os
import pickle
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from distributed import Client, LocalCluster, Security

import scissordyn as sd
from benchmarks.measure import machine, paragraph, table, write_section
from scissordyn.model.options import Options
from scissordyn.run.engine import Engine, Processes, outcomes, workers_of
from scissordyn.studies.ask.description import Study
from scissordyn.studies.ask.design import Design, Factor
from scissordyn.studies.ask.distribution import Interval
from scissordyn.studies.compute.execute import BUSY_FRACTION_MAX, TASK_SECONDS, Block, Progress, block_seconds, execute

__all__ = ["Measured", "measure"]

CASES = 100_000  # Cases of the study whose cost and memory are measured
FEWER = 20  # Divisor of the number of cases for comparisons of rates
TASKS = 2000  # Empty tasks that measure dask's cost and memory per task: two for each of a thousand workers

WORKERS, PLANNED = 1000, 10_000_000

MEASURES = ("peak_force", "contact_count")

MIB = 2**20


@dataclass(frozen=True)
class Measured:
    """Study that was timed.

    Parameters
    ----------
    engine : str
    cases : int
    seconds : float
        Wall-clock time [s].
    beside : float
        Fraction of the workers' time that is not integration.
    early, late : float
        Memory of this process [MiB] after a tenth of its cases and at the end.
    runs : int
        Number of runs of this program; the last one completed the study.
    """

    engine: str
    cases: int
    seconds: float
    beside: float
    early: float
    late: float
    runs: int

    @property
    def rate(self) -> float:
        """Return cases per second."""
        return self.cases / self.seconds

    @property
    def row(self) -> list[str]:
        """Return the row of the table."""
        numbers = f"{self.cases}|{self.seconds:.1f}|{self.rate:.1f}|{self.beside:.0%}|{self.early:.0f}|{self.late:.0f}"
        return [self.engine, *numbers.split("|")]


HEAD = ("engine", "cases", "seconds", "cases per second", "beside the integration", "memory at a tenth [MiB]", "at the end")


def study(cases: int) -> Study:
    """Return a study of frictionless cases of the paper over clearance and speed."""
    arm = sd.scissor(units=2).with_clearance("A", sd.Clearance(0.5e-3)).driven(speed=sd.rpm(150))
    factors = (Factor("A.clearance", Interval(0.05e-3, 0.7e-3)), Factor("drive.speed", Interval(sd.rpm(50), sd.rpm(180))))
    return Study(arm, Options(0.05), factors, Design("random", cases), MEASURES)


def empty(block: Block) -> int:
    """Return the first case of a block without computing it."""
    return int(block.cases[0])


def waiting(block: Block) -> int:
    """Run a task that waits."""
    time.sleep(30.0)
    return int(block.cases[0])


def resident() -> float:
    """Return the memory of this process [MiB]."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / MIB


@dataclass
class Spent:
    """Time and memory of a study so far, in a file beside it.

    Parameters
    ----------
    seconds : float
        Wall-clock time of all runs [s].
    early, late : float
        Memory of the last run after a tenth of its cases, and now [MiB].
    runs : int
    """

    seconds: float = 0.0
    early: float = 0.0
    late: float = 0.0
    runs: int = 0

    @classmethod
    def of(cls, file: Path) -> Spent:
        """Read the file of a study."""
        return cls(**json.loads(file.read_text())) if file.exists() else cls()


def timed(name: str, cases: int, engine: Engine, folder: Path) -> Measured:
    """Time a study after a small one that loads the kernels in every worker; an interrupted study continues."""
    address, file = folder / f"{name}.db", folder / f"{name}.json"
    spent = Spent.of(file)
    before, first, early = spent.seconds, spent.runs, False
    execute(study(8 * workers_of(engine)), folder / f"{name} warm {spent.runs}.db", block=1, engine=engine)
    began = time.perf_counter()

    def look(progress: Progress) -> None:
        nonlocal early
        spent.seconds, spent.late = before + time.perf_counter() - began, resident()
        to_do = progress.cases - progress.complete - progress.failed + progress.done_here
        if not early and progress.done_here >= 0.1 * to_do:
            early, spent.early = True, resident()
        spent.runs = first + 1
        file.write_text(json.dumps(asdict(spent)))

    store = execute(study(cases), address, engine=engine, progress=look)
    times = store.times()
    beside = 1.0 - float(times["integration_seconds"].sum()) / float(times["seconds"].sum())
    return Measured(name, cases, spent.seconds, beside, spent.early, spent.late, spent.runs)


def per_task(client: Client, tasks: int) -> tuple[float, float]:
    """Return the wall-clock time of a task and the processor time of scheduler and coordinator (this process) [s]."""
    described = study(CASES)
    blocks = (Block(described, np.arange(1000)) for _ in range(tasks))
    began, busy = time.perf_counter(), time.process_time()
    for _ in outcomes(client.get_executor(pure=False), empty, blocks):
        pass
    return (time.perf_counter() - began) / tasks, (time.process_time() - busy) / tasks


def held(client: Client, tasks: int) -> float:
    """Return the memory [MiB] of scheduler and client (this process) for tasks that wait."""
    described, before = study(CASES), resident()
    futures = [client.submit(waiting, Block(described, np.arange(1000)), pure=False) for _ in range(tasks)]
    time.sleep(2.0)  # until all tasks have arrived
    grown = resident() - before
    client.cancel(futures, force=True)
    return grown


def measure(cases: int = CASES, tasks: int = TASKS, kept: Path | None = None) -> str:
    """Return the section of the page.

    Parameters
    ----------
    cases : int
        Cases of the study on two threads.
    tasks : int
        Number of empty tasks.
    kept : Path, optional
        Folder of the studies; studies that were stopped continue there.
    """
    fewer, found = max(40, cases // FEWER), dict[str, Measured]()
    with _folder(kept) as folder:
        found["2 threads"] = timed("2 threads", cases, 2, folder)
        found["1 thread"] = timed("1 thread", fewer, 1, folder)
        for workers, title in ((1, "1 process"), (2, "2 processes")):
            with Processes(workers) as engine:
                found[title] = timed(title, fewer * workers, engine, folder)
        with _dask(2) as client:
            clock, cost = per_task(client, tasks)
        with _dask(1) as client:
            memory = held(client, tasks)
    gains = [f"{two}: {found[two].rate / found[one].rate:.2f}" for one, two in PAIRS]
    whole = found["2 threads"]
    size = len(pickle.dumps(Block(study(CASES), np.arange(1000)))) / 1024
    stopped = f" in {whole.runs} runs of the command" if whole.runs > 1 else ""
    about = paragraph(
        f"Frictionless cases of the paper: 50 ms simulated, tolerance 1e-8, random clearance and speed, {len(MEASURES)}",
        f"measures. {whole.cases} cases on two threads took {whole.seconds / 60.0:.1f} minutes{stopped},",
        f"{whole.rate:.0f} a second; the others are measured with fewer cases.",
    )
    tasked = paragraph(
        f"A task costs {1e3 * clock:.2f} ms by the clock ({tasks} tasks without work; a block is sent in {size:.0f} KiB),",
        f"{1e3 * cost:.2f} ms of it processor time of the scheduler and the coordinator, which are one process here. The",
        f"length of blocks is chosen for {1e3 * TASK_SECONDS:g} ms (`TASK_SECONDS`), with the scheduler busy",
        f"{BUSY_FRACTION_MAX:.0%} of the time: {block_seconds(1):g} s for up to {_most_workers()} workers,",
        f"{block_seconds(WORKERS):g} s for {WORKERS}.",
        f"{tasks} tasks that are held take {memory:.0f} MiB in the scheduler and the coordinator.",
    )
    gain = f"Two workers against one: {', '.join(gains)}."
    plan = _plan(found["1 process"].rate, cost, memory * 2 * WORKERS / tasks)
    return "\n\n".join([about, table(HEAD, [one.row for one in found.values()]).rstrip(), gain, tasked, plan])


PAIRS = (("1 thread", "2 threads"), ("1 process", "2 processes"))


@contextmanager
def _folder(kept: Path | None) -> Iterator[Path]:
    if kept is not None:
        kept.mkdir(parents=True, exist_ok=True)
        yield kept
        return
    with tempfile.TemporaryDirectory() as name:
        yield Path(name)


def _most_workers() -> int:
    """Return the largest number of workers for which blocks are as long as for one."""
    return int(block_seconds(1) * BUSY_FRACTION_MAX / TASK_SECONDS)


@contextmanager
def _dask(workers: int) -> Iterator[Client]:
    """Start a scheduler in this process and dask workers, protected like those of a queueing system."""
    own = Security.temporary()
    with (
        LocalCluster(workers, threads_per_worker=1, security=own, dashboard_address="127.0.0.1:0") as scheduler,
        Client(scheduler, set_as_default=False) as client,
    ):
        yield client


def _plan(rate: float, cost: float, memory: float) -> str:
    """Return the plan for ten million cases on a thousand workers, from the figures above."""
    seconds = block_seconds(WORKERS)
    block = max(1, int(rate * seconds))
    tasks = -(-PLANNED // block)
    work, dispatch = PLANNED / rate / WORKERS, tasks * cost
    slower = "the workers decide" if work > dispatch else "the scheduler decides"
    return paragraph(
        f"A plan for {PLANNED:.0e} cases on {WORKERS} workers: {tasks} tasks, blocks of {block} cases, {seconds:g} s",
        f"each. Handing out all of them takes the scheduler {dispatch:.0f} s, the work of each worker is {work:.0f} s:",
        f"{slower} how long it takes. Two tasks for each worker are handed out at a time, {2 * WORKERS} in all:",
        f"{memory:.0f} MiB in the scheduler and the coordinator, however many cases there are.",
    )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true", help="save the section in docs/decisions/measured/studies.md")
    parser.add_argument("--cases", type=int, default=CASES)
    parser.add_argument("--folder", type=Path, help="keep the studies there; the same command goes on")
    given = parser.parse_args()
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else float("nan")
    idle = f"Load before: {load:.1f}; the figures are those of an idle machine if it is below 0.5."
    text = f"{measure(given.cases, kept=given.folder)}\n\n{machine()}\n\n{idle}\n"
    print(text)
    if given.write:
        also = "" if given.cases == CASES else f" --cases {given.cases}"
        write_section("studies", "Cost", f"python -m benchmarks.studies{also} --write", text)
