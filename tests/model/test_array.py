"""Arrays that curve, close to a ring or stand upright, compared with their geometry in closed form."""

import math

import numpy as np
import pytest
from tests.build import one_line_error

import scissordyn as sd
from scissordyn.plan.plan import plan

TIGHT = {"rtol": 1e-12, "atol": 1e-12, "samples": 41}  # Options of `simulate` for accurate runs
PIN = sd.Clearance(0.5e-3)  # Clearance of the joints


def place(run, mechanism, body, point):
    """Return the position of a body's point over time, from the mass centre and the angle of the body."""
    described, turn = mechanism.body(body), run["angle"].sel(body=body).values
    x, y = np.subtract(described.points[point], described.centre)
    arm = np.stack([np.cos(turn) * x - np.sin(turn) * y, np.sin(turn) * x + np.cos(turn) * y], axis=1)
    return run["position"].sel(body=body).values + arm


def degrees_of_freedom(mechanism):
    """Return the number of free coordinates less the number of constraints."""
    coordinates = plan(mechanism).coordinates
    return coordinates.free - len(coordinates.constraints)


@pytest.mark.parametrize(("inner", "outer", "kink"), [(0.8, 1.2, 0.0), (1.2, 0.8, 0.0), (1.0, 1.0, 0.3), (0.9, 1.1, 0.1)])
def test_polar_radii(inner, outer, kink):
    """Closed form: inner and outer ends of the moving array stay on circles given by its opening, to 1e-9 m."""
    units = 4
    array = sd.polar_scissor(units=units, inner=inner, outer=outer, kink=kink, angle=0.7).driven(speed=0.8)
    run = sd.simulate(array, until=0.4, **TIGHT)
    assert run.attrs["status"] == "complete"
    th = 0.5 * (run["angle"].sel(body="unit 3/bar 1") - run["angle"].sel(body="unit 3/bar 2")).values
    assert np.ptp(th) > 0.1
    flat, steep = th - 0.5 * kink, th + 0.5 * kink
    span = 2.0 * np.arctan2(outer * np.cos(flat) - inner * np.cos(steep), outer * np.sin(flat) + inner * np.sin(steep))
    inside, outside = inner * np.cos(steep) / np.sin(0.5 * span), outer * np.cos(flat) / np.sin(0.5 * span)
    centre = np.stack([np.zeros_like(th), -inside], axis=1)
    for unit in range(1, units + 1):
        low = place(run, array, f"unit {unit}/bar 2", "end") - centre
        high = place(run, array, f"unit {unit}/bar 1", "end") - centre
        assert np.allclose(np.hypot(*low.T), np.abs(inside), rtol=0, atol=1e-9)
        assert np.allclose(np.hypot(*high.T), np.abs(outside), rtol=0, atol=1e-9)
        assert np.allclose(low[:, 0], inside * np.sin(unit * span), rtol=0, atol=1e-9)
    if kink and inner == outer:
        assert np.allclose(span, kink, rtol=0, atol=1e-12)


def test_straight_polar_array_is_the_scissor():
    """Limit: with equal legs and no kink the torque is that of the straight array."""
    options = {"until": 0.02, **TIGHT}
    curved = sd.polar_scissor(units=3, inner=1.0, outer=1.0, bar_mass=5.68, slider_mass=5.0, angle=math.pi / 6)
    run = sd.simulate(curved.driven(speed=sd.rpm(150)), **options)
    straight = sd.simulate(sd.scissor(units=3).driven(speed=sd.rpm(150)), **options)
    assert np.allclose(run["drive_torque"], straight["drive_torque"], rtol=1e-9, atol=0)


@pytest.mark.parametrize("units", [3, 4, 12])
def test_ring_radii(units):
    """Closed form: pivots, inner and outer ends of the ring stay on circles about the origin, on fixed rays, to 1e-9 m."""
    ring = sd.hoberman_ring(units=units, leg=0.5, angle=0.4).driven(speed=-0.5)
    run = sd.simulate(ring, until=0.4, **TIGHT)
    assert run.attrs["status"] == "complete"
    th, half = 0.4 - 0.5 * run["time"].values, math.pi / units
    for unit in range(1, units + 1):
        ray = 0.5 * math.pi - (2 * unit - 1) * half
        for point, bar_number, inclination, turn in (
            ("pivot", 1, th, 0.0),
            ("end", 2, th + half, -half),
            ("end", 1, th - half, -half),
        ):
            radius = 0.5 * np.cos(inclination) / math.sin(half)
            expected = radius[:, None] * np.array([math.cos(ray + turn), math.sin(ray + turn)])
            assert np.allclose(place(run, ring, f"unit {unit}/bar {bar_number}", point), expected, rtol=0, atol=1e-9)


def test_pushed_ring():
    """Closed form: a torque M between two bars of a free ring does the work 2 M (th - th_0), which becomes kinetic energy.

    With h = (p/2) sin(k/2) from the pivot of a bar to its mass centre, to 1e-10 of the final energy:
    T = N th'^2 [m (h sin th - p sin th/sin(k/2))^2 + m (h cos th)^2 + I].
    """
    n, p, m, push = 8, 0.5, 1.0, 5.0
    ring = sd.hoberman_ring(units=n, leg=p, bar_mass=m).replace(
        "components", (sd.Torque("push", "unit 1/bar 1", push, "unit 1/bar 2"),)
    )
    run = sd.simulate(ring, until=1.0, **TIGHT)
    one, other = (run.sel(body=f"unit 5/bar {number}") for number in (1, 2))
    th = 0.5 * (one["angle"] - other["angle"]).values
    rate = 0.5 * (one["angular_velocity"] - other["angular_velocity"]).values
    half = math.pi / n
    h, inertia = 0.5 * p * math.sin(half), m * (p**2 / 12 + (0.5 * p * math.cos(half)) ** 2)
    radial, across = h * np.sin(th) - p * np.sin(th) / math.sin(half), h * np.cos(th)
    kinetic = n * rate**2 * (m * radial**2 + m * across**2 + inertia)
    work = 2.0 * push * (th - math.pi / 4)
    assert np.allclose(kinetic, work, rtol=0, atol=1e-10 * work[-1])
    assert work[-1] > 1.0


