"""The report of a study: one HTML file with tables and pictures, which needs nothing else."""

from __future__ import annotations

import base64
import html
import io
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from scissordyn.errors import InputError, ScissordynError
from scissordyn.model.address import number
from scissordyn.plot.study import feasibility_map, pareto_front, requirement_bars, response_curves, sensitivity_bars
from scissordyn.simulation.measure import MEASURES
from scissordyn.simulation.output_file import write_file
from scissordyn.study.answer import AGREEMENT, by_point, causes, counts, feasible_share, replay_command, warned, worst_cases
from scissordyn.study.description import Factor, Study
from scissordyn.study.distribution import Interval, Levels, Uniform
from scissordyn.study.indices import sensitivity
from scissordyn.study.optimise import candidates
from scissordyn.study.requirement import Requirement

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["figures", "write_report"]

STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; max-width: 60rem; margin: 2rem auto; padding: 0 1rem; color: #222; }
table { border-collapse: collapse; margin: 1rem 0; } .scroll { overflow-x: auto; }
th, td { text-align: left; padding: .25rem .9rem .25rem 0;
border-bottom: 1px solid #e4e4e4; } code { background: #f4f4f4; padding: .1rem .3rem; } img { max-width: 100%; }
"""

DPI = 130

MOST_RESPONSES = 8
"""With more responses there are no maps, curves and ranges of each, only the shares that meet the requirements."""

MOST_FRONT = 40
"""Rows of a table of a Pareto front."""


def figures(study: Study, results: xr.Dataset) -> Iterator[tuple[str, Figure]]:
    """All pictures that fit a study, with their titles.

    Parameters
    ----------
    study : Study
    results : Dataset
        From `Store.results`.

    Yields
    ------
    title : str
    figure : Figure
    """
    points = by_point(study, results)
    responses = [str(name) for name, variable in points.data_vars.items() if variable.attrs.get("role") == "response"]
    limits = {one.response.name: one.bound for one in study.requirements}
    drawn: list[tuple[str, Callable[[], list[Axes]]]] = []
    if len(study.requirements) > 2:
        shares = feasible_share(study, results)[:-1]
        bounds = np.array([(one.low, one.high) for one in shares])
        labels = [_meaning(results, one) or one.label for one in study.requirements]
        met = np.array([one.share for one in shares])
        drawn.append(("How often each requirement is met", partial(requirement_bars, labels, met, bounds)))
    if len(responses) > MOST_RESPONSES:
        responses = []
    if len(study.factors) >= 2 and responses:
        if study.requirements:
            drawn.append(("Where the requirements are met", partial(feasibility_map, points)))
        maps = [(name, partial(feasibility_map, points, colour=name, limit=limits.get(name))) for name in responses]
        drawn.extend((f"Map of {name}", draw) for name, draw in maps)
    if study.factors and responses:
        drawn.append(("Response curves", partial(response_curves, points, limits=limits)))
    indices, _ = sensitivity(study, results)
    if indices:
        drawn.append(("Sensitivity", partial(sensitivity_bars, indices)))
    if study.optimisation is not None and len(study.optimisation.goals) >= 2:
        tried, goals = candidates(study, results).points, study.optimisation.goals
        drawn.append(("Pareto front", partial(pareto_front, tried, (goals[0].label, goals[1].label))))
    for title, draw in drawn:
        figure = draw()[0].get_figure(root=True)
        assert figure is not None
        yield title, figure


def write_report(study: Study, results: xr.Dataset, address: str, path: Path) -> Path:
    """Write the report.

    Parameters
    ----------
    study : Study
    results : Dataset
        From `Store.results`.
    address : str
        Of the store, for the commands that replay cases.
    path : Path
        Ends in .html.

    Returns
    -------
    Path
    """
    if path.suffix.lower() not in (".html", ".htm"):
        raise InputError(f"'{path}' as a report", "a name that ends in .html", "-o report.html")
    parts = [*_summary(study, results), *_shares(study, results), *_front(study, results), *_worst(study, results, address)]
    for title, figure in figures(study, results):
        picture = io.BytesIO()
        figure.savefig(picture, format="png", dpi=DPI)
        code = base64.b64encode(picture.getvalue()).decode()
        parts.append(f'<h2>{_text(title)}</h2><img alt="{_text(title)}" src="data:image/png;base64,{code}">')
    head = f'<!doctype html><html lang="en"><meta charset="utf-8"><title>Study</title><style>{STYLE}</style>'
    content = f"{head}<h1>Study {_text(Path(address).name)}</h1>{''.join(parts)}</html>\n".encode()
    try:
        if path.exists() and not path.read_bytes()[:15].lower().startswith(b"<!doctype html>"):
            raise InputError(f"'{path}' is something else than a report", "another name", "-o report.html")
        return write_file(path, content, sample="-o report.html")
    except OSError as error:
        raise ScissordynError(f"cannot write '{path}': {error.strerror or error}") from None


def _text(text: object) -> str:
    return html.escape(str(text))


def _table(head: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    lines = "".join("<tr>" + "".join(f"<td>{_text(cell)}</td>" for cell in row) + "</tr>" for row in rows)
    heads = "".join(f"<th>{_text(cell)}</th>" for cell in head)
    return f'<div class="scroll"><table><tr>{heads}</tr>{lines}</table></div>'


def _over(study: Study, factor: Factor) -> str:
    """What a factor varies over, in words."""
    quantity = number(study.mechanism, factor.address).quantity
    unit = factor.unit or ("" if quantity is None or quantity.unit == "1" else quantity.unit)
    unit, variation = f" {unit}" if unit else "", factor.variation
    if isinstance(variation, Levels):
        values = [value / factor.scale for value in variation.values]
        shown = [f"{value:.6g}" for value in values[:6]] + ([f"... {values[-1]:.6g}"] if len(values) > 6 else [])
        return ", ".join(shown) + unit
    if isinstance(variation, Interval | Uniform):
        low, high = (end / factor.scale for end in variation.ends)
        logarithmic = ", logarithmic" if isinstance(variation, Interval) and variation.logarithmic else ""
        return f"{variation.kind}: {low:.6g} to {high:.6g}{unit}{logarithmic}"
    unit = "" if quantity is None or quantity.unit == "1" else f" {quantity.unit}"
    fields = ", ".join(f"{name} {value}" for name, value in vars(variation).items() if name != "values")
    return f"{variation.kind}: {fields}{unit}"


def _meaning(results: xr.Dataset, requirement: Requirement) -> str:
    """What the function of the user that a requirement is about says of itself."""
    if requirement.measure in MEASURES:
        return ""
    text = str(results[requirement.measure].attrs.get("long_name", ""))
    return "" if text.startswith("measure '") else text


def _summary(study: Study, results: xr.Dataset) -> Iterator[str]:
    complete, failed, pending = counts(results)
    rows = [(factor.address, "chosen", _over(study, factor)) for factor in study.factors]
    rows += [(factor.address, "uncertain", _over(study, factor)) for factor in study.uncertain]
    design = f"{study.points} points ({study.design.kind})"
    samples = f", {study.sampling.samples} samples of the uncertain numbers at each" if study.uncertain else ""
    members = f", {study.members} members of each" if study.members > 1 else ""
    yield f"<p>{_text(design + samples + members)}: {complete} cases complete, {failed} failed, {pending} pending.</p>"
    yield _table(("number", "", "values"), rows)
    points = by_point(study, results)
    if study.members > 1:
        share, undecided = float(points["disagrees"].mean()), float(points["undecided"].mean())
        yield (
            f"<p>Members, whose starts differ by round-off, disagree by more than {AGREEMENT:g} of the response at "
            f"<b>{share:.1%}</b> of the points: the motion is chaotic there, and the answer is a distribution. Whether all "
            f"requirements are met depends on round-off at {undecided:.1%} of the points.</p>"
        )
    found = []
    for name, variable in points.data_vars.items():
        if variable.attrs.get("role") == "response" and bool(np.isfinite(variable.values).any()):
            quantiles = np.nanquantile(variable.values, [0.0, 0.5, 1.0])
            found.append((name, *(f"{value:.4g}" for value in quantiles), variable.attrs["units"]))
    if len(found) <= MOST_RESPONSES:
        yield _table(("response", "smallest", "median", "largest", "unit"), found)
    _, left_out = sensitivity(study, results)
    for name, why in left_out.items():
        yield f"<p>No indices of {_text(name)}: {_text(why)}.</p>"


def _shares(study: Study, results: xr.Dataset) -> Iterator[str]:
    shares = feasible_share(study, results)
    if shares:
        rows = []
        meanings = [_meaning(results, requirement) for requirement in study.requirements]
        for one, meaning in zip(shares, [*meanings, ""], strict=True):
            interval = "no sample" if np.isnan(one.low) else f"{one.low:.1%} to {one.high:.1%}"
            row = [one.label, meaning, f"{one.share:.1%}", interval, one.trials]
            rows.append(row if any(meanings) else [row[0], *row[2:]])
        head = ("requirement", *(("meaning",) if any(meanings) else ()), "met by", "95 % interval", "trials")
        yield "<h2>Requirements</h2>" + _table(head, rows)
        yield "<p>Interval of Clopper and Pearson; a grid is no sample and has none. Failed cases are left out.</p>"


def _front(study: Study, results: xr.Dataset) -> Iterator[str]:
    if study.optimisation is None:
        return
    found = candidates(study, results)
    rows = np.flatnonzero(found.points["front"].values) if found.best < 0 else np.array([found.best])
    names = [factor.address for factor in study.factors] + [goal.label for goal in study.optimisation.goals]
    signs = {goal.label: -1.0 if goal.maximise else 1.0 for goal in study.optimisation.goals}
    table = [
        [int(row), *(f"{signs.get(n, 1.0) * float(found.points[n][row]):.6g}" for n in names)] for row in rows[:MOST_FRONT]
    ]
    heads = ["point", *(f"{name} [{found.points[name].attrs.get('units', '1')}]" for name in names)]
    title = "Pareto front" if found.best < 0 else "Best point"
    yield f"<h2>{title}</h2><p>Measure of risk: {_text(study.optimisation.risk)}.</p>" + _table(heads, table)
    if found.best >= 0 and float(found.points["violation"][found.best]) > 0.0:
        yield "<p>No point meets all requirements; this is the one that violates them least.</p>"


def _worst(study: Study, results: xr.Dataset, address: str) -> Iterator[str]:
    rows = [
        (one.requirement, f"{one.value:.4g}", f"{one.margin:+.1%}", replay_command(address, one.case))
        for one in worst_cases(study, results)
    ]
    if rows:
        yield "<h2>Worst cases</h2>" + _table(("requirement", "value", "margin", "command"), rows)
    failed = [(len(cases), cause, replay_command(address, cases[0])) for cause, cases in causes(results).items()]
    if failed:
        yield "<h2>Failed cases</h2>" + _table(("cases", "cause", "command"), failed)
    said = [(len(cases), text, replay_command(address, cases[0])) for text, cases in warned(results).items()]
    if said:
        yield "<h2>Warnings</h2><p>In the words of the first case.</p>" + _table(("cases", "warning", "command"), said)
