"""Hard contact of journals that slide around their bearings, under load, and in chains of joints."""

import dataclasses
import json
import math
from pathlib import Path

import numpy as np
import pytest

import scissordyn as sd
from scissordyn.kernel import kernel
from scissordyn.laws.damping.factors import LankaraniNikravesh
from scissordyn.mechanics.hard_rows import open_hard
from scissordyn.mechanics.pivoting import pivot
from scissordyn.model.body import Body
from scissordyn.model.joint import Revolute
from scissordyn.model.mechanism import Mechanism
from scissordyn.plan.plan import plan
from scissordyn.run.advance.trajectory import make_driver
from scissordyn.run.options import Options

EXAMPLES = Path(__file__).parents[2] / "examples"


def pendulum(angle: float, speed: float, gravity: float, restitution: float = 0.5) -> Mechanism:
    """A frictionless journal of 1 kg that touches its bearing of 1 m clearance at an angle from below."""
    gap = sd.Clearance(1.0, journal_radius=1.1, damping=LankaraniNikravesh(restitution), contact="hard")
    place, velocity = (math.sin(angle), -math.cos(angle)), (speed * math.cos(angle), speed * math.sin(angle))
    body = Body("journal", 1.0, None, {"centre": (0.0, 0.0)}, position=place, velocity=velocity)
    pin = Revolute("pin", ("journal", "centre"), ("ground", "o"), gap)
    return Mechanism((body,), joints=(pin,), ground=(("o", (0.0, 0.0)),), gravity=gravity)


def test_sliding_around_a_bearing_loses_nothing():
    """Closed form: without gravity and friction a journal slides around at constant speed; a step turns it by 0.1 rad."""
    run = sd.simulate(pendulum(0.0, 2.0, 0.0, 0.0), until=10.0, start="as-placed", step=0.05, events="crossed")
    speed = np.hypot(*run["velocity"].sel(body="journal").transpose("axis", "time").values)[::100]
    assert abs(speed[-1] / speed[1] - 1.0) < 5e-3
    radius = np.hypot(*run["position"].sel(body="journal").transpose("axis", "time").values)[::100]
    assert np.all(np.abs(radius - 1.0) < 5e-3)


def test_period_of_a_journal_under_load():
    """Closed form: pressed down a journal is a pendulum of length c, period 2 pi (c/g)^0.5 (1 + a^2/16)."""
    run = sd.simulate(pendulum(0.1, 0.0, 9.81), until=10.0, start="as-placed", step=0.01, samples=1001)
    x, time = run["position"].sel(body="journal", axis="x").values, run["time"].values
    rising = np.flatnonzero((x[:-1] < 0.0) & (x[1:] >= 0.0))
    crossed = time[rising] - x[rising] * (time[rising + 1] - time[rising]) / (x[rising + 1] - x[rising])
    period = 2.0 * math.pi / math.sqrt(9.81) * (1.0 + 0.1**2 / 16.0)
    assert np.diff(crossed).mean() == pytest.approx(period, rel=1e-3)
    assert np.abs(x[-300:]).max() == pytest.approx(math.sin(0.1), rel=2e-2)


def test_a_journal_faster_than_the_step_comes_to_rest():
    """Limit: with a step of twice what an explicit one is stable for, the oscillation of a loaded journal decays."""
    run = sd.simulate(pendulum(0.01, 0.0, 9.81), until=100.0, start="as-placed", step=4.0 / math.sqrt(9.81), events="crossed")
    speed = np.hypot(*run["velocity"].sel(body="journal").transpose("axis", "time").values)
    assert speed[-1] < 1e-3 * speed.max()


def chain() -> Mechanism:
    """A mast of eight units under gravity with every joint loose."""
    joint = sd.Clearance(
        30e-6, journal_radius=5e-3, damping=sd.Flores(0.7), friction=sd.LuGre(kinetic=0.1), contact="hard", bearing_length=1e-2
    )
    sizes = {"bar_length": 0.5, "bar_mass": 0.2, "slider_mass": 0.3, "platform_mass": 1.0}
    arm = sd.mast(units=8, angle=sd.degrees(15), **sizes)
    return arm.with_clearance("all", joint).driven(sd.Cycloidal(sd.degrees(15), sd.degrees(60), 5.0))


@kernel
def pivot_at(least: int, m: int, hard: int) -> int:
    """See `pivoting.pivot`."""
    return pivot(least, m, open_hard(hard))


