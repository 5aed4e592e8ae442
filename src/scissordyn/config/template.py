"""A commented case file to start from, made from the declarations that case files are read by."""

from __future__ import annotations

from collections.abc import Mapping
from typing import get_args

from scissordyn.config.case import CaseTable, ClearanceTable, DriveTable, Run, ScissorTable
from scissordyn.config.table import Table, key_help, key_sample, quantity_of, table_of, toml
from scissordyn.errors import InputError, did_you_mean

__all__ = ["TEMPLATES", "template"]

TEMPLATES: Mapping[str, type[Table]] = {"scissor": ScissorTable}
"""Structures that a case file can be made for."""

WIDE = 44
"""Longer values have their remark on the line above."""

ALTERNATIVES = ("harmonic", "table", "body", "bearing_material")
"""Keys that are shown but left out: others stand in their place, or their absence means something."""


def template(kind: str) -> str:
    """A case file with every key, its value and its meaning.

    Parameters
    ----------
    kind : str
        The structure, a key of `TEMPLATES`.

    Returns
    -------
    str
        TOML that can be run as it is.
    """
    if kind not in TEMPLATES:
        raise InputError(
            f"structure '{kind}'{did_you_mean(kind, TEMPLATES)}", ", ".join(TEMPLATES), "scissordyn new scissor > case.toml"
        )
    run = table_of(Run, until="50 ms")
    sections = (("[structure]", TEMPLATES[kind]), ("[drive]", DriveTable), ("[[clearance]]", ClearanceTable), ("[run]", run))
    parts = ["# A case for scissordyn. Numbers carry their units; names of laws and materials: scissordyn laws"]
    for heading, table in sections:
        meaning = CaseTable.model_fields[heading.strip("[]")].description
        rows = [
            (f"{'# ' * (key in ALTERNATIVES)}{key} = {key_sample(table, key)}", _remark(table, key))
            for key in table.model_fields
        ]
        width = max(len(row) for row, _ in rows if len(row) <= WIDE)
        lines = [f"{row:{width}}  # {remark}" if len(row) <= WIDE else f"# {remark}\n{row}" for row, remark in rows]
        parts.append("\n".join((f"{heading:{width}}  # {meaning}", *lines)))
    return "\n\n".join(parts) + "\n"


def _remark(table: type[Table], key: str) -> str:
    """What a key is, and its bounds where it has any."""
    quantity = quantity_of(table, key)
    bounds = quantity.allowed.removeprefix("a finite number").strip() if quantity else ""
    choices = " or ".join(toml(choice) for choice in get_args(table.model_fields[key].annotation) if isinstance(choice, str))
    allowed = choices if choices and choices.split(" ")[0] not in key_help(table, key) else bounds
    # a unit alone says nothing here: the value beside it carries one
    return key_help(table, key) + (f", {allowed}" if allowed and not allowed.startswith("[") else "")
