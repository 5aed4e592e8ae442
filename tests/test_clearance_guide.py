"""A block in a channel: closed forms, a second formulation, and the limit of no clearance."""

import dataclasses
import math

import numpy as np
import pytest
from scipy.optimize import brentq

import scissordyn as sd
from reference.block import Block
from scissordyn.analysis.contact import flight_fractions
from scissordyn.laws import catalogue
from scissordyn.laws.damping.kelvin_voigt import KelvinVoigt
from scissordyn.laws.damping.none import NoDamping
from scissordyn.laws.elastic.linear import Linear
from scissordyn.laws.elastic.power_law import PowerLaw
from scissordyn.laws.friction.threlfall import Threlfall

# Length and width of a block, radius of its corners, and its clearance in the channel [m]
LENGTH, WIDTH, RADIUS, GAP = 0.1, 0.04, 2e-3, 1e-3
A, B = 0.5 * LENGTH - RADIUS, 0.5 * WIDTH - RADIUS  # Half distances of the corners' centres along and across the block [m]
MASS = 2.0  # [kg] mass of the block


def block(*, velocity=(0.0, 0.0), centre=(0.0, 0.0), components=(), gravity=0.0, **laws):
    """Return a block alone in a channel along x."""
    points = {"middle": (0.0, 0.0), "front": (0.02, 0.0), "centre": centre}
    body = sd.Body("block", MASS, 3e-3, points, centre=centre, velocity=velocity)
    guide = sd.Guide("channel", ("block", "middle"))
    one = sd.Mechanism((body,), guides=(guide,), components=components, gravity=gravity, output_body="block")
    return one.with_clearance("channel", sd.GuideClearance(GAP, LENGTH, WIDTH, corner_radius=RADIUS, **laws))


def corner(number):
    """Return the name of a corner in a run: 1 and 2 at the right guide surface, rear and front, 3 and 4 at the left one."""
    return f"channel/corner {number}"


def test_flying_to_and_fro():
    """Closed form: between frictionless linear surfaces t_n = t_1 + n (2c/v + pi/w), after a push ending before the first."""
    stiffness, push, lasting = 1e8, 40.0, 4e-3
    force = sd.Force("push", ("block", "centre"), (0.0, push), time_function=sd.Cycloidal(1.0, 0.0, lasting))
    run = sd.simulate(
        block(components=(force,), stiffness=Linear(stiffness), damping=NoDamping()), until=0.3, rtol=1e-11, atol=1e-11
    )
    speed = push * lasting / (2.0 * MASS)
    way = push / MASS * lasting**2 * (1.0 / 3.0 + 1.0 / (4.0 * math.pi**2))
    half_swing = math.pi / math.sqrt(2.0 * stiffness / MASS)
    first = lasting + (GAP - way) / speed
    starts = run["contact_start"].values.reshape(-1, 2)
    assert len(starts) > 4
    expected = first + np.arange(len(starts)) * (2.0 * GAP / speed + half_swing)
    np.testing.assert_allclose(starts, np.repeat(expected[:, None], 2, axis=1), rtol=1e-9)
    names = np.sort(run["contact_joint"].values.astype(str).reshape(-1, 2), axis=1)
    upper, lower = [corner(3), corner(4)], [corner(1), corner(2)]
    assert names.tolist() == [(upper, lower)[k % 2] for k in range(len(names))]
    np.testing.assert_allclose(run["contact_duration"].values[:4], half_swing, rtol=1e-7)
    np.testing.assert_allclose(run["approach_speed"].values, speed, rtol=1e-8)
    aside = run["eccentricity"].sel(joint=[corner(number) for number in range(1, 5)], axis="y").transpose("time", "joint")
    np.testing.assert_allclose(
        aside, np.repeat(run["position"].sel(body="block", axis="y").values[:, None], 4, axis=1), atol=1e-12
    )


