"""Curves of simulated runs with located instants; pictures, films, comparisons and exports of saved runs."""

import csv
import dataclasses
import math

import numpy as np
import pandas as pd
import pytest
from scipy.io import loadmat

import scissordyn as sd
from scissordyn.cli.compare import differences, measures
from scissordyn.cli.main import status_of
from scissordyn.file.export import contact_table, time_table
from scissordyn.model.options import Options
from scissordyn.plot.animation_scene import scene_of
from scissordyn.plot.contact import contact_times, force_curve, insert_points
from scissordyn.plot.joint import force
from scissordyn.plot.over_time import comparison, energy, shared_curves, torque
from scissordyn.plot.report import KINDS, draw_all
from scissordyn.plot.series import mechanism_of, select_window
from scissordyn.record.joint_force import joint_summaries
from scissordyn.run.simulate import compute_results

UNTIL = 0.01  # [s] end of the saved runs

AVAILABLE_PICTURES = [kind for kind in KINDS if kind not in ("film", "track", "bending")]
"""Kinds of pictures that a run without oil, tracked point and flexible bars has."""


@pytest.fixture(scope="module")
def stored(tmp_path_factory):
    """Return two saved runs of the paper's array, with clearances of 0.5 and 0.2 mm."""
    folder = tmp_path_factory.mktemp("runs")
    for name, clearance in (("a", 0.5e-3), ("b", 0.2e-3)):
        arm = sd.scissor(units=2).with_clearance("A", sd.Clearance(clearance)).driven(speed=sd.rpm(150))
        sd.save(sd.simulate(arm, until=UNTIL, samples=201), folder / f"{name}.nc")
    return folder / "a.nc", folder / "b.nc"


def columns(path):
    """Return the columns of a CSV file as text."""
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    return pd.DataFrame({name: [row[name] for row in rows] for name in rows[0]})


@pytest.fixture(scope="module")
def saved(stored):
    return sd.load(stored[0])


def test_saved_run_has_all_pictures(saved):
    """Contract: each kind of picture is drawn from a saved run, which also holds its mechanism."""
    for kind in AVAILABLE_PICTURES:
        assert getattr(sd.plot, kind)(saved)
    assert saved.scissordyn.mechanism.joint("A").clearance.clearance == 0.5e-3


def test_window_of_a_run(saved):
    """Contract: the window has the samples in it and the contacts that overlap it."""
    part = select_window(saved, 2e-3, 6e-3)
    results = compute_results(mechanism_of(saved), Options(UNTIL, samples=201))
    for name, variable in select_window(results, 2e-3, 6e-3).variables.items():
        assert variable.dims == part[name].dims
        np.testing.assert_array_equal(variable.values, part[name].values)
    assert part["time"].values[0] >= 2e-3
    assert part["time"].values[-1] <= 6e-3
    assert part.sizes["time"] == np.count_nonzero((saved["time"] >= 2e-3) & (saved["time"] <= 6e-3))
    begins, lasts = saved["contact_start"].values, saved["contact_duration"].values
    inside = [b <= 6e-3 and (math.isnan(d) or b + d >= 2e-3) for b, d in zip(begins, lasts, strict=True)]
    assert part["contact_start"].values.tolist() == begins[inside].tolist()
    with pytest.raises(sd.InputError, match="fewer than two samples"):
        select_window(saved, 5.01e-3, 5.02e-3)


def test_commands_on_saved_runs_do_not_compute(stored, tmp_path, monkeypatch):
    """Contract: all commands on saved runs work where a simulation would raise."""

    def refuse(*given, **named):
        raise AssertionError("a run was computed")

    monkeypatch.setattr("scissordyn.run.trajectory.compute", refuse)
    monkeypatch.setattr("scissordyn.run.simulate.compute", refuse)
    a, b = map(str, stored)
    assert status_of(["plot", a, "-o", str(tmp_path)]) == 0
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(f"{kind}.png" for kind in AVAILABLE_PICTURES)
    assert status_of(["animate", a, str(tmp_path / "film.html")]) == 0
    assert status_of(["compare", a, b, "-o", str(tmp_path), "--format", "svg"]) == 0
    assert (tmp_path / "comparison.svg").read_text().startswith("<?xml")


