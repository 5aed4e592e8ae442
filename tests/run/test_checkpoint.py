"""Checkpoints: a killed run continues from its file, and its results are those of an undisturbed run."""

from __future__ import annotations

import contextlib
import json
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pytest
import xarray as xr
from tests.build import EXAMPLES, counts_of, on_pin

import scissordyn as sd
from scissordyn.casefile.configuration import write_configuration
from scissordyn.cli.main import status_of
from scissordyn.plan.plan import plan
from scissordyn.run.advance import driver as driver_module
from scissordyn.run.advance import loop as loop_module
from scissordyn.run.advance.checkpoint import Keeper, open_checkpoint
from scissordyn.run.advance.driver import Driver
from scissordyn.run.advance.loop import advance
from scissordyn.run.trajectory import compute, make_driver

CASES = {
    "paper": "0.03 s",  # one joint, located events, explicit
    "mast": "0.02 s",  # several joints
    "controlled": "0.1 s",  # an actuator
    "self_deploying": "0.5 s",  # a latch and springs
    "clearance_guide": "0.01 s",
    "press": "0.2 s",
}
"""Ends of the runs [s] of examples, by name."""


def case(name: str, *changes: str) -> tuple[sd.Mechanism, sd.Options]:
    """Return an example with a shorter time, and changes."""
    found = sd.read_case(
        EXAMPLES / f"{name}.toml", [f"run.until={CASES[name]}", "run.samples=101", "run.trust=false", *changes]
    )
    return found.mechanism, found.run


def opened(checkpoint: sd.Checkpoint, mechanism: sd.Mechanism, options: sd.Options) -> Keeper:
    """Return the keeper of the checkpoints of a run."""
    return open_checkpoint(checkpoint, write_configuration(mechanism, options))


def fresh(mechanism: sd.Mechanism, options: sd.Options) -> Driver:
    """Return a driver at the start of a run with samples and recorded steps."""
    driver, _, _ = make_driver(plan(mechanism), options)
    driver.sample_at(np.linspace(0.0, options.until, options.samples))
    driver.record_steps()
    return driver


def numbers(run: xr.Dataset) -> dict[str, bytes]:
    """Return all values of a run as bytes, and its attributes without the computing time."""
    found = {
        str(name): repr(part.values.tolist()).encode() if part.dtype.kind in "OUb" else part.values.tobytes()
        for name, part in run.variables.items()
    }
    attributes = dict(run.attrs)
    attributes["statistics"] = {key: value for key, value in counts_of(run).items() if key != "seconds"}
    return found | {"attributes": repr(sorted(attributes.items(), key=lambda item: item[0])).encode()}


@pytest.mark.parametrize("changes", [(), ("run.method=rodas5p",)])
@pytest.mark.parametrize("name", CASES)
def test_driver_continues_bit_for_bit(name, changes, monkeypatch):
    """Identity: another driver that continues from any step ends with the arrays of an undisturbed run."""
    mechanism, options = case(name, *changes)
    monkeypatch.setattr(driver_module, "FIRST_STEPS", 3)
    monkeypatch.setattr(loop_module, "SLICE_STEPS_MAX", 3)  # so that every few steps are a moment to be killed at
    moments: list[dict[str, np.ndarray]] = []
    whole = fresh(mechanism, options)
    draw = random.Random(f"{name} {changes}")

    def look(_: float) -> None:
        if draw.random() < 0.1:
            moments.append({key: part.copy() for key, part in whole.arrays().items()})

    assert advance(whole, options.until, progress=look) == 1
    assert len(moments) > 3
    expected = {key: part.tobytes() for key, part in whole.arrays().items()}
    monkeypatch.setattr(loop_module, "SLICE_STEPS_MAX", 20_000)
    for moment in draw.sample(moments, 3):
        other = fresh(mechanism, options)
        other.load_arrays(moment)
        assert {key: part.tobytes() for key, part in other.arrays().items()} == {
            key: part.tobytes() for key, part in moment.items()
        }
        assert advance(other, options.until) == 1
        assert {key: part.tobytes() for key, part in other.arrays().items()} == expected


