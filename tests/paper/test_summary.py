"""The top of the report."""

from scissordyn_paper.cases import DEFAULT
from scissordyn_paper.results import BEST, BEST_OF
from scissordyn_paper.statements import CLAUSES
from scissordyn_paper.summary import summary
from scissordyn_paper.verdict import Finding, Verdict


def test_both_readings_stand_beside_each_other():
    """Contract: counts of the reading chosen before, and of the best one, which is said to be chosen afterwards."""
    finding = Finding(True, "words", {})
    verdicts = [Verdict(clause, finding, True, finding if clause.periodically else None) for clause in CLAUSES]
    best = [finding] * 3 + [Finding(False, "words", {})] * (len(CLAUSES) - 3)
    text = " ".join(summary(verdicts, best))
    assert f"<strong>{len(CLAUSES)} of {len(CLAUSES)}</strong>" in text
    assert f"<strong>3 of {len(CLAUSES)}</strong><span>agree under the best reading, chosen afterwards" in text
    assert f"chosen before its agreement was known: {DEFAULT.words}." in text
    assert f"among {BEST_OF} " in text
    assert BEST.words in text
    assert "give the same answers" in text
