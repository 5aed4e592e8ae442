"""Elements of a self-contained HTML page without scripts, in light and dark."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Sequence
from html import escape
from typing import NamedTuple

__all__ = ["Cell", "badge", "document", "folded", "paragraph", "picture", "section", "table", "tally"]

STYLE = """
:root { color-scheme: light dark; --paper: #fff; --ink: #222; --soft: #666; --line: #ddd; --wash: #f5f5f3; --link: #0072b2;
  --yes: 0 158 115; --no: 213 94 0; }
@media (prefers-color-scheme: dark) { :root { --paper: #16181b; --ink: #e4e4e2; --soft: #a0a3a6; --line: #34383d;
  --wash: #1f2226; --link: #6cbcf0; } }
* { box-sizing: border-box; }
body { margin: 0; background: var(--paper); color: var(--ink); font: 16px/1.5 system-ui, sans-serif; }
main { max-width: 72rem; margin: 0 auto; padding: 2rem 1.25rem 4rem; }
h1 { font-size: 1.8rem; line-height: 1.2; margin: 0 0 .5rem; }
h2 { font-size: 1.3rem; margin: 2.5rem 0 .5rem; padding-top: .75rem; border-top: 1px solid var(--line); }
h3 { font-size: 1.05rem; margin: 1.5rem 0 .25rem; }
p { max-width: 48rem; margin: .5rem 0; }
a { color: var(--link); }
small, .soft { color: var(--soft); font-size: .85rem; }
.scroll { overflow-x: auto; margin: .75rem 0; }
table { border-collapse: collapse; font-size: .88rem; }
th, td { padding: .35rem .55rem; border-bottom: 1px solid var(--line); text-align: left; vertical-align: top; }
th { font-weight: 600; border-bottom: 2px solid var(--line); vertical-align: bottom; }
td.number { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap; }
td.tint { text-align: center; font-variant-numeric: tabular-nums; padding: .3rem .1rem; min-width: 1.9rem; font-size: .76rem; }
th.tint { text-align: center; padding: .35rem .1rem; }
tr.head td { font-weight: 600; background: var(--wash); }
.nowrap { white-space: nowrap; }
.badge { display: inline-block; padding: .05rem .55rem; border-radius: 1rem; font-size: .82rem; font-weight: 600;
  white-space: nowrap; }
.yes { background: rgb(var(--yes) / .18); border: 1px solid rgb(var(--yes)); }
.no { background: rgb(var(--no) / .18); border: 1px solid rgb(var(--no)); }
.tally { display: flex; flex-wrap: wrap; gap: .75rem; margin: 1rem 0; }
.tally div { flex: 1 1 14rem; background: var(--wash); border: 1px solid var(--line); border-radius: 8px; padding: .7rem 1rem; }
.tally strong { display: block; font-size: 1.5rem; line-height: 1.2; }
.tally span { color: var(--soft); font-size: .9rem; }
figure { margin: 1.25rem 0; }
figure img { display: block; max-width: 100%; height: auto; background: #fff; border: 1px solid var(--line); border-radius: 6px;
  padding: .5rem; }
figcaption { max-width: 48rem; margin-top: .4rem; color: var(--soft); font-size: .9rem; }
details { border: 1px solid var(--line); border-radius: 6px; margin: .4rem 0; padding: .3rem .75rem; }
summary { cursor: pointer; }
pre { overflow-x: auto; background: var(--wash); padding: .75rem; border-radius: 6px; font-size: .82rem; }
"""


class Cell(NamedTuple):
    """A cell of a table; plain text is `Cell(escape(text))`.

    Parameters
    ----------
    html : str
    kind : str
        Class: "", "number", "nowrap" or "tint".
    tint : float or None
        From 0, the colour of "differs", to 1, the colour of "agrees".
    note : str
        Shown on hover.
    """

    html: str
    kind: str = ""
    tint: float | None = None
    note: str = ""


def badge(agrees: bool) -> str:
    """The answer as a coloured badge."""
    return f'<span class="badge {"yes" if agrees else "no"}">{"agrees" if agrees else "differs"}</span>'


def paragraph(text: str, kind: str = "") -> str:
    """A paragraph of plain text."""
    return f"<p{_class(kind)}>{escape(text)}</p>"


def section(title: str, name: str, parts: Iterable[str]) -> str:
    """A section of the page with an anchor."""
    return f'<section><h2 id="{name}">{escape(title)}</h2>\n' + "\n".join(parts) + "\n</section>"


def folded(title: str, text: str) -> str:
    """The text of a file, collapsed by default."""
    return f"<details><summary>{escape(title)}</summary><pre>{escape(text)}</pre></details>"


def picture(svg: bytes, title: str, caption: str) -> str:
    """A vector picture inside the page, with its caption."""
    data = base64.b64encode(svg).decode()
    return (
        f'<figure><img src="data:image/svg+xml;base64,{data}" alt="{escape(title)}">'
        f"<figcaption><strong>{escape(title)}.</strong> {escape(caption)}</figcaption></figure>"
    )


def table(head: Sequence[str], rows: Iterable[Sequence[str | Cell] | str], *, tinted: bool = False) -> str:
    """A table.

    Parameters
    ----------
    head : sequence of str
    rows : iterable
        Cells, or one text as a heading across the table.
    tinted : bool
        Whether all columns but the first are narrow and coloured.

    Returns
    -------
    str
    """
    kinds = ["", *(["tint" if tinted else ""] * (len(head) - 1))]
    titles = "".join(f"<th{_class(kind)}>{escape(text)}</th>" for text, kind in zip(head, kinds, strict=True))
    lines = [f"<tr>{titles}</tr>"]
    for row in rows:
        if isinstance(row, str):
            lines.append(f'<tr class="head"><td colspan="{len(head)}">{escape(row)}</td></tr>')
        else:
            lines.append("<tr>" + "".join(map(_cell, row)) + "</tr>")
    return '<div class="scroll"><table>' + "\n".join(lines) + "</table></div>"


def tally(counts: Iterable[tuple[str, str]]) -> str:
    """Large numbers, each with its caption."""
    boxes = (f"<div><strong>{escape(number)}</strong><span>{escape(what)}</span></div>" for number, what in counts)
    return '<div class="tally">' + "".join(boxes) + "</div>"


def document(title: str, parts: Iterable[str]) -> str:
    """The complete page."""
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{escape(title)}</title><style>{STYLE}</style></head>\n<body><main>\n"
        + "\n".join(parts)
        + "\n</main></body></html>\n"
    )


def _class(kind: str) -> str:
    return f' class="{kind}"' if kind else ""


def _cell(given: str | Cell) -> str:
    cell = Cell(escape(given)) if isinstance(given, str) else given
    style = note = ""
    if cell.tint is not None:
        # full colour for 0 and 1, none at one half
        side, strength = ("--yes", cell.tint - 0.5) if cell.tint >= 0.5 else ("--no", 0.5 - cell.tint)
        style = f' style="background: rgb(var({side}) / {1.1 * strength:.2f})"'
    if cell.note:
        note = f' title="{escape(cell.note)}"'
    return f"<td{_class(cell.kind)}{style}{note}>{cell.html}</td>"