@pytest.mark.parametrize(
    ("array", "freedom"),
    [
        (sd.polar_scissor(units=5), 1),
        (sd.polar_scissor(units=5, inner=1.0, outer=1.0, kink=0.3), 1),
        (sd.hoberman_ring(units=6), 1),
        (sd.hoberman_ring(units=13), 1),
        (sd.mast(units=5), 1),
        (sd.mast(units=5, platform_mass=1.0), 1),
        # the rest of a ring holds a unit even without one of its pins: that one clearance has no effect
        (sd.hoberman_ring(units=6).with_clearance("unit 2/pivot", PIN), 1),
        (sd.hoberman_ring(units=6).with_clearance("all", PIN), 3 * 12 - 3),
    ],
    ids=["polar", "kinked", "ring 6", "ring 13", "mast", "platform", "ring with clearance at a pivot", "ring with clearance"],
)
def test_degrees_of_freedom(array, freedom):
    """Identity: free coordinates less constraints are the degrees of freedom, also with redundant joints."""
    assert degrees_of_freedom(array) == freedom


@pytest.mark.parametrize(
    "built",
    [
        sd.polar_scissor(units=5),
        sd.polar_scissor(units=5, inner=0.9, outer=1.1, kink=0.1),
        sd.hoberman_ring(units=7),
        sd.mast(units=3, platform_mass=1.0),
        sd.slider_crank(offset=0.01, angle=2.0),
        sd.four_bar(branch="crossed", angle=2.0),
        sd.n_four_bar(3),
    ],
    ids=["polar", "kinked", "ring", "mast", "slider-crank", "four-bar", "n-four-bar"],
)
def test_placed_bodies_close(built):
    """Identity: every builder places its bodies so that each pin closes, to 1e-14 m."""
    for joint in built.joints:
        assert math.dist(built.place(joint.journal), built.place(joint.bearing)) < 1e-14


@pytest.mark.parametrize("platform", [None, 40.0])
def test_mast_rises(platform):
    """Closed form: the mast is N L sin th high and its base L cos th wide; its potential energy follows, to 1e-9."""
    array = sd.mast(units=4, platform_mass=platform).driven(speed=1.5)
    run = sd.simulate(array, until=0.3, **TIGHT)
    th = math.pi / 6 + 1.5 * run["time"].values
    top = place(run, array, "unit 4/bar 1", "end")
    assert np.allclose(top, np.stack([np.cos(th), 4.0 * np.sin(th)], axis=1), rtol=0, atol=1e-9)
    assert np.allclose(run["slider_position"], np.cos(th), rtol=0, atol=1e-9)
    lifted = (8 * 2.0 * 2.0 + (platform or 0.0) * 4.0) * 9.81 * (np.sin(th) - 0.5)
    assert np.allclose(run["potential_energy"] - run["potential_energy"][0], lifted, rtol=0, atol=1e-9 * lifted[-1])
    if platform:
        assert np.allclose(run["angle"].sel(body="platform"), 0.0, atol=1e-9)


# Driven arrays of ten units, by kind
ARRAYS = {
    "scissor": sd.scissor(units=10).driven(speed=sd.rpm(150)),
    "polar": sd.polar_scissor(units=10, inner=0.95, outer=1.0).driven(speed=10.0),
    "kinked": sd.polar_scissor(units=10, inner=1.0, outer=1.0, kink=0.1).driven(speed=10.0),
    "ring": sd.hoberman_ring(units=10).driven(speed=-10.0),
    "mast": sd.mast(units=10, platform_mass=10.0).driven(speed=10.0),
}


@pytest.mark.parametrize("case", ARRAYS)
def test_clearance_everywhere(case):
    """Identity: ten units with clearance and friction at every pin close their energy balance to 1e-6 of the kinetic energy."""
    pin = sd.Clearance(0.2e-3, friction=sd.LuGre(0.05))
    run = sd.simulate(ARRAYS[case].with_clearance("all", pin), until=0.004, samples=201)
    assert run.attrs["status"] == "complete"
    assert run.sizes["contact"] >= 5
    assert float(np.max(np.abs(run["energy_residual"]))) < 1e-6 * float(run["kinetic_energy"].max())
    assert run.attrs["length_error"] < 1e-10


@pytest.mark.parametrize(
    "build",
    [
        lambda: sd.polar_scissor(units=0),
        lambda: sd.polar_scissor(inner=0.0),
        lambda: sd.polar_scissor(angle=1.5, kink=0.3),
        lambda: sd.polar_scissor(kink=math.nan),
        lambda: sd.hoberman_ring(units=2),
        lambda: sd.hoberman_ring(units=3, angle=0.6),
        lambda: sd.mast(bar_length=-1.0),
        lambda: sd.mast(angle=0.0),
    ],
)
def test_refused_arrays(build):
    """Contract: an array that cannot be built is refused in one line with the allowed values."""
    with one_line_error("expected "):
        build()
