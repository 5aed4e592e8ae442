"""Damage saved runs, checkpoints and studies: flipped bits, missing ends and rewritten notes."""

from __future__ import annotations

import json
import random
import sqlite3
import tempfile
import warnings
from collections.abc import Callable, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np

import scissordyn as sd
from benchmarks.attacks.report import Attack, command
from scissordyn.studies.compute.store import COMPLETE, Store
from scissordyn.studies.compute.table import digest

__all__ = ["attack"]

TRIES, QUICK_TRIES, SEED = 400, 40, 1

NOTES = ("study", "fingerprint", "columns", "block", "cases")

VALUES: tuple[Any, ...] = (None, True, -1, 0, 10**30, 1.5, "", "text", [], [1, 2], ["a"], {}, {"a": 1})

ABOUT = (
    f"Each attempt changes one place of a whole file, drawn with seed {SEED}. Survived: the file is refused in one line, or "
    "what is read of it is what was written; damaged rows of a study count as pending. Lost: other numbers, or another error."
)

Judge = Callable[[Path], str]


def flipped(content: bytes, chance: random.Random) -> bytes:
    """Return the content with one bit changed."""
    changed = bytearray(content)
    bit = chance.randrange(8 * len(content))
    changed[bit // 8] ^= 1 << bit % 8
    return bytes(changed)


def cut(content: bytes, chance: random.Random) -> bytes:
    """Return the content without its end."""
    return content[: chance.randrange(1, len(content))]


def rewritten(content: bytes, chance: random.Random) -> bytes:
    """Return a study in which one value of a note is replaced, with the right digest."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "study.db"
        path.write_bytes(content)
        with closing(sqlite3.connect(path)) as connection, connection:
            name = chance.choice(NOTES)
            note = json.loads(connection.execute("SELECT value FROM notes WHERE name = ?", (name,)).fetchone()[0])
            text = json.dumps(_replaced(note, chance))
            connection.execute("UPDATE notes SET value = ?, digest = ? WHERE name = ?", (text, digest(name, text), name))
        return path.read_bytes()


def _replaced(tree: Any, chance: random.Random) -> Any:
    """Return a tree of plain data with another value at a random position."""
    if isinstance(tree, dict | list) and tree and chance.random() < 0.8:
        place = chance.choice(list(tree) if isinstance(tree, dict) else range(len(tree)))
        tree[place] = _replaced(tree[place], chance)
        return tree
    return chance.choice(VALUES)


def judge_run(whole: Path) -> Judge:
    """Return a judge that reads a saved run."""
    expected = sd.load(whole)

    def judge(path: Path) -> str:
        return "same" if sd.load(path).identical(expected) else "other numbers"

    return judge


def judge_checkpoint(whole: Path, go_on: Callable[[Path], Any]) -> Judge:
    """Return a judge that resumes a run from a checkpoint."""
    expected = go_on(whole)["position"].values

    def judge(path: Path) -> str:
        return "same" if np.array_equal(go_on(path)["position"].values, expected) else "other numbers"

    return judge


def judge_study(whole: Path) -> Judge:
    """Return a judge that reads a study and makes its page."""
    expected = Store(whole).results()

    def judge(path: Path) -> str:
        study = sd.open_study(path)
        study.report(path.with_suffix(".html"))
        results = study.dataset
        kept = np.flatnonzero(results["status"].values == COMPLETE)
        if not set(kept) <= set(range(expected.sizes["case"])):
            return "other numbers"
        names = ("peak_force", "A.clearance")
        same = all(np.array_equal(results[name].values[kept], expected[name].values[kept]) for name in names)
        return ("same" if kept.size == expected.sizes["case"] else "rows pending") if same else "other numbers"

    return judge


def attempts(what: str, whole: Path, change: Callable[[bytes, random.Random], bytes], judge: Judge, tries: int) -> Attack:
    """Return one row of the table."""
    chance, content, results = random.Random(SEED), whole.read_bytes(), list[str]()
    path = whole.with_name(f"changed{whole.suffix}")
    for _ in range(tries):
        path.write_bytes(change(content, chance))
        try:
            results.append(judge(path))
        except sd.ScissordynError:
            results.append("refused")
        except Exception as error:
            results.append(type(error).__name__)
    counts = {result: results.count(result) for result in dict.fromkeys(results)}
    survived = sum(counts.get(result, 0) for result in ("refused", "same", "rows pending"))
    return Attack(what, tries, survived, ", ".join(f"{count} {result}" for result, count in counts.items()))


def attack(quick: bool = False) -> Sequence[Attack]:
    """Return the rows of the table."""
    warnings.simplefilter("ignore")  # warnings of a run without its checksum
    tries = QUICK_TRIES if quick else TRIES
    arm = sd.scissor(units=2).with_clearance("A", sd.Clearance(0.5e-3)).driven(speed=sd.rpm(150))
    with tempfile.TemporaryDirectory() as folder:
        run, checkpoint, study = (Path(folder) / name for name in ("run.nc", "run.checkpoint", "study.db"))
        sd.save(sd.simulate(arm, until=0.005), run)

        def go_on(path: Path) -> Any:
            return sd.simulate(arm, until=0.002, checkpoint=sd.Checkpoint(path, every=1e-3, keep=True))

        go_on(checkpoint)
        sd.study(arm, {"A.clearance": [1e-4, 2e-4, 3e-4, 4e-4]}, until=0.002, measures=["peak_force"], store=study)
        runs, checkpoints, studies = judge_run(run), judge_checkpoint(checkpoint, go_on), judge_study(study)
        return [
            attempts("saved run, one bit flipped", run, flipped, runs, tries),
            attempts("saved run, its end missing", run, cut, runs, tries),
            attempts("checkpoint, one bit flipped", checkpoint, flipped, checkpoints, tries // 4),
            attempts("checkpoint, its end missing", checkpoint, cut, checkpoints, tries // 4),
            attempts("study, one bit flipped", study, flipped, studies, tries // 4),
            attempts("study, its end missing", study, cut, studies, tries // 4),
            attempts("study, a note rewritten with the right digest", study, rewritten, studies, tries // 4),
        ]


if __name__ == "__main__":
    command("damage", "Damaged files", attack, ABOUT)
