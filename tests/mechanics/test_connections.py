"""Massless rods, prescribed distances, latches, end stops and static equilibrium, by closed forms and second formulations."""

import dataclasses
import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from tests.build import momenta, warnings_of

import scissordyn as sd

TIGHT = {"rtol": 1e-11, "atol": 1e-11, "samples": 201}  # Options of `simulate` for accurate runs
METHODS = ("dop853", "rodas5p")  # An explicit method and a stiff one
PIN = sd.Revolute("pin", ("rod", "start"), ("ground", "origin"))  # Pin of the rod at the origin
GROUND = (("origin", (0.0, 0.0)),)  # Ground with one point at the origin


def pendulum(angle=0.3, **parts):
    """Return a uniform bar of 2 kg and 1 m that rotates about a ground pin under gravity."""
    return sd.Mechanism((sd.bar("rod", length=1.0, mass=2.0, angle=angle),), joints=(PIN,), ground=GROUND, **parts)


def paper(**clearance):
    """Return the paper's array with clearance at joint A, driven at 150 rpm."""
    return sd.scissor(units=2).with_clearance("A", sd.Clearance(0.5e-3, **clearance)).driven(speed=sd.rpm(150))


def worst_residual(run):
    """Return the largest energy residual relative to the change of kinetic energy."""
    return float(np.max(np.abs(run["energy_residual"]))) / float(np.ptp(run["kinetic_energy"].values))


@pytest.mark.parametrize("method", METHODS)
def test_pendulum_of_varying_length(method):
    """Second formulation: a mass on a rod of prescribed length, in polar coordinates."""
    mass = dataclasses.replace(sd.point_mass("p", mass=2.0), position=(1.0, 0.0))
    cord = sd.Rod("cord", ("ground", "origin"), ("p", "centre"), motion=sd.Harmonic(1.0, 0.2, 5.0))
    run = sd.simulate(sd.Mechanism((mass,), ground=GROUND, rods=(cord,)), until=3.0, method=method, **TIGHT)

    def length(t):
        return 1.0 + 0.2 * np.sin(5.0 * t), np.cos(5.0 * t), -5.0 * np.sin(5.0 * t)

    def polar(t, state):
        l, rate, _ = length(t)
        return state[1], (-9.81 * math.cos(state[0]) - 2.0 * rate * state[1]) / l

    exact = solve_ivp(polar, (0.0, 3.0), (0.0, 0.0), method="DOP853", rtol=1e-12, atol=1e-12, t_eval=run["time"].values).y
    l, _, bend = length(run["time"].values)
    place = l * np.array([np.cos(exact[0]), np.sin(exact[0])])
    assert np.allclose(run["position"].sel(body="p"), place.T, atol=2e-8)
    tension = 2.0 * (l * exact[1] ** 2 - bend - 9.81 * np.sin(exact[0]))
    assert np.allclose(run["rod_force"].isel(rod=0), tension, atol=1e-5)
    assert np.allclose(run["rod_length"].isel(rod=0), l, atol=1e-12)
    assert worst_residual(run) < 1e-8


def test_rod_is_a_bar_without_mass():
    """Limit: in a double pendulum a rod moves and pulls as an upper bar of one microgram."""
    bob = sd.Body("bob", mass=1.0, inertia=0.1, points={"top": (0.0, 0.0)}, centre=(0.4, 0.0), position=(0.6, 0.0), angle=-1.0)
    rod = sd.Rod("rope", ("ground", "origin"), ("bob", "top"))
    run = sd.simulate(sd.Mechanism((bob,), ground=GROUND, rods=(rod,)), until=0.8, **TIGHT)
    rod = sd.bar("rod", length=0.6, mass=1e-9)
    pins = (PIN, sd.Revolute("low", ("bob", "top"), ("rod", "end")))
    heavy = sd.simulate(sd.Mechanism((rod, bob), joints=pins, ground=GROUND), until=0.8, **TIGHT)
    assert np.allclose(run["position"].sel(body="bob"), heavy["position"].sel(body="bob"), atol=1e-7)
    pull = heavy["reaction"].sel(joint="low").values
    assert np.allclose(run["rod_force"].isel(rod=0), np.hypot(*pull.T), rtol=1e-5)


