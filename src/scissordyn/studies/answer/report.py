"""A study as pictures (``result.plot``), tables (CSV, Parquet, NetCDF), and a report with both, one HTML file or PDF."""

from __future__ import annotations

import base64
import re
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import xarray as xr
from jinja2 import Environment
from markupsafe import Markup

from scissordyn.errors import InputError, ScissordynError
from scissordyn.file.output_file import check_target, write_file
from scissordyn.file.pdf import print_pdf
from scissordyn.plot.style import SIZES, Canvas
from scissordyn.record.store import save
from scissordyn.run.engine import STATUSES
from scissordyn.studies.answer.answers import Answers
from scissordyn.studies.answer.page import page
from scissordyn.studies.answer.response_map import surfaces
from scissordyn.studies.answer.section import Section
from scissordyn.studies.ask.requirement import units_of_parts

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


class Layout(NamedTuple):
    """Sizes of pictures and tables of a report."""

    responses: int = 8  # [responses] largest number for which maps and curves are drawn
    rows: int = 40  # [rows] largest number in the table of a front, of causes or of warnings
    letters: int = 48  # [letters] longest text of a table cell that stays on one line
    scale: float = 0.5  # [-] smallest legible scale of a picture; narrower pages scroll it


LAYOUT = Layout()  # Sizes of pictures and tables in the report of every study


class StudyPictures:
    """Pictures of a study; each is drawn on given Axes or on a new Figure, and returns its Axes.

    Parameters
    ----------
    result : StudyResult
    """

    def __init__(self, result: Answers) -> None:
        self._result = result

    def map(self, colour: str = "met", *, x: str = "", y: str = "", axes: Canvas = None) -> list[Axes]:
        """Draw a response over two parameters, or "met": the fraction of cases that meet the requirements.

        A response with a requirement has a contour at its bound. Between scattered points the response is
        interpolated by a Gaussian process if it predicts points that are left out; uncertain regions are paler.
        """
        from scissordyn.plot.study import feasibility_map  # imports matplotlib, which answers in the terminal do not need

        points = self._result.points
        responses = [str(name) for name, variable in points.data_vars.items() if variable.attrs.get("role") == "response"]
        if colour not in ("met", *points):
            raise InputError(f"a map of '{colour}'", ", ".join(["met", *responses]), f"result.plot.map('{responses[0]}')")
        field, bounds = surfaces(self._result, colour, x, y)
        limit = self._limits().get(colour)
        return feasibility_map(points, x=x, y=y, colour=colour, limit=limit, field=field, bounds=bounds, axes=axes)

    def curves(self, *, axes: Canvas = None) -> list[Axes]:
        """Draw each response over each chosen parameter; see `response_curves`."""
        from scissordyn.plot.study import response_curves

        return response_curves(self._result.points, limits=self._limits(), axes=axes)

    def requirements(self, *, axes: Canvas = None) -> list[Axes]:
        """Draw the fractions of the range that meet each requirement, and all of them; see `requirement_bars`."""
        from scissordyn.plot.study import requirement_bars

        fractions_met = self._result.fractions
        intervals = np.array([(fraction.low, fraction.high) for fraction in fractions_met])
        fractions = np.array([fraction.fraction for fraction in fractions_met])
        return requirement_bars([fraction.label for fraction in fractions_met], fractions, intervals, axes=axes)

    def sensitivity(self, response: str = "", *, axes: Canvas = None) -> list[Axes]:
        """Draw the sensitivity of each response, or of one, as bars."""
        from scissordyn.plot.study import sensitivity_bars

        indices = self._result.sensitivity(response)
        return sensitivity_bars(indices if isinstance(indices, dict) else {response: indices}, axes=axes)

    def front(self, x: int = 0, y: int = 1, *, axes: Canvas = None) -> list[Axes]:
        """Draw all points that an optimisation tried over two of its goals, and the front; see `pareto_front`.

        Points of cheap runs that were run accurately too are shown with both values.
        """
        from scissordyn.plot.study import pareto_front

        tried, goals = self._result.optimum.points, self._result.study.goals
        if not max(x, y) < len(goals) or min(x, y) < 0:
            raise InputError(f"the front of goals {x} and {y} of {len(goals)}", "two goals, from 0")
        confirmed = None if self._result.verified is None else self._result.confirmed
        return pareto_front(tried, (goals[x].label, goals[y].label), confirmed=confirmed, axes=axes)

    def _limits(self) -> dict[str, float]:
        return {requirement.response.name: requirement.bound for requirement in self._result.study.requirements}


