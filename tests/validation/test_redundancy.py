"""Reactions with redundant joints, and with a sufficient number."""

import dataclasses
import math

import numpy as np
import pytest

import scissordyn as sd
from reference.multipliers import Multipliers

TIGHT = {"rtol": 1e-12, "atol": 1e-12}  # Tolerances of accurate runs
START = math.pi / 9  # [rad] inclination of the bars of a ring at the start

# Mechanism, and number of its redundant constraints, by name
CASES = {
    **{f"ring of {units}": (sd.hoberman_ring(units=units, angle=START).driven(speed=-0.3), 4) for units in (3, 4, 6, 12)},
    **{f"{units} four-bars": (sd.n_four_bar(units), 0) for units in (1, 2, 5)},
    "scissor": (sd.scissor(units=3).driven(speed=1.0), 0),
    "curved scissor": (sd.polar_scissor(units=3).driven(speed=1.0), 0),
    "mast": (sd.mast(units=2).driven(speed=1.0), 0),
}


def state(model, run, instant):
    """Return the reference's coordinates and rates at an instant of a run."""
    here = run.isel(time=instant)
    moved = np.column_stack([here["position"].values - model.centre[:-1], here["angle"].values - model.angle[:-1]])
    rates = np.column_stack([here["velocity"].values, here["angular_velocity"].values])
    return moved.ravel()[model.active], rates.ravel()[model.active]


@pytest.mark.parametrize("case", CASES)
def test_redundancy(case):
    """Second formulation: reactions are undetermined, with a warning, where the reference's gradients are rank deficient.

    A ring has 6 N coordinates, 6 N conditions of its pins, 3 of its guides and 1 of the drive, and one freedom without the
    drive: 4 conditions are redundant. The others have none; their reactions agree with the reference's multipliers to 1e-9.
    """
    mechanism, surplus = CASES[case]
    model = Multipliers(mechanism)
    run = sd.simulate(mechanism, until=0.2, samples=5, **TIGHT)
    assert run.attrs["status"] == "complete"
    for instant, t in enumerate(run["time"].values.tolist()):
        q, v = state(model, run, instant)
        position, rate, gradient, _ = model.conditions(t, q, v, model.pins)
        assert np.max(np.abs(position)) < 1e-11
        assert np.max(np.abs(rate)) < 1e-10
        values = np.linalg.svd(gradient, compute_uv=False)
        rank = int(np.count_nonzero(values > 1e-9 * values[0]))
        assert gradient.shape[0] - rank == surplus
        reactions = run["reaction"].values[instant, : len(mechanism.joints)]
        if surplus:
            assert np.all(np.isnan(reactions))
            continue
        _, forces = model.solve(t, q, v, [])
        expected = forces[: 2 * len(mechanism.joints)].reshape(-1, 2)
        assert np.allclose(reactions, expected, rtol=0, atol=1e-9 * np.max(np.abs(expected)))
    assert ("not determined" in run.attrs["warnings"]) is bool(surplus)


@pytest.mark.parametrize("units", [3, 6, 12])
def test_ring_energy(units):
    """Closed form: kinetic energy of a ring, independent of its supports, to 1e-9.

    Pivots move along rays at R' = -p sin th th'/sin(k/2); every bar turns at th' relative to its ray, its mass centre at
    s = (p/2) sin(k/2) from the pivot: T = N [m R'^2 + 2 m s sin th R' th' + I_p th'^2], I_p = m p^2/3.
    """
    ring = sd.hoberman_ring(units=units, angle=START).driven(speed=0.7)
    run = sd.simulate(ring, until=0.2, samples=9, **TIGHT)
    leg, half, mass = 0.5, math.pi / units, ring.bodies[0].mass
    th, rate = START + 0.7 * run["time"].values, 0.7
    radial = -leg * np.sin(th) * rate / math.sin(half)
    offset, about_pivot = 0.5 * leg * math.sin(half), mass * leg**2 / 3.0
    expected = units * (mass * radial**2 + 2.0 * mass * offset * np.sin(th) * radial * rate + about_pivot * rate**2)
    assert np.allclose(run["kinetic_energy"].values, expected, rtol=1e-9, atol=0)


def test_reactions_at_the_folded_position():
    """Limit: where all bars of the N-four-bar lie on one line, reactions are undetermined there and nowhere else.

    The start is exactly on the line, where one constraint is dependent (docs/mechanisms.md: singular mechanisms).
    """
    upright = sd.n_four_bar(2, speed=0.0)
    flat = []
    for body in upright.bodies:
        turned = {"angle": 0.0} if body.name.startswith("crank") else {"position": (float(body.name[-1]), 0.0)}
        flat.append(dataclasses.replace(body, velocity=(0.0, 0.0), angular_velocity=0.0, **turned))
    run = sd.simulate(upright.replace("bodies", tuple(flat)), until=0.2, samples=5, **TIGHT)
    assert run.attrs["status"] == "complete"
    determined = np.all(np.isfinite(run["reaction"].values), axis=(1, 2))
    assert determined.tolist() == [False, True, True, True, True]
    # the pendulum of docs/reference.md: th'' = -((N+1)/2 + N) g / (((N+1)/3 + N) L) at th = 0
    assert run["angular_acceleration"].sel(body="crank 0").values[0] == pytest.approx(-3.5 * 9.81 / 3.0, rel=1e-12)
