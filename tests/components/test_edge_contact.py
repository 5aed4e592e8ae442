"""Contacts with edges: a disc on a floor, on the side and end of a bar, and on another disc."""

import dataclasses
import json
import math
import re

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq

import scissordyn as sd
from scissordyn.components.edge_contact import distance
from scissordyn.laws.catalogue import DAMPING, FRICTION
from scissordyn.laws.damping.none import NoDamping
from scissordyn.laws.elastic.linear import Linear
from scissordyn.laws.elastic.power_law import PowerLaw
from scissordyn.laws.friction.coulomb import Coulomb
from scissordyn.laws.friction.dahl import Dahl

from .shared import METHODS, TIGHT, assert_balance

MASS, RADIUS, G = 2.0, 0.1, 9.81  # Mass [kg] and radius [m] of a disc, gravitational acceleration [m/s^2]
INERTIA = 0.5 * MASS * RADIUS**2  # Of a disc about its centre [kg m^2]


def disc(name, position, velocity=(0.0, 0.0), spin=0.0):
    """Return a disc."""
    return sd.Body(
        name,
        mass=MASS,
        inertia=INERTIA,
        points={"centre": (0.0, 0.0)},
        position=position,
        velocity=velocity,
        angular_velocity=spin,
    )


def on_a_floor(body, slope=0.0, **laws):
    """Return a disc above a floor through the origin, at an angle to the horizontal."""
    floor = sd.EdgeContact("floor", ("ground", "O"), ("disc", "centre"), slope, radius=RADIUS, **laws)
    return sd.Mechanism(bodies=(body,), components=(floor,), ground=(("O", (0.0, 0.0)),), gravity=G)


@pytest.mark.parametrize("method", METHODS)
def test_a_disc_bounces_without_loss(method):
    """Closed form: flight under gravity, and half an oscillation on a linear spring under its weight."""
    height, stiffness = 0.2, 1e6
    floor = on_a_floor(disc("disc", (0.0, RADIUS + height)), stiffness=Linear(stiffness), damping=NoDamping())
    run = sd.simulate(floor, until=1.5, method=method, **TIGHT)
    speed, frequency = math.sqrt(2.0 * G * height), math.sqrt(stiffness / MASS)
    contact = 2.0 / frequency * (math.pi - math.atan(speed * frequency / G))
    fall = speed / G
    expected = [fall, fall + contact, 3.0 * fall + contact, 3.0 * fall + 2.0 * contact]
    assert run["event_kind"].values.astype(str).tolist()[:4] == ["reached", "left", "reached", "left"]
    np.testing.assert_allclose(run["event_time"].values[:4], expected, rtol=1e-9)
    deepest = (MASS * G + math.hypot(MASS * G, speed * math.sqrt(stiffness * MASS))) / stiffness
    assert float(run["edge_contact_peak_force"][0]) == pytest.approx(stiffness * deepest, rel=1e-8)
    assert_balance(run)


@pytest.mark.parametrize("slope", [0.0, 0.3])
def test_a_sliding_disc_begins_to_roll(slope):
    """Closed form: friction slows the disc and turns it until it rolls; on a slope the weight drives it."""
    kinetic, stiffness, speed = 0.2, 1e8, 3.0
    along, up = np.array([math.cos(slope), math.sin(slope)]), np.array([-math.sin(slope), math.cos(slope)])
    weight = MASS * G * math.cos(slope)
    start = (RADIUS - weight / stiffness) * up
    law = {"stiffness": Linear(stiffness), "friction": Coulomb(kinetic, ramp_speed=1e-5)}
    body = disc("disc", (float(start[0]), float(start[1])), tuple((speed * along).tolist()))
    run = sd.simulate(on_a_floor(body, slope, **law), until=0.5, samples=501, **TIGHT)
    pull, friction = G * math.sin(slope), kinetic * G * math.cos(slope)
    rolls = speed / (pull + 3.0 * friction)  # v - (g sin + mu g cos) t = R omega = 2 mu g cos t
    time, turning = run["time"].values, run["angular_velocity"].sel(body="disc").values
    forward = run["velocity"].sel(body="disc").values @ along
    slides = time < rolls - 1e-3
    np.testing.assert_allclose(forward[slides], (speed - (pull + friction) * time)[slides], atol=1e-6)
    np.testing.assert_allclose(-RADIUS * turning[slides], 2.0 * friction * time[slides], atol=1e-6)
    later = time > rolls + 1e-3
    rolling = speed - (pull + friction) * rolls - pull * (time - rolls) / 1.5
    np.testing.assert_allclose(forward[later], rolling[later], atol=1e-4)
    np.testing.assert_allclose(-RADIUS * turning[later], forward[later], atol=1e-4)
    assert_balance(run, 1e-6)


