"""Report of the reproduction of the paper: a page in HTML, and the verdicts in JSON and CSV."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

import xarray as xr

from scissordyn.file.output_file import csv_text
from scissordyn_paper.beyond import contacts_section, control_section, first_contacts_section, regularity_section
from scissordyn_paper.cache import provenance
from scissordyn_paper.cases import DEFAULT, PaperCase
from scissordyn_paper.explanation import STATEMENTS, explanation, summary
from scissordyn_paper.figures import FIGURES, FURTHER
from scissordyn_paper.page import (
    Cell,
    badge,
    cited,
    contents,
    document,
    folded,
    linked,
    noted,
    paragraph,
    picture,
    section,
    small,
    table,
    tally,
)
from scissordyn_paper.parameters import parameter_table
from scissordyn_paper.results import BEST, BEST_OF, Results
from scissordyn_paper.statements import CHECKS
from scissordyn_paper.verdict import Finding, Verdict

TITLE = "Scissor structures with a clearance joint: a paper reproduced"

INTRODUCTION = (
    "The paper computes how a planar array of two scissor units moves in 50 ms, driven at 150 rpm, when the pin of one joint "
    "(A) has a radius 0.5 mm smaller than its hole. The pin then leaves the surface of the hole and hits it again. This report "
    f"computes the paper's figures anew. It splits the paper's {len(STATEMENTS)} statements into {len(CHECKS)} checks, answers "
    "each by yes or no with the computed value, and says why."
)

SOURCE = (
    "Li, Wang, Gantes, Tan, Nonlinear dynamic characteristics and control of planar linear array deployable structures "
    "consisting of scissor-like elements with revolute clearance joint, Advances in Structural Engineering, 2020, "
)
DOI = "10.1177/1369433220971728"

FIGURES_OF = {1: (6,), 3: (7,), 4: (8,), 5: (9, 10), 6: (11, 12), 7: (13,)}
"""Figures of the paper that belong to each statement."""

SECTIONS = (
    ("Control schemes compared", "control"),
    ("Regular or irregular under a periodic drive", "regularity"),
    ("Statistics of the contacts", "statistics"),
    ("First contacts, compared with a second program", "contacts"),
    ("Parameters", "parameters"),
    ("Case files", "cases"),
    ("Warnings, files and versions", "versions"),
)
"""Titles and names of the sections after the statements."""


def page(
    verdicts: Sequence[Verdict],
    results: Results,
    pictures: Mapping[int | str, Sequence[Path]],
    best: Sequence[Finding],
) -> str:
    """Return the report as a page in HTML; `best` are the findings of the best parameter set."""

    def further(name: str) -> str:
        return picture(pictures[name], FURTHER[name].title, FURTHER[name].caption)

    further_parts = {
        "control": [*control_section(results), further("control-torque")],
        "regularity": [
            *regularity_section(results.settled),
            *(further(name) for name in ("maps-by-clearance", "maps-by-friction", "bifurcation")),
        ],
        "statistics": [*contacts_section(results), further("contact-forces")],
        "contacts": first_contacts_section(results.runs[PaperCase()]),
        "parameters": _parameters(),
        "cases": _case_files(results),
        "versions": _versions(results.runs),
    }
    numbers = list(dict.fromkeys(verdict.check.statement for verdict in verdicts))
    parts = [
        cited(TITLE, SOURCE, DOI),
        paragraph(INTRODUCTION),
        picture(pictures["overview"], FURTHER["overview"].title, FURTHER["overview"].caption),
        *_summary(verdicts, best),
        contents([(f"{number}. {STATEMENTS[number].title}", f"statement-{number}") for number in numbers] + list(SECTIONS)),
        *(_statement(number, verdicts, best, pictures) for number in numbers),
        *(section(title, name, further_parts[name]) for title, name in SECTIONS),
    ]
    whole: str = document(TITLE, parts)
    return whole


def _summary(verdicts: Sequence[Verdict], best: Sequence[Finding]) -> list[str]:
    """Return the first section: numbers of agreeing checks, and a sentence on each statement."""
    agreeing = [verdict for verdict in verdicts if verdict.finding.holds]
    periodic = [verdict.periodic for verdict in verdicts if verdict.periodic is not None]
    counts = [(f"{len(agreeing)} of {len(verdicts)}", "checks agree on the paper's single stroke")]
    if periodic:
        holding = sum(finding.holds for finding in periodic)
        counts.append((f"{holding} of {len(periodic)}", "checks on lasting motion agree under a periodic drive"))
    met = sum(finding.holds for finding in best)
    counts.append((f"{met} of {len(best)}", f"checks agree with the best of {BEST_OF:,} parameter sets".replace(",", " ")))
    rows: list[Sequence[str | Cell]] = []
    for number in dict.fromkeys(verdict.check.statement for verdict in verdicts):
        ours = [verdict for verdict in verdicts if verdict.check.statement == number]
        share = f"{sum(verdict.finding.holds for verdict in ours)} of {len(ours)}"
        rows.append((linked(f"{number}. {STATEMENTS[number].title}", f"statement-{number}"), share, summary(number, ours)))
    return [
        tally(counts),
        table(("Statement of the paper", "Checks that agree", "What agrees, what differs, and why"), rows),
        paragraph(
            "Check 4c is the third part of statement 4. A parameter set is one choice of the parameters whose tables are not "
            "public. This report uses a set that was chosen before its agreement was known. The best set was chosen "
            "afterwards, for its agreement, which does not prove that the paper used it.",
            "soft",
        ),
    ]


def _statement(
    number: int, verdicts: Sequence[Verdict], best: Sequence[Finding], pictures: Mapping[int | str, Sequence[Path]]
) -> str:
    """Return the section of a statement: a table of its checks, and its figures."""
    rows: list[Sequence[str | Cell] | str] = []
    doubtful = []
    for verdict, finding in zip(verdicts, best, strict=True):
        if verdict.check.statement == number:
            rows.append(_check_row(verdict, finding))
            rows += _periodic_row(verdict)
            doubtful += [] if verdict.trusted else [verdict.check.key]
    note = (
        f"The runs behind {', '.join(doubtful)} go beyond the predictability horizon: their numbers are one sample. "
        "`scissordyn paper --parameter-sets` counts shares over neighbours."
    )
    whole: str = section(
        f"{number}. {STATEMENTS[number].title}",
        f"statement-{number}",
        [
            table(("", "The paper says", "Answer", "Computed here", "Why", "Best set"), rows),
            *([paragraph(note, "soft")] if doubtful else []),
            *([] if number in FIGURES_OF else [paragraph("The first picture of this report shows both forces.")]),
            *(picture(pictures[figure], f"Figure {figure}", FIGURES[figure].caption) for figure in FIGURES_OF.get(number, ())),
        ],
    )
    return whole


def _check_row(verdict: Verdict, best: Finding) -> Sequence[str | Cell]:
    check = verdict.check
    test = f"Check: {check.criterion}. {check.because[:1].upper()}{check.because[1:]}."
    other = Cell(badge(best.holds), note=best.words)
    words = verdict.finding.words
    return (
        Cell(check.key, "nowrap"),
        noted(check.says, test),
        badge(verdict.finding.holds),
        f"{words[:1].upper()}{words[1:]}.",
        explanation(verdict),
        other,
    )


def _periodic_row(verdict: Verdict) -> list[Sequence[str | Cell]]:
    """Return the row of a check under the periodic drive; none if the check is only for the stroke."""
    check, found = verdict.check.periodically, verdict.periodic
    if check is None or found is None:
        return []
    test = f"Check under the periodic drive: {check.criterion}."
    return [("", small(test), badge(found.holds), small(found.words), "", "")]


def _parameters() -> list[str]:
    return [
        paragraph(
            "The paper's tables of parameters are not public. The set of this report was chosen before its agreement was "
            "known. The other one agrees with most checks of all sets that were drawn (scissordyn paper --parameter-sets)."
        ),
        parameter_table(DEFAULT, BEST),
        paragraph("Numbers are rounded to three digits; the case files below have all digits.", "soft"),
    ]


def _case_files(results: Results) -> list[str]:
    return [
        paragraph("Each of these texts, saved as case.toml, can be run by: scissordyn run case.toml --trust"),
        *(folded(case.name, case.toml) for case in results.runs),
        paragraph("Under the periodic drive:"),
        *(folded(f"periodic {case.name}", case.toml) for case in results.settled),
        paragraph("The controlled runs as plain data are in the attribute case of the files in control/."),
    ]


def _versions(runs: Mapping[PaperCase, xr.Dataset]) -> list[str]:
    said: dict[str, list[str]] = {}
    for case, run in runs.items():
        for warning in json.loads(run.attrs["warnings"]):
            said.setdefault(warning, []).append(case.name)
    rows = [(", ".join(names), warning) for warning, names in said.items()]
    made = ", ".join(f"{name} {value}" for name, value in json.loads(provenance()).items())
    return [
        table(("run", "warning"), rows),
        paragraph(
            "Files with this page: runs/ (strokes), periodic/ (motions under the periodic drive), control/ (controlled "
            "runs), bifurcation.nc, all NetCDF; figures/ (SVG and PNG), cases/ (case files), verdicts.json and verdicts.csv."
        ),
        paragraph(made, "soft"),
    ]


def as_json(verdicts: Sequence[Verdict]) -> str:
    """Return the verdicts with criteria and numbers as JSON."""
    rows = [
        {
            "check": verdict.check.key,
            "says": verdict.check.says,
            "criterion": verdict.check.criterion,
            "because": verdict.check.because,
            **_answer(verdict.finding),
            "trusted": verdict.trusted,
            "periodic": None
            if verdict.periodic is None or verdict.check.periodically is None
            else {"criterion": verdict.check.periodically.criterion, **_answer(verdict.periodic)},
        }
        for verdict in verdicts
    ]
    return json.dumps({"choice": DEFAULT.words, "provenance": json.loads(provenance()), "verdicts": rows}, indent=1) + "\n"


def _answer(finding: Finding) -> dict[str, object]:
    return {"answer": finding.answer, "measured": finding.words, "numbers": finding.numbers}


def as_csv(verdicts: Sequence[Verdict]) -> str:
    """Return the verdicts as a CSV table: check, answer, statement, criterion and measured values."""
    rows: list[tuple[str, ...]] = [("check", "answer", "says", "criterion", "measured", "answer_periodic", "measured_periodic")]
    for verdict in verdicts:
        check, other = verdict.check, verdict.periodic
        row = (check.key, verdict.answer, check.says, check.criterion, verdict.finding.words)
        rows.append((*row, *(("", "") if other is None else (other.answer, other.words))))
    return csv_text(rows)
