"""Table of the integration methods by name."""

from __future__ import annotations

from scissordyn.errors import InputError, did_you_mean
from scissordyn.integrate.dormand_prince import DOP853, DOPRI5
from scissordyn.integrate.rodas import RODAS4P, RODAS5P
from scissordyn.integrate.tableau import Tableau

# coefficients of the integration methods by name, explicit methods first
TABLEAUS = {"dop853": DOP853, "dopri5": DOPRI5, "rodas5p": RODAS5P, "rodas4p": RODAS4P}
METHODS = tuple(TABLEAUS)  # Names of the integration methods with error control


def tableau(name: str) -> Tableau:
    """Return the coefficients of a method."""
    if name not in TABLEAUS:
        raise InputError(f"unknown method '{name}'{did_you_mean(name, METHODS)}", "auto, " + ", ".join(METHODS))
    return TABLEAUS[name]
