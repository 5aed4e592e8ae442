"""Long periodic runs, members whose starts differ by round-off, and largest Lyapunov exponents of mechanisms."""

import dataclasses
import math
from unittest.mock import Mock

import numpy as np
import pint
import pytest
import xarray as xr
from tests.build import counts_of, warnings_of

import scissordyn as sd
from scissordyn.components.place import GROUND
from scissordyn.integrate.integration import COUNTS
from scissordyn.laws.damping.none import NoDamping
from scissordyn.record.store import load
from scissordyn.run.stops import drive_period

PERIOD = 0.125  # [s] period of the drive


@pytest.fixture(scope="module")
def settled(frictional):
    """Return fifteen cycles at default tolerance."""
    return sd.cycle(frictional, cycles=15)


@pytest.fixture(scope="module")
def tight(frictional):
    """Return four cycles at a tight tolerance."""
    return sd.cycle(frictional, cycles=4, rtol=1e-10, atol=1e-10)


@pytest.fixture(scope="module")
def dense(frictional):
    """Return the four cycles by `simulate`, with samples at quarters of the cycles."""
    return sd.simulate(frictional, until=4 * PERIOD, samples=17, rtol=1e-10, atol=1e-10)


def test_same_states_as_a_dense_run(frictional, tight, dense):
    """Cross-check: states equal samples of `simulate`, whose steps do not end at these instants.

    Measured: 2e-7 of the clearance at a tolerance of 1e-9, ten times as large as here; 1e-5 leaves room for another compiler.
    The slider's acceleration is the contact force over its mass, which magnifies by the stiffness of the contact.
    """
    at = slice(0, 16, 4)
    clearance = float(frictional.joint("A").clearance.clearance)
    np.testing.assert_allclose(tight["time"], dense["time"][at], rtol=1e-14)
    apart = tight["eccentricity"].values - dense["eccentricity"].sel(joint=["A"]).values[at]
    assert np.max(np.abs(apart)) < 1e-5 * clearance
    np.testing.assert_allclose(tight["slider_position"], dense["slider_position"][at], rtol=0.0, atol=1e-5 * clearance)
    np.testing.assert_allclose(tight["slider_velocity"], dense["slider_velocity"][at], rtol=1e-7)
    np.testing.assert_allclose(tight["slider_acceleration"], dense["slider_acceleration"][at], rtol=1e-3, atol=0.1)


def test_phase(frictional, tight, dense):
    """Cross-check: states at another phase; statistics of cycles and the end do not depend on the phase."""
    shifted = sd.cycle(frictional, cycles=4, phase=0.25, rtol=1e-10, atol=1e-10)
    apart = shifted["eccentricity"].values - dense["eccentricity"].sel(joint=["A"]).values[1:17:4]
    assert np.max(np.abs(apart)) < 1e-5 * 0.1e-3
    for name in ("peak_force", "contact_fraction", "drive_work", "end_y"):
        np.testing.assert_array_equal(shifted[name], tight[name])


def test_statistics_of_cycles(tight, dense):
    """Cross-check: impacts, contact fraction and work of each cycle from the contacts and energies of a dense run."""
    begin = np.arange(4) * PERIOD
    start, lasts = dense["contact_start"].values, dense["contact_duration"].values
    stop = np.where(np.isnan(lasts), 4 * PERIOD, start + lasts)
    impacts = [np.sum((start >= t) & (start < t + PERIOD)) for t in begin]
    fraction = [np.sum(np.clip(np.minimum(stop, t + PERIOD) - np.maximum(start, t), 0.0, None)) / PERIOD for t in begin]
    assert min(impacts) > 1
    np.testing.assert_array_equal(tight["impacts"].values[:, 0], impacts)
    np.testing.assert_allclose(tight["contact_fraction"].values[:, 0], fraction, rtol=1e-6)
    np.testing.assert_allclose(np.max(tight["peak_force"]), np.max(dense["peak_force"]), rtol=1e-5)
    np.testing.assert_allclose(tight["drive_work"], np.diff(dense["drive_work"].values[::4]), rtol=1e-6, atol=1e-5)


