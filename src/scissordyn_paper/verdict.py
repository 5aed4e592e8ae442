"""Checks of the paper's statements, and their answers."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from scissordyn_paper.cases import Choice, PaperCase
from scissordyn_paper.measures import Measures
from scissordyn_paper.periodic import PERIODIC, Regularity

Measured = Mapping[PaperCase, Measures]

Settled = Mapping[PaperCase, Regularity]  # The asymptotic motions under the periodic drive


@dataclass(frozen=True)
class Finding:
    """Finding of one check: whether the statement holds, with its numbers."""

    holds: bool  # True if the criterion is met
    words: str  # The measured numbers in a sentence
    numbers: dict[str, float]  # The numbers by name; the name ends in its unit

    @property
    def answer(self) -> str:
        """The finding as a word: "agrees" or "differs"."""
        return "agrees" if self.holds else "differs"


@dataclass(frozen=True)
class Periodically:
    """Evaluation of a check for the periodic drive, from the asymptotic motion."""

    criterion: str  # Criterion of the check
    find: Callable[[Choice, Settled], Finding]  # (their choice, motions under the periodic drive) -> Finding


@dataclass(frozen=True)
class Check:
    """One check of the paper's statements."""

    key: str  # Number of the statement and a letter, as "4c"
    says: str  # The paper's statement, paraphrased
    criterion: str  # Criterion of the check
    because: str  # Derivation of the criterion from the paper's wording
    find: Callable[[Choice, Measured], Finding]  # (choice, measured runs) -> Finding
    periodically: Periodically | None = None  # The same check for the periodic drive

    @property
    def statement(self) -> int:
        """Number of the statement that the check belongs to."""
        return int(self.key[:-1])


@dataclass(frozen=True)
class Verdict:
    """An answered check."""

    check: Check
    finding: Finding
    # True if all its runs end before their predictability horizon, so that the numbers are of one trajectory; otherwise they
    # are one sample, and only the distribution over an ensemble is meaningful
    trusted: bool
    periodic: Finding | None = None  # The same check under the periodic drive

    @property
    def answer(self) -> str:
        """The answer as a word: "agrees" or "differs"."""
        return self.finding.answer


class _RecordedMeasures(dict[PaperCase, Measures]):
    """Measures that record which runs were used."""

    def __init__(self, measured: Measured) -> None:
        super().__init__(measured)
        self.used: set[PaperCase] = set()

    def __getitem__(self, case: PaperCase) -> Measures:
        self.used.add(case)
        return super().__getitem__(case)


def answer(check: Check, choice: Choice, measured: Measured, settled: Settled | None = None) -> Verdict:
    """Evaluate a check of the paper's statements on the runs of a choice."""
    recorded = _RecordedMeasures(measured)
    finding = check.find(choice, recorded)
    trusted = all(measured[case].trusted_until >= measured[case].end for case in recorded.used)
    if settled is None or check.periodically is None:
        return Verdict(check, finding, trusted)
    return Verdict(check, finding, trusted, check.periodically.find(PERIODIC, settled))
