"""The report of a study: one HTML file with tables and pictures, which needs nothing else, or the same as PDF."""

from __future__ import annotations

import base64
import html
import io
import re
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from scissordyn.errors import InputError, ScissordynError
from scissordyn.file.output_file import write_file
from scissordyn.file.pdf import printed
from scissordyn.plot.file import figure_of, write
from scissordyn.plot.study import feasibility_map, pareto_front, requirement_bars, response_curves, sensitivity_bars
from scissordyn.study.answer.conclusion import conclude, margin_text, numbers_text, trend_table
from scissordyn.study.answer.fidelity import confirmed, fidelity_text
from scissordyn.study.answer.indices import sensitivity
from scissordyn.study.answer.ranking import rankings
from scissordyn.study.answer.summary import (
    Table,
    agreement,
    best_points,
    design_size,
    interval_note,
    requirement_fractions,
    response_ranges,
    sensitivities,
    varied_numbers,
)
from scissordyn.study.answer.surface import Surfaces, map_extras
from scissordyn.study.answer.verdict import by_point, causes, counts, feasible_fraction, replay_command, warned, worst_cases
from scissordyn.study.ask.description import Study
from scissordyn.study.compute.optimise import candidates
from scissordyn.study.compute.screening import verified_path, verified_results
from scissordyn.study.compute.store import Store

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; max-width: 64rem; margin: 2rem auto; padding: 0 1rem; color: #222; }
.scroll { overflow-x: auto; margin: 1rem 0; } table { border-collapse: collapse; }
th, td { text-align: left; vertical-align: top; padding: .25rem .9rem .25rem 0; border-bottom: 1px solid #e4e4e4; }
th, td { white-space: nowrap; } td.long { white-space: normal; min-width: 20rem; }
code { background: #f4f4f4; padding: .1rem .3rem; } td code { white-space: normal; overflow-wrap: anywhere; }
img { max-width: 100%; }
h1, h2 { overflow-wrap: anywhere; }
@media (max-width: 40rem) { body { font-size: 14px; } th, td { padding-right: .5rem; } td.long { min-width: 12rem; } }
@page { size: A4; margin: 14mm; }
@media print {
  body { font-size: 11px; max-width: none; margin: 0; padding: 0; } .scroll { overflow: visible; }
  th, td { white-space: normal; padding-right: .5rem; } img { min-width: 0 !important; max-height: 240mm; break-inside: avoid; }
  h2 { break-after: avoid; } tr, table { break-inside: avoid; }
}
"""

HTML, PDF = b"<!doctype html>", b"%pdf-"
KINDS = {".html": HTML, ".htm": HTML, ".pdf": PDF}
"""How a report begins, in lower case, by the end of its name."""

VIEWPORT = '<meta name="viewport" content="width=device-width, initial-scale=1">'
"""Without it a telephone shows the page as wide as a desk screen, and small."""

LONG = 48
"""Characters from which the text of a cell is broken into lines."""

DPI = 130

SHRUNK = 0.5
"""A picture is shown no smaller than this share of its size, or nobody could read it: narrow pages scroll it."""

MOST_RESPONSES = 8
"""With more responses there are no maps, curves and ranges of each, only the fractions that meet the requirements."""

NOT_IN_NAMES = re.compile(r"[^a-z0-9_.]+")

MOST_FRONT = 40
"""Rows of a table of a Pareto front."""


def figures(study: Study, results: xr.Dataset, accurate: xr.Dataset | None) -> Iterator[tuple[str, Figure]]:
    """All pictures that fit a study, with their titles."""
    points = by_point(study, results)
    responses = [str(name) for name, variable in points.data_vars.items() if variable.attrs.get("role") == "response"]
    limits = {requirement.response.name: requirement.bound for requirement in study.requirements}
    drawn: list[tuple[str, Callable[[], list[Axes]]]] = []
    if len(study.requirements) > 2:
        fractions = feasible_fraction(study, results)[:-1]
        bounds = np.array([(requirement.low, requirement.high) for requirement in fractions])
        labels = [requirement.label for requirement in study.requirements]
        met = np.array([requirement.fraction for requirement in fractions])
        drawn.append(("How often each requirement is met", partial(requirement_bars, labels, met, bounds)))
    if len(responses) > MOST_RESPONSES:
        responses = []
    if len(study.factors) >= 2 and responses:
        surfaces = Surfaces(study, points)
        for name in (*(("met",) if study.requirements else ()), *responses):
            title = "Where the requirements are met" if name == "met" else f"Map of {name}"
            drawn.append((title, partial(_map, study, points, name, limits.get(name), surfaces)))
    if study.factors and responses:
        drawn.append(("Response curves", partial(response_curves, points, limits=limits)))
    indices, _ = sensitivity(study, results)
    if indices:
        drawn.append(("Sensitivity", partial(sensitivity_bars, indices)))
    if study.optimisation is not None and len(study.optimisation.goals) >= 2:
        tried, goals = candidates(study, results).points, study.optimisation.goals
        there = None if accurate is None else confirmed(study, accurate, results)
        drawn.append(("Pareto front", partial(pareto_front, tried, (goals[0].label, goals[1].label), confirmed=there)))
    for title, draw in drawn:
        yield title, figure_of(draw())


def _map(study: Study, points: xr.Dataset, colour: str, limit: float | None, surfaces: Surfaces) -> list[Axes]:
    field, bounds = map_extras(study, points, colour, surfaces=surfaces)
    return feasibility_map(points, colour=colour, limit=limit, field=field, bounds=bounds)


def write_figures(study: Study, results: xr.Dataset, store_path: str, folder: Path) -> list[Path]:
    """Write the pictures of the report as PNG files, with their titles as names."""
    folder.mkdir(parents=True, exist_ok=True)
    drawn = figures(study, results, verified_results(study, store_path))
    return [write(figure, folder / f"{NOT_IN_NAMES.sub('_', title.lower())}.png") for title, figure in drawn]


def write_report(study: Study, results: xr.Dataset, store_path: str, path: Path) -> Path:
    start = KINDS.get(path.suffix.lower())
    if start is None:
        raise InputError(f"'{path}' as a report", "a name that ends in .html or .pdf", "-o report.html")
    store, accurate = Path(store_path).name, verified_results(study, store_path)
    parts = [
        *_fidelity(study, results, accurate, store_path),
        conclusion_html(study, results, store),
        f"<p>Commands are typed in the folder that has {_text(store)}.</p>",
        "<h2>What was computed</h2>",
        summary_html(study, results),
        *_trends(study, results),
    ]
    parts += [*_sensitivities(study, results), *_cases(study, results, store)]
    for title, figure in figures(study, results, accurate):
        picture = io.BytesIO()
        figure.savefig(picture, format="png", dpi=DPI)
        code, least = base64.b64encode(picture.getvalue()).decode(), round(SHRUNK * DPI * figure.get_figwidth())
        shown = f'<img alt="{_text(title)}" style="min-width: {least}px" src="data:image/png;base64,{code}">'
        parts.append(f'<h2>{_text(title)}</h2><div class="scroll">{shown}</div>')
    name = _text(f"Study {store}")
    head = f'<!doctype html><html lang="en"><meta charset="utf-8">{VIEWPORT}<title>{name}</title><style>{STYLE}</style>'
    content = f"{head}<h1>{name}</h1>{''.join(parts)}</html>\n".encode()
    try:
        if path.exists() and not path.read_bytes()[: len(start)].lower().startswith(start):
            raise InputError(f"'{path}' is something else than a report", "another name", "-o report.html")
        return write_file(path, printed(content) if start == PDF else content, sample="-o report.html")
    except OSError as error:
        raise ScissordynError(f"cannot write '{path}': {error.strerror or error}") from None


def summary_html(study: Study, results: xr.Dataset) -> str:
    """The head of the report, which a notebook shows as well: counts, numbers, responses, requirements, best points."""
    return "".join(_summary(study, results))


def _summary(study: Study, results: xr.Dataset) -> Iterator[str]:
    points = by_point(study, results)
    complete, failed, pending = counts(results)
    yield f"<p>{_text(design_size(study))}: {complete} cases complete, {failed} failed, {pending} pending.</p>"
    if "damage" in results.attrs:
        yield f"<p><strong>{_text(results.attrs['damage'])}</strong></p>"
    yield _table(varied_numbers(study, results))
    if members := agreement(study, points):
        yield f"<p>{_text(members)}</p>"
    ranges = response_ranges(study, results, points)
    if 0 < len(ranges.rows) <= MOST_RESPONSES:
        yield _table(ranges)
    fractions = requirement_fractions(study, results)
    if fractions.rows:
        yield "<h2>Requirements</h2>" + _table(fractions)
        yield f"<p>{_text(interval_note(study, results))}</p>"
    front = best_points(study, results, MOST_FRONT)
    if front is not None:
        yield f"<h2>{front.title}</h2>" + _table(front)


def conclusion_html(study: Study, results: xr.Dataset, store: str) -> str:
    """The first page: verdict, margins, trends, next steps."""
    return "".join(_conclusion(study, results, store))


def _conclusion(study: Study, results: xr.Dataset, store: str) -> Iterator[str]:
    conclusion = conclude(study, results, store)
    yield "".join(f"<p><strong>{_text(line)}</strong></p>" for line in conclusion.verdict[:1])
    yield "".join(f"<p>{_text(line)}</p>" for line in conclusion.verdict[1:])
    if conclusion.margins is not None:
        yield f"<h2>{_text(conclusion.margins.title)}</h2>" + _table(conclusion.margins)
    if conclusion.trends:
        yield (
            "<h2>What the responses go with</h2><ul>"
            + "".join(f"<li>{_text(line)}</li>" for line in conclusion.trends)
            + "</ul>"
        )
    if conclusion.next:
        steps = (f"<p>{_text(why)}:<br><code>{_text(what)}</code></p>" for why, what in conclusion.next)
        yield "<h2>What to try next</h2>" + "".join(steps)


def _fidelity(study: Study, results: xr.Dataset, accurate: xr.Dataset | None, store_path: str) -> Iterator[str]:
    """What cheap and accurate runs say together, where there are both."""
    if accurate is None:
        return
    (first, *others), table, cost = fidelity_text(
        study, results, accurate, (Store(store_path), Store(verified_path(store_path)))
    )
    yield f"<p><strong>{_text(first)}</strong></p>" + "".join(f"<p>{_text(line)}</p>" for line in others)
    yield f"<h2>{_text(table.title)}</h2>" + _table(table) + f"<p>{_text(cost)}</p>"


def _trends(study: Study, results: xr.Dataset) -> Iterator[str]:
    table = trend_table(study, results)
    if table is not None:
        yield f"<h2>{table.title}</h2>" + _table(table)


def _sensitivities(study: Study, results: xr.Dataset) -> Iterator[str]:
    indices, left_out = sensitivity(study, results)
    for table in sensitivities(indices):
        yield f"<h2>What {_text(table.title)} depends on</h2>" + _table(table)
    for table in rankings(study, results):
        yield f"<h2>What {_text(table.title)}</h2>" + _table(table)
    for name, why in left_out.items():
        yield f"<p>No indices of {_text(name)}: {_text(why)}.</p>"


def _cases(study: Study, results: xr.Dataset, store: str) -> Iterator[str]:
    """Cases to look at, each with the command that replays it."""
    worst = [
        (
            case.requirement,
            case.text,
            margin_text(case.margin),
            numbers_text(study, results, case.numbers),
            replay_command(store, case.case),
        )
        for case in worst_cases(study, results)
    ]
    if worst:
        head = ("requirement", "value", "margin", "numbers", "command")
        notes = ("The margin is a fraction of the bound, negative where the requirement is not met.",)
        yield "<h2>Worst cases</h2>" + _table(Table(head, worst, notes=notes))
    for title, what, groups in (("Failed cases", "cause", causes(results)), ("Warnings", "warning", warned(results))):
        rows = [(str(len(cases)), text, replay_command(store, cases[0])) for text, cases in groups.items()]
        if rows:
            notes = ("In the words of the first case.",)
            yield f"<h2>{title}</h2>" + _table(Table(("cases", what, "command"), rows, notes=notes))


def _text(text: object) -> str:
    return html.escape(str(text))


def _table(table: Table) -> str:
    lines = "".join(f"<tr>{''.join(map(_cell, table.head, row))}</tr>" for row in table.rows)
    heads = "".join(f"<th>{_text(cell)}</th>" for cell in table.head)
    notes = "".join(f"<p>{_text(note)}</p>" for note in table.notes)
    return f'<div class="scroll"><table><tr>{heads}</tr>{lines}</table></div>{notes}'


def _cell(head: str, text: str) -> str:
    if head == "command":
        return f"<td><code>{_text(text)}</code></td>"
    return f'<td class="long">{_text(text)}</td>' if len(text) > LONG else f"<td>{_text(text)}</td>"
