"""The report of the paper's runs, as one page and as machine-readable tables."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

import xarray as xr

from scissordyn.file.output_file import csv_text
from scissordyn_paper.beyond import contacts, control, first_contacts, regularity
from scissordyn_paper.cache import provenance
from scissordyn_paper.cases import DEFAULT, PaperCase
from scissordyn_paper.figures import FIGURES, FURTHER
from scissordyn_paper.page import (
    Cell,
    badge,
    cited,
    document,
    folded,
    noted,
    paragraph,
    picture,
    section,
    small,
    table,
    tally,
)
from scissordyn_paper.results import BEST, BEST_OF, Results
from scissordyn_paper.verdict import Finding, Verdict

TITLE = "Scissor structures with a clearance joint: a paper reproduced"

SOURCE = (
    "Li, Wang, Gantes, Tan, Nonlinear dynamic characteristics and control of planar linear array deployable structures "
    "consisting of scissor-like elements with revolute clearance joint, Advances in Structural Engineering, 2020, "
)
DOI = "10.1177/1369433220971728"

CONTROL_FIGURE = 13  # The paper's figure of its control; it is shown with the torque of the control

STATEMENTS = {
    1: "Response with and without clearance",
    2: "Contact force against ideal reaction",
    3: "Speed",
    4: "Clearance: force, torque, impacts",
    5: "Clearance: regular and irregular",
    6: "Friction",
    7: "Control",
}


def page(
    verdicts: Sequence[Verdict],
    results: Results,
    pictures: Mapping[int | str, Sequence[Path]],
    best: Sequence[Finding],
) -> str:
    """The whole report."""
    parts = [
        cited(TITLE, SOURCE, DOI),
        *_summary(verdicts, best),
        section("Answers", "answers", _answers(verdicts, best)),
        section(
            "Figures of the paper", "figures", [_picture(pictures, number) for number in FIGURES if number != CONTROL_FIGURE]
        ),
        section(
            "Control schemes compared",
            "control",
            [_picture(pictures, CONTROL_FIGURE), _further(pictures, "control-torque"), *control(results)],
        ),
        section(
            "Regular or irregular, beyond the paper",
            "regularity",
            [
                *regularity(results.settled),
                *(_further(pictures, name) for name in ("maps-by-clearance", "maps-by-friction", "bifurcation")),
            ],
        ),
        section("Statistics of the contacts", "statistics", [*contacts(results), _further(pictures, "contact-forces")]),
        section("The first contacts, compared with a second program", "contacts", first_contacts(results.runs[PaperCase()])),
        section("Case files", "cases", _case_files(results)),
        section("Warnings, files and versions", "versions", _versions(results.runs)),
    ]
    whole: str = document(TITLE, parts)
    return whole


def _summary(verdicts: Sequence[Verdict], best: Sequence[Finding]) -> list[str]:
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


def _answers(verdicts: Sequence[Verdict], best: Sequence[Finding]) -> list[str]:
    rows: list[Sequence[str | Cell] | str] = []
    for number in dict.fromkeys(verdict.clause.statement for verdict in verdicts):
        rows.append(f"{number}. {STATEMENTS[number]}")
        for verdict, finding in zip(verdicts, best, strict=True):
            if verdict.clause.statement == number:
                clause = verdict.clause
                test = f"Criterion: {clause.criterion}. {clause.because[:1].upper()}{clause.because[1:]}."
                other = Cell(finding.answer, "", float(finding.holds), finding.words)
                rows.append((clause.key, noted(clause.says, test), badge(verdict.finding.holds), verdict.finding.words, other))
                rows += _periodic_row(verdict)
    doubtful = [verdict.clause.key for verdict in verdicts if not verdict.trusted]
    note = (
        "All numbers are of one trajectory: each run agrees to its end with its repetition at a tenth of the tolerance."
        if not doubtful
        else f"The runs behind {', '.join(doubtful)} go beyond the predictability horizon: their numbers are one sample; "
        "`scissordyn paper --readings` counts shares over neighbours."
    )
    return [
        paragraph(
            "Each statement is split into clauses that can be answered by yes or no. Criteria follow the paper's wording; the "
            "source file scissordyn_paper/statements.py states which were corrected after the first results, and why. "
            "Statements 5 and 6 have two answers: "
            "that of the paper's single stroke, and below it that of a periodic drive, for which their terms are defined."
        ),
        table(("", "The paper says", "Answer", "Measured", "Best reading"), rows),
        paragraph(note, "soft"),
    ]


def _periodic_row(verdict: Verdict) -> list[Sequence[str | Cell]]:
    """The same clause under the periodic drive."""
    clause, found = verdict.clause.periodically, verdict.periodic
    if clause is None or found is None:
        return []
    test = f"Criterion under the periodic drive: {clause.criterion}."
    return [("", small(test), badge(found.holds), small(found.words), "")]


def _picture(pictures: Mapping[int | str, Sequence[Path]], number: int) -> str:
    return picture(pictures[number], f"Figure {number}", FIGURES[number].caption)


def _further(pictures: Mapping[int | str, Sequence[Path]], name: str) -> str:
    return picture(pictures[name], FURTHER[name].title, FURTHER[name].caption)


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
    """The verdicts with criteria and numbers."""
    rows = [
        {
            "clause": verdict.clause.key,
            "says": verdict.clause.says,
            "criterion": verdict.clause.criterion,
            "because": verdict.clause.because,
            **_answer(verdict.finding),
            "trusted": verdict.trusted,
            "periodic": None
            if verdict.periodic is None or verdict.clause.periodically is None
            else {"criterion": verdict.clause.periodically.criterion, **_answer(verdict.periodic)},
        }
        for verdict in verdicts
    ]
    return json.dumps({"choice": DEFAULT.words, "provenance": json.loads(provenance()), "verdicts": rows}, indent=1) + "\n"


def _answer(finding: Finding) -> dict[str, object]:
    return {"answer": finding.answer, "measured": finding.words, "numbers": finding.numbers}


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
