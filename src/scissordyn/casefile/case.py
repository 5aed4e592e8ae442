"""Tables of a whole case file, and the mechanism and options that they describe."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Annotated, Any

from scissordyn.casefile.part import PARTS, assemble
from scissordyn.casefile.structure import (
    STRUCTURE,
    BendingTable,
    ClearanceTable,
    ControlTable,
    FeedForward,
    GuideClearanceTable,
    JointFrictionTable,
    PanelsTable,
    PayloadTable,
    StructureTable,
)
from scissordyn.casefile.table import About, Context, Reader, Table, add_place, dataclass_reader, make_table, read_list, reader
from scissordyn.casefile.time_function import DriveTable
from scissordyn.errors import InputError
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.options import Options
from scissordyn.model.wear import Wear
from scissordyn.warning import LISTED_MAX


@dataclasses.dataclass(frozen=True)
class Case:
    """A mechanism and the options of its simulation.

    Parameters
    ----------
    mechanism : Mechanism
    run : Options
    wear : Wear, optional
        Options of a wear computation over many cycles.
    """

    mechanism: Mechanism
    run: Options
    wear: Wear | None = None


def _one_or_several(table: type[Table]) -> Reader:
    """Return the reader of a key whose value is one table or a list of tables of one kind."""

    @reader(lambda: {"anyOf": [table, {"type": "array", "items": table}]})
    def read(given: Any, context: Context) -> list[Table]:
        return read_list(given, table, context) if isinstance(given, list) else [table.read(given, context)]

    return read


@reader(lambda: {"type": "object", "additionalProperties": {"type": ["string", "number", "boolean"]}})
def read_values(given: Any, _: Context) -> Mapping[str, Any]:
    if not isinstance(given, Mapping) or not all(isinstance(value, str | int | float) for value in given.values()):
        raise InputError("not a table of texts and numbers", "the table as scissordyn wrote it")
    return MappingProxyType(dict(given))


WEAR_READER = dataclass_reader(Wear, tolerance="0.1 um", most_clearance="0.6 mm")  # Reader of the table [wear] of a case file

ADDITIONS = (
    *("panels", "bending", "payload", "clearance", "guide_clearance"),
    *("joint_friction", "drive", "control", "coupling"),
)
"""Names of tables that change the mechanism of [structure] and its parts, in the order in which they are applied."""


def _driven_body(mechanism: Mechanism, body: str) -> str:
    """Return the body that a drive or a controller turns: `body`, or else the structure's input body."""
    chosen = body or mechanism.input_body
    if not chosen:
        names = [part.name for part in mechanism.bodies if part.rotates]
        shown = ", ".join(names[:LISTED_MAX]) + (", ..." if len(names) > LISTED_MAX else "")
        raise InputError(
            "missing key 'body', and [structure] has no input_body",
            f"one of {shown}",
            f'body = "{names[0] if names else "NAME"}"',
        )
    return chosen


class _CaseTable(Table):
    """Whole case file, without the components."""

    structure: Annotated[StructureTable, STRUCTURE, About("the structure", examples=[{"kind": "scissor"}])]
    drive: Annotated[Sequence[DriveTable], _one_or_several(DriveTable), About("a drive; [[drive]] for several")] = ()
    control: Annotated[
        Sequence[ControlTable],
        _one_or_several(ControlTable),
        About("a controlled torque instead of a drive; [[control]] for several"),
    ] = ()
    code: Annotated[Mapping[str, Any], read_values, About("digests of the user's files that the case was written with")] = (
        MappingProxyType({})
    )
    run: Annotated[
        Options,
        dataclass_reader(Options, until="50 ms", step="0.1 ms"),
        About("options of the simulation", examples=[{"until": "50 ms"}]),
    ]

    wear: Annotated[
        Wear | None,
        WEAR_READER,
        About("wear of joints over many cycles", examples=[{"cycles": 10000}]),
    ] = None

    def case(self, feed_forward: FeedForward | None = None) -> Case:
        return Case(self.mechanism(feed_forward), self.run, self.wear)

    def mechanism(self, feed_forward: FeedForward | None = None) -> Mechanism:
        """Return the mechanism of the file; raise `InputError` with the place in the file if its tables are inconsistent.

        `feed_forward` computes the torques of the ideal mechanism that a [control] table requests.
        """
        with add_place("structure"):
            base = self.structure.fields()
        parts = {name: getattr(self, name) for name in PARTS}
        mechanism = assemble(base, parts | {"coupling": [table.result() for table in self.coupling]})
        for section in ADDITIONS:
            for index, table in enumerate(tables := getattr(self, section)):
                with add_place(section, index):
                    mechanism = self._with_addition(mechanism, section, table, tables[:index], feed_forward)
            if section == "panels" and self.structure.bars is not None:
                with add_place("structure", "bars"):
                    mechanism = self.structure.bars.result(mechanism)
        return mechanism

    def _with_addition(
        self, mechanism: Mechanism, section: str, table: Any, before: Sequence[Any], feed_forward: FeedForward | None
    ) -> Mechanism:
        """Return the mechanism with the change that one table of `ADDITIONS` describes."""
        match section:
            case "clearance" if table.joint in [earlier.joint for earlier in before]:
                raise InputError(f"two [[clearance]] tables for joint '{table.joint}'", "one [[clearance]] for each joint")
            case "clearance":
                return mechanism.with_clearance(table.joint, table.result())
            case "guide_clearance":
                return mechanism.with_clearance(table.guide, table.result())
            case "drive":
                body = _driven_body(mechanism, table.body)
                if body in [drive.body for drive in mechanism.drives]:
                    raise InputError(f"two drives or controllers for body '{body}'", "one drive for each body")
                return mechanism.driven(table.motion(), body=table.body)
            case "control":
                _driven_body(mechanism, table.body)
                return table.applied(mechanism, feed_forward, self.run.until if self.run else 0.0)  # type: ignore[no-any-return]
            case "coupling" if table.backlash is None:
                return mechanism
            case "coupling":
                return table.backlash.result(mechanism, table.name)  # type: ignore[no-any-return]
        return table.result(mechanism)  # type: ignore[no-any-return]


REPEATABLE_TABLES: Mapping[str, tuple[Reader, str]] = {
    "clearance": (ClearanceTable.reader(), "a clearance joint; one table for each"),
    "guide_clearance": (GuideClearanceTable.reader(), "a clearance guide; one table for each"),
    **{section: (part.reader, part.help) for section, part in PARTS.items()},
    "payload": (PayloadTable.reader(), "a mass fixed to a body; one table for each"),
    "panels": (PanelsTable.reader(), "a panel on each of some bars"),
    "bending": (BendingTable.reader(), "bars that bend; one table for each kind"),
    "joint_friction": (JointFrictionTable.reader(), "friction in many ideal pins; a later table replaces"),
}
"""Tables that a case file may contain several times: reader of one table, and description."""

CaseTable = make_table(
    "CaseTable",
    _CaseTable,
    {key: (Annotated[Sequence[Annotated[Any, read]], About(about)], ()) for key, (read, about) in REPEATABLE_TABLES.items()},
)
