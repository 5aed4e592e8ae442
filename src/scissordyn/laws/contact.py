"""Define the contact data that laws use, and the base classes of laws."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, Literal

from scissordyn.laws.material import Material
from scissordyn.plugin.element import SLOTS, Part, Slot
from scissordyn.units import State


@dataclass(frozen=True)
class JointContact:
    """Both surfaces of a contact, as input of the laws: a journal in its bearing, or a corner or disc at a plane surface.

    A plane surface is a bearing of infinite radius. A law for a journal in a bearing has no finite parameters there.

    Parameters
    ----------
    clearance : float
        Radial clearance c = R_B - R_J [m]; infinite for a plane surface.
    journal_radius : float
        Journal radius R_J, or radius of the corner or disc [m].
    length : float
        Bearing length L_b, or the length of the corner's edge [m].
    journal, bearing : Material
        Materials of the two surfaces.
    gap : float
        Gap between a corner and its plane surface [m]; 0 for a journal or a disc.
    """

    clearance: float
    journal_radius: float
    length: float
    journal: Material
    bearing: Material
    gap: float = 0.0

    @property
    def bearing_radius(self) -> float:
        """Bearing radius R_B = R_J + c [m]."""
        return self.journal_radius + self.clearance

    @property
    def plane(self) -> bool:
        """True if the bearing is a plane surface."""
        return math.isinf(self.clearance)

    @property
    def size(self) -> tuple[float, str]:
        """Length that indentations are compared with [m], 0 for a point, and its name."""
        if not self.plane:
            return self.clearance, "clearance"
        return self.journal_radius, "corner radius" if self.gap > 0.0 else "radius"

    @property
    def relative_radius(self) -> float:
        """Relative radius R_B R_J/(R_B - R_J) [m]: that of a ball on a plane with the same relative curvature."""
        return self.journal_radius if self.plane else self.bearing_radius * self.journal_radius / self.clearance

    @property
    def compliance(self) -> float:
        """Compliance 1/E*: the sum of (1-nu^2)/E over both surfaces [1/Pa]."""
        return self.journal.compliance + self.bearing.compliance

    @property
    def modulus(self) -> float:
        """Contact modulus E* [Pa]."""
        return 1.0 / self.compliance


class Elastic(Part):
    """Base of elastic laws: a kernel of the force [N] over the indentation > 0 [m], and optionally a kernel of its energy [J].

    Without an energy kernel the energy is computed by quadrature.
    """

    slot = Slot("stiffness", ("indentation",), {"force": (1, "force"), "energy": (1, "number")}, title="stiffness law")
    small_contact: ClassVar[bool] = False
    """True if the law assumes a contact patch that is small compared with the radii."""
    materials: ClassVar[Literal["any", "same", "steel"]] = "any"
    """Allowed materials of journal and bearing: any, two equal ones, or steel."""
    caveat: ClassVar[str] = ""
    """Limitation of the law, for the user; empty for none."""


class TangentElastic(Elastic):
    """Base of elastic laws whose force continues along its tangent beyond the indentation `deepest` [m], a kernel parameter."""

    def deepest(self, joint: JointContact) -> float:
        """Return the indentation [m] beyond which the law continues along its tangent."""
        return self.parameters(joint)[self.declaration.numbers.index("deepest")]


class Damping(Part):
    """Base of damping laws: the normal force [N] from the elastic force [N], delta [m], delta' and delta'(-) [m/s].

    A tensile force is cut off. Internal states are zero at the start of a contact. Where surfaces rest on each other, the
    kernel `settled` computes them from the elastic force and delta.
    """

    slot = Slot(
        "damping",
        ("elastic", "indentation", "rate", "approach"),
        {"force": (4, "force"), "settled": (2, "states")},
        stateful=True,
        title="damping law",
    )
    states: ClassVar[tuple[State, ...]] = ()
    """Its internal states; empty for none."""
    restitution_range: ClassVar[tuple[float, float] | None] = None
    """Range of restitution coefficients in the source; None without a restitution coefficient or a range."""


class Friction(Part):
    """Base of friction laws: the tangential force [N] from slip speed [m/s] and normal force [N], and the rates of the states.

    Further kernels compute the states at the start of a contact, those of steady sliding, and the largest |F_t| [N] that
    the law allows.
    """

    slot = Slot(
        "friction",
        ("slip_speed", "normal_force"),
        {"force": (2, "force"), "start": (1, "states"), "steady": (1, "states"), "limit": (2, "number")},
        stateful=True,
        title="friction law",
    )
    states: ClassVar[tuple[State, ...]] = ()
    """Its internal states; empty for none."""
    stiff: ClassVar[bool] = True
    """True if the law makes the equations of motion stiff."""


SLOTS.update({kind.slot.name: kind for kind in (Elastic, Damping, Friction)})
