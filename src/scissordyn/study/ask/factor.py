"""The numbers and names of a study that vary, and how the uncertain ones are sampled."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from scissordyn.errors import InputError, did_you_mean, whole_number
from scissordyn.study.ask.design import INDEPENDENT, check_seed
from scissordyn.study.ask.distribution import Interval, Names, Variation


@dataclass(frozen=True)
class Factor:
    """A number that varies, or a name."""

    # A pattern (``clearance.all.clearance``) gives all its places the same value; of a name, of what it is
    path: str
    variation: Variation  # Values in SI; of names, their places in `Names`
    unit: str = ""  # In which pictures and tables show it; empty for SI
    scale: float = 1.0  # One such unit in SI
    # The chosen number from which this one deviates by its variation; a pattern where it is one of several places
    of: str = ""
    relative: bool = False  # Whether the deviation is a fraction of the chosen value
    si: str = ""  # SI unit of a number that only the case file has, each of whose levels makes a mechanism of its own

    @property
    def name(self) -> str:
        """Of its column: the parameter path, or that of the deviation from a chosen value."""
        return f"{self.path} deviation" if self.of else self.path

    def deviating(self, chosen: Variation) -> list[float]:
        """The outermost values of a number that is chosen, with this deviation; none of a lognormal one, which has no ends."""
        if chosen.kind == "lognormal":
            return []
        deviations = [end for end in self.variation.ends if np.isfinite(end)]
        return [end * (1.0 + by) if self.relative else end + by for end in chosen.ends for by in deviations]

    @property
    def labels(self) -> tuple[str, ...]:
        """The names, by their places; empty for a number."""
        return self.variation.values if isinstance(self.variation, Names) else ()

    @property
    def texts(self) -> tuple[str, ...]:
        """What the case file has there, of each name or level; empty if mechanisms themselves have the number."""
        if not self.si:
            return self.labels
        return tuple(f"{value / self.scale:.12g} {self.unit}".rstrip() for value in self.variation.levels())

    def places(self, values: Any) -> np.ndarray:
        """Places of values in the list of names or levels."""
        return np.asarray(np.abs(np.subtract.outer(values, self.variation.levels())).argmin(axis=-1))

    @property
    def logarithmic(self) -> bool:
        """Whether the range is one of the logarithm."""
        return isinstance(self.variation, Interval) and self.variation.logarithmic

    @property
    def shown(self) -> dict[str, Any]:
        """Attributes that tell pictures the unit, or the names."""
        if self.labels:
            return {"labels": list(self.labels)}
        return {"shown_unit": self.unit, "shown_scale": self.scale} if self.unit else {}


@dataclass(frozen=True)
class Sampling:
    """How the uncertain numbers are sampled at every point of the design."""

    samples: int = 1
    kind: str = "sobol"
    seed: int = 0
    # Whether all points have the same samples (common random numbers), so that differences between points are not noise
    common: bool = True

    def __post_init__(self) -> None:
        if self.kind not in INDEPENDENT:
            near = did_you_mean(self.kind, INDEPENDENT)
            raise InputError(f"sampling '{self.kind}'{near}", ", ".join(INDEPENDENT), 'kind = "sobol"')
        whole_number("samples", self.samples)
        check_seed(whole_number("seed", self.seed, 0))
        if not self.common and self.kind == "latin-hypercube":
            raise InputError("a Latin hypercube of its own for each point", "common = true, or random, or sobol")
