"""Summary of a run, grouped warnings, and the instants of `samples = "auto"`."""

import json
import math

import numpy as np
import pytest
import xarray as xr
from tests.build import one_line_error

import scissordyn as sd
from scissordyn.cli.show import run_record
from scissordyn.explore.answers import cards
from scissordyn.laws.elastic.persson import Persson
from scissordyn.plan.plan import plan
from scissordyn.record.sampling import equally_spaced, spread_samples, time_mean
from scissordyn.record.summary import PointAnswer, at_limit
from scissordyn.record.warn import EXPLANATION_PREFIX, force_at_equal_energy, warning_lines
from scissordyn.record.xarray_dataset import as_dataset
from scissordyn.run.instants import SAMPLES_MAX, add_recorded_samples, choose_rows
from scissordyn.run.simulate import compute_results
from scissordyn.run.trajectory import compute
from scissordyn.units import short
from scissordyn.warning import RunWarning, group, line, warning

TOLERANCE = 0.05e-3  # [m] tolerance of a tracked point


def controlled(limit):
    """Return a slider-crank with a tracked slider pin and a controller with a limit."""
    crank = sd.slider_crank().with_clearance("slider pin", sd.Clearance(2e-4)).track("pin", "rod", "end", TOLERANCE)
    return crank.controlled(sd.PID(30.0, 0.5, 5.0, limit=limit), reference=sd.Cycloidal(0.0, 2.0, 0.05))


@pytest.fixture(scope="module")
def weak():
    return sd.simulate(controlled(2.0), until=0.1, samples=2001)


def test_tracked_point_against_its_tolerance(weak):
    """Contract: the summary has the located deviation and the tolerance, and says in words and data whether it is met."""
    (point,) = weak.scissordyn.summary().points
    assert point.deviation == float(weak["peak_track_deviation"][0]) >= float(weak["track_deviation"].max())
    assert point.tolerance == TOLERANCE
    assert point.met is False
    assert f"not met, by a factor of {point.deviation / TOLERANCE:.3g}" in str(point)
    record = run_record(weak)["summary"]
    assert record["points"][0]["met"] is False
    assert record["met"] is False
    json.dumps(record, allow_nan=False)


def test_part_of_a_run_has_no_summary(weak):
    """Contract: the summary of part of a run is refused in one line; fewer samples over the whole run are no part of it."""
    for part in (weak.isel(time=slice(1000)), weak.isel(time=slice(1, None)), weak.isel(time=7), weak.isel(time=[])):
        with one_line_error("summary of part of a run"):
            part.scissordyn.summary()
    few = weak.isel(time=slice(None, None, 100))
    assert repr(few.scissordyn.summary().force) == repr(weak.scissordyn.summary().force)  # NaN is not equal to itself
    assert len(sd.plot.track(weak, end=0.05)) == 1


def test_run_that_ends_early_has_a_summary():
    """Contract: a run that ended between two samples is whole; without its last sample it is part of a run."""
    bars = {"ground": 0.2, "crank": 0.15, "coupler": 0.1, "rocker": 0.1}
    run = sd.simulate(sd.four_bar(**bars).driven(speed=10.0), until=1.0, samples=2001)
    assert run.attrs["status"] == "failed"
    assert float(run["time"][-1]) < run.attrs["end"]
    assert run.scissordyn.summary().force is not None
    with one_line_error("summary of part of a run"):
        run.isel(time=slice(-1)).scissordyn.summary()
    assert sd.simulate(sd.four_bar(**bars).driven(speed=10.0), until=1.0, most_steps=1).scissordyn.summary().force is None