def free_bodies(bodies, contact):
    """Return two bodies in a plane without gravity."""
    return sd.Mechanism(bodies=bodies, components=(contact,), gravity=0.0)


def momenta(run, bodies):
    """Return linear and angular momentum of two bodies over time, shape (samples, 3)."""
    total = np.zeros((run.sizes["time"], 3))
    for body in bodies:
        place, velocity = (run[name].sel(body=body.name).values for name in ("position", "velocity"))
        total[:, :2] += body.mass * velocity
        turn = place[:, 0] * velocity[:, 1] - place[:, 1] * velocity[:, 0]
        total[:, 2] += body.mass * turn + body.inertia * run["angular_velocity"].sel(body=body.name).values
    return total


def bar(spin=0.0):
    """Return a bar of 1 m whose axis begins at its point `start`."""
    points = {"start": (-0.5, 0.0), "end": (0.5, 0.0)}
    return sd.Body("bar", mass=3.0, inertia=0.25, points=points, position=(0.0, 0.0), angular_velocity=spin)


@pytest.mark.parametrize("kinetic", [0.0, 0.4])
@pytest.mark.parametrize(
    ("x", "side"), [(0.3, 1.0), (0.3, -1.0), (0.56, 1.0), (-0.55, -1.0)], ids=["left", "right", "end", "beginning"]
)
@pytest.mark.parametrize("restitution", [1.0, 0.6])
def test_a_disc_hits_a_turning_bar(x, side, kinetic, restitution):
    """Identity: momenta of two free bodies stay, on both sides and at both round ends; energies balance."""
    contact = sd.EdgeContact(
        *("touch", ("bar", "start"), ("disc", "centre")),
        length=1.0,
        half_width=0.02,
        radius=RADIUS,
        damping=sd.Flores(restitution),
        friction=Coulomb(kinetic) if kinetic else sd.NoFriction(),
    )
    bodies = bar(0.5 * side), disc("disc", (x, side * (RADIUS + 0.04)), (0.3, -2.0 * side), spin=4.0)
    run = sd.simulate(free_bodies(bodies, contact), until=0.1, samples=201, **TIGHT)
    assert "reached" in run["event_kind"].values.astype(str)
    found = momenta(run, bodies)
    np.testing.assert_allclose(found, np.broadcast_to(found[0], found.shape), atol=1e-9)
    assert_balance(run)
    if not kinetic and restitution == 1.0:
        energy = run["kinetic_energy"].values
        assert energy[-1] == pytest.approx(energy[0], rel=1e-9)
        assert run["angular_velocity"].sel(body="disc").values[-1] == pytest.approx(4.0, rel=1e-12)


def test_two_discs_exchange_their_speeds():
    """Closed form: a head-on collision of equal discs without loss; an edge of length 0 is a disc."""
    contact = sd.EdgeContact("touch", ("one", "centre"), ("two", "centre"), 0.7, 0.0, RADIUS, RADIUS, damping=NoDamping())
    bodies = disc("one", (0.0, 0.0), (1.0, 0.5)), disc("two", (0.25, 0.0), (-2.0, 0.5))
    run = sd.simulate(free_bodies(bodies, contact), until=0.05, **TIGHT)
    assert float(run["event_time"][0]) == pytest.approx(0.05 / 3.0, rel=1e-9)
    np.testing.assert_allclose(run["velocity"].values[-1], [[-2.0, 0.5], [1.0, 0.5]], atol=1e-9)