def test_plot_of_chosen_pictures(stored, tmp_path):
    """Contract: only the given pictures of the given joint are drawn."""
    command = ["plot", str(stored[0]), "-o", str(tmp_path), "--only", "force,orbit", "--joint", "A", "--format", "svg"]
    assert status_of([*command, "--from", "2 ms", "--to", "8 ms"]) == 0
    assert sorted(path.name for path in tmp_path.iterdir()) == ["force.svg", "orbit.svg"]


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--only", "forse"], "did you mean 'force'"),
        (["--joint", "B"], "joint 'B'"),
        (["--from", "10"], "missing unit"),
        (["--from", "9 s"], "fewer than two samples"),
        (["--format", "gif"], "picture format 'gif'"),
    ],
)
def test_wrong_plot_options(stored, tmp_path, capsys, options, said):
    """Contract: status 2, one line with the option's value, and nothing is written."""
    assert status_of(["plot", str(stored[0]), "-o", str(tmp_path), *options]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_case_file_instead_of_a_run(tmp_path, capsys):
    """Contract: a case file is refused with the command that runs it."""
    case = tmp_path / "case.toml"
    case.write_text('[structure]\nkind = "scissor"\n')
    assert status_of(["plot", str(case), "-o", str(tmp_path)]) == 2
    assert f"scissordyn run {case} -o case.nc" in capsys.readouterr().err


def test_exports_are_exact(saved, stored, tmp_path):
    """Identity: values in CSV, Parquet and MATLAB files are those of the run, bit for bit."""
    pytest.importorskip("pyarrow", reason="Parquet needs pyarrow")
    force = saved["normal_force"].sel(joint="A").values
    for name in ("table.csv", "table.parquet", "run.mat"):
        assert status_of(["export", str(stored[0]), str(tmp_path / name)]) == 0
    for table in (
        columns(tmp_path / "table.csv").astype(float),
        pd.read_parquet(tmp_path / "table.parquet"),
        time_table(saved),
    ):
        assert table["normal_force of A [N]"].to_numpy().tobytes() == force.tobytes()
        assert table["position of slider, y [m]"].to_numpy().tolist() == saved["slider_position"].values.tolist()
    run = loadmat(tmp_path / "run.mat", simplify_cells=True)["run"]
    assert np.array_equal(run["normal_force"], saved["normal_force"].values, equal_nan=True)
    assert run["units"]["normal_force"] == "N"
    assert run["dims"]["normal_force"] == "time, joint"
    assert run["joint"].tolist() == saved["joint"].values.tolist()
    assert run["attributes"]["configuration"] == saved.attrs["configuration"]


def test_exported_contacts(saved, stored, tmp_path):
    """Contract: the table has one row per contact."""
    assert status_of(["export", str(stored[0]), str(tmp_path / "contacts.csv"), "--contacts"]) == 0
    table = columns(tmp_path / "contacts.csv")
    assert table["peak_force [N]"].astype(float).tolist() == saved["peak_force"].values.tolist()
    assert len(contact_table(saved)) == saved.sizes["contact"]


def test_export_replaces_only_its_own(stored, tmp_path, capsys):
    """Contract: an earlier table is replaced; another file with its name is kept."""
    table = tmp_path / "table.csv"
    for _ in range(2):
        assert status_of(["export", str(stored[0]), str(table)]) == 0
    table.write_text("names, marks\n")
    assert status_of(["export", str(stored[0]), str(table)]) == 2
    assert "exists and is not a CSV file" in capsys.readouterr().err
    assert table.read_text() == "names, marks\n"


def test_comparison_of_cases(stored, capsys, monkeypatch):
    """Contract: the differing values of both cases, and results of both runs."""
    assert status_of(["compare", *map(str, stored)]) == 0
    said = capsys.readouterr().out
    assert "mechanism.joints.A.clearance.clearance 0.5 mm 0.2 mm" in " ".join(said.split())
    assert "largest force at A" in said
    monkeypatch.chdir(stored[0].parent)
    assert status_of(["compare", "a.nc", "a.nc"]) == 0
    said = capsys.readouterr().out
    assert "Both runs are of the same case." in said
    rows = {line.split()[0]: line.split() for line in said.splitlines() if line.split()}
    assert rows["quantity"] == ["quantity", "a.nc", "a.nc", "change"]  # a head for each run
    assert rows["end"][1:3] == rows["end"][3:5]
    arm, steel = sd.scissor(units=1, angle=sd.degrees(30.0)), sd.Clearance(0.5e-3)
    slow, fast = (arm.driven(speed=sd.rpm(speed)) for speed in (120.0, 150.0))
    pairs = (
        (fast, slow, "drives.0.motion.speed", "150 rpm", "120 rpm"),
        (steel, dataclasses.replace(steel, clearance=2e-5), "clearance", "0.5 mm", "0.02 mm"),
        (steel, dataclasses.replace(steel, clearance=0.5e-3 + 1e-12), "clearance", "0.5 mm", "0.500000001 mm"),
        (steel, dataclasses.replace(steel, friction=sd.LuGre(kinetic=0.1)), "friction", "NoFriction", "LuGre"),
    )
    for left, right, *wanted in pairs:
        assert [tuple(wanted)] == list(differences(left, right))


def test_comparison_of_a_drive_with_a_controller(servo):
    """Contract: torque, work and time in contact are compared, although the runs have different kinds of drives."""
    driven = sd.slider_crank(angle=0.4).with_clearance("slider pin", sd.Clearance(1e-4)).driven(speed=20.0)
    run = sd.simulate(driven, until=0.02, samples=21)
    own, other = measures(run), measures(servo)
    assert own["largest torque"] == (abs(run["peak_drive_torque"].item()), "N m")
    assert other["largest torque"] == (servo["peak_control_torque"].item(), "N m")
    assert other["work of drives, motors and actuators"] == (servo["motor_work"].values[-1], "J")
    assert own["fraction of time in contact at slider pin"] == (joint_summaries(run)[0].fraction, "1")


def test_comparison_draws_both(stored):
    """Contract: each panel has the curves of both runs, in the same unit."""
    one, other = map(sd.load, stored)
    for axes, (_, pair) in zip(comparison(one, other), shared_curves([one, other]), strict=True):
        drawn = [np.asarray(line.get_ydata()) for line in axes.lines]
        factor = np.max(np.abs(drawn[0])) / np.max(np.abs(pair[0].values))
        for line, values in zip(drawn, pair, strict=True):
            assert np.allclose(line, factor * values.values, rtol=1e-9)


SAMPLES = 41  # Number of samples of a coarse run


@pytest.fixture(scope="module")
def coarse():
    """Return a run of a slider-crank whose contacts are shorter than the distance of its samples."""
    crank = sd.slider_crank(crank=0.05, rod=0.12, angle=0.4).with_clearance("slider pin", sd.Clearance(5e-4))
    return sd.simulate(crank.driven(speed=sd.rpm(600)), until=0.2, samples=SAMPLES)


@pytest.fixture(scope="module")
def servo():
    """Return a run of a crank with a controller instead of a drive."""
    crank = sd.slider_crank(crank=0.05, rod=0.12, angle=0.4)
    held = crank.controlled(sd.PID(proportional=10.0, limit=5.0), reference=sd.Cycloidal(0.4, 2.0, 0.05))
    return sd.simulate(held, until=0.1, samples=101)


def line(axes, label):
    """Return the points of the line with a label."""
    return np.asarray(next(each for each in axes.lines if each.get_label() == label).get_xydata())


def test_line_of_a_force_reaches_its_peaks(coarse):
    """Contract: the line has every sample and each marked peak, which the samples alone miss."""
    (axes,) = force(coarse)
    drawn, peaks = line(axes, "force"), line(axes, "peak of a contact")
    assert len(peaks) == coarse.sizes["contact"] > 5
    sampled = coarse["normal_force"].sel(joint="slider pin").values
    assert float(coarse["peak_force"].max()) > 1.05 * sampled.max()
    points = {(float(x), float(y)) for x, y in drawn}
    assert {(float(x), float(y)) for x, y in peaks} <= points
    scale = drawn[:, 1].max() / force_curve(coarse, "slider pin").values.max()
    at = np.isin(force_curve(coarse, "slider pin").time, coarse["time"].values)
    np.testing.assert_allclose(drawn[at, 1], scale * sampled, rtol=1e-12)
    assert np.all(np.diff(drawn[:, 0]) >= 0.0)


def test_flights_between_contacts_have_no_force(coarse):
    """Contract: from the end of a contact to the start of the next one the line is zero."""
    curve, found = force_curve(coarse, "slider pin"), contact_times(coarse, "slider pin")
    for end, start in zip(found.end[:-1], found.start[1:], strict=True):
        between = (curve.time >= end) & (curve.time <= start)
        np.testing.assert_array_equal(curve.values[between], 0.0)


def test_inserted_points():
    """Closed form: at a sample the larger magnitude stays; points outside or not finite are left out."""
    time, values = insert_points(
        np.array([0.0, 1.0, 2.0]),
        np.array([0.0, -1.0, 0.0]),
        np.array([1.0, 0.5, 3.0, np.nan]),
        np.array([-4.0, 2.0, 9.0, 9.0]),
    )
    assert time.tolist() == [0.0, 0.5, 1.0, 2.0]
    assert values.tolist() == [0.0, 2.0, -4.0, 0.0]


def test_frames_of_a_film_have_the_peaks(coarse):
    """Contract: the largest force of all frames is that of all contacts, and each contact is in a frame."""
    mechanism = coarse.scissordyn.mechanism
    (joint,) = scene_of(coarse, mechanism, np.arange(0, SAMPLES, 4), ["slider pin"]).clearance_joints
    assert joint.force.max() == coarse["peak_force"].max()
    frames = coarse["time"].values[::4]
    for start in coarse["contact_start"].values:
        assert joint.touched[np.searchsorted(frames, start)]


def test_compared_forces_reach_their_peaks(coarse):
    """Contract: both lines of a comparison reach the largest contact force."""
    drawn = comparison(coarse, coarse)
    axes = next(each for each in drawn if "slider pin" in " ".join(each.get_ylabel().split()))
    factor = 1e-3 if "kN" in axes.get_ylabel() else 1.0
    for each in axes.lines[:2]:
        assert np.max(each.get_ydata()) == pytest.approx(factor * float(coarse["peak_force"].max()), rel=1e-12)


def test_torque_of_a_controller_is_drawn(servo, tmp_path):
    """Contract: a run without a drive has the picture of its controller's torque, and its work among the energies."""
    (axes,) = torque(servo)
    assert axes.get_ylabel().replace("\n", " ").startswith("torque of actuator of crank")
    drawn = line(axes, "with clearance")[:, 1]
    sampled = servo["control_torque"].values[:, 0]
    np.testing.assert_allclose(np.delete(drawn, int(np.argmax(np.abs(drawn)))), sampled, rtol=1e-12)  # beside its located peak
    assert np.max(np.abs(drawn)) == float(servo["peak_control_torque"][0])
    balance = energy(servo)[0]
    drawn = line(balance, "work of motors and actuators")[:, 1]
    assert servo["motor_work"].values[-1] > 0.1
    np.testing.assert_allclose(drawn / drawn[-1], (servo["motor_work"] / servo["motor_work"][-1]).values, rtol=1e-12)
    assert "torque" in [path.stem for path in draw_all(servo, None, tmp_path, None)]
    names = [each.get_ylabel().replace("\n", " ").partition(" [")[0] for each in comparison(servo, servo)]
    assert {"torque of actuator of crank", "work"} <= set(names)
