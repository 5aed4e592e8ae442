"""Anagnostopoulos's dashpot, with its constant from the restitution coefficient."""

from __future__ import annotations

import math
from typing import Annotated

from scissordyn.laws.contact import Damping, JointContact
from scissordyn.laws.damping import kelvin_voigt
from scissordyn.laws.damping.proportional import PositiveRestitution
from scissordyn.plugin.element import element
from scissordyn.units import Quantity


@element(name="anagnostopoulos", force=kelvin_voigt.force, restitution_range=(0.0, 1.0), source="Anagnostopoulos 1988")
class Anagnostopoulos(Damping):
    r"""The linear dashpot that with a linear spring k gives the restitution coefficient c_e for an effective mass m.

    .. math:: F_n = F_{el} + C \delta',\quad C = 2\zeta\sqrt{k m},\quad \zeta = \frac{-\ln c_e}{\sqrt{\pi^2 + \ln^2 c_e}}

    That restitution includes the tension at the end of the contact. Without adhesion the force is set to zero there, and a
    free body rebounds a little faster (0.902 for c_e = 0.9).

    The citation could not be verified.
    """

    restitution: PositiveRestitution = 0.9
    stiffness: Annotated[float, Quantity("N/m", minimum=1e-3, maximum=1e15, help="stiffness k that the constant is for")] = 1e9
    mass: Annotated[float, Quantity("kg", minimum=1e-12, maximum=1e9, help="effective mass m of the two bodies")] = 1.0

    @property
    def damping_ratio(self) -> float:
        """Damping ratio zeta [1]."""
        loss = -math.log(self.restitution)
        return loss / math.hypot(math.pi, loss)

    def parameters(self, joint: JointContact) -> tuple[float, ...]:
        """Return C [N s/m]."""
        return (2.0 * self.damping_ratio * math.sqrt(self.stiffness * self.mass),)