def test_a_disc_runs_over_the_end_of_a_bar():
    """Identity: the energy balances while a disc rolls from the side of a bar around its end and falls off."""
    contact = sd.EdgeContact(
        *("touch", ("ground", "start"), ("disc", "centre")), length=0.5, half_width=0.03, radius=RADIUS, friction=Coulomb(0.5)
    )
    mechanism = sd.Mechanism(
        bodies=(disc("disc", (0.3, RADIUS + 0.03), (1.0, 0.0), spin=-10.0),),
        components=(contact,),
        ground=(("start", (0.0, 0.0)),),
        gravity=G,
    )
    run = sd.simulate(mechanism, until=0.5, samples=501, **TIGHT)
    place = run["position"].sel(body="disc").values
    assert place[-1, 1] < 0.0
    pressed = run["edge_contact_normal"].values[:, 0] > 0.0
    over = pressed & (place[:, 0] > 0.5)
    assert over.any()
    np.testing.assert_allclose(np.hypot(place[over, 0] - 0.5, place[over, 1]), RADIUS + 0.03, atol=1e-4)
    assert_balance(run, 1e-6)


def test_distance_of_a_point():
    """Second formulation: the nearest of many points of the edge."""
    along, rng = (math.cos(0.4), math.sin(0.4)), np.random.default_rng(3)
    edge = np.linspace(0.0, 0.7, 700_001)[:, None] * along
    for x, y in rng.uniform(-1.0, 1.0, (20, 2)).tolist():
        far, nx, ny = distance(x, y, *along, 0.7)
        apart = np.hypot(*(edge - (x, y)).T)
        assert far == pytest.approx(apart.min(), abs=1e-6)
        np.testing.assert_allclose((x, y) - far * np.array([nx, ny]), edge[apart.argmin()], atol=2e-6)


def returned(factor):
    """Return the restitution of a free impact with F = F_el (1 + xi s), s = delta'/v, for any F_el.

    The work of F_el from the onset to a speed s is m v^2 (w(1) - w(s)), with w(s) = (s - ln(1 + xi s)/xi)/xi; 0 at s = -c.
    """
    if factor == 0.0:
        return 1.0

    def work(s):
        return (s - math.log1p(factor * s) / factor) / factor

    return float(brentq(lambda c: work(1.0) - work(-c), 0.0, (1.0 - 1e-15) / factor if factor > 1.0 else 1.0))


FACTORS = [name for name, law in DAMPING.items() if hasattr(law, "factor")]


@pytest.mark.parametrize("name", FACTORS)
def test_restitution_of_each_damping_factor(name):
    """Closed form: the speed ratio of a free impact by the law's factor, whatever the stiffness law."""
    law = DAMPING[name]()
    body = disc("disc", (0.0, RADIUS + 0.01), (0.0, -0.3))
    floor = on_a_floor(body, stiffness=sd.Hertz(), damping=law).replace("gravity", 0.0)
    run = sd.simulate(floor, until=0.08, **TIGHT)
    assert run["event_kind"].values.astype(str).tolist() == ["reached", "left"]
    speeds = run["event_speed"].values
    assert speeds[0] == pytest.approx(0.3, rel=1e-12)
    assert -speeds[1] / speeds[0] == pytest.approx(returned(law.factor), rel=1e-8)
    assert_balance(run)


def test_a_ball_bounces_in_closed_form():
    """Closed form: onsets and releases of Hertz's impact without weight in flight, T = 2 (5 m/4 K)^(2/5) v^(-1/5) I."""
    height, steel = 0.2, sd.STEEL
    stiffness = 2.0 / 3.0 * steel.youngs_modulus / (1.0 - steel.poisson_ratio**2) * math.sqrt(RADIUS)
    ball = on_a_floor(disc("disc", (0.0, RADIUS + height)), stiffness=sd.Hertz(), damping=NoDamping())
    run = sd.simulate(ball, until=0.5, **TIGHT)
    fall, speed = math.sqrt(2.0 * height / G), math.sqrt(2.0 * G * height)
    lasts = 2.0 * (1.25 * MASS / stiffness) ** 0.4 * speed**-0.2 * quad(lambda z: 1.0 / math.sqrt(1.0 - z**2.5), 0.0, 1.0)[0]
    reached, left = (run["event_time"].values[run["event_kind"].values.astype(str) == kind] for kind in ("reached", "left"))
    assert reached[0] == pytest.approx(fall, rel=1e-9)
    assert left[0] - reached[0] == pytest.approx(lasts, rel=1e-3)  # the weight is 1e-4 of the force
    deepest = (1.25 * MASS * speed**2 / stiffness) ** 0.4
    assert float(run["edge_contact_peak_indentation"][0]) == pytest.approx(deepest, rel=1e-3)
    assert float(run["edge_contact_peak_force"][0]) == pytest.approx(stiffness * deepest**1.5, rel=1e-3)
    assert "start faster than" in " ".join(json.loads(run.attrs["warnings"]))


