"""Forces, energies and powers of the components at one state each, against numbers worked out by hand."""

import math

import numpy as np
import pytest

import scissordyn as sd
from scissordyn.components.stop import push, stop_damping
from scissordyn.laws.damping.exact import returned_restitution
from scissordyn.plugin.element import arguments_of

from .shared import ENDS

XI = 8.0 * (1.0 - 0.4) / (5.0 * 0.4)
"""Damping factor of Flores et al. 2011 (doi:10.1007/s11044-010-9237-4) for a restitution coefficient of 0.4."""
ELASTIC = 1e6 * 0.01**1.5  # [N, N m] elastic force K d^n of a stop at an indentation of 10 mm or 10 mrad
PUSH, STORED, LOST = ELASTIC * (1.0 + 0.2 * XI), ELASTIC * 0.01 / 2.5, 0.02 * XI * ELASTIC
"""Force, stored energy and dissipated power of the stop at 0.1 m/s, a fifth of its approach speed."""

START_COORDINATES = 0.3, 0.0, 0.1  # Coordinates of a port at the start; the side of a stop and a free angle depend on them

SPRING = {"stiffness": 50.0, "damping": 3.0}  # Stiffness [N/m] and damping [N s/m] of springs and cables
CABLE = sd.Cable("c", *ENDS, free_length=0.3, **SPRING)  # Cable whose force is compared with its formula
# Constant-force spring whose force is compared with its formula
DRUM = sd.ConstantForceSpring("d", *ENDS, tension=8.0, uncoiling_length=0.4, damping=3.0)
# Parameters of a bushing in SI units
BUSHING_PARAMETERS = {"stiffness_x": 10.0, "stiffness_y": 20.0, "stiffness_xy": 5.0, "torsional_stiffness": 7.0}
BUSHING_PARAMETERS |= {"damping_x": 1.0, "damping_y": 2.0, "damping_xy": 0.5, "torsional_damping": 0.3}
# Motors with a stall torque of 4 N m, by the sense of their torque
MOTORS = {sense: sd.Motor("m", "one", stall_torque=sense * 4.0, no_load_speed=10.0, limit=3.0) for sense in (1.0, -1.0)}
STOP = {"stiffness": 1e6, "exponent": 1.5, "restitution": 0.4}  # Parameters of the contact law of end stops
TRAVEL = sd.TravelStop("t", ENDS[1], direction=0.0, limit=1.5, **STOP)  # End stop of a displacement at 1.5 m
# End stops of an angle at 1.5 rad, by the side on which they act
ANGLE_STOPS = {side: sd.AngleStop("a", "one", angle=side * 1.5, **STOP) for side in (1.0, -1.0)}
LATCH = sd.Latch("l", "one", angle=-0.5)  # Latch at an angle of -0.5 rad
# Forces of 5 N by whether they follow the body
FORCES_OF_PUSH = {False: sd.Force("f", ENDS[1], (3.0, 4.0)), True: sd.Force("f", ENDS[1], (3.0, 4.0), follows=True)}
# Coordinates of a port at an angle of arctan(4/3): position, direction, and rates of zero
TURNED_COORDINATES = (0.0, 0.0, 0.6, 0.8, *[0.0] * 4)
TAPE = sd.TapeSpring("t", "one", "ground", 10.0, 2.0, 0.5, 1.0, 0.3, 0.1)
"""Tape spring: straight branch of 10 N m/rad up to 2 and -1 N m, folded moments 0.5 and -0.3 N m, free angle 0.1 rad."""
TABLES = sd.TapeSpring(
    *("t", "one"),
    straight=((-0.2, -2.0), (0.0, 0.0), (0.1, 2.0), (0.3, 3.0)),
    folded=((-1.0, -0.6), (-0.05, -0.5), (0.05, 1.0), (1.05, 0.8)),
)
"""Tape spring with piecewise linear branches of three and two points, and constant moments beyond them."""