def stopped(mechanism: sd.Mechanism, checkpoint: sd.Checkpoint, after: int, **options: object) -> xr.Dataset:
    """Return a run that is interrupted at the given call of its progress function."""
    calls = [0]

    def told(_: float) -> None:
        calls[0] += 1
        if calls[0] == after:
            raise KeyboardInterrupt

    return sd.simulate(mechanism, checkpoint=checkpoint, progress=told, **options)


def rubbing() -> sd.Mechanism:
    """Return the array with friction in its clearance joint and a tracked point."""
    loose = sd.scissor(units=2).with_clearance("A", sd.Clearance(0.5e-3, friction=sd.LuGre(0.1))).driven(speed=sd.rpm(150))
    return loose.track("tip", "slider", "centre")


def delayed() -> sd.Mechanism:
    """Return a bar whose controller keeps a history of its signal, which grows when it is restored."""
    return on_pin(sd.bar("arm", length=0.5, mass=1.0), gravity=9.81).controlled(sd.Pyragas(0.05, 0.02, onset=0.0))


def hard() -> sd.Mechanism:
    """Return the array with a hard contact."""
    return sd.scissor(units=2).with_clearance("A", sd.Clearance(4e-4, contact="hard")).driven(speed=sd.rpm(150))


@pytest.mark.parametrize(
    ("made", "slices", "options"),
    [
        (rubbing, 50, {"until": 0.02, "samples": 101}),
        (rubbing, 200, {"until": 0.02, "samples": 101, "trust": True}),
        (delayed, 10, {"until": 2.0, "samples": 51}),
        (hard, 50, {"until": 0.02, "step": 1e-5}),
    ],
)
def test_interrupted_run_continues(tmp_path, monkeypatch, made, slices, options):
    """Identity: a run interrupted several times, also while it is repeated, is the same bit for bit; the file is removed."""
    monkeypatch.setattr(driver_module, "FIRST_STEPS", slices)
    monkeypatch.setattr(loop_module, "SLICE_STEPS_MAX", slices)
    expected = sd.simulate(made(), **options)
    checkpoint = sd.Checkpoint(tmp_path / "run.checkpoint", every=0.0)
    part, times = None, 0
    while part is None or part.attrs["status"] == "interrupted":
        part = stopped(made(), checkpoint, 3, **options)
        times += 1
        assert (tmp_path / "run.checkpoint").exists() == (part.attrs["status"] == "interrupted")
    assert times > 2
    assert numbers(part) == numbers(expected)


def test_replay_with_checkpoints(tmp_path, clearance_run):
    """Contract: `replay` writes checkpoints, too; with `keep` the file stays, and another run ends at once."""
    checkpoint = sd.Checkpoint(tmp_path / "run.checkpoint", every=0.0, keep=True)
    assert numbers(sd.replay(clearance_run, checkpoint=checkpoint)) == numbers(clearance_run)
    assert sd.load(checkpoint.path).attrs["reached"] == clearance_run.attrs["end"]
    assert numbers(sd.replay(clearance_run, checkpoint=checkpoint)) == numbers(clearance_run)
    checkpoint.remove()
    assert not list(tmp_path.iterdir())


def test_other_runs_are_refused(tmp_path, clearance_array):
    """Contract: another description, option, version or kind of file, and a damaged file, are refused with the difference."""
    checkpoint = sd.Checkpoint(tmp_path / "run.checkpoint", every=0.0)
    options = sd.Options(0.01)

    def refused(mechanism: sd.Mechanism, options: sd.Options) -> str:
        with pytest.raises(sd.InputError) as error:
            opened(checkpoint, mechanism, options)
        assert "\n" not in str(error.value)
        return str(error.value)

    keeper = opened(checkpoint, clearance_array, options)
    compute(plan(clearance_array), options, keeper=keeper)
    assert opened(checkpoint, clearance_array, options).parts.keys() == {"run"}
    assert 'configuration.run.until = "10 ms" in the checkpoint, "20 ms" in this run' in refused(
        clearance_array, sd.Options(0.02)
    )
    other = clearance_array.replace("A.clearance", 4e-4)
    assert 'configuration.clearance[0].clearance = "0.5 mm" in the checkpoint, "0.4 mm" in this run' in refused(other, options)
    whole = sd.load(checkpoint.path)
    sd.save(whole.assign_attrs(versions=json.dumps({**json.loads(whole.attrs["versions"]), "sources": "0"})), checkpoint.path)
    assert 'versions.sources = "0" in the checkpoint' in refused(clearance_array, options)
    damaged = whole.copy(deep=True)
    damaged["run"].values[100] += 1
    sd.save(damaged, checkpoint.path)
    assert "is damaged" in refused(clearance_array, options)
    sd.save(sd.simulate(clearance_array, until=1e-4, samples=2), checkpoint.path)
    assert "is a 'scissordyn run'" in refused(clearance_array, options)
    Path(checkpoint.path).write_text("something else\n")
    assert "is not overwritten" in refused(clearance_array, options)