def test_forces_at_the_samples():
    """Closed form: normal force, friction, energy and indentation of a sample by the formulas of the laws."""
    coefficient, exponent, restitution, kinetic, ramp = 3e7, 1.3, 0.6, 0.3, 0.5
    laws = {"stiffness": PowerLaw(coefficient, exponent), "damping": sd.Flores(restitution), "friction": Coulomb(kinetic, ramp)}
    body = disc("disc", (0.0, RADIUS), (0.4, -0.5), spin=-2.0)
    run = sd.simulate(on_a_floor(body, **laws), until=1e-3, samples=41, **TIGHT)
    depth = RADIUS - run["position"].values[:, 0, 1]
    rate, slip = (
        -run["velocity"].values[:, 0, 1],
        -run["velocity"].values[:, 0, 0] - RADIUS * run["angular_velocity"].values[:, 0],
    )
    touches = run["edge_contact_normal"].values[:, 0] > 0.0
    touches[0] = False  # the onset itself
    assert touches.sum() > 30
    normal = coefficient * depth**exponent * (1.0 + 1.6 * (1.0 - restitution) / restitution * rate / 0.5)
    for name, expected in {
        "normal": normal,
        "friction": kinetic * normal * np.tanh(slip / ramp),
        "energy": coefficient * depth ** (exponent + 1.0) / (exponent + 1.0),
        "indentation": depth,
    }.items():
        found = run[f"edge_contact_{name}"].values[:, 0]
        np.testing.assert_allclose(found[touches], expected[touches], rtol=1e-7, err_msg=name)
    assert_balance(run)


def test_bristles_slide_roll_and_vibrate():
    """Second formulation: Hertz, Flores and Dahl's law in the equations of a disc on a slope, by scipy."""
    slope, kinetic, sigma, restitution, speed = 0.3, 0.25, 1e5, 0.4, 0.8
    steel = sd.STEEL
    stiffness = 2.0 / 3.0 * steel.youngs_modulus / (1.0 - steel.poisson_ratio**2) * math.sqrt(RADIUS)
    along, up = np.array([math.cos(slope), math.sin(slope)]), np.array([-math.sin(slope), math.cos(slope)])
    weight = MASS * G * math.cos(slope)
    depth = 1.5 * (weight / stiffness) ** (2.0 / 3.0)  # pressed in deeper than at rest
    body = disc("disc", tuple(((RADIUS - depth) * up).tolist()), tuple((speed * along).tolist()), spin=1.0)
    laws = {"stiffness": sd.Hertz(), "damping": sd.Flores(restitution), "friction": Dahl(kinetic, sigma)}
    run = sd.simulate(on_a_floor(body, slope, **laws), until=5e-3, samples=51, method="rodas5p", rtol=1e-10, atol=1e-10)
    xi = 1.6 * (1.0 - restitution) / restitution

    def rate(t, y):
        _, d, v, d_rate, w, z = y
        elastic = stiffness * d**1.5
        reference = max(1e-6, 0.5 * math.sqrt(d_rate**2 + elastic * d / MASS))  # the load of a contact at rest
        normal = max(0.0, elastic * (1.0 + xi * d_rate / reference))
        slip = -v - RADIUS * w  # of the disc's lowest point to the left of the normal
        friction, bends = normal * sigma * z, slip * (1.0 - sigma * z / kinetic * math.copysign(1.0, slip))
        forward = -G * math.sin(slope) + friction / MASS
        return [v, d_rate, forward, (weight - normal) / MASS, RADIUS * friction / INERTIA, bends]

    start = [0.0, depth, speed, 0.0, 1.0, math.copysign(kinetic / sigma, -speed - RADIUS)]
    found = solve_ivp(rate, (0.0, 5e-3), start, t_eval=run["time"].values, method="Radau", rtol=1e-10, atol=1e-15)
    np.testing.assert_allclose(run["velocity"].values[:, 0] @ along, found.y[2], atol=1e-8)
    np.testing.assert_allclose(run["velocity"].values[:, 0] @ up, -found.y[3], atol=1e-7)
    np.testing.assert_allclose(run["angular_velocity"].values[:, 0], found.y[4], atol=1e-6)
    np.testing.assert_allclose(run["edge_contact_bristle_deflection"].values[:, 0], found.y[5], atol=1e-10)
    assert_balance(run, 1e-7)


