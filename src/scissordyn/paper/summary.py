"""The top of the report: what agrees, and which of the open choices decide, in plain words."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr

from scissordyn.paper.page import paragraph, tally
from scissordyn.paper.sensitivity import DEFAULT, FACTORS, full_factorial
from scissordyn.paper.verdict import Verdict

__all__ = ["OFTEN", "in_words", "summary"]

OFTEN = 0.95
"""Fraction of choices from which a clause is said to hold, or not to hold, whatever was chosen."""

DECISIVE = 0.5
"""A factor decides about a clause if its levels shift the fraction of choices for which it holds by as much."""

PLAIN = {
    "driven bar": "which bar is driven",
    "stroke": "from which angle and in which direction the stroke goes",
    "restitution": "the restitution coefficient",
    "joint": "the joint's stiffness (length of the bearing, form of the law)",
}
"""The factors as one would say them."""


def summary(verdicts: Sequence[Verdict], together: xr.Dataset) -> list[str]:
    """What a reader wants to know first.

    Parameters
    ----------
    verdicts : sequence of Verdict
        Of the default choice.
    together : Dataset
        Survey of `full_factorial`.

    Returns
    -------
    list of str
        Pieces of HTML.
    """
    agreeing = [verdict for verdict in verdicts if verdict.finding.holds]
    periodic = [verdict.periodic for verdict in verdicts if verdict.periodic is not None]
    holding = sum(found.holds for found in periodic)
    clauses = [str(key) for key in together["clause"].values]
    counts = [(f"{len(agreeing)} of {len(verdicts)}", "clauses agree on the paper's single stroke")]
    if periodic:
        counts.append((f"{holding} of {len(periodic)}", "agree once the drive is periodic and the motion has settled"))
    always, never, open_ = _sorted(clauses, together["agreeing"].values.mean(axis=0))
    counts.append((f"{len(open_)} of {len(clauses)}", "hang on what the paper's lost tables held"))
    said = [
        tally(counts),
        paragraph(f"The default choice is: {DEFAULT.words}. The paper's tables of parameters are lost."),
        paragraph(_deciding(clauses, together)),
        paragraph(
            f"Whatever is chosen, these hold: {_listed(always)}. Whatever is chosen, these do not: {_listed(never)}. On "
            "the rest "
            f"the paper can be right or wrong: {_listed(open_)}."
        ),
    ]
    changed = [v.clause.key for v in verdicts if v.periodic is not None and v.periodic.holds != v.finding.holds]
    if periodic:
        said.append(
            paragraph(
                "The paper's pictures of a single stroke and true measures under a periodic drive "
                + (f"answer differently on {_listed(changed)}." if changed else "give the same answers.")
            )
        )
    return said


def in_words(clauses: Sequence[str], fractions: np.ndarray) -> str:
    """Which clauses hold whatever was chosen, and which never.

    Parameters
    ----------
    clauses : sequence of str
    fractions : ndarray, shape (clauses,)
        Of the choices for which each holds.

    Returns
    -------
    str
    """
    always, never, open_ = _sorted(clauses, fractions)
    percent = f"{100.0 * OFTEN:g} %"
    return (
        f"Under at least {percent} of the choices hold: {_listed(always)}. Under as many do not hold: {_listed(never)}. "
        "The choice "
        f"decides about: {_listed(open_)}."
    )


def _sorted(clauses: Sequence[str], fractions: np.ndarray) -> tuple[list[str], list[str], list[str]]:
    """Clauses that hold whatever was chosen, that never do, and the others."""
    always = [key for key, fraction in zip(clauses, fractions, strict=True) if fraction >= OFTEN]
    never = [key for key, fraction in zip(clauses, fractions, strict=True) if fraction <= 1.0 - OFTEN]
    return always, never, [key for key in clauses if key not in always and key not in never]


def _deciding(clauses: Sequence[str], together: xr.Dataset) -> str:
    """Which factors shift the answers, the most powerful first."""
    choices, agreeing = full_factorial(), together["agreeing"].values
    decided: dict[str, list[str]] = {}
    for name, level in FACTORS.items():
        levels = np.array([level(choice) for choice in choices])
        means = np.array([agreeing[levels == one].mean(axis=0) for one in dict.fromkeys(levels.tolist())])
        decided[name] = [key for key, shift in zip(clauses, np.ptp(means, axis=0), strict=True) if shift >= DECISIVE]
    ranked = sorted(decided, key=lambda name: -len(decided[name]))
    main = [f"{PLAIN[name]} ({_listed(decided[name])})" for name in ranked if decided[name]]
    rest = [PLAIN[name] for name in ranked if not decided[name]]
    first = f"What decides, most first: {'; '.join(main)}." if main else "No single choice decides about any clause."
    return first + (f" By themselves {' and '.join(rest)} turn no answer." if rest else "")


def _listed(keys: Sequence[str]) -> str:
    return ", ".join(keys) or "none"
