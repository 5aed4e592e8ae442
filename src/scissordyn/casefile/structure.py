"""Table [structure], and tables that add flexible bars, joint friction, payloads, clearances and controllers."""

from __future__ import annotations

import dataclasses
import re
from abc import abstractmethod
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import MISSING
from pathlib import Path
from typing import Annotated, Any, Literal

from scissordyn.casefile.table import (
    About,
    Call,
    Context,
    Hints,
    PartError,
    Reader,
    Table,
    call_table,
    keys_of,
    make_table,
    reader,
    table_of,
    toml,
)
from scissordyn.casefile.time_function import read_tabulated, table_shape
from scissordyn.casefile.value import CONTROLLER_EXAMPLE
from scissordyn.components.actuator import Actuator
from scissordyn.components.place import GROUND
from scissordyn.components.time_function import ConstantSpeed, OverTime, Tabulated, TimeFunction
from scissordyn.control.controller import Controller
from scissordyn.errors import InputError, did_you_mean
from scissordyn.kinematics.bending import with_bending
from scissordyn.laws.contact import Damping, Elastic, Friction
from scissordyn.laws.damping.factors import LankaraniNikravesh
from scissordyn.model.addition import with_joint_friction, with_panels, with_payload
from scissordyn.model.clearance import Clearance, GuideClearance
from scissordyn.model.commanded import with_rotors
from scissordyn.model.linkage import four_bar, n_four_bar, slider_crank
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.scissor import hoberman_ring, mast, polar_scissor, scissor
from scissordyn.model.walk import declared
from scissordyn.units import quantities

# correct key `bars` of the table [structure], which error texts show
BARS_EXAMPLE: dict[str, Any] = {"section": "tube 60x60x1.56 mm", "material": "steel"}

BendingTable = table_of(
    with_bending, (("mechanism", None),), spelt={"bodies": "bars"}, bodies="unit */bar *", modes="auto", **BARS_EXAMPLE
)


def _all_bars_table() -> type[Table]:
    """Return the table class for the key `bars` of [structure]: a table [[bending]] without its own key `bars`."""
    hints = BendingTable.__annotations__.items()
    keys = {key: (hint, getattr(BendingTable, key, MISSING)) for key, hint in hints if key != "bars"}
    return make_table("bars", Table, keys, "Section and material of all bars.")


@reader(_all_bars_table)
def _all_bars(given: Any, context: Context) -> Any:
    """Read the key `bars` of [structure]; by default the mass of the bars follows from their section."""
    if not isinstance(given, Mapping):
        raise InputError("not a table", "the keys of [[bending]] except bars", f"bars = {toml(BARS_EXAMPLE)}")
    if "bars" in given:
        raise InputError(
            "a key bars in the table of all bars", "a table [[bending]] for some of the bars", f"bars = {toml(BARS_EXAMPLE)}"
        )
    mass = {"mass": "section"} if "section" in given else {}
    return BendingTable.read({"bars": "all", **mass, **given}, context)


ALL_BARS = _all_bars  # reader of the key `bars` of [structure]


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


PayloadTable = table_of(with_payload, (("mechanism", None),), spelt={"place": "at"}, place="A", mass="1 kg")

PanelsTable = table_of(with_panels, (("mechanism", None),), bodies="unit */bar 1", mass="0.5 kg")


# Type, bounds and example of the key `restitution` of the table [[clearance]]
_RESTITUTION_KEY = Annotated[
    float | None, quantities(LankaraniNikravesh)["restitution"], About(examples=[LankaraniNikravesh().restitution])
]
# Help text of the key `friction` of the table [[clearance]]
_FRICTION_HELP = '"none", or a law; lugre has bristles that stick, at 3 to 4 times the time of ambrosio'
# Types and help texts of the keys of the table [[clearance]] whose value is a contact law
_LAW_KEYS: Hints = (
    ("stiffness", Annotated[Elastic, About("elastic part of the normal force")]),
    ("damping", Annotated[Damping, About("damping part of the normal force")]),
    ("friction", Annotated[Friction, About(_FRICTION_HELP, [{"law": "lugre", "kinetic": 0.05}])]),
)


def _clearance_table(kind: type, which: str, joints: str, **examples: Any) -> type[Call]:
    """Create the table [[clearance]] or [[guide_clearance]]: fields of a clearance, names of joints, restitution."""
    keys: dict[str, Any] = {which: (Annotated[str, About(joints, [examples.pop(which)])], MISSING)}
    for key, hint in keys_of(kind, _LAW_KEYS, material="steel", **examples).items():
        if key == "stiffness":  # the restitution must come before the damping law, whose reader uses it
            keys["restitution"] = (_RESTITUTION_KEY, None)
        keys[key] = hint
    return call_table(kind, keys, base=Call)


