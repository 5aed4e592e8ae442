"""What [structure] may hold: the keys of each kind, and the mechanism that they build."""

from __future__ import annotations

import dataclasses
import inspect
from abc import abstractmethod
from collections.abc import Callable, Mapping
from typing import Annotated, Any, ClassVar, Literal, get_args, get_type_hints

from pydantic import Field, PlainValidator, ValidationInfo, create_model

from scissordyn.config.table import Table
from scissordyn.errors import InputError, did_you_mean
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.scissor import scissor
from scissordyn.units import Quantity, quantities

__all__ = ["STRUCTURE", "STRUCTURES", "BuiltTable", "MechanismTable", "StructureTable"]

_MECHANISM = quantities(Mechanism)

_GRAVITY = {"gravity": _MECHANISM["gravity"], "gravity_direction": _MECHANISM["gravity_direction"]}


class StructureTable(Table):
    """The keys of one kind of structure."""

    @abstractmethod
    def fields(self) -> dict[str, Any]:
        """What the structure gives, as fields of `Mechanism`."""


class MechanismTable(StructureTable):
    """A mechanism that consists of what the other tables of the file describe."""

    kind: Annotated[
        Literal["mechanism"],
        Field(description="what the tables [[body]], [[joint]], ... below describe", examples=["mechanism"]),
    ]
    gravity: Annotated[float, _MECHANISM["gravity"]] = Mechanism.gravity
    gravity_direction: Annotated[float, _MECHANISM["gravity_direction"]] = Mechanism.gravity_direction
    input_body: Annotated[str, Field(description="the body that a [drive] without one drives", examples=["crank"])] = ""
    output_body: Annotated[str, Field(description="the body whose motion is the purpose", examples=["slider"])] = ""

    def fields(self) -> dict[str, Any]:
        """Gravity and the names of the first and last body."""
        return {name: getattr(self, name) for name in type(self).model_fields if name != "kind"}


class BuiltTable(StructureTable):
    """The arguments of a function that builds a mechanism."""

    builder: ClassVar[Callable[..., Mechanism]]

    def fields(self) -> dict[str, Any]:
        """Every field of the mechanism that is built."""
        arguments = {name: getattr(self, name) for name in type(self).model_fields if name != "kind"}
        mechanism = type(self).builder(**arguments)
        return {field.name: getattr(mechanism, field.name) for field in dataclasses.fields(mechanism)}


def _built(kind: str, builder: Callable[..., Mechanism], help: str, **keys: Quantity | str) -> type[StructureTable]:
    """The table whose keys are the arguments of a builder.

    Parameters
    ----------
    kind : str
        How the case file calls it.
    builder : callable
        All its arguments have defaults.
    help : str
        What it builds, in one line.
    **keys : Quantity or str
        For each argument what kind of number it is, or, where it is none with a unit, what it means.
    """
    hints = get_type_hints(builder)
    found: dict[str, Any] = {"kind": (Literal[kind], Field(description=help, examples=[kind]))}
    for name, parameter in inspect.signature(builder).parameters.items():
        key = keys[name]
        field = Field(parameter.default, description=None if isinstance(key, Quantity) else key)
        found[name] = (Annotated[hints[name], key], field)
    table: type[BuiltTable] = create_model(f"{builder.__name__}_table", __base__=BuiltTable, __doc__=help, **found)
    table.builder = staticmethod(builder)
    return table


_TABLES = (
    _built(
        "scissor",
        scissor,
        "a straight array of scissor units",
        units="number of units",
        bar_length=Quantity("m", above=0.0, help="length of a bar"),
        bar_mass=Quantity("kg", above=0.0, help="mass of a bar"),
        slider_mass=Quantity("kg", above=0.0, help="mass of the slider"),
        angle=Quantity("rad", help="half opening angle at the start, above 0 and below 90 deg"),
        reading='"A": bar 1 is pinned to the ground and driven; "B": bar 2 is pinned and free',
        **_GRAVITY,
    ),
    MechanismTable,
)

STRUCTURES: Mapping[str, type[StructureTable]] = {
    get_args(table.model_fields["kind"].annotation)[0]: table for table in _TABLES
}
"""The tables of [structure] by kind."""


def _known(given: Any) -> str:
    if given not in STRUCTURES:
        raise InputError(f"unknown structure{did_you_mean(str(given), STRUCTURES)}", ", ".join(STRUCTURES), 'kind = "scissor"')
    return str(given)


class _Kind(Table):
    kind: Annotated[str, PlainValidator(_known), Field(description="what kind of structure", examples=["scissor"])]


def _read(given: Any, info: ValidationInfo) -> StructureTable:
    # the kind first: only it says which other keys there are
    alone = {key: value for key, value in given.items() if key == "kind"} if isinstance(given, Mapping) else given
    return STRUCTURES[_Kind.model_validate(alone).kind].model_validate(given, context=info.context)


STRUCTURE = PlainValidator(_read)
"""For ``Annotated[StructureTable, STRUCTURE]``: a key whose value is the table of some kind of structure."""
