"""Kinked bars that bend: straight legs whose directions are held together at the kink."""

import dataclasses
import math

import numpy as np
import pytest
from scipy.optimize import brentq
from tests.build import assert_balance, on_pin

import scissordyn as sd

# Lengths of both legs [m], mass [kg], bending stiffness EI [N m^2] and axial stiffness EA [N] of a kinked bar
FIRST, SECOND, MASS, RIGIDITY, AXIAL = 1.2, 0.8, 4.0, 2000.0, 1e9


def frame(*, load=None, **how):
    """Return an L: a leg along x that is clamped by its drive, and a leg along y."""
    body = sd.angulated_bar("frame", first=FIRST, second=SECOND, kink=0.5 * math.pi, mass=MASS)
    forces = () if load is None else (sd.Force("load", ("frame", "end"), load),)
    return sd.with_bending(on_pin(body, *forces), bending_stiffness=RIGIDITY, axial_stiffness=AXIAL, **how).driven(speed=0.0)


@pytest.mark.parametrize("how", [{"modes": 4}, {"elements": 2}])
def test_a_loaded_frame_deflects_as_its_closed_form(how):
    """Closed form: tip P b^3/(3 EI) + P a b^2/EI along the load, kink P b a^2/(2 EI) across it, turned by P a b/EI."""
    push, sides = 2.0, []
    for sense in (1.0, -1.0):  # half of the difference is free of what is even in the load
        made = frame(load=(sense * push, 0.0), **how)
        run = sd.simulate(made, until=1e-4, samples=2, start="static", method="dop853").isel(time=0)
        tip = next(body.name for body in made.bodies if "end" in body.points)
        kink = next(body.name for body in made.bodies if "pivot" in body.points)
        place, torque = run["position"], float(run["drive_torque"].values.ravel()[0])
        down, turn = -float(place.sel(body=kink, axis="y")), -float(run["angle"].sel(body=kink))
        sides.append([float(place.sel(body=tip, axis="x")), down, turn, torque])
    found = 0.5 * (np.array(sides[0]) - sides[1])
    bent = push * SECOND / RIGIDITY * np.array([SECOND * (SECOND / 3.0 + FIRST), 0.5 * FIRST**2, FIRST, RIGIDITY])
    assert found == pytest.approx(bent, rel=1e-5)


def characteristic(beta):
    """Zero at a frequency of the frame with inextensible legs: leg 2 moves along itself with the end of leg 1."""
    z, mass = beta * FIRST, SECOND
    cos, sin, cosh, sinh = math.cos(z), math.sin(z), math.cosh(z), math.sinh(z)
    even, odd = (cosh - cos, sinh + sin, cosh + cos, sinh - sin), (sinh - sin, cosh - cos, sinh + sin, cosh + cos)
    c, s, ch, sh = (f(beta * SECOND) for f in (math.cos, math.sin, math.cosh, math.sinh))
    # unknowns: both of leg 1, and of leg 2, u = p (cosh - cos) + q sinh + r sin, which is pinned at the kink
    rows = [
        [even[1], odd[1], 0.0, -1.0, -1.0],  # slope
        [even[2], odd[2], -2.0, 0.0, 0.0],  # moment
        [even[3] + beta * mass * even[0], odd[3] + beta * mass * odd[0], 0.0, 0.0, 0.0],  # EI w''' = -m omega^2 w
        [0.0, 0.0, ch + c, sh, -s],  # no moment at the end
        [0.0, 0.0, sh - s, ch, -c],  # no shear at the end
    ]
    return float(np.linalg.det(np.array(rows)))


def test_frequencies_of_a_frame():
    """Closed form: the first three frequencies; cubic elements are a second road."""
    grid = np.linspace(0.2, 6.0, 200)
    values = [characteristic(beta) for beta in grid]
    changes = [k for k in range(len(grid) - 1) if values[k] * values[k + 1] < 0.0][:3]
    beta = np.array([brentq(characteristic, grid[k], grid[k + 1], xtol=1e-13) for k in changes])
    expected = beta**2 * math.sqrt(RIGIDITY * (FIRST + SECOND) / MASS)
    for how, within in (({"modes": 8}, 2e-5), ({"elements": 16}, 2e-5)):
        omega = sd.modes(frame(**how), position="concentric", count=3)["angular_frequency"].values
        assert omega == pytest.approx(expected, rel=within)


@pytest.mark.parametrize("method", ["dop853", "rodas5p"])
def test_a_ring_of_kinked_tubes_keeps_its_energy(method):
    """Identity: the energy balance of a polar array; legs have the mass of the bar."""
    rigid = sd.polar_scissor(units=2, kink=0.3, angle=0.6)
    made = sd.with_bending(rigid, section="tube 60x60x1.56 mm", material="steel", mass="section", modes=2)
    assert len(made.welds) == 4
    bars = [part for part in made.components if isinstance(part, sd.FlexibleBar)]
    assert sum(bar.mass_per_length * bar.length for bar in bars) == pytest.approx(
        sum(body.mass for body in made.bodies if body.name.startswith("unit")), rel=1e-12
    )
    run = sd.simulate(made.driven(speed=1.0), until=5e-3, samples=11, method=method)
    assert_balance(run, 1e-7, ("kinetic_energy",))


def test_kinked_bar_that_is_not_uniform():
    """Contract: legs of uniform tubes cannot stand for a kinked bar with another moment of inertia."""
    body = sd.angulated_bar("frame", first=FIRST, second=SECOND, kink=0.5 * math.pi, mass=MASS)
    assert body.inertia is not None
    heavy = dataclasses.replace(body, inertia=2.0 * body.inertia)
    with pytest.raises(sd.InputError, match="no uniform bar"):
        sd.with_bending(on_pin(heavy), bending_stiffness=RIGIDITY, axial_stiffness=AXIAL)
