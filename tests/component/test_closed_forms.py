"""Forces, energies and powers of the components at one state each, against numbers worked out by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from scissordyn.component import (
    angle_stop,
    bushing,
    cable,
    constant_force_spring,
    force,
    latch,
    motor,
    spring,
    tape_spring,
    torque,
    torsion_spring,
    travel_stop,
)
from scissordyn.component.stop import push, stop_damping
from scissordyn.errors import InputError

ENDS = ("one", "end"), ("ground", "end")
XI = 8.0 * (1.0 - 0.4) / (5.0 * 0.4)
"""Damping factor of Flores et al. 2011 (doi:10.1007/s11044-010-9237-4) at a restitution of 0.4."""


def test_spring():
    """Closed form: 50 N/m over 0.2 m and 3 N s/m at 0.7 m/s."""
    p = spring.Spring("s", *ENDS, stiffness=50.0, free_length=0.3, damping=3.0).parameters(())
    assert spring.force(0.5, 0.7, *p) == pytest.approx((10.0 + 2.1, 1.0, 1.47), rel=1e-14)


def test_torsion_spring():
    """Closed form: the same about a hinge, with the opposite sense of the torque."""
    part = torsion_spring.TorsionSpring("s", "one", stiffness=50.0, free_angle=0.3, damping=3.0)
    assert torsion_spring.force(0.5, 0.7, *part.parameters(())) == pytest.approx((-12.1, 1.0, 1.47), rel=1e-14)


def test_cable():
    """Closed form: taut as a spring; slack nothing; a damper that would push leaves no tension and takes the spring's power."""
    p = cable.Cable("c", *ENDS, stiffness=50.0, free_length=0.3, damping=3.0).parameters(())
    assert cable.gap(0.5, 0.7, p[1]) == pytest.approx((0.2, 0.7), rel=1e-14)
    assert cable.force(0.5, 0.7, 1.0, *p) == pytest.approx((12.1, 1.0, 1.47, 1.0), rel=1e-14)
    assert cable.force(0.5, 0.7, 0.0, *p) == (0.0, 0.0, 0.0, 0.0)
    assert cable.force(0.25, 0.7, 1.0, *p) == (0.0, 0.0, 0.0, 1.0)
    assert cable.force(0.5, -4.0, 1.0, *p) == pytest.approx((0.0, 1.0, 40.0, 1.0), rel=1e-14)
    assert cable.force(0.5, -3.32, 1.0, *p)[0] == pytest.approx(0.04, rel=1e-12)


def test_constant_force_spring():
    """Closed form: 8 N beyond 0.4 m, in proportion to the length below."""
    p = constant_force_spring.ConstantForceSpring("s", *ENDS, tension=8.0, uncoiling_length=0.4, damping=3.0).parameters(())
    assert constant_force_spring.force(0.9, 0.7, *p) == pytest.approx((10.1, 8.0 * 0.7, 1.47), rel=1e-14)
    assert constant_force_spring.force(0.1, 0.7, *p) == pytest.approx((2.0 + 2.1, 0.1, 1.47), rel=1e-14)


def test_bushing():
    """Closed form: a full stiffness and damping matrix in the plane, and both about the axis."""
    part = bushing.Bushing(
        "b",
        *ENDS,
        stiffness_x=10.0,
        stiffness_y=20.0,
        stiffness_xy=5.0,
        torsional_stiffness=7.0,
        damping_x=1.0,
        damping_y=2.0,
        damping_xy=0.5,
        torsional_damping=0.3,
        free_angle=0.2,
    )
    found = bushing.force(0.1, -0.2, 0.6, 0.3, 0.4, 0.5, *part.parameters((0.0, 0.0, 0.1)))
    energy = 0.5 * (10.0 * 0.01 + 20.0 * 0.04 - 2.0 * 5.0 * 0.02 + 7.0 * 0.16)
    power = 1.0 * 0.09 + 2.0 * 0.16 + 2.0 * 0.5 * 0.12 + 0.3 * 0.25
    assert found == pytest.approx((-0.5, 3.5 - 0.95, -2.8 - 0.15, energy, power), rel=1e-13)
    assert bushing.Bushing("b", *ENDS).parameters((0.0, 0.0, 0.1))[-1] == 0.1


def test_motor():
    """Closed form: 4 N m at rest, falling to nothing at 10 rad/s, cut at 3 N m either way; mirrored for the other sense."""
    forth = motor.Motor("m", "one", stall_torque=4.0, no_load_speed=10.0, limit=3.0).parameters(())
    back = motor.Motor("m", "one", stall_torque=-4.0, no_load_speed=10.0, limit=3.0).parameters(())
    found = [motor.force(speed, *forth) for speed in (-5.0, 0.0, 5.0, 12.5, 30.0)]
    assert found == pytest.approx([3.0, 3.0, 2.0, -1.0, -3.0], rel=1e-14)
    assert motor.force(-5.0, *back) == pytest.approx(-2.0, rel=1e-14)


