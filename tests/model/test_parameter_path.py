"""Numbers of a mechanism, by their parameter paths."""

import math

import pytest

import scissordyn as sd
from scissordyn.errors import InputError
from scissordyn.model.parameter_path import find, number


@pytest.fixture
def frictional():
    """A harmonically driven unit with one clearance joint and a spring."""
    clearance = sd.Clearance(0.1e-3, damping=sd.Flores(restitution=0.9), friction=sd.LuGre(0.05))
    drive = sd.Harmonic(math.radians(30.0), math.radians(10.0), 16.0 * math.pi)
    spring = sd.Spring("coil", ("slider", "centre"), ("ground", "origin"), stiffness=100.0, free_length=0.5)
    return sd.scissor(units=1).with_clearance("A", clearance).driven(drive).replace("components", (spring,))


@pytest.mark.parametrize(
    ("path", "value", "unit"),
    [
        ("A.clearance", 0.1e-3, "m"),
        ("A.friction.kinetic", 0.05, "1"),
        ("A.damping.restitution", 0.9, "1"),
        ("A.restitution", 0.9, "1"),
        ("clearance.all.restitution", 0.9, "1"),
        ("drive.angular_frequency", 16.0 * math.pi, "rad/s"),
        ("drive.unit 1/bar 1.amplitude", math.radians(10.0), "rad"),
        ("gravity", 9.81, "m/s^2"),
        ("coil.stiffness", 100.0, "N/m"),
        ("spring.coil.stiffness", 100.0, "N/m"),
        ("joint.A.clearance", 0.1e-3, "m"),
        ("clearance.A.clearance", 0.1e-3, "m"),
        ("body.slider.mass", 5.0, "kg"),
        ("slider.mass", 5.0, "kg"),
        ("unit 1/bar 1.inertia", 5.68 / 3.0, "kg m^2"),
    ],
)
def test_a_number_and_its_change(frictional, path, value, unit):
    """Contract: what is there, its unit, and after a change the new number there and nothing else."""
    found = number(frictional, path)
    assert (found.value, found.quantity.unit) == (pytest.approx(value, rel=1e-15), unit)
    changed = frictional.replace(path, 0.5 * value)
    assert number(changed, path).value == pytest.approx(0.5 * value, rel=1e-15)
    assert changed != frictional
    assert changed.replace(path, found.value) == frictional


@pytest.mark.parametrize(
    ("path", "words"),
    [
        ("A.clearence", "did you mean 'clearance'"),
        ("A.friction", "not a number with a unit"),
        ("O.clearance", "'O' is ideal"),
        ("B.clearance", "no part 'B'"),
        ("drive.speed", "no field 'speed' in Harmonic"),
        ("drive.slider.frequency", "no field 'slider' in Harmonic"),
        ("clearance.each.clearance", "each is no name; allowed: all as the name, and each = true beside the values"),
        ("clearance.each", r"values = \"0.3 mm \+- 20 %\", each = true"),
        ("A.clearance.deeper", "nothing is called 'deeper'"),
        ("gravty", "did you mean 'gravity'"),
        ("clearnce.all.clearance", "did you mean 'clearance.all'"),
        ("joints.A.clearance", "did you mean 'joint.A'"),
        ("sprin.coil.stiffness", "did you mean 'spring.coil'"),
        ("drve.unit 1/bar 1.amplitude", "did you mean 'drive.unit 1/bar 1'"),
    ],
)
def test_paths_that_lead_nowhere(frictional, path, words):
    """Contract: one-line errors."""
    with pytest.raises(InputError, match=words):
        number(frictional, path)


def test_patterns_change_all():
    """Contract: a path with a pattern leads to all clearance joints that match, and changes them alone."""
    loose = sd.scissor(units=2).with_clearance(("A", "unit 1/pivot"), sd.Clearance(1e-4)).driven(speed=1.0)
    assert [place.value for place in find(loose, "joint.all.clearance")] == [1e-4, 1e-4]
    wider = loose.replace("clearance.all.clearance", 3e-4)
    assert [joint.clearance.clearance for joint in wider.clearance_joints] == [3e-4, 3e-4]
    assert [joint.name for joint in wider.ideal_joints] == [joint.name for joint in loose.ideal_joints]
    assert loose.replace("joint.*/pivot.clearance", 3e-4).joint("A") == loose.joint("A")


def test_a_mass_that_stands_twice_does_not_change_alone():
    """Contract: that of a bar per length, which is in its cross-sections, is refused with what to change instead."""
    bent = sd.scissor(units=1).driven(speed=1.0).with_bending(section="tube 60x60x1.5 mm", material="steel")
    parameter = f"{bent.components[0].name}.mass_per_length"
    for change in (lambda: number(bent, parameter), lambda: bent.replace(parameter, 3.0)):
        with pytest.raises(InputError, match="changed alone; allowed: the section or material"):
            change()
