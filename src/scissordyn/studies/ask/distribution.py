"""Ranges of a factor by their quantile functions: levels, an interval, a distribution of SciPy, measured values, names."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Annotated, Any, ClassVar

import numpy as np

from scissordyn.annotation import is_number, shown
from scissordyn.errors import InputError, did_you_mean
from scissordyn.units import Meaning, documented

GRID_LEVELS = 10  # Default number of levels of an interval in a grid design

PROBABILITY_MIN, PROBABILITY_MAX = 0.5 * np.finfo(float).epsneg, 1.0 - np.finfo(float).epsneg
"""[-] bounds of the probabilities at which quantile functions are evaluated, so that quantiles are finite."""

DISTRIBUTIONS = ("uniform", "norm", "truncnorm", "lognorm", "triang", "trapezoid", "beta", "weibull_min")
"""Names of SciPy's distributions that error messages suggest for varied parameters."""

DISTRIBUTION_SAMPLE = "norm(loc=0.8, scale=0.02)"  # Correct distribution, which error texts show


def _numbers(kind: str, values: Any) -> tuple[float, ...]:
    """Return several finite numbers as Python floats; raise `InputError` for anything else."""
    if isinstance(values, str | bytes | Mapping) or not isinstance(values, Iterable):
        raise InputError(f"{kind} of {shown(values)}", "a tuple of finite numbers")
    numbers = tuple(values)
    if not all(is_number(number) and math.isfinite(number) for number in numbers):
        texts = ", ".join(f"{number:g}" if is_number(number) else shown(number) for number in numbers)
        raise InputError(f"{kind} of {texts}", "finite numbers")
    return tuple(map(float, numbers))


class Variation:
    """Values that a factor can have, with their probabilities."""

    kind: ClassVar[str]

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
        """Smallest and largest value that can be drawn; infinite for an unbounded distribution."""
        low, high = self.quantile(np.array([0.0, PROBABILITY_MAX])).tolist()
        return low, high


@dataclass(frozen=True)
class Levels(Variation):
    """Given values, equally probable."""

    kind: ClassVar[str] = "levels"
    values: tuple[float, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "values", _numbers(self.kind, self.values))
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
    """Names, such as those of materials; a study holds their indices 0, 1, ... in the order given."""

    kind: ClassVar[str] = "names"
    values: Annotated[tuple[str, ...], Meaning("all different")]
    probabilities: Annotated[tuple[float, ...], Meaning("of each, with the sum 1; all the same if empty")] = ()

    def __post_init__(self) -> None:
        if not isinstance(self.values, tuple | list) or not all(isinstance(name, str) for name in self.values):
            raise InputError(f"names of {shown(self.values)}", "a tuple of texts", 'Names(("steel", "bronze"))')
        object.__setattr__(self, "values", tuple(self.values))
        object.__setattr__(self, "probabilities", _numbers(self.kind, self.probabilities))
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


@dataclass(frozen=True)
class Interval(Variation):
    """A range: equally spaced levels in a grid, uniform in a sample; both of the logarithm if `logarithmic`."""

    kind: ClassVar[str] = "interval"
    low: float
    high: float
    count: Annotated[int, Meaning("number of levels in a grid")] = GRID_LEVELS
    logarithmic: bool = False

    def __post_init__(self) -> None:
        low, high = _numbers("a range", (self.low, self.high))
        if not low < high:
            raise InputError(f"a range from {low:g} to {high:g} is empty", "a smaller number, then a larger one")
        if self.count < 2:
            raise InputError(f"{self.count} levels of a range", "an integer >= 2")
        if self.logarithmic and low <= 0.0:
            raise InputError(f"a logarithmic range from {low:g}", "numbers > 0")

    def quantile(self, u: np.ndarray) -> np.ndarray:
        if self.logarithmic:
            return np.asarray(self.low * (self.high / self.low) ** u)
        return np.asarray(self.low + u * (self.high - self.low))

    def levels(self) -> np.ndarray:
        space = np.geomspace if self.logarithmic else np.linspace
        return np.asarray(space(self.low, self.high, self.count))

    @property
    def ends(self) -> tuple[float, float]:
        return self.low, self.high


