"""The table [structure]: the keys of each kind, and the mechanism built from them."""

from __future__ import annotations

import dataclasses
from abc import abstractmethod
from collections.abc import Callable, Mapping
from typing import Annotated, Any, Literal

from scissordyn.config.addition import ALL_BARS, BARS_SAMPLE
from scissordyn.config.table import About, Call, Context, Reader, Table, made_table, reader, table_of
from scissordyn.errors import InputError, did_you_mean
from scissordyn.model.linkage import four_bar, n_four_bar, slider_crank
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.scissor import hoberman_ring, mast, polar_scissor, scissor
from scissordyn.units import quantities

_MECHANISM = quantities(Mechanism)


class StructureTable(Table):
    """The keys of one kind of structure."""

    bars: Annotated[Any, ALL_BARS, About("section and material of all straight bars, which bend", examples=[BARS_SAMPLE])] = (
        None
    )
    source: Annotated[
        str | None,
        About("who describes it, for `scissordyn cite`", examples=["Li, Wang 2020, doi:10.1177/1369433220971728"]),
    ] = None

    @abstractmethod
    def fields(self) -> dict[str, Any]:
        """The structure as fields of `Mechanism`."""


class MechanismTable(StructureTable):
    """A mechanism of the parts in the other tables of the file."""

    kind: Annotated[
        Literal["mechanism"],
        About("the parts of the tables [[body]], [[joint]], ... below", examples=["mechanism"]),
    ]
    gravity: Annotated[float, _MECHANISM["gravity"]] = Mechanism.gravity
    gravity_direction: Annotated[float, _MECHANISM["gravity_direction"]] = Mechanism.gravity_direction
    input_body: Annotated[str, About("the driven body of a [drive] without `body`", examples=["crank"])] = ""
    output_body: Annotated[str, About("the output body", examples=["slider"])] = ""

    def fields(self) -> dict[str, Any]:
        """Gravity and the names of the first and last body."""
        values = {name: getattr(self, name) for name in type(self).declared_keys() if name not in ("kind", "bars")}
        return {**values, "source": self.source or ""}


class BuiltTable(Call, StructureTable):
    """The arguments of a function that builds a mechanism."""

    def fields(self) -> dict[str, Any]:
        mechanism = self.result()
        built = {field.name: getattr(mechanism, field.name) for field in dataclasses.fields(mechanism)}
        return {**built, "source": self.source or ""}


def _built(kind: str, builder: Callable[..., Mechanism], help: str, **examples: Any) -> type[StructureTable]:
    """The table of a kind of structure whose keys are the arguments of a builder, which all have defaults."""
    named: Any = Annotated[Literal[kind], About(help, [kind])]
    base = made_table(f"{builder.__name__}_kind", BuiltTable, {"kind": (named, dataclasses.MISSING)})
    table: Any = table_of(builder, (), base_table=base, **examples)
    return table  # type: ignore[no-any-return]


_TABLES = (
    _built("scissor", scissor, "a straight array of scissor units"),
    _built("polar", polar_scissor, "an array that curves"),
    _built("ring", hoberman_ring, "a closed ring of angulated units that opens and closes"),
    _built("mast", mast, "an array on a base that extends upwards"),
    _built("slider-crank", slider_crank, "a crank, a rod and a slider"),
    _built("four-bar", four_bar, "a four-bar linkage", coupler_point="90, 60 mm"),
    _built("n-four-bar", n_four_bar, "parallelograms side by side"),
    MechanismTable,
)

STRUCTURES: Mapping[str, type[StructureTable]] = {table.declared_keys()["kind"].words[0]: table for table in _TABLES}


def _known(given: Any, _: Context) -> str:
    if not isinstance(given, str) or given not in STRUCTURES:
        raise InputError(f"unknown structure{did_you_mean(given, STRUCTURES)}", ", ".join(STRUCTURES), 'kind = "scissor"')
    return str(given)


class _Kind(Table):
    kind: Annotated[
        str, Reader(_known, lambda: {"enum": list(STRUCTURES)}), About("what kind of structure", examples=["scissor"])
    ]


@reader(lambda: {"anyOf": list(STRUCTURES.values())})
def _read(given: Any, context: Context) -> StructureTable:
    # the kind first: it determines the other keys
    alone = {key: value for key, value in given.items() if key == "kind"} if isinstance(given, Mapping) else given
    return STRUCTURES[_Kind.read(alone, context).kind].read(given, context)


STRUCTURE = _read  # For ``Annotated[StructureTable, STRUCTURE]``: a key whose value is the table of some kind of structure
