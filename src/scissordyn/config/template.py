"""A commented case file as a starting point, from the declarations of the tables."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, get_args

from scissordyn.config.case import CaseTable
from scissordyn.config.clearance import ClearanceTable, GuideClearanceTable
from scissordyn.config.part import COMPONENT_SECTIONS, PARTS
from scissordyn.config.payload import PanelsTable, PayloadTable
from scissordyn.config.starter import STARTERS
from scissordyn.config.structure import STRUCTURES
from scissordyn.config.table import Table, key_help, key_sample, quantity_of, table_of, toml
from scissordyn.config.time_function import DriveTable
from scissordyn.errors import InputError, did_you_mean
from scissordyn.run.options import AUTO, Options

__all__ = ["TEMPLATES", "template"]

TEMPLATES = tuple(STRUCTURES)
"""Structures that a case file can be made for."""

LOADS: Mapping[str, type[Table]] = {"payload": PayloadTable, "panels": PanelsTable}

WIDE = 44
"""Longer values have their comment on the line above."""

OPTIONAL: Mapping[type[Table], tuple[str, ...]] = {
    DriveTable: tuple(DriveTable.model_fields),
    ClearanceTable: ("bearing_material", "lubrication"),
    **{
        table: tuple(key for key, field in table.model_fields.items() if field.default is None) for table in STRUCTURES.values()
    },
    **{
        part.table: tuple(key for key, field in part.table.model_fields.items() if not field.is_required())
        for part in PARTS.values()
    },
}
"""Keys that are shown as comments unless given: they are alternatives of other keys, or have a meaning if absent."""

Given = Mapping[str, Any]


def template(kind: str) -> str:
    """A case file with every key, its value and its meaning.

    Parameters
    ----------
    kind : str
        The structure, one of `TEMPLATES`.

    Returns
    -------
    str
        TOML that can be run without changes.
    """
    if kind not in TEMPLATES:
        raise InputError(
            f"structure '{kind}'{did_you_mean(kind, TEMPLATES)}", ", ".join(TEMPLATES), "scissordyn new scissor > case.toml"
        )
    starter = STARTERS[kind]
    run = table_of(Options, until="50 ms")
    parts = ["# A case for scissordyn. Numbers carry their units; names of laws and materials: scissordyn laws"]
    parts.append(_section("[structure]", STRUCTURES[kind], starter.get("structure", {})))
    for name in PARTS:
        parts += _list_of(name, starter.get(name, []))
    if "drive" in starter:
        parts.append(_section("[drive]", DriveTable, starter["drive"]))
    parts.append(_section("[[clearance]]", ClearanceTable, starter.get("clearance", {})))
    if kind in ("mechanism", "slider-crank"):
        parts.append(_section("[[guide_clearance]]", GuideClearanceTable, {}, out=True))
    parts += [
        _section(f"[[{name}]]", PARTS[name].table, {}, out=True)
        for name in ("weld", "track", *COMPONENT_SECTIONS, "component")
        if kind == "mechanism"
    ]
    parts += [_section(f"[[{name}]]", table, {}, out=True) for name, table in LOADS.items()]
    parts.append(_section("[run]", run, {"samples": AUTO, **starter.get("run", {})}))
    if kind != "mechanism":
        parts.append(
            "# Springs, loads, motors, stops, latches, further bodies and joints: scissordyn new mechanism shows their tables."
        )
    return "\n\n".join(parts) + "\n"


def _list_of(name: str, given: list[Given]) -> list[str]:
    """The tables of a list: the first with every key, the others with their given keys."""
    first = [_section(f"[[{name}]]", PARTS[name].table, values) for values in given[:1]]
    others = ["\n".join((f"[[{name}]]", *(f"{key} = {toml(value)}" for key, value in values.items()))) for values in given[1:]]
    return first + others


def _section(heading: str, table: type[Table], given: Given, *, out: bool = False) -> str:
    """One table with a comment on every line; `out` makes all of it a comment."""
    name = heading.strip("[]")
    meaning = PARTS[name].help if name in PARTS else CaseTable.model_fields[name].description
    rows = []
    for key in table.model_fields:
        value = toml(given[key]) if key in given else key_sample(table, key)
        comment = out or (key not in given and key in OPTIONAL.get(table, ()))
        rows.append((f"{'# ' * comment}{key} = {value}", _note(table, key)))
    heading = f"# {heading}" if out else heading
    width = max(len(row) for row, _ in rows if len(row) <= WIDE)
    lines = [f"{row:{width}}  # {note}" if len(row) <= WIDE else f"# {note}\n{row}" for row, note in rows]
    return "\n".join((f"{heading:{width}}  # {meaning}", *lines))


def _note(table: type[Table], key: str) -> str:
    """Description of a key, with its bounds."""
    quantity = quantity_of(table, key)
    bounds = quantity.allowed.removeprefix("a finite number").strip() if quantity else ""
    choices = " or ".join(
        toml(choice) for choice in get_args(table.model_fields[key].annotation) if isinstance(choice, str) and key != "kind"
    )
    allowed = choices if choices and choices.split(" ")[0] not in key_help(table, key) else bounds
    # without a unit alone: the value beside it has one
    return key_help(table, key) + (f", {allowed}" if allowed and not allowed.startswith("[") else "")
