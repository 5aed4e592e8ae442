"""Elements of the page: the template's macros as functions."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup
from matplotlib.figure import Figure

from scissordyn.plot.file import write

FORMATS = ("png", "svg")  # Formats of the picture files

_ENVIRONMENT = Environment(
    loader=PackageLoader("scissordyn_paper", "."), autoescape=True, undefined=StrictUndefined, keep_trailing_newline=True
)
_MACROS: Any = _ENVIRONMENT.get_template("page.html").module

badge, cited, contents, document = _MACROS.badge, _MACROS.cited, _MACROS.contents, _MACROS.document
folded, linked, noted, paragraph = _MACROS.folded, _MACROS.linked, _MACROS.noted, _MACROS.paragraph
section, small, tally = _MACROS.section, _MACROS.small, _MACROS.tally


class Cell(NamedTuple):
    """A cell of a table."""

    text: str  # Escaped, unless it is `Markup` of this page's elements
    kind: str = ""  # Class: "", "number", "nowrap" or "tint"
    tint: float | None = None  # Colour from 0 ("differs") to 1 ("agrees")
    note: str = ""  # Shown on hover

    @property
    def colour(self) -> Markup:
        """The background: full colour for 0 and 1, none at one half."""
        tint = 0.5 if self.tint is None else self.tint
        return Markup("rgb(var(--{}) / {:.2f})").format("yes" if tint >= 0.5 else "no", 1.1 * abs(tint - 0.5))


def table(head: Sequence[str], rows: Iterable[Sequence[str | Cell] | str], *, tinted: bool = False) -> Markup:
    """A table."""
    cells = (row if isinstance(row, str) else [one if isinstance(one, Cell) else Cell(one) for one in row] for row in rows)
    found: Markup = _MACROS.table(head, list(cells), tinted)
    return found


def save_picture(drawn: Figure, folder: Path, name: str) -> list[Path]:
    """Write a picture in all formats."""
    folder.mkdir(parents=True, exist_ok=True)
    return [write(drawn, folder / f"{name}.{form}") for form in FORMATS]


def picture(files: Sequence[Path], title: str, caption: str) -> Markup:
    """The vector file of a picture inside the page, with its caption."""
    svg = next(path for path in files if path.suffix == ".svg").read_bytes()
    found: Markup = _MACROS.figure(base64.b64encode(svg).decode(), title, caption)
    return found
