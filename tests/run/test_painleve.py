"""Painlevé's paradox is said in the result."""

from __future__ import annotations

import json
import math

import pytest

import scissordyn as sd
from scissordyn.model.mechanism import Mechanism

HALF, MASS, RADIUS = 0.5, 1.0, 0.02
"""Half the length of a uniform rod [m], its mass [kg], and the radius of the journal at its tip [m]."""

CLEARANCE, DEPTH = 0.01, 1e-7  # Of the bearing, at whose bottom the journal slides, and the indentation at the start [m]


def sliding(angle: float, friction: float, speed: float) -> Mechanism:
    """A rod that slides with its lower tip, a journal, on the bottom of its bearing."""
    rod = sd.Body(
        name="rod",
        mass=MASS,
        inertia=MASS * HALF**2 / 3.0,
        points={"tip": (0.0, 0.0)},
        centre=(HALF, 0.0),
        position=(0.0, -CLEARANCE - DEPTH),
        angle=angle,
        velocity=(speed, 0.0),
    )
    law = sd.Ambrosio(kinetic=friction)
    ground = sd.Clearance(CLEARANCE, journal_radius=RADIUS, stiffness=sd.law("stiffness", "linear")(), friction=law)
    pin = sd.Revolute("tip", ("rod", "tip"), ("ground", "centre"), clearance=ground)
    return Mechanism((rod,), joints=(pin,), ground=(("centre", (0.0, 0.0)),))


def bracket(angle: float, friction: float, speed: float) -> float:
    """The bracket n M n - mu n M t times the mass: 1 + 3 cos th (cos th + mu s (sin th + r/a)).

    s is the sense of the sliding, a half the rod's length, r the radius of the journal.
    """
    lean = math.sin(angle) + RADIUS / HALF
    return 1.0 + 3.0 * math.cos(angle) * (math.cos(angle) + friction * math.copysign(1.0, speed) * lean)


@pytest.mark.parametrize("speed", [-1.0, 1.0])
@pytest.mark.parametrize("friction", [0.5, 1.2, 1.5, 2.0, 3.0])
def test_a_rod_that_slides_on_its_tip(friction: float, speed: float) -> None:
    """Closed form: the warning stands where the bracket is negative; a rod on a point needs a friction above 4/3."""
    for degrees in (25.0, 40.0, 55.0, 63.4, 75.0, 85.0, 120.0, 150.0):
        angle = math.radians(degrees)
        if abs(bracket(angle, friction, speed)) < 0.02:
            continue
        run = sd.simulate(sliding(angle, friction, speed), until=1e-6, samples=3, start="as-placed")
        assert bool(run["in_contact"][0, 0])
        said = [text for text in json.loads(run.attrs["warnings"]) if "Painlevé" in text]
        assert bool(said) == (bracket(angle, friction, speed) < 0.0), (degrees, said)
        if said:
            assert said[0].startswith("joint 'tip': Painlevé's paradox at ")


def test_ordinary_friction_carries_none() -> None:
    """Contract: the paper's array with its friction has no such warning."""
    loose = sd.scissor(units=2).driven(speed=sd.rpm(150)).with_clearance("A", sd.Clearance(0.5e-3, friction=sd.LuGre(0.1)))
    assert "Painlevé" not in sd.simulate(loose, until=0.02, samples=201).attrs["warnings"]
