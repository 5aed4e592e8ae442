"""Names, words and patterns that choose joints."""

import pytest

import scissordyn as sd
from scissordyn.errors import InputError
from scissordyn.model.parameter_path import matching

PIN = sd.Clearance(0.5e-3)


def clearance_joints(*patterns):
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
    """Contract: names, words and patterns choose the joints they say, in the order of the mechanism."""
    assert clearance_joints(*patterns) == expected


def test_all():
    """Contract: "all" is every revolute joint, and a single string is as good as a list of one."""
    arm = sd.scissor(units=3)
    assert arm.with_clearance("all", PIN).clearance_joints == arm.with_clearance(["*"], PIN).clearance_joints
    assert arm.with_clearance("all", PIN).ideal_joints == ()
    assert arm.with_clearance("all", PIN).ideal() == arm


def test_a_name_goes_before_a_word():
    """Contract: a joint that is called like a word or a pattern is itself."""
    assert matching("joint", "all", ("all", "other")) == ("all",)
    assert matching("joint", "a[1]", ("a1", "a[1]")) == ("a[1]",)


@pytest.mark.parametrize(
    ("pattern", "hint"), [("unit 1/pivto", "did you mean 'unit 1/pivot'"), ("pivot", "did you mean"), ("unit 9/*", "pattern")]
)
def test_nothing_matches(pattern, hint):
    """Contract: a pattern that matches nothing is refused with the nearest name."""
    with pytest.raises(InputError, match="joint") as caught:
        sd.scissor(units=3).with_clearance(pattern, PIN)
    assert hint in str(caught.value)
    assert "\n" not in str(caught.value)


def test_no_names():
    """Contract: an empty list of joints is an error, not a mechanism that stays as it was."""
    with pytest.raises(InputError, match="no joint named"):
        sd.scissor(units=3).with_clearance([], PIN)
