"""Patterns of part names, parameter paths, and the walk over all values of a mechanism."""

import math
from collections.abc import Mapping

import pytest
from tests.build import EXAMPLES, one_line_error

import scissordyn as sd
from scissordyn.model.parameter_path import every_number, find, matching, number
from scissordyn.model.walk import Place, at, declared, is_described, non_default_fields, replaced

PIN = sd.Clearance(0.5e-3)  # Clearance of the joints


def clearance_joints(*patterns):
    """Return the clearance joints of an array of three units with clearances at the joints of some patterns."""
    return [joint.name for joint in sd.scissor(units=3).with_clearance(patterns, PIN).clearance_joints]


@pytest.mark.parametrize(
    ("patterns", "expected"),
    [
        (("A",), ["A"]),
        (("unit 2/pivot", "O"), ["O", "unit 2/pivot"]),
        (("pivots",), ["unit 1/pivot", "unit 2/pivot", "unit 3/pivot"]),
        (("ends",), ["unit 1/upper", "unit 1/lower", "unit 2/upper", "unit 2/lower"]),
        (("unit 2/*",), ["unit 2/pivot", "unit 2/upper", "unit 2/lower"]),
        (("unit [13]/pivot", "A"), ["A", "unit 1/pivot", "unit 3/pivot"]),
    ],
)
def test_patterns(patterns, expected):
    """Contract: names, groups and patterns choose joints, in the order of the mechanism."""
    assert clearance_joints(*patterns) == expected


def test_all():
    """Contract: "all" means every revolute joint, and a single text is equal to a list of one."""
    arm = sd.scissor(units=3)
    assert arm.with_clearance("all", PIN).clearance_joints == arm.with_clearance(["*"], PIN).clearance_joints
    assert arm.with_clearance("all", PIN).ideal_joints == ()
    assert arm.with_clearance("all", PIN).ideal() == arm


def test_names_take_precedence_over_patterns():
    """Contract: a joint with the name of a group or pattern is chosen by its name."""
    assert matching("joint", "all", ("all", "other")) == ("all",)
    assert matching("joint", "a[1]", ("a1", "a[1]")) == ("a[1]",)


@pytest.mark.parametrize(
    ("pattern", "hint"), [("unit 1/pivto", "did you mean 'unit 1/pivot'"), ("pivot", "did you mean"), ("unit 9/*", "pattern")]
)
def test_nothing_matches(pattern, hint):
    """Contract: a pattern without a match is refused with the nearest name."""
    with one_line_error("joint", hint):
        sd.scissor(units=3).with_clearance(pattern, PIN)


def test_no_names():
    """Contract: an empty list of joints is an error."""
    with pytest.raises(sd.InputError, match="no joint given"):
        sd.scissor(units=3).with_clearance([], PIN)


@pytest.fixture
def frictional():
    """Return a harmonically driven unit with one clearance joint and a spring."""
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
def test_value_at_a_path(frictional, path, value, unit):
    """Contract: a path gives a value with its unit, and a change of it changes nothing else."""
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
        ("clearance.each.clearance", "'each' is not a name; expected 'all' as the name, and each = true next to the values"),
        ("clearance.each", r"values = \"0.3 mm \+- 20 %\", each = true"),
        ("A.clearance.deeper", "'deeper' follows a number or a text"),
        ("gravty", "did you mean 'gravity'"),
        ("clearnce.all.clearance", "did you mean 'clearance.all'"),
        ("joints.A.clearance", "did you mean 'joint.A'"),
        ("sprin.coil.stiffness", "did you mean 'spring.coil'"),
        ("drve.unit 1/bar 1.amplitude", "did you mean 'drive.unit 1/bar 1'"),
    ],
)
def test_invalid_paths(frictional, path, words):
    """Contract: an invalid path is refused in one line, with the nearest name."""
    with pytest.raises(sd.InputError, match=words):
        number(frictional, path)


