"""The table [structure]: the keys of each kind, and the mechanism built from them."""

from __future__ import annotations

import dataclasses
import inspect
from abc import abstractmethod
from collections.abc import Callable, Mapping
from typing import Annotated, Any, ClassVar, Literal, get_args, get_type_hints

from pydantic import Field, PlainValidator, ValidationInfo, create_model

from scissordyn.component.place import Point
from scissordyn.config.part import pair
from scissordyn.config.table import Table
from scissordyn.errors import InputError, did_you_mean
from scissordyn.model.array import hoberman_ring, mast, polar_scissor
from scissordyn.model.linkage import four_bar, n_four_bar, slider_crank
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
        """The structure as fields of `Mechanism`."""


class MechanismTable(StructureTable):
    """A mechanism of the parts in the other tables of the file."""

    kind: Annotated[
        Literal["mechanism"],
        Field(description="the parts of the tables [[body]], [[joint]], ... below", examples=["mechanism"]),
    ]
    gravity: Annotated[float, _MECHANISM["gravity"]] = Mechanism.gravity
    gravity_direction: Annotated[float, _MECHANISM["gravity_direction"]] = Mechanism.gravity_direction
    input_body: Annotated[str, Field(description="the driven body of a [drive] without `body`", examples=["crank"])] = ""
    output_body: Annotated[str, Field(description="the output body", examples=["slider"])] = ""

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


def _built(kind: str, builder: Callable[..., Mechanism], help: str, **keys: Any) -> type[StructureTable]:
    """The table whose keys are the arguments of a builder.

    Parameters
    ----------
    kind : str
        Its name in the case file.
    builder : callable
        All its arguments have defaults.
    help : str
        Description in one line.
    **keys : Quantity, str or annotation
        For each argument its quantity or, without a unit, its meaning or how it is read.
    """
    hints = get_type_hints(builder)
    found: dict[str, Any] = {"kind": (Literal[kind], Field(description=help, examples=[kind]))}
    for name, parameter in inspect.signature(builder).parameters.items():
        key = keys[name]
        if isinstance(key, Quantity):
            found[name] = (Annotated[hints[name], key], parameter.default)
        elif isinstance(key, str):
            found[name] = (hints[name], Field(parameter.default, description=key))
        else:
            found[name] = (key, parameter.default)
    table: type[BuiltTable] = create_model(f"{builder.__name__}_table", __base__=BuiltTable, __doc__=help, **found)
    table.builder = staticmethod(builder)
    return table


def _length(help: str) -> Quantity:
    return Quantity("m", above=0.0, help=help)


def _mass(help: str) -> Quantity:
    return Quantity("kg", above=0.0, help=help)


_BAR, _SLIDER, _UNITS = _mass("mass of a bar"), _mass("mass of the slider"), "number of units"

_OPENING_ANGLE = Quantity("rad", help="half opening angle at the start, above 0 and below 90 deg")
_INCLINED = Quantity("rad", help="mean inclination of the bars against the circumference at the start")

_TABLES = (
    _built(
        "scissor",
        scissor,
        "a straight array of scissor units",
        units=_UNITS,
        bar_length=_length("length of a bar"),
        bar_mass=_BAR,
        slider_mass=_SLIDER,
        angle=_OPENING_ANGLE,
        driven_bar="whether the bar pinned to the ground or the bar at the slider is driven",
        **_GRAVITY,
    ),
    _built(
        "polar",
        polar_scissor,
        "an array that curves",
        units=_UNITS,
        inner=_length("length of a bar inside of its pivot"),
        outer=_length("length of a bar outside of its pivot"),
        kink=Quantity("rad", help="angle between the two legs of a bar, 0 for straight bars"),
        bar_mass=_BAR,
        slider_mass=_SLIDER,
        angle=_INCLINED,
        **_GRAVITY,
    ),
    _built(
        "ring",
        hoberman_ring,
        "a closed ring of angulated units that opens and closes",
        units="number of units, >= 3",
        leg=_length("from the pivot of a bar to each of its ends"),
        bar_mass=_BAR,
        angle=_INCLINED,
        **_GRAVITY,
    ),
    _built(
        "mast",
        mast,
        "an array on a base that extends upwards",
        units=_UNITS,
        bar_length=_length("length of a bar"),
        bar_mass=_BAR,
        slider_mass=_SLIDER,
        platform_mass=_mass("mass of a platform on top, none without it"),
        angle=Quantity("rad", help="inclination of the bars against the base at the start, above 0 and below 90 deg"),
        **_GRAVITY,
    ),
    _built(
        "slider-crank",
        slider_crank,
        "a crank, a rod and a slider",
        crank=_length("length of the crank"),
        rod=_length("length of the rod"),
        offset=Quantity("m", help="height of the slider's line above the crank's ground pin"),
        crank_mass=_mass("mass of the crank"),
        crank_inertia=Quantity("kg m^2", above=0.0, help="about its middle, that of a uniform bar without it"),
        rod_mass=_mass("mass of the rod"),
        rod_inertia=Quantity("kg m^2", above=0.0, help="about its middle"),
        slider_mass=_SLIDER,
        slider_inertia=Quantity("kg m^2", above=0.0, help="about its pin; a clearance guide needs it"),
        angle=Quantity("rad", help="direction of the crank at the start"),
        **_GRAVITY,
    ),
    _built(
        "four-bar",
        four_bar,
        "a four-bar linkage",
        ground=_length("distance of the ground pins"),
        crank=_length("length of the crank"),
        coupler=_length("length of the coupler"),
        rocker=_length("length of the rocker"),
        crank_mass=_mass("mass of the crank"),
        coupler_mass=_mass("mass of the coupler"),
        rocker_mass=_mass("mass of the rocker"),
        coupler_point=Annotated[
            Point,
            pair("m"),
            Field(
                description='position of the point "coupler.point", along the coupler and to its left', examples=["90, 60 mm"]
            ),
        ],
        angle=Quantity("rad", help="direction of the crank at the start"),
        branch="side of the diagonal on which the rocker pin starts",
        **_GRAVITY,
    ),
    _built(
        "n-four-bar",
        n_four_bar,
        "parallelograms side by side",
        units="number of parallelograms",
        length=_length("length of every bar"),
        mass=_mass("mass of every bar"),
        speed=Quantity("m/s", help="of the first upper pin along x at the start"),
        gravity=_GRAVITY["gravity"],
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
    # the kind first: it determines the other keys
    alone = {key: value for key, value in given.items() if key == "kind"} if isinstance(given, Mapping) else given
    return STRUCTURES[_Kind.model_validate(alone).kind].model_validate(given, context=info.context)


STRUCTURE = PlainValidator(_read)
"""For ``Annotated[StructureTable, STRUCTURE]``: a key whose value is the table of some kind of structure."""