def test_bristles_hold_a_mass_on_a_slope():
    """Closed form: a point without rotation stays on a slope below the friction angle, and slides above it."""
    for slope, holds in ((0.15, True), (0.4, False)):
        mass = sd.point_mass("block", mass=MASS, position=(0.0, 0.0))
        floor = sd.EdgeContact(
            *("floor", ("ground", "O"), ("block", "centre"), slope),
            stiffness=Linear(1e6),
            damping=DAMPING["kelvin-voigt"](500.0),
            friction=sd.LuGre(0.2, static=0.2),
        )
        mechanism = sd.Mechanism(bodies=(mass,), components=(floor,), ground=(("O", (0.0, 0.0)),), gravity=G)
        run = sd.simulate(mechanism, until=1.0, samples=11, rtol=1e-10, atol=1e-10)
        gone = -run["position"].values[:, 0] @ (math.cos(slope), math.sin(slope))
        if holds:
            assert gone[-1] == pytest.approx(gone[5], abs=1e-9)
            assert float(run["edge_contact_bristle_deflection"][-1, 0]) == pytest.approx(math.tan(slope) / 1e5, rel=1e-6)
        else:
            assert gone[-1] == pytest.approx(0.5 * G * (math.sin(slope) - 0.2 * math.cos(slope)), rel=1e-3)
        assert_balance(run)


@pytest.mark.parametrize("name", FRICTION)
def test_momenta_with_each_friction_law(name):
    """Identity: linear and angular momentum of two free bodies stay with each friction law, and the energy balances."""
    law = FRICTION[name]()
    contact = sd.EdgeContact(
        *("touch", ("bar", "start"), ("disc", "centre")), length=1.0, half_width=0.02, radius=RADIUS, friction=law
    )
    bodies = bar(0.5), disc("disc", (0.3, RADIUS + 0.021), (0.3, -2.0), spin=4.0)
    run = sd.simulate(free_bodies(bodies, contact), until=0.01, samples=51, rtol=1e-9, atol=1e-9)
    assert run["event_kind"].values.astype(str).tolist() == ["reached", "left"]
    found = momenta(run, bodies)
    np.testing.assert_allclose(found, np.broadcast_to(found[0], found.shape), atol=1e-9)
    assert_balance(run, 1e-7)
    moved = float(np.abs(run["edge_contact_friction"]).max()) > 0.0
    assert moved == (name != "none")


def test_bars_of_a_folded_scissor_rebound():
    """Closed form: bars of a folded array touch at sin 2a = 2w/L and rebound with the restitution of the law."""
    width = 0.05
    touches = tuple(
        sd.EdgeContact(
            *(f"touch {unit} {layer}", (f"unit {unit}/bar {layer}", "start"), (f"unit {unit + 1}/bar {layer}", "start")),
            length=1.0,
            half_width=0.5 * width,
            radius=0.5 * width,
            stiffness=PowerLaw(1e11),
            damping=sd.Flores(0.7),
        )
        for unit in (1, 2)
        for layer in (1, 2)
    )
    angle = math.radians(85.0)
    array = sd.scissor(units=3, angle=angle, bar_length=1.0, bar_mass=1.0, slider_mass=1.0, gravity=0.0)
    folding = array.with_parts({"components": (sd.Torque("fold", "unit 1/bar 1", torque=5.0), *touches)})
    run = sd.simulate(folding, until=1.0, samples=1001, **TIGHT)
    kinds, times = run["event_kind"].values.astype(str), run["event_time"].values
    assert kinds[:8].tolist() == ["reached"] * 4 + ["left"] * 4
    before = int(np.searchsorted(run["time"].values, times[0])) - 1
    rates = ("angle", "angular_velocity", "angular_acceleration")
    angle, speed, gain = (float(run[name].sel(body="unit 1/bar 1")[before]) for name in rates)
    later = times[0] - float(run["time"][before])
    assert angle + speed * later + 0.5 * gain * later**2 == pytest.approx(
        0.5 * math.pi - 0.5 * math.asin(2.0 * width), abs=1e-6
    )
    speeds = run["event_speed"].values
    np.testing.assert_allclose(-speeds[4:8] / speeds[:4], returned(1.6 * 0.3 / 0.7), rtol=5e-4)  # the torque presses meanwhile
    assert_balance(run)


