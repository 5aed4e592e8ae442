"""The viscosity index: how little the viscosity of an oil falls with temperature, between 40 and 100 deg C."""

from __future__ import annotations

import math

from scipy.optimize import brentq

from scissordyn.errors import InputError

LOWEST = 2.0  # Viscosity at 100 deg C below which the index is not defined [mm^2/s]

_RANGES = (
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
"""Up to which viscosity at 100 deg C, and the coefficients of L and H [mm^2/s]: the parabolas of the standard."""


def _references(hot: float) -> tuple[float, float]:
    """L and H: viscosities at 40 deg C of the oils of index 0 and 100 that have this one at 100 deg C [mm^2/s]."""
    _, a, b, c, d, e, f = next(row for row in _RANGES if hot <= row[0])
    return a * hot**2 + b * hot + c, d * hot**2 + e * hot + f


def viscosity_index(cold: float, hot: float) -> float:
    """The viscosity index of an oil.

    References
    ----------
    ASTM D2270, Standard practice for calculating viscosity index from kinematic viscosity at 40 and 100 deg C
    """
    zero, hundred = _references(hot)
    if cold >= hundred:
        return 100.0 * (zero - cold) / (zero - hundred)
    power: float = math.log(hundred / cold) / math.log(hot)
    return 100.0 + (math.pow(10.0, power) - 1.0) / 0.00715


def hot_viscosity(cold: float, index: float) -> float:
    """The viscosity at 100 deg C of an oil of some viscosity at 40 deg C and some index [mm^2/s]."""

    def error(hot: float) -> float:
        return viscosity_index(cold, hot) - index

    if not (0.9 * cold > LOWEST and error(LOWEST) < 0.0 < error(0.9 * cold)):
        raise InputError(
            f"an oil of {cold:g} mm^2/s at 40 deg C with the viscosity index {index:g}",
            f"an index with which it has at least {LOWEST:g} mm^2/s at 100 deg C, where it is defined, and is thinner there",
        )
    return float(brentq(error, LOWEST, 0.9 * cold, xtol=1e-12))
