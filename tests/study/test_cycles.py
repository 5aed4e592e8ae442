"""Long periodic runs."""

import math

import numpy as np
import pytest
import xarray as xr

from scissordyn.errors import InputError
from scissordyn.model.drive import Harmonic, TableMotion
from scissordyn.simulation.cycles import cycle
from scissordyn.simulation.run import simulate
from scissordyn.simulation.store import load, save
from scissordyn.simulation.stroboscope import drive_period

PERIOD = 0.125


@pytest.fixture(scope="module")
def settled(rubbing):
    """Fifteen cycles at default tolerance."""
    return cycle(rubbing, cycles=15)


@pytest.fixture(scope="module")
def tight(rubbing):
    """Four cycles at a tight tolerance."""
    return cycle(rubbing, cycles=4, rtol=1e-9, atol=1e-9)


@pytest.fixture(scope="module")
def dense(rubbing):
    """The same by `simulate`, with samples at quarters of the cycles."""
    return simulate(rubbing, until=4 * PERIOD, samples=17, rtol=1e-9, atol=1e-9)


def test_same_states_as_a_dense_run(rubbing, tight, dense):
    """Cross-check: samples of `simulate` at the same instants, whose steps do not end there.

    Measured: 2e-7 of the clearance at a tolerance of 1e-9; 1e-5 leaves room for another compiler. The slider's acceleration is
    the contact force over its mass, which magnifies by the stiffness of the contact.
    """
    at = slice(0, 16, 4)
    clearance = float(rubbing.joint("A").clearance.clearance)
    np.testing.assert_allclose(tight["time"], dense["time"][at], rtol=1e-14)
    apart = tight["eccentricity"].values - dense["eccentricity"].sel(joint=["A"]).values[at]
    assert np.max(np.abs(apart)) < 1e-5 * clearance
    np.testing.assert_allclose(tight["slider_position"], dense["slider_position"][at], rtol=0.0, atol=1e-5 * clearance)
    np.testing.assert_allclose(tight["slider_velocity"], dense["slider_velocity"][at], rtol=1e-7)
    np.testing.assert_allclose(tight["slider_acceleration"], dense["slider_acceleration"][at], rtol=1e-3, atol=0.1)


def test_phase(rubbing, tight, dense):
    """Cross-check: at another phase too; and statistics of cycles and the end do not depend on it."""
    shifted = cycle(rubbing, cycles=4, phase=0.25, rtol=1e-9, atol=1e-9)
    apart = shifted["eccentricity"].values - dense["eccentricity"].sel(joint=["A"]).values[1:17:4]
    assert np.max(np.abs(apart)) < 1e-5 * 0.1e-3
    for name in ("peak_force", "contact_share", "drive_work", "end_state"):
        np.testing.assert_array_equal(shifted[name], tight[name])


def test_statistics_of_cycles(tight, dense):
    """Cross-check: impacts, contact share and work of each cycle from the contacts and energies of a dense run."""
    begin = np.arange(4) * PERIOD
    start, lasts = dense["contact_start"].values, dense["contact_duration"].values
    stop = np.where(np.isnan(lasts), 4 * PERIOD, start + lasts)
    impacts = [np.sum((start >= t) & (start < t + PERIOD)) for t in begin]
    share = [np.sum(np.clip(np.minimum(stop, t + PERIOD) - np.maximum(start, t), 0.0, None)) / PERIOD for t in begin]
    assert min(impacts) > 1
    np.testing.assert_array_equal(tight["impacts"].values[:, 0], impacts)
    np.testing.assert_allclose(tight["contact_share"].values[:, 0], share, rtol=1e-6)
    np.testing.assert_allclose(np.max(tight["peak_force"]), np.max(dense["peak_force"]), rtol=1e-5)
    np.testing.assert_allclose(tight["drive_work"], np.diff(dense["drive_work"].values[::4]), rtol=1e-6, atol=1e-5)


def test_energy_balance(tight):
    """Identity: energy gained in a cycle = work of the drive - losses; measured 3e-6 J of 1 kJ."""
    gained = np.diff(tight["energy"])
    np.testing.assert_allclose(gained, (tight["drive_work"] - tight["dissipated_energy"])[:-1], rtol=0.0, atol=5e-5)


