"""Hard contact on worn contours: circles of shifted centre, an ellipse, curvature, momenta, and a worn journal."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest
import xarray as xr
from scipy.integrate import solve_ivp
from tests.build import momenta, warnings_of
from tests.mechanics.test_worn_contact import WORN_JOURNALS, floating, lobed

import scissordyn as sd
from scissordyn.kernel import kernel
from scissordyn.laws.damping.factors import LankaraniNikravesh
from scissordyn.laws.friction.coulomb import Coulomb
from scissordyn.mechanics import functions
from scissordyn.mechanics.contact import kinematics
from scissordyn.mechanics.hard_contour import CORNER_FRACTION, opened_contour, touch_at
from scissordyn.mechanics.hard_rows import along, contact_rows, convective, open_hard
from scissordyn.mechanics.system import open_system
from scissordyn.model.options import Options
from scissordyn.plan.numbers import contour_table
from scissordyn.plan.plan import plan
from scissordyn.run.trajectory import make_driver


def ball(gap: sd.Clearance, *, centre: tuple[float, float] = (0.0, 0.0), gravity: float = 0.0, **motion: Any) -> sd.Mechanism:
    """Return a point mass of 1 kg whose pin has clearance in a bearing of the ground."""
    body = sd.Body("ball", 1.0, None, {"centre": (0.0, 0.0)}, **motion)
    pin = sd.Revolute("pin", ("ball", "centre"), ("ground", "hole"), gap)
    return sd.Mechanism((body,), (pin,), ground=(("hole", centre),), gravity=gravity)


def gap_with(clearance: float, depths: np.ndarray | None = None, restitution: float = 1.0) -> sd.Clearance:
    """Return a frictionless clearance with hard contact, whose bearing has a contour if depths are given."""
    contour = () if depths is None else tuple(depths.tolist())
    damping = LankaraniNikravesh(restitution)
    return sd.Clearance(clearance, journal_radius=5.0, damping=damping, contact="hard", contour=contour)


def angles(count: int) -> np.ndarray:
    """Return the angles of a contour."""
    return 2.0 * np.pi * np.arange(count) / count


def over_time(run: xr.Dataset, name: str) -> np.ndarray:
    """Return positions or velocities of the ball, shape (time, 2)."""
    return np.asarray(run[name].sel(body="ball").transpose("time", "axis").values)


SHIFT, ASIDE = 0.3, 0.7  # Shift of the centre [m] of a circle of 1.3 m, and its direction [rad]


@pytest.mark.parametrize("events", ["located", "crossed"])
@pytest.mark.parametrize("restitution", [1.0, 0.6])
@pytest.mark.parametrize("slides", [False, True])
def test_a_contour_that_is_a_shifted_circle(events: str, restitution: float, slides: bool) -> None:
    """Cross-check: c = 1 m and the contour of a circle of 1.3 m about another centre move like a round bearing there.

    A spline of h = a (1 + cos) loses a third of a cell's square: order two in the number of angles. e = 1 loses no energy.
    """
    start = {"position": (0.0, 0.0), "velocity": (0.7, 0.4)}
    centre, turned = (SHIFT * math.cos(ASIDE), SHIFT * math.sin(ASIDE)), 0.9
    if slides:
        place = centre[0] + 1.3 * math.cos(turned), centre[1] + 1.3 * math.sin(turned)
        start = {"position": place, "velocity": (-0.3 * math.sin(turned), 0.3 * math.cos(turned))}
    options = {"until": 6.0, "start": "as-placed", "events": events, "step": 5e-3, "samples": 301, "trust": False}
    exact = sd.simulate(ball(gap_with(1.3, restitution=restitution), centre=centre, **start), **options)
    errors = []
    for count in (180, 360):
        depths = SHIFT * (1.0 + np.cos(angles(count) - ASIDE))
        run = sd.simulate(ball(gap_with(1.0, depths, restitution), **start), **options)
        assert run.attrs["status"] == "complete"
        errors.append(float(np.abs(over_time(run, "position") - over_time(exact, "position")).max()))
        if restitution == 1.0:
            kinetic = run["kinetic_energy"].values
            assert np.abs(kinetic[1:] / kinetic[1] - 1.0).max() < (2e-4 if slides else 1e-9)
    assert errors[1] < 1e-3
    if not slides:
        assert math.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.2)


@pytest.mark.parametrize("events", ["located", "crossed"])
def test_swinging_on_a_shifted_circle(events: str) -> None:
    """Cross-check: the length of the pendulum is that of the circle, also in long steps (|e| errs by 1.3e-3 m)."""
    centre, turned = (SHIFT * math.cos(ASIDE), SHIFT * math.sin(ASIDE)), -1.2
    start = {"position": (centre[0] + 1.3 * math.cos(turned), centre[1] + 1.3 * math.sin(turned)), "gravity": 9.81}
    gaps = gap_with(1.3, restitution=0.0), gap_with(1.0, SHIFT * (1.0 + np.cos(angles(360) - ASIDE)), 0.0)
    options = {"until": 3.0, "start": "as-placed", "events": events, "step": 0.05, "samples": 151, "trust": False}
    exact = sd.simulate(ball(gaps[0], centre=centre, **start), **options)
    run = sd.simulate(ball(gaps[1], **start), **options)
    assert np.abs(over_time(run, "position") - over_time(exact, "position")).max() < 2e-4


WIDE, HIGH = 1.4, 1.0  # Semi-axes of an ellipse [m]


def test_sliding_on_an_ellipse() -> None:
    """Cross-check: a bead on an elliptic wire by Lagrange's equation, integrated by SciPy; order two in the step."""

    def lagrange(_: float, y: np.ndarray) -> list[float]:
        sin, cos = math.sin(y[0]), math.cos(y[0])
        inertia = WIDE**2 * sin**2 + HIGH**2 * cos**2
        return [y[1], (-(WIDE**2 - HIGH**2) * sin * cos * y[1] ** 2 - 9.81 * HIGH * cos) / inertia]

    begin = -0.9
    exact = solve_ivp(lagrange, (0.0, 3.0), (begin, 0.0), rtol=1e-12, atol=1e-12, t_eval=np.linspace(0.0, 3.0, 61)).y[0]
    depths = np.hypot(WIDE * np.cos(angles(2880)), HIGH * np.sin(angles(2880))) - HIGH
    errors = []
    for step in (1e-2, 5e-3, 2.5e-3):
        start = ball(gap_with(HIGH, depths, 0.0), gravity=9.81, position=(WIDE * math.cos(begin), HIGH * math.sin(begin)))
        run = sd.simulate(start, until=3.0, start="as-placed", events="located", step=step, samples=61, trust=False)
        wire = np.stack([WIDE * np.cos(exact), HIGH * np.sin(exact)], axis=1)
        errors.append(float(np.abs(over_time(run, "position") - wire).max()))
        assert run["in_contact"].values[1:].all()
        assert np.abs(run["energy_residual"].values).max() < 10.0 * step**2
    assert errors[-1] < 1e-3
    assert math.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.3)
    assert math.log2(errors[1] / errors[2]) == pytest.approx(2.0, abs=0.3)


