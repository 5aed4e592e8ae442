"""Loose joints in a case file."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, ValidationInfo, field_validator

from scissordyn.config.law import law_of, material_of, read_law
from scissordyn.config.table import Table
from scissordyn.laws.contact import Damping, Elastic, Friction
from scissordyn.laws.damping.lankarani_nikravesh import LankaraniNikravesh
from scissordyn.laws.material import Material
from scissordyn.model.clearance import Clearance
from scissordyn.units import quantities

__all__ = ["ClearanceTable"]

_GAP = quantities(Clearance)
_DEFAULT: dict[str, Any] = {
    field.name: field.default if field.default_factory is dataclasses.MISSING else field.default_factory().name
    for field in dataclasses.fields(Clearance)
}


class ClearanceTable(Table):
    """A loose joint."""

    joint: Annotated[str, Field(description='the loose joint, or several: "all", "pivots", "unit 1/*"', examples=["A"])]
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
    restitution: Annotated[
        float | None, quantities(LankaraniNikravesh)["restitution"], Field(examples=[LankaraniNikravesh().restitution])
    ] = None
    stiffness: Annotated[
        Elastic, law_of("stiffness"), Field(description="elastic part of the normal force", validate_default=True)
    ] = _DEFAULT["stiffness"]
    damping: Annotated[Damping, Field(description="damping part of the normal force", validate_default=True)] = _DEFAULT[
        "damping"
    ]
    friction: Annotated[
        Friction,
        law_of("friction"),
        Field(description='"none", or a law', examples=[{"law": "lugre", "kinetic": 0.05}], validate_default=True),
    ] = _DEFAULT["friction"]

    @field_validator("damping", mode="plain")
    @classmethod
    def _damping_with_restitution(cls, given: Any, info: ValidationInfo) -> Any:
        if info.data.get("restitution") is None:
            return read_law(given, "damping", (info.context or {}).get("folder", Path()))
        return read_law(given, "damping", (info.context or {}).get("folder", Path()), restitution=info.data["restitution"])

    def described(self) -> Clearance:
        """The loose joint as the model describes it."""
        return Clearance(**{name: getattr(self, name) for name in _DEFAULT})
