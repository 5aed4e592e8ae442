"""The summary of the report: which clauses agree, and which open parameters are decisive."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr

from scissordyn_paper.page import paragraph, tally
from scissordyn_paper.sensitivity import DEFAULT, FACTORS, full_factorial
from scissordyn_paper.verdict import Verdict

OFTEN = 0.95
"""Fraction of choices from which on a clause is taken as true, or as false, for any choice."""

DECISIVE = 0.5
"""A factor is decisive for a clause if its levels change the fraction of choices for which it agrees by this much."""

PLAIN = {
    "driven bar": "which bar is driven",
    "stroke": "from which angle and in which direction the stroke goes",
    "restitution": "the restitution coefficient",
    "joint": "the joint's stiffness (length of the bearing, form of the law)",
}
"""The factors in words."""


def summary(verdicts: Sequence[Verdict], together: xr.Dataset) -> list[str]:
    """The summary of the results."""
    agreeing = [verdict for verdict in verdicts if verdict.finding.holds]
    periodic = [verdict.periodic for verdict in verdicts if verdict.periodic is not None]
    holding = sum(found.holds for found in periodic)
    clauses = [str(key) for key in together["clause"].values]
    counts = [(f"{len(agreeing)} of {len(verdicts)}", "clauses agree on the paper's single stroke")]
    if periodic:
        counts.append((f"{holding} of {len(periodic)}", "agree under a periodic drive, for the asymptotic motion"))
    always, never, open_ = _sorted(clauses, together["agreeing"].values.mean(axis=0))
    counts.append((f"{len(open_)} of {len(clauses)}", "depend on parameters whose tables are lost"))
    said = [
        tally(counts),
        paragraph(f"The default choice is: {DEFAULT.words}. The paper's tables of parameters are lost."),
        paragraph(_deciding(clauses, together)),
        paragraph(
            f"For any choice these agree: {_listed(always)}. For any choice these differ: {_listed(never)}. The others depend "
            f"on the choice: {_listed(open_)}."
        ),
    ]
    changed = [v.clause.key for v in verdicts if v.periodic is not None and v.periodic.holds != v.finding.holds]
    if periodic:
        said.append(
            paragraph(
                "The paper's pictures of a single stroke and true measures under a periodic drive "
                + (f"have different answers for {_listed(changed)}." if changed else "give the same answers.")
            )
        )
    return said


def in_words(clauses: Sequence[str], fractions: np.ndarray) -> str:
    """Clauses that agree for any choice, and those that never do.

    Shapes: `fractions` (clauses,).
    """
    always, never, open_ = _sorted(clauses, fractions)
    percent = f"{100.0 * OFTEN:g} %"
    return (
        f"These agree for at least {percent} of the choices: {_listed(always)}. These differ for as many: {_listed(never)}. "
        f"These depend on the choice: {_listed(open_)}."
    )


def _sorted(clauses: Sequence[str], fractions: np.ndarray) -> tuple[list[str], list[str], list[str]]:
    """Clauses that agree for any choice, that never do, and the others."""
    always = [key for key, fraction in zip(clauses, fractions, strict=True) if fraction >= OFTEN]
    never = [key for key, fraction in zip(clauses, fractions, strict=True) if fraction <= 1.0 - OFTEN]
    return always, never, [key for key in clauses if key not in always and key not in never]


def _deciding(clauses: Sequence[str], together: xr.Dataset) -> str:
    """Factors that change the answers, in decreasing order."""
    choices, agreeing = full_factorial(), together["agreeing"].values
    decided: dict[str, list[str]] = {}
    for name, level in FACTORS.items():
        levels = np.array([level(choice) for choice in choices])
        means = np.array([agreeing[levels == one].mean(axis=0) for one in dict.fromkeys(levels.tolist())])
        decided[name] = [key for key, shift in zip(clauses, np.ptp(means, axis=0), strict=True) if shift >= DECISIVE]
    ranked = sorted(decided, key=lambda name: -len(decided[name]))
    main = [f"{PLAIN[name]} ({_listed(decided[name])})" for name in ranked if decided[name]]
    rest = [PLAIN[name] for name in ranked if not decided[name]]
    first = (
        f"Decisive parameters, in decreasing order: {'; '.join(main)}."
        if main
        else "No single parameter is decisive for any clause."
    )
    return first + (f" On their own {' and '.join(rest)} change no answer." if rest else "")


def _listed(keys: Sequence[str]) -> str:
    return ", ".join(keys) or "none"
