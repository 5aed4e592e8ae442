"""The elastic foundation's tangent stiffness in place of a stiffness, as printed."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, Literal

from scissordyn.jit import kernel
from scissordyn.laws.contact import JointContact
from scissordyn.laws.elastic.quadrature import NODES, WEIGHTS

__all__ = ["BaiZhaoAsPrinted", "energy", "force"]


@dataclass(frozen=True)
class BaiZhaoAsPrinted:
    r"""The modified force of the clearance literature, for comparison only: its units are not those of a force.

    .. math:: F = K_n \delta^{3/2},\quad K_n = \frac{\pi E^*}{8} \sqrt{\frac{2\delta (3c + 2\delta)^2}{(c+\delta)^3}}

    K_n [N/m^2] is the slope dF/d delta of Liu's law for a unit length. Multiplied by delta^{3/2} it is no force, and the
    bearing's length is missing; the numbers are those that SI units give.

    The citation could not be verified.
    """

    name: ClassVar[str] = "bai-zhao-as-printed"
    kernel_kind: ClassVar[int] = 6
    source: ClassVar[str] = "Bai, Zhao 2013"
    small_contact: ClassVar[bool] = False
    materials: ClassVar[Literal["any", "same", "steel"]] = "any"
    caveat: ClassVar[str] = (
        "as printed, its units are not those of a force and the bearing length does not enter: for comparison only"
    )

    def parameters(self, joint: JointContact) -> tuple[float, ...]:
        """Scale pi E*/8 [Pa] and c [m]."""
        return 0.125 * math.pi * joint.modulus, joint.clearance


@kernel()
def force(delta, p):
    """The printed force, in SI numbers, at indentation delta > 0 [m]."""
    c = p[1]
    sum_ = c + delta
    return p[0] * delta * delta * (3.0 * c + 2.0 * delta) / sum_ * math.sqrt(2.0 / sum_)


@kernel()
def energy(delta, p):
    """Integral of the force up to delta [m]: in closed form, below one clearance, where that cancels, by quadrature."""
    c = p[1]
    if delta > c:
        # with u = c + delta the force is p[0] sqrt(2) (2 u^3 - 3 c u^2 + c^3) u^(-3/2)
        u = c + delta
        at_u = math.sqrt(u) * (0.8 * u * u - 2.0 * c * u - 2.0 * c**3 / u)
        return p[0] * math.sqrt(2.0) * (at_u + 3.2 * c * c * math.sqrt(c))
    total = 0.0
    for k in range(NODES.size):
        total += WEIGHTS[k] * force(delta * NODES[k] ** 2, p) * 2.0 * NODES[k]
    return total * delta
