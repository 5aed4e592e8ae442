"""Along bars that bend: internal forces by equilibrium, deflection by closed forms, and their largest values."""

from __future__ import annotations

import math

import numpy as np
import pytest

import scissordyn as sd
from scissordyn.errors import InputError

PLACES = (0.0, 0.1, 0.33, 0.5, 0.97, 1.0)
RIGIDITY = 100.0


def clamped(elements: int, *, gravity: float = 0.0, **options: object) -> sd.Mechanism:
    """A bar of 1 m clamped at the origin."""
    pin = sd.Revolute("clamp", ("bar", "start"), ("ground", "O"))
    given = options or {"bending_stiffness": RIGIDITY, "axial_stiffness": 1e7}
    mass = 7850.0 * 4e-4 if options else 1.0
    made = sd.Mechanism(
        (sd.bar("bar", length=1.0, mass=mass),), (pin,), ground=(("O", (0.0, 0.0)),), gravity=gravity, input_body="bar"
    )
    return made.with_bending(elements=elements, **given)


def still(mechanism: sd.Mechanism) -> sd.simulate:
    """In static equilibrium."""
    return sd.simulate(mechanism, until=1e-6, samples=2, start="static")


@pytest.mark.parametrize("load", [0.1, 10.0])
def test_a_tip_force_is_in_equilibrium_with_every_section(load: float) -> None:
    """Identity: M = P (x_tip - x), N = P sin(angle), Q = P cos(angle) along a bar that is bent far."""
    made = clamped(4)
    push = sd.Force("push", ("bar/4", "end"), (0.0, RIGIDITY * load))
    made = made.with_parts({"components": (*made.components, push)}).driven(speed=0.0)
    run = still(made)
    found = sd.internal_forces(run, made, places=PLACES).isel(time=0, bar=0)
    tip = run["position"].sel(body="bar/4")[0].values
    x = found["position"].values[:, 0]
    np.testing.assert_allclose(found["bending_moment"], RIGIDITY * load * (tip[0] - x), atol=1e-7 * RIGIDITY * load)
    size = np.hypot(found["axial_force"], found["shear_force"])
    np.testing.assert_allclose(size, RIGIDITY * load, rtol=1e-6)
    assert found["axial_force"].values[0] == pytest.approx(0.0, abs=1e-5 * RIGIDITY * load)
    assert float(run["bar_largest_bending_moment"].item()) == pytest.approx(RIGIDITY * load * tip[0], rel=1e-7)
    assert float(run["bar_largest_bending_moment_place"].item()) == 0.0


def test_the_deflection_of_a_bar_on_two_pins() -> None:
    """Closed form: 5 w L^4/(384 EI) in the middle, w L^2/8 there, w L/2 at the ends, with the depth to the stress."""
    rod = sd.bar("bar", length=1.0, mass=7850.0 * 4e-4)
    pin = sd.Revolute("O", ("bar", "start"), ("ground", "O"))
    slot = sd.Guide("end", ("bar", "end"), (0.0, 0.0), 0.0)
    made = sd.Mechanism((rod,), (pin,), guides=(slot,), ground=(("O", (0.0, 0.0)),), gravity=9.81)
    made = made.with_bending(section="solid 20x20 mm", material="steel", elements=16)
    run = still(made)
    weight, rigidity = 7850.0 * 4e-4 * 9.81, 210e9 * 0.02**4 / 12.0
    found = sd.internal_forces(run, made, places=[0.0, 0.25, 0.5]).isel(time=0, bar=0)
    middle = 5.0 * weight / (384.0 * rigidity)
    quarter = weight / (24.0 * rigidity) * 0.25 * (1.0 - 2.0 * 0.25**2 + 0.25**3)
    np.testing.assert_allclose(found["deflection"], [0.0, -quarter, -middle], rtol=1e-4, atol=1e-9)
    np.testing.assert_allclose(
        np.abs(found["bending_moment"]), weight * np.array([0.0, 3.0 / 32.0, 0.125]), rtol=1e-6, atol=1e-8
    )
    np.testing.assert_allclose(np.abs(found["shear_force"]), weight * np.array([0.5, 0.25, 0.0]), rtol=1e-6, atol=1e-6)
    assert abs(run["bar_largest_stress"].item()) == pytest.approx(weight / 8.0 * 0.01 / (0.02**4 / 12.0), rel=1e-5)
    assert run["bar_largest_stress_place"].item() == pytest.approx(0.5)
    assert run["bar_largest_deflection"].item() == pytest.approx(-middle, rel=1e-4)
    assert run["bar_largest_utilisation"].item() == pytest.approx(run["bar_largest_stress"].item() / 235e6)


def test_heated_bars_bend_without_forces() -> None:
    """Closed form: an arc of curvature alpha dT/h, whose sagitta is the deflection; nothing is stressed."""
    made = clamped(2, section="solid 20x20 mm", material="steel", temperature_difference=30.0).driven(speed=0.0)
    found = sd.internal_forces(still(made), made, places=[0.25, 0.5]).isel(time=0, bar=0)
    radius = 0.02 / (12e-6 * 30.0)
    sagitta = radius * (1.0 - math.cos(0.5 / radius))
    assert abs(found["deflection"].values[1]) == pytest.approx(sagitta, rel=1e-7)
    assert np.all(np.abs(found["bending_moment"].values) < 1e-8)


def test_the_array_has_moments_that_pins_end() -> None:
    """Identity: free ends carry nothing, a pin at a bar's end no moment; the places are those asked for, the largest found."""
    arm = sd.scissor(units=1, bar_length=2.0, bar_mass=5.68)
    arm = arm.with_bending(section="tube 60x60x1.56 mm", material="steel", elements=4).driven(speed=1.0)
    run = sd.simulate(arm, until=2e-3, samples=21)
    found = sd.internal_forces(run, arm, places=[0.0, 0.5, 1.0])
    assert found.sizes == {"time": 21, "bar": 2, "place": 3, "axis": 2}
    np.testing.assert_allclose(found["distance"], [[0.0, 1.0, 2.0]] * 2)
    pinned = found["bending_moment"].sel(bar="unit 1/bar 2").values[:, [0, 2]]
    # the axis between cross-sections and the shapes of its inertia differ by the square of the rotation within an element
    assert np.max(np.abs(pinned)) < 1e-7 * float(np.abs(found["bending_moment"]).max())
    fine = sd.internal_forces(run, arm, places=17)
    for name in ("bending_moment", "deflection"):
        largest = np.abs(run[f"bar_largest_{name}"].values)
        np.testing.assert_allclose(largest, np.abs(fine[name]).max(dim=("time", "place")), rtol=1e-9)


def test_what_has_no_internal_forces_is_refused() -> None:
    """Bad input: rigid bars, a place beyond the bar, a bar of another name."""
    rigid = sd.scissor(units=1).driven(speed=1.0)
    run = sd.simulate(rigid, until=1e-4, samples=3)
    assert "bar" not in run.dims
    with pytest.raises(InputError, match="do not bend"):
        sd.internal_forces(run, rigid)
    made = clamped(1).driven(speed=0.0)
    run = still(made)
    with pytest.raises(InputError, match="from 0 to 1"):
        sd.internal_forces(run, made, places=[1.5])
    with pytest.raises(InputError, match="bar"):
        sd.internal_forces(run, made, bars="rod")