# Component, coordinates and other arguments, expected results, and allowed relative error of force kernels
FORCE_CASES = [
    (sd.Spring("s", *ENDS, free_length=0.3, **SPRING), (0.5, 0.7), (10.0 + 2.1, 1.0, 1.47), 1e-14),
    (sd.TorsionSpring("s", "one", free_angle=0.3, **SPRING), (0.5, 0.7), (-12.1, 1.0, 1.47), 1e-14),
    (CABLE, (0.5, 0.7, 1.0), (12.1, 1.0, 1.47, 1.0), 1e-14),
    # slack nothing; a damper that would push leaves no tension and takes the spring's power
    (CABLE, (0.5, 0.7, 0.0), (0.0, 0.0, 0.0, 0.0), 0.0),
    (CABLE, (0.25, 0.7, 1.0), (0.0, 0.0, 0.0, 1.0), 0.0),
    (CABLE, (0.5, -4.0, 1.0), (0.0, 1.0, 40.0, 1.0), 1e-14),
    (CABLE, (0.5, -3.32, 1.0), (0.04, 1.0, 3.0 * 3.32**2, 1.0), 1e-12),
    (DRUM, (0.9, 0.7), (10.1, 8.0 * 0.7, 1.47), 1e-14),
    (DRUM, (0.1, 0.7), (2.0 + 2.1, 0.1, 1.47), 1e-14),
    (
        sd.Bushing("b", *ENDS, **BUSHING_PARAMETERS, free_angle=0.2),
        (0.1, -0.2, 0.6, 0.3, 0.4, 0.5),
        (
            *(-0.5, 3.5 - 0.95, -2.8 - 0.15),
            0.5 * (10.0 * 0.01 + 20.0 * 0.04 - 2.0 * 5.0 * 0.02 + 7.0 * 0.16),
            1.0 * 0.09 + 2.0 * 0.16 + 2.0 * 0.5 * 0.12 + 0.3 * 0.25,
        ),
        1e-13,
    ),
    # 4 N m at rest, falling to nothing at 10 rad/s, cut at 3 N m either way; mirrored for the other sense
    *(
        (MOTORS[1.0], (0.0, speed), (torque,), 1e-14)
        for speed, torque in ((-5.0, 3.0), (0.0, 3.0), (5.0, 2.0), (12.5, -1.0), (30.0, -3.0))
    ),
    (MOTORS[-1.0], (0.0, -5.0), (-2.0,), 1e-14),
    (FORCES_OF_PUSH[False], (*TURNED_COORDINATES, 2.0), (6.0, 8.0), 1e-14),
    (FORCES_OF_PUSH[True], (*TURNED_COORDINATES, 2.0), (2.0 * (3.0 * 0.6 - 4.0 * 0.8), 2.0 * (3.0 * 0.8 + 4.0 * 0.6)), 1e-14),
    (sd.Torque("t", "one", 5.0), (0.0, 0.0, 2.0), (10.0,), 1e-14),
    (TRAVEL, (1.51, 0.1, 1.0, 0.5, 1e9), (-PUSH, STORED, LOST), 1e-11),
    *(
        (stop, (side * 1.51, side * 0.1, 1.0, 0.5, 1e9), (-side * PUSH, STORED, LOST), 1e-11)
        for side, stop in ANGLE_STOPS.items()
    ),
    (TAPE, (0.25, 0.0, 0.0), (-1.5, 0.5 * 10.0 * 0.15**2, 0.0, 0.0), 1e-12),
    # folded: stored where it snaps back, at 0.05 and -0.03, and then the steady moment times the angle
    (TAPE, (1.1, 0.0, 1.0), (-0.5, 0.0125 + 0.5 * 0.95, 0.0, 1.0), 1e-12),
    (TAPE, (-0.9, 0.0, 1.0), (0.3, 0.0045 + 0.3 * 0.97, 0.0, 1.0), 1e-12),
    (TABLES, (0.2, 0.0, 0.0), (-2.5, 0.1 + 0.5 * 0.1 * 4.5, 0.0, 0.0), 1e-12),
    (TABLES, (-0.1, 0.0, 0.0), (1.0, 0.05, 0.0, 0.0), 1e-12),
    (TABLES, (0.4, 0.0, 0.0), (-3.0, 0.1 + 0.5 + 0.3, 0.0, 0.0), 1e-12),
    (TABLES, (-0.3, 0.0, 0.0), (2.0, 0.2 + 0.2, 0.0, 0.0), 1e-12),
    (TABLES, (0.55, 0.0, 1.0), (-0.9, 0.025 + 0.5 * 0.95, 0.0, 1.0), 1e-12),
    (TABLES, (2.05, 0.0, 1.0), (-0.8, 0.025 + 0.9 + 0.8, 0.0, 1.0), 1e-12),
    (TABLES, (-0.525, 0.0, 1.0), (0.55, 0.0125 + 0.475 * 0.525, 0.0, 1.0), 1e-12),
    (TABLES, (-0.201, 0.0, 0.0), (2.0, 0.2 + 0.002, 0.0, 0.0), 1e-12),
]
# Component, kernel, arguments, expected results, and allowed relative error of gap and switch kernels
GUARD_CASES = [
    (CABLE, "gap", (0.5, 0.7), (0.2, 0.7), 1e-14),
    (TRAVEL, "gap", (1.51, 0.1), (0.01, 0.1), 1e-12),
    *((stop, "gap", (side * 1.51, side * 0.1), (0.01, 0.1), 1e-12) for side, stop in ANGLE_STOPS.items()),
    (LATCH, "gap", (-0.7, -2.0, 0.0), (0.2, 2.0), 1e-14),
    (LATCH, "gap", (9.0, 0.0, 1.0), (1.0, 0.0), 0.0),  # locked it stays
    (TAPE, "gap", (0.35, 2.0, 0.0), (0.05, 2.0), 1e-12),
    (TAPE, "gap", (-0.05, -2.0, 0.0), (0.05, 2.0), 1e-12),
    (TAPE, "gap", (0.35, 2.0, 1.0), (0.2, 2.0), 1e-12),
    (TAPE, "gap", (-0.05, -2.0, 1.0), (0.12, 2.0), 1e-12),
    (TAPE, "switch", (0.3, 0.0, 0.0), (0.2 - 0.0125 - 0.5 * 0.15,), 1e-12),
    (TABLES, "switch", (0.2, 0.0, 1.0), (0.025 + 0.15 * (1.0 + 0.97) / 2.0 - 0.1 - 0.1 * 2.25,), 1e-12),
    (TABLES, "switch", (0.3, 0.0, 0.0), (0.6 - 0.025 - 0.25 * 0.975,), 1e-12),
]


