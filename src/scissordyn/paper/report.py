"""What the paper's runs say, as one page and as tables for machines."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Mapping, Sequence
from html import escape

import numpy as np
import xarray as xr

from scissordyn.paper.cases import ARRAY, CONTROLLED, Choice, PaperCase
from scissordyn.paper.events import event_table
from scissordyn.paper.figures import FIGURES
from scissordyn.paper.measures import measure
from scissordyn.paper.page import Cell, badge, document, folded, paragraph, picture, section, table
from scissordyn.paper.runs import provenance
from scissordyn.paper.sensitivity import DEFAULT, FACTORS, MEMBERS, PAIR, full_factorial, one_at_a_time
from scissordyn.paper.verdict import Verdict

__all__ = ["TITLE", "as_csv", "as_json", "page"]

TITLE = "Scissor structures with a loose joint: a paper computed anew"

SOURCE = (
    "Li, Wang, Gantes, Tan, Nonlinear dynamic characteristics and control of planar linear array deployable structures "
    "consisting of scissor-like elements with revolute clearance joint, Advances in Structural Engineering, 2020, "
)
DOI = "10.1177/1369433220971728"

OFTEN = 0.95
"""Share of choices from which a clause is said to hold, or not to hold, whatever was chosen."""

STATEMENTS = {
    1: "Response with and without clearance",
    2: "Contact force against ideal reaction",
    3: "Speed",
    4: "Clearance: force, torque, impacts",
    5: "Clearance: regular and irregular",
    6: "Friction",
    7: "Control",
}


def as_json(verdicts: Sequence[Verdict]) -> str:
    """The verdicts with criteria and numbers.

    Parameters
    ----------
    verdicts : sequence of Verdict

    Returns
    -------
    str
    """
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
        }
        for verdict in verdicts
    ]
    return json.dumps({"choice": DEFAULT.words, "provenance": json.loads(provenance()), "verdicts": rows}, indent=1) + "\n"


def as_csv(verdicts: Sequence[Verdict]) -> str:
    """The verdicts as a table: clause, answer, what is said, what was measured.

    Parameters
    ----------
    verdicts : sequence of Verdict

    Returns
    -------
    str
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(("clause", "answer", "says", "criterion", "measured"))
    for verdict in verdicts:
        clause = verdict.clause
        writer.writerow((clause.key, verdict.answer, clause.says, clause.criterion, verdict.finding.words))
    return text.getvalue()


def page(
    verdicts: Sequence[Verdict],
    runs: Mapping[PaperCase, xr.Dataset],
    pictures: Mapping[int, bytes],
    singly: xr.Dataset,
    together: xr.Dataset,
) -> str:
    """The whole report.

    Parameters
    ----------
    verdicts : sequence of Verdict
        Of the default choice.
    runs : mapping of PaperCase to Dataset
        Of the default choice.
    pictures : mapping of int to bytes
        SVG by number of figure.
    singly, together : Dataset
        Surveys of `one_at_a_time` and `full_factorial`.

    Returns
    -------
    str
        HTML without anything from outside; the same results give the same page.
    """
    agreeing = sum(verdict.finding.holds for verdict in verdicts)
    parts = [
        f"<h1>{escape(TITLE)}</h1>",
        f'<p class="soft">{escape(SOURCE)}<a href="https://doi.org/{DOI}">doi:{DOI}</a></p>',
        paragraph(
            f"Of {len(verdicts)} clauses that can be checked, {agreeing} agree and {len(verdicts) - agreeing} differ under the "
            f"default choice: {DEFAULT.words}. The paper's tables of parameters are lost; another part of this page "
            "shows which answers depend on what they may have held."
        ),
        section("Answers", "answers", _answers(verdicts)),
        section("Control beside a start in contact", "control", _control(runs)),
        section("Figures", "figures", _figures(pictures)),
        section("What the open choices do", "choices", [*_levels(together), *_singly(singly)]),
        section("The first contacts, compared one by one", "contacts", _events(runs)),
        section("Case files", "cases", _case_files(runs)),
        section("Warnings, files and versions", "versions", _versions(runs)),
    ]
    return document(TITLE, parts)