def test_force_and_torque():
    """Closed form: a factor of 2 on (3, 4) N, fixed and turned by 90 degrees with the body; and on 5 N m."""
    fixed = force.Force("f", ENDS[0], (3.0, 4.0)).parameters(())
    turned = force.Force("f", ENDS[0], (3.0, 4.0), follows=True).parameters(())
    assert force.force(0.6, 0.8, 2.0, *fixed) == pytest.approx((6.0, 8.0), rel=1e-14)
    wanted = 2.0 * (3.0 * 0.6 - 4.0 * 0.8), 2.0 * (3.0 * 0.8 + 4.0 * 0.6)
    assert force.force(0.6, 0.8, 2.0, *turned) == pytest.approx(wanted, rel=1e-14)
    assert torque.force(2.0, *torque.Torque("t", "one", 5.0).parameters(())) == pytest.approx(10.0, rel=1e-14)


def test_push_of_a_stop():
    """Closed form: K delta^n (1 + xi delta'/delta'(-)), never a pull; K delta^(n+1)/(n+1) is stored."""
    elastic = 1e6 * 0.01**1.5
    assert stop_damping(0.4) == pytest.approx(XI, rel=1e-14)
    found = push(1.0, 0.5, 0.01, 0.1, 1e6, 1.5, XI)
    assert found == pytest.approx((elastic * (1.0 + 0.2 * XI), elastic * 0.01 / 2.5, 0.02 * XI * elastic), rel=1e-13)
    assert push(1.0, 0.5, 0.01, -0.5, 1e6, 1.5, XI)[0] == 0.0
    assert push(0.0, 0.5, 0.01, 0.1, 1e6, 1.5, XI) == (0.0, 0.0, 0.0)


def test_travel_stop():
    """Closed form: the push against the direction of travel, 10 mm behind the limit."""
    stop = travel_stop.TravelStop("s", ENDS[0], direction=0.0, limit=1.5, stiffness=1e6, exponent=1.5, restitution=0.4)
    p = stop.parameters(())
    assert travel_stop.gap(1.51, 0.1, p[3]) == pytest.approx((0.01, 0.1), rel=1e-12)
    elastic = 1e6 * 0.01**1.5
    wanted = -elastic * (1.0 + 0.2 * XI), elastic * 0.01 / 2.5, 0.02 * XI * elastic
    assert travel_stop.force(1.51, 0.1, 1.0, 0.5, *p) == pytest.approx(wanted, rel=1e-11)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_angle_stop(side):
    """Closed form: the same about a hinge, in the sense in which the angle is reached from the start."""
    stop = angle_stop.AngleStop("s", "one", angle=side * 1.5, stiffness=1e6, exponent=1.5, restitution=0.4)
    p = stop.parameters((0.3,))
    assert angle_stop.gap(side * 1.51, side * 0.1, *p[3:]) == pytest.approx((0.01, 0.1), rel=1e-12)
    elastic = 1e6 * 0.01**1.5
    wanted = -side * elastic * (1.0 + 0.2 * XI), elastic * 0.01 / 2.5, 0.02 * XI * elastic
    assert angle_stop.force(side * 1.51, side * 0.1, 1.0, 0.5, *p) == pytest.approx(wanted, rel=1e-11)


def test_latch():
    """Closed form: how far its angle is passed in the sense from the start; locked it stays 1."""
    p = latch.Latch("l", "one", angle=-0.5).parameters((0.3,))
    assert latch.gap(-0.7, -2.0, 0.0, *p) == pytest.approx((0.2, 2.0), rel=1e-14)
    assert latch.gap(9.0, 0.0, 1.0, *p) == (1.0, 0.0)


def row(part):
    """What the kernels of a tape spring get: the parameters that have a name, and all of them."""
    numbers = np.array(part.parameters(()))
    return (*numbers[:4].tolist(), numbers)


