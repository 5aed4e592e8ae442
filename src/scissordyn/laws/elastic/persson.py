"""Persson's conformal contact of a pin in a hole."""

from __future__ import annotations

import math

from scissordyn.laws.contact import JointContact, TangentElastic
from scissordyn.laws.elastic.quadrature import NODES, WEIGHTS
from scissordyn.plugin.element import element

QUADRATURE_PIECES = 3  # Number of quadrature intervals of Persson's integral over b^2; with one, the pole costs six digits
ARC_MAX = 0.75  # Largest b^2 of the law itself; beyond, it continues along its tangent (its pole is at 0.834, delta = 10 c)


def force(indentation, scale, clearance, deepest, last_force, last_stiffness):
    """Return the force [N] at indentation delta > 0 [m]."""
    if indentation >= deepest:
        return last_force + last_stiffness * (indentation - deepest)
    q = indentation / (2.0 * clearance + indentation)  # b^2
    return scale * q * (q + 1.0) / (2.0 - math.log1p(q) - 2.0 * q * q)


def energy(indentation, scale, clearance, deepest, last_force, last_stiffness):
    """Return the work [J] up to delta [m], by quadrature over q = b^2, d delta = 2 c dq/(1 - q)^2."""
    rest = max(indentation - deepest, 0.0)
    within = indentation - rest
    last = within / (2.0 * clearance + within)
    total = 0.0
    for piece in range(QUADRATURE_PIECES):
        for k in range(NODES.size):
            q = last * (piece + NODES[k]) / QUADRATURE_PIECES
            total += WEIGHTS[k] * q * (q + 1.0) / ((2.0 - math.log1p(q) - 2.0 * q * q) * (1.0 - q) ** 2)
    return scale * 2.0 * clearance * total * last / QUADRATURE_PIECES + rest * (last_force + 0.5 * last_stiffness * rest)


@element(
    name="persson", force=force, energy=energy, materials="same", source="Persson 1964, Chalmers; Ciavarella, Decuzzi 2001"
)
class Persson(TangentElastic):
    r"""A disc in a hole of almost its size, for arcs of contact that are not small; both of one material.

    .. math::
        F = L_b E^* c \frac{\pi b^2 (b^2+1)}{2 - \ln(b^2+1) - 2b^4},\quad b = \tan\frac{\varepsilon}{2},\quad
        \cos\varepsilon = \frac{c}{c+\delta}

    By the half angle b^2 = delta/(2 c + delta), so the law is explicit. Beyond delta = 6 c it continues along its tangent.

    The citation could not be verified.
    """

    def parameters(self, joint: JointContact) -> tuple[float, ...]:
        """Return Persson's scale pi L_b E* c [N] and c [m], and indentation, force and stiffness where the tangent begins."""
        q, c = ARC_MAX, joint.clearance
        scale = math.pi * joint.length * joint.modulus * c
        below = 2.0 - math.log1p(q) - 2.0 * q * q
        ratio = q * (q + 1.0) / below
        slope = (2.0 * q + 1.0 + ratio * (1.0 / (1.0 + q) + 4.0 * q)) / below
        # q = delta/(2 c + delta):  d q/d delta = (1 - q)^2/(2 c)
        return scale, c, 2.0 * c * q / (1.0 - q), scale * ratio, scale * slope * (1.0 - q) ** 2 / (2.0 * c)