def test_force_at_two_corners():
    """Closed form: a force beside the middle is distributed over two corners by their moment arms, with a tilt."""
    force, stiffness = 100.0, 1e6
    laws = {"stiffness": Linear(stiffness), "damping": KelvinVoigt(2e3)}
    run = sd.simulate(block(components=(sd.Force("load", ("block", "front"), (0.0, -force)),), **laws), until=0.2)
    tilt = 0.0
    for _ in range(20):
        front = force * (A + 0.02 - B * math.tan(tilt)) / (2.0 * A)
        tilt = -math.asin((2.0 * front - force) / (2.0 * A * stiffness))
    end = run.isel(time=-1)
    assert float(end["angle"].sel(body="block")) == pytest.approx(tilt, rel=1e-7)
    found = end["normal_force"].sel(joint=[corner(1), corner(2)]).values
    np.testing.assert_allclose(found, [force - front, front], rtol=1e-7)
    np.testing.assert_allclose(end["reaction"].sel(joint="channel"), [0.0, force], atol=1e-7 * force)


def test_tilting_until_it_jams():
    """Closed form: a torque rotates the block until opposite corners touch, a sin th + b cos th = b + c + delta."""
    torque, stiffness = 5.0, 1e6
    laws = {"stiffness": Linear(stiffness), "damping": KelvinVoigt(2e3)}
    run = sd.simulate(block(components=(sd.Torque("turn", "block", torque),), **laws), until=0.3)

    def missing(th):
        force = torque / (2.0 * (A * math.cos(th) - B * math.sin(th)))
        return A * math.sin(th) + B * math.cos(th) - B - GAP - force / stiffness

    end = run.isel(time=-1)
    assert abs(float(end["angular_velocity"].sel(body="block"))) < 1e-8
    assert float(end["angle"].sel(body="block")) == pytest.approx(brentq(missing, 0.0, 0.5, xtol=1e-15), rel=1e-9)
    touching = end["in_contact"].sel(joint=[corner(k) for k in (1, 2, 3, 4)]).values
    assert touching.tolist() == [True, False, True, False]


def test_against_a_block_in_x_y_and_angle():
    """Cross-check by a second formulation: starts and approach speeds of twenty contacts of a block with friction."""
    centre, mu, ramp = (0.01, -0.004), 0.1, 1e-2
    damping = sd.LankaraniNikravesh(0.7)
    described = block(
        velocity=(0.5, 0.0),
        centre=centre,
        gravity=9.81,
        components=(sd.Force("load", ("block", "centre"), (-3.0, 5.0)),),
        stiffness=PowerLaw(1e9, 1.5),
        damping=damping,
        friction=Threlfall(mu, ramp),
        reference="onset",
    )
    run = sd.simulate(described, until=0.2, rtol=1e-11, atol=1e-11, method="dop853")
    second = Block(
        mass=MASS,
        inertia=3e-3,
        centre=centre,
        half_length=A,
        half_width=B,
        radius=RADIUS,
        clearance=GAP,
        coefficient=1e9,
        exponent=1.5,
        damping=damping.factor,
        friction=mu,
        ramp_speed=ramp,
        load=(-3.0, 5.0 - 9.81 * MASS),
    )
    found, end = second.contacts(np.array([*centre, 0.0, 0.5, 0.0, 0.0]), 0.2)
    assert len(found) >= 20
    assert {k for k, _, _ in found} == {0, 1}
    assert run["contact_joint"].values.astype(str).tolist() == [corner(k + 1) for k, _, _ in found]
    np.testing.assert_allclose(run["contact_start"], [t for _, t, _ in found], rtol=1e-7)
    np.testing.assert_allclose(run["approach_speed"], [v for _, _, v in found], rtol=1e-6)
    np.testing.assert_allclose(run["position"].sel(body="block").values[-1], end[:2], atol=1e-9)
    assert float(run["angle"].values[-1, 0]) == pytest.approx(end[2], abs=1e-8)


