"""Liu, Zhang and Yang's improved elastic foundation."""

from __future__ import annotations

import math

from scissordyn.kernel import kernel
from scissordyn.laws.contact import Elastic, JointContact
from scissordyn.laws.elastic.quadrature import NODES, WEIGHTS
from scissordyn.plugin.element import element


@kernel
def force(indentation, scale, clearance):
    """Return the force [N] at indentation delta > 0 [m]."""
    return scale * indentation * math.sqrt(indentation / (2.0 * (clearance + indentation)))


def energy(indentation, scale, clearance):
    """Return the work [J] up to delta [m]: in closed form, or by quadrature below one clearance, where that cancels."""
    c = clearance
    if indentation > c:
        arc = 0.75 * c * c * math.asinh(math.sqrt(indentation / c))
        return (
            scale * math.sqrt(0.5) * (0.25 * math.sqrt(indentation * (c + indentation)) * (2.0 * indentation - 3.0 * c) + arc)
        )
    total = 0.0
    for k in range(NODES.size):
        total += WEIGHTS[k] * force(indentation * NODES[k] ** 2, scale, clearance) * 2.0 * NODES[k]
    return total * indentation


@element(name="liu", force=force, energy=energy, source="Liu, Zhang, Yang 2007")
class Liu(Elastic):
    r"""A journal in its bearing on an elastic foundation whose stiffness grows with the contact arc.

    .. math:: F = L_b \frac{\pi}{2} E^* \delta \sqrt{\frac{\delta}{2(c+\delta)}}

    The citation could not be verified.
    """

    def parameters(self, joint: JointContact) -> tuple[float, ...]:
        """Return L_b (pi/2) E* [N/m] and c [m]."""
        return joint.length * 0.5 * math.pi * joint.modulus, joint.clearance