def _answers(verdicts: Sequence[Verdict]) -> list[str]:
    rows: list[Sequence[str | Cell] | str] = []
    for number in dict.fromkeys(verdict.clause.statement for verdict in verdicts):
        rows.append(f"{number}. {STATEMENTS[number]}")
        for verdict in verdicts:
            if verdict.clause.statement == number:
                clause = verdict.clause
                test = f"Counts as true: {clause.criterion}. {clause.because[:1].upper()}{clause.because[1:]}."
                criterion = f"{escape(clause.says)}<br><small>{escape(test)}</small>"
                rows.append((clause.key, Cell(criterion), Cell(badge(verdict.finding.holds)), verdict.finding.words))
    doubtful = [verdict.clause.key for verdict in verdicts if not verdict.trusted]
    remark = (
        "All numbers belong to the trajectory: each run agrees to its end with its repetition at a tenth of the tolerance."
        if not doubtful
        else f"The runs behind {', '.join(doubtful)} leave the trust horizon: their numbers are one sample, and only the "
        "shares of the ensemble below count."
    )
    return [
        paragraph(
            "Each statement is split into what can be answered by yes or no. Criteria follow the paper's wording; the source "
            "file paper/statements.py says which were repaired after the first results, and why."
        ),
        table(("", "The paper says", "Answer", "Measured"), rows),
        paragraph(remark, "soft"),
    ]


def _control(runs: Mapping[PaperCase, xr.Dataset]) -> list[str]:
    """What the control does that the start in contact, which it comes with, does not."""
    rows: list[Sequence[str | Cell]] = []
    for size in CONTROLLED:
        cases = {
            "control": PaperCase(size, held=True),
            "start in contact, no control": PaperCase(size, start="in-contact"),
            "concentric start, no control": PaperCase(size),
        }
        for name, case in cases.items():
            found = measure(runs[case], runs[case.ideal])
            numbers = (
                f"{found.impacts}",
                f"{100.0 * found.whole_share:.4g}",
                f"{1e-3 * found.smallest_force:.3f}",
                f"{1e-3 * found.peak_force:.3f}",
                f"{1e-3 * found.peak_torque:.3f}",
            )
            rows.append([f"{1e3 * size:g} mm", name, *(Cell(text, "number") for text in numbers)])
    return [
        paragraph(
            "The paper's control keeps the distance of journal and bearing as a constraint, and starts in contact. At constant "
            "speed of the driven bar the same start without any control shows how much of the effect is the start."
        ),
        table(
            ("clearance", "", "contacts", "in contact [%]", "smallest force [kN]", "peak force [kN]", "peak torque [kN m]"),
            rows,
        ),
    ]


def _figures(pictures: Mapping[int, bytes]) -> list[str]:
    return [picture(pictures[number], f"Figure {number}", figure.caption) for number, figure in FIGURES.items()]


def _levels(together: xr.Dataset) -> list[str]:
    """Share of the choices with a level for which each clause holds."""
    clauses = [str(key) for key in together["clause"].values]
    choices, agreeing = full_factorial(), together["agreeing"].values
    rows: list[Sequence[str | Cell] | str] = [_shares(f"all {len(choices)}", agreeing.mean(axis=0))]
    for name, level in FACTORS.items():
        rows.append(name)
        levels = [level(choice) for choice in choices]
        rows += [_shares(one, agreeing[[other == one for other in levels]].mean(axis=0)) for one in dict.fromkeys(levels)]
    unsteady = int(np.sum((agreeing > 0.0) & (agreeing < 1.0)))
    return [
        paragraph(
            f"Every combination of the levels below was run, {len(choices)} choices, each with {PAIR} neighbours whose "
            f"clearances differ by a millionth of a millionth. Shown is the percentage of choices for which a clause holds. "
            + (
                f"{unsteady} of {agreeing.size} answers differ between the neighbours: chance decides there."
                if unsteady
                else "Neighbours answer alike throughout: none of this is left to chance."
            )
        ),
        paragraph(_in_words(clauses, agreeing.mean(axis=0))),
        table(("choices", *clauses), rows, tinted=True),
    ]


