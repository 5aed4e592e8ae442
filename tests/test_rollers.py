"""Rollers along a bar that bends: static and moving loads against closed forms, derivatives, energy, clearance."""

import math

import numpy as np
import pytest
from tests.build import assert_balance, warnings_of

import scissordyn as sd
from reference.kernels import at_start, check_element_slopes
from scissordyn.plan.plan import plan

# Length [m], mass [kg], bending stiffness EI [N m^2] and axial stiffness EA [N] of a beam
LENGTH, MASS, RIGIDITY, AXIAL = 2.0, 5.68, 2252.0, 7.5e7


def beam(car, *, gravity=9.81, modes=8, parts=None, **roller):
    """Return a bar on two supports, and a car on it."""
    made = sd.Mechanism(
        (sd.bar("beam", length=LENGTH, mass=MASS), car),
        (sd.Revolute("O", ("beam", "start"), ("ground", "O")),),
        ground=(("O", (0.0, 0.0)), ("far", (-50.0, 0.0))),
        gravity=gravity,
        guides=(sd.Guide("end", ("beam", "end")),),
        components=(sd.Roller("wheel", (car.name, next(iter(car.points))), "beam", **roller),),
    )
    parts = parts or {}
    made = made.with_parts({**parts, "guides": (*made.guides, *parts.get("guides", ()))})
    return sd.with_bending(made, "beam", bending_stiffness=RIGIDITY, axial_stiffness=AXIAL, modes=modes)


@pytest.mark.parametrize("at", [0.3, 0.7, 1.6])
def test_a_load_that_stands_on_a_bar(at):
    """Closed form: P a^2 b^2/(3 EI L) and the sag under the bar's weight, P b/L + q L/2 at the support; more modes, nearer."""
    mass, stiffness, rest = 3.0, 1e6, LENGTH - at
    load, weight = mass * 9.81, MASS * 9.81 / LENGTH
    lift = sd.Guide("lift", ("car", "centre"), through=(at, 0.0), direction=0.5 * math.pi)
    sag = load * (at * rest) ** 2 / (3.0 * RIGIDITY * LENGTH)
    sag += weight * at * (LENGTH**3 - 2.0 * LENGTH * at**2 + at**3) / (24.0 * RIGIDITY)
    errors = []
    for modes in (8, 16):
        car = sd.point_mass("car", mass=mass, position=(at, 0.0))
        made = beam(car, modes=modes, stiffness=stiffness, parts={"guides": (lift,)})
        run = sd.simulate(made, until=1e-4, samples=2, start="static").isel(time=0)
        errors.append(abs((-float(run["position"].sel(body="car", axis="y")) - load / stiffness) / sag - 1.0))
        assert float(run["roller_force"][0]) == pytest.approx(load, rel=3e-5)
        assert float(run["roller_gap"][0]) == pytest.approx(-load / stiffness, rel=3e-5)
        assert float(run["roller_place"][0]) == pytest.approx(at, abs=2e-5)
        assert float(run["reaction"].sel(joint="O", axis="y")) == pytest.approx(
            load * rest / LENGTH + 0.5 * weight * LENGTH, rel=2e-5
        )
    assert errors[1] < 0.6 * errors[0] < 3e-4


def test_a_load_that_moves_along_a_bar():
    """Closed form: the modal series of a constant force that crosses a simply supported bar at a constant speed."""
    force, speed = 40.0, 12.0
    car = sd.Body("car", 1e-4, None, {"centre": (0.0, 0.0)}, velocity=(speed, 0.0))
    push = sd.Force("load", ("car", "centre"), (0.0, -force))
    rod = sd.Rod("pull", ("ground", "far"), ("car", "centre"), motion=sd.Polynomial((50.0, speed)))
    made = beam(car, gravity=0.0, stiffness=1e5, damping=5.0)
    made = made.with_parts({"components": (*made.components, push), "rods": (rod,)})
    length = 0.9 * LENGTH / speed
    run = sd.simulate(made, until=length, samples=31, method="rodas5p", start="as-placed")
    time, n = run["time"].values, np.arange(1, 40)[:, None]
    omega, drive = (n * math.pi / LENGTH) ** 2 * math.sqrt(RIGIDITY * LENGTH / MASS), n * math.pi * speed / LENGTH
    terms = np.sin(0.5 * n * math.pi) * (np.sin(drive * time) - drive / omega * np.sin(omega * time)) / (omega**2 - drive**2)
    expected = 2.0 * force / MASS * terms.sum(axis=0)
    found = -run["position"].sel(body="beam/1", axis="y").values
    assert float(run["roller_place"][-1, 0]) == pytest.approx(0.9 * LENGTH, rel=1e-3)
    assert found == pytest.approx(expected, abs=2e-3 * float(np.abs(expected).max()))


