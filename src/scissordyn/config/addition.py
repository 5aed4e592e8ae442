"""What a case file adds to an assembled mechanism: bars that bend, friction in ideal pins, payloads, clearances."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING
from typing import Annotated, Any

from scissordyn.config.table import About, Call, Context, Hints, Table, call_table, keys_of, made_table, reader, table_of, toml
from scissordyn.errors import InputError
from scissordyn.laws.contact import Damping, Elastic, Friction
from scissordyn.laws.damping.factors import LankaraniNikravesh
from scissordyn.model.bending import with_bending
from scissordyn.model.clearance import Clearance
from scissordyn.model.guide_clearance import GuideClearance
from scissordyn.model.joint_friction import with_joint_friction
from scissordyn.model.payload import with_panels, with_payload
from scissordyn.units import quantities

BARS_SAMPLE = {"section": "tube 60x60x1.56 mm", "material": "steel"}

BendingTable = table_of(
    with_bending,
    (("mechanism", None),),
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


JointFrictionTable = table_of(
    with_joint_friction,
    (
        ("mechanism", None),
        ("joints", Annotated[str, About('ideal pins: "all", "pivots", "unit 1/*", or a name', examples=["all"])]),
    ),
    spelt={"joints": "joint"},
    radius="10 mm",
    kinetic=0.1,
)
"""Friction in some ideal pins."""


PayloadTable = table_of(with_payload, (("mechanism", None),), spelt={"place": "at"}, place="A", mass="1 kg")
"""A payload fixed to a body."""

PanelsTable = table_of(with_panels, (("mechanism", None),), bodies="unit */bar 1", mass="0.5 kg")
"""A panel on each of some bars."""


_RESTITUTION = Annotated[
    float | None, quantities(LankaraniNikravesh)["restitution"], About(examples=[LankaraniNikravesh().restitution])
]
_FRICTION = '"none", or a law; lugre has bristles that stick, at 3 to 4 times the time of ambrosio'
_LAWS: Hints = (
    ("stiffness", Annotated[Elastic, About("elastic part of the normal force")]),
    ("damping", Annotated[Damping, About("damping part of the normal force")]),
    ("friction", Annotated[Friction, About(_FRICTION, [{"law": "lugre", "kinetic": 0.05}])]),
)


def _table(kind: type, which: str, joints: str, **examples: Any) -> type[Call]:
    """The table of a kind of clearance: its keys, those of which joints or guides, and the restitution of its damping law."""
    keys: dict[str, Any] = {which: (Annotated[str, About(joints, [examples.pop(which)])], MISSING)}
    for key, declared in keys_of(kind, _LAWS, material="steel", **examples).items():
        if key == "stiffness":  # the damping law, which is read later, takes it
            keys["restitution"] = (_RESTITUTION, None)
        keys[key] = declared
    return call_table(kind, keys, base=Call)


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
