"""Measure time and memory of whole processes: the first run after an installation, later runs, imports."""

from __future__ import annotations

import compileall
import os
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import scissordyn
from benchmarks.measure import command, table
from scissordyn.kernel import library

CASE = Path(__file__).parent.parent / "examples" / "paper.toml"
FIRST, LATER, IMPORT, MEMORY = 1.5, 0.6, 0.4, 130.0  # Targets: first run, later runs and imports [s], memory [MB]


@dataclass(frozen=True)
class Process:
    """Time and memory of a process.

    Parameters
    ----------
    wall, user : float
        Wall clock and processor time [s].
    memory : float
        Largest resident set [MB].
    """

    wall: float
    user: float
    memory: float


LAUNCHER = """
import os, sys, time
began = time.perf_counter()
child = os.posix_spawn(sys.executable, [sys.executable, *sys.argv[1:]], os.environ,
                       file_actions=[(os.POSIX_SPAWN_OPEN, 1, os.devnull, os.O_WRONLY, 0)])
_, status, used = os.wait4(child, 0)
print(time.perf_counter() - began, used.ru_utime, used.ru_maxrss, os.waitstatus_to_exitcode(status))
"""
"""Program that starts and measures another; it is small, since a child's memory would include that of its parent."""


def process(arguments: Sequence[str], environment: Mapping[str, str], python: str = sys.executable) -> Process:
    """Run Python with these arguments, and measure it."""
    launch = [python, "-I", "-S", "-c", LAUNCHER, *arguments]
    inherited = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    done = subprocess.run(launch, env={**inherited, **environment}, capture_output=True, text=True, check=True)
    wall, user, memory, status = done.stdout.split()
    if int(status):
        raise RuntimeError(f"{' '.join(arguments)} ended with {status}: {done.stderr}")
    # Linux counts in KiB, macOS in bytes
    unit = 1024.0 if sys.platform != "darwin" else 1.0
    return Process(float(wall), float(user), float(memory) * unit / 1e6)


def _median(processes: Sequence[Process]) -> Process:
    return Process(*(statistics.median(getattr(one, name) for one in processes) for name in ("wall", "user", "memory")))


def measure(quick: bool = False) -> str:
    """Return the table of first and later runs and of imports."""
    run = ("-m", "scissordyn.cli.main", "run", str(CASE))
    library()  # compile kernels that have changed in this checkout
    compileall.compile_dir(Path(scissordyn.__file__).parent, quiet=1)  # like pip on installation
    with tempfile.TemporaryDirectory() as folder:
        saved = (*run, "-o", str(Path(folder) / "run.nc"))
        named = {
            "first scissordyn run of a user": (run, FIRST),
            "scissordyn run": (run, LATER),
            "scissordyn run -o run.nc": (saved, LATER),
            "import scissordyn": (("-c", "import scissordyn"), None),
            "import what simulate needs": (("-c", "from scissordyn import simulate"), IMPORT),
            "python alone": (("-c", "pass"), None),
        }
        found: dict[str, list[Process]] = {name: [] for name in named}
        for turn in range(3 if quick else 7):
            for name, (arguments, _) in named.items():
                # a user without settings or caches of matplotlib and others
                home = {"HOME": str(Path(folder) / str(turn)), "XDG_CACHE_HOME": "", "XDG_CONFIG_HOME": ""}
                found[name].append(process(arguments, home if "first" in name else {}))
    rows = [_row(name, _median(found[name]), target) for name, (_, target) in named.items()]
    head = ["process", "wall [s]", "target [s]", "user CPU [s]", "memory [MB]", "target [MB]"]
    return "`examples/paper.toml`, medians of interleaved processes, each with all that it starts.\n\n" + table(head, rows)


def _row(name: str, used: Process, target: float | None) -> list[str]:
    wall = _verdict(used.wall, target)
    memory = _verdict(used.memory, None if target is None else MEMORY)
    return [name, f"{used.wall:.2f}", wall, f"{used.user:.2f}", f"{used.memory:.0f}", memory]


def _verdict(value: float, target: float | None) -> str:
    return "" if target is None else f"{target:g}: {'met' if value <= target else 'missed'}"


if __name__ == "__main__":
    command("start_up", measure)
