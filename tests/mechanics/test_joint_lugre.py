"""LuGre friction in ideal pins and guides: presliding, breakaway, steady sliding, stick-slip, limits, energy."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest

import scissordyn as sd
from scissordyn.model.mechanism import Mechanism

G = 9.81
LOAD, RADIUS = 3.0 * G, 0.02
TIGHT = {"rtol": 1e-10, "atol": 1e-12}
ORIGIN = (("O", (0.0, 0.0)),)


def journal(*more: Any, friction: dict[str, float], **start: Any) -> Mechanism:
    """A disc of 3 kg on a pin with bristles."""
    disc = sd.Body("disc", mass=3.0, inertia=0.02, points={"middle": (0.0, 0.0)}, **start)
    pin = sd.Revolute("pin", ("disc", "middle"), ("ground", "O"))
    return Mechanism(
        (disc,),
        joints=(pin,),
        components=(sd.PinLuGre("friction", "disc", RADIUS, **friction), *more),
        ground=ORIGIN,
        gravity=G,
    )


@pytest.mark.parametrize("speed", [0.3, 5.0])
def test_steady_sliding(speed: float) -> None:
    """Closed form: the Stribeck curve and the viscous part, on the friction circle."""
    friction = {"kinetic": 0.2, "static": 0.3, "viscous": 0.05}
    run = sd.simulate(journal(friction=friction).driven(speed=speed, body="disc"), until=0.05, samples=3, **TIGHT)
    slip = RADIUS * speed
    ratio = 0.2 + 0.1 * math.exp(-((slip / 0.01) ** 2)) + 0.05 * slip
    assert float(run["drive_torque"][-1]) == pytest.approx(LOAD * RADIUS * math.sin(math.atan(ratio)), rel=1e-13)


def test_soft_bristles() -> None:
    """Closed form: at a speed from rest on friction grows as g (1 - exp(-sigma_0 x / g)), and vanishes with sigma_0."""
    friction = {"kinetic": 0.3, "bristle_stiffness": 50.0, "bristle_damping": 0.0}
    run = sd.simulate(journal(friction=friction).driven(speed=5.0, body="disc"), until=0.2, samples=9, **TIGHT)
    ratio = 0.3 * (1.0 - np.exp(-50.0 * RADIUS * 5.0 * run["time"].values / 0.3))
    np.testing.assert_allclose(run["drive_torque"], LOAD * RADIUS * np.sin(np.arctan(ratio)), rtol=1e-8, atol=1e-12)


@pytest.mark.parametrize("share", [0.1, 0.5, 0.95])
def test_presliding(share: float) -> None:
    """Closed form: a slow torque below breakaway turns the pin by -mu_s/(sigma_0 R) ln(1 - tan(phi)/mu_s), and it stays."""
    torque = share * LOAD * RADIUS * math.sin(math.atan(0.3))
    load = sd.Torque("load", "disc", torque, time_function=sd.Cycloidal(0.0, 1.0, 2.0))
    run = sd.simulate(journal(load, friction={"kinetic": 0.2, "static": 0.3}), until=3.0, samples=4)
    ratio = math.tan(math.asin(torque / (LOAD * RADIUS)))
    exact = -0.3 / (1e5 * RADIUS) * math.log(1.0 - ratio / 0.3)
    turned = run["angle"].values[:, 0] - run["angle"].values[0, 0]
    assert turned[-1] == pytest.approx(exact, rel=1e-3 if share > 0.9 else 1e-5)
    assert abs(float(run["angular_velocity"][-1, 0])) < 1e-9
    if share == 0.1:  # sigma_0 R^2 W is the stiffness of small angles
        assert turned[-1] == pytest.approx(torque / (1e5 * RADIUS**2 * LOAD), rel=0.06)


def test_breakaway() -> None:
    """Limit: 5 % more than R W sin(arctan(mu_s)) breaks the pin away."""
    torque = 1.05 * LOAD * RADIUS * math.sin(math.atan(0.3))
    load = sd.Torque("load", "disc", torque, time_function=sd.Cycloidal(0.0, 1.0, 2.0))
    run = sd.simulate(journal(load, friction={"kinetic": 0.2, "static": 0.3}), until=3.0, samples=4)
    assert float(run["angle"][-1, 0]) > 1.0


def test_stiff_bristles() -> None:
    """Order of convergence: a disc runs down as by Coulomb's friction, with an error as 1/sigma_0; energy closes."""
    torque, errors = LOAD * RADIUS * math.sin(math.atan(0.2)), []
    for stiffness in (1e4, 1e5):
        friction = {"kinetic": 0.2, "bristle_stiffness": stiffness, "bristle_damping": 0.0}
        run = sd.simulate(journal(friction=friction, angular_velocity=20.0), until=0.5, samples=3, **TIGHT)
        errors.append(float(run["angular_velocity"][-1, 0]) - (20.0 - torque / 0.02 * 0.5))
        lost = float(run["dissipated_energy"][-1])
        assert float(np.abs(run["energy_residual"]).max()) < 1e-9 * lost
    assert errors[0] / errors[1] == pytest.approx(10.0, rel=1e-3)


