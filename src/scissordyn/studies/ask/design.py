"""Factors of a study, and designs of experiments; each point and sample follows from its index alone."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from types import MappingProxyType
from typing import Any

import numpy as np

from scissordyn.errors import InputError, did_you_mean, whole_number
from scissordyn.lookup import library
from scissordyn.studies.ask.distribution import Interval, Names, Variation

PHILOX_WORDS = 4  # Number of random numbers that each counter value of the Philox generator gives
INTEGER_MAX = 2**62  # largest seed and sample count: random generators and SQLite take 64 bits, and an offset is added to seeds
SEED_SAMPLE = "--seed 1, or seed = 1"  # Correct seeds, which error texts show

# [-] factor that shrinks Morris's trajectories towards the middle of the unit cube; all quantiles are then finite
MORRIS_SCALE = 0.99

# Number of levels of Morris's trajectories, as usual: Campolongo et al., Environ. Model. Softw. 22, 1509 (2007).
MORRIS_LEVELS = 4
POINTS_MIN = 8  # Smallest number of points from which a sensitivity index, a response or a correlation is estimated


@dataclass(frozen=True)
class Factor:
    """Parameter that varies in a study: a number, or a name from a list."""

    # Parameter path, or key of the case file that names replace; a pattern (``clearance.all.clearance``) sets all its matches
    path: str
    variation: Variation  # Values in SI units; for names, their indices in `Names`
    unit: str = ""  # Unit in pictures and tables; empty for SI
    scale: float = 1.0  # Size of `unit` in SI units
    # Path or pattern of the chosen parameter to which the variation is added as a deviation; empty for none
    of: str = ""
    relative: bool = False  # True if the deviation is a fraction of the chosen value
    si: str = ""  # SI unit of a number that only the case file has, so that each level needs its own mechanism; or empty

    @property
    def name(self) -> str:
        """Name of the column: the parameter path, or that of the deviation from a chosen value."""
        return f"{self.path} deviation" if self.of else self.path

    def deviated_ends(self, chosen: Variation) -> list[float]:
        """Return the values at the ends of a chosen parameter plus those of this deviation, without infinite ends."""
        deviations = [end for end in self.variation.ends if np.isfinite(end)]
        return [end * (1.0 + by) if self.relative else end + by for end in chosen.ends if np.isfinite(end) for by in deviations]

    @property
    def labels(self) -> tuple[str, ...]:
        """Names in the order of their indices; empty for a number."""
        return self.variation.values if isinstance(self.variation, Names) else ()

    @property
    def texts(self) -> tuple[str, ...]:
        """Text of each name or level in the case file; empty for a number that can be set in a mechanism."""
        if not self.si:
            return self.labels
        return tuple(f"{value / self.scale:.12g} {self.unit}".rstrip() for value in self.variation.levels())

    def places(self, values: Any) -> np.ndarray:
        """Return the indices of values in the list of names or levels."""
        return np.asarray(np.abs(np.subtract.outer(values, self.variation.levels())).argmin(axis=-1))

    @property
    def logarithmic(self) -> bool:
        """True if the values are spread evenly over the logarithm."""
        return isinstance(self.variation, Interval) and self.variation.logarithmic

    @property
    def shown(self) -> dict[str, Any]:
        """Attributes of variables with the unit or the names that pictures show."""
        if self.labels:
            return {"labels": list(self.labels)}
        return {"shown_unit": self.unit, "shown_scale": self.scale} if self.unit else {}


@dataclass(frozen=True)
class Sampling:
    """Sampling of the uncertain parameters at every point of the design."""

    samples: int = 1
    kind: str = "sobol"
    seed: int = 0
    # True if all points have the same samples (common random numbers), so that differences between points are not noise
    common: bool = True

    def __post_init__(self) -> None:
        if self.kind not in INDEPENDENT:
            near = did_you_mean(self.kind, INDEPENDENT)
            raise InputError(f"sampling '{self.kind}'{near}", ", ".join(INDEPENDENT), 'kind = "sobol"')
        whole_number("samples", self.samples)
        whole_number("seed", self.seed, 0, INTEGER_MAX, sample=SEED_SAMPLE)
        if not self.common and self.kind == "latin-hypercube":
            raise InputError("a separate Latin hypercube for each point", "common = true, or random, or sobol")


@dataclass(frozen=True)
class Design:
    """Choice of the points of a study."""

    # "grid", "zip", "random", "latin-hypercube", "sobol", "one-at-a-time", "saltelli" (for Sobol indices), "morris", or
    # "adaptive" (points that an optimiser proposes)
    kind: str = "grid"
    # Number of points of a random, Latin hypercube or Sobol design; of base points of a Saltelli design; of trajectories of a
    # Morris design
    points: int = 0
    seed: int = 0

    def __post_init__(self) -> None:
        if self.kind not in DESIGNS:
            raise InputError(f"unknown design '{self.kind}'{did_you_mean(self.kind, DESIGNS)}", ", ".join(DESIGNS))
        points, least = self.points, 1 if self.kind in SAMPLED else 0
        if isinstance(points, bool) or not isinstance(points, int) or points < least:
            sample = "--points 32, or points = 32"
            raise InputError(f"points = {points!r} of a {self.kind} design", f"a whole number >= {least}", sample)
        if self.kind in LEVEL_DESIGNS and points:
            raise InputError(
                f"points = {points} of a {self.kind} design, whose points are the levels of the parameters",
                "a number of values for each parameter, or a sampled design",
                "'0.1..0.4 mm, 4 values', or a sobol design",
            )
        if self.kind in ("saltelli", "morris") and self.points < POINTS_MIN:
            what = "trajectories" if self.kind == "morris" else "base points"
            raise InputError(
                f"{self.points} {what} of a {self.kind} design", f"at least {POINTS_MIN}", f"--points {POINTS_MIN}"
            )
        whole_number("seed", self.seed, 0, INTEGER_MAX, sample=SEED_SAMPLE)

    @property
    def extendable(self) -> bool:
        """True if points can be added without changing the earlier ones."""
        return self.kind in EXTENDABLE


def uniform_numbers(seed: int, stream: int, dimensions: int, at: np.ndarray) -> np.ndarray:
    """Return uniform random numbers that depend only on their index.

    Philox numbers its outputs (Salmon et al., SC11, 2011): point k takes a fixed range of counts.

    Shapes: `at` (n,); returns (n, dimensions).
    """
    width = -(-dimensions // PHILOX_WORDS)
    drawn = np.empty((at.size, dimensions))
    starts = np.flatnonzero(np.diff(at, prepend=at[:1] - 2) != 1)  # runs of consecutive points are drawn at once
    for first, last in zip(starts, np.append(starts[1:], at.size), strict=True):
        bits = np.random.Philox(key=[seed, stream], counter=[int(at[first]) * width, 0, 0, 0])
        numbers = np.random.Generator(bits).random((last - first) * width * PHILOX_WORDS)
        drawn[first:last] = numbers.reshape(last - first, width * PHILOX_WORDS)[:, :dimensions]
    return drawn


def design_size(design: Design, variations: Sequence[Variation]) -> int:
    match design.kind:
        case "grid":
            return math.prod(variation.count for variation in variations)
        case "zip":
            sizes = {variation.count for variation in variations} - {1}
            if len(sizes) > 1:
                raise InputError(
                    f"lists of {' and '.join(map(str, sorted(sizes)))} values to zip",
                    "lists of one length",
                    "'0.05..0.4 mm, 3 values' and '50, 100, 200 N m'",
                )
            return max(sizes, default=1)
        case "one-at-a-time":
            return 1 + sum(variation.count for variation in variations)
        case _:
            return design.points * {"saltelli": len(variations) + 2, "morris": len(variations) + 1}.get(design.kind, 1)


def design_values(design: Design, variations: Sequence[Variation], base: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Return the values of the factors at the points `at` (n,), shape (n, factors)."""
    if design.kind in LEVEL_DESIGNS:
        return LEVEL_DESIGNS[design.kind](variations, base, at)
    if design.kind not in UNIT_CUBE_DESIGNS:
        raise InputError(f"design '{design.kind}' does not determine its points", "the points that an optimiser has proposed")
    return quantiles(variations, UNIT_CUBE_DESIGNS[design.kind](design, len(variations), at))


