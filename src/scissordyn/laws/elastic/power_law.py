"""Power law with given constants, and the kernels that all power laws share."""

from __future__ import annotations

from typing import Annotated

from scissordyn.laws.contact import Elastic
from scissordyn.plugin.element import element
from scissordyn.units import Quantity


def force(indentation, coefficient, exponent):
    """Return the force [N] at indentation delta > 0 [m]."""
    return coefficient * indentation**exponent


def energy(indentation, coefficient, exponent):
    """Return the work [J] up to indentation delta [m]."""
    return coefficient * indentation ** (exponent + 1.0) / (exponent + 1.0)


@element(name="power", force=force, energy=energy, source="definition; K as in Flores and co-workers 2006")
class PowerLaw(Elastic):
    r"""A spring that hardens with a constant exponent.

    .. math:: F = K \delta^n

    K is in N/m^n; the default is Hertz's stiffness of a steel joint with R_B = 10 mm and c = 0.5 mm.
    """

    coefficient: Annotated[float, Quantity("1", minimum=1e-3, maximum=1e40, help="K, in N/m^n with the n given here")] = 6.61e10
    exponent: Annotated[float, Quantity("1", minimum=0.5, maximum=5.0, help="n")] = 1.5
