"""What a run holds of contacts and peaks at its end, and at an instant at which its accelerations are not defined."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

import scissordyn as sd
from scissordyn.file import export, netcdf, output_file
from scissordyn.plan.plan import plan
from scissordyn.run import configuration, store
from scissordyn.run.advance import driver, trajectory
from scissordyn.run.answer import dataset, events
from scissordyn.run.configuration import write_configuration
from scissordyn.run.options import Options

ENDS = ("peak_force", "peak_time", "impulse", "contact_damping_loss", "contact_friction_loss")


@pytest.fixture(scope="module")
def arm() -> sd.Mechanism:
    """The array with friction in its clearance joint."""
    return sd.scissor().with_clearance("A", sd.Clearance(2e-4, friction=sd.LuGre(0.1))).driven(speed=sd.rpm(150))


def test_contact_open_at_the_end_has_what_it_had_so_far(arm: sd.Mechanism) -> None:
    """Cross-check: peak and impulse of an open contact are those of the samples of a longer run up to that instant."""
    whole = sd.simulate(arm, until=0.03, samples=30001, rtol=1e-9, atol=1e-9)
    k = int(np.argmax(whole["peak_force"].values))
    start, duration = float(whole["contact_start"][k]), float(whole["contact_duration"][k])
    end = start + 0.3 * duration
    short = sd.simulate(arm, until=end, samples=11, rtol=1e-9, atol=1e-9)
    assert short.sizes["contact"] == k + 1
    assert np.isnan(short["contact_duration"].values[k])
    assert np.isnan(short["rebound_speed"].values[k])
    inside = (whole["time"].values >= start) & (whole["time"].values <= end)
    time, normal = whole["time"].values[inside], whole["normal_force"].sel(joint="A").values[inside]
    force = np.hypot(normal, whole["friction_force"].sel(joint="A").values[inside])
    # between the last sample and the end the force rises by less than its largest slope times the distance of two samples
    slack = float(np.max(np.abs(np.diff(force))))
    assert force.max() <= short["peak_force"].values[k] <= force.max() + slack
    assert short["peak_force"].values[k] < 0.99 * whole["peak_force"].values[k]
    assert short["impulse"].values[k] == pytest.approx(np.trapezoid(normal, time), rel=2e-2)


DEVIATIONS = ("peak_track_deviation", "peak_track_deviation_time", "rms_track_deviation", "settling_time")


def undefined_from(whole: xr.Dataset, last: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let accelerations be undefined after a sample."""
    evaluate = trajectory.record

    def undefined_after(maps, system, samples):
        found = evaluate(maps, system, samples)
        found.A[samples.time > whole["time"].values[last]] = np.nan
        return found

    monkeypatch.setattr(trajectory, "record", undefined_after)


def test_cut_run_is_the_run_up_to_there(arm: sd.Mechanism, monkeypatch: pytest.MonkeyPatch) -> None:
    """Contract: a run that is cut at a sample within a contact has the events, peaks and integrals of one that ends there."""
    tracked = arm.track("tip", "unit 2/bar 1", "end", 1e-3)
    whole = sd.simulate(tracked, until=0.03, samples=3001)
    held = np.flatnonzero(whole["in_contact"].sel(joint="A").values)
    k = int(np.argmax(whole["peak_force"].values))
    inside = held[(whole["time"].values[held] > whole["contact_start"].values[k])]
    last = int(inside[len(inside) // 3])
    undefined_from(whole, last, monkeypatch)
    short_of_it = sd.simulate(tracked, until=0.03, samples=3001)
    monkeypatch.undo()
    until = float(whole["time"][last])
    short = sd.simulate(tracked, until=until, samples=11)
    assert short_of_it.attrs["status"] == "failed"
    assert short_of_it.attrs["cause"].startswith(f"stopped at t = {whole['time'].values[last + 1]:.9g} s")
    assert short_of_it.sizes["time"] == last + 1
    assert short_of_it.attrs["end"] == until
    assert short_of_it.sizes["contact"] == short.sizes["contact"]
    for name in (*ENDS, "peak_drive_torque", "peak_pressure_velocity", "contact_duration"):
        np.testing.assert_array_equal(short_of_it[name].values, short[name].values, err_msg=name)
    for name in DEVIATIONS:
        # the table of the ideal mechanism has other rows for another end
        np.testing.assert_allclose(short_of_it[name].values, short[name].values, rtol=1e-6, err_msg=name)
        assert np.isfinite(short_of_it[name].values).all()


def test_writers_do_not_simulate(arm: sd.Mechanism, monkeypatch: pytest.MonkeyPatch) -> None:
    """Contract: a Dataset is made of a trajectory and its record without any call that advances a mechanism."""
    options = Options(until=2e-3, samples=11)
    path = trajectory.compute(plan(arm), options)
    path, record = trajectory.recorded(path.plan, options, path)

    def refuse(*arguments: object, **named: object) -> None:
        raise AssertionError("simulated")

    monkeypatch.setattr(driver.Driver, "advance", refuse)
    made = dataset.results(path.plan, write_configuration(arm, options), path, record).dataset()
    assert made.sizes["time"] == 11
    modules = (dataset, events, configuration, store, netcdf, export, output_file)
    assert not [module.__name__ for module in modules if {"compute", "Driver", "simulate"} & set(vars(module))]
