"""Clearance joints and clearance guides in a case file."""

from __future__ import annotations

import dataclasses
from typing import Annotated, Any, ClassVar

from scissordyn.config.shape import About
from scissordyn.config.table import Hints, Table, keys_of, made_table
from scissordyn.laws.contact import Damping, Elastic, Friction
from scissordyn.laws.damping.factors import LankaraniNikravesh
from scissordyn.model.clearance import Clearance
from scissordyn.model.guide_clearance import GuideClearance
from scissordyn.units import quantities

_RESTITUTION = Annotated[
    float | None, quantities(LankaraniNikravesh)["restitution"], About(examples=[LankaraniNikravesh().restitution])
]
_FRICTION = '"none", or a law; lugre has bristles that stick, at 3 to 4 times the time of ambrosio'
_LAWS: Hints = (
    ("stiffness", Annotated[Elastic, About("elastic part of the normal force")]),
    ("damping", Annotated[Damping, About("damping part of the normal force")]),
    ("friction", Annotated[Friction, About(_FRICTION, [{"law": "lugre", "kinetic": 0.05}])]),
)


class _Contact(Table):
    """A clearance joint or guide, by the keys of its dataclass and the restitution coefficient of its damping law."""

    kind: ClassVar[type]

    def described(self) -> Any:
        """The clearance joint or guide of the model."""
        return type(self).kind(**{field.name: getattr(self, field.name) for field in dataclasses.fields(type(self).kind)})


def _table(kind: type, which: str, joints: str, **examples: Any) -> type[_Contact]:
    """The table of a kind of clearance, whose first key says which joints or guides have it."""
    keys: dict[str, Any] = {which: (Annotated[str, About(joints, [examples.pop(which)])], dataclasses.MISSING)}
    for key, declared in keys_of(kind, _LAWS, material="steel", **examples).items():
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
    joint="A",
    clearance="0.5 mm",
    bearing_material="steel",
    lubrication="ISO VG 46",
)
"""A clearance joint."""

GuideClearanceTable = _table(
    GuideClearance,
    "guide",
    'the clearance guide, or several: "all"',
    guide="guide",
    clearance="0.1 mm",
    length="40 mm",
    width="20 mm",
    guide_material="steel",
    corners=["-19, -9 mm", "19, -9 mm", "19, 9 mm", "-19, 9 mm"],
)
"""A clearance guide."""
