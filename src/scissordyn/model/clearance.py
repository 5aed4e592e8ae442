"""The clearance of a revolute joint and the laws of its contact; what hard contact takes from them, and what it refuses."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple

from scissordyn.errors import InputError
from scissordyn.laws.contact import Damping, Elastic, Friction, JointContact
from scissordyn.laws.damping.factors import Flores
from scissordyn.laws.damping.proportional import DampingFactor
from scissordyn.laws.elastic.liu import Liu
from scissordyn.laws.friction.coefficients import static_coefficient
from scissordyn.laws.friction.none import NoFriction
from scissordyn.laws.material import STEEL, Material
from scissordyn.model.lubrication import Lubrication
from scissordyn.units import Meaning, Quantity, Sample, State, check_quantities, documented

if TYPE_CHECKING:
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
    for parameter in dataclasses.fields(part):
        value = getattr(friction, parameter.name)
        if parameter.name not in _TAKEN and value != parameter.default:
            raise _refused(f"{parameter.name} = {value!r} of friction law '{friction.name}'", "kinetic and static alone")


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


SlipKind = Annotated[
    Literal["surfaces", "contact-points"], Meaning("slip speed of the surfaces, or of the points where they touch")
]


@documented
@dataclass(frozen=True)
class Clearance:
    """A revolute clearance joint: a journal smaller than its bearing by the radial clearance.

    Hard contact has impulses in place of forces by laws, with the restitution of the damping law and the coefficients of the
    friction law. The slip speed is that of the surfaces, or, as in some papers and for comparison with them only, of the points
    where they touch: these do not turn with the bodies, and nearly all sliding is left out.
    """

    clearance: Annotated[float, Quantity("m", above=0.0, help="radial clearance c = R_B - R_J")]
    journal_radius: Annotated[float, Quantity("m", above=0.0, help="radius R_J of the journal")] = 10e-3
    bearing_length: Annotated[float, Quantity("m", above=0.0, help="axial length L_b of the bearing")] = 15e-3
    material: Annotated[Material, Meaning("of the journal, and of the bearing unless that is given", "STEEL")] = STEEL
    bearing_material: Annotated[Material | None, Meaning("of the bearing")] = None
    stiffness: Annotated[Elastic, Meaning("an elastic law", "Liu()")] = field(default_factory=Liu)
    damping: Annotated[Damping, Meaning("a damping law", "Flores(restitution=0.9)")] = field(default_factory=Flores)
    friction: Annotated[Friction, Meaning("a friction law", "Ambrosio(kinetic=0.1)")] = field(default_factory=NoFriction)
    lubrication: Annotated[
        Lubrication | None, Meaning("an oil, or a table with its viscosity", "Lubrication(viscosity=0.05)")
    ] = None
    contact: ContactKind = "compliant"
    slip: SlipKind = "surfaces"

    def __post_init__(self) -> None:
        check_quantities(self)
        if self.clearance >= self.journal_radius:
            raise InputError(
                f"clearance = {self.clearance:g} m with journal_radius = {self.journal_radius:g} m",
                "a clearance smaller than the journal radius",
                Sample("clearance", min(0.05 * self.journal_radius, 5e-4), "m"),
            )
        if self.lubrication is not None:
            self.lubrication.check(self.clearance, self.journal_radius, self.bearing_length)
        check_hard(self)

    @property
    def surfaces(self) -> JointContact:
        """The two surfaces, as input of the laws."""
        return JointContact(
            clearance=self.clearance,
            journal_radius=self.journal_radius,
            length=self.bearing_length,
            journal=self.material,
            bearing=self.material if self.bearing_material is None else self.bearing_material,
        )
