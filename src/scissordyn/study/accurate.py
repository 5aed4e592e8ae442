"""What a study of cheap runs is verified with: the same case with accurate runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from scissordyn.errors import whole_number
from scissordyn.model.description import from_plain as described
from scissordyn.model.description import parse
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.record import to_plain
from scissordyn.run.configuration import Configuration
from scissordyn.run.options import Options

PILOT = 8
"""Points of both kinds of runs that a budget is split by, and the least number of points that are verified."""


@dataclass(frozen=True)
class Accurate:
    """The accurate runs of a study whose own runs are cheap."""

    mechanism: Mechanism  # With the same numbers at the addresses that vary
    options: Options
    points: int = 32  # First points of the design that are run accurately too; of an optimisation, the most points of its front
    variants: tuple[Mechanism, ...] = ()  # With each combination of names, as those of the study

    def __post_init__(self) -> None:
        whole_number("verify", self.points, PILOT)

    def to_plain(self) -> dict[str, Any]:
        """As plain data for JSON."""
        variants = {"variants": [to_plain(each) for each in self.variants]} if self.variants else {}
        return {"mechanism": to_plain(self.mechanism), "options": to_plain(self.options), "points": self.points, **variants}

    @classmethod
    def from_plain(cls, plain: Mapping[str, Any], *, allow_code: Sequence[Path] = (), reading: bool = False) -> Accurate:
        """What `to_plain` wrote; see `Study.from_plain`."""
        mechanism, *variants = (
            read_mechanism(each, allow_code, reading=reading) for each in (plain["mechanism"], *plain.get("variants", ()))
        )
        return cls(mechanism, described(plain["options"], Options), plain["points"], tuple(variants))


def read_mechanism(plain: Any, allow_code: Sequence[Path] = (), *, reading: bool = False) -> Mechanism:
    """A mechanism of plain data, or its description if it is only read."""
    read: Any = parse(plain, Mechanism)
    return read if reading else Configuration(read, plain).build_mechanism(allow_code)
