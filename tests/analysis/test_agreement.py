"""Measures of agreement of a run with measured curves."""

import math

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import scissordyn as sd
from scissordyn.analysis.agreement import agreement, matched_events, rises
from scissordyn.file.export import export

TIME = np.linspace(0.0, 1.0, 1001)  # [s] instants of the made-up curves


def sine(phase=0.0, scale=1.0, offset=0.0):
    return scale * np.sin(2.0 * math.pi * 5.0 * TIME + phase) + offset


@pytest.fixture
def run():
    angle = xr.DataArray(sine()[:, None], dims=("time", "body"), attrs={"units": "rad"})
    return xr.Dataset({"angle": angle}, coords={"time": TIME, "body": ["arm"]})


def record(values, time=TIME):
    return sd.Measured(time, ("angle of arm",), np.asarray(values)[:, None], ("rad",))


def of(run, measured):
    found = agreement(run, measured).drop_vars("column_unit")
    return {str(name): float(value.values[0]) for name, value in found.data_vars.items() if value.dims == ("column",)}


def test_same_curves(run):
    """Contract: no error, and all events at their times."""
    found = of(run, record(sine()))
    assert found["rmse"] == found["bias"] == found["peak_error"] == found["event_deviation"] == 0.0
    assert found["correlation"] == pytest.approx(1.0)
    assert found["explained"] == 1.0
    assert found["matched_events"] == found["events"] == found["run_events"] == 5.0


def test_offset_scale_and_delay(run):
    """Closed form: an offset is the bias, a factor the error of the peak, a delay that of the events."""
    found = of(run, record(sine(offset=-0.1)))
    assert found["bias"] == pytest.approx(0.1)
    assert found["rmse"] == pytest.approx(0.1)
    assert found["nrmse"] == pytest.approx(0.05, rel=1e-3)
    found = of(run, record(sine(scale=0.8)))
    assert found["peak_error"] == pytest.approx(0.25, rel=1e-4)
    assert found["explained"] == pytest.approx(1.0 - (0.2 / 0.8) ** 2, rel=1e-6)
    found = of(run, record(sine(phase=0.2)))  # measured earlier by 0.2 rad
    assert found["event_lag"] == pytest.approx(0.2 / (10.0 * math.pi), rel=1e-3)
    assert found["correlation"] == pytest.approx(math.cos(0.2), abs=1e-4)


def test_only_the_common_time_counts(run):
    """Contract: instants outside the run are left out and counted."""
    found = agreement(run, record(np.sin(10.0 * math.pi * (TIME + 0.5)), TIME + 0.5))
    assert found.attrs["left_out"] == 500
    assert float(found["rmse"][0]) < 1e-9
    with pytest.raises(sd.InputError, match="0 instants in common"):
        agreement(run, record(sine(), TIME + 5.0))


def test_events_are_matched_once():
    """Closed form: rises between instants; an event without a partner is left out."""
    assert rises(np.array([0.0, 1.0, 2.0]), np.array([0.0, 2.0, 0.0]), 1.0).tolist() == [0.5]
    assert matched_events(np.array([1.0, 2.0, 3.0]), np.array([1.1, 2.9])) == pytest.approx([0.1, -0.1])
    assert matched_events(np.array([1.0]), np.empty(0)).size == 0


def test_contact_forces_have_their_own_peaks(clearance_run, tmp_path, answer):
    """Contract: the command on a run and what it exports: peaks between samples are those of the contact table."""
    sd.save(clearance_run, tmp_path / "run.nc")
    export(clearance_run, tmp_path / "all.csv")
    names = ["time [s]", "normal_force of A [N]", "angle of unit 1/bar 1 [rad]"]
    pd.read_csv(tmp_path / "all.csv")[names].to_csv(tmp_path / "measured.csv", index=False)
    files = [str(tmp_path / name) for name in ("run.nc", "measured.csv", "figures")]
    said = answer("compare", *files[:2], "-o", files[2])
    assert (tmp_path / "figures" / "agreement.png").stat().st_size > 10_000
    force = np.nanmax(clearance_run["normal_force"].sel(joint="A").values)
    peak = float(clearance_run["peak_force"].values.max())
    assert f"{100.0 * (peak - force) / force:+.3g} %" in said
    assert "correlation" in said


@pytest.mark.parametrize("after", [0.0, 0.5])
def test_a_run_against_its_own_samples(clearance_run, after):
    """Identity: the located largest force is at the instant of the largest sample, in the whole run and in a part of it."""
    time = clearance_run["time"].values
    force = clearance_run["normal_force"].sel(joint="A").values
    part = time >= after * time[-1]
    measured = sd.Measured(time[part], ("normal_force of A",), force[part, None], ("N",))
    found = agreement(clearance_run, measured).isel(column=0)
    assert abs(float(found["peak_lag"])) <= float(np.diff(time).max())
    assert 0.0 <= float(found["peak_error"]) < 0.1


def test_wrong_files_leave_nothing(clearance_run, tmp_path, answer):
    """Bad input: units of another dimension and times that run backwards end with status 2 and no picture."""
    sd.save(clearance_run, tmp_path / "run.nc")
    for text in ("time [s], angle of slider [mm]\n0, 1\n1, 2\n", "time [s], angle of unit 1/bar 1 [deg]\n0, 1\n-1, 2\n"):
        (tmp_path / "bad.csv").write_text(text)
        files = [str(tmp_path / name) for name in ("run.nc", "bad.csv", "figures")]
        assert answer("compare", *files[:2], "-o", files[2], status=2)
        assert not (tmp_path / "figures").exists()