ClearanceTable = _clearance_table(
    Clearance,
    "joint",
    'the clearance joint, or several: "all", "pivots", "unit 1/*"',
    joint="A",
    clearance="0.5 mm",
    bearing_material="steel",
    lubrication="ISO VG 46",
    wear="1e-7 mm^3/(N m)",
    bush="1 mm",
    contour="0, 0.001, 0.002 mm",
    journal_wear="1e-8 mm^3/(N m)",
    journal_contour="0, 0.001, 0.002 mm",
)

GuideClearanceTable = _clearance_table(
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

FeedForward = Callable[..., Tabulated]  # `run.inverse_dynamics.feed_forward`, an argument because `run` imports this package

# Correct feed-forward torque of a servo, which error texts show
FEED_FORWARD_EXAMPLE = 'feed_forward = { time = "0 0.1 0.2 0.3 0.4 0.5 s", torque = "0 1 2 3 4 5 N m" }'


@reader(lambda: {"anyOf": [{"const": "ideal"}, table_shape("N m")]})
def _read_torques(given: Any, context: Context) -> str | Tabulated:
    if given == "ideal":
        return "ideal"
    if not isinstance(given, Mapping) or set(given) != {"time", "torque"}:
        raise InputError(
            "not a feed-forward torque", '"ideal" for the torque of the ideal mechanism, or a table', FEED_FORWARD_EXAMPLE
        )
    return read_tabulated(given, Path(), "N m")


@contextmanager
def _errors_of_parts(mechanism: Mechanism) -> Iterator[None]:
    """Raise errors of the block that name a part of the mechanism, such as a spring, as `PartError`."""
    parts: tuple[Any, ...] = (*mechanism.components, *mechanism.joints, *mechanism.guides, *mechanism.rods)
    names = {part.name for part in (*parts, *mechanism.couplings, *mechanism.welds)}
    try:
        yield
    except InputError as error:
        if names.isdisjoint(re.findall(r"'([^']+)'", error.what)):
            raise
        raise PartError(error.what, error.expected, error.example) from None


class ControlTable(Table):
    """Table [control]: a controlled torque instead of a drive."""

    controller: Annotated[Controller, About("scissordyn controllers lists them", examples=[CONTROLLER_EXAMPLE])]
    body: Annotated[str, About("the body on which the torque acts", examples=["unit 1/bar 1"])] = ""
    reference: Annotated[
        TimeFunction | None,
        OverTime("rad", "the reference angle over time"),
        About("the reference angle; by default that of the body's [drive]", examples=[{"speed": "20 rpm"}]),
    ] = None
    feed_forward: Annotated[
        str | Tabulated | None,
        _read_torques,
        About("additional torque: that of the ideal mechanism with rigid bars, or a table", examples=["ideal"]),
    ] = None
    sensor: Annotated[str, About('a joint, whose eccentricity is measured, or a point "BODY.POINT"', examples=["A"])] = ""
    inertia: Annotated[float, quantities(Actuator)["inertia"]] = 0.0
    base: Annotated[str, About("the body against which the controller acts and measures, or the ground")] = GROUND
    start_on_reference: Annotated[bool, About("whether the body starts at the reference's angle and speed")] = True
    name: Annotated[str, About("name of the actuator", examples=["servo"])] = ""

    def applied(self, mechanism: Mechanism, feed_forward: FeedForward | None, until: float) -> Mechanism:
        reference, body = self.reference, self.body or mechanism.input_body
        if reference is None:
            reference = next((drive.motion for drive in mechanism.drives if drive.body == body), None)
        torque = self.feed_forward
        if isinstance(torque, str):
            if self.base != GROUND:
                raise InputError(f"feed_forward = {torque!r} against body '{self.base}'", "a table of torques over time")
            if feed_forward is None:
                raise InputError(f"feed_forward = {torque!r} in a saved run", "a table of torques over time")
            turned = with_rotors(mechanism, [(body, self.inertia)] if body else [])
            with _errors_of_parts(mechanism):
                torque = feed_forward(turned, reference or ConstantSpeed(0.0), until=until, body=self.body)
        return mechanism.controlled(
            self.controller,
            reference=reference,
            body=self.body,
            feed_forward=torque,
            sensor=self.sensor or None,
            inertia=self.inertia,
            start_on_reference=self.start_on_reference,
            base=self.base,
            name=self.name,
        )


_MECHANISM_QUANTITIES = quantities(Mechanism)  # unit, bounds and help text of each numeric field of `Mechanism`, by name


class StructureTable(Table):
    """Base of the tables [structure], one class for each kind of structure."""

    bars: Annotated[Any, ALL_BARS, About("section and material of all straight bars, which bend", examples=[BARS_EXAMPLE])] = (
        None
    )
    source: Annotated[
        str | None,
        About(
            "publication about the structure, for `scissordyn cite`", examples=["Li, Wang 2020, doi:10.1177/1369433220971728"]
        ),
    ] = None

    @abstractmethod
    def fields(self) -> dict[str, Any]:
        """Return the fields of `Mechanism` that the structure determines."""


class MechanismTable(StructureTable):
    """Structure of kind "mechanism": its parts are in the other tables of the file."""

    kind: Annotated[
        Literal["mechanism"],
        About("the parts of the tables [[body]], [[joint]], ... below", examples=["mechanism"]),
    ]
    gravity: Annotated[float, _MECHANISM_QUANTITIES["gravity"]] = Mechanism.gravity
    gravity_direction: Annotated[float, _MECHANISM_QUANTITIES["gravity_direction"]] = Mechanism.gravity_direction
    input_body: Annotated[str, About("the driven body of a [drive] without `body`", examples=["crank"])] = ""
    output_body: Annotated[str, About("the output body", examples=["slider"])] = ""

    def fields(self) -> dict[str, Any]:
        """Return gravity and the names of the input and output bodies."""
        values = {name: getattr(self, name) for name in type(self).declared_keys() if name not in ("kind", "bars")}
        return {**values, "source": self.source or ""}


class BuiltTable(Call, StructureTable):
    """Structure whose keys are the arguments of a function that builds a mechanism."""

    def fields(self) -> dict[str, Any]:
        mechanism = self.result()
        built = {name: getattr(mechanism, name) for name in declared(Mechanism)}
        return {**built, "source": self.source or ""}


def _built(kind: str, builder: Callable[..., Mechanism], help: str, **examples: Any) -> type[StructureTable]:
    """Return the table class of a kind of structure from its builder function, whose arguments all have defaults."""
    named: Any = Annotated[Literal[kind], About(help, [kind])]
    base = make_table(f"{builder.__name__}_kind", BuiltTable, {"kind": (named, dataclasses.MISSING)})
    table: Any = table_of(builder, (), base_table=base, **examples)
    return table  # type: ignore[no-any-return]


# Classes of the table [structure], one for each kind of structure
_STRUCTURE_TABLES = (
    _built("scissor", scissor, "a straight array of scissor units"),
    _built("polar", polar_scissor, "an array that curves"),
    _built("ring", hoberman_ring, "a closed ring of angulated units that opens and closes"),
    _built("mast", mast, "an array on a base that extends upwards"),
    _built("slider-crank", slider_crank, "a crank, a rod and a slider"),
    _built("four-bar", four_bar, "a four-bar linkage", coupler_point="90, 60 mm"),
    _built("n-four-bar", n_four_bar, "parallelograms side by side"),
    MechanismTable,
)

# Classes of the table [structure], by the word for the kind of structure in a case file
STRUCTURES: Mapping[str, type[StructureTable]] = {table.declared_keys()["kind"].words[0]: table for table in _STRUCTURE_TABLES}


def _read_kind(given: Any, _: Context) -> str:
    if not isinstance(given, str) or given not in STRUCTURES:
        raise InputError(
            f"unknown kind of structure{did_you_mean(given, STRUCTURES)}", ", ".join(STRUCTURES), 'kind = "scissor"'
        )
    return str(given)


class _Kind(Table):
    kind: Annotated[
        str, Reader(_read_kind, lambda: {"enum": list(STRUCTURES)}), About("what kind of structure", examples=["scissor"])
    ]


@reader(lambda: {"anyOf": list(STRUCTURES.values())})
def _read(given: Any, context: Context) -> StructureTable:
    # read the kind first, because it determines the other keys
    alone = {key: value for key, value in given.items() if key == "kind"} if isinstance(given, Mapping) else given
    return STRUCTURES[_Kind.read(alone, context).kind].read(given, context)


STRUCTURE = _read  # reader of the table [structure] of a case file
