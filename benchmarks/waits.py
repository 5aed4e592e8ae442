"""Measure how long a user waits, of this version and of another one that is measured in turn.

``python -m benchmarks.waits --beside FOLDER --write`` alternates with a checkout of another version, which has its own `.venv`.
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from benchmarks.measure import command, paragraph, table
from benchmarks.start_up import process

ROUNDS, MANY_ROUNDS = 7, 3  # Numbers of rounds: of runs and commands, and of `simulate_many`

HERE = Path(__file__).parent.parent

TEXT = """Whole runs by `sd.simulate`, and the compiled loop alone in parentheses: medians of {rounds} rounds in which processes
of the versions alternate, each the median of up to 15 runs after a short one. Versions are named by their date.
Steps: accepted and rejected. Slider-crank: `flores-slider-crank` of the zoo at the tolerance at which its orbit has
an error of 0.1 % of the clearance (../../validation.md). Array: `examples/paper.toml` without friction. Lift:
`examples/lift.toml`, 0.05 mm at all nine pins, restitution 0.9, kinetic coefficient 0.12, rtol = 1e-5."""

LOOSE = '[{ joint = "all", clearance = "0.05 mm", restitution = 0.9, friction = %s }]'
"""Clearance at all pins of the lift, with a friction law."""

NONE, LAW = '{ law = "none" }', '{ law = "%s", kinetic = 0.12 }'


@dataclass(frozen=True)
class Whole:
    """Run of a case by `sd.simulate`, or many of them by `sd.simulate_many`.

    Parameters
    ----------
    name : str
        Name of the row.
    case : str
        Case file, from the root of the checkout; "" for the slider-crank of the zoo.
    goal : str
        Goal of the whole run [ms], or of the rate.
    changes : sequence of str
        Changes of the case.
    options : mapping
        Options of `simulate` or `simulate_many`.
    runs : int
        Number of runs in each round, of which the median counts; with `simulate_many` the number of cases.
    """

    name: str
    case: str
    goal: str
    changes: Sequence[str] = ()
    options: Mapping[str, object] = field(default_factory=dict)
    runs: int = 15


FRICTIONLESS = 'clearance.A.friction="none"'
TUBES = 'structure.bars={ section = "tube 60x60x1.56 mm", material = "steel"%s }'
SHORT = {"until": 0.03}
UNDER_LOAD = {"until": 0.3, "rtol": 1e-5}
PAPER, LIFT = "examples/paper.toml", "examples/lift.toml"

WHOLE = (
    Whole("slider-crank, one revolution", "", "4.5", (), {"until": 0.012, "rtol": 1.5e-7, "atol": 1.5e-7}),
    Whole("array, 30 ms", PAPER, "2.8", (FRICTIONLESS,), SHORT),
    Whole("array, bars of 2 modes", PAPER, "28", (FRICTIONLESS, TUBES % ", modes = 2"), SHORT, 7),
    Whole("array, bars of default modes", PAPER, "55", (FRICTIONLESS, TUBES % ""), SHORT, 5),
    Whole("lift under load, no friction", LIFT, "80", (f"clearance={LOOSE % NONE}",), UNDER_LOAD, 3),
    Whole("lift under load, Ambrosio", LIFT, "300", (f"clearance={LOOSE % LAW % 'ambrosio'}",), UNDER_LOAD, 1),
    Whole("lift under load, LuGre", LIFT, "1200", (f"clearance={LOOSE % LAW % 'lugre'}",), UNDER_LOAD, 1),
)

FORCES = ("peak_force", "peak_drive_torque")
MANY = (
    Whole(
        "2 ms, contacts counted", PAPER, "1.5 times", (FRICTIONLESS,), {"until": 0.002, "measures": ("contact_count",)}, 2000
    ),
    Whole("2 ms, largest forces", PAPER, "1.5 times", (FRICTIONLESS,), {"until": 0.002, "measures": FORCES}, 2000),
    Whole("30 ms, contacts counted", PAPER, "1.5 times", (FRICTIONLESS,), {"until": 0.03, "measures": ("contact_count",)}, 400),
    Whole("30 ms, largest forces", PAPER, "1.5 times", (FRICTIONLESS,), {"until": 0.03, "measures": FORCES}, 400),
)

COMMANDS = {
    "--help": (("--help",), ""),
    "run": (("run", PAPER), "0.4"),
    "run -o": (("run", PAPER, "-o", "{folder}/run.nc"), "0.5"),
    "run --plot": (("run", PAPER, "--plot", "{folder}/pictures"), "1.3; 200 MB"),
    "sweep": (("sweep", PAPER, "--vary", "A.clearance=0.05..0.4 mm, 120 values", "-o", "{folder}/sweep.db"), ""),
}
"""Arguments of `scissordyn`, and goals [s]."""

PROGRAM = """
import json, statistics, sys, time
import numpy as np
import scissordyn as sd