def test_tape_spring():
    """Closed form: straight branch of 10 N m/rad to 2 and -1 N m; folds of 0.5 and -0.3 N m; areas below them."""
    p = row(
        tape_spring.TapeSpring(
            "t",
            "one",
            stiffness=10.0,
            peak_moment=2.0,
            steady_moment=0.5,
            peak_moment_equal=1.0,
            steady_moment_equal=0.3,
            free_angle=0.1,
        )
    )
    assert tape_spring.force(0.25, 0.0, 0.0, *p) == pytest.approx((-1.5, 0.5 * 10.0 * 0.15**2, 0.0, 0.0), rel=1e-12)
    # folded: stored where it snaps back, at 0.05 and -0.03, and then the steady moment times the angle
    assert tape_spring.force(1.1, 0.0, 1.0, *p) == pytest.approx((-0.5, 0.0125 + 0.5 * 0.95, 0.0, 1.0), rel=1e-12)
    assert tape_spring.force(-0.9, 0.0, 1.0, *p) == pytest.approx((0.3, 0.0045 + 0.3 * 0.97, 0.0, 1.0), rel=1e-12)
    assert tape_spring.switch(0.3, 0.0, 0.0, *p) == pytest.approx(0.2 - 0.0125 - 0.5 * 0.15, rel=1e-12)
    assert tape_spring.gap(0.35, 2.0, 0.0, *p) == pytest.approx((0.05, 2.0), rel=1e-12)
    assert tape_spring.gap(-0.05, -2.0, 0.0, *p) == pytest.approx((0.05, 2.0), rel=1e-12)
    assert tape_spring.gap(0.35, 2.0, 1.0, *p) == pytest.approx((0.2, 2.0), rel=1e-12)
    assert tape_spring.gap(-0.05, -2.0, 1.0, *p) == pytest.approx((0.12, 2.0), rel=1e-12)


def test_tape_spring_whose_fold_takes_more_work():
    """Closed form: piecewise linear moments have work of trapezia, which the message gives; as much is taken."""
    straight = (
        (-0.2, -1.5),
        (-0.1, -1.0),
        (0.1, 1.0),
        (0.3, 2.0),
    )  # from 0.05 to 0.3: 0.0375 + 0.3; from -0.05 to -0.2: 0.1625
    negative, positive = ((-1.0, -0.2), (-0.05, -0.1)), ((0.05, 0.2), (1.0, 0.3))

    def made(*folded):
        return tape_spring.TapeSpring("t", "one", straight=straight, folded=folded)

    peak = (0.3375 - 0.5 * 0.25 * 0.2) / (0.5 * 0.25)  # at the end of a ramp from 0.2 as much work as of the straight branch
    made(*negative, (0.05, 0.2), (0.3, peak - 1e-9), (1.0, 0.3))
    with pytest.raises(InputError, match=r"takes 0\.0125 J more than the straight tape up to the snap at 0\.3 rad"):
        made(*negative, (0.05, 0.2), (0.3, peak + 0.1), (1.0, 0.3))
    with pytest.raises(InputError, match=r"takes 0\.0075 J more than the straight tape up to the snap at -0\.2 rad"):
        made((-1.0, -0.2), (-0.2, 0.1 - (0.1625 + 0.0075) / 0.075), (-0.05, -0.1), *positive)


def test_tape_spring_of_tables():
    """Closed form: piecewise linear branches with three and two pairs, and constant moments beyond them."""
    straight = ((-0.2, -2.0), (0.0, 0.0), (0.1, 2.0), (0.3, 3.0))
    folded = ((-1.0, -0.6), (-0.05, -0.5), (0.05, 1.0), (1.05, 0.8))
    p = row(tape_spring.TapeSpring("t", "one", straight=straight, folded=folded))
    assert tape_spring.force(0.2, 0.0, 0.0, *p)[:2] == pytest.approx((-2.5, 0.1 + 0.5 * 0.1 * 4.5), rel=1e-12)
    assert tape_spring.force(-0.1, 0.0, 0.0, *p)[:2] == pytest.approx((1.0, 0.05), rel=1e-12)
    assert tape_spring.force(0.4, 0.0, 0.0, *p)[:2] == pytest.approx((-3.0, 0.1 + 0.5 + 0.3), rel=1e-12)
    assert tape_spring.force(-0.3, 0.0, 0.0, *p)[:2] == pytest.approx((2.0, 0.2 + 0.2), rel=1e-12)
    assert tape_spring.force(0.55, 0.0, 1.0, *p)[:2] == pytest.approx((-0.9, 0.025 + 0.5 * 0.95), rel=1e-12)
    assert tape_spring.force(2.05, 0.0, 1.0, *p)[:2] == pytest.approx((-0.8, 0.025 + 0.9 + 0.8), rel=1e-12)
    assert tape_spring.force(-0.525, 0.0, 1.0, *p)[:2] == pytest.approx((0.55, 0.0125 + 0.475 * 0.525), rel=1e-12)
    assert tape_spring.force(-0.201, 0.0, 0.0, *p)[0] == pytest.approx(2.0, rel=1e-12)
    back = tape_spring.switch(0.2, 0.0, 1.0, *p)
    assert back == pytest.approx(0.025 + 0.15 * (1.0 + 0.97) / 2.0 - 0.1 - 0.1 * 2.25, rel=1e-12)
    assert math.isclose(tape_spring.switch(0.3, 0.0, 0.0, *p), 0.6 - 0.025 - 0.25 * 0.975, rel_tol=1e-12)
