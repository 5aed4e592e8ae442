"""Measures of a made-up run whose numbers are all known."""

import math

import numpy as np
import pytest
import xarray as xr

from scissordyn_paper.measures import measure

TIME = np.linspace(0.0, 0.05, 501)  # [s] instants of made-up runs


def made(force=0.0, wobble=None, contacts=(), touching=None, around=None):
    """Return a run whose slider follows y = 1 + t, with a deviation added to every curve."""
    wobble = np.zeros_like(TIME) if wobble is None else wobble
    touching = np.zeros(TIME.size, bool) if touching is None else touching
    around = np.zeros_like(TIME) if around is None else around
    line = {"slider_position": 1.0 + TIME, "slider_velocity": 2.0 * TIME, "slider_acceleration": np.full_like(TIME, 4.0)}
    bar = {"angle": -TIME, "angular_velocity": np.full_like(TIME, -1.0), "angular_acceleration": np.zeros_like(TIME)}
    starts, durations, peaks, times = np.array(contacts, float).reshape(-1, 4).T
    place = np.stack([np.cos(around), np.sin(around)], axis=1)[:, None]
    return xr.Dataset(
        {
            **{name: ("time", values + wobble) for name, values in line.items()},
            **{name: (("time", "body"), (values + wobble)[:, None]) for name, values in bar.items()},
            "drive_torque": ("time", np.full_like(TIME, -3.0) - force),
            "peak_drive_torque": ("drive", [3.0 + float(np.max(force))]),
            "reaction": (("time", "joint", "axis"), np.broadcast_to([3.0, 4.0], (TIME.size, 1, 2))),
            "normal_force": (("time", "joint"), np.where(touching, force, 0.0)[:, None]),
            "in_contact": (("time", "joint"), touching[:, None]),
            "eccentricity": (("time", "joint", "axis"), place),
            "contact_joint": ("contact", np.array(["A"] * starts.size, dtype=str)),
            "contact_start": ("contact", starts),
            "contact_duration": ("contact", durations),
            "peak_normal_force": ("contact", peaks),
            "peak_normal_time": ("contact", times),
        },
        coords={"time": TIME, "body": ["unit 1/bar 2"], "joint": ["A"], "axis": ["x", "y"]},
        attrs={"trusted_until": 0.02},
    )


def test_contacts_are_counted_and_assigned():
    """Closed form: starts and fractions of the windows, for a contact across the first bound, a short one and a lasting one."""
    contacts = [(0.002, 0.004, 7.0, 0.001), (0.010, 0.001, 9.0, 0.0005), (0.031, math.nan, 5.0, 0.001)]
    found = measure(made(force=2.0, contacts=contacts, touching=TIME >= 0.031), made())
    assert (found.impacts, found.early_impacts, found.late_impacts, found.settled_impacts) == (3, 2, 1, 2)
    assert found.settled_fraction == pytest.approx((0.001 + 0.001 + 0.019) / 0.045, rel=1e-12)
    assert found.final_fraction == pytest.approx(1.0, rel=1e-12)
    assert found.late_rate == pytest.approx(1.0 / 0.02)
    assert found.settled_rate == pytest.approx(2.0 / 0.045)
    assert (found.peak_force, found.late_peak_force) == (9.0, 5.0)
    assert (found.ideal_force, found.peak_torque, found.ideal_torque) == (5.0, 5.0, 3.0)
    assert (found.trusted_until, found.end) == (0.02, 0.05)


def test_force_of_a_contact_with_an_earlier_peak():
    """Closed form: the force after 30 ms is that of a contact with its peak at 10 ms."""
    found = measure(made(force=2.5, contacts=[(0.009, math.nan, 8.0, 0.001)], touching=TIME >= 0.009), made())
    assert found.late_peak_force == 2.5


def test_deviations_are_split_at_five_milliseconds():
    """Closed form: 0.1 until 5 ms and 0.01 after; the ideal displacement spans 0.05, both curves together 0.06."""
    wobble = np.where(TIME <= 5e-3 + 1e-12, 0.1, 0.01)
    found = measure(made(wobble=wobble), made())
    speed = found.deviations["slider_velocity"]
    assert (speed.before, speed.after) == pytest.approx((0.1, 0.01))
    assert speed.early == pytest.approx(51 * 0.01 / (51 * 0.01 + 450 * 0.0001))
    assert speed.largest == pytest.approx(0.1 / 0.11)  # from 0 to 0.11 at 5 ms
    assert found.position_deviation == pytest.approx(0.1 / 0.105)
    assert found.deviations["angular_acceleration"].largest == pytest.approx(1.0)  # a line without range, and 0.1 above it
    assert found.irregularity == pytest.approx(0.01 / 4.0)


def test_arc_of_contact_directions():
    """Closed form: equal steps of the angle across pi; the arc leaves out 5 % of the samples."""
    touching = np.arange(TIME.size) < 400
    around = np.pi - 0.3 + 0.6 * np.arange(TIME.size) / 379.0
    around[380:] = 0.5
    found = measure(made(touching=touching, around=np.angle(np.exp(1j * around))), made())
    assert found.arc == pytest.approx(0.6, rel=1e-9)
    assert math.isnan(measure(made(), made()).arc)
