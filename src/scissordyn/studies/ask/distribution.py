"""Ranges of a factor by their quantile functions: levels, an interval, a distribution, names, an ISO fit."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Annotated, Any, ClassVar

import numpy as np
from scipy import special

from scissordyn.annotation import is_number, shown
from scissordyn.errors import InputError, did_you_mean
from scissordyn.units import Meaning, Quantity, documented

GRID_LEVELS = 10  # [levels] of an interval in a grid, by default

LEAST, MOST = np.finfo(float).tiny, 1.0 - np.finfo(float).epsneg
"""Probabilities that keep the quantiles of unbounded distributions finite."""


class Variation:
    """A set of values with a measure of probability on it."""

    kind: ClassVar[str]

    def _check_finite(self, *numbers: float) -> None:
        if not all(is_number(number) and math.isfinite(number) for number in numbers):
            given = ", ".join(f"{number:g}" if is_number(number) else shown(number) for number in numbers)
            raise InputError(f"{self.kind} of {given}", "finite numbers")

    def _numbers(self, values: Any) -> tuple[float, ...]:
        """Return several finite numbers as Python floats."""
        if isinstance(values, str | bytes | Mapping) or not isinstance(values, Iterable):
            raise InputError(f"{self.kind} of {shown(values)}", "a tuple of finite numbers")
        given = tuple(values)
        self._check_finite(*given)
        return tuple(map(float, given))

    def _check_ends(self, low: float, high: float) -> None:
        self._check_finite(low, high)
        if not low < high:
            raise InputError(f"a range from {low:g} to {high:g} is empty", "a smaller number, then a larger one")

    def quantile(self, u: np.ndarray) -> np.ndarray:
        """Return the values at probabilities u in [0, 1)."""
        raise NotImplementedError

    def levels(self) -> np.ndarray:
        """Return the values of a grid: quantiles in the middle of equally probable parts, or all given values."""
        return self.quantile((np.arange(GRID_LEVELS) + 0.5) / GRID_LEVELS)

    @property
    def count(self) -> int:
        """Number of values of a grid."""
        return len(self.levels())

    @property
    def ends(self) -> tuple[float, float]:
        """Smallest and largest value; infinite where there is none."""
        return getattr(self, "low"), getattr(self, "high")  # noqa: B009 - fields of the classes below


@dataclass(frozen=True)
class Levels(Variation):
    """Given values, equally probable."""

    kind: ClassVar[str] = "levels"
    values: tuple[float, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "values", self._numbers(self.values))
        if not self.values:
            raise InputError("an empty list of levels", "at least one value")

    def quantile(self, u: np.ndarray) -> np.ndarray:
        return np.asarray(np.asarray(self.values)[np.minimum((u * len(self.values)).astype(int), len(self.values) - 1)])

    def levels(self) -> np.ndarray:
        return np.asarray(self.values)

    @property
    def ends(self) -> tuple[float, float]:
        return min(self.values), max(self.values)


@dataclass(frozen=True)
class Names(Variation):
    """Names, such as those of materials, of which a study holds the places 0, 1, ... in the order given."""

    kind: ClassVar[str] = "names"
    values: Annotated[tuple[str, ...], Meaning("all different")]
    probabilities: Annotated[tuple[float, ...], Meaning("of each, with the sum 1; all the same if empty")] = ()

    def __post_init__(self) -> None:
        if not isinstance(self.values, tuple | list) or not all(isinstance(name, str) for name in self.values):
            raise InputError(f"names of {shown(self.values)}", "a tuple of texts", 'Names(("steel", "bronze"))')
        object.__setattr__(self, "values", tuple(self.values))
        object.__setattr__(self, "probabilities", self._numbers(self.probabilities))
        if not self.values:
            raise InputError("an empty list of names", "at least one name")
        twice = next((name for name in self.values if self.values.count(name) > 1), None)
        if twice is not None:
            raise InputError(f"the name '{twice}' twice", "each name once")
        shares = self.probabilities
        if shares and not (len(shares) == self.count and min(shares) > 0.0 and math.isclose(sum(shares), 1.0, abs_tol=1e-9)):
            raise InputError(f"probabilities {list(shares)} of {self.count} names", f"{self.count} numbers > 0 with the sum 1")

    def quantile(self, u: np.ndarray) -> np.ndarray:
        shares = np.asarray(self.probabilities or [1.0 / self.count] * self.count)
        return np.searchsorted(np.cumsum(shares)[:-1], u, side="right").astype(float)

    def levels(self) -> np.ndarray:
        return np.arange(float(len(self.values)))

    @property
    def ends(self) -> tuple[float, float]:
        return 0.0, float(self.count - 1)


@dataclass(frozen=True)
class Uniform(Variation):
    """Uniform distribution."""

    kind: ClassVar[str] = "uniform"
    low: float
    high: float

    def __post_init__(self) -> None:
        self._check_ends(self.low, self.high)

    def quantile(self, u: np.ndarray) -> np.ndarray:
        return np.asarray(self.low + u * (self.high - self.low))


@dataclass(frozen=True)
class Interval(Uniform):
    """A range: equally spaced levels in a grid, uniform in a sample; both in the logarithm if asked for."""

    kind: ClassVar[str] = "interval"
    count: Annotated[int, Meaning("number of levels in a grid")] = GRID_LEVELS
    logarithmic: bool = False

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.count < 2:
            raise InputError(f"{self.count} levels of a range", "a whole number >= 2")
        if self.logarithmic and self.low <= 0.0:
            raise InputError(f"a logarithmic range from {self.low:g}", "numbers > 0")

    def quantile(self, u: np.ndarray) -> np.ndarray:
        if self.logarithmic:
            return np.asarray(self.low * (self.high / self.low) ** u)
        return super().quantile(u)

    def levels(self) -> np.ndarray:
        space = np.geomspace if self.logarithmic else np.linspace
        return np.asarray(space(self.low, self.high, self.count))


@dataclass(frozen=True)
class Normal(Variation):
    """Normal distribution, truncated if ends are given."""

    kind: ClassVar[str] = "normal"
    mean: Annotated[float, Meaning("of the distribution before truncation")]
    deviation: float
    low: float = -math.inf
    high: float = math.inf

    def __post_init__(self) -> None:
        self._check_finite(self.mean, self.deviation)
        if not self.deviation > 0.0:
            raise InputError(f"a standard deviation of {self.deviation:g}", "a number > 0")
        if not self.low < self.high:
            raise InputError(f"a truncated normal distribution from {self.low:g} to {self.high:g} is empty", "low < high")
        if not self._share()[1] - self._share()[0] > 0.0:
            raise InputError("a truncated normal distribution without probability in its range", "a range near the mean")

    def _share(self) -> tuple[float, float]:
        ends = (np.array([self.low, self.high]) - self.mean) / self.deviation
        below, above = special.ndtr(ends)
        return float(below), float(above)

    def quantile(self, u: np.ndarray) -> np.ndarray:
        below, above = self._share()
        # the smallest probability of a sample keeps the untruncated quantile finite
        p = np.clip(below + np.asarray(u) * (above - below), LEAST, MOST)
        return np.asarray(np.clip(self.mean + self.deviation * special.ndtri(p), self.low, self.high))


@dataclass(frozen=True)
class LogNormal(Variation):
    """Distribution of a number whose logarithm is normal."""

    kind: ClassVar[str] = "lognormal"
    median: float
    deviation: Annotated[float, Meaning("standard deviation of the natural logarithm")]

    def __post_init__(self) -> None:
        self._check_finite(self.median, self.deviation)
        if not (self.median > 0.0 and self.deviation > 0.0):
            raise InputError(f"lognormal of {self.median:g}, {self.deviation:g}", "a median > 0 and a deviation > 0")

    def quantile(self, u: np.ndarray) -> np.ndarray:
        return np.asarray(self.median * np.exp(self.deviation * special.ndtri(np.clip(u, LEAST, MOST))))

    @property
    def ends(self) -> tuple[float, float]:
        return 0.0, math.inf


@dataclass(frozen=True)
class Trapezoid(Variation):
    """Trapezoid distribution: that of the sum or difference of two uniform numbers.

    The density rises from `low` to `first`, is constant to `last` and falls to `high`.
    """

    kind: ClassVar[str] = "trapezoidal"
    low: float
    first: float
    last: float
    high: float

    def __post_init__(self) -> None:
        self._check_ends(self.low, self.high)
        self._check_finite(self.first, self.last)
        if not self.low <= self.first <= self.last <= self.high:
            shares = ", ".join(f"{number:g}" for number in (self.low, self.first, self.last, self.high))
            raise InputError(f"a trapezoidal distribution of {shares}", "four ascending numbers")

    def quantile(self, u: np.ndarray) -> np.ndarray:
        return _trapezoid(np.asarray(u), self.low, self.first, self.last, self.high)


@dataclass(frozen=True)
class Triangular(Variation):
    """Triangular distribution."""

    kind: ClassVar[str] = "triangular"
    low: float
    mode: float
    high: float

    def __post_init__(self) -> None:
        self._check_ends(self.low, self.high)
        if not self.low <= self.mode <= self.high:
            raise InputError(f"a triangular distribution of {self.low:g}, {self.mode:g}, {self.high:g}", "low <= mode <= high")

    def quantile(self, u: np.ndarray) -> np.ndarray:
        return _trapezoid(np.asarray(u), self.low, self.mode, self.mode, self.high)


def _trapezoid(u: np.ndarray, low: float, first: float, last: float, high: float) -> np.ndarray:
    density = 2.0 / ((high - low) + (last - first))
    rising, falling = 0.5 * density * (first - low), 1.0 - 0.5 * density * (high - last)
    ascent = low + np.sqrt(2.0 * np.maximum(u, 0.0) * (first - low) / density)
    descent = high - np.sqrt(2.0 * np.maximum(1.0 - u, 0.0) * (high - last) / density)
    return np.asarray(np.where(u < rising, ascent, np.where(u > falling, descent, first + (u - rising) / density)))


@dataclass(frozen=True)
class Beta(Variation):
    """Beta distribution of two shape parameters on a range."""

    kind: ClassVar[str] = "beta"
    alpha: float
    beta: float
    low: float = 0.0
    high: float = 1.0

    def __post_init__(self) -> None:
        self._check_ends(self.low, self.high)
        self._check_finite(self.alpha, self.beta)
        if not (self.alpha > 0.0 and self.beta > 0.0):
            raise InputError(f"a beta distribution of shapes {self.alpha:g}, {self.beta:g}", "two numbers > 0")

    def quantile(self, u: np.ndarray) -> np.ndarray:
        return np.asarray(self.low + (self.high - self.low) * special.betaincinv(self.alpha, self.beta, u))


@dataclass(frozen=True)
class Weibull(Variation):
    """Weibull distribution."""

    kind: ClassVar[str] = "weibull"
    shape: float
    scale: float
    location: Annotated[float, Meaning("its smallest value")] = 0.0

    def __post_init__(self) -> None:
        self._check_finite(self.shape, self.scale, self.location)
        if not (self.shape > 0.0 and self.scale > 0.0):
            raise InputError(f"a Weibull distribution of shape {self.shape:g}, scale {self.scale:g}", "two numbers > 0")

    def quantile(self, u: np.ndarray) -> np.ndarray:
        p = np.minimum(u, MOST)
        return np.asarray(self.location + self.scale * (-np.log1p(-p)) ** (1.0 / self.shape))

    @property
    def ends(self) -> tuple[float, float]:
        return self.location, math.inf


@dataclass(frozen=True)
class Empirical(Variation):
    """Empirical distribution of measured values: their quantile function, linear between the sorted values."""

    kind: ClassVar[str] = "table"
    values: Annotated[tuple[float, ...], Meaning("at least two")]

    def __post_init__(self) -> None:
        object.__setattr__(self, "values", tuple(sorted(self._numbers(self.values))))
        if len(self.values) < 2:
            raise InputError(f"a table of {len(self.values)} values", "at least two values")

    def quantile(self, u: np.ndarray) -> np.ndarray:
        return np.asarray(np.interp(u, np.linspace(0.0, 1.0, len(self.values)), self.values))

    @property
    def ends(self) -> tuple[float, float]:
        return self.values[0], self.values[-1]


KINDS = (Levels, Names, Interval, Uniform, Normal, LogNormal, Trapezoid, Triangular, Beta, Weibull, Empirical)

VARIATIONS: Mapping[str, type[Any]] = MappingProxyType({variation.kind: documented(variation) for variation in KINDS})


def from_plain(plain: Mapping[str, Any]) -> Any:
    """Return the variation that plain data describe."""
    fields = dict(plain)
    kind = str(fields.pop("kind", ""))
    if kind not in VARIATIONS:
        raise InputError(f"variation '{kind}'{did_you_mean(kind, VARIATIONS)}", ", ".join(VARIATIONS))
    return VARIATIONS[kind](**{name: tuple(value) if isinstance(value, list) else value for name, value in fields.items()})


# --- fits of hole and shaft by ISO 286-1:2010, and the radial clearance that they give --------------------------------------
#
# The tables are those of the standard: tolerance grades IT5 to IT11 (table 1) and fundamental deviations of the shafts e, f, g,
# h (table 4) for diameters up to 500 mm. The standard tolerance unit, from which the tables are rounded, is
# i = 0.45 D^(1/3) + 0.001 D [um] with the geometric mean D [mm] of a range of diameters.

DIAMETERS = (3, 6, 10, 18, 30, 50, 80, 120, 180, 250, 315, 400, 500)
"""Upper ends of the ranges of nominal diameters [mm], which belong to their range."""

DIAMETER_MIN = 1.0  # [mm] smallest nominal diameter

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
"""Width of the tolerance field by grade and range of diameters [um]."""

DEVIATIONS: Mapping[str, tuple[int, ...]] = MappingProxyType(
    {
        "e": (14, 20, 25, 32, 40, 50, 60, 72, 85, 100, 110, 125, 135),
        "f": (6, 10, 13, 16, 20, 25, 30, 36, 43, 50, 56, 62, 68),
        "g": (2, 4, 5, 6, 7, 9, 10, 12, 14, 15, 17, 18, 20),
        "h": (0,) * 13,
    }
)
"""Distance of the upper limit of a shaft below the nominal diameter [um]."""

TEXT = re.compile(r"\s*([A-Za-z]+)(\d+)\s*/\s*([A-Za-z]+)(\d+)\s*")

SAMPLE = "'H7/g6 at 10 mm'"


@documented
@dataclass(frozen=True)
class Fit:
    """A hole and a shaft of the same nominal diameter, by ISO 286-1:2010."""

    hole_grade: Annotated[int, Meaning("of a hole H: 5 to 11")]
    shaft: Annotated[str, Meaning("fundamental deviation of the shaft: e, f, g or h")]
    shaft_grade: int
    diameter: Annotated[float, Quantity("m", help="nominal diameter")]

    def __post_init__(self) -> None:
        for grade in (self.hole_grade, self.shaft_grade):
            if not isinstance(grade, int) or grade not in GRADES:
                raise InputError(f"tolerance grade {grade}", f"{min(GRADES)} to {max(GRADES)}", SAMPLE)
        if not isinstance(self.shaft, str) or self.shaft not in DEVIATIONS:
            raise InputError(f"shaft '{self.shaft}'", ", ".join(DEVIATIONS), SAMPLE)
        if not is_number(self.diameter):
            raise InputError(f"a fit at {shown(self.diameter)}", "a diameter [m]", SAMPLE)
        if not DIAMETER_MIN <= self._millimetres <= DIAMETERS[-1]:
            raise InputError(
                f"a fit at {self._millimetres:g} mm", f"diameters of {DIAMETER_MIN:g} to {DIAMETERS[-1]} mm", SAMPLE
            )

    @property
    def _millimetres(self) -> float:
        return round(self.diameter * 1e3, 9)

    @property
    def _range(self) -> int:
        return next(k for k, end in enumerate(DIAMETERS) if self._millimetres <= end)

    @property
    def hole(self) -> tuple[float, float]:
        """Lower and upper deviation of the hole [m]."""
        return 0.0, GRADES[self.hole_grade][self._range] * 1e-6

    @property
    def pin(self) -> tuple[float, float]:
        """Lower and upper deviation of the shaft [m]."""
        upper = -DEVIATIONS[self.shaft][self._range]
        return (upper - GRADES[self.shaft_grade][self._range]) * 1e-6, upper * 1e-6

    def clearance(self, normal: bool = False) -> Trapezoid | Normal:
        """Return the radial clearance, half of the difference of the diameters [m].

        Parameters
        ----------
        normal : bool
            Whether the diameters are normal about the middle of their tolerance fields, whose limits are three standard
            deviations away; otherwise they are uniform within them, and the clearance has a trapezoidal distribution.
        """
        least, most = 0.5 * (self.hole[0] - self.pin[1]), 0.5 * (self.hole[1] - self.pin[0])
        widths = sorted((0.5 * (self.hole[1] - self.hole[0]), 0.5 * (self.pin[1] - self.pin[0])))
        if not normal:
            return Trapezoid(least, least + widths[0], most - widths[0], most)
        deviation = float((widths[0] ** 2 + widths[1] ** 2) ** 0.5 / 6.0)  # limits are three standard deviations away
        return Normal(0.5 * (least + most), deviation, least, most)


def read_fit(text: str, diameter: float) -> Fit:
    """Read a fit such as ``H7/g6``."""
    match = TEXT.fullmatch(text)
    if match is None:
        raise InputError(f"fit '{text.strip()}'", "a hole H and a shaft e, f, g or h with their grades", SAMPLE)
    hole, hole_grade, shaft, shaft_grade = match.groups()
    if hole != "H":
        raise InputError(f"hole '{hole}'", "H", SAMPLE)
    return Fit(int(hole_grade[:3]), shaft, int(shaft_grade[:3]), diameter)
