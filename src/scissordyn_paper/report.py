"""The report of the paper's runs, as one page and as machine-readable tables."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence

import xarray as xr

from scissordyn_paper.beyond import contacts, control, regularity
from scissordyn_paper.cache import provenance
from scissordyn_paper.cases import ARRAY, PaperCase
from scissordyn_paper.events import event_table
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
)
from scissordyn_paper.results import Results
from scissordyn_paper.summary import summary
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
    pictures: Mapping[int | str, bytes],
    best: Sequence[Finding],
) -> str:
    """The whole report."""
    parts = [
        cited(TITLE, SOURCE, DOI),
        *summary(verdicts, best),
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
        section("The first contacts, compared with a second program", "contacts", _events(results.runs)),
        section("Case files", "cases", _case_files(results)),
        section("Warnings, files and versions", "versions", _versions(results.runs)),
    ]
    whole: str = document(TITLE, parts)
    return whole


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


def _picture(pictures: Mapping[int | str, bytes], number: int) -> str:
    return picture(pictures[number], f"Figure {number}", FIGURES[number].caption)


def _further(pictures: Mapping[int | str, bytes], name: str) -> str:
    return picture(pictures[name], FURTHER[name].title, FURTHER[name].caption)


def _events(runs: Mapping[PaperCase, xr.Dataset]) -> list[str]:
    rows: list[Sequence[str | Cell]] = []
    for name, *numbers in event_table(runs[PaperCase(ARRAY)]):
        rows.append([name, *(Cell(text, "number") for text in numbers)])
    return [
        paragraph(
            "The run at 0.5 mm and 150 rpm without friction, compared with a second program that integrates Lagrange's "
            "equations in minimal coordinates. The first contact start is independent of the contact law; afterwards "
            "differences grow from one contact to the next."
        ),
        table(("", "reference", "here", "relative difference"), rows),
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