def test_jack_lifts_an_array():
    """Closed form: a jack across one unit prescribes its angle; its work is the gain of potential energy."""
    arm = sd.scissor(units=2, bar_length=1.0, bar_mass=1.0, slider_mass=1.0, angle=0.5)
    jack = sd.Rod("jack", ("ground", "origin"), ("slider", "centre"), motion=sd.Cycloidal(math.sin(0.5), math.sin(0.9), 0.5))
    run = sd.simulate(dataclasses.replace(arm, rods=(jack,)), until=0.5, **TIGHT)
    assert run.attrs["status"] == "complete"
    assert run["angle"].sel(body="unit 1/bar 1").values[-1] == pytest.approx(0.9, abs=1e-9)
    assert run["drive_work"].values[-1] == pytest.approx(
        float(run["potential_energy"][-1] - run["potential_energy"][0]), rel=1e-9
    )


@pytest.mark.parametrize("method", METHODS)
def test_latch_is_a_plastic_impact(method):
    """Closed form: speed at the latch after the fall, complete loss of kinetic energy, and the torque on the locked bar."""
    run = sd.simulate(pendulum(latches=(sd.Latch("catch", "rod", angle=-0.5),)), until=1.0, method=method, **TIGHT)
    inertia, weight = 2.0 / 3.0, 2.0 * 9.81 * 0.5
    fallen = weight * (math.sin(0.3) + math.sin(0.5))
    spin = math.sqrt(2.0 * fallen / inertia)
    assert run["event_speed"].values == pytest.approx([spin], rel=1e-9)
    assert run["event_loss"].values == pytest.approx([fallen], rel=1e-9)
    assert list(run["event_kind"].values) == ["locked"]
    locked = run["time"].values > run["event_time"].values[0]
    assert np.allclose(run["angle"].values[locked], -0.5, atol=1e-12)
    assert np.allclose(run["latch_torque"].values[locked], weight * math.cos(0.5), rtol=1e-10)
    assert np.allclose(run["latch_torque"].values[~locked], 0.0)
    assert np.allclose(run["reaction"].values[locked, 0], [0.0, 2.0 * 9.81], atol=1e-9)
    assert worst_residual(run) < 1e-8


def test_latch_between_free_bars_keeps_momentum():
    """Identity: two free bars that lock together keep linear and angular momentum; the latch accounts for the lost energy."""
    one = sd.Body("one", mass=1.0, inertia=0.1, points={"pin": (0.5, 0.0)}, centre=(0.1, 0.05), angular_velocity=2.0)
    other = sd.Body(
        "other",
        mass=2.0,
        inertia=0.3,
        points={"pin": (-0.4, 0.1)},
        centre=(0.2, 0.0),
        position=(0.9, -0.1),
        angular_velocity=-1.0,
    )
    pins = (sd.Revolute("hinge", ("one", "pin"), ("other", "pin")),)
    free = sd.Mechanism((one, other), joints=pins, gravity=0.0, latches=(sd.Latch("catch", "one", base="other", angle=0.6),))
    run = sd.simulate(free, until=0.5, **TIGHT)
    linear, angular = momenta(run, free)
    assert run["event_time"].size == 1
    assert np.allclose(linear, linear[0], atol=1e-11)
    assert np.allclose(angular, angular[0], atol=1e-11)
    after = run.isel(time=-1)
    assert float(after["angular_velocity"][0] - after["angular_velocity"][1]) == pytest.approx(0.0, abs=1e-10)
    assert float(run["kinetic_energy"][0] - after["kinetic_energy"]) == pytest.approx(float(after["switching_loss"]), rel=1e-9)


