"""Linear spring law."""

from __future__ import annotations

from typing import Annotated

from scissordyn.laws.contact import Elastic
from scissordyn.plugin.element import element
from scissordyn.units import Quantity


def force(indentation, stiffness):
    """Return the force [N] at indentation delta > 0 [m]."""
    return stiffness * indentation


def energy(indentation, stiffness):
    """Return the work [J] up to indentation delta [m]."""
    return 0.5 * stiffness * indentation * indentation


@element(name="linear", force=force, energy=energy, source="definition")
class Linear(Elastic):
    r"""A spring of constant stiffness.

    .. math:: F = k \delta
    """

    stiffness: Annotated[float, Quantity("N/m", minimum=1e-3, maximum=1e15, help="k")] = 1e9
