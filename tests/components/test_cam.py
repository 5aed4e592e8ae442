"""A cam by its profile: lift, forces and lift-off of an eccentric circle, and the energy of any profile."""

import dataclasses
import math

import numpy as np
import pytest
from scipy.optimize import brentq

import scissordyn as sd
from scissordyn.components.cam import depth_at

from .shared import METHODS, TIGHT, assert_balance

A, E, B = 0.03, 0.01, 0.008  # Radius of a circular cam, its eccentricity, and radius of the roller [m]

MASS, G = 0.5, 9.81  # Mass of the follower [kg] and gravitational acceleration [m/s^2]


def circle(pairs=91):
    """Return the profile of an eccentric circle about the axis of the cam."""
    angles = np.linspace(0.0, 2.0 * math.pi, pairs)
    radii = E * np.cos(angles) + np.sqrt(A * A - E * E * np.sin(angles) ** 2)
    radii[-1] = radii[0]
    return tuple(zip(angles.tolist(), radii.tolist(), strict=True))


def lift(turn, length=A + B):
    """Return the height of the roller above the axis [m]; `turn` is the angle of the circle's centre."""
    return E * np.sin(turn) + np.sqrt(length**2 - (E * np.cos(turn)) ** 2)


def lift_rate(turn, length=A + B):
    """Return the derivative of the lift by the angle."""
    return E * np.cos(turn) + E * E * np.sin(turn) * np.cos(turn) / np.sqrt(length**2 - (E * np.cos(turn)) ** 2)


def bend(turn):
    """Return the second derivative of the lift by the angle, by differences."""
    return (lift_rate(turn + 1e-6) - lift_rate(turn - 1e-6)) / 2e-6


def tappet(speed, angle, push=0.0, **law):
    """Return a roller in a vertical guide above a driven eccentric circle."""
    wheel = sd.Body("wheel", mass=1.0, inertia=1e-3, points={"axis": (0.0, 0.0)}, position=(0.0, 0.0), angle=angle)
    cam = sd.Cam("cam", ("wheel", "axis"), ("follower", "centre"), circle(), B, **{"restitution": 1.0, **law})
    # it starts as deep as its force presses it in
    depth = ((MASS * (G + speed**2 * float(bend(angle))) + push) / cam.stiffness) ** (2.0 / 3.0)
    follower = sd.point_mass("follower", mass=MASS, position=(0.0, float(lift(angle)) - depth))
    return sd.Mechanism(
        bodies=(wheel, follower),
        joints=(sd.Revolute("bearing", ("wheel", "axis"), ("ground", "O")),),
        guides=(sd.Guide("guide", ("follower", "centre"), direction=math.pi / 2),),
        components=(cam, sd.Force("spring", ("follower", "centre"), (0.0, -push))),
        ground=(("O", (0.0, 0.0)),),
        gravity=G,
    ).driven(speed=speed, body="wheel")


@pytest.mark.parametrize("method", METHODS)
def test_lift_and_forces_of_an_eccentric_circle(method):
    """Closed form: the roller's centre is on a circle; the forces across the profile and of the drive follow from its lift."""
    speed, stiffness, push = 20.0, 1e11, 40.0
    mechanism = tappet(speed, math.pi / 2, push, stiffness=stiffness)
    run = sd.simulate(mechanism, until=2.0 * math.pi / speed, samples=361, method=method, **TIGHT)
    turn = math.pi / 2 + speed * run["time"].values
    way = run["position"].sel(body="follower", axis="y").values
    np.testing.assert_allclose(way, lift(turn), atol=2e-6)
    total = MASS * (G + speed**2 * bend(turn)) + push
    across = (lift(turn) - E * np.sin(turn)) / (A + B)  # cosine of the pressure angle
    np.testing.assert_allclose(run["cam_normal"].values[:, 0], total / across, rtol=2e-3)
    np.testing.assert_allclose(
        run["drive_torque"], total * lift_rate(turn), atol=2e-3 * np.max(np.abs(total * lift_rate(turn)))
    )
    assert run.sizes["event"] == 1  # it is pressed from the start on
    assert_balance(run)


def test_a_follower_lifts_off():
    """Closed form: it leaves where the lift would ask for more than gravity, flies, and falls back on the cam."""
    speed = 45.0
    run = sd.simulate(tappet(speed, -math.pi / 2, stiffness=1e13), until=0.2, **TIGHT)
    turn = brentq(lambda turn: speed**2 * float(bend(turn)) + G, -1.5, 1.5)
    leaves = (turn + math.pi / 2) / speed

    def flight(time):
        return float(lift(turn)) + speed * float(lift_rate(turn)) * time - 0.5 * G * time**2

    late = np.linspace(2e-3, 0.15, 1500)
    first = late[np.argmax(flight(late) < lift(turn + speed * late))]
    falls = brentq(lambda time: float(flight(time) - lift(turn + speed * time)), first - 1e-3, first)
    kinds, when = run["event_kind"].values.astype(str).tolist(), run["event_time"].values
    assert kinds[:3] == ["reached", "left", "reached"]
    assert when[1] == pytest.approx(leaves, abs=5e-5)  # the softer the contact, the later it is free of it
    assert when[2] == pytest.approx(leaves + falls, abs=1e-6)
    after = run["time"].values - leaves
    inside = (after > 1e-3) & (after < falls)
    way = run["position"].sel(body="follower", axis="y").values
    np.testing.assert_allclose(way[inside], flight(after[inside]), atol=1e-6)
    assert_balance(run, 1e-6)


