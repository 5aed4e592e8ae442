"""A study as files: tables (CSV, Parquet, NetCDF), and a report with tables and pictures, one HTML file or the same as PDF."""

from __future__ import annotations

import base64
import html
import io
import re
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from scissordyn.errors import InputError, ScissordynError
from scissordyn.file.output_file import check_target, write_file
from scissordyn.file.pdf import printed
from scissordyn.plot.file import figure_of, write
from scissordyn.run.engine import STATES
from scissordyn.run.store import save
from scissordyn.study.answer.fact import Section
from scissordyn.study.answer.page import page
from scissordyn.study.answer.sensitivity import sensitivity
from scissordyn.study.ask.requirement import units_of_parts

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from scissordyn.study.result import StudyResult

ENDINGS = (".csv", ".parquet", ".nc")


def table(results: xr.Dataset) -> pd.DataFrame:
    """One row for each case; a measure of several joints has a column for each, ``A.peak_force [N]``."""
    import pandas as pd

    columns: dict[str, np.ndarray] = {name: results[name].values for name in ("point", "sample", "member")}
    for role in ("factor", "uncertain", "measure"):
        for name, variable in results.data_vars.items():
            if variable.attrs.get("role") != role:
                continue
            units = units_of_parts(results, str(name))
            if "labels" in variable.attrs:
                labels = [*variable.attrs["labels"], ""]  # of a damaged block the last
                columns[str(variable.attrs["address"])] = np.array(
                    [labels[int(label)] for label in np.nan_to_num(variable.values, nan=-1.0)]
                )
                continue
            if variable.ndim == 1:
                columns[_headed(str(variable.attrs.get("address", name)), units[0])] = variable.values
                continue
            for place, part in enumerate(variable[variable.dims[1]].values):
                columns[_headed(f"{part}.{name}", units[place])] = variable.values[:, place]
    columns["status"] = np.array([STATES[int(code)] for code in results["status"].values])
    columns["cause"] = results["cause"].values.astype(object)
    return pd.DataFrame(columns)


def _headed(name: str, unit: str) -> str:
    return name if unit in ("1", "") else f"{name} [{unit}]"


def export(results: xr.Dataset, path: Path) -> Path:
    """Write all cases to a file whose ending says in which form."""
    ending = path.suffix.lower()
    if ending not in ENDINGS:
        raise InputError(f"'{path}' as a table", f"a name that ends in {', '.join(ENDINGS)}", "-o study.csv")
    if ending == ".nc":
        check_target(path, sample="-o study.nc")
        plain = results.copy()
        for name, variable in results.variables.items():
            if variable.dtype.kind not in "fib":
                plain[name] = variable.copy(data=variable.values.astype(object))
        plain.attrs = {
            name: value if isinstance(value, (str, int, float)) else str(value) for name, value in plain.attrs.items()
        }
        return save(plain, path)
    check_target(path, sample=f"-o study{ending}")
    rows = table(results)
    try:
        content = rows.to_csv(index_label="case").encode() if ending == ".csv" else rows.to_parquet()
    except ImportError:
        raise InputError("pyarrow is not installed", "the extra 'study', or CSV", "-o study.csv") from None
    return write_file(path, content, sample=f"-o study{ending}")


STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; max-width: 64rem; margin: 2rem auto; padding: 0 1rem; color: #222; }
.scroll { overflow-x: auto; margin: 1rem 0; } table { border-collapse: collapse; }
th, td { text-align: left; vertical-align: top; padding: .25rem .9rem .25rem 0; border-bottom: 1px solid #e4e4e4; }
th { vertical-align: bottom; } td { white-space: nowrap; } td.long { white-space: normal; min-width: 20rem; }
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
KINDS = {".html": HTML, ".htm": HTML, ".pdf": PDF}  # How a report begins, in lower case, by the end of its name

VIEWPORT = '<meta name="viewport" content="width=device-width, initial-scale=1">'
"""Without it a telephone shows the page as wide as a desk screen, and small."""

LONG = 48  # Characters from which the text of a cell is broken into lines

DPI = 130

SHRUNK = 0.5  # A picture is shown no smaller than this share of its size, or nobody could read it: narrow pages scroll it
MOST_RESPONSES = 8  # With more responses there are no maps and curves of them

NOT_IN_NAMES = re.compile(r"[^a-z0-9_.]+")

MOST_ROWS = 40  # Points of a front, causes and warnings that are listed


def figures(result: StudyResult) -> Iterator[tuple[str, Figure]]:
    """All pictures that fit a study, with their titles."""
    study, points, plot = result.study, result.points, result.plot
    responses = [str(name) for name, variable in points.data_vars.items() if variable.attrs.get("role") == "response"]
    drawn: list[tuple[str, Callable[[], list[Axes]]]] = []
    if len(study.requirements) > 2:
        drawn.append(("How often each requirement is met", plot.requirements))
    if study.factors and 0 < len(responses) <= MOST_RESPONSES:
        for name in (*(("met",) if study.requirements else ()), *responses) if len(study.factors) > 1 else ():
            title = "Where the requirements are met" if name == "met" else f"Map of {name}"
            drawn.append((title, partial(plot.map, name)))
        drawn.append(("Response curves", plot.curves))
    if sensitivity(study, result.dataset)[0]:
        drawn.append(("Sensitivity", plot.sensitivity))
    if study.optimisation is not None and len(study.optimisation.goals) >= 2:
        drawn.append(("Pareto front", plot.front))
    for title, draw in drawn:
        yield title, figure_of(draw())


def write_figures(result: StudyResult, folder: Path) -> list[Path]:
    """Write the pictures of the report as PNG files, with their titles as names."""
    folder.mkdir(parents=True, exist_ok=True)
    return [write(figure, folder / f"{NOT_IN_NAMES.sub('_', title.lower())}.png") for title, figure in figures(result)]


def write_report(result: StudyResult, path: Path) -> Path:
    start = KINDS.get(path.suffix.lower())
    if start is None:
        raise InputError(f"'{path}' as a report", "a name that ends in .html or .pdf", "-o report.html")
    store = Path(result.store.path).name
    parts = [as_html(page(result, store, MOST_ROWS)), f"<p>Commands are typed in the folder that has {_text(store)}.</p>"]
    for title, figure in figures(result):
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


def as_html(sections: Iterable[Section]) -> str:
    """Sections as HTML; the first line of one without a title is an answer, and bold."""
    parts = []
    for part in sections:
        lines = [f"<p>{_text(line)}</p>" for line in part.lines]
        if lines and not part.title:
            lines[0] = f"<p><strong>{_text(part.lines[0])}</strong></p>"
        table = _table(part) if part.rows else ""
        parts.append((f"<h2>{_text(part.title)}</h2>" if part.title else "") + "".join(lines) + table)
    return "".join(parts)


def _text(text: object) -> str:
    return html.escape(str(text))


def _table(part: Section) -> str:
    lines = "".join(f"<tr>{''.join(map(_cell, part.head, row))}</tr>" for row in part.rows)
    heads = "".join(f"<th>{_text(cell).replace('.', '.<wbr>')}</th>" for cell in part.head)
    notes = "".join(f"<p>{_text(note)}</p>" for note in part.notes)
    return f'<div class="scroll"><table><tr>{heads}</tr>{lines}</table></div>{notes}'


def _cell(head: str, text: str) -> str:
    if head == "command":
        return f"<td><code>{_text(text)}</code></td>"
    return f'<td class="long">{_text(text)}</td>' if len(text) > LONG else f"<td>{_text(text)}</td>"
