"""Hertz's contact, in the sphere form that the clearance-joint literature uses."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, Literal

from scissordyn.jit import kernel
from scissordyn.laws.contact import JointContact

__all__ = ["Hertz", "energy", "force"]


@dataclass(frozen=True)
class Hertz:
    r"""A ball of the journal's radius in a ball-shaped socket of the bearing's radius.

    .. math:: F = K \delta^{3/2},\quad K = \frac{4}{3} E^* \sqrt{\frac{R_B R_J}{R_B - R_J}}

    At a plane surface it is a ball of the corner's radius on a plane.
    """

    name: ClassVar[str] = "hertz"
    kernel_kind: ClassVar[int] = 1
    source: ClassVar[str] = "Hertz 1881; for a journal in a bearing: Flores and co-workers 2006"
    small_contact: ClassVar[bool] = True
    materials: ClassVar[Literal["any", "same", "steel"]] = "any"
    caveat: ClassVar[str] = ""

    def parameters(self, joint: JointContact) -> tuple[float, ...]:
        """K [N/m^1.5]."""
        return (4.0 / 3.0 * joint.modulus * math.sqrt(joint.relative_radius),)


@kernel()
def force(delta, p):
    """Force [N] at indentation delta > 0 [m]."""
    return p[0] * delta * math.sqrt(delta)


@kernel()
def energy(delta, p):
    """Work [J] to press in by delta [m]."""
    return 0.4 * p[0] * delta * delta * math.sqrt(delta)
