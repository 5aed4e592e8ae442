"""Random mechanisms keep energy, momentum and the closure of their joints.

The number of mechanisms drawn by each test is MECHANISMS; set it in the environment for a longer search.
"""

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from benchmarks.random_mechanisms import judge
from energy_balance import closure_error, energy_drift, height_over_drift, masses, momentum_drift
from mechanisms import FRICTIONAL, random_mechanism

import scissordyn as sd

MECHANISMS = int(os.environ.get("MECHANISMS", "20"))  # Number of random mechanisms in each test
drawn = pytest.mark.parametrize("seed", range(MECHANISMS))
GAP_TOL = 1e-12
"""[m] Largest gap of an ideal joint: some hundred times round-off; the largest of a thousand runs was 3e-13."""
ENERGY_TOL = 1e-10
"""Largest relative error of energy: round-off of 1e-16 m in positions times 1e4 N is 1e-12 J in each step of a contact."""
MOMENTUM_TOL = 1e-13  # Largest relative error of linear momentum, which every one-step method conserves up to round-off


def run(mechanism, tolerance, *, until=0.1):
    """Return a complete run."""
    found = sd.simulate(mechanism, until=until, samples=101, rtol=tolerance, atol=tolerance)
    assert found.attrs["status"] == "complete", found.attrs["cause"]
    return found


@drawn
def test_energy_and_closure(seed):
    """Identity: elastic joints and springs keep the energy to the solver's error, which falls with its tolerance.

    Of the largest kinetic or stored energy, a hundred tolerances may be lost in up to a hundred contacts, and some rounding,
    which is that of heights where weights move little. Joints, guides and welds stay closed at every tolerance.
    """
    mechanism = random_mechanism(seed)
    for tolerance in (1e-6, 1e-9, 1e-13):
        found = run(mechanism, tolerance)
        assert closure_error(found, mechanism) < GAP_TOL
        rounding = ENERGY_TOL if found.sizes["contact"] else 1e-12 * max(1.0, height_over_drift(found, mechanism))
        assert energy_drift(found, mechanism) < 100.0 * tolerance + rounding


@drawn
def test_momentum_of_floating_mechanisms(seed):
    """Identity: without ground linear momentum is constant to rounding, angular momentum to the solver's error."""
    mechanism = random_mechanism(seed, floating=True)
    coarse, fine = run(mechanism, 1e-8), run(mechanism, 1e-13)
    for found in (coarse, fine):
        assert momentum_drift(found, mechanism)[0] < MOMENTUM_TOL
        assert closure_error(found, mechanism) < GAP_TOL
    assert momentum_drift(fine, mechanism)[1] < 1e-11


def angular_momentum_rate(found, mechanism):
    """Return the rate of angular momentum over time [N m], and the largest sum of the bodies' contributions."""
    mass, inertia = masses(mechanism)
    x, a = found["position"].values, found["acceleration"].values
    contributions = mass * (x[..., 0] * a[..., 1] - x[..., 1] * a[..., 0]) + inertia * found["angular_acceleration"].values
    lever = mass * np.hypot(x[..., 0], x[..., 1]) * np.hypot(a[..., 0], a[..., 1])
    return np.sum(contributions, axis=1), float(np.max(np.sum(lever + np.abs(contributions), axis=1)))


def assert_momentum_balances(found, mechanism):
    """Check that linear momentum is constant, and that forces on all bodies have no moment."""
    assert momentum_drift(found, mechanism)[0] < MOMENTUM_TOL
    rate, scale = angular_momentum_rate(found, mechanism)
    # the inner forces of a rotating body cancel up to round-off on the scale of the kinetic energy
    assert np.max(np.abs(rate)) <= 1e-13 * max(scale, float(found["kinetic_energy"].max()))


@drawn
def test_momentum_of_mechanisms_with_friction(seed):
    """Identity: with impacts and friction at all joints, actions equal reactions to 1e-13, and the energy balance closes."""
    mechanism = random_mechanism(seed, floating=True, clearances=FRICTIONAL, everywhere=True)
    found = run(mechanism, 1e-8)
    assert_momentum_balances(found, mechanism)
    assert np.max(np.abs(found["energy_residual"])) < 1e-6 * np.max(found["kinetic_energy"] + found["stored_energy"])


def test_mechanisms_of_all_sizes_and_parts():
    """Identity: with any laws, components, drives and controllers, of any size, a run balances or ends with a named cause.

    Each run of the test draws other mechanisms; a failure gives their numbers for `benchmarks.random_cases.random_case`.
    """
    first = int(os.environ.get("FIRST_MECHANISM", np.random.default_rng().integers(2**31)))
    outcomes = [judge(number) for number in range(first, first + max(30, MECHANISMS))]
    bad = [(each.seed, each.verdict, each.residual, each.reason) for each in outcomes if each.verdict == "FAULT"]
    assert not bad
    assert sum(each.verdict in ("balances", "coarse") for each in outcomes) > 0.6 * len(outcomes)


@pytest.mark.parametrize("motion", ["trapezoidal", "cycloidal"])
@pytest.mark.parametrize("method", ["dop853", "dopri5", "rodas5p"])
def test_breaks_of_drives(motion, method):
    """Identity: the work of a drive with jumps of acceleration, with a swinging load, balances as that of a smooth one."""
    move = sd.Trapezoidal(0.4, 1.6, 0.2, 0.25) if motion == "trapezoidal" else sd.Cycloidal(0.4, 1.6, 0.2)
    bars = (
        sd.bar("crank", length=0.4, mass=1.0, angle=0.4),
        sd.bar("rod", length=0.6, mass=1.5, position=(0.0, 0.0), angle=-1.0),
    )
    end = 0.4 * np.cos(0.4), 0.4 * np.sin(0.4)
    mechanism = sd.Mechanism(
        bodies=(bars[0], replace(bars[1], position=(float(end[0]), float(end[1])))),
        joints=(sd.Revolute("O", ("crank", "start"), ("ground", "O")), sd.Revolute("A", ("rod", "start"), ("crank", "end"))),
        ground=(("O", (0.0, 0.0)),),
        gravity=9.81,
        input_body="crank",
    ).driven(move)
    found = sd.simulate(mechanism, until=0.3, samples=301, method=method)
    assert found.attrs["status"] == "complete"
    # a hundred tolerances, as above
    assert float(np.max(np.abs(found["energy_residual"]))) < 1e-6 * float(np.max(np.abs(found["drive_work"])))


def test_break_under_a_heavy_load():
    """Identity: the energy balance closes over a break of a drive under a heavy load."""
    case = sd.read_case(Path(__file__).parent / "cases" / "heavy_drive.toml")
    found = sd.simulate(case.mechanism, until=case.run.until, samples=51)
    assert float(np.max(np.abs(found["energy_residual"]))) < 1e-7 * float(np.max(np.abs(found["drive_work"])))