case, changes, options, runs, many = json.loads(sys.argv[1])
read = sd.read_case(case or sd.zoo["flores-slider-crank"].case_file, changes)
if many:
    over = {"A.clearance": np.linspace(5e-5, 5e-4, runs), "drive.speed": np.linspace(10.0, 25.0, runs)}
    for cases in (64, runs):
        began = time.perf_counter()
        sd.simulate_many(
            read.mechanism,
            {path: values[:cases] for path, values in over.items()},
            threads=2,
            **options,
        )
    print(json.dumps([runs / (time.perf_counter() - began), 0, 0]))
    sys.exit()
whole, loop = [], []
for turn in range(runs + 1):
    given = {**vars(read.run), "trust": False, **options}
    if not turn:  # the first run imports modules
        given["until"] = min(given["until"], 1e-3)
    began = time.perf_counter()
    run = sd.simulate(read.mechanism, **given)
    seconds = time.perf_counter() - began
    if run.attrs["status"] != "complete":
        sys.exit(f"{case}: {run.attrs['status']}")
    found = json.loads(run.attrs["statistics"])
    if turn:
        whole.append(1e3 * seconds)
        loop.append(1e3 * found["seconds"])
print(json.dumps([statistics.median(whole), statistics.median(loop), found["steps"] + found["rejected"]]))
"""
"""Program that each version runs: print time of the whole [ms] and of the loop, and steps; or cases per second."""


def _in_process(folder: Path, one: Whole, *, many: bool) -> list[float]:
    given = json.dumps([one.case, one.changes, one.options, one.runs, many])
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run(
        [folder / ".venv/bin/python", "-c", PROGRAM, given],
        cwd=folder, env=environment, capture_output=True, text=True, check=False,
    )  # fmt: skip
    if done.returncode:
        raise RuntimeError(f"{one.name} in {folder}: {done.stderr}")
    return [float(number) for number in json.loads(done.stdout)]


def _command(folder: Path, arguments: Sequence[str]) -> list[float]:
    """Return wall-clock time [s] and memory [MB] of a command."""
    with tempfile.TemporaryDirectory() as written:
        words = (str(folder / PAPER) if word == PAPER else word.format(folder=written) for word in arguments)
        typed = ("-m", "scissordyn.cli.main", *words)
        used = process(typed, {}, str(folder / ".venv/bin/python"))
    return [used.wall, used.memory]


def _medians(folders: Sequence[Path], measured: Callable[[Path], list[float]], rounds: int) -> list[list[float]]:
    """Return the medians of all numbers of each version; the versions alternate."""
    found: list[list[list[float]]] = [[] for _ in folders]
    for _ in range(rounds):
        for kept, folder in zip(found, folders, strict=True):
            kept.append(measured(folder))
    return [[statistics.median(numbers) for numbers in zip(*kept, strict=True)] for kept in found]


def measure(quick: bool = False, beside: Sequence[Path] = ()) -> str:
    """Return the tables of the versions in the folders `beside` and of this one."""
    folders, rounds, many_rounds = [*beside, HERE], *((1, 1) if quick else (ROUNDS, MANY_ROUNDS))
    versions = [_version(folder) for folder in folders]
    runs, commands, many = [], [], []
    for one in WHOLE:
        numbers = _medians(folders, partial(_in_process, one=one, many=False), rounds)
        times = [f"{whole:.3g} ({loop:.3g})" for whole, loop, _ in numbers]
        runs.append([one.name, *times, one.goal, *(f"{steps:.0f}" for _, _, steps in numbers)])
    for name, (arguments, goal) in COMMANDS.items():
        numbers = _medians(folders, partial(_command, arguments=arguments), rounds)
        commands.append([name, *(f"{wall:.2f} ({memory:.0f})" for wall, memory in numbers), goal])
    for one in MANY:
        numbers = _medians(folders, partial(_in_process, one=one, many=True), many_rounds)
        many.append([one.name, *(f"{rate:.0f}" for rate, *_ in numbers), one.goal])
    return "\n".join(
        (
            paragraph(TEXT.format(rounds=rounds)) + "\n",
            table(["run", *(f"{name} [ms]" for name in versions), "goal", *(f"{name}: steps" for name in versions)], runs),
            "`scissordyn`, with `examples/paper.toml`, and a sweep of 120 clearances: time, and memory in parentheses.\n",
            table(["command", *(f"{name} [s] ([MB])" for name in versions), "goal"], commands),
            f"`simulate_many` of the paper's array on two processors, clearance and speed varied: medians of {many_rounds}.\n",
            table(["cases", *(f"{name} [1/s]" for name in versions), "goal"], many),
        )
    )


def _version(folder: Path) -> str:
    """Return the date of a checkout's last commit."""
    asked = ["git", "-C", str(folder), "log", "-1", "--format=%cs"]
    return subprocess.run(asked, capture_output=True, text=True, check=True).stdout.strip()


if __name__ == "__main__":
    help_text = "a checkout of another version, with .venv; repeatable"
    beside = {"type": Path, "action": "append", "default": [], "metavar": "FOLDER", "help": help_text}
    command("waits", measure, {"--beside": beside})
