"""Radzimovsky's line contact of two cylinders."""

from __future__ import annotations

import math
from typing import Annotated

from scissordyn.laws.contact import JointContact
from scissordyn.laws.elastic.logarithmic import Logarithmic, row
from scissordyn.plugin.element import element
from scissordyn.units import Quantity


@element(name="radzimovsky", source="Radzimovsky 1953, University of Illinois Engineering Experiment Station Bulletin 408")
class Radzimovsky(Logarithmic):
    r"""Two cylinders whose axes approach as the contact flattens to a strip of half width b.

    .. math:: \delta = \frac{f}{\pi E^*} \left[\tfrac{2}{3} + \ln\frac{4R_B}{b} + \ln\frac{4R_J}{b}\right],\quad
        b = k_b \sqrt{\frac{f R}{E^*}},\quad R = \frac{R_B R_J}{R_B - R_J},\quad f = F/L_b

    The default k_b = 2/sqrt(pi) = 1.128 is Hertz's half width. Two others are in use: b = 1.60 sqrt(f R (1-nu^2)/E)
    summed over both bodies (k_b = 1.60) and, for equal bodies with nu = 0.3, b = 2.15 sqrt(f R/E) (k_b = 1.594);
    these are full widths instead of half widths.

    The citation could not be verified.
    """

    half_width: Annotated[float, Quantity("1", minimum=0.1, maximum=10.0, help="k_b in b = k_b sqrt(f R/E*)")] = (
        2.0 / math.sqrt(math.pi)
    )

    def parameters(self, joint: JointContact) -> tuple[float, ...]:
        """Return the kernel's parameters; A [m/N] and G [N] of the form delta = A F ln(G/F) determine them."""
        softness = 1.0 / (math.pi * joint.modulus * joint.length)
        # 16 R_B R_J / b^2 = 16 c / (k_b^2 f/E*), since R_B R_J = R c; with k_b^2 = 4/pi the bracket is 2/3 + ln(4 pi E* c/f)
        argument = 16.0 * joint.clearance * joint.modulus * joint.length / self.half_width**2
        return row(softness, argument * math.exp(2.0 / 3.0))