def test_impulses_by_pivoting():
    """Cross-check: pivoting, of each third contact and of all, finds what Newton's method does, within the law of contact.

    Contacts of an eight-unit mast that stay closed are elastic, so that there is one solution.
    """
    step, seen = 1e-4, 0
    driver, _, _ = make_driver(plan(chain()), Options(1.0, start="in-contact", step=step))
    driver.sample_at(np.zeros(0))
    assert driver.stepping is not None
    hard, m = driver.stepping.content, driver.plan.model.constraint_start.size - 1
    for k in range(0, 200, 10):
        driver.advance((k + 10) * step, most_steps=10)
        impulse, velocity = hard.impulse.copy(), hard.velocity.copy()
        taking_part = hard.gram[hard.place[m : m + 2 * hard.which.size : 2], hard.reach[0]] > 0.0
        hard.closed[taking_part] = 1  # those that the step has opened too
        force, speed = np.abs(impulse).max(), np.abs(hard.free).max()
        hard.restless[:] = np.arange(hard.which.size) % 3 == 0
        for least in (1, 0):
            assert pivot_at(least, m, driver.stepping.hard.address) >= 0
            np.testing.assert_allclose(hard.impulse, impulse, atol=1e-6 * force)
            np.testing.assert_allclose(hard.velocity, velocity, atol=1e-6 * speed)
        a, b = hard.place[m : m + 2 * hard.which.size : 2], hard.place[m + 1 : m + 2 * hard.which.size : 2]
        own = hard.gram[a, hard.reach[0]] > 0.0
        p, u = hard.impulse[a][own], (hard.velocity[a] + hard.compliance * hard.impulse[a] + hard.offset)[own]
        seen += int(np.count_nonzero(hard.compliance[own] * p > 0.0))
        slip = hard.velocity[b][own]
        rubs = (hard.impulse[b] - hard.lag + hard.turning_mass * hard.velocity[b])[own]
        limit = hard.friction[own] * p
        assert p.min() > -1e-12 * force
        assert u.min() > -1e-8 * speed
        assert np.abs(p * u).max() < 1e-8 * force * speed
        assert np.all(np.abs(rubs) <= limit + 1e-8 * force)
        slides = np.abs(slip) > 1e-7 * speed
        np.testing.assert_allclose(rubs[slides], -limit[slides] * np.sign(slip[slides]), atol=1e-7 * force)
    assert seen > 100


def test_every_step_of_a_long_array_is_solved():
    """Invariant: where Newton's method cycles, the few contacts that keep changing their modes are pivoted, the others not."""
    joint = sd.Clearance(1e-4, damping=sd.Flores(0.7), friction=sd.LuGre(kinetic=0.1), contact="hard")
    arm = sd.scissor(units=64, bar_length=0.5, bar_mass=0.2, slider_mass=0.3, angle=sd.degrees(60), gravity=9.81)
    move = sd.Cycloidal(sd.degrees(60), sd.degrees(58), 2.0)
    run = sd.simulate(arm.with_clearance("all", joint).driven(move), until=0.2, step=1e-4, samples=3, start="concentric")
    counts = json.loads(run.attrs["statistics"])
    assert counts["steps_not_solved"] == 0
    assert 0 < counts["pivots"] < 100 * counts["steps_solved_by_pivoting"]


def test_the_automatic_step_of_the_solar_array():
    """Cross-check: the shipped array runs without a warning, loses by impacts and friction what the compliant one loses.

    Compliant runs at 1e-6 to 1e-9 lose 0.2305 to 0.2313 J by friction and 0.0059 to 0.0065 J in impacts (docs/decisions/0021).
    """
    one = sd.read_case(EXAMPLES / "solar_array.toml").mechanism
    joints = tuple(
        dataclasses.replace(joint, clearance=joint.clearance and dataclasses.replace(joint.clearance, contact="hard"))
        for joint in one.joints
    )
    run = sd.simulate(dataclasses.replace(one, joints=joints), until=2.2)
    assert json.loads(run.attrs["warnings"]) == []
    assert "decay" in json.loads(run.attrs["statistics"])["reason"]
    assert float(run["friction_loss"][-1]) == pytest.approx(0.2312, rel=0.02)
    assert float(run["damping_loss"][-1]) == pytest.approx(0.0062, rel=0.1)
    assert float(run["track_deviation"].max()) == pytest.approx(18.24e-3, rel=0.04)


def test_hard_contact_between_bars_that_bend():
    """Identity: with bars that bend the energy balance of impacts and friction closes."""
    gap = sd.Clearance(1e-5, journal_radius=5e-3, damping=sd.Flores(0.7), friction=sd.LuGre(kinetic=0.1), contact="hard")
    arm = sd.scissor(units=2, bar_length=0.5, bar_mass=0.2983, slider_mass=0.3, angle=sd.degrees(60), gravity=0.0)
    bent = sd.with_bending(arm.with_clearance("O", gap), section="tube 20x20x1 mm", material="steel").driven(speed=sd.rpm(20))
    run = sd.simulate(bent, until=8e-3)
    assert run.sizes["contact"] > 2
    assert float(run["contact_damping_loss"].max()) > 0.0
    assert float(np.abs(run["energy_residual"]).max()) < 1e-5 * float(run["kinetic_energy"].max())