@pytest.mark.parametrize(
    ("part", "kernel", "state", "expected", "bound"), [*((part, "force", *row) for part, *row in FORCE_CASES), *GUARD_CASES]
)
def test_kernel_at_one_state(part, kernel, state, expected, bound):
    """Closed form: what a kernel gives of coordinates, rates and context of its component, to so many digits."""
    declared, numbers = part.declaration, part.parameters(START_COORDINATES)
    values = dict(zip((*declared.port.coordinates, *declared.port.rates, *declared.context), state, strict=False))
    values |= {**dict(zip(declared.numbers, numbers, strict=False)), "table": np.array(numbers)}
    function = declared.kernels[kernel]
    found = function(*map(values.__getitem__, arguments_of(function)))
    assert np.atleast_1d(found) == pytest.approx(expected, rel=bound, abs=0.0)


def test_free_angle_of_a_bushing():
    """Closed form: as placed unless it is given."""
    assert sd.Bushing("b", *ENDS).parameters(START_COORDINATES)[-1] == 0.1


def test_push_of_a_stop():
    """Closed form: never a pull, and nothing from outside."""
    assert stop_damping(0.4) == pytest.approx(XI, rel=1e-14)
    assert push(1.0, 0.5, 1e9, 0.01, 0.1, 1e6, 1.5, XI) == pytest.approx((PUSH, STORED, LOST), rel=1e-13)
    assert push(1.0, 0.5, 1e9, 0.01, -0.5, 1e6, 1.5, XI)[0] == 0.0
    assert push(0.0, 0.5, 1e9, 0.01, 0.1, 1e6, 1.5, XI) == (0.0, 0.0, 0.0)


def test_push_of_a_stop_that_is_loaded():
    """Closed form: beyond twice the approach speed damping refers to half of the speed that motion and strain are worth."""
    mass, rate = 2.0, 0.1
    loaded = 0.5 * math.hypot(rate, math.sqrt(ELASTIC * 0.01 / mass))
    assert loaded > 1.0
    force = ELASTIC * (1.0 + XI * rate / loaded)
    assert push(1.0, 0.5, mass, 0.01, rate, 1e6, 1.5, XI)[0] == pytest.approx(force, rel=1e-13)


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
        return sd.TapeSpring("t", "one", straight=straight, folded=folded)

    peak = (0.3375 - 0.5 * 0.25 * 0.2) / (0.5 * 0.25)  # at the end of a ramp from 0.2 as much work as of the straight branch
    made(*negative, (0.05, 0.2), (0.3, peak - 1e-9), (1.0, 0.3))
    with pytest.raises(sd.InputError, match=r"takes 0\.0125 J more than the straight tape up to the snap at 0\.3 rad"):
        made(*negative, (0.05, 0.2), (0.3, peak + 0.1), (1.0, 0.3))
    with pytest.raises(sd.InputError, match=r"takes 0\.0075 J more than the straight tape up to the snap at -0\.2 rad"):
        made((-1.0, -0.2), (-0.2, 0.1 - (0.1625 + 0.0075) / 0.075), (-0.05, -0.1), *positive)


@pytest.mark.parametrize(("restitution", "rebound"), [(0.5, "0.470"), (0.1, "0.069")])
def test_rebound_of_an_end_stop(restitution, rebound):
    """Cross-check: a wheel rebounds from its stop as documented; second road: the equation of free bodies."""
    wheel = sd.Body("one", 1.0, 0.5, {"pin": (0.0, 0.0)}, position=(0.0, 0.0), angle=0.0, angular_velocity=2.0)
    stop = sd.AngleStop("stop", "one", angle=0.2, stiffness=1e5, restitution=restitution)
    pin = sd.Revolute("pin", ("one", "pin"), ("ground", "O"))
    made = sd.Mechanism((wheel,), (pin,), ground=(("O", (0.0, 0.0)),), components=(stop,), gravity=0.0)
    found = -sd.simulate(made, until=0.4, samples=3, rtol=1e-9)["angular_velocity"].values[-1, 0] / 2.0
    assert found == pytest.approx(returned_restitution(stop_damping(restitution)), rel=1e-7)
    assert f"{found:.3f}" == rebound
    for kind in (sd.AngleStop, sd.TravelStop, sd.Cam, sd.Roller):
        assert rebound in kind.__doc__