def test_full_disk_does_not_end_the_run(tmp_path, monkeypatch, clearance_array):
    """Contract: a run without room for checkpoints continues with a warning; a missing folder is refused."""
    expected = sd.simulate(clearance_array, until=5e-3, samples=11)

    def full(*_: Any, **__: Any) -> None:
        raise sd.InputError("cannot write 'run.checkpoint': No space left on device")

    monkeypatch.setattr("scissordyn.record.store.save", full)
    checkpoint = sd.Checkpoint(tmp_path / "run.checkpoint", every=0.0)
    run = sd.simulate(clearance_array, until=5e-3, samples=11, checkpoint=checkpoint)
    assert run.equals(expected)
    assert "the last checkpoints are missing: cannot write" in run.attrs["warnings"]
    with pytest.raises(sd.InputError, match="no folder"):
        sd.simulate(clearance_array, until=5e-3, checkpoint=sd.Checkpoint(tmp_path / "none" / "run.checkpoint"))


def test_state_of_another_size_is_refused(tmp_path, clearance_array, frictional_array):
    """Contract: arrays of the wrong shape are refused, even if the file claims to belong to this run."""
    checkpoint = sd.Checkpoint(tmp_path / "run.checkpoint")
    keeper = Keeper(checkpoint, {})
    compute(plan(frictional_array), sd.Options(1e-3, samples=5), keeper=keeper)
    with pytest.raises(sd.InputError, match="does not fit this run"):
        compute(plan(clearance_array), sd.Options(1e-3, samples=5), keeper=keeper)


def stiffening(length, rate, stiffness):
    """Return force, energy and dissipation."""
    return -stiffness * length, 0.5 * stiffness * length**2, 0.0


def softening(length, rate, stiffness):
    """Return force, energy and dissipation at half the stiffness."""
    return -0.5 * stiffness * length, 0.25 * stiffness * length**2, 0.0


def test_edited_kernels_are_refused(tmp_path):
    """Contract: a component whose Python kernel differs belongs to another run, though its fields are the same."""
    checkpoint, options = sd.Checkpoint(tmp_path / "run.checkpoint"), sd.Options(1e-3, samples=2)
    arms = []
    for kernel in (stiffening, softening):

        @sd.component(port="line", force=kernel, section="rubber")
        class Rubber:
            """A rubber band."""

            name: str
            start: tuple[str, str]
            end: tuple[str, str]
            stiffness: Annotated[float, sd.Quantity("N/m", above=0.0)] = 10.0

        band = Rubber("band", ("unit 1/bar 1", "end"), ("unit 1/bar 2", "end"))
        arms.append(sd.scissor(units=1).replace("components", (band,)))
    keeper = opened(checkpoint, arms[0], options)
    compute(plan(arms[0]), options, keeper=keeper)
    assert opened(checkpoint, arms[0], options).parts
    with pytest.raises(sd.InputError, match=r"belongs to another run: configuration\.code\.class"):
        opened(checkpoint, arms[1], options)


CASE = ("run", str(EXAMPLES / "paper.toml"), "--set", "run.until=10 ms")  # Command that runs the paper's array for 10 ms