def pulled(**friction: float) -> Mechanism:
    """A block of 1 kg on a floor, pulled by a spring of 1 N/mm whose end moves at 2 mm/s."""
    block, hand = sd.point_mass("block", mass=1.0, position=(0.0, 0.0)), sd.point_mass("hand", mass=1.0, position=(1.0, 0.0))
    guides = (sd.Guide("floor", ("block", "centre")), sd.Guide("rail", ("hand", "centre")))
    pull = sd.CoordinateDrive("pull", sd.Slide(("hand", "centre")), sd.Polynomial((1.0, 2e-3)))
    spring = sd.Spring("spring", ("block", "centre"), ("hand", "centre"), stiffness=1e3, free_length=1.0)
    floor = sd.GuideLuGre("floor", ("ground", "O"), ("block", "centre"), 0.0, **friction)
    return Mechanism((block, hand), guides=guides, drives=(pull,), components=(spring, floor), ground=ORIGIN, gravity=G)  # type: ignore[arg-type]


def test_stick_slip() -> None:
    """Closed form: slip is half an oscillation about mu_k N, from F to 2 mu_k N - F; F goes to mu_s N with sigma_0."""
    breakaway = []
    for stiffness in (1e5, 1e6):
        bristles = {"bristle_stiffness": stiffness, "bristle_damping": math.sqrt(stiffness)}
        run = sd.simulate(pulled(kinetic=0.2, static=0.4, stribeck_speed=1e-4, **bristles), until=6.0, samples=6001)
        force = run["spring_force"].values[:, 0] / G
        breakaway.append(float(force.max()))
        assert breakaway[-1] + float(force[force.argmax() :].min()) == pytest.approx(2.0 * 0.2, rel=1e-3)
        fastest = (breakaway[-1] - 0.2) * G * math.sqrt(1.0 / 1e3) + 2e-3
        velocity = run["velocity"].sel(body="block", axis="x").values
        assert float(velocity.max()) == pytest.approx(fastest, rel=0.02)
        assert float(np.mean(np.abs(velocity) < 1e-4)) > 0.9
    assert 0.36 < breakaway[0] < breakaway[1] < 0.4
    assert breakaway[1] == pytest.approx(0.4, rel=0.02)


@pytest.mark.parametrize(("slope", "holds"), [(0.28, True), (0.32, False)])
def test_block_on_an_incline(slope: float, holds: bool) -> None:
    """Closed form: mu_s = 0.3 holds a block up to tan(alpha) = mu_s, without creep."""
    angle = math.atan(slope)
    block = sd.point_mass("block", mass=2.0, position=(0.0, 0.0))
    friction = sd.GuideLuGre("friction", ("ground", "O"), ("block", "centre"), angle, 0.2, 0.3)
    guide = sd.Guide("incline", ("block", "centre"), direction=angle)
    run = sd.simulate(
        Mechanism((block,), guides=(guide,), components=(friction,), ground=ORIGIN, gravity=G), until=2.0, samples=3
    )
    assert (math.hypot(*run["position"].values[-1, 0]) < 1e-4) is holds
    if holds:
        assert float(np.linalg.norm(run["velocity"].values[-1, 0])) < 1e-9


