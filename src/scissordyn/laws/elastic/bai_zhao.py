"""The elastic foundation's tangent stiffness in place of a stiffness, as printed."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, Literal

from scissordyn.jit import kernel
from scissordyn.laws.contact import JointContact

__all__ = ["BaiZhaoAsPrinted", "force"]


@dataclass(frozen=True)
class BaiZhaoAsPrinted:
    r"""The modified force of the clearance literature, for comparison only: its units are not those of a force.

    .. math:: F = K_n \delta^{3/2},\quad K_n = \frac{\pi E^*}{8} \sqrt{\frac{2\delta (3c + 2\delta)^2}{(c+\delta)^3}}

    K_n [N/m^2] is the slope dF/d delta of Liu's law for a unit length. Multiplied by delta^{3/2} it is no force, and the
    bearing's length is missing; the numbers are those that SI units give.
    """

    name: ClassVar[str] = "bai-zhao-as-printed"
    kernel_kind: ClassVar[int] = 6
    source: ClassVar[str] = "Bai, Zhao 2013, doi:10.1016/j.ijnonlinmec.2012.07.003"
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
