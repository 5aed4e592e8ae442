"""Time stepping with hard contact: components that damp in several directions, bushings and oil films, taken implicitly."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr
from scipy.linalg import expm

import scissordyn as sd
from scissordyn.component.bushing import Bushing
from scissordyn.model.body import Body
from scissordyn.model.joint import Revolute
from scissordyn.model.mechanism import Mechanism

WIDE = Revolute("wide", ("free", "c"), ("ground", "o"), sd.Clearance(10.0, journal_radius=11.0, contact="hard"))
"""A bearing so wide that the point mass in it, hard as its contact is, does not touch."""

MASS, INERTIA = 2.0, 1e-3
OIL = sd.Clearance(1e-4, journal_radius=1e-2, bearing_length=2e-2, lubrication=sd.Lubrication(viscosity=0.1))


def shaft(mass: float = MASS, spin: float = 30.0, **parts: Any) -> Mechanism:
    """A shaft beside the mass whose contact is hard, so that time stepping moves both."""
    joints = (WIDE, *parts.pop("joints", ()))
    bodies = (
        Body("free", 1.0, None, {"c": (0.0, 0.0)}),
        Body("shaft", mass, INERTIA, {"c": (0.0, 0.0)}, velocity=(0.02, 0.0), angular_velocity=spin),
    )
    return Mechanism(bodies, joints=joints, ground=(("o", (0.0, 0.0)),), **parts)


def run_of(one: Mechanism, until: float, **how: Any) -> xr.Dataset:
    """A run of it that is complete."""
    run = sd.simulate(one, until=until, start="as-placed", samples=101, **how)
    assert run.attrs["status"] == "complete"
    return run


def test_a_bushing_decays_by_the_exponential_of_its_damping() -> None:
    """Closed form: v = exp(-D t/m) v_0 + (1 - exp(-D t/m)) D^-1 m g, its angle alike, of the second order in the step."""
    damping, around, t = np.array([[800.0, 300.0], [300.0, 500.0]]), 0.6, 0.01
    bushing = Bushing(
        "bushing",
        ("ground", "o"),
        ("shaft", "c"),
        damping_x=damping[0, 0],
        damping_y=damping[1, 1],
        damping_xy=damping[0, 1],
        torsional_damping=around,
    )
    one, decay = shaft(components=(bushing,)), expm(-damping * t / MASS)
    last = np.linalg.solve(damping, [0.0, -9.81 * MASS])
    exact = [*(decay @ [0.02, 0.0] + last - decay @ last), 30.0 * np.exp(-around * t / INERTIA)]
    errors = []
    for step in (5e-4, 2.5e-4):
        end = run_of(one, t, step=step).isel(time=-1).sel(body="shaft")
        errors.append([*end["velocity"].values, float(end["angular_velocity"])] - np.array(exact))
    assert np.all(np.abs(errors[0] / errors[1] - 4.0) < 0.5), errors
    far = run_of(shaft(spin=0.0, components=(bushing,)), 1.2, step=0.1)["position"].isel(time=-1).sel(body="shaft").values
    assert far == pytest.approx(last * 1.2, rel=1e-2)  # steps of up to 60 times the time of decay


def test_a_film_as_with_controlled_error() -> None:
    """Cross-check: the path of a journal that sinks into its oil against Rosenbrock steps of controlled error, order two."""
    oiled = Revolute("oiled", ("shaft", "c"), ("ground", "o"), OIL)
    one = shaft(20.0, 0.0, joints=(oiled,))
    exact = run_of(one.with_clearance("wide", sd.Clearance(10.0, journal_radius=11.0)), 0.05, method="rodas5p", rtol=1e-10)
    assert float(exact["film_least_thickness"].squeeze()) < 0.08 * OIL.clearance
    deviation = []
    for step in (1.25e-4, 6.25e-5):
        run = run_of(one, 0.05, step=step)
        apart = run["eccentricity"].sel(joint="oiled") - exact["eccentricity"].sel(joint="oiled")
        deviation.append(float(np.abs(apart).max()))
        assert float(run["film_least_thickness"].squeeze()) == pytest.approx(
            float(exact["film_least_thickness"].squeeze()), rel=3e-3
        )
        assert float(run["damper_loss"][-1]) == pytest.approx(float(exact["damper_loss"][-1]), rel=1e-5)
    assert deviation[0] < 2e-4 * OIL.clearance
    assert 3.5 < deviation[0] / deviation[1] < 4.5


def test_a_film_beside_hard_contact_at_the_default_step() -> None:
    """Limit: least film and what oil loses in a scissor mast, as with a step of a tenth; explicit in oil, 9 um for 2.7."""
    arm = sd.scissor(units=3, bar_length=0.5, bar_mass=0.5, slider_mass=0.3, angle=sd.degrees(50), gravity=9.81)
    dry = sd.Clearance(1e-4, journal_radius=5e-3, damping=sd.Flores(0.7), friction=sd.Ambrosio(kinetic=0.1), contact="hard")
    arm = arm.with_clearance("unit 1/pivot", dry).with_clearance("unit 2/pivot", OIL)
    arm = arm.driven(sd.Cycloidal(sd.degrees(50), sd.degrees(20), 0.5))
    found = []
    for step in ({}, {"step": 4e-6}):
        run = sd.simulate(arm, until=0.5, samples=51, **step)
        assert float(np.abs(run["energy_residual"]).max()) < 1e-4 * float(run["damper_loss"][-1])
        found.append((float(run["film_least_thickness"].squeeze()), float(run["damper_loss"][-1])))
    assert found[0] == pytest.approx(found[1], rel=5e-3)
