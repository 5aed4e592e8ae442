"""Law of Bai and Zhao as printed, with the elastic foundation's tangent stiffness."""

from __future__ import annotations

import math

from scissordyn.kernel import kernel
from scissordyn.laws.contact import Elastic, JointContact
from scissordyn.laws.elastic.quadrature import NODES, WEIGHTS
from scissordyn.plugin.element import element


@kernel
def force(indentation, scale, clearance):
    """Return the value of the printed formula, which is not in N; `scale` is pi E*/8 [Pa]."""
    c = clearance
    sum_ = c + indentation
    return scale * indentation * indentation * (3.0 * c + 2.0 * indentation) / sum_ * math.sqrt(2.0 / sum_)


def energy(indentation, scale, clearance):
    """Return the integral of the force up to delta [m], by quadrature below one clearance, where the closed form cancels."""
    c = clearance
    if indentation > c:
        # with u = c + indentation the force is scale sqrt(2) (2 u^3 - 3 c u^2 + c^3) u^(-3/2)
        u = c + indentation
        at_u = math.sqrt(u) * (0.8 * u * u - 2.0 * c * u - 2.0 * c**3 / u)
        return scale * math.sqrt(2.0) * (at_u + 3.2 * c * c * math.sqrt(c))
    total = 0.0
    for k in range(NODES.size):
        total += WEIGHTS[k] * force(indentation * NODES[k] ** 2, scale, clearance) * 2.0 * NODES[k]
    return total * indentation


@element(
    name="bai-zhao-as-printed",
    force=force,
    energy=energy,
    caveat=("as printed, its units are not those of a force and the bearing length does not enter: for comparison only"),
    source="Bai, Zhao 2013",
)
class BaiZhaoAsPrinted(Elastic):
    r"""Modified force of the clearance literature, for comparison only: its units are not those of a force.

    .. math:: F = K_n \delta^{3/2},\quad K_n = \frac{\pi E^*}{8} \sqrt{\frac{2\delta (3c + 2\delta)^2}{(c+\delta)^3}}

    K_n [N/m^2] is the slope dF/d delta of Liu's law for a unit length. Multiplied by delta^{3/2} it is not a force, and the
    bearing's length is missing; the numbers are those that SI units give.

    The citation could not be verified.
    """

    def parameters(self, joint: JointContact) -> tuple[float, ...]:
        """Return the scale pi E*/8 [Pa] and c [m]."""
        return 0.125 * math.pi * joint.modulus, joint.clearance