def _grid(variations: Sequence[Variation], base: np.ndarray, at: np.ndarray) -> np.ndarray:
    levels = [variation.levels() for variation in variations]
    if not levels:
        return np.empty((at.size, 0))
    places = np.unravel_index(at, [values.size for values in levels])
    return np.stack([values[place] for values, place in zip(levels, places, strict=True)], axis=1)


def _zip(variations: Sequence[Variation], base: np.ndarray, at: np.ndarray) -> np.ndarray:
    size = design_size(Design("zip"), variations)
    return np.stack([np.broadcast_to(variation.levels(), size)[at] for variation in variations], axis=1)


def _one_at_a_time(variations: Sequence[Variation], base: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Return point 0 (the unchanged mechanism), then the levels of each factor with all others unchanged."""
    rows, first = np.tile(base, (at.size, 1)), 1
    for place, variation in enumerate(variations):
        here = (at >= first) & (at < first + variation.count)
        rows[here, place] = variation.levels()[at[here] - first]
        first += variation.count
    return rows


@lru_cache(maxsize=4)
def _hypercube(points: int, dimensions: int, seed: int) -> np.ndarray:
    from scipy.stats import qmc

    return np.asarray(qmc.LatinHypercube(dimensions, rng=np.random.default_rng(seed)).random(points))


def sobol_numbers(seed: int, dimensions: int, at: np.ndarray) -> np.ndarray:
    """Return points of a scrambled Sobol sequence by their indices."""
    from scipy.stats import qmc

    low, high = int(at.min()), int(at.max()) + 1
    sequence = qmc.Sobol(dimensions, scramble=True, rng=np.random.default_rng(seed))
    if low:
        sequence.fast_forward(low)
        drawn = sequence.random(high - low)
    else:  # draw the first point separately: scipy warns if the first draw is not a power of two
        drawn = np.concatenate([sequence.random(1), sequence.random(high - 1)]) if high > 1 else sequence.random(1)
    return np.asarray(drawn[at - low])


def _saltelli_numbers(seed: int, d: int, at: np.ndarray) -> np.ndarray:
    """Return rows A, A with one column of B for each factor, and B, in the order that SALib expects (Saltelli et al. 2010)."""
    row, part = np.divmod(at, d + 2)
    both = sobol_numbers(seed, 2 * d, row)
    u = np.where((part == d + 1)[:, None], both[:, d:], both[:, :d])
    for k in range(d):
        u[part == k + 1, k] = both[part == k + 1, d + k]
    return u


@lru_cache(maxsize=4)
def _trajectories(count: int, dimensions: int, seed: int) -> np.ndarray:
    morris = library("SALib.sample.morris", "study", "a design by trajectories")
    problem = {"num_vars": dimensions, "names": [str(k) for k in range(dimensions)], "bounds": [[0.0, 1.0]] * dimensions}
    return np.asarray(morris.sample(problem, count, num_levels=MORRIS_LEVELS, seed=seed))


def morris_numbers(design: Design, dimensions: int) -> np.ndarray:
    """Return points of the trajectories in the unit cube, moved inwards by `MORRIS_SCALE`."""
    return 0.5 * (1.0 - MORRIS_SCALE) + MORRIS_SCALE * _trajectories(design.points, dimensions, design.seed)


def quantiles(variations: Sequence[Variation], u: np.ndarray) -> np.ndarray:
    """Return the values of each factor at the probabilities `u` (n, factors), shape (n, factors)."""
    return np.stack([variation.quantile(u[:, place]) for place, variation in enumerate(variations)], axis=1)


LEVEL_DESIGNS: Mapping[str, Callable[[Sequence[Variation], np.ndarray, np.ndarray], np.ndarray]] = MappingProxyType(
    {"grid": _grid, "zip": _zip, "one-at-a-time": _one_at_a_time}
)
"""Function that returns points at the levels of the factors, by kind of design."""

UNIT_CUBE_DESIGNS: Mapping[str, Callable[[Design, int, np.ndarray], np.ndarray]] = MappingProxyType(
    {
        "random": lambda design, d, at: uniform_numbers(design.seed, 0, d, at),
        "latin-hypercube": lambda design, d, at: _hypercube(design.points, d, design.seed)[at],
        "sobol": lambda design, d, at: sobol_numbers(design.seed, d, at),
        "saltelli": lambda design, d, at: _saltelli_numbers(design.seed, d, at),
        "morris": lambda design, d, at: morris_numbers(design, d)[at],
    }
)
"""Function that returns points in the unit cube (probabilities for the quantile functions), by kind of design."""

DESIGNS = (*LEVEL_DESIGNS, *UNIT_CUBE_DESIGNS, "adaptive")  # Names of all kinds of designs of a study

INDEPENDENT = ("random", "latin-hypercube", "sobol")  # Kinds of designs whose points sample the distributions of the parameters
SAMPLED = tuple(UNIT_CUBE_DESIGNS)  # Kinds of designs for which the user chooses the number of points
EXTENDABLE = ("random", "sobol", "saltelli", "adaptive")  # Kinds of designs to which points can be added
