"""Statics of every mechanism of the zoo: virtual work along its stroke, and equilibrium of each of its bodies."""

import dataclasses
import math

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline
from tests.build import EXAMPLES, on_pin

import scissordyn as sd
from reference.balance import Balance
from reference.virtual_work import VirtualWork
from scissordyn.kinematics.closure import Inputs
from scissordyn.model.commanded import commanded
from scissordyn.plan.plan import plan

G = 9.81  # [m/s^2] gravitational acceleration


# Mechanisms of the zoo without a prescribed stroke
WITHOUT_STROKE = (
    "a01-pendulum",
    "a02-n-four-bar",
    "a03-squeezer",
    "press",
    "self-deploying",
    "tape-spring-hinge",
    "woodpecker",
)

# Number of positions, if 41 are too few for an integral over the stroke; walking legs step in a small part of a turn
POINTS = dict.fromkeys(("clearance-guide", "flores-slider-crank", "four-bar", "train-pantograph"), 81)
POINTS |= {"jansen": 161, "klann": 161}


LOADED = {
    "hoberman-ring": ("unit 12/bar 2", (0.0, 31.0)),  # bars move along the radius
    "rack-with-backlash": ("rack", (31.0, 0.0)),
}
"""Body and force that do work, for mechanisms in which the usual force, along x on the last body, does none."""


def along_stroke(mechanism, until):
    """Return the ideal mechanism whose inputs move evenly, in a second, to their farthest value, one turn at most."""
    mechanism = commanded(mechanism).ideal()
    inputs = Inputs(plan(mechanism))
    values, motions = inputs.over(np.linspace(0.0, until, 401)), []
    for (first, *_), stroke, unit in zip(values.T, (values - values[0]).T, inputs.units, strict=True):
        far = float(stroke[np.argmax(np.abs(stroke))])
        motions.append(
            sd.Polynomial((float(first), math.copysign(min(abs(far), 2.0 * math.pi), far) if unit == "rad" else far))
        )
    pending = iter(motions)
    drives = [dataclasses.replace(drive, motion=next(pending)) for drive in mechanism.drives]
    rods = tuple(dataclasses.replace(rod, motion=next(pending)) if rod.motion else rod for rod in mechanism.rods)
    drives += [dataclasses.replace(drive, motion=next(pending)) for drive in mechanism.coordinate_drives]
    return dataclasses.replace(mechanism, drives=tuple(drives), coordinate_drives=(), rods=rods)


def loaded(mechanism, name, force):
    """Return the mechanism with a force at a body and, if it has none, gravity."""
    body = mechanism.body(name)
    point = max(body.points, key=lambda name: math.hypot(*body.points[name]))
    load = sd.Force("extra load", (body.name, point), force=force)
    changed = dataclasses.replace(mechanism, components=(*mechanism.components, load))
    return changed if mechanism.gravity else dataclasses.replace(changed, gravity=G, gravity_direction=0.0)


def test_mechanisms_without_a_stroke():
    """Contract: statics refuses the mechanisms of the zoo without prescribed motion, and no others."""
    for name in WITHOUT_STROKE:
        with pytest.raises(sd.InputError, match="without stroke: it has no drive, servo, driven rod or driven coordinate"):
            sd.statics(sd.zoo[name].mechanism, until=1.0)
    assert set(WITHOUT_STROKE) < set(sd.zoo)


@pytest.mark.parametrize("name", [name for name in sd.zoo if name not in WITHOUT_STROKE])
def test_mechanisms_of_the_zoo(name):
    """Identity: drives do the work of the loads (to 1e-7), and each body is in equilibrium (1e-11 of the largest force)."""
    mechanism = along_stroke(sd.zoo[name].mechanism, sd.zoo[name].case.run.until)
    mechanism = loaded(mechanism, *LOADED.get(name, (mechanism.bodies[-1].name, (31.0, 0.0))))
    forces = sd.statics(mechanism, until=1.0, points=POINTS.get(name, 41))
    assert max(np.abs(forces[rate]).max() for rate in ("velocity", "angular_velocity")) == 0.0
    assert max(Balance(forces, mechanism).residual()) < 1e-11
    work = VirtualWork(forces, mechanism)
    assert work.largest > 1e-2
    assert work.imbalance() < 1e-7
    check_envelope(forces)


