"""Clearance joints and clearance guides in a case file."""

from __future__ import annotations

import dataclasses
from typing import Annotated, Any, ClassVar

from scissordyn.component.place import Point
from scissordyn.config.law import law_of, law_shape, material_of, read_law
from scissordyn.config.lubrication import lubrication_of
from scissordyn.config.quantity import read_numbers
from scissordyn.config.shape import About, Context, reader
from scissordyn.config.table import Hints, Table, keys_of, made_table
from scissordyn.config.unit_pattern import numbers_pattern
from scissordyn.errors import InputError
from scissordyn.laws.contact import Damping, Elastic, Friction
from scissordyn.laws.damping.factors import LankaraniNikravesh
from scissordyn.laws.material import STEEL, Material
from scissordyn.model.clearance import Clearance
from scissordyn.model.guide_clearance import GuideClearance
from scissordyn.model.lubrication import Lubrication
from scissordyn.units import quantities


@reader(lambda: law_shape("damping"))
def _read_damping(given: Any, context: Context) -> Any:
    """A damping law, with the restitution coefficient of the table."""
    restitution = context["values"]["restitution"]
    further = {} if restitution is None else {"restitution": restitution}
    return read_law(given, "damping", context, **further)


@reader(lambda: {"type": "array", "items": {"type": "string", "pattern": numbers_pattern("m", 2)}})
def _read_corners(given: Any, context: Context) -> tuple[Point, ...]:
    if not isinstance(given, list):
        raise InputError("not a list of corners", "a list of places", 'corners = ["-20, -10 mm", "20, -10 mm", "0, 10 mm"]')
    corners = []
    for place in given:
        numbers = read_numbers(place, "m")
        if len(numbers) != 2:
            raise InputError(f"a corner with {len(numbers)} numbers", "two numbers and their unit [m]", '"20, -10 mm"')
        corners.append((numbers[0], numbers[1]))
    return tuple(corners)


def _material(kind: Any, whose: str) -> Any:
    return Annotated[kind, material_of, About(whose, examples=[STEEL.name])]


_RESTITUTION = Annotated[
    float | None, quantities(LankaraniNikravesh)["restitution"], About(examples=[LankaraniNikravesh().restitution])
]
_PRICE = "bristles that stick, at 3 to 4 times the time of ambrosio"
_FRICTION = About(f'"none", or a law; lugre has {_PRICE}', examples=[{"law": "lugre", "kinetic": 0.05}])
_LAWS: Hints = (
    ("stiffness", Annotated[Elastic, law_of("stiffness"), About("elastic part of the normal force")]),
    (
        "damping",
        Annotated[Damping, _read_damping, About("damping part of the normal force")],
    ),
    ("friction", Annotated[Friction, law_of("friction"), _FRICTION]),
)
_CORNERS = Annotated[
    tuple[Point, ...],
    _read_corners,
    About(
        "in place of length and width: centres of the rounded corners, in the follower's frame",
        examples=[["-19, -9 mm", "19, -9 mm", "19, 9 mm", "-19, 9 mm"]],
    ),
]


class _Contact(Table):
    """A clearance joint or guide, by the keys of its dataclass and the restitution coefficient of its damping law."""

    kind: ClassVar[type]

    def described(self) -> Any:
        """The clearance joint or guide of the model."""
        return type(self).kind(**{field.name: getattr(self, field.name) for field in dataclasses.fields(type(self).kind)})


def _table(kind: type, which: str, joints: str, hints: Hints, **examples: Any) -> type[_Contact]:
    """The table of a kind of clearance, whose first key says which joints or guides have it."""
    keys: dict[str, Any] = {which: (Annotated[str, About(joints, [examples.pop(which)])], dataclasses.MISSING)}
    for key, declared in keys_of(kind, (*_LAWS, *hints), **examples).items():
        if key == "stiffness":  # the damping law, which is read later, takes it
            keys["restitution"] = (_RESTITUTION, None)
        keys[key] = declared
    table = made_table(f"{kind.__name__}Table", _Contact, keys)
    table.kind = kind
    return table


ClearanceTable = _table(
    Clearance,
    "joint",
    'the clearance joint, or several: "all", "pivots", "unit 1/*"',
    (
        ("material", _material(Material, "of the journal, and of the bearing unless that is given")),
        ("bearing_material", _material(Material | None, "of the bearing")),
        (
            "lubrication",
            Annotated[
                Lubrication | None,
                lubrication_of,
                About("an oil in the clearance, or a table with its viscosity", examples=["ISO VG 46"]),
            ],
        ),
    ),
    joint="A",
    clearance="0.5 mm",
)
"""A clearance joint."""

GuideClearanceTable = _table(
    GuideClearance,
    "guide",
    'the clearance guide, or several: "all"',
    (
        ("material", _material(Material, "of the block, and of the guide unless that is given")),
        ("guide_material", _material(Material | None, "of the guide")),
        ("corners", _CORNERS),
    ),
    guide="guide",
    clearance="0.1 mm",
    length="40 mm",
    width="20 mm",
)
"""A clearance guide."""