def test_one_orbit_per_cycle(settled):
    """Limit: with friction and a small clearance the map has a fixed point; a perturbation shrinks, so that it stays."""
    late = settled["slider_velocity"].values[-3:]
    assert np.ptp(late) < 1e-5
    assert np.ptp(settled["slider_velocity"].values[:3]) > 1e-4
    np.testing.assert_array_equal(settled["impacts"].values[-3:], 5)


def test_going_on_is_bit_for_bit(knocking, tmp_path):
    """Identity: five cycles and seven from a file, and twelve one by one, are the twelve of one call."""
    whole = cycle(knocking, cycles=12)
    save(cycle(knocking, cycles=5), tmp_path / "five.nc")
    rest = cycle(knocking, cycles=7, start=load(tmp_path / "five.nc"))
    step = cycle(knocking, cycles=1)
    for number in range(1, 12):
        step = cycle(knocking, cycles=1, start=step)
        np.testing.assert_array_equal(step["end_state"], cycle(knocking, cycles=number + 1)["end_state"])
    assert rest["cycle"].values.tolist() == list(range(5, 12))
    for name in rest.data_vars:
        expected = whole[name].isel(cycle=slice(5, None)) if "cycle" in whole[name].dims else whole[name]
        np.testing.assert_array_equal(rest[name], expected, err_msg=str(name))


def test_keep(knocking):
    """Identity: the last cycles of a run."""
    whole, kept = cycle(knocking, cycles=4), cycle(knocking, cycles=4, keep=2)
    xr.testing.assert_identical(kept.drop_attrs(), whole.isel(cycle=slice(2, None)).drop_attrs())


def test_a_cycle_that_fails(knocking):
    """Identity: a run that breaks off says where and why, and holds the whole cycles before, without NaN."""
    whole = cycle(knocking, cycles=6)
    steps = whole["steps"].values
    # rejected steps count too, so that the first cycle that takes more than the median is not the first that fails
    broken = cycle(knocking, cycles=6, most_steps=int(np.sort(steps)[-1]))
    assert broken.attrs["status"] == "failed"
    done = broken.sizes["cycle"]
    assert done < 6
    assert broken.attrs["end_cycle"] == done
    assert f"cycle {done} " in broken.attrs["cause"]
    assert "steps did not suffice" in broken.attrs["cause"]
    for name in broken.data_vars:
        assert np.all(np.isfinite(broken[name].values.astype(float))), name
    np.testing.assert_array_equal(broken["slider_velocity"], whole["slider_velocity"][:done])


def test_ideal_mechanism(swinging):
    """Closed form: y = L sin th and y' = L cos th th' for ideal joints."""
    run = cycle(swinging, cycles=3, phase=0.1)
    phase = 2.0 * math.pi * 0.1
    angle = math.radians(45.0) + math.radians(10.0) * math.sin(phase)
    rate = math.radians(10.0) * 2.0 * math.pi * 8.0 * math.cos(phase)
    np.testing.assert_allclose(run["slider_position"], 2.0 * math.sin(angle), rtol=1e-8)
    np.testing.assert_allclose(run["slider_velocity"], 2.0 * math.cos(angle) * rate, rtol=1e-6)
    assert run.sizes["joint"] == 0


def test_what_cannot_be_used(swinging, knocking, rubbing):
    """Identity: one-line errors."""
    ideal = cycle(swinging, cycles=1)
    table = TableMotion(tuple(0.1 * k for k in range(7)), tuple(0.7 + 0.01 * k for k in range(7)))
    two = swinging.driven(Harmonic(-0.7, 0.1, 10.0), body="unit 1/bar 2")
    assert drive_period(swinging) == pytest.approx(PERIOD, rel=1e-15)
    for call, words in (
        (lambda: cycle(knocking, cycles=0), "cycles = 0"),
        (lambda: cycle(knocking, cycles=2, keep=0), "keep = 0"),
        (lambda: cycle(knocking, cycles=1, phase=1.0), "phase = 1.0"),
        (lambda: cycle(knocking, cycles=1, start=ideal), "another mechanism"),
        (lambda: cycle(knocking, cycles=1, period=0.1, start=cycle(knocking, cycles=1)), "the same period"),
        (lambda: cycle(knocking, cycles=1, start=ideal.drop_vars("end_state")), "no state to go on from"),
        (lambda: cycle(swinging.driven(table), cycles=10, period=0.1), "tabulated until 0.6 s"),
        (lambda: drive_period(two), "2 periods"),
        (lambda: drive_period(swinging.driven(table)), "no periods"),
    ):
        with pytest.raises(InputError, match=words):
            call()
