"""Braendlein's law of the deflection of a steel roller."""

from __future__ import annotations

from scissordyn.laws.contact import Elastic, JointContact
from scissordyn.laws.elastic import power_law
from scissordyn.plugin.element import element


@element(
    name="braendlein",
    force=power_law.force,
    energy=power_law.energy,
    small_contact=True,
    materials="steel",
    source="Braendlein, Eschmann, Hasbargen, Weigand 1995, Die Waelzlagerpraxis",
)
class Braendlein(Elastic):
    r"""A steel roller between steel races, fitted to rolling bearings.

    .. math:: F = 35948\, L_b^{8/9}\, \delta^{10/9} \quad (\mathrm{N}, \mathrm{mm})

    The constant is in N/mm^2; here it is converted to SI. Clearance and radii do not enter.

    The citation could not be verified.
    """

    def parameters(self, joint: JointContact) -> tuple[float, ...]:
        """Return K [N/m^(10/9)] and n = 10/9."""
        # 8/9 + 10/9 = 2: one factor (1000 mm/m)^2 for both lengths together
        return 35948.0 * 1000.0**2 * joint.length ** (8.0 / 9.0), 10.0 / 9.0