@kernel
def convective_at(system: int) -> float:
    """Return the second derivative of the indentation of the first contact at zero acceleration."""
    S = open_system(system)
    kinematics(0, S)
    return convective(0, S)


def hard(**worn: Any) -> sd.Mechanism:
    """Return two free bodies that rotate at different speeds, with a hard contact with friction in a worn bearing."""
    return floating(contact="hard", friction=Coulomb(0.1), damping=LankaraniNikravesh(0.7), **worn)


@kernel
def row_speed_at(system: int, hard: int, axis: int) -> float:
    """Return U_N (axis 0) or U_T (axis 1) of the first hard contact by its rows."""
    S, H = open_system(system), open_hard(hard)
    kinematics(0, S)
    contact_rows(0, S, H)
    return along(S.work.multiplier.size + axis, S.work.V, S, H)


@WORN_JOURNALS
def test_rates_of_the_gap(worn: dict[str, Any]) -> None:
    """Cross-check: rate and curvature term are derivatives of the gap along a motion; the rows have the rate and the slip."""
    driver, _, _ = make_driver(plan(hard(**worn)), Options(0.02, "concentric", 2, events="located"))
    n, system = driver.plan.coordinates.free, driver.system
    y = driver.state.y.copy()
    y[:2] += 4.6e-4, 2.1e-4  # the journal near its bearing, and moving along it
    y[n : n + 2] += -0.3, 0.6
    values, h = [], 3e-7
    for k in (-2, -1, 0, 1, 2):
        moved, value, rate = y.copy(), np.zeros(1), np.zeros(1)
        moved[:n] += k * h * y[n : 2 * n]
        functions.guards(0.0, moved, system.address, value, rate)
        values.append(float(value[0]))
        if k == 0:
            here = float(rate[0])
            curving = convective_at(system.address)
            towards, aside = (row_speed_at(system.address, driver.stepping.hard.address, axis) for axis in range(2))
            slip = float(system.content.work.contact[0]["slip"])
    assert here == pytest.approx((values[3] - values[1]) / (2.0 * h), rel=1e-5)
    assert (-towards, -aside) == pytest.approx((here, slip), rel=1e-12)
    assert abs(curving) > 1.0
    assert curving == pytest.approx((values[3] - 2.0 * values[2] + values[1]) / h**2, rel=2e-3)


