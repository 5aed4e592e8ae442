"""The input of a law from its joint, and the protocols of laws."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, Literal, Protocol, runtime_checkable

from scissordyn.laws.material import Material
from scissordyn.plugin.element import SLOTS, Part, Slot
from scissordyn.units import State


@dataclass(frozen=True)
class JointContact:
    """The two surfaces of a contact, as input of the laws: a journal in its bearing, or a rounded corner at a plane surface.

    A plane surface is a bearing of infinite radius. A law for a journal in a bearing has no finite parameters there.

    Parameters
    ----------
    clearance : float
        Radial clearance c = R_B - R_J [m]; infinite for a plane surface.
    journal_radius : float
        R_J, or the radius of the corner [m].
    length : float
        Bearing length L_b, or the length of the corner's edge [m].
    journal, bearing : Material
        Materials of the two surfaces.
    gap : float
        Between a corner and its plane surface [m]; 0 for a journal.
    """

    clearance: float
    journal_radius: float
    length: float
    journal: Material
    bearing: Material
    gap: float = 0.0

    @property
    def bearing_radius(self) -> float:
        """R_B = R_J + c [m]."""
        return self.journal_radius + self.clearance

    @property
    def plane(self) -> bool:
        """Whether the bearing is a plane surface."""
        return math.isinf(self.clearance)

    @property
    def relative_radius(self) -> float:
        """R_B R_J/(R_B - R_J), the radius of a ball on a plane with the same relative curvature [m]."""
        return self.journal_radius if self.plane else self.bearing_radius * self.journal_radius / self.clearance

    @property
    def compliance(self) -> float:
        """(1-nu^2)/E summed over both surfaces, 1/E* [1/Pa]."""
        return self.journal.compliance + self.bearing.compliance

    @property
    def modulus(self) -> float:
        """Contact modulus E* [Pa]."""
        return 1.0 / self.compliance


class Elastic(Part):
    """An elastic part: force [N] of an indentation above 0 [m], and, unless quadrature is to find it, the energy [J] of it."""

    slot = Slot("stiffness", ("indentation",), {"force": (1, "force"), "energy": (1, "number")}, title="stiffness law")
    small_contact: ClassVar[bool] = False
    """Whether the law assumes a contact patch that is small against the radii."""
    materials: ClassVar[Literal["any", "same", "steel"]] = "any"
    """Allowed materials of journal and bearing: any, the same, or steel."""
    caveat: ClassVar[str] = ""
    """Limitation of the law, for the user; empty for none."""


@runtime_checkable
class Continued(Protocol):
    """An elastic part whose source describes it up to some indentation, beyond which it goes on along its tangent."""

    name: ClassVar[str]

    def deepest(self, joint: JointContact) -> float:
        """The indentation [m] up to which the law itself holds."""


class TangentElastic(Elastic):
    """An elastic part with such a tangent, from the indentation that its kernels call `deepest`."""

    def deepest(self, joint: JointContact) -> float:
        """The indentation [m] from which the law goes on along its tangent."""
        return self.parameters(joint)[self.declaration.numbers.index("deepest")]


class Damping(Part):
    """A damping part: normal force [N] of the elastic part [N], delta [m], delta' and delta'(-) [m/s]; a pull is cut off.

    Its internal states are zero at the start of a contact, and those of its kernel `settled`, which gets the elastic part and
    delta, where surfaces rest on each other.
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
    """Range of restitution coefficients in the source; None without a restitution or a range."""


class Friction(Part):
    """A friction law: tangential force [N] of slip speed [m/s] and normal force [N], and the rates of its states.

    Its further kernels: the states at the start of a contact, those of steady sliding, the largest |F_t| [N] that it allows.
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
    """Whether the law makes the equations of motion stiff."""


SLOTS.update({kind.slot.name: kind for kind in (Elastic, Damping, Friction)})
