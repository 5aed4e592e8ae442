"""Kill a study with -9 at random moments, resume it, and compare its rows and the blocks computed twice."""

from __future__ import annotations

import argparse
import random
import re
import socket
import sqlite3
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.measure import machine, paragraph, table, write_section
from scissordyn.cli.option import NO_TLS_WARNING
from scissordyn.studies.compute.store import COMPLETE, Store

__all__ = ["Kill", "killed_at_random", "measure"]

VICTIMS = ("coordinator", "worker", "scheduler")

KILLS, SEED = 20, 1

BLOCK = 5  # Cases of a block: a fifth of a second of work

CASES = 300

AHEAD, WAIT = 6, 0.3  # The victim is killed after at most this many more blocks and this many seconds

SWEEP = (
    *("sweep", str(Path(__file__).parents[1] / "examples" / "paper.toml"), "--set", "run.until=20 ms"),
    *("--vary", "A.clearance=0.1..0.5 mm, 20 values", "--vary", "drive.speed=100..200 rpm, 15 values", "--block", str(BLOCK)),
)


@dataclass(frozen=True)
class Kill:
    """One kill and its effect on the study.

    Parameters
    ----------
    victim : {"coordinator", "worker", "scheduler"}
    finished : int
        Blocks that were complete before this run of the coordinator.
    rewritten : int
        Number of these blocks that were written again.
    done : int
        Blocks that are complete after it.
    status : int
        Exit status of the coordinator.
    lines : tuple of str
        Lines of stderr besides the progress.
    same : bool or None
        Whether all rows equal those of the undisturbed run, once the study is complete.
    """

    victim: str
    finished: int
    rewritten: int
    done: int
    status: int
    lines: tuple[str, ...]
    same: bool | None


def killed_at_random(folder: Path, kills: int = KILLS, seed: int = SEED) -> list[Kill]:
    """Kill the coordinator, a worker and the scheduler in turn, and resume the study after each kill.

    Scheduler and workers are separate processes, as on other machines; the coordinator is the command line. A complete study is
    compared with the undisturbed one and restarted.

    Parameters
    ----------
    folder : Path
        Empty.
    kills : int
    seed : int
        Seed of the moments.

    Returns
    -------
    list of Kill
        Kills in order; the last entry has no victim, since the study is resumed and not disturbed.
    """
    whole, store = folder / "whole.db", folder / "killed.db"
    _ended(_command(*SWEEP, "-o", str(whole), "--threads", "1"))
    expected = _rows(whole)
    moments, found = random.Random(seed), list[Kill]()
    for number in range(kills + 1):
        victim = VICTIMS[number % len(VICTIMS)] if number < kills else ""
        if victim and found and found[-1].same is not None:
            store.unlink()
        finished = _finished(store)
        port = _free_port()
        with _dask(port, folder) as processes:
            coordinator = _command(*SWEEP, "-o", str(store), "--scheduler", f"tcp://127.0.0.1:{port}")
            if victim:
                _let_work(coordinator, store, moments)
                (coordinator if victim == "coordinator" else processes[victim]).kill()
            status, lines = _ended(coordinator)
        now = _finished(store)
        rewritten = sum(now.get(block) != times for block, times in finished.items())
        complete = bool(np.all(Store(store).status() == COMPLETE)) if store.exists() else False
        same = _rows(store) == expected if complete else None
        found.append(Kill(victim, len(finished), rewritten, len(now), status, lines, same))
    return found


def _let_work(coordinator: subprocess.Popen[str], store: Path, moments: random.Random) -> None:
    """Wait until a random moment at which the coordinator works."""
    wanted = len(_finished(store)) + moments.randint(1, AHEAD)
    _wait_for(lambda: len(_finished(store)) >= wanted or coordinator.poll() is not None)
    time.sleep(moments.uniform(0.0, WAIT))


