"""Long pages that the site shows in parts, one page each: components by family, validation by case."""

from __future__ import annotations

import os
import re
from functools import cache
from pathlib import Path
from typing import NamedTuple

__all__ = ["moved_target", "shortened", "write"]

HERE = Path(__file__).parent

FAMILIES: dict[str, tuple[str, ...]] = {
    "Springs and cables": (
        *("spring", "constant_force_spring", "nonlinear_spring", "gas_spring", "cable", "torsion_spring", "tape_spring"),
    ),
    "Friction and clutches": ("clutch", "pin_friction", "guide_friction", "pin_lugre", "guide_lugre"),
    "Elastic connections and rollers": ("bushing", "beam", "flexible_bar", "roller"),
    "Loads and motors": (
        *("force", "drag", "torque", "stroke_load", "angle_load", "motor", "tabulated_motor", "linear_motor"),
    ),
    "Stops, cams, edges, rods and latches": ("angle_stop", "travel_stop", "cam", "edge_contact", "rod", "latch"),
}
"""Components of each page, in the order of its headings."""

ABOUT = {
    "components": "Ports, results and the case of the examples are on the page [components](../components.md).",
    "validation": "This page is one case of the [validation](../validation.md).",
}
"""First sentence of the parts of each page that is split."""

CODE = re.compile(r"(^ *```.*?^ *```)", re.DOTALL | re.MULTILINE)
LINK = re.compile(r"(\]\()([^)\s]+)\)")


class Part(NamedTuple):
    """A page that the site shows instead of some sections of a longer one."""

    title: str
    text: str  # Sections with their headings


def slug(heading: str) -> str:
    """Return the anchor of a heading, as GitHub and the site write it."""
    return re.sub(r"[^\w\- ]", "", heading.lower().strip()).replace(" ", "-")


@cache
def sections(page: str) -> dict[str, str]:
    """Return the text of each section of a page by its heading; that before the first one by ""."""
    lines, found, inside = (HERE / f"{page}.md").read_text(encoding="utf-8").splitlines(keepends=True), {"": ""}, False
    for line in lines:
        inside ^= line.lstrip().startswith("```")
        if line.startswith("## ") and not inside:
            found[line[3:].strip()] = line
        else:
            found[next(reversed(found))] += line
    return found


@cache
def parts(page: str) -> dict[str, Part]:
    """Return the parts of a page by the name of their file."""
    known = sections(page)
    if page == "validation":
        return {slug(heading): Part(heading, text) for heading, text in known.items() if heading}
    headings = {family: [f"`[[{name}]]`" for name in names] for family, names in FAMILIES.items()}
    missing = {heading for heading in known if heading.startswith("`[[")} - {one for some in headings.values() for one in some}
    if missing:
        raise ValueError(f"no family of components has {', '.join(sorted(missing))}; see docs/_split.py")
    return {slug(family): Part(family, "".join(known[one] for one in some)) for family, some in headings.items()}


@cache
def anchors(page: str) -> dict[str, str]:
    """Return the name of the part that each heading of a page is in, by the anchor of the heading."""
    return {
        slug(heading): name
        for name, part in parts(page).items()
        for heading in re.findall(r"^##+ (.*)$", CODE.sub("", part.text), flags=re.MULTILINE)
    }


def moved_target(docname: str, target: str) -> str:
    """Return where a link of a page leads on the site: into the part that has the heading."""
    path, _, anchor = target.partition("#")
    if not anchor or "://" in target:
        return target
    page = os.path.normpath(HERE / Path(docname).parent / path) if path else str(HERE / f"{docname}.md")
    stem = str(Path(page).relative_to(HERE).with_suffix("")) if page.startswith(str(HERE)) else ""
    if stem not in ABOUT or anchor not in anchors(stem):
        return target
    there = f"{stem}/{anchors(stem)[anchor]}"
    return f"#{anchor}" if there == docname else f"{os.path.relpath(there, Path(docname).parent)}.md#{anchor}"


def shortened(docname: str, text: str) -> str:
    """Return a page without the sections that other pages of the site have, and with links to these."""
    if docname not in ABOUT:
        return text
    moved = parts(docname)
    for part in moved.values():
        for heading in re.findall(r"^## (.*)$", CODE.sub("", part.text), flags=re.MULTILINE):
            text = text.replace(sections(docname)[heading], "")
    links = "\n".join(f"* [{part.title}]({docname}/{name}.md)" for name, part in moved.items())
    first, found, rest = text.partition("\n\n<!-- made") if docname == "components" else (text.rstrip(), "", "\n")
    return f"{first}\n\n{links}{found}{rest}"


def write() -> None:
    """Write the parts of each page, with links that lead from their folder, and delete those that are gone."""
    for page in ABOUT:
        (HERE / page).mkdir(exist_ok=True)
        for name, part in parts(page).items():
            text = _from_folder(page, part.text)
            if page == "validation":  # its one section has the title of the page
                text = re.sub(r"^#(?=##)", "", text.split("\n", 1)[1], flags=re.MULTILINE)
            text = f"---\norphan: true\n---\n\n# {part.title}\n\n{ABOUT[page]}\n\n{text.lstrip()}"
            target = HERE / page / f"{name}.md"
            if not target.exists() or target.read_text(encoding="utf-8") != text:
                target.write_text(text, encoding="utf-8")
        for old in set((HERE / page).glob("*.md")) - {HERE / page / f"{name}.md" for name in parts(page)}:
            old.unlink()


def _from_folder(page: str, text: str) -> str:
    """Return a text of a page with links that lead from the folder of its parts."""

    def link(found: re.Match[str]) -> str:
        target = found[2]
        if "://" in target or target.startswith("mailto:"):
            return found[0]
        return f"{found[1]}../{page}.md{target})" if target.startswith("#") else f"{found[1]}../{target})"

    pieces = CODE.split(text)
    return "".join(piece if k % 2 else LINK.sub(link, piece) for k, piece in enumerate(pieces))