@pytest.mark.parametrize(
    ("law", "largest"), [(Coulomb(0.25), 0.25), (sd.LuGre(0.2, static=0.3), 0.3)], ids=["coulomb", "lugre"]
)
def test_statics_of_friction_at_an_edge(law, largest):
    """Closed form: torque mu K delta (L + R) of a driven crank whose disc rubs on a floor, against its motion."""
    length, depth, stiffness = 1.0, 5e-4, 1e5
    pivot, start = (0.0, length + RADIUS - depth), -0.5 * math.pi - 0.01
    crank = sd.Body("crank", 1.0, 0.1, {"pivot": (0.0, 0.0), "end": (length, 0.0)}, position=pivot, angle=start)
    floor = sd.EdgeContact("floor", ("ground", "O"), ("crank", "end"), radius=RADIUS, stiffness=Linear(stiffness), friction=law)
    driven = sd.Mechanism(
        (crank,),
        joints=(sd.Revolute("pivot", ("crank", "pivot"), ("ground", "P")),),
        components=(floor,),
        ground=(("O", (0.0, 0.0)), ("P", pivot)),
        gravity=0.0,
    ).driven(sd.Polynomial((start, 0.02)), body="crank")
    torque = largest * stiffness * depth * (length + RADIUS)
    for sense, sign in (("none", 0.0), ("forward", 1.0), ("backward", -1.0)):
        found = sd.statics(driven, until=1.0, points=3, friction=sense)
        assert float(found["drive_torque"][1]) == pytest.approx(sign * torque, rel=1e-9, abs=1e-9)


def test_curvature_of_two_discs():
    """Closed form: Hertz's constant of two balls, 4/3 E* sqrt(R w/(R + w)), from the relative radius."""
    contact = sd.EdgeContact("touch", ("one", "centre"), ("two", "centre"), 0.0, 0.0, 0.03, RADIUS, stiffness=sd.Hertz())
    modulus = 0.5 * sd.STEEL.youngs_modulus / (1.0 - sd.STEEL.poisson_ratio**2)
    (constant,) = contact.stiffness.parameters(contact.surfaces)
    assert constant == pytest.approx(4.0 / 3.0 * modulus * math.sqrt(RADIUS * 0.03 / (RADIUS + 0.03)), rel=1e-14)


@pytest.mark.slow
def test_gradients_of_a_bounce():
    """Second formulation: derivatives of the largest force by radius and laws, against differences of runs."""
    laws = {"stiffness": sd.Hertz(), "friction": sd.LuGre(0.3)}
    floor = on_a_floor(disc("disc", (0.0, RADIUS + 0.005), (1.0, 0.0), spin=2.0), **laws)
    by = ["floor.radius", "floor.friction.kinetic", "floor.damping.restitution"]
    found = sd.gradient(floor, of=["peak_component_force"], by=by, until=0.035)["derivative"].values[0]

    def largest(path, value):
        run = sd.simulate(floor.replace(path, value), until=0.035, rtol=1e-12, atol=1e-12)
        return float(run["edge_contact_peak_force"][0])

    for path, slope, value in zip(by, found, (RADIUS, 0.3, 0.5), strict=True):
        step = 1e-4 * value
        assert slope == pytest.approx((largest(path, value + step) - largest(path, value - step)) / (2.0 * step), rel=1e-5)


def test_bristles_and_hard_contact_exclude_each_other():
    """Contract: time stepping of hard contacts does not integrate the states of friction at edges, and says so."""
    loose = sd.Clearance(5e-4, contact="hard")
    arm = sd.scissor(units=1).with_clearance("A", loose)
    floor = sd.EdgeContact("wall", ("ground", "origin"), ("disc", "centre"), radius=RADIUS, friction=sd.LuGre(0.3))
    both = arm.with_parts({"bodies": (*arm.bodies, disc("disc", (9.0, 1.0))), "components": (floor,)})
    with pytest.raises(sd.InputError, match="edge contact 'wall' has friction law 'lugre' with internal states, next to hard"):
        sd.simulate(both, until=0.1)