def test_energy_balance(tight):
    """Identity: energy gained in a cycle = work of the drive - losses; measured 3e-6 J of 1 kJ."""
    gained = np.diff(tight["energy"])
    np.testing.assert_allclose(gained, (tight["drive_work"] - tight["dissipated_energy"])[:-1], rtol=0.0, atol=5e-5)


def test_one_orbit_per_cycle(settled):
    """Limit: with friction and a small clearance the motion settles to one orbit."""
    late = settled["slider_velocity"].values[-3:]
    assert np.ptp(late) < 1e-5
    assert np.ptp(settled["slider_velocity"].values[:3]) > 1e-4
    np.testing.assert_array_equal(settled["impacts"].values[-3:], 5)


def test_continued_cycles_are_the_same(impacting, tmp_path):
    """Identity: five cycles and seven from a file, and twelve single ones, equal twelve of one call bit for bit."""
    whole = sd.cycle(impacting, cycles=12)
    sd.save(sd.cycle(impacting, cycles=5), tmp_path / "five.nc")
    rest = sd.cycle(impacting, cycles=7, start=load(tmp_path / "five.nc"))
    step = sd.cycle(impacting, cycles=1)
    for number in range(1, 12):
        step = sd.cycle(impacting, cycles=1, start=step)
        np.testing.assert_array_equal(step["end_y"], sd.cycle(impacting, cycles=number + 1)["end_y"])
    assert rest["cycle"].values.tolist() == list(range(5, 12))
    for name in set(rest.data_vars) - {"end_counts"}:  # the slope at the start is computed anew, and counted
        expected = whole[name].isel(cycle=slice(5, None)) if "cycle" in whole[name].dims else whole[name]
        np.testing.assert_array_equal(rest[name], expected, err_msg=str(name))


def test_keep(impacting):
    """Contract: `keep` returns the last cycles; the others take fewer evaluations, as they are not monitored."""
    whole, kept = sd.cycle(impacting, cycles=4), sd.cycle(impacting, cycles=4, keep=2)
    rates = COUNTS.names.index("rates")
    assert kept["end_counts"].values[rates] < whole["end_counts"].values[rates]
    whole["end_counts"].values[rates] = kept["end_counts"].values[rates]
    xr.testing.assert_identical(kept.drop_attrs(), whole.isel(cycle=slice(2, None)).drop_attrs())


def of_joint(run):
    """Return warnings about the laws of joint A."""
    return [text for text in warnings_of(run) if text.startswith("joint 'A'")]


def test_warnings(impacting):
    """Cross-check: warnings about laws are those of a run over the kept cycles."""
    options = {"rtol": 1e-9, "atol": 1e-9}
    whole = sd.cycle(impacting, cycles=2, **options)
    assert of_joint(whole) == of_joint(sd.simulate(impacting, until=2 * PERIOD, **options))
    assert "contacts start faster than" in of_joint(whole)[0]
    last = sd.cycle(impacting, cycles=2, keep=1, **options)
    assert of_joint(last) == of_joint(sd.cycle(impacting, cycles=1, start=sd.cycle(impacting, cycles=1, **options), **options))
    assert of_joint(last) != of_joint(whole)


def test_failed_cycle(impacting):
    """Contract: a failed run has time and cause, and the complete cycles without NaN."""
    whole = sd.cycle(impacting, cycles=6)
    steps = whole["steps"].values
    # rejected steps count too, so that the first cycle that takes more than the median is not the first that fails
    broken = sd.cycle(impacting, cycles=6, most_steps=int(np.sort(steps)[-1]))
    assert broken.attrs["status"] == "failed"
    done = broken.sizes["cycle"]
    assert done < 6
    assert broken.attrs["end_cycle"] == done
    assert f"cycle {done} " in broken.attrs["cause"]
    assert "steps are not enough" in broken.attrs["cause"]
    for name in set(broken.data_vars) - {"end_clock", "end_band"}:  # infinite where there is no limit
        assert np.all(np.isfinite(broken[name].values.astype(float))), name
    np.testing.assert_array_equal(broken["slider_velocity"], whole["slider_velocity"][:done])


