"""Static equilibrium at the start: found where there is one, a minimum of the potential energy, and else a reason."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
import xarray as xr

import scissordyn as sd
from reference.lagrange import Array
from scissordyn.errors import InputError
from scissordyn.model.mechanism import Mechanism

LENGTH, SLIDER, GRAVITY = 2.0, 5.0, 9.81
WEIGHTS = Array(joint=None, motion=None).weights()  # type: ignore[arg-type]
"""Of the two families of bars in the potential energy [J]."""

PRESSURE = 1.5e-2 * 0.5 * math.pi * sd.STEEL.youngs_modulus / (2.0 * (1.0 - sd.STEEL.poisson_ratio**2))
"""p_0 of Liu's law F = p_0 d sqrt(d/(2 (c + d))) [N/m]."""

BARS = ("unit 1/bar 1", "unit 1/bar 2")


def sprung(angle: float, clearance: float, stiffness: float, free: float, *, mirrored: bool = False) -> Mechanism:
    """The paper's array with a loose joint A and a spring between the bars of its first unit; angles in degrees."""
    array = sd.scissor(units=2, angle=math.radians(angle)).with_clearance("A", sd.Clearance(clearance, stiffness=sd.Liu()))
    body, base = BARS[::-1] if mirrored else BARS
    spring = sd.TorsionSpring("spring", body, base, stiffness=stiffness, free_angle=math.radians(free))
    return dataclasses.replace(array, components=(spring,))


def resting(mechanism: Mechanism, until: float = 1e-4) -> xr.Dataset:
    """A short run from equilibrium."""
    return sd.simulate(mechanism, until=until, samples=3, start="static")


def slopes(run: xr.Dataset, clearance: float, stiffness: float, turned: float) -> tuple[np.ndarray, np.ndarray]:
    """Gradient and Hessian of the potential energy in the minimal coordinates p, k, y at the start of a run.

    V = w_p sin p + w_k sin k + m_s g y + W(|e| - c) + K (p - k - turned)^2/2, with the eccentricity
    e = ((L/2)(cos p - cos k), (L/2)(sin p - sin k) - y).
    """
    p, k = (float(run["angle"].sel(body=bar)[0]) for bar in BARS)
    y = float(run["slider_position"][0])
    half = 0.5 * LENGTH
    e = np.array([half * (math.cos(p) - math.cos(k)), half * (math.sin(p) - math.sin(k)) - y])
    by = np.array([[-half * math.sin(p), half * math.sin(k), 0.0], [half * math.cos(p), -half * math.cos(k), -1.0]])
    bend = np.array([[-half * math.cos(p), half * math.cos(k), 0.0], [-half * math.sin(p), half * math.sin(k), 0.0]])
    far = math.hypot(*e)
    depth = max(far - clearance, 0.0)
    normal, along = e / far, np.array([-e[1], e[0]]) / far
    force = PRESSURE * depth * math.sqrt(depth / (2.0 * (clearance + depth)))
    rise = force * (1.5 / depth - 0.5 / (clearance + depth)) if depth > 0.0 else 0.0
    spring = stiffness * np.array([1.0, -1.0, 0.0])
    weight = np.array([WEIGHTS[0] * math.cos(p), WEIGHTS[1] * math.cos(k), SLIDER * GRAVITY])
    gradient = weight + force * normal @ by + spring * (p - k - turned)
    hessian = by.T @ (rise * np.outer(normal, normal) + force / far * np.outer(along, along)) @ by
    hessian += np.diag(force * normal @ bend - np.array([WEIGHTS[0] * math.sin(p), WEIGHTS[1] * math.sin(k), 0.0]))
    hessian += np.outer(spring, [1.0, -1.0, 0.0])
    return gradient, hessian


def assert_minimum(run: xr.Dataset, clearance: float, stiffness: float, turned: float) -> None:
    """The potential energy is stationary there, to 1e-7 of the weight, and has a minimum."""
    gradient, hessian = slopes(run, clearance, stiffness, turned)
    assert np.abs(gradient).max() < 1e-7 * WEIGHTS[0]
    assert np.linalg.eigvalsh(hessian)[0] > 0.0


def test_equilibrium_of_the_ideal_array() -> None:
    """Closed form: g L (2 m + m_s) cos th = 2 k (phi - 2 th), which holds at 39.9210 degrees for this spring."""
    mechanism = sprung(35.0, 0.3e-3, 458.3, 95.23).ideal()
    angle = float(resting(mechanism)["angle"].sel(body=BARS[0])[0])
    load = GRAVITY * LENGTH * (2.0 * 5.68 + SLIDER)
    assert load * math.cos(angle) == pytest.approx(2.0 * 458.3 * (math.radians(95.23) - 2.0 * angle), rel=1e-9)
    assert math.degrees(angle) == pytest.approx(39.9210, abs=5e-5)


def test_equilibrium_with_a_loose_joint() -> None:
    """Cross-check: at rest near the angle of the ideal array, where the energy in minimal coordinates has a minimum."""
    run = resting(sprung(35.0, 0.3e-3, 458.3, 95.23))
    assert_minimum(run, 0.3e-3, 458.3, math.radians(95.23))
    p, k = (math.degrees(float(run["angle"].sel(body=bar)[0])) for bar in BARS)
    assert 0.5 * (p - k) == pytest.approx(39.9210, abs=0.03)