@WORN_JOURNALS
def test_a_floating_hard_joint_keeps_momenta_and_energy(worn: dict[str, Any]) -> None:
    """Identity: nothing from outside acts; the energy balance counts what restitution and friction take."""
    mechanism = hard(**worn)
    run = sd.simulate(mechanism, until=0.1, step=2e-5, trust=False)
    assert run.attrs["status"] == "complete"
    linear, spin = momenta(run, mechanism)
    kinetic = run["kinetic_energy"].values
    assert run.sizes["contact"] > 5
    assert run["friction_loss"].values[-1].max() > 1e-3 * kinetic[0]
    assert np.abs(linear - linear[0]).max() < 1e-11 * np.abs(linear[0]).max()
    assert np.abs(spin / spin[0] - 1.0).max() < 1e-5
    assert np.abs(run["energy_residual"].values).max() < 1e-5 * kinetic[0]


@pytest.mark.parametrize("contact", ["hard", "compliant"])
def test_eccentricity_on_a_contour(contact: str) -> None:
    """Identity: the eccentricity is the distance of the pin's points, also where the surfaces touch in another direction."""
    gap = dataclasses.replace(gap_with(1.0, 0.3 * (1.0 + np.cos(angles(360))), 0.5), contact=contact, bearing_length=1.0)
    run = sd.simulate(ball(gap, gravity=9.81, position=(0.5, 0.0)), until=1.0, start="as-placed", samples=101, trust=False)
    assert run.sizes["contact"] > 0
    found = run["eccentricity"].sel(joint="pin").transpose("time", "axis").values
    assert np.abs(found - over_time(run, "position")).max() < 1e-9


def test_a_pocket_in_which_a_journal_rests() -> None:
    """Closed form: a pocket touches its journal at all angles; opened, its corner has the radius r and is less deep.

    The centre may be in the hull of the circle c and the corner c + d; a disk of radius r reaches up to c + d (1 - r/c).
    """
    deep, gap, count = 9e-6, 5e-5, 1440
    table = contour_table(np.maximum(0.0, (gap + deep) * np.cos(angles(count)) - gap).tolist())
    opened_contour(table, np.zeros(0), gap, np.zeros(count))
    out = np.zeros(6)
    reached = gap + deep * (1.0 - CORNER_FRACTION)
    touch_at(reached, 0.0, table, np.zeros(0), gap, out)
    assert abs(out[0]) < 1e-3 * deep
    assert out[3] == pytest.approx(CORNER_FRACTION * gap, rel=1e-2)
    touch_at(-gap, 0.0, table, np.zeros(0), gap, out)
    assert out[:4] == pytest.approx([0.0, -1.0, 0.0, gap], abs=1e-15)


