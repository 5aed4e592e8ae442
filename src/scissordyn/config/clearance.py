"""Clearance joints and clearance guides in a case file."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, PlainValidator, ValidationInfo, field_validator

from scissordyn.component.place import Point
from scissordyn.config.law import law_of, material_of, read_law
from scissordyn.config.lubrication import lubrication_of
from scissordyn.config.quantity import read_numbers
from scissordyn.config.table import Table
from scissordyn.errors import InputError
from scissordyn.laws.contact import Damping, Elastic, Friction
from scissordyn.laws.damping.factors import LankaraniNikravesh
from scissordyn.laws.material import Material
from scissordyn.model.clearance import Clearance
from scissordyn.model.guide_clearance import GuideClearance
from scissordyn.model.lubrication import Lubrication
from scissordyn.units import quantities

__all__ = ["ClearanceTable", "GuideClearanceTable"]

_GAP, _CHANNEL = quantities(Clearance), quantities(GuideClearance)


def _defaults(kind: type) -> dict[str, Any]:
    """Defaults of a dataclass in the form of a case file, with laws by name."""
    return {
        field.name: field.default if field.default_factory is dataclasses.MISSING else field.default_factory().name
        for field in dataclasses.fields(kind)
    }


_DEFAULT, _GUIDE_DEFAULT = _defaults(Clearance), _defaults(GuideClearance)


def _damping_with_restitution(given: Any, info: ValidationInfo) -> Any:
    """A damping law, with the restitution coefficient of the table."""
    folder = (info.context or {}).get("folder", Path())
    if info.data.get("restitution") is None:
        return read_law(given, "damping", folder)
    return read_law(given, "damping", folder, restitution=info.data["restitution"])


def _read_corners(given: Any) -> tuple[Point, ...]:
    if not isinstance(given, list):
        raise InputError("not a list of corners", "a list of places", 'corners = ["-20, -10 mm", "20, -10 mm", "0, 10 mm"]')
    found = []
    for place in given:
        numbers = read_numbers(place, "m")
        if len(numbers) != 2:
            raise InputError(f"a corner with {len(numbers)} numbers", "two numbers and their unit [m]", '"20, -10 mm"')
        found.append((numbers[0], numbers[1]))
    return tuple(found)


RestitutionKey = Annotated[
    float | None, quantities(LankaraniNikravesh)["restitution"], Field(examples=[LankaraniNikravesh().restitution])
]
StiffnessKey = Annotated[
    Elastic, law_of("stiffness"), Field(description="elastic part of the normal force", validate_default=True)
]
DampingKey = Annotated[Damping, Field(description="damping part of the normal force", validate_default=True)]
FrictionKey = Annotated[
    Friction,
    law_of("friction"),
    Field(description='"none", or a law', examples=[{"law": "lugre", "kinetic": 0.05}], validate_default=True),
]


class ClearanceTable(Table):
    """A clearance joint."""

    joint: Annotated[str, Field(description='the clearance joint, or several: "all", "pivots", "unit 1/*"', examples=["A"])]
    clearance: Annotated[float, _GAP["clearance"], Field(examples=["0.5 mm"])]
    journal_radius: Annotated[float, _GAP["journal_radius"]] = _DEFAULT["journal_radius"]
    bearing_length: Annotated[float, _GAP["bearing_length"]] = _DEFAULT["bearing_length"]
    material: Annotated[
        Material,
        material_of,
        Field(description="of the journal, and of the bearing unless that is given", examples=[_DEFAULT["material"].name]),
    ] = _DEFAULT["material"]
    bearing_material: Annotated[
        Material | None, material_of, Field(description="of the bearing", examples=[_DEFAULT["material"].name])
    ] = None
    restitution: RestitutionKey = None
    stiffness: StiffnessKey = _DEFAULT["stiffness"]
    damping: DampingKey = _DEFAULT["damping"]
    friction: FrictionKey = _DEFAULT["friction"]
    lubrication: Annotated[
        Lubrication | None,
        lubrication_of,
        Field(description="an oil in the clearance, or a table with its viscosity", examples=["ISO VG 46"]),
    ] = None

    _damping = field_validator("damping", mode="plain")(_damping_with_restitution)

    def described(self) -> Clearance:
        """The clearance joint of the model."""
        return Clearance(**{name: getattr(self, name) for name in _DEFAULT})


class GuideClearanceTable(Table):
    """A clearance guide."""

    guide: Annotated[str, Field(description='the clearance guide, or several: "all"', examples=["guide"])]
    clearance: Annotated[float, _CHANNEL["clearance"], Field(examples=["0.1 mm"])]
    length: Annotated[float | None, _CHANNEL["length"], Field(examples=["40 mm"])] = None
    width: Annotated[float | None, _CHANNEL["width"], Field(examples=["20 mm"])] = None
    corners: Annotated[
        tuple[Point, ...],
        PlainValidator(_read_corners),
        Field(
            description="in place of length and width: centres of the rounded corners, in the follower's frame",
            examples=[["-19, -9 mm", "19, -9 mm", "19, 9 mm", "-19, 9 mm"]],
        ),
    ] = ()
    corner_radius: Annotated[float, _CHANNEL["corner_radius"]] = _GUIDE_DEFAULT["corner_radius"]
    thickness: Annotated[float, _CHANNEL["thickness"]] = _GUIDE_DEFAULT["thickness"]
    material: Annotated[
        Material,
        material_of,
        Field(description="of the block, and of the guide unless that is given", examples=[_GUIDE_DEFAULT["material"].name]),
    ] = _GUIDE_DEFAULT["material"]
    guide_material: Annotated[
        Material | None, material_of, Field(description="of the guide", examples=[_GUIDE_DEFAULT["material"].name])
    ] = None
    restitution: RestitutionKey = None
    stiffness: StiffnessKey = _GUIDE_DEFAULT["stiffness"]
    damping: DampingKey = _GUIDE_DEFAULT["damping"]
    friction: FrictionKey = _GUIDE_DEFAULT["friction"]

    _damping = field_validator("damping", mode="plain")(_damping_with_restitution)

    def described(self) -> GuideClearance:
        """The clearance guide of the model."""
        return GuideClearance(**{name: getattr(self, name) for name in _GUIDE_DEFAULT})
