"""What a study of cheap runs is verified with: the same case with accurate runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from scissordyn.errors import whole_number
from scissordyn.model.mechanism import Mechanism
from scissordyn.run.configuration import read_mechanism, write_configuration
from scissordyn.run.options import Options

PILOT = 8
"""Points of both kinds of runs that a budget is split by, and the least number of points that are verified."""


@dataclass(frozen=True)
class Accurate:
    """The accurate runs of a study whose own runs are cheap."""

    mechanism: Mechanism  # With the same numbers at the parameter paths that vary
    options: Options
    points: int = 32  # First points of the design that are run accurately too; of an optimisation, the most points of its front
    variants: tuple[Mechanism, ...] = ()  # With each combination of names, as those of the study

    def __post_init__(self) -> None:
        whole_number("verify", self.points, PILOT)

    def to_plain(self) -> dict[str, Any]:
        """As plain data for JSON."""
        variants = {"variants": [mechanism_text(variant) for variant in self.variants]} if self.variants else {}
        text = mechanism_text(self.mechanism)
        return {"mechanism": text, "options": self.options.keywords, "points": self.points, **variants}

    @classmethod
    def from_plain(cls, plain: Mapping[str, Any], *, allow_code: Sequence[Path] = (), reading: bool = False) -> Accurate:
        """What `to_plain` wrote; see `Study.from_plain`."""
        mechanism, *variants = (
            text if reading else read_mechanism(text, allow_code) for text in (plain["mechanism"], *plain.get("variants", ()))
        )
        return cls(mechanism, read_options(plain["options"]), plain["points"], tuple(variants))


def mechanism_text(mechanism: Mechanism | str) -> str:
    """What a study keeps of a mechanism: a case file, as it is where the study is only read."""
    return write_configuration(mechanism) if isinstance(mechanism, Mechanism) else mechanism


def read_options(plain: Mapping[str, Any]) -> Options:
    """The options of a study's runs, also of one of an earlier version, which named their class."""
    return Options(**{name: value for name, value in plain.items() if name != "kind"})