def block(**roller):
    """Return a block on two wheels that slides along a bar that turns and bends, damped and heavy."""
    car = sd.Body("car", 2.0, 0.05, {"front": (0.1, 0.0), "rear": (-0.1, 0.0)}, position=(0.6, 0.0), velocity=(6.0, 0.0))
    made = sd.Mechanism(
        (sd.bar("arm", length=LENGTH, mass=MASS), car),
        (sd.Revolute("O", ("arm", "start"), ("ground", "O")),),
        ground=(("O", (0.0, 0.0)),),
        input_body="arm",
        components=(sd.Roller("front", ("car", "front"), "arm", **roller), sd.Roller("rear", ("car", "rear"), "arm", **roller)),
    )
    return sd.with_bending(made, "arm", bending_stiffness=RIGIDITY, axial_stiffness=AXIAL, modes=4).driven(speed=2.0)


def test_the_analytic_derivatives_are_those_of_the_forces():
    """Identity, by differences: by position and rate, at a bent position off the axis, inside a span and beyond the end."""
    made = block(stiffness=3e4, damping=40.0)
    coordinates, (system, start) = plan(made).coordinates, at_start(made)
    n, random = coordinates.free, np.random.default_rng(2)
    for shift in (0.0, 1.0, 1.4):  # the front wheel inside, the rear one too; at last both are beyond the end
        y, natural = start.copy(), coordinates.placed[0].copy()
        natural[coordinates.natural.offsets["car"]] += shift
        y[:n] = coordinates.nearest(np.array([1.0, 1.0, 0.0]), natural) + 1e-2 * random.standard_normal(n)
        y[n : 2 * n] += random.standard_normal(n)
        check_element_slopes(system, y, linear=True)


@pytest.mark.parametrize("roller", [{"stiffness": 1e5, "damping": 20.0}, {"stiffness": 1e6, "clearance": 5e-4}])
@pytest.mark.parametrize("method", ["dop853", "rodas5p"])
def test_a_block_on_an_arm_keeps_the_balance_of_energy(method, roller):
    """Contract: rollers and a guide with clearance, whose impacts are events; the block leaves the arm, which is said."""
    run = sd.simulate(block(**roller), until=0.35, samples=36, method=method)
    assert_balance(run, 1e-6, ("kinetic_energy",))
    assert float(np.abs(run["roller_gap"]).max()) < 6e-3
    assert (run["event_name"].size > 4) == ("clearance" in roller)
    beyond = float(run["roller_place"].max()) > LENGTH
    assert beyond == any("runs off" in warning for warning in warnings_of(run))
    assert beyond


def test_a_rigid_bar_carries_guides_and_no_rollers():
    """Bad input: one line, with what to type."""
    car, arm = sd.point_mass("car", mass=1.0, position=(0.5, 0.0)), sd.bar("arm", length=LENGTH, mass=MASS)
    free = sd.Mechanism((arm, car), (sd.Revolute("O", ("arm", "start"), ("ground", "O")),), ground=(("O", (0.0, 0.0)),))
    bars = {"bodies": "arm", "bending_stiffness": RIGIDITY, "axial_stiffness": AXIAL}
    with pytest.raises(sd.InputError, match=r"guide 'slot' is fixed to flexible bar 'arm'.* a roller that runs along it"):
        sd.with_bending(free.with_parts({"guides": (sd.Guide("slot", ("car", "centre"), body="arm"),)}), **bars)
    made = free.with_parts({"components": (sd.Roller("wheel", ("car", "centre"), "arm"),)})
    for rigid in (made, sd.with_bending(made, **bars, elements=2)):
        with pytest.raises(sd.InputError, match="runs along 'arm', which is not a flexible bar"):
            sd.simulate(rigid, until=1e-3)
