"""The synchronisation error of the units of arrays."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import scissordyn as sd

SMALL = 1e-9
"""Angle [rad] above the rounding of positions in arrays of some metres, and far below a clearance over a bar's length."""

ARRAYS: dict[str, Any] = {
    "scissor": lambda: sd.scissor(units=4),
    "driven at the slider": lambda: sd.scissor(units=3, driven_bar="slider"),
    "polar": lambda: sd.polar_scissor(units=4),
    "ring": lambda: sd.hoberman_ring(units=6),
    "mast": lambda: sd.mast(units=3, platform_mass=4.0),
}


@pytest.mark.parametrize("kind", ARRAYS)
def test_ideal_arrays_are_synchronous(kind: str) -> None:
    """Closed form: in an ideal array of equal units all deployment angles are equal."""
    run = sd.simulate(ARRAYS[kind]().driven(speed=sd.rpm(20)), until=0.1, samples=21)
    assert run["synchronisation_error"].dims == ("time", "unit")
    assert list(run["unit"].values) == [f"unit {k + 1}" for k in range(run.sizes["unit"])]
    assert float(np.max(np.abs(run["synchronisation_error"].values))) < SMALL
    assert float(run["peak_synchronisation_error"].max()) < SMALL


def test_one_clearance_joint() -> None:
    """Closed form: the starts of the bars of unit 2 are apart by those of its neighbour's ends plus the eccentricity."""
    length, c = 2.0, 1e-3
    arm = sd.scissor(units=2, bar_length=length).with_clearance("unit 1/upper", sd.Clearance(c)).driven(speed=sd.rpm(150))
    run = sd.simulate(arm, until=0.05, samples=201)
    bars = run["angle"].sel(body=["unit 1/bar 1", "unit 1/bar 2"]).values
    ends = 0.5 * length * np.stack([np.cos(bars), np.sin(bars)], axis=-1)
    pins = ends[:, 0] - ends[:, 1]  # of the first unit, from the end of bar 2 to that of bar 1
    eccentricity = run["eccentricity"].sel(joint="unit 1/upper").values  # of the end of bar 1 in the start of unit 2's bar 2
    starts = pins - eccentricity
    angle = [np.arcsin(np.hypot(*between.T) / length) for between in (pins, starts)]
    error = run["synchronisation_error"].sel(unit="unit 2").values
    assert np.allclose(error, angle[1] - angle[0], rtol=0.0, atol=SMALL)
    assert float(np.max(np.abs(error))) > 0.5 * c / length
    assert float(run["peak_synchronisation_error"].sel(unit="unit 2")) == np.max(np.abs(error))
    assert not np.any(run["synchronisation_error"].sel(unit="unit 1").values)


def test_angles_that_differ_by_turns() -> None:
    """Contract: a full turn in the angle that a bar is given changes nothing."""
    arm = sd.scissor(units=2).driven(speed=sd.rpm(60))
    turned = arm.replace("unit 2/bar 2.angle", arm.body("unit 2/bar 2").angle + 2.0 * math.pi)
    error = sd.simulate(turned, until=0.02, samples=5)["synchronisation_error"].values
    assert float(np.max(np.abs(error))) < SMALL


@pytest.mark.parametrize("mechanism", [lambda: sd.scissor(units=1), lambda: sd.slider_crank()])
def test_mechanisms_without_several_units(mechanism: Any) -> None:
    """Contract: fewer than two units have nothing to be synchronous with."""
    run = sd.simulate(mechanism().driven(speed=1.0), until=1e-3, samples=2)
    assert "synchronisation_error" not in run
    assert "unit" not in run.dims
