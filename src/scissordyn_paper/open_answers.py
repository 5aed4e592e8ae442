"""Answers to what the paper leaves open: what bars that bend and oil change, in numbers with their spread."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import xarray as xr

from scissordyn.file.output_file import csv_text, write_file
from scissordyn.run.engine import Engine
from scissordyn_paper.cache import Progress, fetch, provenance
from scissordyn_paper.cases import DEFAULT
from scissordyn_paper.figure import open_question as figure
from scissordyn_paper.open_change import CLEAR_SHARE_MIN, NOTICED_FRACTION, Change
from scissordyn_paper.open_question import (
    BARS,
    COMPARED,
    LONGEST_FIRST,
    MANOEUVRES,
    MEASURES,
    NEIGHBOUR_RUNS,
    OILS,
    OPEN_CASES,
    STIFFER,
    OpenCase,
    compute,
)
from scissordyn_paper.page import Cell, cited, document, folded, paragraph, picture, save_picture, section, table
from scissordyn_paper.report import DOI, SOURCE

TITLE = "Beyond the paper: do bars that bend and oil in the joint help?"

Found = Mapping[OpenCase, xr.Dataset]  # Measures and orbit of each case


@dataclass(frozen=True)
class OpenAnswers:
    """Answer to the open question of the paper."""

    changes: tuple[Change, ...]  # Effect of each change on each measure
    report: Path  # Report in HTML


def answer_open_question(folder: Path, *, engine: Engine = None, progress: Progress | None = None) -> OpenAnswers:
    """Compute the missing runs, compare them, and write the report with its tables and pictures."""
    folder.mkdir(parents=True, exist_ok=True)
    runs = fetch(LONGEST_FIRST, compute, folder / "beyond", what="runs beyond the paper", engine=engine, progress=progress)
    found = {case: runs[case] for case in OPEN_CASES}
    answers = changes(found)
    drawn = {"beyond-ratios": figure.draw_ratios(answers), "beyond-orbits": figure.draw_orbits(found)}
    pictures = {name: save_picture(each, folder / "figures", name) for name, each in drawn.items()}
    write_file(folder / "beyond.csv", _csv(found).encode(), sample="-o paper")
    report = write_file(folder / "beyond.html", _page(found, answers, pictures).encode(), sample="-o paper")
    return OpenAnswers(answers, report)


def changes(found: Found) -> tuple[Change, ...]:
    """Return the effect of each change (flexible bars, oil, or both), for each manoeuvre and measure."""
    return tuple(
        Change(
            manoeuvre, what, measure, tuple((float(found[one][measure]), float(found[other][measure])) for one, other in pairs)
        )
        for manoeuvre in MANOEUVRES
        for what, pairs in _pairs(tuple(case for case in found if case.manoeuvre == manoeuvre), found).items()
        for measure in COMPARED
    )


def _pairs(cases: Sequence[OpenCase], found: Found) -> dict[str, list[tuple[OpenCase, OpenCase]]]:
    """Return pairs of runs that differ only by a change, by the text of the change."""
    pairs: dict[str, list[tuple[OpenCase, OpenCase]]] = {}
    for bars in (*BARS, *STIFFER):
        for oil in (None, *OILS):
            what = " and ".join(([] if bars == "rigid" else [bars]) + ([] if oil is None else [f"oil of {1e3 * oil:g} mPa s"]))
            changed = [case for case in cases if (case.bars, case.oil) == (bars, oil)]
            if what and changed:
                pairs[what] = [(case, case.rigid.dry) for case in changed if case.rigid.dry in found]
    return pairs


def _spread(found: Found) -> tuple[float, float]:
    """Return the median and largest relative difference of the largest force between neighbours of the same case."""
    groups: dict[OpenCase, list[float]] = {}
    for case, run in found.items():
        groups.setdefault(replace(case, member=0), []).append(float(run["peak_force"]))
    apart = [
        (max(values) - min(values)) / max(values) for values in groups.values() if len(values) == NEIGHBOUR_RUNS and max(values)
    ]
    return (float(np.median(apart)), max(apart)) if apart else (math.nan, math.nan)


def _csv(found: Found) -> str:
    """Return a CSV table with the measures of all runs in SI units."""
    rows: list[tuple[object, ...]] = [("manoeuvre", "bars", "viscosity", "clearance", "member", "choice", *MEASURES)]
    for case, run in found.items():
        start = case.manoeuvre, case.bars, "" if case.oil is None else case.oil, case.clearance, case.member, case.choice.words
        rows.append((*start, *(f"{float(run[name]):.9g}" for name in MEASURES)))
    return csv_text(rows)


def _page(found: Found, answers: Sequence[Change], pictures: Mapping[str, Sequence[Path]]) -> str:
    """Return the report as a page in HTML."""
    middle, largest = _spread(found)
    parts = [
        cited(TITLE, SOURCE, DOI),
        section(
            "Answers",
            "answers",
            [
                paragraph(
                    "The paper expects that flexible bars and lubricated joints reduce the energy consumption and the "
                    "collisions. Each number below is a measure divided by the same measure with rigid bars and a dry "
                    f"joint, all else being the same: median and range over the clearances {_sizes(found)}, over "
                    f"{NEIGHBOUR_RUNS} neighbours whose clearances differ by a relative 1e-12, and in the stroke with the "
                    "steel tube over every parameter whose table is lost, one at a time. Where the work of the "
                    "drive without the change is negative, there is no ratio, but the pair counts. Yes: lower by more than "
                    f"{100.0 * NOTICED_FRACTION:g} % in at least {100.0 * CLEAR_SHARE_MIN:g} % of the pairs; no: in at most "
                    f"{100.0 - 100.0 * CLEAR_SHARE_MIN:g} %."
                ),
                *_answers(answers),
                paragraph(
                    f"Neighbours differ in their largest force by {100.0 * middle:.2g} % (median) and at most "
                    f"{100.0 * largest:.2g} %: what differs less than that between two columns is not an effect."
                ),
                picture(pictures["beyond-ratios"], "What each change does", "Each dot is a pair of runs; 1 is no effect."),
            ],
        ),
        section("Runs", "runs", _runs(found)),
        section(
            "Orbits",
            "orbits",
            [
                picture(
                    pictures["beyond-orbits"],
                    "Orbits of the journal",
                    f"Stroke, clearance {1e3 * OpenCase().clearance:g} mm, in clearances: the circle is where metal touches.",
                )
            ],
        ),
        section("How", "how", _how(found)),
    ]
    whole: str = document(TITLE, parts)
    return whole


def _sizes(found: Found) -> str:
    return ", ".join(f"{1e3 * size:g}" for size in sorted({case.clearance for case in found})) + " mm"


def _answers(answers: Sequence[Change]) -> list[str]:
    tint = {"yes": 1.0, "no": 0.0, "depends": 0.5}
    rows: list[Sequence[str | Cell] | str] = []
    for manoeuvre, title in MANOEUVRES.items():
        rows.append(title[:1].upper() + title[1:])
        ours = [one for one in answers if one.manoeuvre == manoeuvre]
        for what in dict.fromkeys(one.what for one in ours):
            cells = [Cell(f"{one.answer}: {one.words}", "", tint[one.answer]) for one in ours if one.what == what]
            rows.append([Cell(what, "nowrap"), *cells])
    return [table(("change", *(f"reduces the {title}?" for title in COMPARED.values())), rows)]


def _runs(found: Found) -> list[str]:
    rows: list[Sequence[str | Cell] | str] = []
    for manoeuvre, title in MANOEUVRES.items():
        rows.append(title[:1].upper() + title[1:])
        for case, run in found.items():
            if case.manoeuvre == manoeuvre and case.member == 0 and case.choice == DEFAULT:
                numbers = [factor * float(run[name]) for name, (_, factor) in MEASURES.items()]
                texts = ["–" if math.isnan(number) else f"{number:.4g}" for number in numbers]
                name = Cell(f"{case.bars}, {case.joint}, {1e3 * case.clearance:g} mm", "nowrap")
                rows.append([name, *(Cell(text, "number") for text in texts)])
    return [
        table(("bars, joint, clearance", *(title for title, _ in MEASURES.values())), rows),
        paragraph(
            "Largest stress over yield strength: above 1 the bar would yield, which the model does not know. Given by "
            "the drive: the sum of what it gives, without what it takes back. Slider off by: largest difference from the "
            "mechanism with rigid bars and ideal joints. Every run, with the neighbours and the other choices, is in "
            "beyond.csv.",
            "soft",
        ),
    ]


def _how(found: Found) -> list[str]:
    kept = sorted({(case.bars, int(run["modes"])) for case, run in found.items() if int(run["modes"])})
    modes = ", ".join(f"{bars} {number}" for bars, number in kept)
    said = sorted({warning for run in found.values() for warning in json.loads(run.attrs["warnings"])})
    made = ", ".join(f"{name} {value}" for name, value in json.loads(provenance()).items())
    return [
        paragraph(
            f"Bending modes of a bar with its pins held: {modes}. "
            "Bars of the stroke start unbent with the velocities of rigid ones, "
            "those of the deployment at rest in equilibrium under gravity, the journal in contact. Oil: a film of finite "
            "length by an impedance table. No friction in dry contact, as in the paper's own runs."
        ),
        folded("A case file", OpenCase(bars="steel tube", oil=OILS[-1]).toml),
        folded("Warnings", "\n".join(said)),
        paragraph(made, "soft"),
    ]
