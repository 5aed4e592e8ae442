"""Studies: the store holds single runs, independent of the way they were computed."""

import dataclasses
import functools
import os
import sqlite3
import types
from contextlib import closing

import numpy as np
import pytest
import xarray as xr

import scissordyn as sd
from scissordyn.run.response import Response
from scissordyn.studies.ask.description import OwnMeasure, Study
from scissordyn.studies.ask.design import Design, Factor, Sampling
from scissordyn.studies.ask.requirement import Requirement, response_values
from scissordyn.studies.compute.execute import BLOCK_SECONDS, TASK_SECONDS, block_seconds, execute, extend
from scissordyn.studies.compute.store import COMPLETE, FAILED, Store, StoreError

UNTIL = 0.005  # [s] end of the runs


def arm():
    """Return the paper's array with clearance at joint A."""
    return sd.scissor(units=2).with_clearance("A", sd.Clearance(0.5e-3)).driven(speed=sd.rpm(150))


def study(**changes):
    """Return a study of clearance and speed on a grid, uncertain restitution, two members."""
    fields = {
        "mechanism": arm(),
        "options": sd.Options(UNTIL),
        "factors": (Factor("A.clearance", sd.Interval(1e-4, 5e-4, 3)), Factor("drive.speed", sd.Levels((10.0, 20.0)))),
        "measures": ("peak_force", "contact_count"),
        "uncertain": (Factor("A.damping.restitution", sd.Interval(0.7, 0.95)),),
        "sampling": Sampling(2),
        "members": 2,
        "requirements": (Requirement("peak_force", "<", 2e4),),
    }
    return Study(**(fields | changes))


def rows(path):
    """Return all rows of cases of a store, as any tool reads them."""
    with closing(sqlite3.connect(path)) as connection:
        return connection.execute("SELECT * FROM cases ORDER BY number").fetchall()


def test_store_holds_single_runs(tmp_path):
    """Identity: peaks of member 0 equal those of `simulate` with the same values, bit for bit."""
    store = execute(study(), tmp_path / "study.db", block=7)
    found = store.results()
    assert found.sizes["case"] == 24
    assert found["status"].values.tolist() == [COMPLETE] * 24
    for case in (0, 6, 22):
        numbers = {name: float(found[name][case]) for name in ("A.clearance", "drive.speed", "A.damping.restitution")}
        one = arm()
        for address, value in numbers.items():
            one = one.replace(address, value)
        run = sd.simulate(one, until=UNTIL, samples=2)
        assert float(found["peak_force"][case, 0]) == float(run["peak_force"].max())
    # common random numbers: the same samples at each point; members: the same numbers
    restitution = found["A.damping.restitution"].values.reshape(6, 2, 2)
    assert np.all(restitution == restitution[:1, :, :1])
    with closing(sqlite3.connect(store.path)) as connection:
        raw = connection.execute('SELECT "A.peak_force", "ideal joints.peak_force" FROM cases ORDER BY number').fetchall()
    np.testing.assert_array_equal(raw, found["peak_force"].values)


def test_members_differ_by_round_off_only():
    """Limit: early in a run members differ, and agree to nine digits."""
    numbers = {"A.clearance": np.full(3, 2e-4)}
    found = sd.simulate_many(arm(), numbers, until=UNTIL, members=[0, 1, 2], measures=("peak_force",))
    peaks = found["peak_force"].values[:, 0]
    assert len(set(peaks.tolist())) == 3
    np.testing.assert_allclose(peaks, peaks[0], rtol=1e-9)
    again = sd.simulate_many(arm(), {"A.clearance": np.full(1, 2e-4)}, until=UNTIL, members=2, measures=("peak_force",))
    assert float(again["peak_force"][0, 0]) == peaks[2]


def test_resumed_rows_are_those_of_an_undisturbed_study(tmp_path):
    """Contract: rows do not depend on interruptions and threads; finished blocks are not written again."""
    whole = execute(study(), tmp_path / "whole.db", block=5, engine=1)
    stopped = tmp_path / "stopped.db"

    def stop(progress):
        if progress.done_here >= 10:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        execute(study(), stopped, block=5, engine=2, progress=stop)
    done = Store(stopped).status() == COMPLETE
    assert 10 <= done.sum() < 24
    assert Store(stopped).times()["attempts"].sum() == np.ceil(done.sum() / 5)
    resumed = execute(study(), stopped, engine=2)
    assert rows(stopped) == rows(whole.path)
    assert resumed.times()["attempts"].tolist() == [1.0] * 5
    assert whole.times()["attempts"].tolist() == [1.0] * 5


