"""The paper's array with a periodic drive of 8 Hz."""

import math

import pytest

import scissordyn as sd


@pytest.fixture(scope="session")
def periodic():
    """Return the ideal array."""
    drive = sd.Harmonic(math.radians(45.0), math.radians(10.0), 2.0 * math.pi * 8.0)
    return sd.scissor(units=2, angle=math.radians(45.0)).driven(drive)


@pytest.fixture(scope="session")
def frictional(periodic):
    """Return the array with friction and a small clearance, whose motion soon repeats in every cycle."""
    return periodic.with_clearance("A", sd.Clearance(0.1e-3, friction=sd.LuGre(kinetic=0.05)))


@pytest.fixture(scope="session")
def impacting(periodic):
    """Return the array without friction, whose motion does not repeat."""
    return periodic.with_clearance("A", sd.Clearance(0.5e-3))
