"""Define materials of journal and bearing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Annotated

from scissordyn.units import Meaning, Quantity, check_quantities, documented


@documented
@dataclass(frozen=True)
class Material:
    """Isotropic elastic material."""

    name: str
    youngs_modulus: Annotated[float, Quantity("Pa", minimum=1e3, maximum=1e13, help="Young's modulus E")]
    poisson_ratio: Annotated[float, Quantity("1", above=-1.0, maximum=0.5, help="Poisson's ratio nu")]
    density: Annotated[float, Quantity("kg/m^3", minimum=0.1, maximum=1e5, help="density rho")]
    source: Annotated[str, Meaning("source of the numbers")] = ""

    def __post_init__(self) -> None:
        check_quantities(self)

    @property
    def compliance(self) -> float:
        """Compliance (1 - nu^2)/E [1/Pa]."""
        return (1.0 - self.poisson_ratio**2) / self.youngs_modulus


# Sources of the constants of materials
METALS = "ASM Handbook 2, 1990, doi:10.31399/asm.hb.v02.9781627081627"
PLASTICS = "Brydson 1999, Plastics Materials"

STEEL = Material("steel", 207e9, 0.3, 7800.0, "Flores and co-workers 2006")

_ALL = (
    STEEL,
    Material("stainless-steel", 193e9, 0.29, 8000.0, "AISI 304: ASM Handbook 1, 1990"),
    Material("aluminium", 68.9e9, 0.33, 2700.0, f"6061-T6: {METALS}"),
    Material("titanium", 113.8e9, 0.342, 4430.0, f"Ti-6Al-4V, annealed: {METALS}"),
    Material("bronze", 100e9, 0.34, 8930.0, f"bearing bronze C93200: {METALS}"),
    Material("brass", 97e9, 0.34, 8490.0, f"C36000: {METALS}"),
    Material("beryllium-copper", 131e9, 0.3, 8250.0, f"C17200: {METALS}"),
    Material("ptfe", 0.5e9, 0.46, 2180.0, f"unfilled, 23 deg C: {PLASTICS}"),
    Material("peek", 3.6e9, 0.38, 1300.0, f"unfilled, 23 deg C: {PLASTICS}"),
    Material(
        "cfrp",
        70e9,
        0.3,
        1600.0,
        "quasi-isotropic laminate of standard fibres, in its plane: Jones 1999, Mechanics of Composite Materials",
    ),
)

MATERIALS: Mapping[str, Material] = MappingProxyType({material.name: material for material in _ALL})  # All materials by name