EXPORT_ENDINGS = (".csv", ".parquet", ".nc")  # File name endings of the formats in which the table of a study is exported


def table(results: xr.Dataset) -> pd.DataFrame:
    """Return one row for each case; a measure of several joints has a column for each, ``A.peak_force [N]``."""
    import pandas as pd

    columns: dict[str, np.ndarray] = {name: results[name].values for name in ("point", "sample", "member")}
    for role in ("factor", "uncertain", "measure"):
        for name, variable in results.data_vars.items():
            if variable.attrs.get("role") != role:
                continue
            units = units_of_parts(results, str(name))
            if "labels" in variable.attrs:
                labels = np.array([*variable.attrs["labels"], ""])  # of a damaged block the last
                columns[str(variable.attrs["address"])] = labels[np.nan_to_num(variable.values, nan=-1.0).astype(int)]
            elif variable.ndim == 1:
                columns[_headed(str(variable.attrs.get("address", name)), units[0])] = variable.values
            else:
                heads = (f"{part}.{name}" for part in variable[variable.dims[1]].values)
                columns |= dict(zip(map(_headed, heads, units), variable.values.T, strict=True))
    columns["status"] = np.array([STATUSES[int(code)] for code in results["status"].values])
    columns["cause"] = results["cause"].values.astype(object)
    return pd.DataFrame(columns)


def _headed(name: str, unit: str) -> str:
    return name if unit in ("1", "") else f"{name} [{unit}]"


def export(results: xr.Dataset, path: Path) -> Path:
    """Write all cases to a CSV, Parquet or NetCDF file, chosen by the ending of its name."""
    ending = path.suffix.lower()
    if ending not in EXPORT_ENDINGS:
        raise InputError(f"'{path}' as a table", f"a name that ends in {', '.join(EXPORT_ENDINGS)}", "-o study.csv")
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