def check_envelope(forces):
    """Check that the smallest and largest values enclose the table and lie near it."""
    values = forces["quantity_value"].values
    scale = np.nanmax(np.abs(values))
    lost = np.isnan(values).any(axis=0)
    assert np.isnan(forces["largest"].values[lost]).all()
    for end, extreme, sign in (("largest", values.max(axis=0), 1.0), ("least", values.min(axis=0), -1.0)):
        beyond = sign * (forces[end].values - extreme)[~lost]
        assert beyond.min(initial=0.0) >= -1e-12 * scale
        assert beyond.max(initial=0.0) < 0.02 * scale


def sprung():
    """Return a slider-crank with springs of all kinds."""
    crank = dataclasses.replace(
        sd.slider_crank(crank=0.1, rod=0.3, gravity=G), ground=(("origin", (0.0, 0.0)), ("A", (0.0, 0.4)))
    )
    start, end = ("ground", "A"), ("rod", "end")
    springs = (
        sd.Spring("spring", start, end, stiffness=900.0, free_length=0.2),
        sd.NonlinearSpring("nonlinear", start, end, curve=((0.1, -50.0), (0.4, 20.0), (0.9, 400.0))),
        sd.GasSpring("gas", start, end, force=300.0, extended_length=0.7, stroke=0.5, progression=1.4),
        sd.TorsionSpring("torsion", "rod", base="crank", stiffness=5.0, free_angle=0.4),
        sd.Bushing("bushing", ("crank", "end"), ("slider", "centre"), stiffness_x=300.0, stiffness_y=500.0, free_angle=0.1),
        sd.StrokeLoad("cut", ("slider", "centre"), 0.0, ((0.1, -100.0), (0.3, -40.0), (0.5, -10.0))),
        sd.AngleLoad("wind", "crank", ((-1.0, 3.0), (2.0, -4.0), (4.0, 1.0))),
    )
    return dataclasses.replace(crank.driven(sd.Polynomial((0.2, 2.5))), components=springs)


def rubbed(sense):
    """Return a loaded slider-crank with friction in its pins, its guide and the seal of a gas spring."""
    crank = sd.slider_crank(crank=0.1, rod=0.3, gravity=G)
    parts = (
        sd.PinFriction("crank bearing", "crank", 0.02, 0.2),
        sd.PinFriction("crank pin", "rod", 0.015, 0.1, base="crank"),
        sd.GuideFriction("guide", ("ground", "origin"), ("slider", "centre"), 0.0, 0.15),
        sd.GasSpring("strut", ("ground", "origin"), ("slider", "centre"), 200.0, 0.6, 0.5, friction=25.0),
        sd.Force("cut", ("slider", "centre"), force=(-250.0, -40.0)),
    )
    return dataclasses.replace(crank.driven(sd.Polynomial((0.2, 2.5))), components=parts)


def test_springs_and_curves():
    """Identity: virtual work and equilibrium with springs of all kinds; reported energies are those of the work."""
    mechanism = sprung()
    forces = sd.statics(mechanism, until=1.0, points=41)
    assert max(Balance(forces, mechanism).residual()) < 1e-12
    work = VirtualWork(forces, mechanism)
    assert work.imbalance() < 1e-7
    stored = sum(forces[f"{kind}_energy"].values[:, 0] for kind in ("spring", "gas_spring", "torsion_spring", "bushing"))
    done = sum(work.work[name] for name in ("spring", "gas", "torsion", "bushing"))
    np.testing.assert_allclose(stored[0] - stored, done, atol=1e-6 * np.abs(done).max())


@pytest.mark.parametrize("sense", ["forward", "backward"])
def test_friction_up_and_down(sense):
    """Identity: virtual work and equilibrium with friction. Closed form: friction circle, Coulomb's law, force of a seal."""
    mechanism = rubbed(sense)
    forces = sd.statics(mechanism, until=1.0, points=41, friction=sense)
    assert max(Balance(forces, mechanism).residual()) < 1e-12
    assert not forces["angular_velocity"].values.any()
    work = VirtualWork(forces, mechanism)
    assert work.imbalance() < 1e-7
    sign = 1.0 if sense == "forward" else -1.0
    # friction takes from a drive that goes forward, and goes into one that comes back along the same positions
    for name in ("crank bearing", "crank pin", "guide"):
        assert np.all(sign * np.diff(work.work[name]) < 0.0)
    size = np.linalg.norm(forces["reaction"].transpose("joint", "time", "axis").values, axis=-1)
    sizes = dict(zip(forces["joint"].values.tolist(), size, strict=True))
    for name, pin, radius, friction in (("crank bearing", "ground pin", 0.02, 0.2), ("crank pin", "crank pin", 0.015, 0.1)):
        torque = np.abs(forces["pin_friction_torque"].sel(pin_friction=name).values)
        np.testing.assert_allclose(torque, radius * math.sin(math.atan(friction)) * sizes[pin], rtol=1e-9)
    along = np.abs(forces["guide_friction_force"].sel(axis="x").values[:, 0])
    np.testing.assert_allclose(along, 0.15 * sizes["guide"], rtol=1e-9)
    still = sd.statics(mechanism, until=1.0, points=41)
    seal = forces["gas_spring_force"].values[:, 0] - still["gas_spring_force"].values[:, 0]
    np.testing.assert_allclose(seal, sign * 25.0 * np.sign(np.gradient(forces["slider_position"].values)), rtol=1e-9)