@pytest.mark.parametrize("events", ["located", "crossed"])
def test_a_journal_stays_in_its_pocket(events: str) -> None:
    """Limit: a turning shaft stays in its pocket under its weight, and n follows its friction, which is that of its weight."""
    depths = np.maximum(0.0, 59e-6 * np.cos(angles(360) + 0.5 * np.pi) - 50e-6)
    gap = sd.Clearance(50e-6, damping=sd.Flores(0.5), friction=sd.LuGre(0.1), contact="hard", contour=tuple(depths.tolist()))
    shaft = sd.Body("shaft", 10.0, 0.01, {"pin": (0.0, 0.0)})
    pin = sd.Revolute("pin", ("shaft", "pin"), ("ground", "hole"), gap)
    turning = sd.Mechanism((shaft,), (pin,), ground=(("hole", (0.0, 0.0)),), gravity=9.81).driven(speed=30.0, body="shaft")
    run = sd.simulate(turning, until=0.2, start="in-contact", events=events, step=1e-5, samples=201, trust=False)
    assert run["in_contact"].values[1:].mean() > 0.99
    assert not [text for text in warnings_of(run) if "overlap" in text]
    place = run["position"].sel(body="shaft").transpose("time", "axis").values
    assert np.abs(place - [0.0, -59e-6]).max() < 2e-6
    weight = 98.1 * math.cos(math.atan(0.1))
    work = 0.1 * weight * 30.0 * 0.2 * 10e-3
    assert run["friction_loss"].values[-1].sum() == pytest.approx(work, rel=1e-2 if events == "located" else 0.1)


@pytest.mark.parametrize("journal", [(), lobed(360, 1e-4)])
def test_gradient_on_a_contour(journal: tuple[float, ...]) -> None:
    """Cross-check: derivatives of a pendulum that falls into its worn hole and slides there, by central differences."""
    gap = sd.Clearance(
        1e-3, journal_radius=0.06, damping=LankaraniNikravesh(0.0), friction=Coulomb(0.05), contact="hard",
        contour=lobed(360, 2e-4), journal_contour=journal,
    )  # fmt: skip
    bob = sd.Body("bob", 1.0, 2e-3, {"centre": (0.0, 0.0)}, centre=(0.0, -0.2), angle=1.0, angular_velocity=0.5)
    pin = sd.Revolute("hole", ("bob", "centre"), ("ground", "middle"), gap)
    swinging = sd.Mechanism((bob,), (pin,), ground=(("middle", (0.0, 0.0)),), gravity=9.81)
    options = {"until": 0.02, "start": "as-placed", "step": 1e-4, "samples": 2}
    found = sd.gradient(swinging, by=["gravity", "hole.clearance"], trajectory=True, **options)
    exact = found["velocity_derivative"].sel(body="bob").transpose("parameter", "time", "axis").values[:, -1]
    for k, (path, value, change) in enumerate((("gravity", 9.81, 1e-5), ("hole.clearance", 1e-3, 1e-9))):
        ends = []
        for sign in (1.0, -1.0):
            run = sd.simulate(swinging.replace(path, value + sign * change), events="located", trust=False, **options)
            ends.append(run["velocity"].sel(body="bob").values[-1])
        assert exact[k] == pytest.approx((ends[0] - ends[1]) / (2.0 * change), rel=1e-5)


def test_worn_joints_of_both_kinds_of_contact() -> None:
    """Contract: a worn hard joint next to a round compliant one is simulated; a worn compliant one next to it is refused."""
    crank, worn = sd.slider_crank(crank=0.05, rod=0.12).driven(speed=100.0), {"contour": lobed(360, 2e-5)}
    hard_pin, soft_pin = sd.Clearance(1e-4, contact="hard", **worn), sd.Clearance(1e-4)
    mixed = crank.with_clearance("slider pin", hard_pin).with_clearance("crank pin", soft_pin)
    run = sd.simulate(mixed, until=0.02, trust=False)
    assert run.attrs["status"] == "complete"
    assert np.abs(run["energy_residual"].values).max() < 1e-3 * run["kinetic_energy"].values.max()
    refused = mixed.with_clearance("crank pin", dataclasses.replace(soft_pin, **worn))
    with pytest.raises(sd.InputError, match="a worn bearing of compliant contact has hard contact at 'slider pin'"):
        sd.simulate(refused, until=0.02)