@dataclass(frozen=True)
class Distribution(Variation):
    """A continuous distribution of scipy.stats, by its name and the names of its arguments."""

    kind: ClassVar[str] = "distribution"
    name: str
    arguments: Any  # mapping of names to numbers; kept as pairs in the order of SciPy: shapes, loc, scale

    def __post_init__(self) -> None:
        names, arguments = argument_names(self.name), {"loc": 0.0, "scale": 1.0} | dict(self.arguments)
        if set(arguments) != set(names):
            raise InputError(
                f"{self.name} with {', '.join(arguments)}", f"{self.name}({', '.join(names)})", DISTRIBUTION_SAMPLE
            )
        numbers = _numbers(self.name, [arguments[name] for name in names])
        object.__setattr__(self, "arguments", tuple(zip(names, numbers, strict=True)))
        if not np.isfinite(self.quantile(np.array([0.5]))[0]):  # SciPy returns NaN for arguments out of range
            raise InputError(
                f"{self.text(lambda value: f'{value:g}')} is not a distribution",
                "arguments in their range",
                DISTRIBUTION_SAMPLE,
            )

    def quantile(self, u: np.ndarray) -> np.ndarray:
        with np.errstate(invalid="ignore"):  # of arguments out of range, which give NaN
            return np.asarray(_scipy(self.name).ppf(np.clip(u, PROBABILITY_MIN, PROBABILITY_MAX), **dict(self.arguments)))

    @property
    def ends(self) -> tuple[float, float]:
        support = _scipy(self.name).support(**dict(self.arguments))
        drawn = self.quantile(np.array([0.0, PROBABILITY_MAX]))  # an open end is never drawn
        low, high = np.where(np.isfinite(support), drawn, support).tolist()
        return low, high

    def text(self, write: Callable[[float], str]) -> str:
        """Return the text of the distribution in a study file, without its unit; `write` writes location and scale."""
        written = (
            f"{name}={write(number) if name in ('loc', 'scale') else f'{number:.4g}'}" for name, number in self.arguments
        )
        return f"{self.name}({', '.join(written)})"


def _scipy(name: str) -> Any:
    """Return a continuous distribution of scipy.stats, which is imported when the first one is used."""
    from scipy import stats

    distribution = getattr(stats, name, None)
    if not isinstance(distribution, stats.rv_continuous):
        allowed = f"a continuous distribution of scipy.stats: {', '.join(DISTRIBUTIONS)}, ..."
        raise InputError(f"unknown distribution '{name}'{did_you_mean(name, DISTRIBUTIONS)}", allowed, DISTRIBUTION_SAMPLE)
    return distribution


def argument_names(name: str) -> Sequence[str]:
    """Return the names of the arguments of a distribution of scipy.stats, in their order."""
    return [*filter(None, (_scipy(name).shapes or "").split(", ")), "loc", "scale"]


def from_scipy(frozen: Any) -> Distribution:
    """Return a distribution such as ``scipy.stats.norm(0.8, 0.02)``."""
    names = argument_names(frozen.dist.name)
    return Distribution(frozen.dist.name, dict(zip(names, frozen.args, strict=False)) | frozen.kwds)


def within_tolerance(shape: str, middle: float, width: float, deviation: float | None = None) -> Distribution:
    """Return a distribution from `middle` - `width` to `middle` + `width`: "uniform", "triang" or "norm".

    The standard deviation of the normal distribution, which is truncated, is by default a third of the width.
    """
    if shape == "norm":
        deviation = width / 3.0 if deviation is None else deviation
        return Distribution("truncnorm", {"a": -width / deviation, "b": width / deviation, "loc": middle, "scale": deviation})
    shapes = {"c": 0.5} if shape == "triang" else {}
    return Distribution(shape, {**shapes, "loc": middle - width, "scale": 2.0 * width})


@dataclass(frozen=True)
class Empirical(Variation):
    """Empirical distribution of measured values: their quantile function, linear between the sorted values."""

    kind: ClassVar[str] = "table"
    values: Annotated[tuple[float, ...], Meaning("at least two")]

    def __post_init__(self) -> None:
        object.__setattr__(self, "values", tuple(sorted(_numbers("a table", self.values))))
        if len(self.values) < 2:
            raise InputError(f"a table of {len(self.values)} values", "at least two values")

    def quantile(self, u: np.ndarray) -> np.ndarray:
        return np.asarray(np.interp(u, np.linspace(0.0, 1.0, len(self.values)), self.values))

    @property
    def ends(self) -> tuple[float, float]:
        return self.values[0], self.values[-1]


KINDS = (Levels, Names, Interval, Distribution, Empirical)  # Classes that describe how a parameter varies

VARIATIONS: Mapping[str, type[Any]] = MappingProxyType({variation.kind: variation for variation in KINDS})
"""Classes that describe how a parameter varies, by the name of their kind."""

for _public in (Levels, Names, Interval, Empirical):
    documented(_public)


def from_plain(plain: Mapping[str, Any]) -> Any:
    """Return the variation that plain data describe."""
    fields = dict(plain)
    kind = str(fields.pop("kind", ""))
    if kind not in VARIATIONS:
        raise InputError(f"unknown variation '{kind}'{did_you_mean(kind, VARIATIONS)}", ", ".join(VARIATIONS))
    return VARIATIONS[kind](**{name: tuple(value) if isinstance(value, list) else value for name, value in fields.items()})
