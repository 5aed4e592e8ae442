"""Hard contact of journals that slide around their bearings, under load, in chains, and together with bushings and oil."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest
import xarray as xr
from scipy.linalg import expm
from tests.build import EXAMPLES, counts_of, in_bearing, in_c, warnings_of

import scissordyn as sd
from scissordyn.kernel import kernel
from scissordyn.mechanics.hard_rows import open_hard
from scissordyn.mechanics.pivoting import pivot
from scissordyn.plan.plan import plan
from scissordyn.run.advance.loop import advance
from scissordyn.run.trajectory import make_driver


def pendulum(angle: float, speed: float, gravity: float, restitution: float = 0.5) -> sd.Mechanism:
    """Return a frictionless journal of 1 kg that touches its bearing of 1 m clearance at an angle from below."""
    gap = sd.Clearance(1.0, journal_radius=1.1, damping=sd.LankaraniNikravesh(restitution), contact="hard")
    place, velocity = (math.sin(angle), -math.cos(angle)), (speed * math.cos(angle), speed * math.sin(angle))
    return dataclasses.replace(in_bearing(gap, position=place, velocity=velocity), gravity=gravity)


def test_sliding_around_a_bearing_loses_nothing():
    """Closed form: without gravity and friction a journal slides around at constant speed, by 0.1 rad per step."""
    run = sd.simulate(pendulum(0.0, 2.0, 0.0, 0.0), until=10.0, start="as-placed", step=0.05, events="crossed")
    speed = np.hypot(*run["velocity"].sel(body="ball").transpose("axis", "time").values)[::100]
    assert abs(speed[-1] / speed[1] - 1.0) < 5e-3
    radius = np.hypot(*run["position"].sel(body="ball").transpose("axis", "time").values)[::100]
    assert np.all(np.abs(radius - 1.0) < 5e-3)


def test_period_of_a_journal_under_load():
    """Closed form: under gravity a journal is a pendulum of length c with the period 2 pi (c/g)^0.5 (1 + a^2/16)."""
    run = sd.simulate(pendulum(0.1, 0.0, 9.81), until=10.0, start="as-placed", step=0.01, samples=1001)
    x, time = run["position"].sel(body="ball", axis="x").values, run["time"].values
    rising = np.flatnonzero((x[:-1] < 0.0) & (x[1:] >= 0.0))
    crossed = time[rising] - x[rising] * (time[rising + 1] - time[rising]) / (x[rising + 1] - x[rising])
    period = 2.0 * math.pi / math.sqrt(9.81) * (1.0 + 0.1**2 / 16.0)
    assert np.diff(crossed).mean() == pytest.approx(period, rel=1e-3)
    assert np.abs(x[-300:]).max() == pytest.approx(math.sin(0.1), rel=2e-2)


def test_oscillation_faster_than_the_step_decays():
    """Limit: with twice the stable step of an explicit method, the oscillation of a loaded journal decays."""
    run = sd.simulate(pendulum(0.01, 0.0, 9.81), until=100.0, start="as-placed", step=4.0 / math.sqrt(9.81), events="crossed")
    speed = np.hypot(*run["velocity"].sel(body="ball").transpose("axis", "time").values)
    assert speed[-1] < 1e-3 * speed.max()


def chain() -> sd.Mechanism:
    """Return a mast of eight units under gravity with every joint loose."""
    joint = sd.Clearance(
        30e-6, journal_radius=5e-3, damping=sd.Flores(0.7), friction=sd.LuGre(kinetic=0.1), contact="hard", bearing_length=1e-2
    )
    sizes = {"bar_length": 0.5, "bar_mass": 0.2, "slider_mass": 0.3, "platform_mass": 1.0}
    arm = sd.mast(units=8, angle=sd.degrees(15), **sizes)
    return arm.with_clearance("all", joint).driven(sd.Cycloidal(sd.degrees(15), sd.degrees(60), 5.0))


def pivot_at(least: int, m: int, hard: int) -> int:
    """Call `pivoting.pivot` on the address of a hard system."""
    return pivot(least, m, open_hard(hard))


def test_impulses_by_pivoting():
    """Cross-check: pivoting of every third contact, and of all, agrees with Newton's method and the contact law.

    Contacts of an eight-unit mast that stay closed are elastic, so that the solution is unique.
    """
    step, seen = 1e-4, 0
    driver, _, _ = make_driver(plan(chain()), sd.Options(1.0, start="in-contact", step=step))
    driver.sample_at(np.zeros(0))
    model, work = driver.stepping.content.model, driver.stepping.content.work
    m, compiled = driver.plan.model.constraint_start.size - 1, in_c(pivot_at)
    for k in range(0, 200, 10):
        advance(driver, (k + 10) * step, most_steps=10)
        impulse, velocity = work.impulse.copy(), work.velocity.copy()
        taking_part = work.gram[model.place[m : m + 2 * model.which.size : 2], model.reach[0]] > 0.0
        work.closed[taking_part] = 1  # those that the step has opened too
        force, speed = np.abs(impulse).max(), np.abs(work.free).max()
        work.restless[:] = np.arange(model.which.size) % 3 == 0
        # in Python once, where every index is checked
        for least, pivoted in ((1, kernel(pivot_at)), (1, compiled), (0, compiled))[k > 0 :]:
            assert pivoted(least, m, driver.stepping.hard.address) >= 0
            np.testing.assert_allclose(work.impulse, impulse, atol=1e-6 * force)
            np.testing.assert_allclose(work.velocity, velocity, atol=1e-6 * speed)
        a, b = model.place[m : m + 2 * model.which.size : 2], model.place[m + 1 : m + 2 * model.which.size : 2]
        own = work.gram[a, model.reach[0]] > 0.0
        p, u = work.impulse[a][own], (work.velocity[a] + work.compliance * work.impulse[a] + work.offset)[own]
        seen += int(np.count_nonzero(work.compliance[own] * p > 0.0))
        slip = work.velocity[b][own]
        rubs = (work.impulse[b] - work.lag + work.turning_mass * work.velocity[b])[own]
        limit = work.friction[own] * p
        assert p.min() > -1e-12 * force
        assert u.min() > -1e-8 * speed
        assert np.abs(p * u).max() < 1e-8 * force * speed
        assert np.all(np.abs(rubs) <= limit + 1e-8 * force)
        slides = np.abs(slip) > 1e-7 * speed
        np.testing.assert_allclose(rubs[slides], -limit[slides] * np.sign(slip[slides]), atol=1e-7 * force)
    assert seen > 100


def test_every_step_of_a_long_array_is_solved():
    """Contract: where Newton's method cycles, only the few contacts that change their modes are pivoted."""
    joint = sd.Clearance(1e-4, damping=sd.Flores(0.7), friction=sd.LuGre(kinetic=0.1), contact="hard")
    arm = sd.scissor(units=64, bar_length=0.5, bar_mass=0.2, slider_mass=0.3, angle=sd.degrees(60), gravity=9.81)
    move = sd.Cycloidal(sd.degrees(60), sd.degrees(58), 2.0)
    run = sd.simulate(arm.with_clearance("all", joint).driven(move), until=0.2, step=1e-4, samples=3, start="concentric")
    counts = counts_of(run)
    assert counts["steps_not_solved"] == 0
    assert 0 < counts["pivots"] < 100 * counts["steps_solved_by_pivoting"]


