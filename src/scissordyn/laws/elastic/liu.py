"""Liu, Zhang and Yang's improved elastic foundation."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, Literal

from scissordyn.jit import kernel
from scissordyn.laws.contact import JointContact
from scissordyn.laws.elastic.quadrature import NODES, WEIGHTS

__all__ = ["Liu", "energy", "force"]


@dataclass(frozen=True)
class Liu:
    r"""A journal in its bearing on an elastic foundation whose stiffness grows with the contact arc.

    .. math:: F = L_b \frac{\pi}{2} E^* \delta \sqrt{\frac{\delta}{2(c+\delta)}}

    The citation could not be verified.
    """

    name: ClassVar[str] = "liu"
    kernel_kind: ClassVar[int] = 0
    source: ClassVar[str] = "Liu, Zhang, Yang 2007"
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


@kernel()
def energy(delta, p):
    """Work [J] to press in by delta [m]: in closed form, below one clearance, where that cancels, by quadrature."""
    c = p[1]
    if delta > c:
        arc = 0.75 * c * c * math.asinh(math.sqrt(delta / c))
        return p[0] * math.sqrt(0.5) * (0.25 * math.sqrt(delta * (c + delta)) * (2.0 * delta - 3.0 * c) + arc)
    total = 0.0
    for k in range(NODES.size):
        total += WEIGHTS[k] * force(delta * NODES[k] ** 2, p) * 2.0 * NODES[k]
    return total * delta
