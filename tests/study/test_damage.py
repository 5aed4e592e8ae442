"""Damaged stores: nothing wrong is shown, what is whole is kept, the rest is computed anew."""

from __future__ import annotations

import dataclasses
import multiprocessing
import os
import random
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from tampering import tampered

import scissordyn as sd
from scissordyn.cli.main import status_of
from scissordyn.run.options import Options
from scissordyn.study.block import Block, ProgramError, run_block
from scissordyn.study.description import Factor, Study
from scissordyn.study.distribution import Levels
from scissordyn.study.engine import Threads
from scissordyn.study.execute import execute
from scissordyn.study.optimise import optimise
from scissordyn.study.requirement import Requirement
from scissordyn.study.store import COMPLETE, PENDING, Store

QUICK, ALL, PART = 25, 1000, 250
COMMANDS = ("status", "resume", "retry", "export", "replay", "report", "extend")
WEIGHTS = (6, 6, 3, 4, 3, 1, 1)
"""A report draws for a second."""

CASES, BLOCK = 8, 2


def study() -> Study:
    """Eight clearances, of which all meet the requirement."""
    arm = sd.scissor(units=2).with_clearance("A", sd.Clearance(0.5e-3)).driven(speed=sd.rpm(150))
    return Study(
        arm,
        Options(0.005),
        (Factor("A.clearance", Levels(tuple(np.linspace(1e-4, 5e-4, CASES).tolist()))),),
        measures=("peak_force", "contact_count"),
        requirements=(Requirement("peak_force", "<", 1e9),),
    )


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A store that is complete."""
    path = tmp_path_factory.mktemp("whole") / "a.db"
    execute(study(), path, block=BLOCK, engine=Threads(1))
    return path


@pytest.fixture
def store(whole: Path, tmp_path: Path) -> Path:
    """A copy of it."""
    return Path(shutil.copytree(whole, tmp_path / "a.db"))


def arrays(folder: Path) -> dict[str, bytes]:
    """All files but the times, the lock and what was moved aside or is left of a killed writer."""
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and not ("timing" in path.parts or path.name == "lock" or "aside" in str(path.relative_to(folder)))
    }


def resumed(store: Path, whole: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """After one `resume` the store has the bytes of the undisturbed one."""
    assert status_of(["study", "resume", str(store), "--threads", "1"]) == 0, capfd.readouterr().err
    assert arrays(store) == arrays(whole)


def test_a_block_that_is_gone_is_named_and_computed_anew(whole: Path, store: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """Identity: of an interrupted copy nothing is counted that is not there."""
    shutil.rmtree(store / "peak_force" / "c" / "2")
    assert status_of(["study", "status", str(store)]) == 0
    said = capfd.readouterr().out
    assert "6 complete, 0 failed, 2 pending" in said
    assert "1 block is damaged or not whole, and pending: 2 (cases 4 to 5: peak_force is missing)" in said
    assert f"scissordyn study resume {store}" in said
    assert status_of(["study", "report", str(store), "-o", str(store.parent / "r.html")]) == 0
    assert "peak_force is missing" in (store.parent / "r.html").read_text()
    assert "100.0%" in capfd.readouterr().out
    resumed(store, whole, capfd)
    assert Store(store).damage() == {}


@pytest.mark.parametrize("name", ["peak_force/c/1/0", "status/c/1", "A.clearance/c/1", "record/seals/1.json"])
def test_every_bit_of_a_chunk_counts(whole: Path, store: Path, name: str) -> None:
    """Identity: whichever bit is flipped, no other number is read: the block is whole, or pending."""
    expected, path = Store(whole).results(), store / name
    content = path.read_bytes()
    chance = random.Random(1)
    for bit in chance.sample(range(8 * len(content)), min(25, 8 * len(content))):
        changed = bytearray(content)
        changed[bit // 8] ^= 1 << bit % 8
        path.write_bytes(changed)
        assert list(Store(store).damage()) == [1], bit
        found = Store(store).results()
        assert found["status"].values.tolist() == [COMPLETE] * 2 + [PENDING] * 2 + [COMPLETE] * 4
        good = found["status"].values == COMPLETE
        xr.testing.assert_equal(found.isel(case=good).drop_attrs(), expected.isel(case=good).drop_attrs())


def test_other_readers_see_the_checksums(store: Path) -> None:
    """Identity: xarray refuses a chunk with a flipped bit."""
    path = store / "peak_force" / "c" / "1" / "0"
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)
    with pytest.raises(ValueError, match="checksum"):
        xr.open_zarr(store).load()


def descriptions(whole: Path) -> list[str]:
    """All files of a store that are no block's."""
    found = [path for path in whole.rglob("*") if path.is_file() and path.name != "lock"]
    names = [path.relative_to(whole).as_posix() for path in found]
    return [name for name in names if name.endswith("zarr.json") or "description" in name or name.startswith("joint/c")]