def test_actuator_against_its_limit(weak):
    """Contract: the time at the limit is that of the samples there; a strong actuator never reaches its limit."""
    (actuator,) = weak.scissordyn.summary().actuators
    there = int(np.sum(np.abs(weak["control_torque"].values[:, 0]) >= 2.0 * (1.0 - 1e-9)))
    assert there > 0
    assert actuator.limit == 2.0
    assert actuator.time_at_limit == pytest.approx(there * 0.1 / 2000, rel=0.05)
    assert "at its limit of 2 N m" in str(actuator)
    strong = sd.simulate(controlled(80.0), until=0.02, samples=201).scissordyn.summary().actuators[0]
    assert strong.time_at_limit == 0.0
    assert "of its limit of 80 N m" in str(strong)


def test_intervals_at_the_limit():
    """Closed form: samples 2 to 4 of six are at the limit from 1.5 to 4.5; there are none without a limit."""
    time, torque = np.arange(6.0), np.array([0.0, 1.0, 5.0, -5.0, 5.0, 0.0])
    assert at_limit(time, torque, 5.0) == [(1.5, 4.5)]
    assert at_limit(time, torque, 6.0) == []
    assert at_limit(time, torque, None) == []
    assert at_limit(time, np.full(6, 5.0), 5.0) == [(0.0, 5.0)]


def test_span_of_a_scissor():
    """Closed form: n units of bars L at the angle a span n L cos a by L sin a; each side is compared with itself."""
    ways = (
        (70.0, 20.0, "grows along x and shrinks along y"),
        (20.0, 70.0, "shrinks along x and grows along y"),  # a lift that rises, drawn on its side
        (40.0, 40.0, "keeps its size along x and y"),
    )
    for first, last, said in ways:
        ideal = sd.scissor(units=3, bar_length=1.5, angle=sd.degrees(first)).driven(
            motion=sd.Cycloidal(sd.degrees(first), sd.degrees(last), 1.0)
        )
        run = sd.simulate(ideal, until=1.0, samples=11)
        span = run.scissordyn.summary().span
        for side, angle in ((span.start, first), (span.end, last)):
            turned = math.radians(angle)
            assert side == pytest.approx((4.5 * math.cos(turned), 1.5 * math.sin(turned)), rel=1e-6)
        assert span.change == said
        card = next(card for card in cards(run.scissordyn.summary()) if card["title"].startswith("span"))
        assert card["value"] == " x ".join(short(side, "m") for side in span.end)
        assert card["detail"] == f"{said}; {' x '.join(short(side, 'm') for side in span.start)} at the start"


def test_largest_force_work_and_text(weak):
    """Contract: the largest force is in the contact table, the work at the end, and each answer has one line."""
    summary = weak.scissordyn.summary()
    worst = int(np.argmax(weak["peak_force"].values))
    assert summary.force.force == float(weak["peak_force"][worst])
    assert summary.force.joint == str(weak["contact_joint"].values[worst])
    assert summary.work["motors and actuators"] == float(weak["motor_work"][-1])
    assert len(str(summary).splitlines()) == 5


def fast(name, count, contacts, speed):
    """Return a warning about contacts that start fast."""
    return warning("fast", name, fast=count, contacts=contacts, limit=0.051, speed=speed)


# Warnings of a made-up run, some of them of one kind
WARNINGS = [
    fast("A", 7, 66, 0.199),
    fast("B 2", 23, 103, 0.408),
    warning("unbalanced", residual=3.0, share="", finer="a shorter step"),
    fast("C", 9, 66, 0.3),
]


def test_similar_warnings_are_grouped():
    """Contract: one line with ranges of values and the worst name; other warnings are unchanged."""
    short = [line(alike) for alike in group(WARNINGS)]
    assert len(short) == 2
    assert short[0].startswith("3 joints ('A', 'B 2', 'C'): 7 to 23 of 66 to 103 contacts start faster than 0.051 m/s")
    assert "(up to 0.199 to 0.408 m/s)" in short[0]
    assert short[0].endswith("the worst is 'B 2'")
    assert short[1] == str(WARNINGS[2])
    assert group(WARNINGS[:1]) == [WARNINGS[:1]]
    assert len(group([warning("doubt", name, slot="friction", doubt=name) for name in "AB"])) == 2


