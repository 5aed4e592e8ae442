"""What a factor of a study varies over: levels, an interval, a distribution, or names, each given by its quantile function."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, ClassVar

import numpy as np
from scipy import special

from scissordyn.errors import InputError, did_you_mean

LEVELS = 10  # Levels of an interval in a grid if their number is not given

LEAST, MOST = np.finfo(float).tiny, 1.0 - np.finfo(float).epsneg
"""Probabilities that keep the quantiles of unbounded distributions finite."""


class Variation:
    """A set of values with a measure of probability on it."""

    kind: ClassVar[str]

    def _check_finite(self, *numbers: float) -> None:
        if not all(map(math.isfinite, numbers)):
            raise InputError(f"{self.kind} of {', '.join(f'{number:g}' for number in numbers)}", "finite numbers")

    def _check_ends(self, low: float, high: float) -> None:
        self._check_finite(low, high)
        if not low < high:
            raise InputError(f"a range from {low:g} to {high:g} is empty", "a smaller number, then a larger one")

    def quantile(self, u: np.ndarray) -> np.ndarray:
        """Values at probabilities u in [0, 1)."""
        raise NotImplementedError

    def levels(self) -> np.ndarray:
        """Values of a grid: quantiles in the middle of equally probable parts, or all that were given."""
        return self.quantile((np.arange(LEVELS) + 0.5) / LEVELS)

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
    """Given values, equally probable.

    Parameters
    ----------
    values : tuple of float
    """

    kind: ClassVar[str] = "levels"
    values: tuple[float, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "values", tuple(map(float, self.values)))
        if not self.values:
            raise InputError("an empty list of levels", "at least one value")
        self._check_finite(*self.values)

    def quantile(self, u: np.ndarray) -> np.ndarray:
        return np.asarray(np.asarray(self.values)[np.minimum((u * len(self.values)).astype(int), len(self.values) - 1)])

    def levels(self) -> np.ndarray:
        return np.asarray(self.values)

    @property
    def ends(self) -> tuple[float, float]:
        return min(self.values), max(self.values)


@dataclass(frozen=True)
class Names(Variation):
    """Names, such as those of materials, of which a study holds the places 0, 1, ... in the order given.

    Parameters
    ----------
    values : tuple of str
        All different.
    probabilities : tuple of float
        Of each, with the sum 1; all the same if empty.
    """

    kind: ClassVar[str] = "names"
    values: tuple[str, ...]
    probabilities: tuple[float, ...] = ()

    def __post_init__(self) -> None:
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
class Interval(Variation):
    """A range: equally spaced levels in a grid, uniform in a sample; both in the logarithm if asked for.

    Parameters
    ----------
    low, high : float
    count : int
        Number of levels in a grid.
    logarithmic : bool
    """

    kind: ClassVar[str] = "interval"
    low: float
    high: float
    count: int = LEVELS
    logarithmic: bool = False

    def __post_init__(self) -> None:
        self._check_ends(self.low, self.high)
        if self.count < 2:
            raise InputError(f"{self.count} levels of a range", "a whole number >= 2")
        if self.logarithmic and self.low <= 0.0:
            raise InputError(f"a logarithmic range from {self.low:g}", "numbers > 0")

    def quantile(self, u: np.ndarray) -> np.ndarray:
        if self.logarithmic:
            return np.asarray(self.low * (self.high / self.low) ** u)
        return np.asarray(self.low + u * (self.high - self.low))

    def levels(self) -> np.ndarray:
        space = np.geomspace if self.logarithmic else np.linspace
        return np.asarray(space(self.low, self.high, self.count))


@dataclass(frozen=True)
class Uniform(Variation):
    """Uniform distribution.

    Parameters
    ----------
    low, high : float
    """

    kind: ClassVar[str] = "uniform"
    low: float
    high: float

    def __post_init__(self) -> None:
        self._check_ends(self.low, self.high)

    def quantile(self, u: np.ndarray) -> np.ndarray:
        return np.asarray(self.low + u * (self.high - self.low))


@dataclass(frozen=True)
class Normal(Variation):
    """Normal distribution, truncated if ends are given.

    Parameters
    ----------
    mean, deviation : float
        Of the distribution before truncation.
    low, high : float
    """

    kind: ClassVar[str] = "normal"
    mean: float
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
    """Distribution of a number whose logarithm is normal.

    Parameters
    ----------
    median : float
    deviation : float
        Standard deviation of the natural logarithm.
    """

    kind: ClassVar[str] = "lognormal"
    median: float
    deviation: float

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

    Parameters
    ----------
    low, first, last, high : float
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
    """Triangular distribution.

    Parameters
    ----------
    low, mode, high : float
    """

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
    """Beta distribution on a range.

    Parameters
    ----------
    alpha, beta : float
        Shape parameters.
    low, high : float
    """

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
    """Weibull distribution.

    Parameters
    ----------
    shape, scale : float
    location : float
        Its smallest value.
    """

    kind: ClassVar[str] = "weibull"
    shape: float
    scale: float
    location: float = 0.0

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
    """Empirical distribution of measured values: their quantile function, linear between the sorted values.

    Parameters
    ----------
    values : tuple of float
        At least two.
    """

    kind: ClassVar[str] = "table"
    values: tuple[float, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "values", tuple(sorted(map(float, self.values))))
        if len(self.values) < 2:
            raise InputError(f"a table of {len(self.values)} values", "at least two values")
        self._check_finite(*self.values)

    def quantile(self, u: np.ndarray) -> np.ndarray:
        return np.asarray(np.interp(u, np.linspace(0.0, 1.0, len(self.values)), self.values))

    @property
    def ends(self) -> tuple[float, float]:
        return self.values[0], self.values[-1]


KINDS = (Levels, Names, Interval, Uniform, Normal, LogNormal, Trapezoid, Triangular, Beta, Weibull, Empirical)

VARIATIONS: Mapping[str, type[Any]] = MappingProxyType({variation.kind: variation for variation in KINDS})  # Variations by kind


def from_plain(plain: Mapping[str, Any]) -> Any:
    """The variation of plain data."""
    fields = dict(plain)
    kind = str(fields.pop("kind", ""))
    if kind not in VARIATIONS:
        raise InputError(f"variation '{kind}'{did_you_mean(kind, VARIATIONS)}", ", ".join(VARIATIONS))
    return VARIATIONS[kind](**{name: tuple(value) if isinstance(value, list) else value for name, value in fields.items()})
