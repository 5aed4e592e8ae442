"""What a number of a study varies over: levels, an interval, or a distribution, each given by its quantile function."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, ClassVar, Protocol, runtime_checkable

import numpy as np
from scipy import special

from scissordyn.errors import InputError, did_you_mean

__all__ = [
    "Empirical",
    "Interval",
    "Levels",
    "LogNormal",
    "Normal",
    "Uniform",
    "Variation",
    "from_plain",
    "to_plain",
]

LEVELS = 10
"""Levels of an interval in a grid if their number is not given."""


@runtime_checkable
class Variation(Protocol):
    """A set of values with a measure of probability on it."""

    kind: ClassVar[str]

    def quantile(self, u: np.ndarray) -> np.ndarray:
        """Values at probabilities u in [0, 1)."""

    def levels(self) -> np.ndarray:
        """Values to take in a grid, ascending or as given."""

    @property
    def count(self) -> int:
        """Number of these values."""

    @property
    def ends(self) -> tuple[float, float]:
        """Smallest and largest value; infinite where there is none."""


def _finite(kind: str, *numbers: float) -> None:
    if not all(map(math.isfinite, numbers)):
        raise InputError(f"{kind} of {', '.join(f'{number:g}' for number in numbers)}", "finite numbers")


def _ascending(kind: str, low: float, high: float) -> None:
    _finite(kind, low, high)
    if not low < high:
        raise InputError(f"{kind} from {low:g} to {high:g} is empty", "a smaller number, then a larger one")


@dataclass(frozen=True)
class Levels:
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
        _finite(self.kind, *self.values)

    def quantile(self, u: np.ndarray) -> np.ndarray:
        """The level in whose share of [0, 1) u is."""
        return np.asarray(np.asarray(self.values)[np.minimum((u * len(self.values)).astype(int), len(self.values) - 1)])

    def levels(self) -> np.ndarray:
        """The values as given."""
        return np.asarray(self.values)

    @property
    def count(self) -> int:
        """Number of values."""
        return len(self.values)

    @property
    def ends(self) -> tuple[float, float]:
        """Smallest and largest level."""
        return min(self.values), max(self.values)


@dataclass(frozen=True)
class Interval:
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
        _ascending("a range", self.low, self.high)
        if self.count < 2:
            raise InputError(f"{self.count} levels of a range", "a whole number >= 2")
        if self.logarithmic and self.low <= 0.0:
            raise InputError(f"a logarithmic range from {self.low:g}", "numbers > 0")

    def quantile(self, u: np.ndarray) -> np.ndarray:
        """Low + u (high - low), or low (high/low)^u."""
        if self.logarithmic:
            return np.asarray(self.low * (self.high / self.low) ** u)
        return np.asarray(self.low + u * (self.high - self.low))

    def levels(self) -> np.ndarray:
        """Equally spaced values, with both ends."""
        space = np.geomspace if self.logarithmic else np.linspace
        return np.asarray(space(self.low, self.high, self.count))

    @property
    def ends(self) -> tuple[float, float]:
        """The ends of the range."""
        return self.low, self.high


class _Distribution:
    count: ClassVar[int] = LEVELS

    def quantile(self, u: np.ndarray) -> np.ndarray:
        raise NotImplementedError

    def levels(self) -> np.ndarray:
        """Quantiles in the middle of `LEVELS` equally probable parts."""
        return self.quantile((np.arange(LEVELS) + 0.5) / LEVELS)


@dataclass(frozen=True)
class Uniform(_Distribution):
    """Uniform distribution.

    Parameters
    ----------
    low, high : float
    """

    kind: ClassVar[str] = "uniform"
    low: float
    high: float

    def __post_init__(self) -> None:
        _ascending("a uniform distribution", self.low, self.high)

    def quantile(self, u: np.ndarray) -> np.ndarray:
        """Low + u (high - low)."""
        return np.asarray(self.low + u * (self.high - self.low))

    @property
    def ends(self) -> tuple[float, float]:
        """The ends of the range."""
        return self.low, self.high


@dataclass(frozen=True)
class Normal(_Distribution):
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
        _finite("a normal distribution", self.mean, self.deviation)
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
        """Mean + deviation Phi^-1(p), p between the probabilities of the ends."""
        below, above = self._share()
        # the smallest probability of a sample keeps the untruncated quantile finite
        p = np.clip(below + np.asarray(u) * (above - below), np.finfo(float).tiny, 1.0 - np.finfo(float).epsneg)
        return np.asarray(np.clip(self.mean + self.deviation * special.ndtri(p), self.low, self.high))

    @property
    def ends(self) -> tuple[float, float]:
        """The truncation."""
        return self.low, self.high


@dataclass(frozen=True)
class LogNormal(_Distribution):
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
        _finite("a lognormal distribution", self.median, self.deviation)
        if not (self.median > 0.0 and self.deviation > 0.0):
            raise InputError(f"lognormal of {self.median:g}, {self.deviation:g}", "a median > 0 and a deviation > 0")

    def quantile(self, u: np.ndarray) -> np.ndarray:
        """Median exp(deviation Phi^-1(u))."""
        p = np.clip(u, np.finfo(float).tiny, 1.0 - np.finfo(float).epsneg)
        return np.asarray(self.median * np.exp(self.deviation * special.ndtri(p)))

    @property
    def ends(self) -> tuple[float, float]:
        """0 and infinity."""
        return 0.0, math.inf


@dataclass(frozen=True)
class Empirical(_Distribution):
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
        _finite("a table", *self.values)

    def quantile(self, u: np.ndarray) -> np.ndarray:
        """Value at the fraction u of the way through the sorted values."""
        return np.asarray(np.interp(u, np.linspace(0.0, 1.0, len(self.values)), self.values))

    @property
    def ends(self) -> tuple[float, float]:
        """Smallest and largest value."""
        return self.values[0], self.values[-1]


VARIATIONS: Mapping[str, type[Any]] = MappingProxyType(
    {each.kind: each for each in (Levels, Interval, Uniform, Normal, LogNormal, Empirical)}
)
"""Variations by kind."""


def to_plain(variation: Any) -> dict[str, Any]:
    """A variation as plain data for JSON."""
    return {"kind": variation.kind, **{f.name: getattr(variation, f.name) for f in dataclasses.fields(variation)}}


def from_plain(plain: Mapping[str, Any]) -> Any:
    """The variation that `to_plain` wrote."""
    fields = dict(plain)
    kind = str(fields.pop("kind", ""))
    if kind not in VARIATIONS:
        raise InputError(f"variation '{kind}'{did_you_mean(kind, VARIATIONS)}", ", ".join(VARIATIONS))
    return VARIATIONS[kind](**{name: tuple(value) if isinstance(value, list) else value for name, value in fields.items()})
