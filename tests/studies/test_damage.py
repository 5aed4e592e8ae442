"""Damaged stores: no wrong value is shown, intact rows are kept, and the others are computed again."""

import dataclasses
import json
import os
import random
import resource
import shutil
import signal
import sqlite3
import sys
import time
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from tests.process import Duplicate

import scissordyn as sd
from scissordyn.cli.main import status_of
from scissordyn.studies.ask.description import Study
from scissordyn.studies.ask.design import Design, Factor
from scissordyn.studies.ask.requirement import Goal, Optimisation, Requirement
from scissordyn.studies.compute.execute import Block, ProgramError, execute, run_block, simulated
from scissordyn.studies.compute.optimise import optimise
from scissordyn.studies.compute.store import COMPLETE, PENDING, Store, StoreError
from scissordyn.studies.compute.table import digest
from studies.test_study import arm, rows

CASES, BLOCK = 8, 2  # Number of cases of a study, and number that is computed and stored together

FLIPS, ALL_FLIPS = 60, 2000  # Number of bits of a file that are flipped, one at a time, in every test run and in the slow tests


def study():
    """Return a study of eight clearances that all meet the requirement."""
    return Study(
        arm(),
        sd.Options(0.005),
        (Factor("A.clearance", sd.Levels(tuple(np.linspace(1e-4, 5e-4, CASES).tolist()))),),
        measures=("peak_force", "contact_count"),
        requirements=(Requirement("peak_force", "<", 1e9),),
    )


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Return a complete store."""
    path = tmp_path_factory.mktemp("whole") / "a.db"
    execute(study(), path, block=BLOCK, engine=1)
    return path


@pytest.fixture
def store(whole, tmp_path):
    """Return a copy of the complete store."""
    return Path(shutil.copy(whole, tmp_path / "a.db"))


def change(path, *commands):
    """Change a store without the program."""
    with closing(sqlite3.connect(path)) as connection, connection:
        for text in commands:
            connection.execute(text)


def resumed(store, whole, capfd):
    """Check that `resume` gives the rows of the undisturbed store."""
    assert status_of(["study", "resume", str(store), "--threads", "1"]) == 0, capfd.readouterr().err
    assert rows(store) == rows(whole)


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("""UPDATE cases SET "A.peak_force" = "A.peak_force" * 1.0000000000001 WHERE number = 5""", "not what was written"),
        ("""UPDATE cases SET "A.peak_force" = x'00' WHERE number = 5""", "not what was written"),
        ("UPDATE cases SET warnings = 'other' WHERE number = 5", "not what was written"),
        ("UPDATE cases SET status = 'complete' WHERE number = 5", "not what was written"),
        ("UPDATE cases SET number = 99 WHERE number = 5", "missing"),
        ("DELETE FROM cases WHERE number = 5", "missing"),
    ],
)
def test_changed_row(text, why, whole, store, capfd):
    """Contract: if a row is changed, its case alone is pending and reported."""
    change(store, text)
    assert status_of(["study", "status", str(store)]) == 0
    said = capfd.readouterr().out
    assert "7 complete, 0 failed, 1 pending" in said
    assert f"1 row is damaged and its case pending: 5 ({why})" in said
    assert f"scissordyn study resume {store}" in said
    broken = sd.open_study(store)
    assert f"5 ({why})" in repr(broken)
    assert "damaged" in broken._repr_html_()
    assert broken.counts == {"complete": 7, "failed": 0, "pending": 1}
    assert why in broken.report(store.parent / "r.html").read_text()
    resumed(store, whole, capfd)
    assert f"5 ({why})" in capfd.readouterr().err
    assert Store(store).damage() == {}
    assert sd.open_study(store).damage == ""


@pytest.mark.parametrize(("flips", "costs"), [(FLIPS, {0}), pytest.param(ALL_FLIPS, {0, 1}, marks=pytest.mark.slow)])
def test_flipped_bits(flips, costs, whole, store, capfd):
    """Contract: no flipped bit changes a value that is read; lost rows are reported and computed again."""
    expected, content, lost = Store(whole).results(), whole.read_bytes(), set[int]()
    chance = random.Random(1)
    for bit in chance.sample(range(8 * len(content)), flips):
        changed = bytearray(content)
        changed[bit // 8] ^= 1 << bit % 8
        store.write_bytes(changed)
        try:
            results = Store(store).results() if Store(store).exists() else None
        except (sd.InputError, StoreError) as error:  # of the description, or of the first page
            refused = str(error)
            status = status_of(["study", "status", str(store)])
            assert (status in (2, 3), "\n" in refused, capfd.readouterr().err.count("\n")) == (True, False, 1)
            continue
        assert results is not None
        good = results["status"].values == COMPLETE
        xr.testing.assert_equal(results.isel(case=good).drop_attrs(), expected.isel(case=good).drop_attrs())
        assert good.all() or "damage" in results.attrs, bit
        lost.add(int(np.sum(~good)))
        if not good.all():
            assert (execute(study(), store, engine=1).status() == COMPLETE).all(), bit
            assert rows(store) == rows(whole), bit
    assert lost >= costs


@pytest.mark.parametrize("size", [0.1, 0.5, 0.9])
def test_truncated_store(size, whole, store, capfd):
    """Contract: a truncated file gives one line, or its intact rows."""
    store.write_bytes(whole.read_bytes()[: int(size * whole.stat().st_size)])
    status = status_of(["study", "status", str(store)])
    shown = capfd.readouterr()
    assert status in (0, 2, 3)
    assert status == 0 or shown.err.count("\n") == 1


def test_unreadable_page(tmp_path):
    """Contract: only the rows of an unreadable page are pending."""
    path = tmp_path / "a.db"
    long = dataclasses.replace(
        study(), factors=(Factor("A.clearance", sd.Interval(1e-4, 5e-4, 1000)),), options=sd.Options(1e-5)
    )
    execute(long, path, engine=1, block=100)
    content, expected = bytearray(path.read_bytes()), Store(path).results()
    row_500 = b"\x83\x74"  # as SQLite writes the number
    page = next(k for k in range(4096, len(content), 4096) if content[k] == 13 and row_500 in content[k : k + 4096])
    content[page] ^= 0xFF  # the kind of the page
    path.write_bytes(content)
    results = Store(path).results()
    good = results["status"].values == COMPLETE
    assert 800 < good.sum() < 1000
    xr.testing.assert_equal(results.isel(case=good).drop_attrs(), expected.isel(case=good).drop_attrs())
    assert "cannot be read" in results.attrs["damage"]
    xr.testing.assert_equal(execute(long, path, engine=1).results(), expected)


def test_changed_description(store, capfd):
    """Contract: a changed description is refused in one line."""
    change(store, "UPDATE notes SET value = replace(value, '0.005', '0.006') WHERE name = 'study'")
    assert status_of(["study", "status", str(store)]) == 2
    said = capfd.readouterr().err
    assert said.count("\n") == 1
    assert "the note 'study' in" in said


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("study", None),
        ("study", {"design": 1}),
        ("study", [1, 2]),
        ("fingerprint", 3),
        ("columns", {"arrays": [1], "labels": {}}),
        ("columns", {"arrays": [], "labels": {}}),
        ("block", "many"),
        ("block", 0),
        ("block", 10**30),
        ("cases", -1),
        ("cases", 10**15),
    ],
)
def test_rewritten_notes(name, value, store, capfd):
    """Contract: invalid notes with a valid digest give one line with status 2."""
    text = json.dumps(value)
    with closing(sqlite3.connect(store)) as connection, connection:
        connection.execute("UPDATE notes SET value = ?, digest = ? WHERE name = ?", (text, digest(name, text), name))
    for what in ("status", "resume", "report"):
        if what != "status" or name != "fingerprint":  # by which a study is not shown, only continued
            file = ["-o", str(store.with_suffix(".html"))] if what == "report" else []
            expected = 0 if (what, name) == ("report", "fingerprint") else 2
            assert status_of(["study", what, str(store), *file]) == expected
            said = capfd.readouterr().err
            assert said.count("\n") == (expected == 2)


@pytest.mark.parametrize("command", ["resume", "retry", "extend --points 8", "refine --vary A.clearance=0.1..0.2mm -o"])
def test_read_only_folder(command, tmp_path, monkeypatch, capfd):
    """Contract: status 2 and one line, before anything is computed."""
    path, word = tmp_path / "a.db", command.split()[0]
    random_points = dataclasses.replace(
        study(), design=Design("sobol", 4), factors=(Factor("A.clearance", sd.Interval(1e-4, 5e-4)),)
    )
    execute(random_points, path, engine=1)
    monkeypatch.setattr("os.access", lambda place, mode: mode != os.W_OK or not str(place).startswith(str(tmp_path)))
    options = [*command.split()[1:], *([str(tmp_path / "b.db")] if word == "refine" else [])]
    assert status_of(["study", word, str(path), *options]) == 2
    said = capfd.readouterr().err
    assert said.count("\n") == 1
    assert f"'{tmp_path}' can only be read" in said


def test_other_files_are_refused(tmp_path):
    """Contract: a text, another database and a folder are not changed."""
    (tmp_path / "text.db").write_text("of the user" * 100)
    change(tmp_path / "other.db", "CREATE TABLE cases (number INTEGER)")
    (tmp_path / "folder.db").mkdir()
    for name in ("text.db", "other.db", "folder.db"):
        before = (tmp_path / name).read_bytes() if name != "folder.db" else b""
        with pytest.raises(sd.InputError, match="is not a study"):
            execute(study(), tmp_path / name, block=BLOCK, engine=1)
        assert name == "folder.db" or (tmp_path / name).read_bytes() == before
    assert sorted(path.name for path in tmp_path.iterdir()) == ["folder.db", "other.db", "text.db"]


def test_store_behind_a_link(tmp_path):
    """Contract: the store is at the target of a link, and continues there."""
    (tmp_path / "a.db").symlink_to(tmp_path / "b.db")
    execute(study(), tmp_path / "a.db", block=BLOCK, engine=1)
    assert (tmp_path / "a.db").is_symlink()
    assert Store(tmp_path / "b.db").exists()
    assert (execute(study(), tmp_path / "a.db", engine=1).status() == COMPLETE).all()


def test_ctrl_c_before_the_store(tmp_path, monkeypatch, capfd):
    """Contract: the message of an early Ctrl-C names a command that works."""
    import scissordyn.studies.compute.execute as module

    def stop(*_):
        raise KeyboardInterrupt

    (tmp_path / "case.toml").write_text(
        '[structure]\nkind = "scissor"\n[drive]\nspeed = "100 rpm"\n[[clearance]]\njoint = "A"\nclearance = "0.5 mm"\n'
        '[run]\nuntil = "1 ms"\n'
    )
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(module, "simulated", stop)
    sweep = ["sweep", "case.toml", "--vary", "A.clearance=0.1..0.4 mm, 2 values", "-o", "a.db", "--threads", "1"]
    assert status_of(sweep) == 130
    said = capfd.readouterr().err
    assert "nothing was computed yet; the same command starts again" in said
    assert "resume" not in said
    monkeypatch.undo()
    monkeypatch.chdir(tmp_path)
    assert status_of(sweep) == 0


def test_worker_with_another_program(monkeypatch):
    """Contract: a worker with other sources is refused in one line."""
    ours = study().fingerprint()
    monkeypatch.setattr(Study, "fingerprint", lambda _: {**ours, "program": "another"})
    with pytest.raises(ProgramError, match=r"would compute other numbers \(differs in program\); expected the same sources"):
        run_block(Block(study(), np.arange(2), fingerprint=ours))


def _hold(address):
    with Store(address).alone():
        print("held", flush=True)
        time.sleep(100)


def test_one_writer_at_a_time(whole, store):
    """Contract: a second writer is refused; readers are not affected."""
    with Duplicate(_hold, store) as other:
        assert other.stdout.readline() == "held\n"
        with pytest.raises(sd.InputError, match="is being computed by another process"), Store(store).alone():
            pass
        xr.testing.assert_equal(Store(store).results(), Store(whole).results())
        other.kill()
    with Store(store).alone():
        pass


def test_creation_by_two_processes(whole, tmp_path):
    """Contract: of two processes that find no store, the second does not replace the first's."""
    described, path = study(), tmp_path / "a.db"
    first, second = Store(path), Store(path)
    runs = simulated(described, np.array([0]))
    first.create(described, runs, BLOCK)
    with first.alone(), pytest.raises(sd.InputError, match="was made by another process meanwhile"):
        second.create(described, runs, BLOCK)
    assert [one.name for one in tmp_path.iterdir()] == ["a.db"]
    execute(described, path, engine=1)
    assert rows(path) == rows(whole)


