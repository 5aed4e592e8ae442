"""Whether two mechanisms differ only in numbers that do not enter the tables of a plan."""

from __future__ import annotations

from typing import Any

from scissordyn.model.hard_contact import contact_states
from scissordyn.model.joint import Revolute
from scissordyn.model.mechanism import Mechanism

ENTIRE = ("bodies", "ground", "welds", "guides", "rods", "latches", "couplings", "coordinate_drives")
"""Fields of a mechanism that all enter the tables."""


def same_tables(base: Mechanism, other: Mechanism) -> bool:
    """Whether two mechanisms have the same tables.

    Whatever could enter them, as a length or a mass, has them made anew: that costs time only.
    """
    return (
        all(getattr(base, name) == getattr(other, name) for name in ENTIRE)
        and [drive.body for drive in base.drives] == [drive.body for drive in other.drives]
        and [(track.body, track.point) for track in base.tracks] == [(track.body, track.point) for track in other.tracks]
        and len(base.joints) == len(other.joints)
        and all(ours is theirs or _same_joint(ours, theirs) for ours, theirs in zip(base.joints, other.joints, strict=True))
        and len(base.components) == len(other.components)
        and all(
            ours is theirs or _same_component(ours, theirs)
            for ours, theirs in zip(base.components, other.components, strict=True)
        )
    )


def _same_joint(one: Revolute, another: Revolute) -> bool:
    a, b = one.clearance, another.clearance
    if (one.name, one.journal, one.bearing) != (another.name, another.journal, another.bearing):
        return False
    if a is None or b is None:
        return a is b
    same_states = a.contact == b.contact and contact_states(a) == contact_states(b)
    return same_states and (a.lubrication is None) == (b.lubrication is None)


def _same_component(one: Any, another: Any) -> bool:
    if type(one) is not type(another) or one.declaration.motor:
        return False
    port = one.declaration.port
    return all(getattr(one, name) == getattr(another, name) for name in (*port.points, *port.turning, *port.numbers))
