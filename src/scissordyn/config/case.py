"""A whole case file, which a user writes or a run carries, and the mechanism and options that it describes."""

from __future__ import annotations

import dataclasses
import tomllib
from collections.abc import Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any

from scissordyn.config.code import AbsentCode, AbsentPart, AllowedCode, Code
from scissordyn.config.part import PARTS, assembled
from scissordyn.config.structure import (
    STRUCTURE,
    BendingTable,
    ClearanceTable,
    ControlTable,
    GuideClearanceTable,
    JointFrictionTable,
    PanelsTable,
    PayloadTable,
    StructureTable,
)
from scissordyn.config.table import About, Context, Reader, Table, described, instance, made_table, placed, read_list, reader
from scissordyn.config.time_function import DriveTable
from scissordyn.errors import InputError
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.options import Options
from scissordyn.run.configuration import Configuration


@dataclasses.dataclass(frozen=True)
class Case:
    """A mechanism and the options of its simulation.

    Parameters
    ----------
    mechanism : Mechanism
    run : Options
    """

    mechanism: Mechanism
    run: Options


def _one_or_several(table: type[Table]) -> Reader:
    """One table, or a list of them."""

    @reader(lambda: {"anyOf": [table, {"type": "array", "items": table}]})
    def read(given: Any, context: Context) -> list[Table]:
        return read_list(given, table, context) if isinstance(given, list) else [table.read(given, context)]

    return read


@reader(lambda: {"type": "object", "additionalProperties": {"type": ["string", "number", "boolean"]}})
def _read_values(given: Any, _: Context) -> Mapping[str, Any]:
    if not isinstance(given, Mapping) or not all(isinstance(value, str | int | float) for value in given.values()):
        raise InputError("not a table of texts and numbers", "what scissordyn writes there")
    return MappingProxyType(dict(given))


ADDITIONS = (
    *("panels", "bending", "payload", "clearance", "guide_clearance"),
    *("joint_friction", "drive", "control", "coupling"),
)
"""Tables that add to the mechanism of the structure and the parts, in their order: a later one replaces an earlier one."""


class _CaseTable(Table):
    """A whole case file, apart from the components."""

    structure: Annotated[StructureTable, STRUCTURE, About("the structure", examples=[{"kind": "scissor"}])]
    drive: Annotated[Sequence[DriveTable], _one_or_several(DriveTable), About("a drive; [[drive]] for several")] = ()
    control: Annotated[
        Sequence[ControlTable],
        _one_or_several(ControlTable),
        About("a controlled torque in place of a drive; [[control]] for several"),
    ] = ()
    code: Annotated[
        Mapping[str, Any], _read_values, About("digests of the files of your own that the case was written with")
    ] = MappingProxyType({})
    run: Annotated[
        Options,
        described(Options, until="50 ms", step="0.1 ms"),
        About("options of the simulation", examples=[{"until": "50 ms"}]),
    ]

    def case(self) -> Case:
        return Case(self.mechanism(), self.run)

    def mechanism(self) -> Mechanism:
        """The mechanism of the file; an `InputError` with the place in the file if its tables are inconsistent."""
        with placed("structure"):
            base = self.structure.fields()
        parts = {name: getattr(self, name) for name in PARTS}
        mechanism = assembled(base, parts | {"coupling": [table.result() for table in self.coupling]})
        for section in ADDITIONS:
            for index, table in enumerate(tables := getattr(self, section)):
                with placed(section, index):
                    mechanism = self._added(mechanism, section, table, tables[:index])
            if section == "panels" and self.structure.bars is not None:
                with placed("structure"):
                    mechanism = self.structure.bars.result(mechanism)
        return mechanism

    def _added(self, mechanism: Mechanism, section: str, table: Any, before: Sequence[Any]) -> Mechanism:
        """The mechanism with what one table adds to it."""
        match section:
            case "clearance" if table.joint in [earlier.joint for earlier in before]:
                raise InputError(f"joint '{table.joint}' given twice", "one [[clearance]] for each joint")
            case "clearance":
                return mechanism.with_clearance(table.joint, table.result())
            case "guide_clearance":
                return mechanism.with_clearance(table.guide, table.result())
            case "drive":
                body = table.body or mechanism.input_body
                if body in [drive.body for drive in mechanism.drives]:
                    raise InputError(f"body '{body}' driven twice", "one drive for each body")
                return mechanism.driven(table.motion(), body=table.body)
            case "control":
                return table.applied(mechanism, until=self.run.until if self.run else 0.0)  # type: ignore[no-any-return]
            case "coupling" if table.backlash is None:
                return mechanism
            case "coupling":
                return table.backlash.result(mechanism, table.name)  # type: ignore[no-any-return]
        return table.result(mechanism)  # type: ignore[no-any-return]


LISTS: Mapping[str, tuple[Reader, str]] = {
    "clearance": (ClearanceTable.reader(), "a clearance joint; one table for each"),
    "guide_clearance": (GuideClearanceTable.reader(), "a clearance guide; one table for each"),
    **{section: (part.reader, part.help) for section, part in PARTS.items()},
    "payload": (PayloadTable.reader(), "a mass fixed to a body; one table for each"),
    "panels": (PanelsTable.reader(), "a panel on each of some bars"),
    "bending": (BendingTable.reader(), "bars that bend; one table for each kind"),
    "joint_friction": (JointFrictionTable.reader(), "friction in many ideal pins; a later table replaces"),
}
"""Lists of tables: how each is read, and what it is."""

CaseTable = made_table(
    "CaseTable",
    _CaseTable,
    {key: (Annotated[Sequence[Annotated[Any, read]], About(about)], ()) for key, (read, about) in LISTS.items()},
)


RecordTable = made_table(
    "RecordTable",
    CaseTable,
    {
        "run": (Annotated[Options | None, CaseTable.declared_keys()["run"].reader], None),
        "diagram": (Annotated[Mapping[str, Any], _read_values], MappingProxyType({})),
    },
)
"""What a run carries: a case file without [run] perhaps, and with further entries of a diagram."""


WRITTEN = "a Dataset that scissordyn made"

NOT_WRITTEN = {"control", "payload", "panels", "bending", "joint_friction"}
"""Tables that are computed with; a run has the bodies and components that they make."""


@lru_cache(maxsize=16)
def read_facts(text: str) -> Configuration:
    """What a run says of itself; nothing is executed."""
    return _read(text, lambda digests: AbsentCode(None, digests))


def read_record(text: str, allow_code: Sequence[Path] = ()) -> Configuration:
    """What a run says of itself, with its parts of classes of the user's in files that may be executed."""
    return _read(text, lambda digests: AllowedCode(allow_code, digests))


def _read(text: str, code: Any) -> Configuration:
    if not text.strip():
        raise InputError("an empty attribute 'configuration'", WRITTEN)
    if text.startswith("{"):
        raise InputError(
            "a mechanism in JSON, which an earlier version of scissordyn wrote",
            f"{WRITTEN}, or that version: git checkout d1bea37c",
        )
    try:
        tree = tomllib.loads(text)
        for section in NOT_WRITTEN & tree.keys():
            raise InputError(f"[[{section}]] in a run", "the tables that scissordyn writes there")
        digests = tree.get("code", {})
        chosen: Code = code(digests if isinstance(digests, dict) else {})
        table = instance(RecordTable, tree, {"code": chosen})
        absent = tuple(part for part in table.component if isinstance(part, AbsentPart))
        return Configuration(text, table.mechanism(), table.run, table.diagram, absent)
    except (ValueError, RecursionError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"the attribute 'configuration' is not whole TOML: {error}", WRITTEN) from None
