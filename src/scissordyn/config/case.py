"""The tables of a case file and their description as a mechanism and options."""

from __future__ import annotations

import dataclasses
from typing import Annotated, Any

from pydantic import Field, PlainValidator, TypeAdapter, ValidationInfo, create_model

from scissordyn.component.place import Point
from scissordyn.config.bending import BendingTable
from scissordyn.config.clearance import ClearanceTable, GuideClearanceTable
from scissordyn.config.control import ControlTable
from scissordyn.config.part import COMPONENT_SECTIONS, PARTS, assembled
from scissordyn.config.payload import PanelsTable, PayloadTable
from scissordyn.config.shape import accepting
from scissordyn.config.structure import STRUCTURE, StructureTable
from scissordyn.config.table import Table, described, placed
from scissordyn.config.time_function import DriveTable
from scissordyn.errors import InputError
from scissordyn.model.body import Body
from scissordyn.model.connection import Weld
from scissordyn.model.joint import Guide, Revolute
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.track import Track
from scissordyn.run.options import Options


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


_DRIVES = TypeAdapter(list[DriveTable])
_CONTROLS = TypeAdapter(list[ControlTable])


@accepting(lambda: {"anyOf": [DriveTable, {"type": "array", "items": DriveTable}]})
def _read_drives(given: Any, info: ValidationInfo) -> list[DriveTable]:
    """One drive as a table, several as a list of tables."""
    if isinstance(given, list):
        return _DRIVES.validate_python(given, context=info.context)
    return [DriveTable.model_validate(given, context=info.context)]


@accepting(lambda: {"anyOf": [ControlTable, {"type": "array", "items": ControlTable}]})
def _read_controls(given: Any, info: ValidationInfo) -> list[ControlTable]:
    """One controller as a table, several as a list of tables."""
    if isinstance(given, list):
        return _CONTROLS.validate_python(given, context=info.context)
    return [ControlTable.model_validate(given, context=info.context)]


def _listed(description: str | None = None) -> Any:
    return Field(description=description, default_factory=list)


class _CaseTable(Table):
    """A whole case file, apart from the components."""

    structure: Annotated[
        StructureTable, STRUCTURE, Field(description="the structure", examples=[{"kind": "scissor"}], validate_default=True)
    ]
    drive: Annotated[
        list[DriveTable],
        PlainValidator(_read_drives),
        Field(description="a drive; [[drive]] for several", default_factory=list),
    ]
    control: Annotated[
        list[ControlTable],
        PlainValidator(_read_controls),
        Field(description="a controlled torque in place of a drive; [[control]] for several", default_factory=list),
    ]
    clearance: list[Annotated[Any, ClearanceTable.reader()]] = _listed("a clearance joint; one table for each")
    guide_clearance: list[Annotated[Any, GuideClearanceTable.reader()]] = _listed("a clearance guide; one table for each")
    body: list[Annotated[Body, PARTS["body"].reader]] = _listed()
    ground: list[Annotated[tuple[str, Point], PARTS["ground"].reader]] = _listed()
    joint: list[Annotated[Revolute, PARTS["joint"].reader]] = _listed()
    guide: list[Annotated[Guide, PARTS["guide"].reader]] = _listed()
    weld: list[Annotated[Weld, PARTS["weld"].reader]] = _listed()
    track: list[Annotated[Track, PARTS["track"].reader]] = _listed()
    payload: list[Annotated[Any, PayloadTable.reader()]] = _listed("a mass fixed to a body; one table for each")
    panels: list[Annotated[Any, PanelsTable.reader()]] = _listed("a panel on each of some bars")
    bending: list[Annotated[Any, BendingTable.reader()]] = _listed("bars that bend; one table for each kind")
    run: Annotated[
        Options,
        described(Options, until="50 ms", step="0.1 ms"),
        Field(description="options of the simulation", examples=[{"until": "50 ms"}]),
    ]

    def case(self) -> Case:
        """The case of the file; an `InputError` with the place in the file if its tables are inconsistent."""
        with placed("structure"):
            base = self.structure.fields()
        mechanism = assembled(base, {name: getattr(self, name) for name in PARTS})
        for section in ("panels", "bending", "payload"):
            for index, change in enumerate(getattr(self, section)):
                with placed(section, index):
                    mechanism = change.result(mechanism)
            if section == "panels" and self.structure.bars is not None:
                with placed("structure"):
                    mechanism = self.structure.bars.result(mechanism)
        mechanism = self._with_clearances(mechanism)
        driven = set[str]()
        for index, table in enumerate(self.drive):
            with placed("drive", index):
                body = table.body or mechanism.input_body
                if body in driven:
                    raise InputError(f"body '{body}' driven twice", "one drive for each body")
                driven.add(body)
                mechanism = mechanism.driven(table.motion(), body=table.body)
        for index, control in enumerate(self.control):
            with placed("control", index):
                mechanism = control.applied(mechanism, until=self.run.until)
        return Case(mechanism, self.run)

    def _with_clearances(self, mechanism: Mechanism) -> Mechanism:
        """The mechanism with every [[clearance]] and [[guide_clearance]], in order: a later table replaces an earlier one."""
        named = set[str]()
        for index, table in enumerate(self.clearance):
            with placed("clearance", index):
                if table.joint in named:
                    raise InputError(f"joint '{table.joint}' given twice", "one [[clearance]] for each joint")
                named.add(table.joint)
                mechanism = mechanism.with_clearance(table.joint, table.described())
        for index, channel in enumerate(self.guide_clearance):
            with placed("guide_clearance", index):
                mechanism = mechanism.with_clearance(channel.guide, channel.described())
        return mechanism


CaseTable: type[_CaseTable] = create_model(
    "CaseTable",
    __base__=_CaseTable,
    **{  # type: ignore[call-overload]
        section: (list[Annotated[Any, PARTS[section].reader]], _listed()) for section in (*COMPONENT_SECTIONS, "component")
    },
)
"""A whole case file."""
