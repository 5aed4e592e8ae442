"""Bars that bend, in a case file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING
from typing import Any

from scissordyn.config.shape import Context, reader
from scissordyn.config.table import Call, Table, made_table, table_of_call, toml
from scissordyn.errors import InputError
from scissordyn.model.bending import with_bending

BARS_SAMPLE = {"section": "tube 60x60x1.56 mm", "material": "steel"}

BendingTable = table_of_call(
    with_bending,
    (("mechanism", None),),
    base=Call,
    spelt={"bodies": "bars"},
    bodies="unit */bar *",
    modes="auto",
    **BARS_SAMPLE,
)
"""Bars that bend."""


def _of_all_bars() -> type[Table]:
    """The table of some bars without the key that says which."""
    hints = BendingTable.__annotations__.items()
    keys = {key: (hint, getattr(BendingTable, key, MISSING)) for key, hint in hints if key != "bars"}
    return made_table("bars", Table, keys, "Section and material of all bars.")


@reader(_of_all_bars)
def _all_bars(given: Any, context: Context) -> Any:
    """Of all bars; their mass is that of a section unless the table says otherwise."""
    if not isinstance(given, Mapping):
        raise InputError("not a table", "the keys of [[bending]] but for bars", f"bars = {toml(BARS_SAMPLE)}")
    if "bars" in given:
        raise InputError("bars within bars", "[[bending]] for some of the bars", f"bars = {toml(BARS_SAMPLE)}")
    mass = {"mass": "section"} if "section" in given else {}
    return BendingTable.read({"bars": "all", **mass, **given}, context)


ALL_BARS = _all_bars  # For a key of [structure] whose value is a table of all bars
