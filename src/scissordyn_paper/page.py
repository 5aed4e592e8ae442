"""Elements of pages in HTML: the macros of the template as functions."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup
from matplotlib.figure import Figure

from scissordyn.plot.file import contents_of, write_content

FORMATS = ("png", "svg")  # Formats of the picture files

_ENVIRONMENT = Environment(
    loader=PackageLoader("scissordyn_paper", "."), autoescape=True, undefined=StrictUndefined, keep_trailing_newline=True
)
_MACROS: Any = _ENVIRONMENT.get_template("page.html").module

badge, cited, contents, document = _MACROS.badge, _MACROS.cited, _MACROS.contents, _MACROS.document
folded, linked, noted, paragraph = _MACROS.folded, _MACROS.linked, _MACROS.noted, _MACROS.paragraph
section, small, tally = _MACROS.section, _MACROS.small, _MACROS.tally


class Cell(NamedTuple):
    """Cell of a table in HTML."""

    text: str  # Plain text, which is escaped, or `Markup`
    kind: str = ""  # CSS class: "", "number", "nowrap" or "tint"
    tint: float | None = None  # Background colour from 0 ("differs") to 1 ("agrees")
    note: str = ""  # Text that appears when the pointer is over the cell

    @property
    def colour(self) -> Markup:
        """Background colour in CSS: full colour for a tint of 0 or 1, none for one half."""
        tint = 0.5 if self.tint is None else self.tint
        return Markup("rgb(var(--{}) / {:.2f})").format("yes" if tint >= 0.5 else "no", 1.1 * abs(tint - 0.5))


def table(head: Sequence[str], rows: Iterable[Sequence[str | Cell] | str], *, tinted: bool = False) -> Markup:
    """Return a table in HTML; a row that is a text becomes a heading between rows."""
    cells = (row if isinstance(row, str) else [one if isinstance(one, Cell) else Cell(one) for one in row] for row in rows)
    found: Markup = _MACROS.table(head, list(cells), tinted)
    return found


def save_picture(drawn: Figure, folder: Path, name: str) -> list[Path]:
    """Write a picture in all formats; return the paths of the files."""
    folder.mkdir(parents=True, exist_ok=True)
    contents = contents_of(drawn, FORMATS)
    return [write_content(content, folder / f"{name}.{form}") for form, content in zip(FORMATS, contents, strict=True)]


def picture(files: Sequence[Path], title: str, caption: str) -> Markup:
    """Return HTML of the vector file of a picture with title and caption."""
    svg = next(path for path in files if path.suffix == ".svg").read_bytes()
    found: Markup = _MACROS.figure(base64.b64encode(svg).decode(), title, caption)
    return found