def test_bars_that_bend():
    """Identity: virtual work with the energy of bars, equilibrium of cross-sections. Closed form: stress and elastic line."""
    case = sd.read_case(EXAMPLES / "lift_table.toml")
    mechanism = along_stroke(case.mechanism, case.run.until)
    forces = sd.statics(mechanism, until=1.0, points=21)
    assert max(Balance(forces, mechanism).residual()) < 1e-8
    assert VirtualWork(forces, mechanism).imbalance() < 1e-6
    # a tube 60x60x2 mm of steel
    place, half, modulus = np.linspace(0.0, 1.0, 2001), 0.03, 210e9
    area, inertia = 0.06**2 - 0.056**2, (0.06**4 - 0.056**4) / 12.0
    along = sd.internal_forces(forces, mechanism, places=place)
    normal, moment = along["axial_force"].values, along["bending_moment"].values
    stress = np.abs(normal) / area + np.abs(moment) * half / inertia
    np.testing.assert_allclose(stress.max(axis=(0, 2)), forces["bar_largest_stress"], rtol=1e-3)
    step = place[1]
    slope = np.cumsum((moment[..., 1:] + moment[..., :-1]) * 0.5 * step / (modulus * inertia), axis=-1)
    line = np.cumsum(np.concatenate([0.0 * slope[..., :1], slope], axis=-1) * step, axis=-1)
    line = line - line[..., -1:] * place
    np.testing.assert_allclose(np.abs(line).max(axis=(0, 2)), np.abs(forces["bar_largest_deflection"]), rtol=1e-3)
    for quantity in ("axial_force", "bending_moment"):
        largest = np.abs(along[quantity]).max(dim=("time", "place"))
        np.testing.assert_allclose(np.abs(forces[f"bar_largest_{quantity}"]), largest, rtol=2e-3)


@pytest.mark.parametrize("how", [{"modes": 3}, {"elements": 2}])
def test_scissors_that_bend(how):
    """Identity: virtual work of drive, weight and bars, by modes with their energy, by beam elements with their end forces."""
    rigid = sd.scissor(units=2, angle=0.5, gravity=G)
    mechanism = sd.with_bending(rigid, section="tube 20x20x1 mm", material="steel", mass="section", **how).driven(speed=0.5)
    forces = sd.statics(mechanism, until=1.0, points=41)
    work = VirtualWork(forces, mechanism)
    assert work.imbalance() < 1e-6
    assert float(np.abs(sum(work.work[name] for name in work.work if "bar" in name and "drive" not in name)).max()) > 1.0


@pytest.mark.parametrize("how", [{"modes": 4}, {"elements": 4}])
def test_thin_bar_over_a_turn(how):
    """Identity: the torque that turns a thin bar against its weight is the slope of the potential energy over the angle."""
    bar = sd.bar("bar", length=0.16, mass=12.8)
    thin = sd.with_bending(on_pin(bar, gravity=G), bending_stiffness=1.5, axial_stiffness=7.4e9, **how).driven(speed=1.0)
    forces = sd.statics(thin, until=2.0 * math.pi, points=41)
    angle, torque = forces["input"].values[:, 0], forces["drive_torque"].values
    energy = (forces["potential_energy"] + forces["stored_energy"]).values
    slope = make_interp_spline(angle, energy, k=5).derivative()(angle)
    inside = slice(10, -10)  # the spline is less accurate at its ends
    np.testing.assert_allclose(slope[inside], torque[inside], rtol=0.0, atol=1e-6 * float(np.max(np.abs(torque))))
    assert float(np.abs(forces["bar_largest_deflection"][0])) > 0.04 * 0.16
