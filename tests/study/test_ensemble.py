"""Members whose starts differ by round-off."""

import json

import numpy as np
import pytest

from scissordyn.errors import InputError
from scissordyn.periodic.cycles import cycle
from scissordyn.periodic.ensemble import ensemble


@pytest.fixture(scope="module")
def diverging(impacting):
    """Four members of an irregular motion."""
    return ensemble(impacting, members=4, cycles=8, skip=2, engine=1)


def test_irregular_motion_diverges(impacting, diverging):
    """Limit: round-off of 1e-14 grows to a thousandth of the clearance within some cycles, and never at once."""
    assert set(diverging["status"].values) == {"complete"}
    assert 1 <= diverging.attrs["trusted_cycles"] < 8
    assert diverging.attrs["trusted_until"] == pytest.approx(0.125 * (diverging.attrs["trusted_cycles"] - 1))
    agreeing = diverging["agreeing"].values
    np.testing.assert_array_equal(agreeing[: diverging.attrs["trusted_cycles"]], 1.0)
    assert agreeing[-1] < 1.0
    np.testing.assert_array_equal(diverging["slider_velocity"].values[0], cycle(impacting, cycles=8)["slider_velocity"])


def test_warnings(impacting, diverging):
    """Cross-check: what members warn of stands once, as the first of them says it."""
    alone = cycle(impacting, cycles=8)
    said = json.loads(diverging.attrs["warnings"])
    assert said == json.loads(alone.attrs["warnings"])
    assert any("contacts start faster than" in text for text in said)


def test_means_and_spread(diverging):
    """Contract: numpy's mean and standard deviation over what is counted."""
    means = diverging["impacts"].values[:, 2:, 0].mean(axis=1)
    np.testing.assert_allclose(diverging["mean_impacts"].values[:, 0], means, rtol=1e-14)
    assert float(diverging["spread_impacts"][0]) == pytest.approx(np.std(means, ddof=1), rel=1e-12)
    assert float(diverging["spread_peak_force"][0]) > 0.0


def test_regular_motion_stays_together(frictional):
    """Limit: where a perturbation shrinks, all members agree to the end."""
    found = ensemble(frictional, members=3, cycles=6, engine=1)
    assert found.attrs["trusted_cycles"] == 6
    np.testing.assert_array_equal(found["agreeing"], 1.0)
    np.testing.assert_array_equal(found["divergence_cycle"], 6)
    assert not np.array_equal(found["eccentricity"].values[0], found["eccentricity"].values[1])


def test_seed(impacting):
    """Contract: the same seed gives the same members, another seed others."""
    here = ensemble(impacting, members=2, cycles=1, seed=5, engine=1)
    there = ensemble(impacting, members=2, cycles=1, seed=5, engine=1)
    other = ensemble(impacting, members=2, cycles=1, seed=6, engine=1)
    np.testing.assert_array_equal(here["eccentricity"], there["eccentricity"])
    assert not np.array_equal(here["drive_work"].values[1], other["drive_work"].values[1])


def test_what_cannot_be_used(periodic, impacting):
    """Contract: one-line errors."""
    for mechanism, options, words in (
        (periodic, {}, "without clearance joints"),
        (impacting, {"members": 1}, "members = 1"),
        (impacting, {"skip": 2}, "skip = 2 of 2 cycles"),
        (impacting, {"perturbation": 0.1}, "perturbation = 0.1"),
        (impacting, {"agreement": 0.0}, "agreement = 0.0"),
    ):
        with pytest.raises(InputError, match=words):
            ensemble(mechanism, **{"members": 2, "cycles": 2, **options})
