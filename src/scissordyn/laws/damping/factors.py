"""The published damping factors that are one formula of the restitution coefficient."""

from __future__ import annotations

import math

from scissordyn.laws.damping.proportional import DampingFactor, PositiveRestitution
from scissordyn.plugin.element import element

ALL_RESTITUTIONS = (0.0, 1.0)
"""`restitution_range` of a law whose source gives its factor for every restitution coefficient.

A law whose source says "high restitution" without a number has None.
"""


@element(name="hunt-crossley", source="Hunt, Crossley 1975, doi:10.1115/1.3423596")
class HuntCrossley(DampingFactor):
    r"""Damping that vanishes with the indentation, so that the force starts and ends at zero.

    .. math:: \xi = \tfrac{3}{2} (1 - c_e)
    """

    @staticmethod
    def _xi(c: float) -> float:
        return 1.5 * (1.0 - c)


@element(name="herbert-mcwhannell", source="Herbert, McWhannell 1977")
class HerbertMcWhannell(DampingFactor):
    r"""Damping whose energy loss is found along the approach curve of the damped contact.

    .. math:: \xi = \frac{6(1-c_e)}{(2c_e-1)^2 + 3}

    The citation could not be verified.
    """

    @staticmethod
    def _xi(c: float) -> float:
        return 6.0 * (1.0 - c) / ((2.0 * c - 1.0) ** 2 + 3.0)


@element(name="lee-wang", source="Lee, Wang 1983, J. Mech. Transm. Autom. Des. 105, 534-540")
class LeeWang(DampingFactor):
    r"""Half of Hunt and Crossley's damping, for intermittent motion mechanisms.

    .. math:: \xi = \tfrac{3}{4} (1 - c_e)

    The citation could not be verified.
    """

    @staticmethod
    def _xi(c: float) -> float:
        return 0.75 * (1.0 - c)


@element(name="lankarani-nikravesh", source="Lankarani, Nikravesh 1990, doi:10.1115/1.2912617")
class LankaraniNikravesh(DampingFactor):
    r"""Damping that returns the nominal restitution for nearly elastic contacts.

    .. math:: \xi = \tfrac{3}{4} (1 - c_e^2)
    """

    @staticmethod
    def _xi(c: float) -> float:
        return 0.75 * (1.0 - c**2)


@element(
    name="zhiying-qishao",
    restitution_range=ALL_RESTITUTIONS,
    source="Qin (Zhiying), Lu (Qishao) 2006, Journal of Dynamics and Control 4, 294-298",
)
class ZhiyingQishao(DampingFactor):
    r"""Lankarani and Nikravesh's factor, raised for soft contacts.

    .. math:: \xi = \tfrac{3}{4} (1 - c_e^2) e^{2(1-c_e)}

    The citation could not be verified.
    """

    @staticmethod
    def _xi(c: float) -> float:
        return 0.75 * (1.0 - c**2) * math.exp(2.0 * (1.0 - c))


@element(name="flores", restitution_range=ALL_RESTITUTIONS, source="Flores et al. 2011, doi:10.1007/s11044-010-9237-4")
class Flores(DampingFactor):
    r"""Damping for the whole range of restitution, soft contacts too.

    .. math:: \xi = \frac{8(1-c_e)}{5c_e}
    """

    restitution: PositiveRestitution = 0.9

    @staticmethod
    def _xi(c: float) -> float:
        return 8.0 * (1.0 - c) / (5.0 * c)


@element(name="hu-guo", restitution_range=ALL_RESTITUTIONS, source="Hu, Guo 2015, doi:10.1007/s11044-015-9453-z")
class HuGuo(DampingFactor):
    r"""Damping for the whole range of restitution, its energy balance taken over approach and rebound.

    .. math:: \xi = \frac{3(1-c_e)}{2c_e}

    An article of this subject has the DOI of the source; the formula could not be compared with its text. It tends to the
    exact factor for c_e -> 1.
    """

    restitution: PositiveRestitution = 0.9

    @staticmethod
    def _xi(c: float) -> float:
        return 1.5 * (1.0 - c) / c


@element(
    name="carvalho-martins",
    restitution_range=ALL_RESTITUTIONS,
    source="Carvalho, Martins 2019, doi:10.1016/j.mechmachtheory.2019.03.028",
)
class CarvalhoMartins(DampingFactor):
    r"""A rational fit of the exact factor.

    .. math:: \xi = \tfrac{3}{2} (1 - c_e) \frac{11 - c_e}{1 + 9c_e}
    """

    @staticmethod
    def _xi(c: float) -> float:
        return 1.5 * (1.0 - c) * (11.0 - c) / (1.0 + 9.0 * c)


@element(
    name="safaeifar-farshidianfar",
    restitution_range=ALL_RESTITUTIONS,
    source="Safaeifar, Farshidianfar 2020, doi:10.1007/s11044-020-09732-2",
)
class SafaeifarFarshidianfar(DampingFactor):
    r"""Damping from an energy balance with different approach and rebound curves.

    .. math:: \xi = \frac{5(1-c_e)}{4c_e}

    An article of this subject has the DOI of the source; the formula could not be compared with its text.
    """

    restitution: PositiveRestitution = 0.9

    @staticmethod
    def _xi(c: float) -> float:
        return 5.0 * (1.0 - c) / (4.0 * c)
