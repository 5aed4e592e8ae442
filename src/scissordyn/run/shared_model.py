"""What mechanisms have in common that differ only in numbers which do not enter the reduced model."""

from __future__ import annotations

import threading
from typing import Any

from scissordyn.component.actuator import Actuator
from scissordyn.component.motor import Motor
from scissordyn.kept import has_kept, keep, take_over
from scissordyn.kinematics.closure import closure_template
from scissordyn.mechanics.build import build_model
from scissordyn.mechanics.outputs import body_maps
from scissordyn.mechanics.reactions import balance
from scissordyn.mechanics.reduce import reduce_mechanism
from scissordyn.model.joint import Revolute
from scissordyn.model.mechanism import Mechanism

__all__ = ["same_model", "share_model"]

REMEMBERED = 8
"""So many mechanisms are remembered; a study needs those with and without clearance or friction at some joints."""

MOST_BODIES = 500
"""Larger mechanisms are not remembered, since what is kept with them takes much memory."""

UNCHANGED = ("bodies", "ground", "welds", "guides", "rods", "latches", "components", "tracks")
"""Fields of a mechanism that all enter the reduced model, or that are not worth a comparison."""

_remembered: list[Mechanism] = []
_remembering = threading.Lock()


def share_model(mechanism: Mechanism) -> None:
    """Let a mechanism have the reduced model of one that was simulated before and was made from the same parts, if it may.

    It may if they differ only in numbers of clearances, laws without other internal states, motions of drives, and gravity.
    The reduced model, and so the run, is the same to the last bit as one that is computed anew.

    Parameters
    ----------
    mechanism : Mechanism
    """
    if has_kept(reduce_mechanism, mechanism) or len(mechanism.bodies) > MOST_BODIES:
        return
    with _remembering:
        others = [other for other in _remembered if _made_from_same_parts(other, mechanism)]
    if ideal := next((other for other in others if has_kept(closure_template, other)), None):
        take_over(closure_template, ideal, mechanism)  # it has ideal joints in any case
    known = next((other for other in others if same_model(other, mechanism)), None)
    if known is None:
        reduce_mechanism(mechanism)
    else:
        reduced = reduce_mechanism(known)
        shared = reduced.with_numbers(mechanism)
        take_over(build_model, reduced, shared)
        take_over(body_maps, reduced, shared)
        take_over(balance, known, mechanism)
        keep(reduce_mechanism, mechanism, shared)
    last = mechanism if known is None else known
    with _remembering:
        _remembered[:] = [*(other for other in _remembered if other is not last), last][-REMEMBERED:]


def _made_from_same_parts(base: Mechanism, other: Mechanism) -> bool:
    """Whether two mechanisms consist of the same objects, apart from the clearances of joints and the motions of drives.

    Equal numbers would not do: a zero has two signs, which can show in a result.
    """
    if any(getattr(base, name) is not getattr(other, name) for name in UNCHANGED):
        return False
    if len(base.joints) != len(other.joints) or [each.body for each in base.drives] != [each.body for each in other.drives]:
        return False
    joints = zip(base.joints, other.joints, strict=True)
    return all(one is another or _ends(one) == _ends(another) for one, another in joints)


def _ends(joint: Revolute) -> tuple[Any, ...]:
    return joint.name, joint.journal, joint.bearing


def same_model(base: Mechanism, other: Mechanism) -> bool:
    """Whether two mechanisms with the same joints differ only in numbers that do not enter the model.

    Whatever could enter it, as a length or a mass, has the model built anew: that costs time only.

    Parameters
    ----------
    base, other : Mechanism

    Returns
    -------
    bool
    """
    same = base.bodies == other.bodies and base.ground == other.ground and base.welds == other.welds
    same = same and base.guides == other.guides and base.rods == other.rods and base.latches == other.latches
    same = same and [drive.body for drive in base.drives] == [drive.body for drive in other.drives]
    if not same or len(base.components) != len(other.components):
        return False
    for one, another in zip(base.joints, other.joints, strict=True):
        a, b = one.clearance, another.clearance
        if one is another or (a is None and b is None):
            continue
        if a is None or b is None or a.friction.states != b.friction.states:
            return False
    return all(
        one is another
        or (type(one) is type(another) and not isinstance(one, Actuator | Motor) and _attached(one) == _attached(another))
        for one, another in zip(base.components, other.components, strict=True)
    )


def _attached(component: Any) -> tuple[Any, ...]:
    port = component.declaration.port
    return tuple(getattr(component, name) for name in (*port.points, *port.turning))
