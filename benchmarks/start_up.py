"""What the first run on a machine costs, and what every later process costs before it computes."""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from benchmarks.measure import command, table

CASE = Path(__file__).parent.parent / "examples" / "paper.toml"
FIRST, LATER, MEMORY = 60.0, 1.5, 400.0
"""Targets: first run and later runs [s], memory [MB]."""


@dataclass(frozen=True)
class Process:
    """What a process used.

    Parameters
    ----------
    wall, user : float
        [s]
    memory : float
        Largest resident set [MB].
    """

    wall: float
    user: float
    memory: float


def _process(arguments: Sequence[str], environment: Mapping[str, str]) -> Process:
    began = time.perf_counter()
    child = subprocess.Popen([sys.executable, *arguments], env={**os.environ, **environment}, stdout=subprocess.DEVNULL)
    _, status, used = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    if child.returncode:
        raise RuntimeError(f"{' '.join(arguments)} ended with {child.returncode}")
    # Linux counts in KiB, macOS in bytes
    unit = 1024.0 if sys.platform != "darwin" else 1.0
    return Process(time.perf_counter() - began, used.ru_utime, used.ru_maxrss * unit / 1e6)


def _median(processes: Sequence[Process]) -> Process:
    return Process(*(statistics.median(getattr(one, name) for one in processes) for name in ("wall", "user", "memory")))


def measure(quick: bool = False) -> str:
    """First and later runs, and imports."""
    run = ("-m", "scissordyn.cli.main", "run", str(CASE))
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        environment = {"SCISSORDYN_CACHE": folder}
        if not quick:
            first = _process(run, environment)
            rows.append(_row("first run, nothing compiled yet", first, FIRST))
        _process(run, environment if not quick else {})
        saved = (*run, "-o", str(Path(folder) / "run.nc"))
        shared = {} if quick else environment
        named = {
            "scissordyn run": (run, LATER),
            "scissordyn run -o run.nc": (saved, LATER),
            "import scissordyn": (("-c", "import scissordyn"), None),
            "import what simulate needs": (("-c", "from scissordyn import simulate"), None),
            "python alone": (("-c", "pass"), None),
        }
        found: dict[str, list[Process]] = {name: [] for name in named}
        for _ in range(3 if quick else 5):
            for name, (arguments, _) in named.items():
                found[name].append(_process(arguments, shared))
        rows += [_row(name, _median(found[name]), target) for name, (_, target) in named.items()]
    head = ["process", "wall [s]", "target [s]", "user CPU [s]", f"memory [MB], target {MEMORY:g}"]
    return "`examples/paper.toml`, medians of interleaved processes (the first run: one).\n\n" + table(head, rows)


def _row(name: str, used: Process, target: float | None) -> list[str]:
    verdict = "" if target is None else f"{target:g}: {'met' if used.wall <= target else 'missed'}"
    return [name, f"{used.wall:.2f}", verdict, f"{used.user:.2f}", f"{used.memory:.0f}"]


if __name__ == "__main__":
    command("start_up", measure)