def test_ideal_mechanism(periodic):
    """Closed form: y = L sin th and y' = L cos th th' for ideal joints."""
    run = sd.cycle(periodic, cycles=3, phase=0.1)
    phase = 2.0 * math.pi * 0.1
    angle = math.radians(45.0) + math.radians(10.0) * math.sin(phase)
    rate = math.radians(10.0) * 2.0 * math.pi * 8.0 * math.cos(phase)
    np.testing.assert_allclose(run["slider_position"], 2.0 * math.sin(angle), rtol=1e-8)
    np.testing.assert_allclose(run["slider_velocity"], 2.0 * math.cos(angle) * rate, rtol=1e-6)
    assert run.sizes["joint"] == 0


def test_units(settled, tmp_path):
    """Contract: pint reads all units; variables with different entries have names for them."""
    for run in (settled, load(sd.save(settled, tmp_path / "cycles.nc"))):
        for values in run.variables.values():
            pint.application_registry.parse_units(values.attrs.get("units", "1"))
        assert "units" not in run["internal_state"].attrs
        assert run["internal"].values.tolist() == ["A: bristle_deflection"]
        assert (run["end_total"].attrs["units"], run["end_mode"].attrs["units"]) == ("J", "1")
        assert "units" not in run["end_y"].attrs


def test_refused_cycles(periodic, impacting, frictional, upright):
    """Contract: wrong arguments are refused in one line."""
    ideal = sd.cycle(periodic, cycles=1)
    table = sd.Tabulated(tuple(0.1 * k for k in range(7)), tuple(0.7 + 0.01 * k for k in range(7)))
    two = periodic.driven(sd.Harmonic(-0.7, 0.1, 10.0), body="unit 1/bar 2")
    assert drive_period(periodic) == pytest.approx(PERIOD, rel=1e-15)
    for call, words in (
        (lambda: sd.cycle(impacting, cycles=0), "cycles = 0"),
        (lambda: sd.cycle(impacting, cycles=2, keep=0), "keep = 0"),
        (lambda: sd.cycle(impacting, cycles=1, phase=1.0), "phase = 1.0"),
        (lambda: sd.cycle(impacting, cycles=1, start=ideal), "another mechanism"),
        (lambda: sd.cycle(impacting, cycles=1, period=0.1, start=sd.cycle(impacting, cycles=1)), "the same period"),
        (lambda: sd.cycle(impacting, cycles=1, start=ideal.drop_vars("end_y")), "has no final state"),
        (lambda: sd.cycle(periodic.driven(table), cycles=10, period=0.1), "tabulated from 0 s to 0.6 s"),
        (lambda: drive_period(two), "2 periods"),
        (lambda: drive_period(periodic.driven(table)), "no drive is periodic"),
        (lambda: sd.ensemble(periodic, members=2, cycles=2), "no clearance joints"),
        (lambda: sd.ensemble(impacting, members=1, cycles=2), "members = 1"),
        (lambda: sd.ensemble(impacting, members=2, cycles=2, skip=2), "skip = 2 of 2 cycles"),
        (lambda: sd.ensemble(impacting, members=2, cycles=2, perturbation=0.1), "perturbation = 0.1"),
        (lambda: sd.ensemble(impacting, members=2, cycles=2, agreement=0.0), "agreement = 0.0"),
        (lambda: sd.variational_exponent(frictional, cycles=1), "variational equation is not defined"),
        (lambda: sd.variational_exponent(impacting, cycles=1), "variational equation is not defined"),
        (lambda: sd.variational_exponent(periodic, cycles=1), "drives prescribe the whole motion"),
        (lambda: sd.separation_exponent(periodic, cycles=1), "drives prescribe the whole motion"),
        (lambda: sd.separation_exponent(upright, cycles=0, period=1.0), "cycles = 0"),
        (lambda: sd.separation_exponent(upright, cycles=1, period=0.1, intervals=1, skip=1), "no interval left"),
    ):
        with pytest.raises(sd.InputError, match=words):
            call()