def test_mechanism_with_a_clearance_guide_and_a_clearance_joint():
    """Identity: the energy balance of a slider-crank with impacts and friction in both places closes to the tolerance."""
    linkage = sd.slider_crank(slider_inertia=2e-5, gravity=9.81).driven(speed=sd.rpm(600))
    linkage = linkage.with_clearance("slider pin", sd.Clearance(0.2e-3, friction=Threlfall(0.05)))
    linkage = linkage.with_clearance("guide", sd.GuideClearance(0.1e-3, 0.04, 0.02, friction=Threlfall(0.1)))
    run = sd.simulate(linkage, until=0.1)
    assert run.attrs["status"] == "complete"
    touched = set(run["contact_joint"].values.astype(str))
    assert touched == {"slider pin", *(f"guide/corner {k}" for k in (1, 2, 3, 4))}
    turnover = np.max(run["kinetic_energy"].values) + run["dissipated_energy"].values[-1]
    assert run["friction_loss"].values[-1] > 1e-3 * turnover
    assert np.max(np.abs(run["energy_residual"].values)) < 1e-6 * turnover


def test_cycles_know_how_long_any_corner_touches():
    """Second road: the free flight of a guide from the cycles of a run, and from the contacts of one run over all of them."""
    linkage = sd.slider_crank(slider_inertia=2e-5, gravity=9.81).driven(speed=sd.rpm(600))
    linkage = linkage.with_clearance("slider pin", sd.Clearance(0.2e-3))
    linkage = linkage.with_clearance("guide", sd.GuideClearance(0.1e-3, 0.04, 0.02))
    cycles = sd.cycle(linkage, cycles=4, rtol=1e-10)
    united = cycles["united_contact_fraction"].values
    # later cycles of the two runs differ, because the motion is irregular
    run = sd.simulate(linkage, until=0.1, samples=5, rtol=1e-10)
    wanted = 1.0 - np.array(list(flight_fractions(run, 0.0, 0.1).values()))
    assert united[0] == pytest.approx(wanted[[0, 1, 1, 1, 1]], rel=1e-5)
    assert np.all(united[:, 1] > cycles["contact_fraction"].values[:, 1:].max(axis=1))
    flight = float(np.max(1.0 - united[2:].mean(axis=0)))
    assert sd.classify(cycles).measures["flight_fraction"] == pytest.approx(flight, rel=1e-12)


def test_without_gap_it_is_the_ideal_guide():
    """Limit: the distance from the ideal mechanism's slider decreases with the clearance; its guide force agrees on average."""
    linkage = sd.slider_crank(slider_inertia=2e-5, gravity=9.81).driven(speed=sd.rpm(60))
    ideal = sd.simulate(linkage, until=0.5)
    laws = {"stiffness": Linear(1e6), "damping": KelvinVoigt(200.0)}
    away = []
    for gap in (4e-4, 4e-5):
        run = sd.simulate(linkage.with_clearance("guide", sd.GuideClearance(gap, 0.04, 0.02, **laws)), until=0.5)
        assert run.attrs["status"] == "complete"
        away.append(np.max(np.abs(run["position"] - ideal["position"]).sel(body="slider").values))
        force = run["reaction"].sel(joint="guide", axis="y").values
        wanted = ideal["reaction"].sel(joint="guide", axis="y").values
        late = run["time"].values > 0.1
        assert abs(np.mean(force[late] - wanted[late])) < 0.02 * np.mean(np.abs(wanted[late]))
    assert 4e-4 < away[0] < 5e-4
    # the deflection of the guide surfaces themselves, some N over 1 MN/m, does not shrink
    assert away[1] == pytest.approx(0.1 * away[0], rel=0.2)


