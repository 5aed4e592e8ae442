"""The top of the report."""

import numpy as np
import xarray as xr

from scissordyn_paper.findings import percent
from scissordyn_paper.sensitivity import full_factorial
from scissordyn_paper.statements import CLAUSES
from scissordyn_paper.summary import in_words, summary
from scissordyn_paper.verdict import Finding, Verdict


def test_clauses_are_sorted_by_how_often_they_hold():
    """Contract: at and beyond the bounds, and between them."""
    said = in_words(["a", "b", "c", "d"], np.array([0.95, 0.05, 0.5, 1.0]))
    assert f"These agree for at least {percent(0.95)} of the choices: a, d." in said
    assert "differ for as many: b." in said
    assert said.endswith("These depend on the choice: c.")


def test_the_factor_that_decides_is_named():
    """Limit: one clause depends on the driven bar alone, one on nothing, one on chance in equal parts."""
    keys = [clause.key for clause in CLAUSES]
    agreeing = np.ones((len(full_factorial()), len(keys)))
    agreeing[:, 0] = [choice.driven_bar == "pinned" for choice in full_factorial()]
    agreeing[:, 1] = 0.0
    together = xr.Dataset({"agreeing": (("choice", "clause"), agreeing)}, coords={"clause": keys})
    found = Finding(True, "words", {})
    verdicts = [Verdict(clause, found, True, found if clause.periodically else None) for clause in CLAUSES]
    text = " ".join(summary(verdicts, together))
    assert f"Decisive parameters, in decreasing order: which bar is driven ({keys[0]})." in text
    assert f"For any choice these differ: {keys[1]}." in text
    assert f"<strong>{len(CLAUSES)} of {len(CLAUSES)}</strong>" in text
    assert "give the same answers" in text
