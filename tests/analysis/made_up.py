"""Made-up runs with known contacts and motions."""

import math

import numpy as np
import xarray as xr

CLEARANCE = 1e-3  # [m] radial clearance of the only clearance joint in a made-up run
# Names of the bodies in a made-up run: two scissor units and a slider
BODIES = ["unit 1/bar 1", "unit 1/bar 2", "unit 2/bar 1", "unit 2/bar 2", "slider"]


def named(dims, values, units):
    """Return a variable of a run: dimensions, values and attributes with the unit."""
    return dims, values, {"units": units, "long_name": "made up"}


def made_up_run(spans, *, end=1.0, instants=1001, orbit=None, **attributes):
    """Make up a run with joint A in contact during `spans` [s]; the end of a span that lasts to the end of the run is NaN."""
    time = np.linspace(0.0, end, instants)
    start = np.array([span[0] for span in spans], float)
    duration = np.array([span[1] - span[0] for span in spans], float)
    touching = np.zeros((instants, 2), bool)
    for begin, lasting in zip(start, duration, strict=True):
        touching[:, 0] |= (time >= begin) & (time < (begin + lasting if math.isfinite(lasting) else math.inf))
    place = np.full((instants, 2, 2), np.nan)
    place[:, 0] = CLEARANCE * np.stack([np.cos(time), np.sin(time)], axis=-1) if orbit is None else orbit
    force = np.full((instants, 2), np.nan)
    force[:, 0] = np.where(touching[:, 0], 100.0, 0.0)
    motion = np.zeros((instants, len(BODIES), 2))
    peaks = 100.0 + 10.0 * np.arange(len(spans))
    w = 2.0 * math.pi
    variables = {
        "slider_position": named(("time",), np.sin(w * time), "m"),
        "slider_velocity": named(("time",), w * np.cos(w * time), "m/s"),
        "slider_acceleration": named(("time",), -(w**2) * np.sin(w * time), "m/s^2"),
        "position": named(("time", "body", "axis"), motion, "m"),
        "velocity": named(("time", "body", "axis"), motion, "m/s"),
        "acceleration": named(("time", "body", "axis"), motion, "m/s^2"),
        "angle": named(("time", "body"), motion[..., 0].copy(), "rad"),
        "eccentricity": named(("time", "joint", "axis"), place, "m"),
        "normal_force": named(("time", "joint"), force, "N"),
        "reaction": named(("time", "joint", "axis"), np.stack([force, 0.0 * force], axis=-1), "N"),
        "in_contact": named(("time", "joint"), touching, "1"),
        "clearance": named(("joint",), np.array([CLEARANCE, np.nan]), "m"),
        "contact_joint": (("contact",), np.full(len(spans), "A")),
        "contact_start": named(("contact",), start, "s"),
        "contact_duration": named(("contact",), duration, "s"),
        "peak_force": named(("contact",), peaks, "N"),
        "peak_time": named(("contact",), np.full(len(spans), 1e-3), "s"),
        "peak_normal_force": named(("contact",), peaks, "N"),
        "peak_normal_time": named(("contact",), np.full(len(spans), 1e-3), "s"),
    }
    coordinates = {"time": ("time", time, {"units": "s"}), "body": BODIES, "joint": ["A", "O"], "axis": ["x", "y"]}
    return xr.Dataset(variables, coords=coordinates, attrs={"trusted_until": math.nan, **attributes})


def logistic(r, count, *, start=0.3, skip=500):
    """Return the iterates of the logistic map x -> r x (1 - x), without the first `skip`."""
    values, x = np.empty(count), start
    for k in range(skip + count):
        x = r * x * (1.0 - x)
        if k >= skip:
            values[k - skip] = x
    return values


def henon(count):
    """Return the iterates of the Henon map with a = 1.4 and b = 0.3, shape (count, 2)."""
    values, x, y = np.empty((count, 2)), 0.1, 0.1
    for k in range(100 + count):
        x, y = 1.0 - 1.4 * x * x + y, 0.3 * x
        if k >= 100:
            values[k - 100] = x, y
    return values


GOLDEN_RATIO = 0.5 * (math.sqrt(5.0) - 1.0)  # Golden ratio, 0.618...: the rotation by this fraction of a turn is quasi-periodic


def rotation(count, number=GOLDEN_RATIO):
    """Return points that rotate on the unit circle by the fraction `number` of a revolution each, shape (count, 2)."""
    turned = 2.0 * np.pi * number * np.arange(count)
    return np.stack([np.cos(turned), np.sin(turned)], axis=1)
