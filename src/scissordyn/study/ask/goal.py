"""Goals of an optimisation, and measures of risk over the uncertain numbers."""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from scissordyn.errors import InputError, whole_number
from scissordyn.study.ask.design import Design
from scissordyn.study.ask.distribution import Levels, Names, Variation
from scissordyn.study.ask.requirement import Response, read_response

RISK = re.compile(r"(mean|worst)|(quantile|cvar)\s+(\d+(?:\.\d+)?)\s*%")


@dataclass(frozen=True)
class Goal:
    """A response to be made small, or large."""

    measure: str  # Or the parameter path of a number that is chosen
    part: str = ""
    maximise: bool = False

    @property
    def response(self) -> Response:
        """The number that counts: of several joints the worst."""
        return Response(self.measure, self.part, self.maximise)

    @property
    def label(self) -> str:
        """As the user writes it."""
        return f"{'maximise' if self.maximise else 'minimise'} {self.response.name}"


@dataclass(frozen=True)
class Optimisation:
    """How the best point is searched for: CMA-ES for one goal, NSGA-II for several, all combinations where names are chosen."""

    goals: tuple[Goal, ...]
    # What counts of a goal over the uncertain numbers and members: "mean", "worst", "quantile 95 %" or "cvar 95 %", the mean
    # of the worst 5 %
    risk: str = "mean"
    population: int = 0  # Candidates of a generation; 0 for the method's own choice
    generations: int = 20
    seed: int = 0
    every: bool = False  # Whether all combinations of what is listed are tried, as one generation

    def __post_init__(self) -> None:
        if not self.goals:
            raise InputError("an optimisation without a goal", "at least one", "'minimise peak_force'")
        risk_value(np.zeros((1, 1)), self.risk)
        for name, least in (("population", 0), ("generations", 1), ("seed", 0)):
            whole_number(name, getattr(self, name), least)
        if self.every and self.generations > 1:
            raise InputError("more generations of a search that tries all combinations", "generations = 1")

    def over(self, variations: Sequence[Variation]) -> Optimisation:
        """The same search; where names are chosen, the one that tries all combinations."""
        if not any(isinstance(variation, Names) for variation in variations):
            return self
        if not all(isinstance(variation, Names | Levels) for variation in variations):
            what = "a search over names, which tries all combinations, and over a range"
            raise InputError(what, "lists of all that is chosen", '"A.clearance" = "0.1, 0.2, 0.3 mm"')
        return dataclasses.replace(
            self, population=math.prod(variation.count for variation in variations), generations=1, every=True
        )

    def size(self, factors: int) -> int:
        """Candidates of a generation: by default 4 + 3 ln n (Hansen 2016), or 40 with several goals."""
        if self.every:
            return self.population
        if self.population:
            return max(self.population, 4)
        return 4 + int(3 * np.log(max(factors, 2))) if len(self.goals) == 1 else 40

    def design(self, generations: int, factors: int) -> Design:
        return Design("adaptive", generations * self.size(factors))


def read_goal(text: str, units: Mapping[str, str] | None = None, parameters: Sequence[str] = ()) -> Goal:
    """A goal such as ``minimise peak_force``."""
    direction, _, rest = text.strip().partition(" ")
    if direction not in ("minimise", "maximise") or not rest:
        raise InputError(f"goal '{text}'", "minimise or maximise, and a measure", "'minimise peak_force'")
    if rest.strip() in parameters:
        return Goal(rest.strip(), "", direction == "maximise")
    part, measure, _ = read_response(rest.strip(), units)
    return Goal(measure, part, direction == "maximise")


def risk_value(values: np.ndarray, risk: str) -> np.ndarray:
    """A measure of risk of values of which large ones are bad.

    Shapes: `values` (points, cases); returns (points,).
    """
    match = RISK.fullmatch(risk.strip())
    if match is None or (match[3] and not 0.0 < float(match[3]) < 100.0):
        raise InputError(f"risk '{risk}'", "mean, worst, quantile 95 %, cvar 95 %", "'cvar 95 %'")
    if match[1] == "mean":
        return np.asarray(np.mean(values, axis=1))
    if match[1] == "worst":
        return np.asarray(np.max(values, axis=1))
    fraction = float(match[3]) / 100.0
    if match[2] == "quantile":
        return np.asarray(np.quantile(values, fraction, axis=1, method="inverted_cdf"))
    threshold = np.quantile(values, fraction, axis=1, method="inverted_cdf")
    beyond = np.maximum(values - threshold[:, None], 0.0)
    return np.asarray(threshold + np.mean(beyond, axis=1) / (1.0 - fraction))
