"""A power law with given constants."""

from __future__ import annotations

from typing import Annotated

from scissordyn.laws.contact import Elastic
from scissordyn.laws.elastic import power
from scissordyn.plugin.element import element
from scissordyn.units import Quantity


@element(name="power", force=power.force, energy=power.energy, source="definition; K as in Flores and co-workers 2006")
class PowerLaw(Elastic):
    r"""A spring that hardens with a constant exponent.

    .. math:: F = K \delta^n

    K is in N/m^n; the default is Hertz's stiffness of a steel joint with R_B = 10 mm and c = 0.5 mm.
    """

    coefficient: Annotated[float, Quantity("1", minimum=1e-3, maximum=1e40, help="K, in N/m^n with the n given here")] = 6.61e10
    exponent: Annotated[float, Quantity("1", minimum=0.5, maximum=5.0, help="n")] = 1.5