@pytest.mark.parametrize("method", METHODS)
def test_angle_stop_returns_its_restitution(method):
    """Closed form: the stop's damping factor obeys ln[(1+xi)/(1-xi e)] = xi (1+e) without other forces, docs/theory (D1)."""
    rod = dataclasses.replace(sd.bar("rod", length=1.0, mass=2.0), angular_velocity=3.0)
    stop = sd.AngleStop("stop", "rod", angle=0.4, stiffness=1e5, restitution=0.6)
    run = sd.simulate(
        sd.Mechanism((rod,), joints=(PIN,), ground=GROUND, gravity=0.0, components=(stop,)), until=0.3, method=method, **TIGHT
    )
    assert list(run["event_kind"].values) == ["reached", "left"]
    xi = 8.0 * (1.0 - 0.6) / (5.0 * 0.6)
    out = brentq(lambda e: math.log((1.0 + xi) / (1.0 - xi * e)) - xi * (1.0 + e), 1e-6, min(1.0, 0.999999 / xi))
    assert run["event_speed"].values == pytest.approx([3.0, -3.0 * out], rel=1e-8)
    assert run["event_time"].values[0] == pytest.approx(0.4 / 3.0, rel=1e-10)
    assert float(run["damper_loss"][-1]) == pytest.approx(0.5 * 2.0 / 3.0 * 9.0 * (1.0 - out * out), rel=1e-6)
    assert worst_residual(run) < 1e-7


@pytest.mark.parametrize("method", METHODS)
def test_travel_stop_without_loss_reverses(method):
    """Closed form: a mass that falls on an elastic stop rebounds with its speed; the deepest point follows from energy."""
    mass = dataclasses.replace(sd.point_mass("p", mass=2.0), position=(0.3, 1.0))
    buffer = sd.TravelStop("buffer", ("p", "centre"), direction=-math.pi / 2, limit=-0.5, stiffness=1e6, restitution=1.0)
    run = sd.simulate(sd.Mechanism((mass,), components=(buffer,)), until=1.2, method=method, **TIGHT)
    fall = math.sqrt(2.0 * 0.5 / 9.81)
    assert run["event_time"].values[0] == pytest.approx(fall, rel=1e-9)
    assert run["event_speed"].values[:2] == pytest.approx([9.81 * fall, -9.81 * fall], rel=1e-7)
    deepest = brentq(lambda depth: 1e6 * depth**2.5 / 2.5 - 2.0 * 9.81 * (0.5 + depth), 1e-6, 0.1)
    lowest = -0.5 - deepest
    assert lowest < float(run["position"][:, 0, 1].min()) + 1e-3
    assert float(run["position"][:, 0, 1].min()) > lowest - 1e-9
    assert worst_residual(run) < 1e-8


@pytest.mark.parametrize("units", [2, 18])
def test_equilibrium_in_clearance_joints(units):
    """Contract: from static equilibrium nothing moves, and joints carry nearly the reactions of the ideal array."""
    mechanism = sd.scissor(units=units).with_clearance("all", sd.Clearance(0.1e-3)).driven(sd.Polynomial((sd.degrees(30),)))
    assert len(mechanism.clearance_joints) == 3 * units
    run = sd.simulate(mechanism, until=0.02, start="static", samples=11)
    assert float(np.max(np.abs(run["velocity"]))) < 1e-8
    ideal = sd.simulate(mechanism.ideal(), until=0.02, start="static", samples=11)["reaction"].isel(time=0)
    force = np.hypot(*ideal.values.T)
    touching = run["in_contact"].values[0]
    assert touching.sum() >= 6
    assert np.allclose(run["normal_force"].values[0, touching], force[touching], rtol=0.01)


@pytest.mark.parametrize(("mass", "stiffness", "gravity"), [(2.0, 1e-2, 9.81), (2.0, 1e6, 9.81), (1e-6, 1.0, 0.0)])
@pytest.mark.parametrize("place", [0.3, 0.5])
def test_equilibrium_on_a_horizontal_guide(mass, stiffness, gravity, place):
    """Closed form: the guide carries the weight, the spring has its free length, and the run has no energy warning.

    Forces are balanced up to a billionth of the weight: 2e-8 N over the spring's stiffness.
    """
    coil = sd.Spring("coil", ("ground", "O"), ("block", "centre"), stiffness=stiffness, free_length=0.3)
    mechanism = sd.Mechanism(
        bodies=(sd.point_mass("block", mass=mass, position=(place, 0.0)),),
        ground=(("O", (0.0, 0.0)),),
        joints=(),
        guides=(sd.Guide("rail", ("block", "centre")),),
        components=(coil,),
        gravity=gravity,
    )
    run = sd.simulate(mechanism, until=0.1, start="static", samples=3)
    assert float(np.max(np.abs(run["position"].values[:, 0, 0] - 0.3))) < 1e-9 * 0.3 + 3e-8 / stiffness * (gravity > 0.0)
    assert "energy balance" not in run.attrs["warnings"]


