"""What a statement is, and what an answer to it is."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from scissordyn.paper.cases import Choice, PaperCase
from scissordyn.paper.measures import Measures
from scissordyn.paper.periodic import Regularity

__all__ = ["Clause", "Finding", "Measured", "Periodically", "Settled", "Verdict", "answer"]

Measured = Mapping[PaperCase, Measures]

Settled = Mapping[PaperCase, Regularity]
"""What the motions under the periodic drive settle to."""


@dataclass(frozen=True)
class Finding:
    """What was found for one clause.

    Parameters
    ----------
    holds : bool
        Whether the criterion is met.
    words : str
        The measured numbers in a sentence.
    numbers : dict of str to float
        The same for machines; the name ends in its unit.
    """

    holds: bool
    words: str
    numbers: dict[str, float]

    @property
    def answer(self) -> str:
        """The word for it: "agrees" or "differs"."""
        return "agrees" if self.holds else "differs"


@dataclass(frozen=True)
class Periodically:
    """How a clause is answered for the periodic drive, by what the motion settles to.

    Parameters
    ----------
    criterion : str
        When the clause counts as true.
    find : callable
        (motions under the periodic drive) -> Finding.
    measures_regularity : bool
        Whether only such a drive gives the words of the clause their meaning.
    """

    criterion: str
    find: Callable[[Settled], Finding]
    measures_regularity: bool = False


@dataclass(frozen=True)
class Clause:
    """One thing that the paper says.

    Parameters
    ----------
    key : str
        Number of the statement and a letter, as "4c".
    says : str
        What the paper says, in our words.
    criterion : str
        When that counts as true.
    because : str
        How the criterion follows from the paper's wording.
    find : callable
        (choice, measured runs) -> Finding.
    periodically : Periodically, optional
        The same clause for the periodic drive.
    """

    key: str
    says: str
    criterion: str
    because: str
    find: Callable[[Choice, Measured], Finding]
    periodically: Periodically | None = None

    @property
    def statement(self) -> int:
        """Number of the statement that the clause belongs to."""
        return int(self.key[:-1])


@dataclass(frozen=True)
class Verdict:
    """An answered clause.

    Parameters
    ----------
    clause : Clause
    finding : Finding
    trusted : bool
        Whether all runs behind it are trusted to their ends, so that the numbers belong to the trajectory; otherwise they
        are one sample, and only the distribution over an ensemble is meaningful.
    periodic : Finding or None
        The same clause under the periodic drive.
    """

    clause: Clause
    finding: Finding
    trusted: bool
    periodic: Finding | None = None

    @property
    def answer(self) -> str:
        """The word for it: "agrees" or "differs"."""
        return self.finding.answer


class _Watched(dict[PaperCase, Measures]):
    """Measures that remember which runs were asked for."""

    def __init__(self, measured: Measured) -> None:
        super().__init__(measured)
        self.used: set[PaperCase] = set()

    def __getitem__(self, case: PaperCase) -> Measures:
        self.used.add(case)
        return super().__getitem__(case)


def answer(clause: Clause, choice: Choice, measured: Measured, settled: Settled | None = None) -> Verdict:
    """Answer a clause.

    Parameters
    ----------
    clause : Clause
    choice : Choice
    measured : mapping of PaperCase to Measures
        With every run of the choice.
    settled : mapping of PaperCase to Regularity, optional
        Every motion under the periodic drive, for the clauses that have a meaning there.

    Returns
    -------
    Verdict
    """
    watched = _Watched(measured)
    finding = clause.find(choice, watched)
    trusted = all(measured[case].trusted_until >= measured[case].end for case in watched.used)
    if settled is None or clause.periodically is None:
        return Verdict(clause, finding, trusted)
    return Verdict(clause, finding, trusted, clause.periodically.find(settled))