@pytest.mark.parametrize("fault", ["deleted", "cut", "folder"])
def test_no_description_locks_a_study(whole: Path, tmp_path: Path, fault: str, capfd: pytest.CaptureFixture[str]) -> None:
    """Identity: each of them is restored from its copy, and said so."""
    names = descriptions(whole)
    assert len(names) > 8
    for name in names:
        store = tmp_path / "a.db"
        shutil.copytree(whole, store)
        path = store / name
        content = path.read_bytes()
        path.unlink()
        if fault == "cut":
            path.write_bytes(content[: len(content) // 2])
        elif fault == "folder":
            path.mkdir()
        assert status_of(["study", "status", str(store)]) == 0, (name, capfd.readouterr())
        shown = capfd.readouterr()
        assert f"restored from its copy in '{store}': {name}" in shown.err
        assert f"{CASES} complete" in shown.out
        assert arrays(store) == arrays(whole), name
        shutil.rmtree(store)


def test_a_store_of_an_earlier_format_is_refused(store: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """Identity: one line that names what reads it."""
    shutil.rmtree(store / "record")
    text = (store / "zarr.json").read_text()
    (store / "zarr.json").write_text(text.replace('"format": 2,', "", 1))
    assert status_of(["study", "status", str(store)]) == 2
    said = capfd.readouterr().err
    assert said.count("\n") == 1
    assert "a store of format 1, which has no checksums" in said


def told(capfd: pytest.CaptureFixture[str], store: Path, chance: random.Random) -> tuple[int, str]:
    """Status of a random command on a store, whose last line on stderr is its only complaint."""
    what = chance.choices(COMMANDS, WEIGHTS)[0]
    options: dict[str, list[str]] = {
        "resume": ["--threads", "1"],
        "retry": ["--threads", "1"],
        "export": ["-o", str(store.parent / "t.csv")],
        "replay": [str(chance.randrange(CASES))],
        "report": ["-o", str(store.parent / "r.html")],
        "extend": ["--points", "9"],
    }
    status = status_of(["study", what, str(store), *options.get(what, [])])
    shown = capfd.readouterr()
    assert status in (0, 2, 3), (what, shown.err)
    lines = [line for line in shown.err.splitlines() if "restored from its copy" not in line]
    assert len(lines) == (0 if status == 0 else 1), (what, shown.err)
    return status, what


def fuzzed(first: int, last: int, whole: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> list[int]:
    """Statuses of commands on tampered stores; what is shown as complete is what was computed, and one fault is mended."""
    expected, found = Store(whole).results(), []
    for number in range(first, last):
        chance = random.Random(number)
        store = Path(shutil.copytree(whole, tmp_path / "a.db"))
        faults = [tampered(store, chance) for _ in range(chance.choice((1, 1, 1, 2, 4)))]
        try:
            status, _ = told(capfd, store, chance)
            try:
                opened = Store(store)
                results = opened.results() if opened.exists() else None
            except sd.InputError:
                assert len(faults) > 1 or "record" in faults[0]
                results = None
            if results is not None:
                good = results["status"].values == COMPLETE
                xr.testing.assert_equal(results.isel(case=good).drop_attrs(), expected.isel(case=good).drop_attrs())
                if len(faults) == 1:
                    resumed(store, whole, capfd)
        except Exception as error:
            raise AssertionError(f"tampered store {number}: {faults}: {error!r}") from error
        finally:
            capfd.readouterr()
            shutil.rmtree(store) if store.is_dir() else store.unlink(missing_ok=True)
        found.append(status)
    return found


def test_tampered_stores(whole: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """Identity: whatever befalls the files, statuses 0, 2 and 3 with one line, and no wrong number."""
    assert 0 in fuzzed(0, QUICK, whole, tmp_path, capfd)


@pytest.mark.slow
@pytest.mark.parametrize("first", range(0, ALL, PART))
def test_a_thousand_tampered_stores(first: int, whole: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """Identity: as above."""
    assert len(fuzzed(first, first + PART, whole, tmp_path, capfd)) == PART


def test_nothing_of_the_user_is_touched(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """Identity: folders and files that are named like a store and more stay, byte for byte."""
    (tmp_path / "a.db.new").mkdir()
    (tmp_path / "a.db.new" / "thesis.txt").write_text("of the user")
    (tmp_path / "a.db.lock").write_text("of the user")
    execute(study(), tmp_path / "a.db", block=BLOCK, engine=Threads(1))
    assert (tmp_path / "a.db.new" / "thesis.txt").read_text() == "of the user"
    assert (tmp_path / "a.db.lock").read_text() == "of the user"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.db", "a.db.lock", "a.db.new"]


def test_a_link_to_an_empty_folder_is_a_place_for_a_store(tmp_path: Path) -> None:
    """Identity: the store is where the link leads, and goes on through it."""
    (tmp_path / "disk").mkdir()
    (tmp_path / "a.db").symlink_to(tmp_path / "disk")
    execute(study(), tmp_path / "a.db", block=BLOCK, engine=Threads(1))
    assert (tmp_path / "a.db").is_symlink()
    assert Store(tmp_path / "disk").exists()
    assert (execute(study(), tmp_path / "a.db", engine=Threads(1)).status() == COMPLETE).all()


def test_ctrl_c_before_there_is_a_store_promises_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """Identity: what is typed after it works."""
    import scissordyn.study.execute as module

    def stop(*_: Any) -> None:
        raise KeyboardInterrupt

    (tmp_path / "case.toml").write_text(
        '[structure]\nkind = "scissor"\n[drive]\nspeed = "100 rpm"\n[[clearance]]\njoint = "A"\nclearance = "0.5 mm"\n'
        '[run]\nuntil = "1 ms"\n'
    )
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(module, "pilot", stop)
    sweep = ["sweep", "case.toml", "--vary", "A.clearance=0.1..0.4 mm, 2 values", "-o", "a.db", "--threads", "1"]
    assert status_of(sweep) == 130
    said = capfd.readouterr().err
    assert "nothing was computed yet; the same command begins anew" in said
    assert "resume" not in said
    monkeypatch.undo()
    monkeypatch.chdir(tmp_path)
    assert status_of(sweep) == 0


def test_a_worker_with_another_program_computes_nothing(store: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Identity: one line that names the worker; its block stays as it was."""
    shutil.rmtree(store / "peak_force" / "c" / "2")
    ours = study().fingerprint()
    before = arrays(store)
    monkeypatch.setattr(Study, "fingerprint", lambda _: {**ours, "program": "another"})
    with pytest.raises(ProgramError, match=r"would compute other numbers \(differs in program\); allowed: the same sources"):
        run_block(Block(study(), str(store), 2, fingerprint=ours))
    assert arrays(store) == before


def test_a_block_of_another_program_is_refused(whole: Path, store: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """Identity: numbers whose seal names another program are not mixed with the others, whoever wrote them."""
    other = Store(store)
    other.write(
        np.array([4, 5]),
        {"peak_force": np.full((2, 1), 1e12)},
        np.array([COMPLETE] * 2, np.int8),
        (0.0, 0.0, 2.0),
        "another",
    )
    assert other.damage() == {2: "another program computed it"}
    found = other.results()
    assert found["status"].values.tolist() == [COMPLETE] * 4 + [PENDING] * 2 + [COMPLETE] * 2
    assert np.nanmax(found["peak_force"].values) < 1e12
    resumed(store, whole, capfd)


def test_a_worker_that_seals_nothing_stops_the_study(store: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Identity: as one of an earlier version, whose numbers nobody can vouch for."""
    shutil.rmtree(store / "peak_force" / "c" / "2")
    monkeypatch.setattr("scissordyn.study.store.seal", lambda *_: None)
    with pytest.raises(ProgramError, match="block 2 came back and is not whole"):
        execute(study(), store, engine=Threads(1))


def _hold(address: str, held: Any, release: Any) -> None:
    with Store(address).alone():
        held.set()
        release.wait(60)


def test_the_lock_is_held_by_one_and_never_unlinked(store: Path) -> None:
    """Identity: a process that comes while another holds the lock, and one after it, lock the same file."""
    context = multiprocessing.get_context("spawn")
    held, release = context.Event(), context.Event()
    process = context.Process(target=_hold, args=(str(store), held, release))
    process.start()
    assert held.wait(120)
    number = (store / "record" / "lock").stat().st_ino
    with pytest.raises(sd.InputError, match="is being computed by another process"), Store(store).alone():
        pass
    release.set()
    process.join()
    with Store(store).alone():
        assert (store / "record" / "lock").stat().st_ino == number
    assert (store / "record" / "lock").stat().st_ino == number


def test_a_block_is_on_the_disk_before_it_is_sealed(store: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Identity: each file of a block and each folder that names it is synchronised before the seal has its name."""
    import scissordyn.study.seal as module

    done: list[str] = []
    fsync, replace = os.fsync, os.replace

    def noted(handle: int) -> None:
        done.append(os.readlink(f"/proc/self/fd/{handle}"))
        fsync(handle)

    def named(one: Any, other: Any) -> None:
        done.append(f"-> {other}")
        replace(one, other)

    shutil.rmtree(store / "peak_force" / "c" / "2")
    monkeypatch.setattr(module.os, "fsync", noted)
    monkeypatch.setattr(module.os, "replace", named)
    run_block(Block(study(), str(store), 2))
    sealed = done.index(f"-> {store / 'record' / 'seals' / '2.json'}")
    for path in ("peak_force/c/2/0", "peak_force/c/2", "peak_force/c", "status/c/2", "status/c", "A.clearance/c/2"):
        assert str(store / path) in done[:sealed], path
    assert str(store / "record" / "seals") in done[sealed:]


def test_an_optimisation_with_a_damaged_early_block_goes_on(tmp_path: Path) -> None:
    """Identity: the block is computed anew and the search ends with the same bytes."""
    from scissordyn.study.distribution import Interval
    from scissordyn.study.goal import Goal
    from scissordyn.study.optimise import Optimisation

    plain = dataclasses.replace(study(), factors=(Factor("A.clearance", Interval(1e-4, 5e-4)),))
    plan = Optimisation((Goal("peak_force"),), generations=3, population=4)
    searched = dataclasses.replace(plain, optimisation=plan, design=plan.design(1, 1))
    path = tmp_path / "a.db"
    optimise(searched, path, engine=Threads(1), block=3)
    expected = arrays(path)
    shutil.rmtree(path / "peak_force" / "c" / "1")
    assert list(Store(path).damage()) == [1]
    optimise(searched, path, engine=Threads(1), block=3)
    assert arrays(path) == expected
