"""Pereira, Ramalho and Ambrosio's fit for cylinders in cylinders."""

from __future__ import annotations

import math

from scissordyn.errors import InputError
from scissordyn.laws.contact import Elastic, JointContact
from scissordyn.laws.elastic import power_law
from scissordyn.plugin.element import element

CLEARANCES = (0.005, 0.34954, 10.0)  # Limits of the clearance c for the two pieces of the exponent [mm]


@element(
    name="pereira",
    force=power_law.force,
    energy=power_law.energy,
    source="Pereira, Ramalho, Ambrosio 2011, Nonlinear Dynamics 63, 681-697",
)
class Pereira(Elastic):
    r"""An explicit power law fitted to Johnson's internal contact, exponent and stiffness depending on the clearance.

    .. math::
        F = \frac{(0.965 c + 0.0965) L_b E^*}{c} \delta^n,\quad n = Y c^{-0.005}\quad (\mathrm{N}, \mathrm{mm}, \mathrm{MPa})

        Y = 1.51 (\ln 1000c)^{-0.151}\ (0.005 \le c < 0.34954),\quad Y = 0.0151 c + 1.151\ (0.34954 \le c \le 10)

    The constants hold for lengths in mm, moduli in MPa and forces in N; here they are converted to SI.

    The citation could not be verified.
    """

    def parameters(self, joint: JointContact) -> tuple[float, ...]:
        """Return K [N/m^n] and n."""
        c = 1000.0 * joint.clearance
        if not CLEARANCES[0] <= c <= CLEARANCES[2]:
            raise InputError(
                f"Pereira's law with a clearance of {c:g} mm",
                f"{CLEARANCES[0]:g} mm to {CLEARANCES[2]:g} mm",
                'stiffness = "liu"',
            )
        y = 1.51 * math.log(1000.0 * c) ** -0.151 if c < CLEARANCES[1] else 0.0151 * c + 1.151
        n = y * c**-0.005
        # N/mm^n to N/m^n; L_b/c is a pure number, E* goes from Pa to N/mm^2, the fit's constants carry a mm
        stiffness = (0.965 * c + 0.0965) * joint.length / joint.clearance * joint.modulus * 1e-6
        return stiffness * 1000.0**n, n
