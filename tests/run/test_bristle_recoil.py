"""Warning of bristles in ideal pins and guides that recoil faster than the Stribeck speed."""

import dataclasses
import json
import math

import pytest
from tests.build import on_pin

import scissordyn as sd
from scissordyn.cli.main import status_of

# Gravity [m/s^2], kinetic and static friction coefficient, and Stribeck speed [m/s]
G, KINETIC, STATIC, STRIBECK = 9.81, 0.2, 0.3, 0.01


def _block(stiffness, slope=0.0, speed=0.0, **friction):
    """Return a block of 2 kg on an incline."""
    angle = math.atan(slope)
    along = speed * math.cos(angle), speed * math.sin(angle)
    block = dataclasses.replace(sd.point_mass("block", mass=2.0, position=(0.0, 0.0)), velocity=along)
    law = {"kinetic": KINETIC, "static": STATIC, "stribeck_speed": STRIBECK, "bristle_stiffness": stiffness} | friction
    bristles = sd.GuideLuGre("floor", ("ground", "O"), ("block", "centre"), angle, **law)
    guide = sd.Guide("incline", ("block", "centre"), direction=angle)
    return sd.Mechanism((block,), guides=(guide,), components=(bristles,), ground=(("O", (0.0, 0.0)),), gravity=G)


def _recoils(run):
    return [item["numbers"] for item in json.loads(run.attrs["warning_data"]) if item["kind"] == "recoil"]


def _brief(mechanism):
    return sd.simulate(mechanism, until=1e-5, samples=2)


LIMIT = G * (STATIC / STRIBECK) ** 2
"""[1/m] Bristle stiffness sigma_0 at which the recoil speed of the block, mu_s sqrt(g/sigma_0), is the Stribeck speed."""


@pytest.mark.parametrize(("factor", "warned"), [(0.25, True), (1.0 - 1e-6, True), (1.0 + 1e-6, False), (4.0, False)])
def test_limit_of_a_block(factor, warned):
    """Closed form: the warning begins where the recoil speed is the Stribeck speed."""
    found = _recoils(_brief(_block(factor * LIMIT)))
    assert bool(found) == warned
    if warned:
        assert found[0]["recoil"] == pytest.approx(STRIBECK / math.sqrt(factor), rel=1e-6)


def test_recoil_of_a_pin():
    """Closed form: a pendulum's inertia I on a journal of radius R moves as the mass I/R^2."""
    radius, stiffness = 0.05, 1e3
    bar = sd.bar("bar", length=1.0, mass=3.0, angle=-math.pi / 2)
    law = sd.PinLuGre("pin", "bar", radius, KINETIC, static=STATIC, stribeck_speed=1e-6, bristle_stiffness=stiffness)
    (found,) = _recoils(_brief(on_pin(bar, law, gravity=G)))
    mass = 3.0 * 1.0**2 / 3.0 / radius**2
    assert found["recoil"] == pytest.approx(STATIC * math.sqrt(3.0 * G / (stiffness * mass)), rel=1e-6)


def test_recoil_in_a_linkage():
    """Second formulation: the mass that moves along the guide of a slider-crank is 2 T/v^2 of the whole mechanism."""
    stiffness = 1e3
    crank = sd.slider_crank(crank=0.1, rod=0.3, gravity=G, angle=0.8)
    bodies = (dataclasses.replace(b, angular_velocity=1e-2) if b.name == "crank" else b for b in crank.bodies)
    law = {"kinetic": KINETIC, "static": STATIC, "stribeck_speed": 1e-3, "bristle_stiffness": stiffness, "bristle_damping": 0.0}
    friction = sd.GuideLuGre("guide", ("ground", "origin"), ("slider", "centre"), 0.0, **law)
    run = _brief(dataclasses.replace(crank, bodies=tuple(bodies), components=(friction,)))
    (found,) = _recoils(run)
    mass = 2.0 * float(run["kinetic_energy"][0]) / float(run["velocity"].sel(body="slider", axis="x")[0]) ** 2
    force = float(run["guide_lugre_reaction"][0, 0])
    assert found["recoil"] == pytest.approx(STATIC * math.sqrt(force / (stiffness * mass)), rel=1e-5)


def test_advised_stiffness_holds():
    """Limit: soft bristles lose a load between both coefficients that begins suddenly, those of the advice hold it."""
    slope = 0.5 * (KINETIC + STATIC)
    soft = sd.simulate(_block(0.1 * LIMIT, slope), until=2.0, samples=201)
    (found,) = _recoils(soft)
    stiff = sd.simulate(_block(found["stiffer"], slope), until=2.0, samples=201)
    assert not _recoils(stiff)
    assert float(abs(stiff["velocity"].values[-1]).max()) < 1e-9
    assert float(abs(soft["velocity"].values[-1]).max()) > 50.0 * STRIBECK


@pytest.mark.parametrize(("friction", "speed"), [({"static": 0.0}, 0.0), ({"static": KINETIC}, 0.0), ({}, 3.0 * STRIBECK)])
def test_no_warning_where_static_friction_does_not_act(friction, speed):
    """Contract: equal coefficients and a block that slides have nothing to lose."""
    assert not _recoils(_brief(_block(0.1 * LIMIT, speed=speed, **friction)))


def test_check_warns(tmp_path, capsys):
    """Contract: `check` gives the warning of the run before it."""
    case = tmp_path / "case.toml"
    case.write_text(sd.case_text(_block(0.25 * LIMIT)))
    assert status_of(["check", str(case)]) == 0
    printed = " ".join(capsys.readouterr().out.split())
    assert "Warning: guide friction 'floor': bristles recoil at 0.02 m/s (t = 0 s), faster than the Stribeck speed" in printed
