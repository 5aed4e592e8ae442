"""Line contact of ESDU item 78035."""

from __future__ import annotations

import math

from scissordyn.laws.contact import JointContact
from scissordyn.laws.elastic.logarithmic import Logarithmic, row
from scissordyn.plugin.element import element


@element(
    name="esdu-78035",
    source="ESDU 78035, Contact phenomena I, 1978; as given by Pereira et al. 2011, Nonlinear Dynamics 63, 681-697",
)
class Esdu(Logarithmic):
    r"""A cylinder in a cylindrical seat, after the engineering data item: Johnson's form with +1 instead of -1.

    .. math:: \delta = \frac{F(h_B+h_J)}{L_b} \left[\ln\frac{4 L_b c}{F(h_B+h_J)} + 1\right],\quad
        h = \frac{1-\nu^2}{\pi E}

    The citation could not be verified.
    """

    def parameters(self, joint: JointContact) -> tuple[float, ...]:
        """Return the kernel's parameters for delta = A F ln(G/F)."""
        softness = joint.compliance / (math.pi * joint.length)
        return row(softness, 4.0 * joint.clearance * math.e / softness)