def test_extended_designs_keep_what_is_done(tmp_path):
    """Contract: 8 points and 8 more are the study of 16 points; finished cases are not computed again."""
    sobol = {"design": Design("sobol", 8, seed=2), "factors": (Factor("A.clearance", sd.Interval(1e-4, 5e-4)),), "members": 1}
    store = execute(study(**sobol), tmp_path / "a.db", block=6)
    larger = extend(store.study(), tmp_path / "a.db", 16)
    at_once = execute(study(**sobol | {"design": Design("sobol", 16, seed=2)}), tmp_path / "b.db", block=6)
    xr.testing.assert_equal(larger.results(), at_once.results())
    assert larger.times()["cases"].sum() == 32
    with pytest.raises(sd.InputError, match="more points of a grid"):
        extend(study(), tmp_path / "a.db", 99)


def test_another_study_is_refused(tmp_path):
    """Contract: the error names the difference."""
    execute(study(), tmp_path / "a.db", block=24)
    for changes, differs in (
        ({"members": 1}, "design"),
        ({"measures": ("peak_force",)}, "measures"),
        ({"options": sd.Options(UNTIL, rtol=1e-6)}, "options"),
        ({"mechanism": arm().replace("A.clearance", 1e-4)}, "mechanism"),
    ):
        with pytest.raises(sd.InputError, match=f"another study \\(differs in {differs}\\)"):
            execute(study(**changes), tmp_path / "a.db")
    with pytest.raises(sd.InputError, match="is not a study"):
        execute(study(), tmp_path)
    execute(study(requirements=()), tmp_path / "a.db")  # requirements are judged afterwards