def _in_words(clauses: Sequence[str], shares: np.ndarray) -> str:
    """Which clauses hold whatever was chosen, and which never."""
    always = [key for key, share in zip(clauses, shares, strict=True) if share >= OFTEN]
    never = [key for key, share in zip(clauses, shares, strict=True) if share <= 1.0 - OFTEN]
    open_ = [key for key in clauses if key not in always and key not in never]
    percent = f"{100.0 * OFTEN:g} %"
    return (
        f"Under at least {percent} of the choices hold: {', '.join(always) or 'none'}. Under as many do not hold: "
        f"{', '.join(never) or 'none'}. The choice decides about: {', '.join(open_) or 'none'}."
    )


def _shares(name: str, shares: np.ndarray) -> list[str | Cell]:
    return [Cell(escape(name), "nowrap"), *(Cell(f"{100.0 * share:.0f}", "tint", float(share)) for share in shares)]


def _singly(singly: xr.Dataset) -> list[str]:
    """Each clause under the default choice and under those that differ from it in one thing."""
    choices, agreeing, words = one_at_a_time(), singly["agreeing"].values, singly["words"].values
    rows = []
    for k, choice in enumerate(choices):
        cells = [
            Cell(
                "yes" if share == 1.0 else "no" if share == 0.0 else f"{round(share * MEMBERS)}/{MEMBERS}",
                "tint",
                float(share),
                str(said),
            )
            for share, said in zip(agreeing[k], words[k], strict=True)
        ]
        spread = float(singly["spread"].values[k])
        rows.append([Cell(escape(_difference(choice)), "nowrap"), *cells, Cell(f"{spread:.0e}", "number")])
    return [
        "<h3>One thing at a time</h3>",
        paragraph(
            f"Yes and no where all of {MEMBERS} neighbours agree, else how many say yes. The last column is the largest "
            "relative spread of a peak force among them: far below one, the numbers are of the trajectory; near one, they "
            "are statistics. Rest the pointer on an answer to read what was measured."
        ),
        table(("choice", *(str(key) for key in singly["clause"].values), "spread"), rows, tinted=True),
    ]


def _difference(choice: Choice) -> str:
    """In what a choice differs from the default."""
    if choice == DEFAULT:
        return "default"
    changed = [level(choice) for level in FACTORS.values() if level(choice) != level(DEFAULT)]
    return ", ".join(changed)


def _events(runs: Mapping[PaperCase, xr.Dataset]) -> list[str]:
    rows: list[Sequence[str | Cell]] = []
    for name, *numbers in event_table(runs[PaperCase(ARRAY)]):
        rows.append([name, *(Cell(text, "number") for text in numbers)])
    return [
        paragraph(
            "The run at 0.5 mm and 150 rpm without friction, beside a second program that integrates Lagrange's equations in "
            "minimal coordinates. The first contact starts without any contact law; then differences grow from one to the next."
        ),
        table(("", "reference", "here", "relative difference"), rows),
    ]


def _case_files(runs: Mapping[PaperCase, xr.Dataset]) -> list[str]:
    return [
        paragraph("Each of these texts, saved as case.toml, is run by: scissordyn run case.toml --trust"),
        *(folded(case.name, case.toml) for case in runs),
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
            "Beside this page: runs/ (every run, NetCDF), figures/ (SVG and PNG), cases/ (case files), verdicts.json and "
            "verdicts.csv, one-at-a-time.nc and full-factorial.nc (the answers under other choices)."
        ),
        paragraph(made, "soft"),
    ]