@pytest.mark.parametrize("name", catalogue.ELASTIC)
def test_laws_at_a_flat_wall(name):
    """Contract: a formula with the clearance of a bearing in it has no value at a plane surface, and the error says so."""
    law = catalogue.ELASTIC[name]()
    if name in ("braendlein", "hertz", "linear", "power"):
        assert sd.GuideClearance(GAP, LENGTH, WIDTH, stiffness=law).stiffness == law
        return
    with pytest.raises(sd.InputError, match="no value for a corner on a plane guide surface"):
        sd.GuideClearance(GAP, LENGTH, WIDTH, stiffness=law)


def test_hertz_at_a_flat_wall():
    """Closed form: a ball of radius R on a plane, 4/3 E* sqrt(R) (Hertz); and the limit of ever wider bearings."""
    plane = sd.GuideClearance(GAP, LENGTH, WIDTH, corner_radius=RADIUS)
    (found,) = sd.Hertz().parameters(plane.surfaces)
    modulus = sd.STEEL.youngs_modulus / (2.0 * (1.0 - sd.STEEL.poisson_ratio**2))
    assert found == pytest.approx(4.0 / 3.0 * modulus * math.sqrt(RADIUS), rel=1e-14)
    (wide,) = sd.Hertz().parameters(dataclasses.replace(plane.surfaces, clearance=1e6))
    assert wide == pytest.approx(found, rel=1e-8)


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"length": None}, "has no size"),
        ({"corners": ((0.0, 0.01),)}, "corners and length or width"),
        ({"corner_radius": 0.03}, "at most 0.02 m"),
        ({"length": None, "width": None, "corners": ((0.0, math.nan),)}, "numbers from"),
        ({"clearance": -1e-3}, "from 1e-12"),
    ],
)
def test_what_is_no_clearance(change, match):
    """Contract: each refusal names what is wrong."""
    with pytest.raises(sd.InputError, match=match):
        sd.GuideClearance(**{"clearance": GAP, "length": LENGTH, "width": WIDTH, **change})


def test_clearances_that_are_refused():
    """Identity: a follower without inertia, corners on one side only, and a guide that is not there are refused by name."""
    gap = sd.GuideClearance(GAP, LENGTH, WIDTH)
    with pytest.raises(sd.InputError, match="'guide' needs the angle of body 'slider'"):
        sd.slider_crank().with_clearance("guide", gap)
    aside = sd.GuideClearance(GAP, corners=((0.0, 0.01), (0.1, 0.01)))
    with pytest.raises(sd.InputError, match="both sides"):
        sd.slider_crank(slider_inertia=1e-5).with_clearance("guide", aside)
    with pytest.raises(sd.InputError, match="did you mean 'guide'"):
        sd.slider_crank(slider_inertia=1e-5).with_clearance("giude", gap)
    with pytest.raises(sd.InputError, match="in-contact"):
        sd.simulate(sd.slider_crank(slider_inertia=1e-5).with_clearance("guide", gap), until=0.1, start="in-contact")


def test_describing_and_changing():
    """Identity: a block given by its corners is the same block; a value is changed by its path; `ideal` restores it."""
    linkage = sd.slider_crank(slider_inertia=2e-5).driven(speed=sd.rpm(60))
    block_ = linkage.with_clearance("guide", sd.GuideClearance(1e-4, 0.04, 0.02, corner_radius=2e-3))
    corners = ((-0.018, -0.008), (0.018, -0.008), (0.018, 0.008), (-0.018, 0.008))
    same = linkage.with_clearance("guide", sd.GuideClearance(1e-4, corners=corners, corner_radius=2e-3))
    for one, other in zip(block_.contact_points, same.contact_points, strict=True):
        assert (one.name, one.normal, one.distance) == (other.name, other.normal, pytest.approx(other.distance))
        assert one.centre == pytest.approx(other.centre)
    assert block_.replace("guide.clearance", 2e-4).contact_points[0].distance == pytest.approx(0.0102)
    assert block_.ideal() == linkage == block_.ideal("guide")
