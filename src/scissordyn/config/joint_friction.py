"""Friction in many ideal pins at once, in a case file."""

from __future__ import annotations

from typing import Annotated

from scissordyn.config.shape import About
from scissordyn.config.table import Call, table_of_call
from scissordyn.model.joint_friction import with_joint_friction

JointFrictionTable = table_of_call(
    with_joint_friction,
    (
        ("mechanism", None),
        ("joints", Annotated[str, About('ideal pins: "all", "pivots", "unit 1/*", or a name', examples=["all"])]),
    ),
    base=Call,
    spelt={"joints": "joint"},
    radius="10 mm",
    kinetic=0.1,
)
"""Friction in some ideal pins."""
