"""Derivatives at the start of a run: a journal near its bearing, and a journal that touches it."""

import dataclasses
import json

import pytest

import scissordyn as sd
from scissordyn.sensitivity.seed import Start, parameter_of, sided_derivatives

CLEARANCE, HEIGHT, SPEED = 1e-3, 2e-4, 0.5  # Clearance and height of the bearing's centre [m], speed of the journal [m/s]

DISTANCE = (CLEARANCE**2 - HEIGHT**2) ** 0.5  # Distance that the journal flies to its first contact [m]


def flying(place):
    """Return a body whose journal is 100 mm from its origin, which is at `place` [m], and the derivatives of a contact."""
    points = {"centre": (0.1, 0.0)}
    ball = sd.Body("ball", 1.0, 1e-3, points=points, position=(place, 0.0), velocity=(SPEED, 0.0))
    hole = sd.Revolute("hole", ("ball", "centre"), ("ground", "O"), clearance=sd.Clearance(CLEARANCE, friction=sd.NoFriction()))
    return sd.Mechanism(bodies=(ball,), joints=(hole,), ground=(("O", (0.1, HEIGHT)),), gravity=0.0)


@pytest.mark.parametrize(
    ("path", "slope"),
    [
        ("body.ball.points.centre.x", -1.0 / SPEED),
        ("body.ball.position.x", -1.0 / SPEED),
        ("body.ball.position.y", HEIGHT / DISTANCE / SPEED),
    ],
)
def test_a_length_whose_hundredth_part_exceeds_the_clearance(path, slope):
    """The journal is placed in the clearance, where a change of 1.2 % of its distance would put it into the bearing."""
    found = sd.gradient(flying(0.0), of=["hole.first_contact"], by=[path], until=3e-3, start="as-placed")
    assert float(found["derivative"][0, 0]) == pytest.approx(slope, rel=1e-8)


def test_a_journal_that_touches_its_bearing():
    """A change in one direction ends the contact at the start, so that the derivative is that of the other direction."""
    begin = Start(flying(DISTANCE), "as-placed")
    slopes, one_sided, _ = sided_derivatives(begin, parameter_of(begin.mechanism, "body.ball.position.x", 1.0))
    assert one_sided is not None
    assert one_sided[0] == "larger values"
    assert one_sided[1].startswith("'body.ball.position.x': a small change of it begins or ends a contact at the start")
    assert "y" in slopes


def test_a_parameter_at_its_bound():
    """A damping of zero has the derivative of larger values."""
    spring = sd.TorsionSpring("spring", "ball", stiffness=5.0)
    held = dataclasses.replace(flying(0.0), components=(spring,))
    wanted = {"of": ["damper_loss"], "until": 1e-3, "start": "as-placed"}
    found = sd.gradient(held, by=["spring.damping", "spring.stiffness"], **wanted)
    (warning,) = json.loads(found.attrs["warnings"])
    assert warning.startswith("derivatives by 'spring.damping' are those for larger values only, for example because of this: ")
    assert "expected a number from 0" in warning


def test_an_inertia_of_zero():
    """Closed form: the angle of a rotor under a torque, by an inertia that is zero and much smaller than 1 kg m^2."""
    torque, inertia, end = 1e-3, 2e-6, 0.01
    rotor = sd.Body("rotor", 1e-3, inertia, points={"centre": (0.0, 0.0)}, position=(0.0, 0.0))
    pin = sd.Revolute("pin", ("rotor", "centre"), ("ground", "O"))
    motor = sd.Actuator("motor", "rotor", sd.PID(0.0, 0.0), reference=sd.ConstantSpeed(0.0))
    load = sd.Torque("load", "rotor", torque)
    free = sd.Mechanism(
        bodies=(rotor,), joints=(pin,), components=(motor, load), ground=(("O", (0.0, 0.0)),), tracks=(), gravity=0.0
    )
    found = sd.gradient(free, by=["motor.inertia"], until=end, trajectory=True, samples=2)
    slope = float(found["angle_derivative"].sel(body="rotor").values[-1, 0])
    assert slope == pytest.approx(-0.5 * torque * end**2 / inertia**2, rel=1e-8)


def test_start_that_is_another_one_beside_its_value():
    """Contract: speeds at the start of bending bars that meet only at this position jump there; both sides agree."""
    arm = sd.scissor(units=2, angle=0.8).driven(speed=2.0)
    bent = sd.with_bending(arm, "unit 1/bar 2", bending_stiffness=10.0, axial_stiffness=1e6, modes=1)
    with pytest.raises(sd.InputError, match="another one at all smaller and larger values"):
        sd.gradient(bent, of=["drive_work"], by=["body.unit 1/bar 2/2.position.x"], until=1e-4)