# CSS style sheet of the HTML report of a study
STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; max-width: 68rem; margin: 2rem auto; padding: 0 1rem; color: #222; }
.scroll { overflow-x: auto; margin: 1rem 0; } table { border-collapse: collapse; }
th, td { text-align: left; vertical-align: top; padding: .25rem .9rem .25rem 0; border-bottom: 1px solid #e4e4e4; }
th { vertical-align: bottom; } td { white-space: nowrap; } td.long { white-space: normal; min-width: 14rem; }
code { background: #f4f4f4; padding: .1rem .3rem; }
td code { display: inline-block; min-width: 15rem; white-space: normal; overflow-wrap: break-word; }
img { max-width: 100%; }
h1, h2 { overflow-wrap: anywhere; }
@media (max-width: 40rem) { body { font-size: 14px; } th, td { padding-right: .5rem; } td.long { min-width: 12rem; }
  td code { min-width: 0; overflow-wrap: anywhere; } }
@media screen and (prefers-color-scheme: dark) {
  body { background: #16181c; color: #dcdcdc; } th, td { border-color: #3a3d44; } code { background: #24272d; }
  img { border-radius: .3rem; filter: invert(.92) hue-rotate(180deg); }
}
@page { size: A4; margin: 14mm; }
@media print {
  body { font-size: 11px; max-width: none; margin: 0; padding: 0; } .scroll { overflow: visible; }
  th, td { white-space: normal; padding-right: .5rem; } img { min-width: 0 !important; max-height: 240mm; break-inside: avoid; }
  h2 { break-after: avoid; } tr, table { break-inside: avoid; }
}
"""

HTML, PDF = b"<!doctype html>", b"%pdf-"
FIRST_BYTES = {".html": HTML, ".htm": HTML, ".pdf": PDF}  # First bytes of a report, in lower case, by its file name ending

SECTIONS = """
{% for part in sections %}
{% if part.title %}<h2>{{ part.title }}</h2>{% endif %}
{% for line in part.lines %}
<p>{% if loop.first and not part.title %}<strong>{{ line }}</strong>{% else %}{{ line }}{% endif %}</p>
{% endfor %}
{% if part.rows %}
<div class="scroll"><table><tr>{% for head in part.head %}<th>{{ (head | e).replace(".", may_break) }}</th>{% endfor %}</tr>
{% for row in part.rows %}<tr>{% for text in row %}{% set typed = part.head[loop.index0] == "command" %}
<td{% if text | length > long and not typed %} class="long"{% endif %}>
{% if typed %}<code>{{ text }}</code>{% else %}{{ text }}{% endif %}</td>
{% endfor %}</tr>{% endfor %}</table></div>{% for note in part.notes %}<p>{{ note }}</p>{% endfor %}{% endif %}{% endfor %}
"""
"""HTML template of the sections of a report; the first line of a section without a title is bold, as it is an answer."""

# HTML template of the page that contains all sections of a report
REPORT = """
<!doctype html><html lang="en"><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
{# without a viewport a telephone shows the page as wide as a desk screen, and small #}
<title>{{ heading }}</title><meta name="color-scheme" content="light dark">
<style>{{ style }}</style><h1>{{ heading }}</h1>
{{ answers }}{% if note %}<p>{{ note }}</p>{% endif %}
{% for title, least, picture in pictures %}<h2>{{ title }}</h2><div class="scroll">
<img alt="{{ title }}" style="min-width: {{ least }}px" src="data:image/png;base64,{{ picture }}"></div>{% endfor %}</html>
"""


NOT_IN_NAMES = re.compile(r"[^a-z0-9_.]+")  # Pattern of characters that the names of a report's picture files do not contain


def figures(result: Answers) -> Iterator[tuple[str, Figure]]:
    """Yield title and Figure of each picture that suits a study."""
    from scissordyn.plot.file import figure_of

    study, points, plot = result.study, result.points, StudyPictures(result)
    responses = [str(name) for name, variable in points.data_vars.items() if variable.attrs.get("role") == "response"]
    drawn: list[tuple[str, Callable[[], list[Axes]]]] = []
    if len(study.requirements) > 2:
        drawn.append(("How often each requirement is met", plot.requirements))
    if study.factors and 0 < len(responses) <= LAYOUT.responses:
        for name in (*(("met",) if study.requirements else ()), *responses) if len(study.factors) > 1 else ():
            title = "Where the requirements are met" if name == "met" else f"Map: {points[name].attrs['label']}"
            drawn.append((title, partial(plot.map, name)))
        drawn.append(("Response curves", plot.curves))
    if result.indices[0]:
        drawn.append(("Sensitivity", plot.sensitivity))
    if len(study.goals) >= 2:
        drawn.append(("Pareto front", plot.front))
    for title, draw in drawn:
        yield title, figure_of(draw())


def write_figures(result: Answers, folder: Path) -> list[Path]:
    """Write the pictures of the report as PNG files, with their titles as names."""
    from scissordyn.plot.file import write

    folder.mkdir(parents=True, exist_ok=True)
    return [write(figure, folder / f"{NOT_IN_NAMES.sub('_', title.lower())}.png") for title, figure in figures(result)]


def write_report(result: Answers, path: Path) -> Path:
    store = Path(result.store.path).name
    note = f"Commands are typed in the folder that has {store}."
    return write_page(path, f"Study {store}", page(result, store, LAYOUT.rows), figures(result), note)


def write_page(
    path: Path, heading: str, sections: Iterable[Section], drawn: Iterable[tuple[str, Figure]], note: str = ""
) -> Path:
    """Write sections of text and tables, and then figures with their titles, as one HTML file or PDF."""
    from scissordyn.plot.file import content_of

    start = FIRST_BYTES.get(path.suffix.lower())
    if start is None:
        raise InputError(f"'{path}' as a report", "a name that ends in .html or .pdf", "-o report.html")
    pictures = list[tuple[str, int, str]]()
    for title, figure in drawn:
        width = round(LAYOUT.scale * SIZES.png_dpi * figure.get_figwidth())
        pictures.append((title, width, base64.b64encode(content_of(figure, "png")).decode()))
    names = {"heading": heading, "style": Markup(STYLE), "answers": as_html(sections), "note": note}
    content = rendered(REPORT, **names, pictures=pictures).encode()
    try:
        if path.exists() and not path.read_bytes()[: len(start)].lower().startswith(start):
            raise InputError(f"'{path}' exists and is not a report", "another name", "-o report.html")
        return write_file(path, print_pdf(content) if start == PDF else content, sample="-o report.html")
    except OSError as error:
        raise ScissordynError(f"cannot write '{path}': {error.strerror or error}") from None


def as_html(sections: Iterable[Section]) -> Markup:
    return rendered(SECTIONS, sections=sections, long=LAYOUT.letters, may_break=Markup(".<wbr>"))


def rendered(template: str, **names: Any) -> Markup:
    """Return a filled template without its line breaks."""
    return Markup(Environment(autoescape=True).from_string(template.replace("\n", "")).render(names))
