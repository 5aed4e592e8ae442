"""Lubricants: viscosity over temperature."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Annotated

from scissordyn.errors import InputError, did_you_mean
from scissordyn.units import Quantity, check_quantities

COLD, HOT = 313.15, 373.15  # Temperatures at which viscosities of oils are stated [K]: 40 and 100 deg C
RANGE = 253.15, 423.15  # Temperatures of the law [K]: beyond them oils set, or evaporate and age
VISCOSITY = {"minimum": 2e-6, "maximum": 1e-1}  # Below 2 mm^2/s the standard has further terms


@dataclass(frozen=True)
class Oil:
    r"""A mineral or synthetic oil, whose viscosity follows Walther's law between two stated values.

    .. math:: \log_{10}\log_{10}(\nu/\mathrm{mm^2 s^{-1}} + 0.7) = A - B\,\log_{10} T

    Parameters
    ----------
    name : str
    viscosity_40, viscosity_100 : float
        Kinematic viscosity nu at 40 and at 100 deg C [m^2/s].
    density : float
        rho [kg/m^3].
    source : str
        Source of the numbers.

    References
    ----------
    ASTM D341, Standard practice for viscosity-temperature equations and charts for liquid petroleum products
    """

    name: str
    viscosity_40: Annotated[float, Quantity("m^2/s", **VISCOSITY, help="kinematic viscosity at 40 deg C")]
    viscosity_100: Annotated[float, Quantity("m^2/s", **VISCOSITY, help="kinematic viscosity at 100 deg C")]
    density: Annotated[float, Quantity("kg/m^3", minimum=500.0, maximum=2500.0, help="density")] = 870.0
    source: str = ""

    def __post_init__(self) -> None:
        check_quantities(self)
        if not self.viscosity_100 < self.viscosity_40:
            raise InputError(
                f"oil '{self.name}' with {self.viscosity_100:g} m^2/s at 100 deg C and {self.viscosity_40:g} m^2/s at 40 deg C",
                "a viscosity that falls as the oil gets warmer",
            )

    @classmethod
    def of_index(cls, name: str, viscosity_40: float, viscosity_index: float = 95.0, *, density: float = 870.0) -> Oil:
        """An oil by its viscosity at 40 deg C and its viscosity index.

        Parameters
        ----------
        name : str
        viscosity_40 : float
            Kinematic viscosity at 40 deg C [m^2/s]; that of the grade ISO VG 46 is 46e-6.
        viscosity_index : float
            By ASTM D2270: about 95 for mineral oils, above 120 for many synthetic ones.
        density : float
            [kg/m^3]

        Returns
        -------
        Oil
        """
        from scissordyn.laws.viscosity_index import hot_viscosity

        hot = hot_viscosity(1e6 * viscosity_40, viscosity_index)
        return cls(name, viscosity_40, 1e-6 * hot, density, f"viscosity index {viscosity_index:g} by ASTM D2270")

    def viscosity(self, temperature: float) -> float:
        """Dynamic viscosity mu = rho nu at a temperature [K], the density taken as constant [Pa s]."""

        def twice(viscosity: float) -> float:
            return math.log10(math.log10(1e6 * viscosity + 0.7))

        cold, hot = twice(self.viscosity_40), twice(self.viscosity_100)
        part = math.log10(temperature / COLD) / math.log10(HOT / COLD)
        kinematic: float = 1e-6 * (10.0**10.0 ** (cold + part * (hot - cold)) - 0.7)
        return self.density * kinematic


_DTE = "typical values of Mobil DTE 20 hydraulic oils, product data sheet; grades by ISO 3448"

_GRADE = "middle of the grade by ISO 3448; viscosity index 95 by ASTM D2270, that of a mineral oil"

_ALL = (
    Oil("ISO VG 10", 10e-6, 2.637e-6, source=_GRADE),
    Oil("ISO VG 15", 15e-6, 3.381e-6, source=_GRADE),
    Oil("ISO VG 22", 22e-6, 4.254e-6, source=_GRADE),
    Oil("ISO VG 32", 31.5e-6, 5.29e-6, 871.0, _DTE),
    Oil("ISO VG 46", 44.2e-6, 6.65e-6, 876.0, _DTE),
    Oil("ISO VG 68", 71.2e-6, 8.53e-6, 881.0, _DTE),
    Oil("ISO VG 100", 100e-6, 11.07e-6, source=_GRADE),
    Oil("ISO VG 150", 150e-6, 14.54e-6, source=_GRADE),
    Oil("ISO VG 220", 220e-6, 18.75e-6, source=_GRADE),
    Oil("ISO VG 320", 320e-6, 23.95e-6, source=_GRADE),
    Oil("ISO VG 460", 460e-6, 30.34e-6, source=_GRADE),
)

OILS: Mapping[str, Oil] = MappingProxyType({oil.name: oil for oil in _ALL})  # Oils by name


def oil_of(name: str) -> Oil:
    if "grease" in name.lower():
        raise InputError(
            f"'{name}' as an oil: a grease does not flow below its yield stress, which the film does not describe",
            ", ".join(OILS) + ", or the viscosity of the grease's base oil for a joint that is full of it",
            "viscosity=0.1",
        )
    if name not in OILS:
        allowed = ", ".join(OILS) + ", or one of your own"
        raise InputError(f"unknown oil '{name}'{did_you_mean(name, OILS)}", allowed, 'oil="ISO VG 46"')
    return OILS[name]
