"""Tables of the pages that are made from declarations: keys of components, names of laws, zoo, bibliography, subpackages.

Each stands in a page between two comments, which say what it is of. ``python docs/_tables.py`` writes them anew, and with
``--check`` only names the pages that are not up to date.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from scissordyn.casefile.part import PARTS
from scissordyn.casefile.quantity import rounded_text
from scissordyn.casefile.table import Table, toml
from scissordyn.components.catalogue import COMPONENTS
from scissordyn.components.port import AXIS
from scissordyn.laws.catalogue import BY_KIND

sys.path.insert(0, str(Path(__file__).parent))
from _subpackages import import_chart
from _zoo import bibliography_list, zoo_pages, zoo_table

__all__ = ["PAGES", "component_keys", "component_outputs", "filled", "key_rows", "refresh"]

PAGES = ("components.md", "laws.md", "gallery.md", "maintain.md", "references.md")

BLOCK = re.compile(r"(<!-- made from declarations: ([\w -]+) -->\n).*?(<!-- end -->)", re.DOTALL)


def _default(field: Any, quantity: Any) -> str:
    value = None if field.required else field.default
    if field.required:
        return "required"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, Mapping):
        return f"`{toml(value)}`"
    if isinstance(value, int | float) and quantity is not None:
        return f"{value:g}" if quantity.unit == "1" else rounded_text(float(value), quantity.unit)
    return f'"{value}"' if isinstance(value, str) else "none"


def _range(quantity: Any) -> str:
    """What a number may be, without its unit."""
    if quantity is None:
        return ""
    bounds = ((">", quantity.above), ("≥", quantity.minimum), ("<", quantity.below), ("≤", quantity.maximum))
    return ", ".join(f"{sign} {bound:g}" for sign, bound in bounds if bound is not None)


def key_rows(table: type[Table]) -> list[str]:
    """A row for each key: name, unit, default, range in SI, meaning."""
    lines = ["| key | unit | default | range in SI | meaning |", "| --- | --- | --- | --- | --- |"]
    for key, field in table.declared_keys().items():
        quantity = field.quantity
        unit = "" if quantity is None or quantity.unit == "1" else quantity.unit
        meaning = field.help
        lines.append(f"| `{key}` | {unit} | {_default(field, quantity)} | {_range(quantity)} | {meaning} |")
    return lines


SHARED = (
    "| `name` |  | required |  | name, unique among its kind |",
    *(f'| `{key}` |  | required |  | a point, as "BODY.POINT" or "ground.POINT" |' for key in ("start", "end", "point")),
    "| `body` |  | required |  | the body that it acts on |",
    '| `base` |  | "ground" |  | the body that it acts against |',
)
"""Rows that stand in most tables of components: the page says them once."""


def component_keys(section: str) -> list[str]:
    """The table of a component's keys without those of its name and its place that all share."""
    return [line for line in key_rows(PARTS[section].table) if line not in SHARED]


def component_outputs(section: str) -> str:
    """The variables of a run that a component makes, without the instants of largest values."""
    declared = COMPONENTS[section].declaration
    if declared.force is None:  # a constraint, whose force is a reaction
        if declared.port is AXIS:  # in words: its parts are those of beams
            return ""
        names = {"latch": ("torque", "N m", "angle", "rad"), "rod": ("force", "N", "length", "m")}[section]
        return "Outputs: " + ", ".join(f"`{section}_{name}` [{unit}]" for name, unit in (names[:2], names[2:])) + "."
    kind, unit = ("torque", "N m") if declared.port.forces == ("torque",) else ("force", "N")
    found = {f"{section}_{each.name}": each.unit for each in (*declared.reported, *declared.states)}
    peaks = ((kind, unit), *((each.name, each.unit) for each in declared.outputs_monitored))
    peak = {f"{section}_peak_{name}": unit for name, unit in peaks}
    return "Outputs: " + ", ".join(f"`{n}` [{u}]" for n, u in (found | peak).items()) + "."


def _all_components() -> list[str]:
    lines = ["| table | class | port | symbol |", "| --- | --- | --- | --- |"]
    for section, kind in COMPONENTS.items():
        if section != "actuator":
            described: Any = kind
            port, symbol = described.declaration.port.name, described.declaration.symbol
            lines.append(f"| [`[[{section}]]`](#{section}) | `{described.__name__}` | {port} | {symbol} |")
    return lines


def _law_names() -> list[str]:
    """The names of all laws by their slot."""
    lines = ["| slot | laws |", "| --- | --- |"]
    return [*lines, *(f"| `{slot}` | {', '.join(f'`{name}`' for name in sorted(laws))} |" for slot, laws in BY_KIND.items())]


def filled(what: str) -> list[str]:
    """The lines of a table by what its comment says, such as "components", "component spring" or "subpackages"."""
    kind, _, name = what.partition(" ")
    if kind == "component":
        outputs = component_outputs(name)
        return [*component_keys(name), *(("", outputs) if outputs else ())]
    tables = {"components": _all_components, "laws": _law_names, "zoo": zoo_table, "bibliography": bibliography_list}
    tables["subpackages"] = import_chart
    return tables[kind]()


def refresh(docs: Path, *, write: bool = True) -> list[str]:
    """Make the tables of all pages anew; the names of the pages that were not up to date."""
    old = []
    for page in PAGES:
        path = docs / page
        text = path.read_text(encoding="utf-8")
        if not BLOCK.search(text):
            raise ValueError(f"{page}: no table that is made from declarations; expected a page with one in PAGES")
        new = BLOCK.sub(lambda found: found[1] + "\n".join(filled(found[2])) + "\n" + found[3], text)
        if new != text:
            old.append(page)
            if write:
                path.write_text(new, encoding="utf-8")
    for path, new in zoo_pages(docs).items():
        if not path.exists() or path.read_text(encoding="utf-8") != new:
            old.append(f"zoo/{path.name}")
            if write:
                path.write_text(new, encoding="utf-8")
    return old


if __name__ == "__main__":
    print("\n".join(refresh(Path(__file__).parent, write="--check" not in sys.argv)) or "all tables are up to date")
