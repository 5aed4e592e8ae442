"""Numbers of a mechanism, by name."""

import math

import pytest

from scissordyn.errors import InputError
from scissordyn.study.parameter import parameter, varied


@pytest.mark.parametrize(
    ("path", "value", "unit"),
    [
        ("A.clearance", 0.1e-3, "m"),
        ("A.friction.kinetic", 0.05, "1"),
        ("A.damping.restitution", 0.9, "1"),
        ("drive.angular_frequency", 16.0 * math.pi, "rad/s"),
        ("drive.unit 1/bar 1.amplitude", math.radians(10.0), "rad"),
        ("gravity", 9.81, "m/s^2"),
    ],
)
def test_a_number_and_its_change(frictional, path, value, unit):
    """Identity: what is there, its unit, and after a change the new number there and nothing else."""
    found = parameter(frictional, path)
    assert (found.value, found.quantity.unit) == (pytest.approx(value, rel=1e-15), unit)
    changed = varied(frictional, path, 0.5 * value)
    assert parameter(changed, path).value == pytest.approx(0.5 * value, rel=1e-15)
    assert changed != frictional
    assert varied(changed, path, found.value) == frictional


@pytest.mark.parametrize(
    ("path", "words"),
    [
        ("A.clearence", "did you mean 'clearance'"),
        ("A.friction", "not a number with a unit"),
        ("O.clearance", "joint 'O' is ideal"),
        ("B.clearance", "'B' is neither a joint"),
        ("drive.speed", "no field 'speed' in Harmonic"),
        ("drive.slider.frequency", "body 'slider' has no drive"),
        ("A.clearance.deeper", "no field 'deeper' in float"),
        ("gravty", "did you mean 'gravity'"),
    ],
)
def test_paths_that_lead_nowhere(frictional, path, words):
    """Identity: one-line errors."""
    with pytest.raises(InputError, match=words):
        parameter(frictional, path)