# Points (angle [rad], radius [m]) of the profile of a cam with three lobes
LOBES = tuple(
    (k * math.pi / 18, 0.04 + 0.006 * math.cos(3 * k * math.pi / 18) + 0.002 * math.sin(k * math.pi / 18)) for k in range(36)
)


def test_forces_of_any_profile_come_from_an_energy():
    """Identity: derivatives of the depth by differences; a knife edge on its profile is at depth 0, a roller at its radius."""
    cam = sd.Cam("cam", ("wheel", "axis"), ("tip", "centre"), (*LOBES, (2.0 * math.pi, LOBES[0][1])), 0.01)
    table, h = np.array(cam.parameters((1.0, 0.0, 0.0))), 1e-6
    count = int(table[3])
    for x, y in ((0.05, 0.003), (-0.03, 0.035), (0.01, -0.045)):
        _, gx, gy = depth_at(x, y, table, count)
        by_x = (depth_at(x + h, y, table, count)[0] - depth_at(x - h, y, table, count)[0]) / (2.0 * h)
        by_y = (depth_at(x, y + h, table, count)[0] - depth_at(x, y - h, table, count)[0]) / (2.0 * h)
        assert (gx, gy) == pytest.approx((by_x, by_y), abs=1e-7)
    outline, _ = cam.outline
    edge = dataclasses.replace(cam, roller=0.0)
    sharp = np.array(edge.parameters((1.0, 0.0, 0.0)))
    for k in range(0, 180, 7):
        x, y = outline[k]
        assert depth_at(x, y, sharp, count)[0] == pytest.approx(0.0, abs=1e-9)
        along = outline[k + 1] - outline[k - 1]
        normal = np.array([along[1], -along[0]]) / math.hypot(*along)
        assert depth_at(x + 0.01 * normal[0], y + 0.01 * normal[1], table, count)[0] == pytest.approx(0.0, abs=2e-5)


def test_a_turning_cam_throws_its_follower_without_loss():
    """Identity: cam and follower in the plane, neither driven: energy and angular momentum stay over several contacts."""
    cam = sd.Cam(
        "cam", ("wheel", "axis"), ("tip", "centre"), (*LOBES, (2.0 * math.pi, LOBES[0][1])), 0.01, 1e9, restitution=1.0
    )
    wheel = sd.Body(
        "wheel", mass=2.0, inertia=2e-3, points={"axis": (0.0, 0.0)}, position=(0.0, 0.0), angle=0.0, angular_velocity=30.0
    )
    tip = dataclasses.replace(sd.point_mass("tip", mass=0.3, position=(0.07, 0.0)), velocity=(-1.0, 0.2))
    pin = sd.Revolute("bearing", ("wheel", "axis"), ("ground", "O"))
    spring = sd.Spring("back", ("ground", "O"), ("tip", "centre"), stiffness=400.0)
    run = sd.simulate(
        sd.Mechanism((wheel, tip), (pin,), components=(cam, spring), ground=(("O", (0.0, 0.0)),), gravity=0.0),
        until=0.3,
        **TIGHT,
    )
    assert run.sizes["event"] > 6
    place, speed = run["position"].sel(body="tip").values, run["velocity"].sel(body="tip").values
    momentum = 2e-3 * run["angular_velocity"].sel(body="wheel").values
    momentum = momentum + 0.3 * (place[:, 0] * speed[:, 1] - place[:, 1] * speed[:, 0])
    assert np.ptp(run["angular_velocity"].sel(body="wheel").values) > 1.0
    np.testing.assert_allclose(momentum, momentum[0], atol=1e-9)
    assert_balance(run)


@pytest.mark.parametrize(
    ("change", "line"),
    [
        ({"profile": circle()[:-1]}, "cam 'cam': the periodic curve begins with 0.04 and ends with"),
        (
            {"profile": ((0.0, 1.0), (1.0, 2.0), (2.0, 1.0))},
            "cam 'cam': a profile over 114.592 deg; expected angles over a whole turn",
        ),
        (
            {"roller": 0.05, "profile": (*LOBES, (2.0 * math.pi, LOBES[0][1]))},
            "cam 'cam': a roller of 0.05 m in a hollow of 0.0",
        ),
    ],
)
def test_refused(change, line):
    """Contract: one line that says what came."""
    cam = tappet(1.0, 0.0).components[0]
    with pytest.raises(sd.InputError, match=line):
        dataclasses.replace(cam, **change)


def test_a_follower_within_the_cam_is_refused():
    """Contract: the error says where the profile is."""
    deep = tappet(1.0, math.pi / 2, 1.0)
    follower = dataclasses.replace(deep.body("follower"), position=(0.0, 0.03))
    with pytest.raises(
        sd.InputError, match=r"its follower starts 0.03 m from the centre, within the cam; expected about 0.048 m or more"
    ):
        sd.simulate(dataclasses.replace(deep, bodies=(deep.bodies[0], follower)), until=0.1)