def _finished(store: Path) -> dict[int, float]:
    """Return how often each complete block was written."""
    if not Store(store).has_content():
        return {}
    attempts = Store(store).times()["attempts"]
    return {int(block): float(attempts[block]) for block in np.flatnonzero(attempts)}


def _rows(store: Path) -> list[tuple[object, ...]]:
    """Return all rows of cases."""
    with closing(sqlite3.connect(store)) as connection:
        return connection.execute("SELECT * FROM cases ORDER BY number").fetchall()


def _command(*arguments: str) -> subprocess.Popen[str]:
    """Start the command line in its own process group."""
    command = [sys.executable, "-m", "scissordyn.cli.main", *arguments]
    return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, start_new_session=True)


def _ended(process: subprocess.Popen[str]) -> tuple[int, tuple[str, ...]]:
    """Return exit status and lines of stderr, without those about progress and connections, which depend on the machine."""
    lines = process.communicate(timeout=600)[1].splitlines()
    return process.returncode, tuple(one for one in lines if one != NO_TLS_WARNING and not re.match(r"\d+ of \d+ cases, ", one))


def _wait_for(condition: Callable[[], bool], seconds: float = 300.0) -> None:
    until = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > until:
            raise TimeoutError(f"nothing within {seconds:g} s")
        time.sleep(0.02)


def _free_port() -> int:
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return int(one.getsockname()[1])


def _answers(port: int) -> bool:
    with socket.socket() as one:
        return one.connect_ex(("127.0.0.1", port)) == 0


@contextmanager
def _dask(port: int, folder: Path) -> Iterator[dict[str, subprocess.Popen[bytes]]]:
    """Start a scheduler and two workers, as on two machines."""
    dask, address = [sys.executable, "-m", "dask"], f"tcp://127.0.0.1:{port}"
    worker = [*dask, "worker", address, "--nthreads", "1", "--no-dashboard", "--no-nanny"]
    commands = {
        "scheduler": [*dask, "scheduler", "--host", "127.0.0.1", "--port", str(port), "--no-dashboard"],
        "worker": worker,
        "other worker": worker,
    }
    running = {
        name: subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, cwd=folder)
        for name, command in commands.items()
    }
    try:
        _wait_for(lambda: _answers(port))
        yield running
    finally:
        for process in running.values():
            process.kill()
            process.wait()


def measure(kills: int = KILLS) -> str:
    """Return the section of the page."""
    with tempfile.TemporaryDirectory() as folder:
        found = killed_at_random(Path(folder), kills)
    rows = []
    for victim in (*VICTIMS, ""):
        own = [kill for kill in found if kill.victim == victim]
        whole = [kill.same for kill in own if kill.same is not None]
        rows.append(
            [
                victim or "none, at the end",
                str(len(own)) if victim else "0",
                str(sum(kill.finished for kill in own)),
                str(sum(kill.rewritten for kill in own)),
                f"{sum(whole)} of {len(whole)}",
                ", ".join(sorted({str(kill.status) for kill in own})),
            ]
        )
    head = ("killed", "times", "blocks complete before", "written again", "whole studies with the same rows", "exit status")
    about = paragraph(
        f"{kills} kills with -9 at random moments (seed {SEED}) of a study of {CASES} cases in {CASES // BLOCK} blocks, with a",
        "scheduler and two workers as processes of their own. After each the same command takes the study up; a study that is",
        "complete is compared with an undisturbed one, row by row, and begun anew.",
        "`tests/studies/test_cluster.py` is the same as a test.",
    )
    return f"{about}\n\n{table(head, rows)}"


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true", help="save the section in docs/decisions/measured/studies.md")
    parser.add_argument("--kills", type=int, default=KILLS)
    given = parser.parse_args()
    text = f"{measure(given.kills)}\n{machine()}\n"
    print(text)
    if given.write:
        write_section("studies", "Kills", "python -m benchmarks.study_kills --write", text)
