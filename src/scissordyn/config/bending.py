"""Bars that bend, in a case file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING
from typing import Annotated, Any, Literal

from scissordyn.component.time_function import TimeFunction
from scissordyn.config.shape import About, Context, reader
from scissordyn.config.table import Call, Table, made_table, table_of_call, toml
from scissordyn.config.time_function import TIME_FUNCTION
from scissordyn.errors import InputError
from scissordyn.model.bending import ELEMENTS, with_bending

BendingTable = table_of_call(
    with_bending,
    (
        ("mechanism", None),
        ("bodies", Annotated[str, About("which bars, by name or pattern", examples=["unit */bar *"])]),
        ("section", Annotated[str | None, About("tube, box, solid, angle or strip with its dimensions")]),
        ("material", Annotated[str | None, About("steel, aluminium or titanium")]),
        (
            "modes",
            Annotated[int | Literal["auto"], About("bending modes of a bar, its points held", examples=["auto"])],
        ),
        ("elements", Annotated[int | None, ELEMENTS, About("beam elements along a bar, in place of modes")]),
        (
            "time_function",
            Annotated[TimeFunction | None, TIME_FUNCTION, About("a factor of temperatures over time")],
        ),
    ),
    base=Call,
    spelt={"bodies": "bars"},
    section="tube 60x60x1.56 mm",
    material="steel",
)
"""Bars that bend."""

BARS_SAMPLE = {"section": "tube 60x60x1.56 mm", "material": "steel"}


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


ALL_BARS = _all_bars
"""For a key of [structure] whose value is a table of all bars."""
