"""Change points: a moving mechanism continues along its smooth branch at any speed; a locking position stops it."""

import math
from dataclasses import replace

import numpy as np
import pytest
from benchmarks.change_points import judge, linkage, rocker_angle
from tests.build import warnings_of

import scissordyn as sd
from scissordyn.record.summary import summary_of


@pytest.mark.parametrize("seed", range(24))
def test_random_linkage_stays_on_its_branch(seed):
    """Closed form: driven, free, turned by a torque, or with a clearance joint; see benchmarks/change_points.py."""
    assert judge(seed).verdict == "on its branch"


FOUR_BAR = (4.0, 1.0, 3.0, 2.0)  # Lengths of ground, crank, coupler and rocker of a linkage that folds flat


def off_branch(run) -> float:
    """Return the largest error of the rocker's angle, by the law of cosines for the crank's angle."""
    crank, rocker = (run["angle"].sel(body=name).values for name in ("crank", "rocker"))
    return float(np.max(np.abs(np.exp(1j * rocker) - np.exp(1j * rocker_angle(FOUR_BAR, crank, -1.0)))))


@pytest.mark.parametrize("speed", [0.5, 1.0, 2.0, 3.0, 4.5])
@pytest.mark.parametrize("samples", [21, 361])
def test_driven_through_the_stretched_position(speed, samples):
    """Closed form: a 4-1-3-2 linkage at any speed; velocities are continuous, energy balances, and there is one warning.

    With 361 samples one is at the change point itself.
    """
    run = sd.simulate(linkage(FOUR_BAR, math.pi / 3, -1.0, "driven", speed), until=2.0 * math.pi / speed, samples=samples)
    assert run.attrs["status"] == "complete"
    assert off_branch(run) < 1e-9
    crank = run["angle"].sel(body="crank").values
    rate = run["angular_velocity"].sel(body="rocker").values / speed
    fine = np.linspace(crank[0], crank[-1], 20001)
    slope = np.gradient(np.unwrap(rocker_angle(FOUR_BAR, fine, -1.0)), 2.0 * math.pi / 20000)
    expected = np.interp(crank, fine, slope)
    assert np.max(np.abs(rate - expected)[1:-1]) < 1e-4
    assert np.all(np.isfinite(run["angular_acceleration"].values))
    assert float(np.max(np.abs(run["energy_residual"]))) < 1e-5 * float(run["kinetic_energy"].max())
    assert sum("change point" in text for text in warnings_of(run)) == 1


@pytest.mark.parametrize("motion", ["driven", "free"])
@pytest.mark.parametrize("speed", [0.5, 2.0, -3.0])
@pytest.mark.parametrize("before", [0.5, 0.4, 0.31])
def test_change_point_with_hard_contacts(motion, speed, before):
    """Closed form: time stepping passes the point, with open or closed contacts, at the end of a step or within it."""
    linked = linkage(FOUR_BAR, math.copysign(math.pi - before, speed), -1.0, "driven, a bob", speed)
    hard = sd.Clearance(1e-3, contact="hard")
    joints = tuple(replace(joint, clearance=hard) if joint.clearance else joint for joint in linked.joints)
    linked = replace(linked, joints=joints, drives=linked.drives if motion == "driven" else ())
    run = sd.simulate(linked, until=1.2 / abs(speed), samples=121)
    assert run.attrs["status"] == "complete"
    assert off_branch(run) < 1e-10
    missed = float(np.max(np.abs(run["energy_residual"]))) / float(run["kinetic_energy"].max())
    assert missed < 1e-5 or "energy balance error" in run.attrs["warnings"]
    assert missed < 2e-3


def lagging(delayed):
    """Return a braking torque of a delayed speed."""
    return -0.3 * delayed


@pytest.mark.parametrize("speed", [0.5, -2.0, 5.0])
@pytest.mark.parametrize("lag", [0.05, 0.3])
def test_change_point_with_delayed_feedback(speed, lag):
    """Closed form of the branch, and order of convergence: the history continues across the change point."""
    linked = linkage(FOUR_BAR, math.copysign(math.pi - 0.5, speed), -1.0, "free", speed)
    braked = linked.controlled(sd.element(slot="controller", delay=lag / abs(speed), recorded="speed")(lagging)())
    runs = [sd.simulate(braked, until=1.2 / abs(speed), samples=121, rtol=tol, atol=tol) for tol in (1e-6, 1e-9, 1e-12)]
    assert max(map(off_branch, runs)) < 1e-9
    coarse, fine, exact = (run["angle"].sel(body="crank").values for run in runs)
    assert abs(exact[-1]) > math.pi
    assert np.max(np.abs(coarse - exact)) < 1e-6
    assert np.max(np.abs(fine - exact)) < 1e-9
    assert max(float(np.max(np.abs(run["energy_residual"]))) for run in runs[1:]) < 1e-8 * speed**2