def test_failed_cases_do_not_stop_a_study(tmp_path):
    """Contract: failed cases have their cause and are computed again on request only; the others are complete."""
    broken = study(options=sd.Options(UNTIL, most_steps=60), uncertain=(), sampling=Sampling(), members=1)
    store = execute(broken, tmp_path / "a.db", block=2)
    status = store.status()
    assert FAILED in status
    assert COMPLETE in status
    causes = store.results()["cause"].values[status == FAILED].tolist()
    assert all("60 steps are not enough" in cause for cause in causes)
    attempts = store.times()["attempts"]
    execute(broken, tmp_path / "a.db")
    np.testing.assert_array_equal(store.times()["attempts"], attempts)
    execute(broken, tmp_path / "a.db", retry=True)
    failed_blocks = np.unique(np.flatnonzero(status == FAILED) // 2)
    np.testing.assert_array_equal(np.flatnonzero(store.times()["attempts"] == 2), failed_blocks)


def test_measures_of_the_user(tmp_path):
    """Contract: functions of the Dataset and of the accumulators are measures; an error fails its case."""
    file = tmp_path / "mine.py"
    file.write_text(
        "def largest(run):\n    return float(run['peak_force'].max())\n\n\n"
        "def steps(ended):\n    return ended.driver.state.counts['steps'][0]\n\n\n"
        "def fault(ended):\n    return 1 / 0\n"
        "def unfit(run):\n    from scissordyn.errors import InputError\n    raise InputError('this run', 'another')\n"
    )
    own = (OwnMeasure("largest", f"{file}:largest", units="N"), OwnMeasure("own_steps", f"{file}:steps", of="accumulators"))
    plain = study(uncertain=(), sampling=Sampling(), members=1, own_measures=own, measures=("peak_force", "steps"))
    store = execute(plain, tmp_path / "a.db", block=4)
    found = store.results()
    np.testing.assert_array_equal(found["largest"].values, found["peak_force"].values[:, 0])
    np.testing.assert_array_equal(found["own_steps"].values, found["steps"].values)
    assert store.study(allow_code=[file]) == plain
    with pytest.raises(sd.InputError, match="--allow-code"):
        store.study()
    same = file.read_text()
    file.write_text(f"{same}\n")
    with pytest.raises(sd.InputError, match="has changed since the study was begun; expected the same file, or a new study"):
        store.study(allow_code=[file])
    assert store.study(reading=True).measure_names == plain.measure_names
    with pytest.raises(sd.InputError, match="only read"):
        store.study(reading=True).own_measures[0].callable()(found)
    file.write_text(same)
    unnamed = dataclasses.replace(plain, own_measures=(OwnMeasure("twice", lambda run: 2.0),)).to_plain()
    with pytest.raises(sd.InputError, match=r"'twice' is a Python function that is not in a file; .*measures="):
        Study.from_plain(unnamed)
    fault = dataclasses.replace(plain, own_measures=(OwnMeasure("fault", f"{file}:fault", of="accumulators"),))
    failed = execute(fault, tmp_path / "b.db", block=6).results()
    assert failed["status"].values.tolist() == [FAILED] * 6
    assert "measure 'fault': ZeroDivisionError" in str(failed["cause"].values[0])
    unfit = dataclasses.replace(plain, own_measures=(OwnMeasure("unfit", f"{file}:unfit"),))
    refused = execute(unfit, tmp_path / "c.db", block=6).results()
    assert str(refused["cause"].values[0]) == "measure 'unfit': InputError: this run; expected another"


def test_function_without_readable_source(tmp_path):
    """Contract: the digest of a function without readable source is that of the function itself."""
    space = {}
    (tmp_path / "page.md").write_text("(\n" * 9)
    exec(compile("\n\ndef late(run):\n    return 1.0\n", tmp_path / "page.md", "exec"), space)
    assert len(OwnMeasure("late", space["late"]).to_plain()["digest"]) == 16


def test_digest_of_a_partial_function():
    """Contract: equal functions with equal arguments have one digest in every process; other arguments change it."""
    first, second = (types.FunctionType(rows.__code__, globals()) for _ in range(2))  # at two addresses, as in two processes

    def digest(function, limit):
        return OwnMeasure("late", functools.partial(function, limit=limit)).to_plain()["digest"]

    assert digest(first, 3.0) == digest(second, 3.0) != digest(second, 4.0)


def test_requirements_and_responses():
    """Closed form: the worst part decides; NaN meets nothing."""
    values = np.array([[1.0, 3.0], [2.0, np.nan], [np.nan, np.nan]])
    found = xr.Dataset({"peak_force": (("case", "joint"), values, {"role": "measure"})}, coords={"joint": ["A", "B"]})
    np.testing.assert_array_equal(response_values(found, Response("peak_force")), [3.0, 2.0, np.nan])
    np.testing.assert_array_equal(response_values(found, Response("peak_force", smallest=True)), [1.0, 2.0, np.nan])
    np.testing.assert_array_equal(response_values(found, Response("peak_force", "A")), [1.0, 2.0, np.nan])
    limit = Requirement("peak_force", "<", 2.5)
    assert limit.met(response_values(found, limit.response)).tolist() == [False, True, False]
    assert limit.margin(np.array([2.0, 3.0])).tolist() == [0.2, -0.2]
    with pytest.raises(sd.InputError, match="did you mean 'peak_force'"):
        response_values(found, Response("peak_forse"))
    with pytest.raises(sd.InputError, match="no part 'C'"):
        response_values(found, Response("peak_force", "C"))
    with pytest.raises(sd.InputError, match="the study has no measure 'steps'"):
        study(requirements=(Requirement("steps", "<", 1.0),))


def test_stiffness_of_bars_without_clearance(tmp_path):
    """Identity: bending stiffness of all bars is varied as in single runs, also without clearance."""
    bent = sd.with_bending(
        sd.scissor(units=1, bar_length=1.0, bar_mass=1.0), bending_stiffness=2000.0, axial_stiffness=2e7, modes=2
    )
    found = sd.study(
        bent.driven(speed=6.0), {"flexible_bar.all.bending_stiffness": [1000.0, 4000.0]}, until=0.002, store=tmp_path / "a.db"
    )
    assert set(found.trends) <= {"peak_drive_torque", "peak_force"}
    for case, stiffness in enumerate((1000.0, 4000.0)):
        parts = [part for part in found.mechanism(case).components if isinstance(part, sd.FlexibleBar)]
        assert {part.bending_stiffness for part in parts} == {stiffness}
    torques = found.dataset["peak_drive_torque"].values[:, 0].tolist()
    runs = [sd.simulate(found.mechanism(case), until=0.002, samples=2) for case in range(2)]
    assert torques == [float(run["peak_drive_torque"][0]) for run in runs]
    assert torques[0] != torques[1]


def test_store_on_a_full_disk(tmp_path, monkeypatch):
    """Contract: a disk that is full from the first byte leaves nothing."""

    def full(*_):
        raise OSError(28, os.strerror(28))

    with monkeypatch.context() as patched:
        patched.setattr("scissordyn.studies.compute.table.create", full)
        with pytest.raises(StoreError, match="No space left on device"):
            execute(study(), tmp_path / "a.db", block=12)
    assert not list(tmp_path.iterdir())
    assert (execute(study(), tmp_path / "a.db", block=12).status() == COMPLETE).all()
    assert [path.name for path in tmp_path.iterdir()] == ["a.db"]


def test_store_in_a_missing_folder(tmp_path):
    """Contract: the error comes before anything is computed."""
    with pytest.raises(sd.InputError, match="no study at"):
        Store(tmp_path / "a.db").status()
    with pytest.raises(sd.InputError, match=r"no folder .*; expected a folder that exists"):
        execute(study(), tmp_path / "none" / "a.db")


def test_blocks_are_longer_for_very_many_workers():
    """Limit: blocks take a few seconds; with a thousand workers the scheduler is busy half of its time."""
    assert block_seconds(1) == block_seconds(100) == BLOCK_SECONDS
    assert 1000 / block_seconds(1000) * TASK_SECONDS == pytest.approx(0.5)
