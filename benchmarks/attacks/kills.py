"""Kill at random moments: a study, its workers and its scheduler, and the command while it creates the study."""

from __future__ import annotations

import random
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from benchmarks.attacks.report import Attack, command
from benchmarks.study_kills import SWEEP, VICTIMS, killed_at_random
from scissordyn.studies.compute.store import COMPLETE, Store

__all__ = ["attack"]

KILLS, QUICK_KILLS, SEED = 6, 3, 1

CREATIONS, QUICK_CREATIONS = 8, 4

BEGINNING = (2.0, 6.0)  # Range of kill times of the command that creates a study [s]: imports take some seconds

ABOUT = (
    "Each process is killed with -9. Survived: the same command completes the study afterwards, with the rows of an "
    f"undisturbed one and no block written twice, and no file is left but the study. Moments are drawn with seed {SEED}."
)


def during(kills: int) -> list[Attack]:
    """Return the results of kills while blocks are computed."""
    with tempfile.TemporaryDirectory() as folder:
        found = killed_at_random(Path(folder), kills, SEED)
    rows = []
    for victim in VICTIMS:
        own = [kill for kill in found if kill.victim == victim]
        survived = sum(kill.rewritten == 0 and kill.same in (None, True) for kill in own)
        statuses = ", ".join(sorted({str(kill.status) for kill in own}))
        rows.append(Attack(f"kill of the {victim} of a study", len(own), survived, f"exit status {statuses}"))
    return rows


def creating(kills: int) -> Attack:
    """Return the results of kills while the study is created."""
    chance, survived, left = random.Random(SEED), 0, 0
    for _ in range(kills):
        with tempfile.TemporaryDirectory() as folder:
            store = Path(folder) / "study.db"
            typed = [sys.executable, "-m", "scissordyn.cli.main", *SWEEP, "--set", "run.until=1 ms", "-o", str(store)]
            quiet = subprocess.DEVNULL
            process = subprocess.Popen(typed, stdout=quiet, stderr=quiet)
            time.sleep(chance.uniform(*BEGINNING))
            process.send_signal(signal.SIGKILL)
            process.wait()
            left += any(not path.name.startswith((".", "study.db")) for path in Path(folder).iterdir())
            again = subprocess.run(typed, stdout=quiet, stderr=quiet, check=False).returncode
            whole = again == 0 and bool((Store(store).status() == COMPLETE).all())
            survived += whole and [path.name for path in Path(folder).iterdir()] == ["study.db"]
    return Attack("kill of the command while it creates the study", kills, survived, f"files of other names left: {left}")


def attack(quick: bool = False) -> Sequence[Attack]:
    """Return the rows of the table."""
    return [creating(QUICK_CREATIONS if quick else CREATIONS), *during(QUICK_KILLS if quick else KILLS)]


if __name__ == "__main__":
    command("kills", "Kills", attack, ABOUT)
