"""Points of bodies are spelled alike in Python and in case files."""

from __future__ import annotations

import pytest

import scissordyn as sd


def test_both_spellings_are_the_same_mechanism() -> None:
    """Contract: "BODY.POINT" and (BODY, POINT) give equal parts, wherever a body and a point are named."""
    arm = sd.scissor(units=2)
    for made in (
        lambda point, other: sd.Revolute("pin", point, other),
        lambda point, other: sd.Spring("spring", point, other, 10.0),
        lambda point, other: sd.Rod("rod", point, other),
        lambda point, other: sd.Weld("weld", point, other),
        lambda point, other: sd.Force("push", point, (1.0, 0.0)),
        lambda point, other: sd.Guide("guide", point, (0.0, 0.0), 0.0),
        lambda point, other: sd.common_pin("pin", point, other),
        lambda point, other: sd.with_payload(arm, point, 2.0),
        lambda point, other: arm.controlled(sd.PID(10.0), sensor=point),
        lambda point, other: arm.place(point),
    ):
        pairs = ("unit 2/bar 1", "end"), ("unit 1/bar 2", "start")
        assert made(*map(".".join, pairs)) == made(*pairs)


def test_a_joint_goes_before_a_point() -> None:
    """Contract: where a joint or a point may be named, the name of a joint is a joint."""
    arm = sd.scissor(units=1)
    assert arm.joint_or_point("A") == arm.joint("A")
    assert arm.joint_or_point("slider.centre") == ("slider", "centre")
    with pytest.raises(sd.InputError, match="joint 'B'"):
        arm.joint_or_point("B")


@pytest.mark.parametrize("given", ["", "end", ".end", "bar.", ("bar",), 3])
def test_what_is_no_point(given: object) -> None:
    """Contract: one line that says what is wanted."""
    with pytest.raises(sd.InputError, match=r"joint 'pin'|Revolute"):
        sd.Revolute("pin", given, ("ground", "O"))  # type: ignore[arg-type]