def test_ctrl_c_keeps_run_and_checkpoint(tmp_path, monkeypatch, capsys):
    """Contract: Ctrl-C leaves both files; the same command continues, and its run is the undisturbed one."""
    whole, target = tmp_path / "whole.nc", tmp_path / "run.nc"
    assert status_of([*CASE, "-o", str(whole)]) == 0
    monkeypatch.setattr(driver_module, "FIRST_STEPS", 20)
    restore = Keeper.restore

    def once(keeper: Keeper, *arguments: Any) -> tuple[float, Callable[[float], None]]:
        monkeypatch.setattr(Keeper, "restore", restore)

        def interrupt(_: float) -> None:
            raise KeyboardInterrupt

        return 0.0, interrupt

    monkeypatch.setattr(Keeper, "restore", once)
    kept = [*CASE, "-o", str(target), "--checkpoint", "1 min"]
    assert status_of(kept) == 130
    assert sorted(path.name for path in tmp_path.iterdir()) == ["run.nc", "run.nc.checkpoint", "whole.nc"]
    assert 0.0 < sd.load(target).attrs["end"] < 0.01
    assert status_of(kept) == 0
    assert sorted(path.name for path in tmp_path.iterdir()) == ["run.nc", "whole.nc"]
    assert numbers(sd.load(target)) == numbers(sd.load(whole))
    capsys.readouterr()


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("--checkpoint", "60 s"), "--checkpoint without -o"),
        (("-o", "run.nc", "--checkpoint", "60"), "--checkpoint 60: missing unit"),
        (("-o", "run.nc", "--checkpoint", "-1 s"), "--checkpoint -1 s: out of bounds"),
        (("-o", "other", "--checkpoint", "1 s"), "'other.checkpoint' exists and is not a NetCDF file of scissordyn"),
    ],
)
def test_refused_checkpoint_options(arguments, says, tmp_path, monkeypatch, capsys):
    """Contract: wrong options give one line and status 2 before anything is computed."""
    monkeypatch.chdir(tmp_path)
    Path("other.checkpoint").write_text("notes\n")
    assert status_of([*CASE, *arguments]) == 2
    said = capsys.readouterr().err
    assert says in said
    assert said.count("\n") == 1


COMMAND = (sys.executable, "-m", "scissordyn.cli.main", "run")  # Command line of `scissordyn run`


def command(target: Path, until: str) -> list[str]:
    """Return the command of a run of about half a minute."""
    changes = (f"until={until}", "most_steps=1000000000", "samples=500", "rtol=1e-11")
    words = [word for change in changes for word in ("--set", f"run.{change}")]
    return [*COMMAND, str(EXAMPLES / "mast.toml"), *words, "-o", str(target), "--checkpoint", "0.2 s"]


def killed(target: Path, until: str, writes: int, delay: float) -> bool:
    """Kill a command after some checkpoints and a delay [s]; return False if it ended before."""
    state = target.with_name(f"{target.name}.checkpoint")

    def written() -> int:
        return state.stat().st_mtime_ns if state.exists() else 0

    process = subprocess.Popen(
        command(target, until), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True
    )
    last, seen = written(), 0
    while seen < writes and process.poll() is None:
        time.sleep(0.005)
        now = written()
        seen, last = seen + (now != last), now
    time.sleep(delay)
    if process.poll() is not None:
        return False
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    return True


@pytest.mark.slow
def test_twenty_real_kills(tmp_path):
    """Contract: after twenty kills at random moments the run is that of an undisturbed process."""
    until, draw, kills = "1 s", random.Random(4), 0
    undisturbed, target = tmp_path / "undisturbed.nc", tmp_path / "run.nc"
    subprocess.run(command(undisturbed, until), check=True, capture_output=True)
    reached = []
    while kills < 20:
        assert killed(target, until, draw.randrange(4), draw.uniform(0.0, 0.4)), f"done after {kills} kills"
        kills += 1
        state = target.with_name("run.nc.checkpoint")
        reached.append(sd.load(state).attrs["reached"] if state.exists() else 0.0)
    assert reached == sorted(reached)
    assert reached[-1] > reached[0]
    subprocess.run(command(target, until), check=True, capture_output=True)
    assert numbers(sd.load(target)) == numbers(sd.load(undisturbed))
    assert sorted(tmp_path.iterdir()) == [target, undisturbed]