def test_automatic_step_of_the_solar_array():
    """Cross-check: the example runs without a warning and dissipates as much as with compliant contact.

    Compliant runs at 1e-6 to 1e-9 lose 0.2305 to 0.2313 J by friction and 0.0059 to 0.0065 J in impacts (docs/decisions/0021).
    """
    one = sd.read_case(EXAMPLES / "solar_array.toml").mechanism
    joints = tuple(
        dataclasses.replace(joint, clearance=joint.clearance and dataclasses.replace(joint.clearance, contact="hard"))
        for joint in one.joints
    )
    run = sd.simulate(dataclasses.replace(one, joints=joints), until=2.2)
    assert warnings_of(run) == []
    assert "decay" in counts_of(run)["reason"]
    assert float(run["friction_loss"][-1]) == pytest.approx(0.2312, rel=0.02)
    assert float(run["damping_loss"][-1]) == pytest.approx(0.0062, rel=0.1)
    assert float(run["track_deviation"].max()) == pytest.approx(18.24e-3, rel=0.04)


def test_hard_contact_between_bars_that_bend():
    """Identity: with bending bars the energy balance of impacts and friction closes."""
    gap = sd.Clearance(1e-5, journal_radius=5e-3, damping=sd.Flores(0.7), friction=sd.LuGre(kinetic=0.1), contact="hard")
    arm = sd.scissor(units=2, bar_length=0.5, bar_mass=0.2983, slider_mass=0.3, angle=sd.degrees(60), gravity=0.0)
    bent = sd.with_bending(arm.with_clearance("O", gap), section="tube 20x20x1 mm", material="steel").driven(speed=sd.rpm(20))
    run = sd.simulate(bent, until=8e-3)
    assert run.sizes["contact"] > 2
    assert float(run["contact_damping_loss"].max()) > 0.0
    assert float(np.abs(run["energy_residual"]).max()) < 1e-5 * float(run["kinetic_energy"].max())


WIDE = sd.Revolute("wide", ("free", "c"), ("ground", "o"), sd.Clearance(10.0, journal_radius=11.0, contact="hard"))
"""Joint with hard contact in so wide a bearing that the point mass in it never touches."""

MASS, INERTIA = 2.0, 1e-3  # Mass [kg] and moment of inertia [kg m^2] of a shaft
# Clearance with an oil film
OIL = sd.Clearance(1e-4, journal_radius=1e-2, bearing_length=2e-2, lubrication=sd.Lubrication(viscosity=0.1))


def shaft(mass: float = MASS, spin: float = 30.0, **parts: Any) -> sd.Mechanism:
    """Return a shaft next to a mass with hard contact, so that time stepping moves both."""
    joints = (WIDE, *parts.pop("joints", ()))
    bodies = (
        sd.Body("free", 1.0, None, {"c": (0.0, 0.0)}),
        sd.Body("shaft", mass, INERTIA, {"c": (0.0, 0.0)}, velocity=(0.02, 0.0), angular_velocity=spin),
    )
    return sd.Mechanism(bodies, joints=joints, ground=(("o", (0.0, 0.0)),), **parts)


def run_of(one: sd.Mechanism, until: float, **how: Any) -> xr.Dataset:
    """Return a complete run."""
    run = sd.simulate(one, until=until, start="as-placed", samples=101, **how)
    assert run.attrs["status"] == "complete"
    return run


def test_bushing_decays_exponentially():
    """Closed form: v = exp(-D t/m) v_0 + (1 - exp(-D t/m)) D^-1 m g, and the same for the angle, with second order."""
    damping, around, t = np.array([[800.0, 300.0], [300.0, 500.0]]), 0.6, 0.01
    bushing = sd.Bushing(
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


def test_film_with_time_stepping():
    """Cross-check: a journal sinks into its oil as with controlled error, with second order in the step."""
    oiled = sd.Revolute("oiled", ("shaft", "c"), ("ground", "o"), OIL)
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


def test_film_and_hard_contact_at_the_default_step():
    """Limit: smallest film and loss in a scissor mast agree with those of a step of a tenth."""
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