def test_laws_in_a_case_file(tmp_path):
    """Contract: laws by name or as a table, also user-defined, are read and written; a wrong one is one line."""
    laws = {"stiffness": sd.Hertz(), "damping": sd.LankaraniNikravesh(0.8), "friction": sd.LuGre(0.1)}
    floor = on_a_floor(disc("disc", (0.0, 2.0 * RADIUS)), **laws)
    text = sd.case_text(floor)
    assert 'stiffness = "hertz"' in text
    assert 'damping = {law = "lankarani-nikravesh", restitution = 0.8}' in text.replace("{ ", "{").replace(" }", "}")
    path = tmp_path / "case.toml"
    path.write_text(text, encoding="utf-8")
    assert sd.read_case(path).mechanism.components == floor.components
    for law, message in {"liu": "no force for a radius of 0.1 m on a plane surface", "hetz": "did you mean 'hertz'"}.items():
        path.write_text(text.replace('"hertz"', f'"{law}"'), encoding="utf-8")
        with pytest.raises(sd.InputError, match=message):
            sd.simulate(sd.read_case(path).mechanism, until=0.1)


def test_impossible_edges_are_refused():
    """Contract: a start inside the edge, and a point at a line, are one line."""
    with pytest.raises(sd.InputError, match="starts 50 mm deep in the edge"):
        sd.simulate(on_a_floor(disc("disc", (0.0, 0.5 * RADIUS))), until=0.1)
    with pytest.raises(sd.InputError, match="a point and an edge without width"):
        free_bodies(
            (bar(), disc("disc", (0.0, 1.0))), sd.EdgeContact("touch", ("bar", "start"), ("disc", "centre"), length=1.0)
        )
    point = sd.EdgeContact("floor", ("ground", "O"), ("disc", "centre"), stiffness=sd.Hertz())
    fallen = sd.Mechanism(bodies=(disc("disc", (0.0, 1.0)),), components=(point,), ground=(("O", (0.0, 0.0)),))
    with pytest.raises(sd.InputError, match=r"stiffness law 'hertz' has no force for a radius of 0 m"):
        sd.simulate(fallen, until=0.1)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("speed", [0.5, 1.0, 1.7])
@pytest.mark.parametrize("events", ["located", "crossed"])
def test_a_thin_bar_stops_a_fast_disc(speed, method, events):
    """Second road: the contact alone in SciPy. Bar and disc are 800 times as thin as the flight is long."""
    stiffness, reach = 1e7, 6e-4
    bar = sd.EdgeContact("bar", ("ground", "O"), ("ball", "centre"), 0.5 * math.pi, length=0.4, half_width=1e-4, radius=5e-4)
    bar = dataclasses.replace(bar, stiffness=Linear(stiffness))
    ball = sd.Body("ball", 1.0, 1e-3, {"centre": (0.0, 0.0)}, position=(0.0, 0.0), velocity=(speed, 0.0))
    thrown = sd.Mechanism((ball,), components=(bar,), ground=(("O", (0.5, -0.2)),), gravity=0.0)
    run = sd.simulate(thrown, until=1.0 / speed, start="as-placed", method=method, events=events, **TIGHT)

    def motion(_, y):
        factor = 1.0 + 8.0 * (1.0 - 0.5) / (5.0 * 0.5) * y[1] / speed
        return [y[1], -stiffness * max(y[0], 0.0) * factor]

    def released(t, y):
        return float(y[0]) if t > 0.0 else 1.0

    released.terminal = True
    contact = solve_ivp(motion, (0.0, 1.0), (0.0, speed), "DOP853", rtol=1e-11, atol=1e-14, events=released, max_step=1e-4)
    assert contact.y[0].max() < reach
    assert run["velocity"].values[-1, 0, 0] == pytest.approx(contact.y[1, -1], rel=1e-7)
    assert "failed" not in run.attrs["warnings"]


def test_a_disc_that_passes_a_bar_is_named():
    """Contract: a disc whose centre crosses the bar's axis comes out on the other side, which no law describes."""
    bar = sd.EdgeContact("bar", ("ground", "O"), ("disc", "centre"), 0.5 * math.pi, length=0.4, half_width=1e-3, radius=RADIUS)
    bar = dataclasses.replace(bar, stiffness=Linear(1e3))
    thrown = sd.Mechanism((disc("disc", (0.0, 0.0), (9.0, 0.0)),), components=(bar,), ground=(("O", (0.5, -0.2)),), gravity=0.0)
    run = sd.simulate(thrown, until=0.2, start="as-placed")
    assert run["velocity"].values[-1, 0, 0] > 0.0
    said = "the contact model has failed.*edge contact 'bar': indentation 101 mm reaches the radius of 100 mm"
    assert re.search(said, run.attrs["warnings"])