def test_free_mass_rests_on_a_horizontal_guide():
    """Contract: where every position is an equilibrium the start keeps the given one."""
    block = sd.point_mass("block", mass=2.0, position=(0.5, 0.0))
    mechanism = sd.Mechanism((block,), ground=(), joints=(), guides=(sd.Guide("rail", ("block", "centre")),), gravity=9.81)
    run = sd.simulate(mechanism, until=0.1, start="static", samples=3)
    assert np.allclose(run["position"].values[:, 0], [0.5, 0.0], rtol=0.0, atol=1e-15)


def test_constrained_contact_published_figures():
    """Published numbers (docs/reference.md): force from 3256.9 to 7542.2 N and torque from 4528.6 to 9021.4 N m over 50 ms."""
    run = sd.simulate(sd.constrain_contact(paper()), until=0.05, samples=5001)
    force, torque = run["rod_force"].isel(rod=0), run["drive_torque"]
    assert [float(force.min()), float(force.max())] == pytest.approx([3256.9, 7542.2], rel=1e-4)
    assert [float(torque.min()), float(torque.max())] == pytest.approx([4528.6, 9021.4], rel=1e-4)
    assert warnings_of(run) == []
    assert worst_residual(run) < 1e-6


def test_constrained_contact_warns_of_negative_force():
    """Contract: from -90 degrees the contact would pull (docs/reference.md); the warning names joint and time."""
    run = sd.simulate(sd.constrain_contact(paper(), direction=-math.pi / 2), until=0.05)
    assert float(run["rod_force"].min()) < 0.0
    (sentence,) = warnings_of(run)
    assert "joint 'A': negative normal force from t = " in sentence


def test_constrained_contact_at_an_indentation():
    """Identity: an indentation has the same effect as a wider clearance."""
    forces = [sd.simulate(sd.constrain_contact(paper(), indentation=d), until=0.01)["rod_force"].values for d in (2e-4, 0.0)]
    wider = sd.constrain_contact(paper().replace("A.clearance", 0.5e-3 + 2e-4))
    np.testing.assert_allclose(forces[0], sd.simulate(wider, until=0.01)["rod_force"].values, rtol=1e-9)
    assert np.max(np.abs(forces[0] - forces[1])) > 1e-6 * np.max(forces[1])


def test_constrained_contact_is_the_limit_of_stiff_contact():
    """Limit: a clearance joint that starts in contact approaches the constrained force with ten times stiffer material."""
    constrained = sd.simulate(sd.constrain_contact(paper()), until=0.02)["rod_force"].isel(rod=0).values
    gaps = []
    for modulus in (207e9, 2070e9):
        material = sd.Material("stiff", modulus, 0.3, 7800.0)
        run = sd.simulate(paper(material=material), until=0.02, start="in-contact")
        gaps.append(np.sqrt(np.mean((run["normal_force"].sel(joint="A").values - constrained) ** 2)))
    assert gaps[0] < 0.2 * float(np.mean(constrained))
    assert gaps[1] < 0.5 * gaps[0]


@pytest.mark.parametrize("method", METHODS)
def test_driven_mechanism_without_freedom(method):
    """Closed form: the angles of a driven N-four-bar follow its drive; the torque balances weight and inertia."""
    run = sd.simulate(sd.n_four_bar(2).driven(speed=2.0), until=1.0, method=method)
    th = float(run["angle"][0, 0]) + 2.0 * run["time"].values
    assert np.allclose(run["angle"].values[:, :3], th[:, None], atol=1e-12)
    assert np.allclose(run["drive_torque"], (3 / 2 + 2) * 9.81 * np.cos(th), atol=1e-9)
    assert np.max(np.abs(run["energy_residual"])) < 1e-9


