"""The numbers and names of a study that vary, how the uncertain ones are sampled, and the mechanisms that names make."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from scissordyn.errors import InputError, did_you_mean, whole_number
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.parameter_path import changed_all, number
from scissordyn.run.answer.measure import MEASURES, parts_of
from scissordyn.study.ask.design import INDEPENDENT, check_seed
from scissordyn.study.ask.distribution import Interval, Names, Variation

if TYPE_CHECKING:
    from scissordyn.study.ask.description import Study


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


def by_variant(study: Study, values: Mapping[str, np.ndarray]) -> Iterator[tuple[Mechanism, np.ndarray]]:
    count = len(next(iter(values.values())))
    every: dict[str, Any] = {**own_values(study), **values}
    chosen = [factor.places(np.broadcast_to(every[factor.name], count)) for factor in study.apart]
    which = np.ravel_multi_index(chosen, _counts(study)) if chosen else np.zeros(count, int)
    for place in np.unique(which):
        yield study.variants[place] if chosen else study.mechanism, np.flatnonzero(which == place)


def mechanism_of(study: Study, values: Mapping[str, float], *, nominal: bool = False) -> Mechanism:
    ((mechanism, _),) = by_variant(study, {name: np.array([value]) for name, value in values.items()})
    apart = {factor.name for factor in study.apart}
    numbers = {name: value for name, value in values.items() if name not in apart} if nominal else study.applied(values)
    return changed_all(mechanism, numbers)


def labelled(study: Study, values: Mapping[str, float]) -> dict[str, float | str]:
    """Numbers by parameter, with the names in place of what stands for them."""
    labels = {factor.name: factor.labels for factor in study.apart if factor.labels}
    return {name: labels[name][int(value)] if name in labels else value for name, value in values.items()}


def own_values(study: Study) -> dict[str, float]:
    """Values of the factors apart in the mechanism itself, the first ones if it is none of the variants."""
    variant = study.variants.index(study.mechanism) if study.mechanism in study.variants else 0
    places = np.unravel_index(variant, _counts(study))
    return {factor.name: float(factor.variation.levels()[place]) for factor, place in zip(study.apart, places, strict=True)}


def with_places(study: Study, places: Mapping[str, Sequence[int]]) -> Study:
    """The study with some names and levels of its factors apart only."""
    if not places:
        return study
    kept = np.ix_(*(places.get(factor.name, range(factor.variation.count)) for factor in study.apart))

    def fewer(factor: Factor) -> Factor:
        if factor.name not in places:
            return factor
        every: Any = factor.variation
        return replace(factor, variation=type(every)(tuple(every.values[place] for place in places[factor.name])))

    return replace(
        study,
        factors=tuple(map(fewer, study.factors)),
        uncertain=tuple(map(fewer, study.uncertain)),
        variants=tuple(study.variants[k] for k in np.arange(len(study.variants)).reshape(_counts(study))[kept].ravel()),
    )


def check_variants(study: Study) -> None:
    """Raise `InputError` for a design that needs an order of names, or variants that measures cannot be compared of."""
    if not study.apart:
        return
    named = [factor.path for factor in study.apart if factor.labels]
    goals = [goal.measure for goal in study.optimisation.goals] if study.optimisation is not None else []
    if named and study.design.kind == "morris":
        what = f"'{named[0]}': names, which have no order, in a Morris design"
        raise InputError(what, "a design for Sobol indices", 'kind = "saltelli"')
    if any(parameter in goals for parameter in named):
        raise InputError(f"a goal about names, '{named[0]}'", "a goal about a measure or a number", "'minimise mass'")
    if study.design.kind == "one-at-a-time" and study.mechanism not in study.variants:
        what = f"'{study.apart[0].path}' in a one-at-a-time design, without what the case has"
        raise InputError(what, "the names and levels of the case among them")
    for factor in (varied for varied in (*study.factors, *study.uncertain) if not varied.texts):
        units = {quantity.unit for varied in study.variants if (quantity := number(varied, factor.path).quantity) is not None}
        if len(units) > 1:
            raise InputError(f"'{factor.path}' in [{'] and ['.join(sorted(units))}], by name", "a number of one unit")
    dims = {dim for name in study.measures for dim in MEASURES[name].dims}
    first, *others = (parts_of(variant) for variant in study.variants)
    differs = next((dim for parts in others for dim in dims if parts[dim] != first[dim]), None)
    if differs is not None:
        what = f"measures of each {differs}, of which the mechanisms have different ones"
        raise InputError(what, f"names and dimensions with which each {differs} stays, or other measures")


def _counts(study: Study) -> list[int]:
    return [factor.variation.count for factor in study.apart]
