"""The input of a law from its joint, and the protocols of laws."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, Literal, Protocol, runtime_checkable

from scissordyn.laws.material import Material
from scissordyn.units import State

__all__ = ["Continued", "Damping", "Doubtful", "Elastic", "Friction", "JointContact", "Proportional"]


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
    """

    clearance: float
    journal_radius: float
    length: float
    journal: Material
    bearing: Material

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


@runtime_checkable
class Elastic(Protocol):
    """An elastic part: force against indentation."""

    name: ClassVar[str]
    source: ClassVar[str]
    small_contact: ClassVar[bool]
    """Whether the law assumes a contact patch that is small against the radii."""
    materials: ClassVar[Literal["any", "same", "steel"]]
    """Allowed materials of journal and bearing: any, the same, or steel."""
    caveat: ClassVar[str]
    """Limitation of the law, for the user; empty for none."""

    def parameters(self, joint: JointContact) -> tuple[float, ...]:
        """The numbers that the kernels read."""


@runtime_checkable
class Continued(Elastic, Protocol):
    """An elastic part whose source describes it up to some indentation, beyond which it goes on along its tangent."""

    def deepest(self, joint: JointContact) -> float:
        """The indentation [m] up to which the law itself holds."""


@runtime_checkable
class Doubtful(Protocol):
    """A user's law, which is tried in its joint: it may be usable and still not what its author meant."""

    def doubts(self, joint: JointContact) -> list[str]:
        """What is doubtful about it, one clause each."""


@runtime_checkable
class Damping(Protocol):
    """A damping part: normal force from the elastic force and the rate of indentation."""

    name: ClassVar[str]
    source: ClassVar[str]
    restitution_range: ClassVar[tuple[float, float] | None]
    """Range of restitution coefficients in the source; None without a restitution or a range."""

    def parameters(self, joint: JointContact) -> tuple[float, ...]:
        """The numbers that the kernels read."""


@runtime_checkable
class Proportional(Damping, Protocol):
    """A damping that multiplies the elastic part by 1 + xi delta'/delta'(-), with xi from a restitution coefficient."""

    @property
    def restitution(self) -> float:
        """c_e [1]."""

    @property
    def factor(self) -> float:
        """Damping factor xi [1]."""


@runtime_checkable
class Friction(Protocol):
    """A friction law: tangential force against slip speed, normal force and internal states."""

    name: ClassVar[str]
    source: ClassVar[str]
    states: ClassVar[tuple[State, ...]]
    """Its internal states; empty for none."""
    stiff: ClassVar[bool]
    """Whether the law makes the equations of motion stiff."""

    def parameters(self, joint: JointContact) -> tuple[float, ...]:
        """The numbers that the kernels read."""