def test_drawer_that_jams() -> None:
    """Closed form: pulled aside of its rails a drawer takes P/(1 - 2 mu a/l); from 2 mu a = l on it jams."""
    box = sd.Body("box", mass=2.0, inertia=0.05, points={"c": (0.0, 0.0), "pull": (0.0, 0.2)})
    for mu in (0.3, 1.1):
        friction = sd.GuideLuGre("friction", ("ground", "O"), ("box", "c"), 0.0, mu, length=0.4)
        rod = sd.Rod("hand", ("ground", "far"), ("box", "pull"), motion=sd.Polynomial((2.0, 0.1)))
        drawer = Mechanism(
            (box,),
            guides=(sd.Guide("rails", ("box", "c"), aligned=True),),
            rods=(rod,),
            components=(friction, sd.Force("side", ("box", "c"), (-30.0, 0.0))),
            ground=(*ORIGIN, ("far", (-2.0, 0.2))),
            gravity=0.0,
        )
        run = sd.simulate(drawer, until=0.1, samples=3)
        if mu < 1.0:
            assert float(-run["rod_force"][-1, 0]) == pytest.approx(30.0 / (1.0 - 2.0 * mu * 0.2 / 0.4), rel=1e-9)
        else:
            assert "the mechanism jams: no reactions are in balance with friction 'friction'" in run.attrs["cause"]


def crank_with_bristles() -> Mechanism:
    """A slider-crank with bristles in its pins."""
    crank = sd.slider_crank(crank=0.1, rod=0.3, gravity=G)
    pins = (("ground pin", "crank", "ground"), ("crank pin", "rod", "crank"), ("slider pin", "rod", "slider"))
    frictions = (sd.PinLuGre(name, body, 0.012, 0.2, base=base, static=0.3) for name, body, base in pins)
    bodies = tuple(dataclasses.replace(b, angular_velocity=30.0) if b.name == "crank" else b for b in crank.bodies)
    return dataclasses.replace(crank, components=tuple(frictions), bodies=bodies)


def test_explicit_and_implicit_steps() -> None:
    """Cross-check: two methods agree, the energy balance closes, and reactions are those of the result."""
    runs = [
        sd.simulate(crank_with_bristles(), until=0.05, samples=6, method=method, **TIGHT) for method in ("dop853", "rodas5p")
    ]
    np.testing.assert_allclose(runs[0]["angle"], runs[1]["angle"], atol=1e-8)
    lost = float(runs[0]["dissipated_energy"][-1])
    assert float(np.abs(runs[0]["energy_residual"]).max()) < 1e-8 * lost
    size, joints = np.linalg.norm(runs[0]["reaction"].values, axis=2), runs[0]["joint"].values.tolist()
    for k, joint in enumerate(runs[0]["pin_lugre"].values.tolist()):
        np.testing.assert_allclose(runs[0]["pin_lugre_reaction"][:, k], size[:, joints.index(joint)], rtol=1e-9)


def test_rest_and_statics() -> None:
    """Limit: in equilibrium bristles exert nothing; in a slow motion they are Coulomb's friction."""
    crank = dataclasses.replace(sd.slider_crank(crank=0.1, rod=0.3, gravity=G), components=crank_with_bristles().components)
    coulomb = dataclasses.replace(crank, components=tuple(part.without_bristles() for part in crank.components))  # type: ignore[attr-defined]
    drive = sd.Cycloidal(0.5, 2.0, 1.0)
    torques = [
        sd.statics(part.driven(drive), until=1.0, points=5, friction="forward")["drive_torque"] for part in (crank, coulomb)
    ]
    np.testing.assert_array_equal(*torques)
    run = sd.simulate(crank, until=0.01, start="static")
    assert float(np.abs(run["angular_velocity"]).max()) < 1e-6