def test_patterns_change_all():
    """Contract: a path with a pattern refers to all matching clearance joints and changes only them."""
    loose = sd.scissor(units=2).with_clearance(("A", "unit 1/pivot"), sd.Clearance(1e-4)).driven(speed=1.0)
    assert [place.value for place in find(loose, "joint.all.clearance")] == [1e-4, 1e-4]
    wider = loose.replace("clearance.all.clearance", 3e-4)
    assert [joint.clearance.clearance for joint in wider.clearance_joints] == [3e-4, 3e-4]
    assert [joint.name for joint in wider.ideal_joints] == [joint.name for joint in loose.ideal_joints]
    assert loose.replace("joint.*/pivot.clearance", 3e-4).joint("A") == loose.joint("A")


def test_mass_per_length_of_a_bar_cannot_change_alone():
    """Contract: the mass per length follows from the cross-sections; the error says what to change instead."""
    bent = sd.with_bending(sd.scissor(units=1).driven(speed=1.0), section="tube 60x60x1.5 mm", material="steel")
    parameter = f"{bent.components[0].name}.mass_per_length"
    for change in (lambda: number(bent, parameter), lambda: bent.replace(parameter, 3.0)):
        with pytest.raises(sd.InputError, match="cannot change alone; expected the section or material"):
            change()


def test_masses_of_payloads_do_not_change_alone():
    """Contract: the mass of a body includes them, so that another one would change nothing but the picture."""
    loaded = sd.scissor(units=1)
    for end, mass in (("end", 2.0), ("start", 1.0)):
        loaded = sd.with_payload(loaded, f"unit 1/bar 1.{end}", mass=mass)
    assert not [path for path in every_number(loaded) if ".payloads" in path]
    for path in ("payloads", "payloads.x"):
        with pytest.raises(sd.InputError, match="cannot change alone; expected the mass of the body"):
            loaded.replace(f"unit 1/bar 1.{path}", 3.0)


def leaves(value, path=(), quantity=None):
    """Yield every elementary value of a description; a tuple with a unit, such as a position, is one value."""
    if is_described(value):
        for field in declared(type(value)).values():
            yield from leaves(getattr(value, field.name), (*path, field.name), field.quantity)
    elif isinstance(value, Mapping) or (isinstance(value, tuple) and quantity is None):
        for key, inner in value.items() if isinstance(value, Mapping) else enumerate(value):
            yield from leaves(inner, (*path, key), quantity)
    else:
        yield Place(path, value, quantity)


FILES = sorted(EXAMPLES.glob("*.toml"))  # Case files of all examples


@pytest.mark.parametrize("case", FILES, ids=lambda path: path.stem)
def test_every_value_is_found_and_replaced_at_its_path(case):
    """Contract: each value is found at its path, and replacing it changes that value only."""
    mechanism = sd.read_case(case).mechanism
    met = list(leaves(mechanism))
    assert len({leaf.path for leaf in met}) == len(met) > 10
    assert all(at(mechanism, leaf.path) is leaf.value for leaf in met)
    masses = [
        leaf for leaf in met if leaf.quantity is not None and leaf.quantity.unit == "kg" and isinstance(leaf.value, float)
    ]
    assert masses
    for leaf in masses[:4]:
        new = replaced(mechanism, leaf.path, 1.25 * leaf.value)
        changed = [(one.path, two.value) for one, two in zip(met, leaves(new), strict=True) if one.value != two.value]
        assert changed == [(leaf.path, 1.25 * leaf.value)]


@pytest.mark.parametrize("case", FILES, ids=lambda path: path.stem)
def test_given_fields_rebuild_a_part(case):
    """Contract: the fields that differ from their defaults build an equal description."""
    mechanism = sd.read_case(case).mechanism
    parts = [part for field in ("bodies", "joints", "guides", "drives", "components") for part in getattr(mechanism, field)]
    assert parts
    assert all(map(is_described, parts))
    for part in (mechanism, *parts):
        assert type(part)(**{field.name: value for field, value in non_default_fields(part)}) == part


def test_points_are_values_with_a_unit():
    """Contract: points are values in metres, by name; a centre of -0.0 is not its default."""
    body = sd.Body("rod", 1.0, 0.1, points={"tip": (0.2, 0.0)}, centre=(-0.0, 0.0))
    units = {leaf.path: leaf.quantity.unit for leaf in leaves(body) if leaf.quantity is not None}
    assert units["points", "tip"] == units["centre",] == "m"
    assert [field.name for field, _ in non_default_fields(body)] == ["name", "mass", "inertia", "points", "centre"]