def spoiled(path: Path, chance: random.Random) -> str:
    """Damage a checkpoint, below or above the library of its format, and return the kind of damage."""
    what = chance.choice(("cut", "flip", "flips", "attribute", "content", "overwrite"))
    content = bytearray(path.read_bytes())
    if what == "cut":
        path.write_bytes(content[: chance.randrange(len(content))])
    elif what in ("flip", "flips"):
        for _ in range(1 if what == "flip" else 30):
            content[chance.randrange(len(content))] ^= 1 << chance.randrange(8)
        path.write_bytes(content)
    elif what == "overwrite":
        path.write_bytes(chance.choice([b"\0" * 100, chance.randbytes(300), b"CDF\1", b"{}"]))
    else:
        stored = sd.load(path)
        if what == "attribute":
            name = chance.choice(sorted(stored.attrs))
            stored.attrs[name] = chance.choice(changed_values(str(stored.attrs[name]), chance))
            what = f"attribute {name}"
        else:
            content = stored["run"].values.copy()
            content[chance.randrange(content.size)] ^= 1 << chance.randrange(8)
            half = content[: content.size // 2]
            other = chance.choice([content, half, content.astype(float), half.astype(str).astype(object)])
            seconds = chance.choice([{}, {"seconds": "3"}, {"seconds": 3.0}, stored["run"].attrs])
            stored = stored.drop_vars("run").assign({chance.choice(["run", "other"]): ("byte", other, seconds)})
        with contextlib.suppress(sd.InputError):  # a title of another program
            sd.save(stored, path)
    return what


def changed_values(text: str, chance: random.Random) -> list[Any]:
    """Return other values for an attribute."""
    at = chance.randrange(len(text) + 1)
    numbers = re.sub(r"\d+", lambda found: str(int(found[0]) + chance.choice((0, 1))), text)
    others = ("", "[]", "{}", "null", "3", 3, np.array([1.0, 2.0]), np.array([1, 2, 3]))
    return [text[:at], *others, numbers, f"{text} ", text[at:]]


def fuzzed(first: int, last: int, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> list[int]:
    """Return statuses of runs with damaged checkpoints; a run that continues must equal the undisturbed one."""
    (tmp_path / "case.toml").write_text(
        '[structure]\nkind = "scissor"\n[drive]\nspeed = "150 rpm"\n[[clearance]]\njoint = "A"\nclearance = "0.5 mm"\n'
        '[run]\nuntil = "6 ms"\nsamples = 21\ntrust = false\n'
    )
    found = sd.read_case(tmp_path / "case.toml", [])
    whole = sd.simulate(found.mechanism, **found.run.keywords, checkpoint=sd.Checkpoint(tmp_path / "kept.nc", 0.0, keep=True))
    statuses, state = [], tmp_path / "run.nc.checkpoint"
    for number in range(first, last):
        chance = random.Random(number)
        shutil.copy(tmp_path / "kept.nc", state)
        (tmp_path / "run.nc").unlink(missing_ok=True)
        what = spoiled(state, chance)
        status = status_of(["run", str(tmp_path / "case.toml"), "-o", str(tmp_path / "run.nc"), "--checkpoint", "60 s"])
        said = capfd.readouterr().err
        assert status in (0, 2, 3), (number, what, said)
        assert said.count("\n") == (0 if status == 0 else 1), (number, what, said)
        if status == 0:
            np.testing.assert_array_equal(sd.load(tmp_path / "run.nc")["position"].values, whole["position"].values)
        statuses.append(status)
    return statuses


# Ranges of damaged checkpoints that slow tests try
SLOWLY = [pytest.param(first, 250, marks=pytest.mark.slow) for first in range(0, 1000, 250)]


@pytest.mark.parametrize(("first", "count"), [(0, 25), *SLOWLY])
def test_damaged_checkpoints(first, count, tmp_path, capfd):
    """Contract: any content of a checkpoint gives status 0 with the same results, or 2 or 3 with one line."""
    statuses = fuzzed(first, first + count, tmp_path, capfd)
    assert len(statuses) == count
    assert 2 in statuses