@pytest.mark.parametrize("moment", ["fsync", "link", "unlink"])
def test_kill_during_creation(moment, whole, tmp_path):
    """Contract: at most one hidden file is left; the same command removes it and computes the study."""
    path = tmp_path / "a.db"
    with Duplicate(_die_at, path, moment) as other:
        pass
    assert other.returncode == -signal.SIGKILL
    shown, hidden = {"fsync": ([], 1), "link": ([], 1), "unlink": (["a.db"], 1)}[moment]
    assert sorted(one.name for one in tmp_path.iterdir() if not one.name.startswith(".")) == shown
    assert len([one for one in tmp_path.iterdir() if one.name.startswith(".")]) == hidden
    execute(study(), path, block=BLOCK, engine=1)
    assert [one.name for one in tmp_path.iterdir()] == ["a.db"]
    assert rows(path) == rows(whole)


def _die_at(address, moment):
    """Create a store and kill this process at a system call."""
    described = study()
    runs = simulated(described, np.array([0]))

    def die(first, *_):
        if moment == "fsync" or str(first).endswith(".part"):
            os.kill(os.getpid(), signal.SIGKILL)

    setattr(os, moment, die)
    Store(address).create(described, runs, BLOCK)


def test_killed_writer(whole, store):
    """Contract: a block is stored completely or not at all."""
    change(store, "DELETE FROM cases WHERE number >= 4", "DELETE FROM blocks WHERE number >= 2")
    before = rows(store)
    with Duplicate(_die, store) as other:
        pass
    assert other.returncode == 9
    assert (store.parent / "a.db-journal").exists()
    assert (Store(store).status() == COMPLETE).tolist() == [True] * 4 + [False] * 4
    assert rows(store) == before
    execute(study(), store, engine=1)
    assert rows(store) == rows(whole)


