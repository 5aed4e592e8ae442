"""Oil between the journal and the bearing of a clearance joint."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from scissordyn.component.film.film import Film
from scissordyn.component.place import BodyPoint
from scissordyn.errors import InputError
from scissordyn.laws.oil import COLD, RANGE, Oil, oil_of
from scissordyn.units import Meaning, Quantity, check_quantities, documented, quantities

SHORTEST, LONGEST = 0.25, 4.0  # Length over diameter of the table of finite bearings

THICK = Quantity("m", above=0.0, maximum=1e-3, help="film thickness at which the peaks of both surfaces carry")


@documented
@dataclass(frozen=True)
class Lubrication:
    """A film of oil that fills the clearance; where it is as thin as the surfaces are rough, metal touches beside it.

    An oil has a viscosity at the temperature. Finite bearings are from a quarter to four diameters long; negative pressures can
    count in short and long ones.

    Raises
    ------
    InputError
        Without viscosity, or with oil and viscosity.
    """

    oil: Annotated[Oil | None, Meaning("an oil by name, or its viscosities", '"ISO VG 46"')] = None
    viscosity: Annotated[float | None, Quantity("Pa s", above=0.0, maximum=1e4, help="dynamic viscosity mu")] = None
    temperature: Annotated[float, Quantity("K", minimum=RANGE[0], maximum=RANGE[1], help="temperature of the oil")] = COLD
    roughness: Annotated[float, THICK] = 1e-6
    bearing: Annotated[Literal["finite", "short", "long"], Meaning("how the pressure is computed")] = "finite"
    full: Annotated[bool, Meaning("whether negative pressures count, too, as under a high ambient pressure")] = False
    density: Annotated[float, quantities(Oil)["density"]] = 870.0
    ambient_pressure: Annotated[float, Quantity("Pa", minimum=0.0, maximum=1e9, help="pressure around the joint")] = 101325.0
    vapour_pressure: Annotated[float, Quantity("Pa", minimum=0.0, maximum=1e7, help="vapour pressure, 0 if unknown")] = 0.0

    def __post_init__(self) -> None:
        what: object = self.oil
        if isinstance(what, str):
            object.__setattr__(self, "oil", oil_of(what))
        check_quantities(self)
        if (self.oil is None) == (self.viscosity is None):
            what = "neither oil nor viscosity" if self.oil is None else "an oil and a viscosity"
            raise InputError(f"lubrication with {what}", "one of them", 'viscosity=0.05 for 50 mPa s, or oil="ISO VG 46"')
        if self.bearing not in ("finite", "short", "long"):
            raise InputError(f"bearing = {self.bearing!r} of a film", '"finite", "short" or "long"')
        if self.full and self.bearing == "finite":
            raise InputError("full = True with a finite bearing, whose table has no negative pressures", '"short" or "long"')

    @property
    def dynamic_viscosity(self) -> float:
        """Mu at the temperature [Pa s]."""
        if self.oil is not None:
            return self.oil.viscosity(self.temperature)
        assert self.viscosity is not None
        return self.viscosity

    @property
    def mass_density(self) -> float:
        """Rho [kg/m^3]."""
        return self.density if self.oil is None else self.oil.density

    def check(self, clearance: float, radius: float, length: float) -> None:
        """Raise `InputError` where a joint is too rough, too short or too long for the film."""
        if self.roughness >= clearance:
            raise InputError(
                f"lubrication with roughness = {self.roughness:g} m in a clearance of {clearance:g} m",
                "a roughness below the clearance",
            )
        ratio = 0.5 * length / radius
        if self.bearing == "finite" and not SHORTEST <= ratio <= LONGEST:
            other = "short" if ratio < SHORTEST else "long"
            raise InputError(
                f"a finite film in a bearing of {ratio:.3g} diameters",
                f"{SHORTEST:g} to {LONGEST:g} diameters",
                f'bearing="{other}"',
            )

    def film(self, name: str, bearing: BodyPoint, journal: BodyPoint, clearance: float, radius: float, length: float) -> Film:
        """What exerts the film's force in a joint."""
        return Film(
            name, bearing, journal, self.dynamic_viscosity, clearance, radius, length, self.roughness, self.bearing, self.full
        )
