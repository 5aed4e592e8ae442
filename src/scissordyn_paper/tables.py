"""The verdicts as machine-readable tables."""

from __future__ import annotations

import json
from collections.abc import Sequence

from scissordyn.file.output_file import csv_text
from scissordyn_paper.cache import provenance
from scissordyn_paper.cases import DEFAULT
from scissordyn_paper.verdict import Verdict


def as_json(verdicts: Sequence[Verdict]) -> str:
    """The verdicts with criteria and numbers."""
    rows = [
        {
            "clause": verdict.clause.key,
            "says": verdict.clause.says,
            "criterion": verdict.clause.criterion,
            "because": verdict.clause.because,
            "answer": verdict.answer,
            "measured": verdict.finding.words,
            "numbers": verdict.finding.numbers,
            "trusted": verdict.trusted,
            "periodic": _periodic(verdict),
        }
        for verdict in verdicts
    ]
    return json.dumps({"choice": DEFAULT.words, "provenance": json.loads(provenance()), "verdicts": rows}, indent=1) + "\n"


def as_csv(verdicts: Sequence[Verdict]) -> str:
    """The verdicts as a table: clause, answer, statement, measured values, and the same for the periodic drive."""
    rows: list[tuple[str, ...]] = [
        ("clause", "answer", "says", "criterion", "measured", "answer_periodic", "measured_periodic")
    ]
    for verdict in verdicts:
        clause, other = verdict.clause, verdict.periodic
        row = (clause.key, verdict.answer, clause.says, clause.criterion, verdict.finding.words)
        rows.append((*row, *(("", "") if other is None else (other.answer, other.words))))
    return csv_text(rows)


def _periodic(verdict: Verdict) -> dict[str, object] | None:
    """The answer for the periodic drive, if the clause has one."""
    clause, found = verdict.clause.periodically, verdict.periodic
    if clause is None or found is None:
        return None
    return {"criterion": clause.criterion, "answer": found.answer, "measured": found.words, "numbers": found.numbers}
