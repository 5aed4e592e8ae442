"""Fits of hole and shaft by ISO 286-1:2010, and the radial clearance that they give.

The tables are those of the standard: tolerance grades IT5 to IT11 (table 1) and fundamental deviations of the shafts e, f, g, h
(table 4) for diameters up to 500 mm. The standard tolerance unit, from which the tables are rounded, is
i = 0.45 D^(1/3) + 0.001 D [um] with the geometric mean D [mm] of a range of diameters.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Annotated

from scissordyn.annotation import is_number, shown
from scissordyn.errors import InputError
from scissordyn.studies.ask.distribution import Distribution, within_tolerance
from scissordyn.units import Meaning, Quantity, documented

DIAMETERS = (1, 3, 6, 10, 18, 30, 50, 80, 120, 180, 250, 315, 400, 500)
"""Limits of the ranges of nominal diameters in ISO 286 [mm]; a range includes its upper limit, the first both limits."""

GRADES: Mapping[int, tuple[int, ...]] = MappingProxyType(
    {
        5: (4, 5, 6, 8, 9, 11, 13, 15, 18, 20, 23, 25, 27),
        6: (6, 8, 9, 11, 13, 16, 19, 22, 25, 29, 32, 36, 40),
        7: (10, 12, 15, 18, 21, 25, 30, 35, 40, 46, 52, 57, 63),
        8: (14, 18, 22, 27, 33, 39, 46, 54, 63, 72, 81, 89, 97),
        9: (25, 30, 36, 43, 52, 62, 74, 87, 100, 115, 130, 140, 155),
        10: (40, 48, 58, 70, 84, 100, 120, 140, 160, 185, 210, 230, 250),
        11: (60, 75, 90, 110, 130, 160, 190, 220, 250, 290, 320, 360, 400),
    }
)
"""Width of the tolerance field in each range of diameters [um], by tolerance grade of ISO 286."""

DEVIATIONS: Mapping[str, tuple[int, ...]] = MappingProxyType(
    {
        "e": (14, 20, 25, 32, 40, 50, 60, 72, 85, 100, 110, 125, 135),
        "f": (6, 10, 13, 16, 20, 25, 30, 36, 43, 50, 56, 62, 68),
        "g": (2, 4, 5, 6, 7, 9, 10, 12, 14, 15, 17, 18, 20),
        "h": (0,) * 13,
    }
)
"""Distance of a shaft's upper limit below the nominal diameter in each range of diameters [um], by letter of ISO 286."""

FIT_TEXT = re.compile(r"\s*([A-Za-z]+)(\d+)\s*/\s*([A-Za-z]+)(\d+)\s*")  # Pattern of an ISO 286 fit of hole and shaft: H7/g6

SAMPLE = "'H7/g6 at 10 mm'"  # Correct fit, which error texts show


@documented
@dataclass(frozen=True)
class Fit:
    """A hole and a shaft of the same nominal diameter, by ISO 286-1:2010."""

    hole_grade: Annotated[int, Meaning("tolerance grade of the hole H, 5 to 11")]
    shaft: Annotated[str, Meaning("fundamental deviation of the shaft: e, f, g or h")]
    shaft_grade: Annotated[int, Meaning("tolerance grade of the shaft, 5 to 11")]
    diameter: Annotated[float, Quantity("m", help="nominal diameter")]

    def __post_init__(self) -> None:
        for grade in (self.hole_grade, self.shaft_grade):
            if not isinstance(grade, int) or grade not in GRADES:
                raise InputError(f"tolerance grade {grade}", f"{min(GRADES)} to {max(GRADES)}", SAMPLE)
        if not isinstance(self.shaft, str) or self.shaft not in DEVIATIONS:
            raise InputError(f"unknown shaft '{self.shaft}' of a fit", "one of " + ", ".join(DEVIATIONS), SAMPLE)
        if not is_number(self.diameter):
            raise InputError(f"a fit at {shown(self.diameter)}", "a diameter [m]", SAMPLE)
        if not DIAMETERS[0] <= self._millimetres <= DIAMETERS[-1]:
            raise InputError(f"a fit at {self._millimetres:g} mm", f"diameters of {DIAMETERS[0]} to {DIAMETERS[-1]} mm", SAMPLE)

    @property
    def _millimetres(self) -> float:
        return round(self.diameter * 1e3, 9)

    @property
    def _range(self) -> int:
        return next(k for k, end in enumerate(DIAMETERS[1:]) if self._millimetres <= end)

    @property
    def hole(self) -> tuple[float, float]:
        """Lower and upper deviation of the hole [m]."""
        return 0.0, GRADES[self.hole_grade][self._range] * 1e-6

    @property
    def pin(self) -> tuple[float, float]:
        """Lower and upper deviation of the shaft [m]."""
        upper = -DEVIATIONS[self.shaft][self._range]
        return (upper - GRADES[self.shaft_grade][self._range]) * 1e-6, upper * 1e-6

    def clearance(self, shape: str = "uniform", smallest: float = 0.0) -> Distribution:
        """Return the radial clearance, half of the difference of the diameters [m].

        Parameters
        ----------
        shape : {"uniform", "norm"}
            Distribution of the diameters: uniform within their tolerance fields, or normal about their middle, with the limits
            three standard deviations away. The clearance of uniform diameters is trapezoidal.
        smallest : float
            Smallest clearance that a joint can have [m]; the range of a shaft h begins there instead of at 0.
        """
        least, most = max(smallest, 0.5 * (self.hole[0] - self.pin[1])), 0.5 * (self.hole[1] - self.pin[0])
        widths = sorted((0.5 * (self.hole[1] - self.hole[0]), 0.5 * (self.pin[1] - self.pin[0])))
        middle, half = 0.5 * (least + most), 0.5 * (most - least)
        if shape == "norm":
            return within_tolerance("norm", middle, half, (widths[0] ** 2 + widths[1] ** 2) ** 0.5 / 6.0)
        plateau = min(widths[0] / (most - least), 0.5)  # not above by rounding
        return Distribution("trapezoid", {"c": plateau, "d": 1.0 - plateau, "loc": least, "scale": most - least})


def read_fit(text: str, diameter: float) -> Fit:
    """Read a fit such as ``H7/g6``."""
    match = FIT_TEXT.fullmatch(text)
    if match is None:
        raise InputError(f"fit '{text.strip()}'", "a hole H and a shaft e, f, g or h with their grades", SAMPLE)
    hole, hole_grade, shaft, shaft_grade = match.groups()
    if hole != "H":
        raise InputError(f"hole '{hole}'", "H", SAMPLE)
    return Fit(int(hole_grade[:3]), shaft, int(shaft_grade[:3]), diameter)
