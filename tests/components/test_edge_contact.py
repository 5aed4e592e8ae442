"""Contacts with edges: a disc on a floor, on the side and end of a bar, and on another disc."""

from __future__ import annotations

import math

import numpy as np
import pytest

import scissordyn as sd
from scissordyn.components.edge_contact import distance
from scissordyn.errors import InputError
from scissordyn.model.mechanism import Mechanism

from .shared import METHODS, TIGHT, assert_balance

MASS, RADIUS, G = 2.0, 0.1, 9.81  # Mass [kg] and radius [m] of a disc, gravitational acceleration [m/s^2]
INERTIA = 0.5 * MASS * RADIUS**2  # Of a disc about its centre [kg m^2]


def disc(name: str, position: tuple[float, float], velocity: tuple[float, float] = (0.0, 0.0), spin: float = 0.0) -> sd.Body:
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


def on_a_floor(body: sd.Body, slope: float = 0.0, **law: float) -> Mechanism:
    """Return a disc above a floor through the origin, at an angle to the horizontal."""
    floor = sd.EdgeContact("floor", ("ground", "O"), ("disc", "centre"), slope, radius=RADIUS, **law)
    return Mechanism(bodies=(body,), components=(floor,), ground=(("O", (0.0, 0.0)),), gravity=G)


@pytest.mark.parametrize("method", METHODS)
def test_a_disc_bounces_without_loss(method: str) -> None:
    """Closed form: flight under gravity, and half an oscillation on a linear spring under its weight."""
    height, stiffness = 0.2, 1e6
    floor = on_a_floor(disc("disc", (0.0, RADIUS + height)), stiffness=stiffness, exponent=1.0, restitution=1.0)
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
def test_a_sliding_disc_begins_to_roll(slope: float) -> None:
    """Closed form: friction slows the disc and turns it until it rolls; on a slope the weight drives it."""
    kinetic, stiffness, speed = 0.2, 1e8, 3.0
    along, up = np.array([math.cos(slope), math.sin(slope)]), np.array([-math.sin(slope), math.cos(slope)])
    weight = MASS * G * math.cos(slope)
    start = (RADIUS - weight / stiffness) * up
    law = {"stiffness": stiffness, "exponent": 1.0, "kinetic": kinetic, "transition": 1e-5}
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


def free_bodies(bodies: tuple[sd.Body, sd.Body], contact: sd.EdgeContact) -> Mechanism:
    """Return two bodies in a plane without gravity."""
    return Mechanism(bodies=bodies, components=(contact,), gravity=0.0)


def momenta(run, bodies: tuple[sd.Body, sd.Body]) -> np.ndarray:
    """Return linear and angular momentum of two bodies over time, shape (samples, 3)."""
    total = np.zeros((run.sizes["time"], 3))
    for body in bodies:
        place, velocity = (run[name].sel(body=body.name).values for name in ("position", "velocity"))
        total[:, :2] += body.mass * velocity
        turn = place[:, 0] * velocity[:, 1] - place[:, 1] * velocity[:, 0]
        total[:, 2] += body.mass * turn + body.inertia * run["angular_velocity"].sel(body=body.name).values
    return total


def bar(spin: float = 0.0) -> sd.Body:
    """Return a bar of 1 m whose axis begins at its point `start`."""
    points = {"start": (-0.5, 0.0), "end": (0.5, 0.0)}
    return sd.Body("bar", mass=3.0, inertia=0.25, points=points, position=(0.0, 0.0), angular_velocity=spin)


@pytest.mark.parametrize("kinetic", [0.0, 0.4])
@pytest.mark.parametrize(
    ("x", "side"), [(0.3, 1.0), (0.3, -1.0), (0.56, 1.0), (-0.55, -1.0)], ids=["left", "right", "end", "beginning"]
)
@pytest.mark.parametrize("restitution", [1.0, 0.6])
def test_a_disc_hits_a_turning_bar(x: float, side: float, kinetic: float, restitution: float) -> None:
    """Identity: momenta of two free bodies stay, on both sides and at both round ends; energies balance."""
    contact = sd.EdgeContact(
        *("touch", ("bar", "start"), ("disc", "centre")),
        length=1.0,
        half_width=0.02,
        radius=RADIUS,
        restitution=restitution,
        kinetic=kinetic,
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


def test_two_discs_exchange_their_speeds() -> None:
    """Closed form: a head-on collision of equal discs without loss; an edge of length 0 is a disc."""
    contact = sd.EdgeContact("touch", ("one", "centre"), ("two", "centre"), 0.7, 0.0, RADIUS, RADIUS, restitution=1.0)
    bodies = disc("one", (0.0, 0.0), (1.0, 0.5)), disc("two", (0.25, 0.0), (-2.0, 0.5))
    run = sd.simulate(free_bodies(bodies, contact), until=0.05, **TIGHT)
    assert float(run["event_time"][0]) == pytest.approx(0.05 / 3.0, rel=1e-9)
    np.testing.assert_allclose(run["velocity"].values[-1], [[-2.0, 0.5], [1.0, 0.5]], atol=1e-9)


def test_a_disc_runs_over_the_end_of_a_bar() -> None:
    """Identity: the energy balances while a disc rolls from the side of a bar around its end and falls off."""
    contact = sd.EdgeContact(
        *("touch", ("ground", "start"), ("disc", "centre")), length=0.5, half_width=0.03, radius=RADIUS, kinetic=0.5
    )
    mechanism = Mechanism(
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


def test_distance_of_a_point() -> None:
    """Second formulation: the nearest of many points of the edge."""
    along, rng = (math.cos(0.4), math.sin(0.4)), np.random.default_rng(3)
    edge = np.linspace(0.0, 0.7, 700_001)[:, None] * along
    for x, y in rng.uniform(-1.0, 1.0, (20, 2)).tolist():
        far, nx, ny = distance(x, y, *along, 0.7)
        apart = np.hypot(*(edge - (x, y)).T)
        assert far == pytest.approx(apart.min(), abs=1e-6)
        np.testing.assert_allclose((x, y) - far * np.array([nx, ny]), edge[apart.argmin()], atol=2e-6)


def test_impossible_edges_are_refused() -> None:
    """Contract: a start inside the edge, and a point at a line, are one line."""
    with pytest.raises(InputError, match="starts 50 mm deep in the edge"):
        sd.simulate(on_a_floor(disc("disc", (0.0, 0.5 * RADIUS))), until=0.1)
    with pytest.raises(InputError, match="a point and an edge without width"):
        free_bodies(
            (bar(), disc("disc", (0.0, 1.0))),
            sd.EdgeContact("touch", ("bar", "start"), ("disc", "centre"), length=1.0),
        )
