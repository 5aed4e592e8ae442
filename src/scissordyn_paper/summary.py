"""The summary of the report: which clauses agree, and what the best reading changes."""

from __future__ import annotations

from collections.abc import Sequence

from scissordyn_paper.cases import DEFAULT
from scissordyn_paper.page import paragraph, tally
from scissordyn_paper.results import BEST, BEST_OF
from scissordyn_paper.verdict import Finding, Verdict


def summary(verdicts: Sequence[Verdict], best: Sequence[Finding]) -> list[str]:
    """The summary of the results."""
    agreeing = [verdict for verdict in verdicts if verdict.finding.holds]
    periodic = [verdict.periodic for verdict in verdicts if verdict.periodic is not None]
    counts = [(f"{len(agreeing)} of {len(verdicts)}", "clauses agree on the paper's single stroke")]
    if periodic:
        holding = sum(finding.holds for finding in periodic)
        counts.append((f"{holding} of {len(periodic)}", "agree under a periodic drive, for the asymptotic motion"))
    met = sum(finding.holds for finding in best)
    counts.append((f"{met} of {len(best)}", "agree under the best reading, chosen afterwards"))
    words = [
        tally(counts),
        paragraph(
            "The paper's tables of parameters are lost. The reading of this page was chosen before its agreement was known: "
            f"{DEFAULT.words}."
        ),
        paragraph(
            f"Beside it stands the reading that meets most of the clauses among {BEST_OF} (scissordyn paper --readings). It "
            f"was chosen afterwards, for its agreement, which is no evidence that the paper had these numbers: {BEST.words}."
        ),
    ]
    changed = [v.clause.key for v in verdicts if v.periodic is not None and v.periodic.holds != v.finding.holds]
    if periodic:
        words.append(
            paragraph(
                "The paper's pictures of a single stroke and true measures under a periodic drive "
                + (f"have different answers for {', '.join(changed)}." if changed else "give the same answers.")
            )
        )
    return words
