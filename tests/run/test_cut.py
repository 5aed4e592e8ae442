"""Runs that end early: contacts and peaks of a cut run, and Ctrl-C in a part of a larger computation."""

from dataclasses import replace
from importlib import import_module

import numpy as np
import pytest
import xarray as xr

import scissordyn as sd
from scissordyn.casefile import configuration
from scissordyn.casefile.configuration import write_configuration
from scissordyn.cli.main import status_of
from scissordyn.file import export, netcdf, output_file
from scissordyn.plan.plan import plan
from scissordyn.record import dataset, events, store
from scissordyn.record import trajectory as motion
from scissordyn.record.xarray_dataset import as_dataset
from scissordyn.run import trajectory
from scissordyn.run.advance import loop
from scissordyn.run.advance.loop import next_slice
from scissordyn_paper import controlled, periodic, runs
from scissordyn_paper.cases import PaperCase

# Measures of contacts that are known at their end
ENDS = ("peak_force", "peak_time", "impulse", "contact_damping_loss", "contact_friction_loss")


@pytest.fixture(scope="module")
def arm():
    """Return the array with friction in its clearance joint."""
    return sd.scissor().with_clearance("A", sd.Clearance(2e-4, friction=sd.LuGre(0.1))).driven(speed=sd.rpm(150))


def test_contact_open_at_the_end(arm):
    """Cross-check: peak and impulse of an open contact are those of a longer run's samples up to that instant."""
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


# Measures of the deviation of a tracked point
DEVIATIONS = ("peak_track_deviation", "peak_track_deviation_time", "rms_track_deviation", "settling_time")


def undefined_from(whole, last, monkeypatch):
    """Make accelerations undefined after a sample."""
    evaluate = motion.record

    def undefined_after(maps, system, samples):
        found = evaluate(maps, system, samples)
        found.A[samples.time > whole["time"].values[last]] = np.nan
        return found

    monkeypatch.setattr(motion, "record", undefined_after)


def test_cut_run_is_the_run_up_to_there(arm, monkeypatch):
    """Contract: a run cut within a contact has the events, peaks and integrals of a run that ends there."""
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


def test_writers_do_not_simulate(arm, monkeypatch):
    """Contract: a Dataset is made from a trajectory without advancing a mechanism."""
    options = sd.Options(until=2e-3, samples=11)
    path = trajectory.compute(plan(arm), options)
    path, record = trajectory.record_trajectory(path.plan, options, path)

    def refuse(*arguments, **named):
        raise AssertionError("simulated")

    monkeypatch.setattr(loop, "advance", refuse)
    made = as_dataset(dataset.results(path.plan, write_configuration(arm, options), path, record))
    assert made.sizes["time"] == 11
    modules = (dataset, events, configuration, store, netcdf, export, output_file)
    assert not [module.__name__ for module in modules if {"compute", "Driver", "simulate"} & set(vars(module))]


def interrupted(*_, **__):
    """Return the result of an interrupted run."""
    values = {"status": "interrupted", "cause": "stopped at t = 0 s of 1 s: interrupted"}
    return xr.Dataset({"value": ("value", np.zeros(1)), "status": ("value", ["pending"])}, attrs=values)


# Parts of a result that Ctrl-C may interrupt: module, function, and function that uses it
PARTS = {
    "the torque of the ideal mechanism": (
        "scissordyn.run.inverse_dynamics",
        "simulate",
        lambda _: sd.feed_forward(sd.scissor(units=1), sd.ConstantSpeed(1.0), until=0.1),
    ),
    "a run of the paper": ("scissordyn_paper.runs", "simulate", lambda _: runs.compute(PaperCase())),
    "a controlled run": (
        "scissordyn_paper.controlled",
        "simulate",
        lambda _: controlled.compute(controlled.CONTROLLED_RUNS[0]),
    ),
    "a periodic motion": ("scissordyn_paper.periodic", "cycle", lambda _: periodic.examine(periodic.ALL_CASES[0])),
    "a diagram": ("scissordyn_paper.periodic", "bifurcation", lambda folder: periodic.fetch_diagram(folder / "diagram.nc")),
}


@pytest.mark.parametrize("part", PARTS)
def test_interrupted_part(part, tmp_path, monkeypatch):
    """Contract: an interrupted part raises KeyboardInterrupt, so that the rest does not continue."""
    module, name, whole = PARTS[part]
    monkeypatch.setattr(import_module(module), name, interrupted)
    with pytest.raises(KeyboardInterrupt):
        whole(tmp_path)


def test_interrupted_paper_command(tmp_path, monkeypatch, capsys):
    """Contract: the command says where finished runs are, and starts no other run."""
    began = []

    def stopped(*given, **options):
        began.append(given)
        return interrupted()

    monkeypatch.setattr(runs, "simulate", stopped)
    assert status_of(["paper", "-o", str(tmp_path / "out"), "--threads", "1"]) == 130
    assert len(began) == 1
    assert "completed runs are in" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("steps", "seconds", "most", "expected"),
    [(20, 0.01, 2000, 40), (20, 60.0, 2000, 1), (1000, 0.2, 2000, 500), (2000, 1e-6, 2000, 2000), (0, 0.0, 2000, 1)],
)
def test_length_of_slices(steps, seconds, most, expected):
    """Closed form: as many steps as fit into a tenth of a second, at most twice as many as before, and at least one."""
    assert next_slice(steps, seconds, most) == expected


def test_slices_change_nothing(monkeypatch):
    """Identity: a run in slices of one step is bit for bit the run in large ones, with events, friction and cycles."""
    arm = sd.scissor(units=1).with_clearance("A", sd.Clearance(0.5e-3, friction=sd.LuGre(0.1)))
    driven, swung = arm.driven(speed=sd.rpm(150)), arm.driven(sd.Harmonic(0.8, 0.2, 60.0))
    whole = [sd.simulate(driven, until=0.01, samples=51), sd.cycle(swung, cycles=2)]
    monkeypatch.setattr("scissordyn.run.advance.loop.next_slice", lambda *_: 1)
    monkeypatch.setattr("scissordyn.run.advance.driver.FIRST_STEPS", 1)
    cut = [sd.simulate(driven, until=0.01, samples=51), sd.cycle(swung, cycles=2)]
    for one, other in zip(whole, cut, strict=True):
        assert one.equals(other)


def test_ctrl_c_while_the_ideal_mechanism_is_simulated(monkeypatch):
    """Contract: an interrupt during the run of the ideal mechanism ends the run for which it is computed."""
    from scissordyn.run import ideal_path

    arm = sd.scissor(units=1).with_clearance("A", sd.Clearance(0.5e-3)).driven(speed=1.0).track("tip", "slider", "centre")
    compute = ideal_path.compute
    monkeypatch.setattr(ideal_path, "compute", lambda *given, **named: replace(compute(*given, **named), status="interrupted"))
    with pytest.raises(KeyboardInterrupt):
        sd.simulate(arm, until=1e-3, samples=3)