def test_warnings_as_data():
    """Contract: the attribute of a run gives the same warnings; a warning without a needed value is an error."""
    data = json.loads(json.dumps([item.data for item in WARNINGS]))
    assert [RunWarning(**item) for item in data] == WARNINGS
    with pytest.raises(KeyError):
        str(warning("fast", "A"))


def test_meaning_of_fast_contacts():
    """Closed form: forces grow as v for line contacts, as v^(2/3) at constant pressure; eight times the speed is a factor 2."""
    _, meant, *_ = warning_lines(WARNINGS)
    assert meant.startswith(EXPLANATION_PREFIX)
    assert "a factor of 2 in the fastest contact, at 'B 2'" in meant


def test_laws_at_equal_energy():
    """Closed form: forces of K delta and 4 K delta at equal energy differ by 2; equal laws agree."""
    contact = sd.Clearance(1e-4).surfaces
    soft, hard = (sd.law("stiffness", "linear")(stiffness) for stiffness in (1e8, 4e8))
    assert force_at_equal_energy(soft, hard, contact, 1e-5) == pytest.approx(2.0, rel=1e-4)
    assert force_at_equal_energy(hard, soft, contact, 1e-5) == pytest.approx(0.5, rel=1e-4)
    assert force_at_equal_energy(Persson(), Persson(), contact, 1e-5) == pytest.approx(1.0, rel=1e-4)


def test_auto_samples_meet_every_peak(clearance_array, clearance_run):
    """Contract: the sampled force has the located peak of each contact; the motion at shared instants is the same."""
    plain = clearance_run
    auto = sd.simulate(clearance_array, until=0.05, samples="auto")
    force = auto["normal_force"].sel(joint="A")
    instants = auto["contact_start"].values + auto["peak_time"].values
    assert np.isin(instants, auto["time"].values).all()
    assert force.sel(time=instants).values == pytest.approx(auto["peak_force"].values, rel=1e-8)
    assert float(plain["normal_force"].max()) < float(force.max())
    np.testing.assert_array_equal(auto["position"].sel(time=plain["time"]), plain["position"])
    assert auto.sizes["time"] <= SAMPLES_MAX
    wanted = compute_results(clearance_array, sd.Options(0.05), curves=True)
    np.testing.assert_array_equal(wanted["position"].values, plain["position"].values)
    drawn = as_dataset(wanted.finer)
    xr.testing.assert_identical(drawn.drop_attrs(), auto.drop_attrs())
    assert drawn.attrs == as_dataset(wanted).attrs


@pytest.mark.parametrize("events", ["located", "crossed"])
@pytest.mark.parametrize("contact", ["compliant", "hard"])
def test_auto_samples_have_events_and_located_maxima(events, contact):
    """Identity: the samples are those of a run with these instants, and include all events."""
    joint = sd.Clearance(5e-4, contact=contact, friction=sd.Ambrosio(0.1))
    array = sd.scissor(units=2).driven(speed=sd.rpm(150)).with_clearance("A", joint)
    options = sd.Options(0.05, samples="auto", events=events)
    path = add_recorded_samples(compute(plan(array), options, curves=True))
    again = compute(plan(array), options, times=path.samples.time)
    ends = np.isin(path.samples.time, path.steps[0])  # behind the impact of a hard contact, back on the constraints
    assert ends.sum() > 100
    inside = ~ends
    for mine, other in zip(path.samples, again.samples, strict=True):
        np.testing.assert_array_equal(mine[inside], other[inside])
    scale = np.abs(again.samples.state).max(axis=0)
    if contact == "compliant":
        assert np.max(np.abs(path.samples.state - again.samples.state)[ends] / scale) < 1e-6
    log = path.log[path.log["time"] <= path.end]
    rounding = 4.0 * np.spacing(log["time"])
    assert np.all(np.abs(path.samples.time[:, None] - log["time"]).min(axis=0) <= rounding)


