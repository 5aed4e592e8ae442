"""Friction in many ideal pins at once."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Annotated

from scissordyn.component.lugre import PinLuGre
from scissordyn.component.pin_friction import PinFriction
from scissordyn.component.place import GROUND
from scissordyn.errors import InputError
from scissordyn.laws.friction.bristle import BristleDamping
from scissordyn.model.joint import Revolute
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.pattern import matching
from scissordyn.units import Meaning, Quantity, checked, documented, quantities

_PIN = quantities(PinFriction)


@documented
@checked
def with_joint_friction(
    mechanism: Mechanism,
    joints: Annotated[
        str | Iterable[str], Meaning('names of ideal pins, "all", "pivots", "ends", or patterns as "unit 3/*"', '"pivots"')
    ] = "all",
    *,
    radius: Annotated[float, _PIN["radius"]],
    kinetic: Annotated[float, _PIN["kinetic"]],
    static: Annotated[float, _PIN["static"]] = 0.0,
    stribeck_speed: Annotated[float, _PIN["stribeck_speed"]] = 0.01,
    transition: Annotated[float, _PIN["transition"]] = 1e-3,
    bristle_stiffness: Annotated[
        float, Quantity("1/m", minimum=0.0, maximum=1e9, help="sigma_0 of LuGre's bristles; 0: none, friction is smooth")
    ] = 0.0,
    bristle_damping: BristleDamping = 316.0,
) -> Mechanism:
    """The same mechanism with friction in some ideal pins: a `PinFriction` or `PinLuGre` for each, with the name of its joint.

    Friction of that name, of a call before, is replaced; friction of another name in the same pin is an error. A pin between
    bodies that do not rotate has none.

    Returns
    -------
    Mechanism
    """
    chosen = {joint.name: joint for joint in mechanism.ideal_joints}
    chosen = {name: chosen[name] for name in matching("ideal joint", joints, list(chosen))}
    before = [part for part in mechanism.components if isinstance(part, PinFriction | PinLuGre)]
    replaced = [part for part in before if part.name in chosen]
    pairs = {frozenset((part.body, part.base)): part for part in before if part not in replaced}
    added = []
    for name, joint in chosen.items():
        other = pairs.get(frozenset(joint.bodies))
        if other is not None:
            raise InputError(f"friction in pin '{name}', which has '{other.name}' already", "one of both")
        body, base = _rotating(mechanism, joint)
        if not body:
            continue
        common = name, body, radius, kinetic, base, static, stribeck_speed
        added.append(
            PinLuGre(*common, bristle_stiffness, bristle_damping) if bristle_stiffness else PinFriction(*common, transition)
        )
    return mechanism.with_parts({"components": (*(part for part in mechanism.components if part not in replaced), *added)})


def _rotating(mechanism: Mechanism, joint: Revolute) -> tuple[str, str]:
    """A body of a joint that rotates, and the other one; no body where neither does."""
    for body, base in (joint.bodies, joint.bodies[::-1]):
        if body != GROUND and mechanism.body(body).rotates:
            return body, base
    return "", ""
