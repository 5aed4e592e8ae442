"""The clearance of a revolute joint and the laws of its contact."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Literal

from scissordyn.errors import InputError
from scissordyn.laws.contact import Damping, Elastic, Friction, JointContact
from scissordyn.laws.damping.factors import Flores
from scissordyn.laws.elastic.liu import Liu
from scissordyn.laws.friction.none import NoFriction
from scissordyn.laws.material import STEEL, Material
from scissordyn.model.hard_contact import ContactKind, check_hard
from scissordyn.model.lubrication import Lubrication
from scissordyn.units import Meaning, Quantity, Sample, check_quantities, documented

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
