"""Hertz's contact, in the sphere form that the clearance-joint literature uses."""

from __future__ import annotations

import math

from scissordyn.laws.contact import Elastic, JointContact
from scissordyn.plugin.element import element


def force(indentation, stiffness):
    """Return the force [N] at indentation delta > 0 [m]."""
    return stiffness * indentation * math.sqrt(indentation)


def energy(indentation, stiffness):
    """Return the work [J] up to indentation delta [m]."""
    return 0.4 * stiffness * indentation * indentation * math.sqrt(indentation)


@element(
    name="hertz",
    force=force,
    energy=energy,
    small_contact=True,
    source="Hertz 1881; for a journal in a bearing: Flores and co-workers 2006",
)
class Hertz(Elastic):
    r"""A ball of the journal's radius in a ball-shaped socket of the bearing's radius.

    .. math:: F = K \delta^{3/2},\quad K = \frac{4}{3} E^* \sqrt{\frac{R_B R_J}{R_B - R_J}}

    At a plane surface it is a ball of the corner's radius on a plane.
    """

    def parameters(self, joint: JointContact) -> tuple[float, ...]:
        """Return K [N/m^1.5]."""
        return (4.0 / 3.0 * joint.modulus * math.sqrt(joint.relative_radius),)
