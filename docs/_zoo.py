"""Pages of the zoo and of the bibliography, from the declarations: a page for each mechanism, and the tables of two pages."""

from __future__ import annotations

import os
import re
from pathlib import Path

import scissordyn as sd
from scissordyn.bibliography.reference import Reference, bibliography, dois, references
from scissordyn.collection.catalogue import Entry
from scissordyn.control.catalogue import CONTROLLERS
from scissordyn.laws.catalogue import BY_KIND

__all__ = ["bibliography_list", "zoo_page", "zoo_pages", "zoo_table"]


def _said(reference: Reference) -> str:
    """A publication with links, and whether its DOI was found in one place only."""
    text = reference.text
    if reference.url:
        text = text.replace(reference.url, f"<{reference.url}>")
    if not reference.seen:
        return text.replace(f", doi:{reference.doi}", "") if reference.doi else text
    text = text.replace(f"doi:{reference.doi}", f"[doi:{reference.doi}](<https://doi.org/{reference.doi}>)")
    return text if reference.verified else f"{text} DOI found in one place."


def _cell(text: str) -> str:
    return re.sub(r"([|_*`\\])", r"\\\1", text)


def zoo_page(entry: Entry, docs: Path) -> str:
    """The page of a mechanism."""
    film = f"../_static/zoo/{entry.name}.html"
    lines = ["---", "orphan: true", "---", "", f"# {entry.title}", "", f"`{entry.name}`: {entry.kind}. {entry.about}", ""]
    lines += [f"![{entry.title} at three instants]({entry.name}.png)", ""]
    frame = f'<iframe class="film" src="{film}" title="{entry.title} in motion" loading="lazy"></iframe>'
    lines += [f"```{{raw}} html\n{frame}\n```", ""]
    if entry.references:
        lines += ["## Source", "", *(f"* {_said(reference)}" for reference in entry.references), ""]
    lines += ["## Numbers that a right program gives", ""]
    lines += ["| quantity | joints | value | tolerance | by | from |", "| --- | --- | --- | --- | --- | --- |"]
    for one in entry.numbers:
        joints = "ideal" if one.ideal else "with clearance"
        cells = (one.what, joints, one.value, one.tolerance, one.origin, one.reason)
        lines.append(f"| {' | '.join(_cell(cell) for cell in cells)} |")
    place = os.path.relpath(entry.case_file, docs / "zoo")
    lines += ["", f"`scissordyn zoo {entry.name} --check` computes and compares them.", "", "## Parameters", ""]
    lines += [f"The case file is [{entry.case_file.name}]({place}), licence {entry.licence}:", ""]
    lines += [f"```{{literalinclude}} {place}\n:language: toml\n```", ""]
    return "\n".join(lines)


def zoo_pages(docs: Path) -> dict[Path, str]:
    """The page of every mechanism that comes with the package."""
    ours = (entry for entry in sd.zoo.values() if entry.package == "scissordyn")
    return {docs / "zoo" / f"{entry.name}.md": zoo_page(entry, docs) for entry in ours}


def zoo_table() -> list[str]:
    """A row for each mechanism."""
    ours = (entry for entry in sd.zoo.values() if entry.package == "scissordyn")
    rows = []
    for entry in ours:
        first = next(iter(entry.numbers))
        value, unit = first.value.split(" ", 1)
        number = f"{_cell(first.what)}: {float(value):.4g} {_cell(unit)}"
        rows.append(f"| [{entry.name}](zoo/{entry.name}.md) | {entry.title} | {entry.kind} | {number} |")
    return ["| name | what it is | kind | a number that it must give |", "| --- | --- | --- | --- |", *rows]


def _citing_pages(docs: Path) -> dict[str, list[str]]:
    """Links to the pages that name a DOI, in lower case."""
    found: dict[str, list[str]] = {}
    for page in sorted(docs.rglob("*.md")):
        name = page.relative_to(docs).as_posix()
        if name == "references.md" or name.startswith(("zoo/", "components/", "validation/", "theory/catalogue", "decisions/")):
            continue  # made from the same declarations, or no part of the site
        for doi in dois(page.read_text(encoding="utf-8")):
            found.setdefault(doi.lower(), []).append(f"[{name.removesuffix('.md')}]({name})")
    return found


def bibliography_list() -> list[str]:
    """Every publication with what cites it."""
    pages = _citing_pages(Path(__file__).parent)
    users: dict[str, list[str]] = {}
    parts = [(f"{kind} {name}", law.source) for kind, known in BY_KIND.items() for name, law in known.items()]
    parts += [(f"controller {name}", found.source) for name, found in CONTROLLERS.items()]
    parts += [(f"[{entry.name}](zoo/{entry.name}.md)", entry.mechanism.source) for entry in sd.zoo.values()]
    for use, source in parts:
        for reference in references(source):
            users.setdefault(reference.key, []).append(use)
    lines = []
    for key, reference in sorted(bibliography().items()):
        if reference.type != "software":
            by = users.get(key, []) + (pages.get(reference.doi.lower(), []) if reference.doi else [])
            cited = f" *Cited by* {', '.join(by)}." if by else ""
            lines.append(f"* `{key}`: {_said(reference)}{cited}")
    return lines