def _die(address):
    store = Store(address)
    with store.alone(), store._transaction() as connection:
        connection.execute("PRAGMA cache_size = 1")
        for number in range(4, 4000):  # more than are kept in memory
            connection.execute("INSERT INTO cases (number, cause) VALUES (?, ?)", (number, "x" * 100))
        os._exit(9)


@pytest.mark.skipif(sys.platform == "win32", reason="no limit of the size of a file")
def test_full_disk(whole, tmp_path):
    """Contract: the error names the store; afterwards the study continues."""
    path, soft = tmp_path / "a.db", resource.getrlimit(resource.RLIMIT_FSIZE)
    many = dataclasses.replace(
        study(), factors=(Factor("A.clearance", sd.Interval(1e-4, 5e-4, 1000)),), options=sd.Options(1e-5)
    )

    def full(progress):
        resource.setrlimit(resource.RLIMIT_FSIZE, (path.stat().st_size, soft[1]))

    try:
        with pytest.raises(StoreError, match=r"cannot be read or written: .*; completed cases are kept"):
            execute(many, path, block=100, engine=1, progress=full)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, soft)
    done = (Store(path).status() == COMPLETE).sum()
    assert 100 <= done < 1000
    assert done % 100 == 0
    assert not (execute(many, path).status() == PENDING).any()


def test_damaged_optimisation(tmp_path):
    """Contract: the row is computed again and the search ends with the same rows."""
    plain = dataclasses.replace(study(), factors=(Factor("A.clearance", sd.Interval(1e-4, 5e-4)),))
    plan = Optimisation((Goal("peak_force"),), generations=3, population=4)
    searched = dataclasses.replace(plain, optimisation=plan, design=plan.design(1, 1))
    path = tmp_path / "a.db"
    optimise(searched, path, engine=1, block=3)
    expected = rows(path)
    change(path, "DELETE FROM cases WHERE number = 4")
    assert list(Store(path).damage()) == [4]
    optimise(searched, path, engine=1, block=3)
    assert rows(path) == expected


def test_many_columns(tmp_path, monkeypatch):
    """Identity: values packed in one column equal those of separate columns."""
    narrow = execute(study(), tmp_path / "a.db", engine=1).results()
    monkeypatch.setattr("scissordyn.studies.compute.table.COLUMNS_MAX", 1)
    wide = execute(study(), tmp_path / "b.db", engine=1).results()
    xr.testing.assert_identical(wide, narrow)
