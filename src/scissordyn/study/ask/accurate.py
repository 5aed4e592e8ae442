"""What a study of cheap runs is verified with: the same case with accurate runs."""

from __future__ import annotations

from dataclasses import dataclass

from scissordyn.errors import whole_number
from scissordyn.model.mechanism import Mechanism
from scissordyn.run.options import Options

PILOT = 8  # Points of both kinds of runs that a budget is split by, and the least number of points that are verified


@dataclass(frozen=True)
class Accurate:
    """The accurate runs of a study whose own runs are cheap."""

    mechanism: Mechanism  # With the same numbers at the parameter paths that vary
    options: Options
    points: int = 32  # First points of the design that are run accurately too; of an optimisation, the most points of its front
    variants: tuple[Mechanism, ...] = ()  # With each combination of names, as those of the study

    def __post_init__(self) -> None:
        whole_number("verify", self.points, PILOT)
