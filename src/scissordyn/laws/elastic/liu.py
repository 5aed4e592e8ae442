"""Liu, Zhang and Yang's improved elastic foundation."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, Literal

from scissordyn.jit import kernel
from scissordyn.laws.contact import JointContact

__all__ = ["Liu", "force"]


@dataclass(frozen=True)
class Liu:
    r"""A journal in its bearing on an elastic foundation whose stiffness grows with the contact arc.

    .. math:: F = L_b \frac{\pi}{2} E^* \delta \sqrt{\frac{\delta}{2(c+\delta)}}
    """

    name: ClassVar[str] = "liu"
    kernel_kind: ClassVar[int] = 0
    source: ClassVar[str] = "Liu, Zhang, Yang 2007, doi:10.1016/j.mechmachtheory.2006.02.006"
    small_contact: ClassVar[bool] = False
    materials: ClassVar[Literal["any", "same", "steel"]] = "any"
    caveat: ClassVar[str] = ""

    def parameters(self, joint: JointContact) -> tuple[float, ...]:
        """L_b (pi/2) E* [N/m] and c [m]."""
        return joint.length * 0.5 * math.pi * joint.modulus, joint.clearance


@kernel()
def force(delta, p):
    """Force [N] at indentation delta > 0 [m]."""
    return p[0] * delta * math.sqrt(delta / (2.0 * (p[1] + delta)))
