"""What docs/components.md has to say of each component, from its declaration."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from scissordyn.component.catalogue import COMPONENTS
from scissordyn.config.part import PARTS
from scissordyn.config.quantity import written
from scissordyn.config.table import Table, key_help, quantity_of

PAGE = Path(__file__).parents[2] / "docs" / "components.md"
SECTIONS = tuple(section for section in COMPONENTS if section != "actuator")
"""Components with a table of their own; [control] describes an actuator."""


def rows(table: type[Table]) -> list[str]:
    """The rows of a table's keys."""
    found = []
    for key, field in table.model_fields.items():
        quantity = quantity_of(table, key)
        unit = quantity.unit if quantity else ""
        value: Any = None if field.is_required() else field.get_default(call_default_factory=True)
        if field.is_required():
            default = "required"
        elif isinstance(value, float) and quantity is not None:
            default = f"{value:g}" if unit == "1" else written(value, unit)
        elif isinstance(value, bool):
            default = str(value).lower()
        else:
            default = f'"{value}"' if isinstance(value, str) else "none"
        found.append(f"| `{key}` | {'' if unit == '1' else unit} | {default} | {key_help(table, key)} |")
    return found


def outputs(section: str) -> str:
    """The variables of a run that a component makes."""
    declared = COMPONENTS[section].declaration
    if section == "latch":
        return "Outputs: `latch_torque` [N m], `latch_angle` [rad]."
    if section == "rod":
        return "Outputs: `rod_force` [N], `rod_length` [m]."
    kind, unit = ("torque", "N m") if declared.port.forces == ("torque",) else ("force", "N")
    names = [f"`{section}_{output.name}` [{output.unit}]" for output in declared.reported]
    return "Outputs: " + ", ".join((*names, f"`{section}_peak_{kind}` [{unit}]")) + "."


def parts() -> dict[str, str]:
    """The sections of the page by their headings."""
    pieces = re.split(r"^## (.*)$", PAGE.read_text(encoding="utf-8"), flags=re.MULTILINE)
    return dict(zip(pieces[1::2], pieces[2::2], strict=True))


def snippets(text: str, language: str = "toml") -> list[str]:
    """The blocks of code of a text in a language."""
    return re.findall(rf"^```{language}\n(.*?)^```", text, flags=re.MULTILINE | re.DOTALL)


def heading(section: str) -> str:
    """The heading of a component."""
    return f"`[[{section}]]`"


def table(section: str) -> type[Table]:
    """The table of a component."""
    return PARTS[section].table