@pytest.mark.parametrize("mirrored", [False, True])
def test_random_springs_and_clearances(mirrored: bool) -> None:
    """Cross-check: sixty of them all find rest, a minimum of the energy in minimal coordinates, full turns counted rightly.

    Mirrored, the springs pull the array through its flat position, most of them into the bars' other order.
    """
    random = np.random.default_rng(0)
    for _ in range(60):
        angle, clearance = random.uniform(20.0, 70.0), random.uniform(0.05e-3, 0.5e-3)
        stiffness, free = random.uniform(50.0, 2000.0), random.uniform(20.0, 160.0)
        run = resting(sprung(angle, clearance, stiffness, free, mirrored=mirrored))
        assert_minimum(run, clearance, stiffness, math.radians(-free if mirrored else free))


def test_rest_is_kept() -> None:
    """Contract: the run stays where it starts, also where the bars have turned by more than half a turn against each other."""
    mechanism = sprung(50.77, 0.2227e-3, 1994.6, 220.0, mirrored=True)
    run = resting(mechanism, until=0.05)
    angle = run["angle"].sel(body=list(BARS)).values
    assert abs(math.degrees(angle[0, 0] - angle[0, 1])) > 180.0
    assert np.ptp(angle, axis=0).max() < 1e-9
    assert float(abs(run["angular_acceleration"]).max()) < 1e-5


def test_unloaded_rest_is_exact() -> None:
    """Identity: without gravity the unbalanced force is compared with the spring's, not with what contacts bore on the way."""
    crank = sd.slider_crank(crank=0.3, rod=0.7, angle=1.7, gravity=0.0)
    for joint, clearance in (("ground pin", 0.234e-3), ("crank pin", 0.07e-3)):
        crank = crank.with_clearance(joint, sd.Clearance(clearance))
    spring = sd.TorsionSpring("spring", "rod", stiffness=38.57, free_angle=-0.39)
    run = resting(dataclasses.replace(crank, components=(spring,)))
    inertia = 0.21 * 0.7**2 / 12.0
    assert float(abs(run["angular_acceleration"].sel(body="rod")).max()) * inertia < 1e-8 * 38.57


def test_nothing_holds_it() -> None:
    """Identity: a mass that only its weight acts on is refused, with that as the reason."""
    free = Mechanism((sd.point_mass("ball", mass=2.0, position=(0.5, 0.0)),), ground=(("O", (0.0, 0.0)),))
    with pytest.raises(InputError, match="no equilibrium: nothing holds the mechanism"):
        resting(free)


def test_gain_of_a_rate_does_not_count_at_rest() -> None:
    """Identity: tubes that are loose at all joints rest where a servo without a derivative gain lets them rest."""
    tubes = sd.scissor(units=2, bar_length=0.9, bar_mass=0.733).with_clearance("all", sd.Clearance(1e-5))
    tubes = tubes.with_bending(section="tube 50x2 mm", material="aluminium")
    servos = [sd.FeedForward(2e4, derivative, limit=2e3) for derivative in (0.0, 3500.0)]
    runs = [resting(tubes.controlled(servo, reference=sd.ConstantSpeed(0.0))) for servo in servos]
    np.testing.assert_allclose(runs[1]["position"].values[0], runs[0]["position"].values[0], rtol=0.0, atol=1e-10)
    torque = float(runs[1]["control_torque"].values[0, 0])
    assert torque == pytest.approx(2e4 * float(runs[1]["control_error"].values[0, 0]), rel=1e-9)


def test_servo_that_cannot_hold_is_named() -> None:
    """Contract: the rod of a crank is turned by more than the servo's limit, which nothing else bears."""
    crank = sd.slider_crank(crank=0.3, rod=0.7, angle=1.0, gravity=0.0).with_clearance("crank pin", sd.Clearance(1e-4))
    crank = crank.controlled(sd.FeedForward(2e4, 300.0, limit=20.0), reference=sd.ConstantSpeed(0.0), name="servo")
    load = sd.Torque("load", crank.input_body, torque=50.0)
    with pytest.raises(InputError, match=r"no equilibrium.*actuator 'servo' is at its limit of 20 N m"):
        resting(dataclasses.replace(crank, components=(*crank.components, load)))


@pytest.mark.parametrize("elements", [8, 16])
def test_a_load_without_weight_is_balanced(elements: int) -> None:
    """Closed form: the elastica of a cantilever with P L^2 = EI, by elliptic integrals; nothing but the force loads it."""
    bar = sd.bar("bar", length=1.0, mass=1.0, position=(0.0, 0.0), angle=0.0)
    clamped = sd.Mechanism(
        (bar,),
        (sd.Revolute("O", ("bar", "start"), ("ground", "O")),),
        ground=(("O", (0.0, 0.0)),),
        gravity=0.0,
        input_body="bar",
    ).with_bending(bending_stiffness=1e3, axial_stiffness=1e9, elements=elements)
    push = sd.Force("push", (clamped.bodies[-1].name, "end"), (0.0, 1e3))
    loaded = clamped.with_parts({"components": (*clamped.components, push)}).driven(speed=0.0)
    run = sd.simulate(loaded, until=1e-5, samples=2, start="static")
    assert float(run["angle"][0, -1]) == pytest.approx(0.46135194971188, rel=1e-6)


@pytest.mark.parametrize("kind", [{"modes": 4}, {"elements": 4}])
def test_a_bar_that_bends_moves_as_a_whole(kind: dict[str, int]) -> None:
    """Identity: the velocity that is given of a bar is that of all its cross-sections, as placed too."""
    bar = dataclasses.replace(sd.bar("bar", length=1.0, mass=1.0, position=(0.0, 0.0), angle=0.3), velocity=(1.0, -2.0))
    bent = sd.Mechanism((bar,), (), gravity=0.0).with_bending(bending_stiffness=1e3, axial_stiffness=1e6, **kind)
    run = sd.simulate(bent, until=1e-3, samples=3, start="as-placed")
    np.testing.assert_allclose(run["velocity"], np.broadcast_to([1.0, -2.0], run["velocity"].shape), atol=1e-5)