def test_recorded_steps_are_thinned_out(clearance_array, monkeypatch):
    """Limit: a full record keeps events and largest values, and every other one of the other steps."""
    whole = compute(plan(clearance_array), sd.Options(0.3), curves=True)
    monkeypatch.setattr("scissordyn.run.trajectory.RECORDED_STEPS_MAX", 1024)
    path = compute(plan(clearance_array), sd.Options(0.3), curves=True)
    assert whole.recorded.time.size > 2000
    assert path.recorded.every[0] > 1
    assert path.recorded.time.size < 0.7 * whole.recorded.time.size
    assert np.isin(path.log["time"], path.recorded.time).all()
    rows, every_row = (
        {(time, *state) for time, state in zip(run.time, run.state, strict=True)} for run in (path.recorded, whole.recorded)
    )
    assert rows <= every_row


def test_number_of_auto_samples_is_limited():
    """Limit: with more contacts than samples every third of their instants is kept."""
    time = np.linspace(0.0, 1.0, 100_000)
    equal = np.linspace(0.0, 1.0, 2001)
    rows = choose_rows(equal, time, time[::2])
    assert 0.4 * SAMPLES_MAX < rows.size <= SAMPLES_MAX - equal.size
    assert np.sum(rows % 2 == 0) == 16_667
    few = choose_rows(equal, time, time[::1000])
    assert np.isin(np.arange(0, 100_000, 1000), few).all()
    assert few.size <= SAMPLES_MAX - equal.size


def test_auto_in_a_case_file(tmp_path):
    """Contract: the word "auto" is read; any other word is refused."""
    case = tmp_path / "case.toml"
    text = '[structure]\nkind = "scissor"\n[drive]\nspeed = "150 rpm"\n[run]\nuntil = "2 ms"\nsamples = "auto"\n'
    case.write_text(text)
    read = sd.read_case(case)
    assert read.run.samples == "auto"
    with pytest.raises(sd.InputError, match="samples"):
        sd.simulate(read.mechanism, until=0.01, samples="many")
    case.write_text(text.replace("auto", "many"))
    with pytest.raises(sd.InputError, match="samples"):
        sd.read_case(case)


def test_means_and_frames_of_samples():
    """Closed form: time means by the trapezoidal rule, of t^2 with its error h^2/6; frames are equally spaced in time."""
    equal = np.linspace(0.0, 1.0, 11)
    assert time_mean(equal**2, equal) == pytest.approx(1.0 / 3.0 + 0.01 / 6.0)
    assert time_mean(np.array([True]), equal[:1]) == 1.0
    time = np.array([0.0, 0.1, 0.2, 0.25, 0.3, 1.0])
    assert not equally_spaced(time)
    assert time_mean(time, time) == pytest.approx(0.5)
    assert spread_samples(time, 2).tolist() == [0, 5]
    assert spread_samples(np.linspace(0.0, 1.0, 11), 3).tolist() == [0, 5, 10]
    assert spread_samples(np.array([0.0, 0.48, 0.5, 0.52, 1.0]), 3).tolist() == [0, 2, 4]


@pytest.mark.parametrize(
    ("servo", "shown"),
    [(7e-9, ", by bending"), (2e-4, " (servo 200 µm, bending 36 mm)"), (40.0, ", by servo")],
)
def test_contributions_to_a_deviation(servo, shown):
    """Contract: those below a thousandth of the largest, such as errors of the integration, are not shown."""
    parts = {"servo": servo, "bending": 0.036, "clearance": 0.0}
    answer = PointAnswer("tip", 0.036, 0.8, None, None, 0.0, parts, dict.fromkeys(parts, 0.0))
    assert str(answer) == f"Tracked point tip: off by up to 36 mm, at 800 ms{shown}; 0 m at the end; no tolerance is given."
