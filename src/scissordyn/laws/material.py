"""Materials of journal and bearing."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from scissordyn.units import Quantity, check_quantities

__all__ = ["STEEL", "Material"]


@dataclass(frozen=True)
class Material:
    """An isotropic elastic material.

    Parameters
    ----------
    name : str
        What the user calls it.
    youngs_modulus : float
        E [Pa].
    poisson_ratio : float
        nu [1].
    density : float
        rho [kg/m^3].
    source : str
        Where the numbers come from.
    """

    name: str
    youngs_modulus: Annotated[float, Quantity("Pa", above=0.0, help="Young's modulus")]
    poisson_ratio: Annotated[float, Quantity("1", minimum=0.0, maximum=0.5, help="Poisson's ratio")]
    density: Annotated[float, Quantity("kg/m^3", above=0.0, help="density")]
    source: str = ""

    def __post_init__(self) -> None:
        check_quantities(self)

    @property
    def compliance(self) -> float:
        """(1 - nu^2)/E [1/Pa]."""
        return (1.0 - self.poisson_ratio**2) / self.youngs_modulus


STEEL = Material("steel", 207e9, 0.3, 7800.0, "Flores et al. 2006, doi:10.1007/s11044-006-9028-0")