def five_bar(half: float, length: float, angle: float, speed: float, driven: bool) -> sd.Mechanism:
    """Return two mirrored cranks at (-half, 0) and (half, 0), and two rods that stretch when the cranks point outwards."""
    rod = half + length
    x, y = half + length * math.cos(angle), length * math.sin(angle)
    top = y - math.copysign(math.sqrt(rod * rod - x * x), math.sin(0.5 * angle))
    at = {"left": (-half, 0.0), "right": (half, 0.0), "left rod": (-x, y), "right rod": (x, y)}
    turned = {"left": math.pi - angle, "right": angle, "left rod": math.atan2(top - y, x), "right rod": math.atan2(top - y, -x)}
    bodies = tuple(
        sd.Body(
            name,
            1.0,
            0.1 * long**2,
            {"start": (0.0, 0.0), "end": (long, 0.0)},
            centre=(0.4 * long, 0.0),
            position=place,
            angle=turned[name],
            angular_velocity=None if driven or "rod" in name else (speed if name == "right" else -speed),
        )
        for (name, place), long in zip(at.items(), (length, length, rod, rod), strict=True)
    )
    ends = ["left", "ground.A"], ["right", "ground.B"], ["left rod", "left.end"], ["right rod", "right.end"]
    joints = [sd.Revolute(f"{one} pin", (one, "start"), tuple(other.split("."))) for one, other in ends]
    joints.append(sd.Revolute("top", ("left rod", "end"), ("right rod", "end")))
    linked = sd.Mechanism(bodies, tuple(joints), ground=(("A", (-half, 0.0)), ("B", (half, 0.0))), gravity=0.0)
    return linked.driven(speed=-speed, body="left").driven(speed=speed, body="right") if driven else linked


@pytest.mark.parametrize("driven", [True, False])
@pytest.mark.parametrize(("half", "length"), [(0.5, 0.5), (0.2, 0.7)])
@pytest.mark.parametrize("speed", [-1.0, 0.3, -7.0, 20.0])
def test_symmetric_five_bar(half, length, speed, driven):
    """Closed form: the top is 2 sin(a/2) (L (d + L cos^2(a/2)))^(1/2) below the ends of the cranks, on both sides of a = 0."""
    linked = five_bar(half, length, -math.copysign(0.8, speed), speed, driven)
    run = sd.simulate(linked, until=1.6 / abs(speed), samples=201)
    assert run.attrs["status"] == "complete"
    angle = run["angle"].sel(body="right").values
    assert angle[0] * angle[-1] < 0.0
    assert np.max(np.abs(math.pi - angle - run["angle"].sel(body="left").values)) < 1e-12
    height = -2.0 * np.sin(0.5 * angle) * np.sqrt(length * (half + length * np.cos(0.5 * angle) ** 2))
    rod = (half + length) * np.sin(run["angle"].sel(body="right rod").values)
    assert np.max(np.abs(rod - height)) < 1e-9
    assert float(np.max(np.abs(run["energy_residual"]))) < 1e-5 * float(run["kinetic_energy"].max())


@pytest.mark.parametrize("driven", [True, False])
@pytest.mark.parametrize("second_guide", [True, False])
@pytest.mark.parametrize("speed", [1.0, -0.4, 6.0, -25.0])
def test_scott_russell(speed, second_guide, driven):
    """Closed form: the rod turns opposite to the crank, also where its foot passes the crank's pivot."""
    r, first = 0.5, math.copysign(0.4, speed)
    tip = r * math.cos(first), r * math.sin(first)
    crank = sd.bar("crank", length=r, mass=1.0, angle=first)
    crank = replace(crank, angular_velocity=None if driven else speed)
    rod = sd.Body("rod", 2.0, 0.5, {"middle": (0, 0), "foot": (r, 0), "head": (-r, 0)}, (0.1 * r, 0.0), tip, -first)
    slider = sd.point_mass("slider", mass=1.5, position=(2.0 * tip[0], 0.0))
    joints = (
        sd.Revolute("O", ("crank", "start"), ("ground", "O")),
        sd.Revolute("A", ("rod", "middle"), ("crank", "end")),
        sd.Revolute("B", ("rod", "foot"), ("slider", "centre")),
    )
    guides = [sd.Guide("rail", ("slider", "centre"))]
    if second_guide:
        guides.append(sd.Guide("pole", ("rod", "head"), direction=0.5 * math.pi))
    linked = sd.Mechanism((crank, rod, slider), joints, tuple(guides), ground=(("O", (0.0, 0.0)),), gravity=0.0)
    linked = linked.driven(speed=speed, body="crank") if driven else linked
    run = sd.simulate(linked, until=2.0 * math.pi / abs(speed), samples=101)
    turned = run["angle"].sel(body="crank").values
    assert run.attrs["status"] == "complete"
    assert abs(turned[-1]) > 1.5 * math.pi
    assert np.max(np.abs(turned + run["angle"].sel(body="rod").values)) < 1e-9
    assert float(np.max(np.abs(run["energy_residual"]))) < 1e-5 * float(run["kinetic_energy"].max())


def test_lock_has_no_largest_torque():
    """Limit: the torque of a drive at constant speed grows without limit towards a locking position."""
    run = sd.simulate(sd.slider_crank(crank=0.12, rod=0.1, angle=0.5).driven(speed=1.0), until=1.0)
    assert run.attrs["status"] == "failed"
    assert "grows without limit" in str(summary_of(run).actuators[0])
