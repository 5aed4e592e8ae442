"""What a law may know about the joint it acts in, and what a law is."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, Literal, Protocol, runtime_checkable

from scissordyn.laws.material import Material
from scissordyn.plugin.pointer import PARAMETERS

__all__ = ["PARAMETERS", "Continued", "Damping", "Doubtful", "Elastic", "Friction", "JointContact", "Proportional"]


@dataclass(frozen=True)
class JointContact:
    """The two surfaces of a loose joint as the laws see them: a journal in its bearing, or a rounded corner at a flat wall.

    A flat wall is a bearing of infinite radius. A law that is made for a journal in a bearing has no finite parameters there.

    Parameters
    ----------
    clearance : float
        Radial clearance c = R_B - R_J [m]; infinite for a flat wall.
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
    def flat(self) -> bool:
        """Whether the bearing is a flat wall."""
        return math.isinf(self.clearance)

    @property
    def relative_radius(self) -> float:
        """R_B R_J/(R_B - R_J), the radius of a ball that meets a plane as the two surfaces meet [m]."""
        return self.journal_radius if self.flat else self.bearing_radius * self.journal_radius / self.clearance

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
    tag: ClassVar[int]
    source: ClassVar[str]
    small_contact: ClassVar[bool]
    """Whether the law takes the contact patch for small against the radii."""
    materials: ClassVar[Literal["any", "same", "steel"]]
    """What journal and bearing must be made of: anything, one material, or steel."""
    caveat: ClassVar[str]
    """What the user must know before believing the numbers, empty for nothing."""

    def parameters(self, joint: JointContact) -> tuple[float, ...]:
        """The numbers that the kernel reads, at most `PARAMETERS` of them."""


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
    """A damping part: what it makes of the elastic force."""

    name: ClassVar[str]
    tag: ClassVar[int]
    source: ClassVar[str]
    restitution_range: ClassVar[tuple[float, float] | None]
    """Restitution coefficients for which the source offers the law; None where it has no restitution or claims nothing."""

    def parameters(self, joint: JointContact) -> tuple[float, ...]:
        """The numbers that the kernel reads, at most `PARAMETERS` of them."""


@runtime_checkable
class Proportional(Damping, Protocol):
    """A damping that multiplies the elastic part by 1 + xi delta'/delta'(-), made for a restitution."""

    @property
    def restitution(self) -> float:
        """c_e [1]."""

    @property
    def factor(self) -> float:
        """Damping factor xi [1]."""


@runtime_checkable
class Friction(Protocol):
    """A friction law: tangential force against slip speed, normal force and hidden states."""

    name: ClassVar[str]
    tag: ClassVar[int]
    source: ClassVar[str]
    states: ClassVar[tuple[str, ...]]
    """Names of the hidden states, empty for a law without memory."""
    stiff: ClassVar[bool]
    """Whether the law makes the equations of motion stiff."""

    def parameters(self, joint: JointContact) -> tuple[float, ...]:
        """The numbers that the kernel reads, at most `PARAMETERS` of them."""
