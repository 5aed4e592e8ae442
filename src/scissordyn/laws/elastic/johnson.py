"""Johnson's line contact of a cylinder in a cylinder."""

from __future__ import annotations

import math

from scissordyn.laws.contact import JointContact
from scissordyn.laws.elastic.logarithmic import Logarithmic, row
from scissordyn.plugin.element import element


@element(name="johnson", source="Johnson 1985, Contact Mechanics, section 4.2, doi:10.1017/CBO9781139171731")
class Johnson(Logarithmic):
    r"""A cylinder in a cylindrical seat, on the ascending branch of the curve.

    .. math:: \delta = \frac{f}{\pi E^*} \left[\ln\frac{4\pi E^* c}{f} - 1\right],\quad f = F/L_b

    The branch ends at delta = 4 c/e^2 = 0.54 c; from 97 % of that on the law continues along its tangent.
    """

    def parameters(self, joint: JointContact) -> tuple[float, ...]:
        """Return the kernel's parameters for delta = A F ln(G/F)."""
        softness = 1.0 / (math.pi * joint.modulus * joint.length)
        return row(softness, 4.0 * joint.clearance / (softness * math.e))
