"""Many cases of one mechanism, and the shared keywords of `Options`, `simulate` and `simulate_many`."""

import dataclasses
import inspect
import math
import multiprocessing
import os
import signal
import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import scissordyn as sd
from scissordyn.run.measure import MEASURES, Ended, Measure
from scissordyn.run.rows import Worker

CASES = 12  # Number of cases in a batch

# Names of measures that are computed during a run, not from samples
ACCUMULATED = tuple(name for name, measure in MEASURES.items() if not (measure.sampled or measure.static))


def arm(**clearance: Any) -> sd.Mechanism:
    """Return the paper's array with a clearance at joint A and a tracked point."""
    loose = sd.scissor(units=2).with_clearance("A", sd.Clearance(0.5e-3, **clearance)).driven(speed=sd.rpm(150))
    return loose.track("tip", "unit 2/bar 1", "end", 1e-3)


def test_page_of_measures():
    """Contract: docs/measures.md has every measure."""
    page = (Path(__file__).parents[2] / "docs" / "measures.md").read_text(encoding="utf-8")
    assert not [name for name in MEASURES if f"`{name}`" not in page]


# Values of the varied parameters, in SI units, by path
OVER = {
    "A.clearance": np.linspace(1e-4, 7e-4, CASES),
    "drive.speed": sd.rpm(1) * np.linspace(250.0, 100.0, CASES),
    "slider.mass": np.repeat([5.0, 2.0, 8.0], CASES // 3),  # with which the model is eliminated anew
}


@pytest.fixture(scope="module", params=["frictionless", "lugre", "hard"])
def case(request):
    """Return a mechanism and its batch on one thread."""
    laws = {"lugre": {"friction": sd.LuGre(0.05)}, "hard": {"friction": sd.Ambrosio(0.05), "contact": "hard"}}
    mechanism = arm(**laws.get(request.param, {}))
    return mechanism, sd.simulate_many(mechanism, OVER, until=0.02, measures=ACCUMULATED, threads=1)


def test_case_equals_a_single_run(case):
    """Identity: every measure is that of `simulate`, bit for bit, independent of earlier cases on the thread."""
    mechanism, batch = case
    for k in range(CASES):
        changed = mechanism
        for name, values in OVER.items():
            changed = changed.replace(name, values[k])
        run, one = sd.simulate(changed, until=0.02, samples=2), batch.isel(case=k).sel(joint="A")
        np.testing.assert_equal(float(one["peak_force"]), float(run["peak_force"].max()))
        if "peak_force_estimate" in run:
            assert np.isnan(one["peak_force"])
            assert float(one["peak_force_estimate"]) == float(run["peak_force_estimate"].max())
        assert float(one["contact_count"]) == run.sizes["contact"] > 0
        assert float(one["first_contact"]) == float(run["contact_start"][0])
        assert float(one["peak_approach_speed"]) == float(run["approach_speed"].max())
        assert float(one["peak_drive_torque"][0]) == float(run["peak_drive_torque"][0])
        for name in ("peak_pressure_velocity", "pressure_distance", "peak_indentation"):
            assert float(one[name]) == float(run[name].sel(joint="A")), name
        for name in ("peak_track_deviation", "rms_track_deviation", "settling_time"):
            np.testing.assert_array_equal(one[name].values, run[name].values, err_msg=name)
        assert np.isnan(one["deployment_time"])
        for name in ("drive_work", "damping_loss", "friction_loss"):
            assert float(one[name]) == float(run[name][-1]), name


@pytest.mark.parametrize("contact", ["compliant", "hard"])
def test_pressure_times_sliding_distance(contact):
    """Closed form: m g/(2 R L) omega R t for a rotor that rests in its bearing; the integral over samples where it bounces."""
    gap = sd.Clearance(1e-4, contact=contact)
    rotor = sd.Body("rotor", mass=3.0, inertia=0.01, points={"c": (0.0, 0.0)}, position=(0.0, 0.0), angle=0.0)
    pin = sd.Revolute("A", ("rotor", "c"), ("ground", "O"), clearance=gap)
    turning = sd.Mechanism((rotor,), (pin,), ground=(("O", (0.0, 0.0)),)).driven(speed=20.0, body="rotor")
    resting = sd.simulate(turning, until=0.05, samples=2, start="static")
    surfaces = gap.surfaces
    assert resting["pressure_distance"].item() == pytest.approx(3.0 * 9.81 * 20.0 * 0.05 / (2.0 * surfaces.length), rel=1e-6)
    falling = sd.simulate(turning, until=0.05, samples=20001)
    size = (falling["normal_force"] * abs(falling["slip_speed"])).sel(joint="A").fillna(0.0)
    area = 2.0 * surfaces.journal_radius * surfaces.length
    expected = np.trapezoid(size, falling["time"]) / area
    assert falling["pressure_distance"].item() == pytest.approx(expected, rel=1e-2)


def test_threads_and_order_of_cases(case):
    """Identity: two threads, and the cases in another order, give the same values bit for bit."""
    mechanism, batch = case
    order = np.random.default_rng(1).permutation(CASES)
    again = sd.simulate_many(
        mechanism, {name: values[order] for name, values in OVER.items()}, until=0.02, measures=ACCUMULATED, threads=2
    )
    for name in ACCUMULATED:
        np.testing.assert_array_equal(again[name].values, batch[name].values[order], err_msg=name)


def test_many_cases_on_duplicates(duplicated):
    """Identity: with 64 cases, which processes or threads share, all measures have the bits of one thread."""
    over = {name: np.resize(values, 64) for name, values in OVER.items()}
    one, two = (sd.simulate_many(arm(), over, until=2e-3, measures=ACCUMULATED, threads=threads) for threads in (1, 2))
    for name in (*ACCUMULATED, "status", "warnings"):
        np.testing.assert_array_equal(two[name].values, one[name].values, err_msg=name)


def test_a_measure_changes_this_process(duplicated):
    """Contract: functions of the user run in the process that calls `simulate_many`, also for many cases."""
    seen = list[float]()

    def length(ended: Ended) -> float:
        seen.append(ended.driver.time)
        return 0.0

    measures = {"own": Measure("1", "nothing", (), length)}
    sd.simulate_many(arm(), {"A.clearance": np.linspace(1e-4, 2e-4, 64)}, until=1e-4, measures=measures, threads=2)
    assert seen == [1e-4] * 64


def test_killed_duplicates_lose_their_cases_only(duplicated, monkeypatch):
    """Contract: cases whose process dies have failed, with their cause; the others are complete."""
    process, computed = os.getpid(), Worker.rows

    def dying(worker, group, case):
        if 30 in group and os.getpid() != process:
            os.kill(os.getpid(), signal.SIGKILL)
        return computed(worker, group, case)

    monkeypatch.setattr(Worker, "rows", dying)
    batch = sd.simulate_many(arm(), {"A.clearance": np.linspace(1e-4, 2e-4, 64)}, until=1e-4, threads=2)
    failed = batch["status"].values == "failed"
    assert failed[30]
    assert set(batch["cause"].values[failed]) == {"the processes that computed it died"}
    assert set(batch["status"].values[~failed]) == {"complete"}
    assert 1 <= failed.sum() == batch.attrs["failed_cases"] <= 16


@pytest.mark.parametrize("path", ["gravity", "A.clearance"])
def test_forces_of_cases_in_one_pass(path):
    """Identity: reactions of cases that are evaluated together, or differ in gravity, are those of each case alone."""
    values = np.array([9.81, 1.62, 9.81, 3.71]) if path == "gravity" else 1e-4 * np.arange(1.0, 5.0)

    def forces(*chosen):
        batch = sd.simulate_many(arm(), {path: np.repeat(chosen, 8)}, until=2e-3, measures=["peak_reaction"], threads=1)
        return np.asarray(batch["peak_reaction"].values[::8])

    np.testing.assert_array_equal(forces(*values), [forces(value)[0] for value in values])


def test_failed_case():
    """Contract: a failed case has its cause and NaN, and does not affect the others."""
    batch = sd.simulate_many(arm(), {"A.clearance": [1e-4, 2e-4, -1.0, 3e-4]}, until=0.01, threads=2)
    assert batch["status"].values.tolist() == ["complete", "complete", "failed", "complete"]
    assert "clearance" in str(batch["cause"].values[2])
    assert np.isnan(batch["peak_force"].values[2]).all()
    assert batch.attrs["failed_cases"] == 1
    short = sd.simulate_many(arm(), {"A.clearance": [1e-4]}, until=0.01, most_steps=20)
    assert "20 steps are not enough" in str(short["cause"].values[0])


@pytest.mark.parametrize("threads", [1, 2])
def test_interrupted_batch(threads, request):
    """Contract: an interrupted batch has its complete cases, and the others are pending."""
    if threads > 1:
        request.getfixturevalue("duplicated")

    def stop(done: int, total: int) -> None:
        if done >= 1:
            raise KeyboardInterrupt

    before = threading.active_count()  # libraries keep threads of their own
    found = sd.simulate_many(arm(), {"A.clearance": np.full(400, 2e-4)}, until=0.05, threads=threads, progress=stop)
    assert found.attrs["status"] == "interrupted"
    states = found["status"].values.tolist()
    assert states.count("complete") >= 1
    assert states.count("pending") >= 1
    assert threading.active_count() <= before
    assert not multiprocessing.active_children()
    assert not np.isnan(found["peak_force"].values[np.array(states) == "complete"]).any()


@pytest.mark.parametrize(
    ("over", "options", "says"),
    [
        ({}, {}, "no numbers to vary"),
        ({"A.clearence": [1e-4]}, {}, "did you mean 'clearance'"),
        ({"A.clearance": [[1e-4]]}, {}, "one-dimensional array"),
        ({"A.clearance": [1e-4, 2e-4], "drive.speed": [1.0, 2.0, 3.0]}, {}, "the parameters have 2 and 3 values"),
        ({"A.clearance": [1e-4]}, {"measures": ("peak_fource",)}, "did you mean 'peak_force'"),
        ({"A.clearance": [1e-4]}, {"threads": 0}, "threads = 0"),
        ({"A.clearance": [1e-4]}, {"measures": "peak_force"}, "'peak_force'; expected a sequence of names; for example"),
        ([{}], {}, r"over = \[\{\}\]; expected a mapping of parameter paths to values"),
    ],
)
def test_refused_batches(over, options, says):
    """Contract: wrong arguments are refused before anything is computed."""
    with pytest.raises(sd.InputError, match=says):
        sd.simulate_many(arm(), over, until=0.01, **options)


def test_fraction_in_contact():
    """Limit: the fraction in contact is that of many samples, and zero without contacts."""
    batch = sd.simulate_many(arm(), {"A.clearance": [2e-4]}, until=0.05)
    run = sd.simulate(arm().replace("A.clearance", 2e-4), until=0.05, samples=20_001)
    sampled = float(run["in_contact"].sel(joint="A").mean())
    assert float(batch["contact_fraction"][0, 0]) == pytest.approx(sampled, abs=1e-3)
    early = sd.simulate_many(arm(), {"A.clearance": [7e-4]}, until=1e-4, measures=("contact_fraction", "first_contact"))
    assert float(early["contact_fraction"][0, 0]) == 0.0
    assert math.isinf(float(early["first_contact"][0, 0]))


def test_deployment_time():
    """Closed form: a bar at constant speed turns by 0.5 rad until its latch locks; the time is infinite if it does not lock."""
    one = sd.Body("bar", 1.0, 0.1, points={"pin": (0.0, 0.0)}, angular_velocity=2.0)
    swinging = sd.Mechanism(
        bodies=(one,),
        joints=(sd.Revolute("O", ("bar", "pin"), ("ground", "O")),),
        ground=(("O", (0.0, 0.0)),),
        latches=(sd.Latch("latch", "bar", 0.5),),
        gravity=0.0,
    )
    batch = sd.simulate_many(swinging, {"body.bar.angular_velocity": [2.0, 1.0, 0.1]}, until=1.0, measures=("deployment_time",))
    np.testing.assert_allclose(batch["deployment_time"][:2], [0.25, 0.5], rtol=1e-9)
    assert np.isinf(batch["deployment_time"][2])


FIELDS = {field.name: field.default for field in dataclasses.fields(sd.Options)}  # Default values of the options by name


@pytest.mark.parametrize("function", [sd.simulate, sd.simulate_many])
def test_keywords_have_names_order_and_defaults_of_the_options(function):
    """Contract: keywords with an option's name have its default and the order of the options."""
    keywords = inspect.signature(function).parameters
    shared = [name for name in keywords if name in FIELDS]
    assert shared == [name for name in FIELDS if name in keywords]
    assert all(keywords[name].default == FIELDS[name] for name in shared if FIELDS[name] is not dataclasses.MISSING)


def test_simulate_has_every_option():
    """Contract: `simulate` takes every option."""
    assert set(FIELDS) <= set(inspect.signature(sd.simulate).parameters)


def test_deviations_from_a_path_with_a_jerk():
    """Contract: where a latch stops the commanded path, a batch has the deviations and the warning of single runs."""
    opening = sd.scissor(units=1, gravity=9.81).with_parts(
        {
            "components": (sd.TorsionSpring("spring", "unit 1/bar 1", stiffness=2000.0, free_angle=sd.degrees(90)),),
            "latches": (sd.Latch("latch", "unit 1/bar 1", sd.degrees(45)),),
        }
    )
    opening = opening.with_clearance("A", sd.Clearance(0.2e-3)).track("tip", "unit 1/bar 1", "end")
    run = sd.simulate(opening, until=0.2)
    assert "deviations of tracked points err by up to" in run.attrs["warnings"]
    batch = sd.simulate_many(opening, {"A.clearance": [0.2e-3]}, until=0.2, measures=("peak_track_deviation",))
    assert batch["cause"].item() == ""
    assert batch["peak_track_deviation"].values[0] == pytest.approx(run["peak_track_deviation"].values, rel=1e-12)
    assert "deviations of tracked points err by up to" in batch["warnings"].item()