def test_rod_within_a_body_is_refused():
    """Contract: the error names the rod and the body."""
    with pytest.raises(sd.InputError, match="rod 'rope' acts between body 'rod' and itself"):
        sd.Rod("rope", ("rod", "end"), ("rod", "start"))


def test_latch_at_its_angle_is_refused():
    """Contract: a latch may not start at its locking angle."""
    with pytest.raises(sd.InputError, match="latch 'catch' is at its angle at the start"):
        sd.simulate(pendulum(latches=(sd.Latch("catch", "rod", angle=0.3),)), until=0.1)


def test_more_contacts_at_the_start_than_the_log_has_room_for():
    """Contract: an array of 100 units starts in contact in all its pins; the event log grows."""
    arm = sd.scissor(units=100, bar_length=0.5, bar_mass=0.1, slider_mass=0.1, angle=sd.degrees(60))
    resting = arm.with_clearance("all", sd.Clearance(1e-4)).driven(sd.Polynomial((sd.degrees(60),)))
    run = sd.simulate(resting, until=1e-6, start="in-contact", samples=2)
    assert run.attrs["status"] == "complete"
    assert int(run["in_contact"].values[0].sum()) > 256


def test_warning_of_an_assembly_that_rotates_a_body():
    """Contract: a rocker placed at 124 deg is assembled at 89.66 deg, and a warning gives both angles."""
    linkage = sd.four_bar(angle=math.radians(60.0))
    placed = (dataclasses.replace(b, angle=math.radians(124.0)) if b.name == "rocker" else b for b in linkage.bodies)
    far = dataclasses.replace(linkage, bodies=tuple(placed)).driven(speed=1.0)
    run = sd.simulate(far, until=0.01, samples=3)
    angle = math.degrees(float(run["angle"].sel(body="rocker")[0]))
    said = f"body 'rocker' is rotated by {124.0 - angle:.4g} deg: it starts at {angle:.4g} deg instead of 124 deg"
    assert said in run.attrs["warnings"]
    assert "assemble" not in sd.simulate(linkage.driven(speed=1.0), until=0.01, samples=3).attrs["warnings"]


def test_warning_of_an_assembly_that_moves_a_body():
    """Contract: a slider placed 30 mm off its guide is moved by 30 mm, and a warning says so."""
    mechanism = sd.slider_crank().driven(speed=1.0)
    placed = next(body for body in mechanism.bodies if body.name == "slider")
    there = dataclasses.replace(placed, position=(placed.position[0], placed.position[1] + 0.03))
    off = dataclasses.replace(mechanism, bodies=tuple(there if body is placed else body for body in mechanism.bodies))
    said = sd.simulate(off, until=0.01, samples=3).attrs["warnings"]
    assert "body 'slider' is moved by 30 mm: its origin starts at 0.17, 0 m instead of 0.17, 0.03 m" in said


def test_thrown_journal():
    """Closed form: without gravity a journal thrown at 0.3 m/s reaches its bearing, 0.2 mm away, after 0.67 ms.

    The default start of the ideal mechanism drops the given velocity, with a warning.
    """
    array = sd.scissor(gravity=0.0).with_clearance("A", sd.Clearance(2e-4))
    thrown = (dataclasses.replace(b, velocity=(0.0, 0.3)) if b.name == "slider" else b for b in array.bodies)
    array = dataclasses.replace(array, bodies=tuple(thrown)).driven(speed=0.0)
    run = sd.simulate(array, until=1e-3, samples=3, start="as-placed")
    assert float(run["contact_start"][0]) == pytest.approx(2e-4 / 0.3, rel=1e-6)
    assert float(run["approach_speed"][0]) == pytest.approx(0.3, rel=1e-6)
    dropped = sd.simulate(array, until=1e-3, samples=3)
    assert "the origin of body 'slider' starts at 0, 0 m/s instead of 0, 0.3 m/s" in dropped.attrs["warnings"]
