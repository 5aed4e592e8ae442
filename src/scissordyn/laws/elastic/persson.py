"""Persson's conformal contact of a pin in a hole."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, Literal

from scissordyn.jit import kernel
from scissordyn.laws.contact import JointContact
from scissordyn.laws.elastic.quadrature import NODES, WEIGHTS

__all__ = ["Persson", "energy", "force"]

PIECES = 3
"""Of the range of b^2 in the quadrature of the energy: in one piece the pole would cost six digits."""

LAST_ARC = 0.75
"""b^2 from which on the tangent continues the law: its pole is at 0.834, at about ten clearances."""


@dataclass(frozen=True)
class Persson:
    r"""A disc in a hole of almost its size, for arcs of contact that are not small; both of one material.

    .. math::
        F = L_b E^* c \frac{\pi b^2 (b^2+1)}{2 - \ln(b^2+1) - 2b^4},\quad b = \tan\frac{\varepsilon}{2},\quad
        \cos\varepsilon = \frac{c}{c+\delta}

    By the half angle b^2 = delta/(2 c + delta), so the law is explicit. Beyond delta = 6 c it continues along its tangent.

    The citation could not be verified.
    """

    name: ClassVar[str] = "persson"
    kernel_kind: ClassVar[int] = 5
    source: ClassVar[str] = "Persson 1964, Chalmers; Ciavarella, Decuzzi 2001"
    small_contact: ClassVar[bool] = False
    materials: ClassVar[Literal["any", "same", "steel"]] = "same"
    caveat: ClassVar[str] = ""

    def parameters(self, joint: JointContact) -> tuple[float, ...]:
        """Scale pi L_b E* c [N], c [m], and at the tangent the indentation [m], the force [N] and the stiffness [N/m]."""
        q, c = LAST_ARC, joint.clearance
        scale = math.pi * joint.length * joint.modulus * c
        below = 2.0 - math.log1p(q) - 2.0 * q * q
        ratio = q * (q + 1.0) / below
        slope = (2.0 * q + 1.0 + ratio * (1.0 / (1.0 + q) + 4.0 * q)) / below
        # q = delta/(2 c + delta):  d q/d delta = (1 - q)^2/(2 c)
        return scale, c, 2.0 * c * q / (1.0 - q), scale * ratio, scale * slope * (1.0 - q) ** 2 / (2.0 * c)

    def deepest(self, joint: JointContact) -> float:
        """The indentation [m] from which the law goes on along its tangent."""
        return self.parameters(joint)[2]


@kernel()
def force(delta, p):
    """Force [N] at indentation delta > 0 [m]."""
    if delta >= p[2]:
        return p[3] + p[4] * (delta - p[2])
    q = delta / (2.0 * p[1] + delta)  # b^2
    return p[0] * q * (q + 1.0) / (2.0 - math.log1p(q) - 2.0 * q * q)


@kernel()
def energy(delta, p):
    """Work [J] to press in by delta [m], by quadrature over q = b^2, d delta = 2 c dq/(1 - q)^2."""
    rest = max(delta - p[2], 0.0)
    within = delta - rest
    last = within / (2.0 * p[1] + within)
    total = 0.0
    for piece in range(PIECES):
        for k in range(NODES.size):
            q = last * (piece + NODES[k]) / PIECES
            total += WEIGHTS[k] * q * (q + 1.0) / ((2.0 - math.log1p(q) - 2.0 * q * q) * (1.0 - q) ** 2)
    return p[0] * 2.0 * p[1] * total * last / PIECES + rest * (p[3] + 0.5 * p[4] * rest)
