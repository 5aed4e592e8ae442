"""Checks of the paper's statements, and their answers."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from scissordyn_paper.cases import Choice, PaperCase
from scissordyn_paper.measures import Measures
from scissordyn_paper.periodic import PERIODIC, Regularity

Measured = Mapping[PaperCase, Measures]

Settled = Mapping[PaperCase, Regularity]  # Regularity of the asymptotic motions under the periodic drive, by case


@dataclass(frozen=True)
class Finding:
    """Result of evaluating the criterion of a check."""

    holds: bool  # True if the criterion is met, so that the statement of the paper agrees
    words: str  # Text of the measured numbers
    numbers: dict[str, float]  # Measured numbers by name; each name ends in its unit

    @property
    def answer(self) -> str:
        """Text "agrees" if the criterion is met, otherwise "differs"."""
        return "agrees" if self.holds else "differs"


@dataclass(frozen=True)
class Periodically:
    """Criterion of a check for the asymptotic motion under the periodic drive."""

    criterion: str  # Text of the criterion
    find: Callable[[Choice, Settled], Finding]  # Function that evaluates the criterion on the motions of a choice


@dataclass(frozen=True)
class Check:
    """Part of a statement of the paper that is answered by yes or no."""

    key: str  # Number of the statement and a letter, such as "4c"
    says: str  # The paper's statement, paraphrased
    criterion: str  # Text of the criterion
    because: str  # Reason why the criterion follows from the paper's wording
    find: Callable[[Choice, Measured], Finding]  # Function that evaluates the criterion on the measured runs of a choice
    periodically: Periodically | None = None  # Criterion for the periodic drive; None if the check is only for the stroke

    @property
    def statement(self) -> int:
        """Number of the statement that the check belongs to."""
        return int(self.key[:-1])


@dataclass(frozen=True)
class Verdict:
    """Check with its answer."""

    check: Check
    finding: Finding
    # True if all runs of the check end before their predictability horizon; otherwise the numbers are one random sample, and
    # only their distribution over an ensemble is meaningful
    trusted: bool
    periodic: Finding | None = None  # Finding of the check under the periodic drive

    @property
    def answer(self) -> str:
        """Text "agrees" if the criterion is met, otherwise "differs"."""
        return self.finding.answer


class _RecordedMeasures(dict[PaperCase, Measures]):
    """Measures of runs by case, which record the cases that were looked up."""

    def __init__(self, measured: Measured) -> None:
        super().__init__(measured)
        self.used: set[PaperCase] = set()

    def __getitem__(self, case: PaperCase) -> Measures:
        self.used.add(case)
        return super().__getitem__(case)


def answer(check: Check, choice: Choice, measured: Measured, settled: Settled | None = None) -> Verdict:
    """Evaluate a check on the measured runs of a choice, and on the motions under the periodic drive if they are given."""
    recorded = _RecordedMeasures(measured)
    finding = check.find(choice, recorded)
    trusted = all(measured[case].trusted_until >= measured[case].end for case in recorded.used)
    if settled is None or check.periodically is None:
        return Verdict(check, finding, trusted)
    return Verdict(check, finding, trusted, check.periodically.find(PERIODIC, settled))
