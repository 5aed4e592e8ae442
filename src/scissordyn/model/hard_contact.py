"""Hard contact in place of a compliant law: what it takes from the laws of a joint, and what it refuses."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple

from scissordyn.errors import InputError
from scissordyn.laws.damping.proportional import DampingFactor
from scissordyn.laws.friction.coefficients import static_coefficient
from scissordyn.laws.friction.none import NoFriction
from scissordyn.units import Meaning, State

if TYPE_CHECKING:
    from scissordyn.model.clearance import Clearance
    from scissordyn.model.guide_clearance import GuideClearance

ContactKind = Annotated[
    Literal["compliant", "hard"], Meaning("forces by the laws, or impulses with their restitution and friction")
]

MEAN_FRICTION = State("mean_friction", "N", scale=1.0)
"""Internal state of a hard contact: its mean friction force over the last step."""

STORED = State("stored_energy", "J", scale=1.0)  # And the elastic energy of its surfaces at the end of that step
HARD_STATES = (MEAN_FRICTION, STORED)  # In their order

_TAKEN = ("kinetic", "static")


class HardNumbers(NamedTuple):
    restitution: float  # Newton's coefficient e [1]
    kinetic: float  # Coulomb's coefficients mu_k and mu_s [1]
    static: float


def check_hard(clearance: Clearance | GuideClearance) -> None:
    """Raise `InputError` for what a hard contact does not have."""
    if clearance.contact != "hard":
        return
    if getattr(clearance, "lubrication", None) is not None:
        raise _refused("lubrication", "a dry joint", 'contact = "compliant"')
    if getattr(clearance, "slip", "surfaces") != "surfaces":
        raise _refused("slip of the contact points", "that of the surfaces")
    damping, friction = clearance.damping, clearance.friction
    if not isinstance(damping, DampingFactor):
        raise _refused(f"damping law '{damping.name}'", "a restitution coefficient", "restitution = 0.7")
    if isinstance(friction, NoFriction):
        return
    if not hasattr(friction, "kinetic"):
        raise _refused(f"friction law '{friction.name}'", "a kinetic and a static coefficient", 'friction = "none"')
    part: Any = friction
    for field in dataclasses.fields(part):
        value = getattr(friction, field.name)
        if field.name not in _TAKEN and value != field.default:
            raise _refused(f"{field.name} = {value!r} of friction law '{friction.name}'", "kinetic and static alone")


def _refused(what: str, allowed: str, sample: str = "") -> InputError:
    return InputError(f"{what} in a hard contact, which has none", allowed, sample)


def hard_numbers(clearance: Clearance | GuideClearance) -> HardNumbers:
    damping, friction = clearance.damping, clearance.friction
    restitution = float(getattr(damping, "restitution", 0.0))
    kinetic = float(getattr(friction, "kinetic", 0.0))
    static = static_coefficient(friction.name, kinetic, friction.static) if hasattr(friction, "static") else kinetic
    return HardNumbers(restitution, kinetic, static)


def contact_states(clearance: Clearance | GuideClearance) -> tuple[State, ...]:
    """Internal states of a contact: of friction, then damping, or mean friction and elastic energy of a hard contact."""
    return HARD_STATES if clearance.contact == "hard" else (*clearance.friction.states, *clearance.damping.states)
