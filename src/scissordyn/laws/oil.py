"""Compute the viscosity of lubricants from the temperature, and the viscosity index, a measure of its decrease."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Annotated

from scissordyn.errors import InputError, did_you_mean
from scissordyn.units import Meaning, Quantity, check_quantities, documented

COLD, HOT = 313.15, 373.15  # Temperatures of stated oil viscosities [K]: 40 and 100 deg C
TEMPERATURE_RANGE = 253.15, 423.15  # Range of oil temperatures [K]; below it oils solidify, above it they evaporate and age

# [m^2/s] bounds of oil viscosities; below 2 mm^2/s the equation of ASTM D341 has further terms
VISCOSITY_BOUNDS = {"minimum": 2e-6, "maximum": 1e-1}


INDEX_COEFFICIENTS = (
    (3.8, 1.14673, 1.7576, -0.109, 0.84155, 1.5521, -0.077),
    (4.4, 3.38095, -15.4952, 33.196, 0.78571, 1.7929, -0.183),
    (5.0, 2.5, -7.2143, 13.812, 0.82143, 1.5679, 0.119),
    (6.4, 0.101, 16.635, -45.469, 0.04985, 9.1613, -18.557),
    (7.0, 3.35714, -23.5643, 78.466, 0.22619, 7.7369, -16.656),
    (7.7, 0.01191, 21.475, -72.87, 0.79762, -0.7321, 14.61),
    (9.0, 0.41858, 16.1558, -56.04, 0.05794, 10.5156, -28.24),
    (12.0, 0.88779, 7.5527, -16.6, 0.26665, 6.7015, -10.81),
    (15.0, 0.7672, 10.7972, -38.18, 0.20073, 8.4658, -22.49),
    (18.0, 0.97305, 5.3135, -2.2, 0.28889, 5.9741, -4.93),
    (22.0, 0.97256, 5.25, -0.98, 0.24504, 7.416, -16.73),
    (28.0, 0.91413, 7.4759, -21.82, 0.20323, 9.1267, -34.23),
    (40.0, 0.87031, 9.7157, -50.77, 0.18411, 10.1015, -46.75),
    (55.0, 0.84703, 12.6752, -133.31, 0.17029, 11.4866, -80.62),
    (70.0, 0.85921, 11.1009, -83.19, 0.1713, 11.368, -76.94),
    (float("inf"), 0.83531, 14.6731, -216.246, 0.16841, 11.8493, -96.947),
)
"""Rows of ASTM D2270: largest viscosity at 100 deg C [mm^2/s], then coefficients of the parabolas L and H (`_references`)."""


def _references(hot: float) -> tuple[float, float]:
    """Return L and H: viscosities at 40 deg C of the oils of index 0 and 100 with this viscosity at 100 deg C [mm^2/s]."""
    _, a, b, c, d, e, f = next(row for row in INDEX_COEFFICIENTS if hot <= row[0])
    return a * hot**2 + b * hot + c, d * hot**2 + e * hot + f


def viscosity_index(cold: float, hot: float) -> float:
    """Return the viscosity index of an oil from its viscosities at 40 and 100 deg C [mm^2/s].

    References
    ----------
    ASTM D2270, Standard practice for calculating viscosity index from kinematic viscosity at 40 and 100 deg C
    """
    zero, hundred = _references(hot)
    if cold >= hundred:
        return 100.0 * (zero - cold) / (zero - hundred)
    power: float = math.log(hundred / cold) / math.log(hot)
    return 100.0 + (math.pow(10.0, power) - 1.0) / 0.00715


def hot_viscosity(cold: float, index: float, least: float = 2.0) -> float:
    """Return the viscosity at 100 deg C of an oil from its viscosity at 40 deg C and its index [mm^2/s].

    `least`: [mm^2/s] viscosity at 100 deg C below which the index is not defined.
    """

    def error(hot: float) -> float:
        return viscosity_index(cold, hot) - index

    if not (0.9 * cold > least and error(least) < 0.0 < error(0.9 * cold)):
        raise InputError(
            f"an oil of {cold:g} mm^2/s at 40 deg C with the viscosity index {index:g}",
            f"an index with which it has at least {least:g} mm^2/s at 100 deg C and is thinner there",
        )
    from scipy.optimize import brentq  # takes longer to import than most of the package

    return float(brentq(error, least, 0.9 * cold, xtol=1e-12))


@documented
@dataclass(frozen=True)
class Oil:
    r"""Mineral or synthetic oil, whose viscosity follows Walther's law through two stated values.

    .. math:: \log_{10}\log_{10}(\nu/\mathrm{mm^2 s^{-1}} + 0.7) = A - B\,\log_{10} T

    References
    ----------
    ASTM D341, Standard practice for viscosity-temperature equations and charts for liquid petroleum products
    """

    name: str
    viscosity_40: Annotated[float, Quantity("m^2/s", **VISCOSITY_BOUNDS, help="kinematic viscosity nu at 40 deg C")]
    viscosity_100: Annotated[float, Quantity("m^2/s", **VISCOSITY_BOUNDS, help="kinematic viscosity nu at 100 deg C")]
    density: Annotated[float, Quantity("kg/m^3", minimum=500.0, maximum=2500.0, help="density rho")] = 870.0
    source: Annotated[str, Meaning("source of the numbers")] = ""

    def __post_init__(self) -> None:
        check_quantities(self)
        if not self.viscosity_100 < self.viscosity_40:
            raise InputError(
                f"oil '{self.name}' with {self.viscosity_100:g} m^2/s at 100 deg C and {self.viscosity_40:g} m^2/s at 40 deg C",
                "a viscosity that falls with temperature",
            )

    @classmethod
    def of_index(cls, name: str, viscosity_40: float, viscosity_index: float = 95.0, *, density: float = 870.0) -> Oil:
        """Return an oil with a given viscosity at 40 deg C and viscosity index.

        Parameters
        ----------
        name : str
        viscosity_40 : float
            Kinematic viscosity at 40 deg C [m^2/s]; that of the grade ISO VG 46 is 46e-6.
        viscosity_index : float
            Index of ASTM D2270: about 95 for mineral oils, above 120 for many synthetic ones.
        density : float
            [kg/m^3]
        """
        hot = hot_viscosity(1e6 * viscosity_40, viscosity_index)
        return cls(name, viscosity_40, 1e-6 * hot, density, f"viscosity index {viscosity_index:g} by ASTM D2270")

    def viscosity(self, temperature: float) -> float:
        """Return the dynamic viscosity mu = rho nu at a temperature [K], with constant density [Pa s]."""

        def twice(viscosity: float) -> float:
            return math.log10(math.log10(1e6 * viscosity + 0.7))

        cold, hot = twice(self.viscosity_40), twice(self.viscosity_100)
        part = math.log10(temperature / COLD) / math.log10(HOT / COLD)
        kinematic: float = 1e-6 * (10.0**10.0 ** (cold + part * (hot - cold)) - 0.7)
        return self.density * kinematic


# Source of the values of hydraulic oils
_DTE = "typical values of Mobil DTE 20 hydraulic oils, product data sheet; grades by ISO 3448"

# Source of the values of oils of an ISO viscosity grade
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
            f"'{name}' is not an oil: a grease does not flow below its yield stress, which the film model excludes",
            ", ".join(OILS) + ", or the viscosity of the grease's base oil for a joint that is full of it",
            "viscosity=0.1",
        )
    if name not in OILS:
        allowed = ", ".join(OILS) + ", or a user-defined oil"
        raise InputError(f"unknown oil '{name}'{did_you_mean(name, OILS)}", allowed, 'oil="ISO VG 46"')
    return OILS[name]
