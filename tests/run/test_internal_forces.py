"""Along bars that bend: internal forces by equilibrium, deflection by closed forms, and their largest values."""

from __future__ import annotations

import dataclasses
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


def by_modes(*loads: sd.Force, **options: float) -> sd.Mechanism:
    """A bar of 1 m and 1 kg by modes, clamped at the origin by its drive."""
    pin = sd.Revolute("clamp", ("bar", "start"), ("ground", "O"))
    body, ground = sd.bar("bar", length=1.0, mass=1.0), (("O", (0.0, 0.0)),)
    made = sd.Mechanism((body,), (pin,), ground=ground, gravity=0.0, input_body="bar", components=loads)
    return made.with_bending(**{"bending_stiffness": RIGIDITY, "axial_stiffness": 1e7, "modes": 8} | options)


@pytest.mark.parametrize("modes", [2, 12])
@pytest.mark.parametrize("axial", [1e5, 1e9])
def test_internal_forces_of_a_bar_by_modes_are_in_equilibrium(modes: int, axial: float) -> None:
    """Identity: N = P sin(angle), Q = P cos(angle), M = P (x_tip - x) for any EA and few modes, P L^2/EI = 10."""
    force = 10.0 * RIGIDITY
    made = by_modes(sd.Force("push", ("bar", "end"), (0.0, force)), modes=modes, axial_stiffness=axial).driven(speed=0.0)
    run = still(made)
    found = sd.internal_forces(run, made, places=[0.0, 0.5, 1.0]).isel(time=0, bar=0)
    x = run["position"].sel(body=["bar", "bar/1", "bar/2"], axis="x")[0].values
    assert found["bending_moment"].values == pytest.approx(force * (x[-1] - x), abs=1e-6 * force)
    assert np.hypot(found["axial_force"], found["shear_force"]).values == pytest.approx([force] * 3, rel=1e-6)
    tip = float(run["angle"].sel(body="bar/2")[0])
    assert found["axial_force"].values[[0, 2]] == pytest.approx([0.0, force * math.sin(tip)], abs=1e-5 * force)
    ends, starts = run["beam_end_axial_force"][0].values, run["beam_start_axial_force"][0].values
    assert starts[1:] == pytest.approx(ends[:-1], abs=1e-7 * force)  # no steps where nothing acts


@pytest.mark.parametrize("force", [(1000.0, 0.0), (-1000.0, 0.0)])
def test_a_force_along_a_bar_is_its_axial_force_up_to_where_it_acts(force: tuple[float, float]) -> None:
    """Contract: in the half before the force all of it, none beyond."""
    made = by_modes(sd.Force("push", ("bar", "middle"), force)).driven(speed=0.0)
    found = sd.internal_forces(still(made), made, places=[0.0, 0.2, 0.499, 0.501, 1.0])["axial_force"].isel(time=0, bar=0)
    assert found.values == pytest.approx([force[0]] * 3 + [0.0] * 2, abs=1e-5)


@pytest.mark.parametrize("units", [1, 2])
def test_a_moving_array_of_bars_by_modes_has_free_ends(units: int) -> None:
    """Identity: Newton's law of the whole bar: nothing at free ends, no moment at pins, the reaction at the driven end."""
    arm = sd.scissor(units=units).with_clearance("A", sd.Clearance(0.5e-3))
    made = arm.with_bending(section="tube 60x60x1.56 mm", material="steel", modes=4).driven(speed=sd.rpm(150))
    run = sd.simulate(made, until=4e-3, samples=41)
    found = sd.internal_forces(run, made, places=[0.0, 1.0])
    largest = float(np.abs(found["axial_force"]).max())
    free = found.sel(bar=[f"unit {units}/bar 1", f"unit {units}/bar 2"]).isel(place=1)
    for name in ("axial_force", "shear_force", "bending_moment"):
        assert float(np.abs(free[name]).max()) < 1e-7 * largest
    root = found.isel(place=0).sel(bar="unit 1/bar 1")
    reaction = np.hypot(*run["reaction"].sel(joint="O").values.T)
    assert np.hypot(root["axial_force"], root["shear_force"]).values == pytest.approx(reaction, rel=1e-9)


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


TUBE = {"bending_stiffness": 43620.7, "axial_stiffness": 76579776.0}


@pytest.mark.parametrize("modes", [2, 6, 8, 24])
@pytest.mark.parametrize(("load", "within"), [("end", 0.003), ("middle", 0.045), ("weight", 0.007)])
def test_a_clamped_bar_extends_as_by_its_closed_form(load: str, within: float, modes: int) -> None:
    """Closed form: F L/(EA), F L/(2 EA) at the middle, m g L/(2 EA); the direction of the drive itself has no strain."""
    force, body = 1000.0, "bar/1" if load == "middle" else "bar/2"
    push = sd.Force("push", ("bar", load), (force, 0.0))
    made = by_modes(*([push] if load != "weight" else []), modes=modes, **TUBE)
    if load == "weight":
        made = dataclasses.replace(made, gravity=force, gravity_direction=0.0)
    run = still(made.driven(speed=0.0))
    away = float(np.hypot(*run["position"].sel(body=body)[0].values)) - (0.5 if load == "middle" else 1.0)
    assert away == pytest.approx((1.0 if load == "end" else 0.5) * force / TUBE["axial_stiffness"], rel=within)
