"""Couplings with further inputs: cables over pulleys, and tendons over several joints."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from tests.build import chain

import scissordyn as sd

TIGHT = {"rtol": 1e-10, "atol": 1e-12}  # Tolerances of accurate runs
ANGLE = sd.RelativeAngle  # Short name of the coordinate class


def hoist(*, depth: float = 0.4, block: float = 3.0) -> sd.Mechanism:
    """Return a block in the loop of a cable between A and the pulley B, and a counterweight of 2 kg below B."""
    spans = (
        (("ground", "A"), ("block", "centre")),
        (("block", "centre"), ("ground", "B")),
        (("ground", "B"), ("weight", "centre")),
    )
    first, second, last = (sd.Distance(*ends) for ends in spans)
    cable = sd.Coupling("cable", last, first, -1.0, further=(sd.FurtherInput(second, -1.0),))
    up = {"direction": 0.5 * math.pi}
    masses = {"block": (block, (0.0, -depth)), "weight": (2.0, (0.5, -1.0))}
    return sd.Mechanism(
        tuple(sd.point_mass(name, mass=mass, position=place) for name, (mass, place) in masses.items()),
        guides=tuple(sd.Guide(name, (name, "centre"), through=(place[0], 0.0), **up) for name, (_, place) in masses.items()),
        couplings=(cable,),
        ground=(("A", (-0.5, 0.0)), ("B", (0.5, 0.0))),
    )


def test_block_in_the_loop_of_a_cable():
    """Second formulation: the Lagrangian of the depth y, with the span z = L - 2 (a^2 + y^2)^(1/2), by scipy; the energy."""
    run, a, g = sd.simulate(hoist(), until=0.6, **TIGHT), 0.5, 9.81

    def rate(_: float, state: np.ndarray) -> list[float]:
        y, speed = state
        span = math.hypot(a, y)
        slope, bend = -2.0 * y / span, -2.0 * a * a / span**3
        return [speed, (3.0 * g + 2.0 * g * slope - 2.0 * slope * bend * speed**2) / (3.0 + 2.0 * slope**2)]

    found = solve_ivp(rate, (0.0, 0.6), [0.4, 0.0], t_eval=run["time"].values, rtol=1e-12, atol=1e-12)
    place = run["position"].values
    np.testing.assert_allclose(-place[:, 0, 1], found.y[0], atol=1e-8)
    np.testing.assert_allclose(2.0 * np.hypot(a, place[:, 0, 1]) - place[:, 1, 1], 2.0 * math.hypot(a, 0.4) + 1.0, atol=1e-10)
    drop = run["velocity"].values[:, 1, 1]
    tension = 2.0 * (g + np.gradient(drop, run["time"].values, edge_order=2))
    np.testing.assert_allclose(-run["coupling_force"].values[5:-5, 0], tension[5:-5], rtol=1e-3)
    turnover = float(np.ptp(run["potential_energy"].values))
    assert float(np.abs(run["energy_residual"]).max()) < 1e-8 * turnover


def test_balance_of_pulleys():
    """Closed form: at rest 2 M sin(alpha) = m, and the tension is M g."""
    sine = 3.0 / (2.0 * 2.0)
    run = sd.simulate(hoist(depth=0.5 * sine / math.sqrt(1.0 - sine**2)), until=0.2, **TIGHT)
    assert float(np.abs(run["velocity"]).max()) < 1e-9
    np.testing.assert_allclose(run["coupling_force"].values, -2.0 * 9.81, rtol=1e-8)


def test_tendon_over_joint_angles(tmp_path):
    """Identity: a weighted sum of three joint angles stays, the torques are in the weights' ratio, and the energy balances."""
    bars = tuple(sd.bar(name, length=0.3, mass=1.0, angle=0.3 * k) for k, name in enumerate("uvw"))
    weights = {"u": 1.0, "v": 0.7, "w": -0.4}
    angles = {"u": ANGLE("u"), "v": ANGLE("v", "u"), "w": ANGLE("w", "v")}
    further = (sd.FurtherInput(angles["w"], -weights["w"]),)
    tendon = sd.Coupling("tendon", angles["u"], angles["v"], -weights["v"], further=further)
    arm = chain(*bars, pins="ABC", couplings=(tendon,))
    run = sd.simulate(arm, until=0.5, **TIGHT)
    u, v, w = (run["angle"].sel(body=name).values for name in "uvw")
    total = weights["u"] * u + weights["v"] * (v - u) + weights["w"] * (w - v)
    np.testing.assert_allclose(total, total[0], atol=1e-9)
    assert float(np.ptp(v - u)) > 0.1
    assert float(np.abs(run["energy_residual"]).max()) < 1e-8 * float(run["kinetic_energy"].max())
    path = tmp_path / "case.toml"
    path.write_text(sd.case_text(arm), encoding="utf-8")
    assert sd.read_case(path).mechanism.couplings == (tendon,)
    path.write_text(sd.case_text(arm).replace(", ratio = 0.4 }", " }"), encoding="utf-8")
    with pytest.raises(sd.InputError, match="a further input without a ratio"):
        sd.read_case(path)
    with pytest.raises(sd.InputError, match="backlash in coupling 'tendon', which has further inputs"):
        sd.with_backlash(arm, "tendon", 0.01)