def test_reason_of_the_method(settled):
    """Contract: the statistics have the method and its reason, as those of a run."""
    statistics = counts_of(settled)
    assert statistics["method"] == "rodas5p"
    assert "internal states" in statistics["reason"]


def test_replay_of_cycles_is_refused(settled):
    """Contract: the error says which function repeats cycles."""
    with pytest.raises(sd.InputError, match=r"replay of 'scissordyn cycles'.*for example cycle"):
        sd.replay(settled)


def test_cycles_with_a_clearance_guide_alone_are_classified():
    """Contract: the map has the clearance of every contact point, which scales distances; corners alone give no flight."""
    block = sd.slider_crank(crank=0.05, rod=0.12, slider_inertia=2.3e-5)
    block = block.with_clearance("guide", sd.GuideClearance(1e-4, length=0.04, width=0.02)).driven(speed=20.0)
    found = sd.cycle(block, cycles=4)
    assert found["clearance"].values.tolist() == [1e-4] * 4
    assert 0.0 < sd.classify(found).measures["flight_fraction"] < 1.0
    assert "flight_fraction" not in sd.classify(found.drop_vars("united_contact_fraction")).measures
    pressed = found.assign(united_contact_fraction=0.0 * found["united_contact_fraction"] + 1.0)
    assert sd.classify(pressed).measures["flight_fraction"] == 0.0


@pytest.fixture(scope="module")
def diverging(impacting):
    """Return four members of an irregular motion."""
    return sd.ensemble(impacting, members=4, cycles=8, skip=2, engine=1)


def test_irregular_motion_diverges(impacting, diverging):
    """Limit: round-off of 1e-14 grows to a thousandth of the clearance within some cycles, but not in the first."""
    assert set(diverging["status"].values) == {"complete"}
    assert 1 <= diverging.attrs["trusted_cycles"] < 8
    assert diverging.attrs["trusted_until"] == pytest.approx(0.125 * (diverging.attrs["trusted_cycles"] - 1))
    agreeing = diverging["agreeing"].values
    np.testing.assert_array_equal(agreeing[: diverging.attrs["trusted_cycles"]], 1.0)
    assert agreeing[-1] < 1.0
    np.testing.assert_array_equal(diverging["slider_velocity"].values[0], sd.cycle(impacting, cycles=8)["slider_velocity"])


def test_warnings_of_members(impacting, diverging):
    """Cross-check: a warning of several members appears once, as in the first member."""
    alone = sd.cycle(impacting, cycles=8)
    said = warnings_of(diverging)
    assert said == warnings_of(alone)
    assert any("contacts start faster than" in text for text in said)


def test_means_and_spread(diverging):
    """Closed form: numpy's mean and standard deviation over the counted cycles."""
    means = diverging["impacts"].values[:, 2:, 0].mean(axis=1)
    np.testing.assert_allclose(diverging["mean_impacts"].values[:, 0], means, rtol=1e-14)
    assert float(diverging["spread_impacts"][0]) == pytest.approx(np.std(means, ddof=1), rel=1e-12)
    assert float(diverging["spread_peak_force"][0]) > 0.0


def test_regular_motion_stays_together(frictional):
    """Limit: where perturbations decay, all members agree to the end."""
    found = sd.ensemble(frictional, members=3, cycles=6, engine=1)
    assert found.attrs["trusted_cycles"] == 6
    np.testing.assert_array_equal(found["agreeing"], 1.0)
    np.testing.assert_array_equal(found["divergence_cycle"], 6)
    assert not np.array_equal(found["eccentricity"].values[0], found["eccentricity"].values[1])


