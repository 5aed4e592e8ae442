"""Law of Goldsmith and of Dubowsky and Freudenstein for a pin in a hole."""

from __future__ import annotations

import math
from typing import Annotated

from scissordyn.laws.contact import JointContact
from scissordyn.laws.elastic.logarithmic import Logarithmic, row
from scissordyn.plugin.element import element
from scissordyn.units import Quantity


@element(
    name="dubowsky-freudenstein",
    source="Dubowsky, Freudenstein 1971, Dynamic Analysis of Mechanical Systems With Clearances; Goldsmith 1960, Impact",
)
class DubowskyFreudenstein(Logarithmic):
    r"""A cylindrical pin in an elastic hole.

    .. math:: \delta = \frac{F(h_B+h_J)}{L_b} \left[\ln\frac{L_b^m c}{F R_B R_J (h_B+h_J)} + 1\right],\quad
        h = \frac{1-\nu^2}{\pi E}

    m = 3 makes the logarithm's argument a pure number. Goldsmith's printing has m = 1 and Dubowsky and Freudenstein's
    has m = 2 in places; both then hold in one system of units only (here: metres and newtons).

    The citation could not be verified.
    """

    length_exponent: Annotated[float, Quantity("1", minimum=0.0, maximum=4.0, help="exponent m of the bearing length")] = 3.0

    def parameters(self, joint: JointContact) -> tuple[float, ...]:
        """Return the kernel's parameters for delta = A F ln(G/F)."""
        softness = joint.compliance / (math.pi * joint.length)
        geometry = (
            joint.length ** (self.length_exponent - 1.0) * joint.clearance / (joint.bearing_radius * joint.journal_radius)
        )
        return row(softness, geometry * math.e / softness)
