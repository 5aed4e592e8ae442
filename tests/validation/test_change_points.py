"""Change points: a mechanism that moves goes on along its own smooth branch, at any speed; a lock stops it."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from benchmarks.change_points import judge, linkage, rocker_angle

import scissordyn as sd
from scissordyn.run.summary import summary_of


@pytest.mark.parametrize("seed", range(24))
def test_random_linkage_stays_on_its_branch(seed: int) -> None:
    """Closed form: driven, free, turned by a torque or beside a clearance joint; see benchmarks/change_points.py."""
    assert judge(seed).verdict == "on its branch"


@pytest.mark.parametrize("speed", [0.5, 1.0, 2.0, 3.0, 4.5])
@pytest.mark.parametrize("samples", [21, 361])
def test_driven_through_the_stretched_position(speed: float, samples: int) -> None:
    """Closed form: a 4-1-3-2 linkage at any speed; velocities are continuous, the balance closes, it is warned of once.

    With 361 samples one is at the change point itself.
    """
    lengths, first = (4.0, 1.0, 3.0, 2.0), math.pi / 3
    run = sd.simulate(linkage(lengths, first, -1.0, "driven", speed), until=2.0 * math.pi / speed, samples=samples)
    assert run.attrs["status"] == "complete"
    crank, rocker = (run["angle"].sel(body=name).values for name in ("crank", "rocker"))
    assert np.max(np.abs(np.exp(1j * rocker) - np.exp(1j * rocker_angle(lengths, crank, -1.0)))) < 1e-9
    rate = run["angular_velocity"].sel(body="rocker").values / speed
    fine = np.linspace(crank[0], crank[-1], 20001)
    slope = np.gradient(np.unwrap(rocker_angle(lengths, fine, -1.0)), 2.0 * math.pi / 20000)
    expected = np.interp(crank, fine, slope)
    assert np.max(np.abs(rate - expected)[1:-1]) < 1e-4
    assert np.all(np.isfinite(run["angular_acceleration"].values))
    assert float(np.max(np.abs(run["energy_residual"]))) < 1e-5 * float(run["kinetic_energy"].max())
    assert sum("change point" in text for text in json.loads(run.attrs["warnings"])) == 1


def test_lock_has_no_largest_torque() -> None:
    """Limit: the torque of a drive at constant speed grows without limit towards a locking position."""
    run = sd.simulate(sd.slider_crank(crank=0.12, rod=0.1, angle=0.5).driven(speed=1.0), until=1.0)
    assert run.attrs["status"] == "failed"
    assert "grows without limit" in str(summary_of(run).actuators[0])