def test_seed_of_members(impacting):
    """Contract: the same seed gives the same members, another seed others."""
    here = sd.ensemble(impacting, members=2, cycles=1, seed=5, engine=1)
    there = sd.ensemble(impacting, members=2, cycles=1, seed=5, engine=1)
    other = sd.ensemble(impacting, members=2, cycles=1, seed=6, engine=1)
    np.testing.assert_array_equal(here["eccentricity"], there["eccentricity"])
    assert not np.array_equal(here["drive_work"].values[1], other["drive_work"].values[1])


@pytest.fixture(scope="module")
def upright():
    """Return a uniform bar of 1 m that stands on its pin."""
    return sd.Mechanism(
        bodies=(sd.bar("bar", length=1.0, mass=2.0, position=(0.0, 0.0), angle=0.5 * math.pi),),
        joints=(sd.Revolute("pin", ("bar", "start"), (GROUND, "origin")),),
        ground=(("origin", (0.0, 0.0)),),
    )


@pytest.mark.parametrize(
    ("road", "options", "error"),
    [(sd.separation_exponent, {"distance": 1e-7}, 1e-6), (sd.variational_exponent, {"substeps": 50}, 1e-5)],
)
def test_inverted_pendulum(upright, road, options, error):
    """Closed form: sqrt(3 g/(2 L)) where a bar stands upright; measured errors 7e-9 and 2e-6.

    Round-off makes it fall after about ten times 1/sqrt(3 g/(2 L)), after the run. The error of the implicit midpoint rule is
    (h lambda)^2/12 = 1.9e-6.
    """
    found = road(upright, cycles=4, period=1.0, skip=2, **options)
    assert float(found["exponent"]) == pytest.approx(math.sqrt(1.5 * 9.81), rel=error)
    assert found.attrs["status"] == "complete"


def test_both_methods_agree(periodic):
    """Second formulation: growth in the first six 32nds of a cycle of an undamped joint, during impacts.

    The midpoint rule meets kinks of dF/d delta at every touch; measured 0.008 in the worst interval, 0.006 in the sum of 12.2.
    After twice that time the two trajectories have diverged, as the exponent predicts.
    """
    mechanism = periodic.with_clearance("A", sd.Clearance(0.2e-3, damping=NoDamping()))
    options = {"cycles": 1, "intervals": 32, "rtol": 1e-12, "atol": 1e-12}
    two = sd.separation_exponent(mechanism, distance=1e-4, **options)["log_growth"].values[:6]
    one = sd.variational_exponent(mechanism, substeps=4000, **options)["log_growth"].values[:6]
    assert np.sum(one) > 10.0
    np.testing.assert_allclose(two, one, rtol=0.0, atol=0.02)


def test_interruption_before_an_interval_counts(upright):
    """Contract: Ctrl-C while all intervals are still skipped is an interruption, not an error of the arguments."""
    interrupted = Mock(side_effect=KeyboardInterrupt)
    with pytest.raises(KeyboardInterrupt):
        sd.separation_exponent(upright, cycles=2, period=0.1, intervals=2, skip=1, progress=interrupted)
    interrupted.assert_called_once_with(1, 2)


def test_exponent_of_a_settled_orbit(frictional):
    """Limit: where the motion settles to one orbit the exponent is negative."""
    found = sd.separation_exponent(frictional, cycles=8, intervals=4, skip=4, distance=1e-2, rtol=1e-8, atol=1e-8)
    assert float(found["exponent"]) < 0.0


@pytest.mark.parametrize("measure", [sd.separation_exponent, sd.variational_exponent])
def test_tables_that_end_early_are_refused(measure):
    """Contract: cycles beyond the end of a table are refused, as in runs and maps."""
    instants = tuple(np.linspace(0.0, 0.1, 7).tolist())
    load = sd.Torque("load", "crank", torque=1.0, time_function=sd.Tabulated(instants, tuple(0.0 * t for t in instants)))
    crank = dataclasses.replace(sd.slider_crank(crank=0.05, rod=0.12, angle=0.4), components=(load,)).driven(speed=20.0)
    with pytest.raises(sd.InputError, match=r"time function of 'load' is tabulated from 0 s to 0.1 s"):
        measure(crank, cycles=2)
