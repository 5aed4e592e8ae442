"""Kelvin and Voigt's dashpot parallel to the spring, with the kernel of all linear dashpots."""

from __future__ import annotations

from typing import Annotated

from scissordyn.laws.contact import Damping
from scissordyn.plugin.element import element
from scissordyn.units import Quantity


def force(elastic, rate, coefficient):
    """Return the normal force [N] from the elastic part [N] and delta' [m/s]; tension is cut off later."""
    return elastic + coefficient * rate


@element(name="kelvin-voigt", force=force, source="Goldsmith 1960, Impact")
class KelvinVoigt(Damping):
    r"""A linear dashpot with a given constant.

    .. math:: F_n = F_{el} + C \delta'

    The force is discontinuous at the start of the contact, and zero where it would be negative.
    """

    coefficient: Annotated[float, Quantity("N s/m", minimum=0.0, maximum=1e12, help="damping coefficient C")] = 1e3
