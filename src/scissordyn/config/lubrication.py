"""The lubrication of a clearance joint in a case file: an oil by name, or a table."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Annotated, Any

from scissordyn.config.law import table_or_name
from scissordyn.config.shape import About, Context, reader
from scissordyn.config.table import Table, build, table_of
from scissordyn.errors import InputError
from scissordyn.laws.oil import OILS, Oil, oil_of
from scissordyn.model.lubrication import Lubrication


@reader(lambda: table_or_name(Oil, None))
def _read_oil(given: Any, context: Context) -> Oil:
    if isinstance(given, Mapping):
        oil: Oil = build(Oil, {"name": "custom", **given}, context)
        return oil
    if not isinstance(given, str):
        raise InputError(f"{given!r} as an oil", ", ".join(OILS) + ", or a table of viscosity_40, viscosity_100 and density")
    return oil_of(given)


@cache
def _table() -> type[Table]:
    oil = Annotated[Oil | None, _read_oil, About("an oil by name, or its viscosities")]
    return table_of(Lubrication, (("oil", oil),))


@reader(lambda: {"anyOf": [{"type": "string"}, _table()]})
def _read(given: Any, context: Context) -> Lubrication:
    values = {"oil": given} if isinstance(given, str) else given
    table = _table().read(values, context)
    return Lubrication(**{key: getattr(table, key) for key in values})


lubrication_of = _read
"""For ``Annotated[Lubrication, lubrication_of]``: a key whose value is an oil or a table."""
