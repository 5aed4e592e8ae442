"""A commented case file as a starting point, from the declarations of the tables."""

from __future__ import annotations

import dataclasses
import math
import tomllib
from collections.abc import Iterable, Mapping
from typing import Any

from scissordyn.casefile.case import CaseTable
from scissordyn.casefile.part import COMPONENT_SECTIONS, PARTS
from scissordyn.casefile.structure import (
    STRUCTURES,
    ClearanceTable,
    ControlTable,
    GuideClearanceTable,
    PanelsTable,
    PayloadTable,
)
from scissordyn.casefile.table import Table, table_of, toml, toml_entries
from scissordyn.casefile.time_function import DriveTable
from scissordyn.config.file import case_of, changed
from scissordyn.config.fitted import Given, fitted
from scissordyn.errors import InputError, command, did_you_mean
from scissordyn.model.body import Body
from scissordyn.model.commanded import rigid
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.options import AUTO, Options

STARTERS: Mapping[str, Mapping[str, Any]] = {
    "scissor": {"structure": {"angle": "60 deg"}, "drive": {"speed": "-150 rpm"}},
    "polar": {"drive": {"speed": "30 rpm"}},
    "ring": {"drive": {"speed": "-20 rpm"}, "clearance": {"joint": "unit 1/*", "clearance": "0.1 mm"}},
    "mast": {"drive": {"speed": "20 rpm"}, "clearance": {"joint": "unit 1/*", "clearance": "0.1 mm"}},
    "slider-crank": {"drive": {"speed": "5000 rpm"}, "clearance": {"joint": "slider pin"}, "run": {"until": "12 ms"}},
    "four-bar": {"drive": {"speed": "300 rpm"}, "clearance": {"joint": "rocker pin", "clearance": "0.2 mm"}},
    "n-four-bar": {"clearance": {"joint": "B1 1", "clearance": "0.1 mm"}},
    "mechanism": {
        "structure": {"input_body": "crank", "output_body": "slider"},
        "ground": [{"name": "O", "position": "0, 0 m"}],
        "body": [
            {"name": "crank", "mass": "0.3 kg", "length": "50 mm", "position": "0, 0 m", "angle": "90 deg"},
            {"name": "rod", "mass": "0.2 kg", "length": "130 mm", "position": "0, 50 mm", "angle": "-22.619864948 deg"},
            {"name": "slider", "mass": "0.15 kg", "points": {"centre": "0, 0 m"}, "position": "120, 0 mm"},
        ],
        "joint": [
            {"name": "crank bearing", "journal": "crank.start", "bearing": "ground.O"},
            {"name": "crank pin", "journal": "crank.end", "bearing": "rod.start"},
            {"name": "slider pin", "journal": "rod.end", "bearing": "slider.centre"},
        ],
        "guide": [{"name": "guide", "follower": "slider.centre", "direction": "0 deg"}],
        "drive": {"speed": "300 rpm"},
        "clearance": {"joint": "slider pin", "clearance": "0.1 mm"},
    },
}
"""By structure: values of the keys of each section, a list of tables for the parts."""

TURNS: Mapping[str, float] = {
    kind: math.radians(degrees)
    for kind, degrees in {
        "scissor": -45.0,
        "polar": 8.0,
        "ring": -15.0,
        "mast": 30.0,
        "slider-crank": 90.0,
        "four-bar": 90.0,
        "n-four-bar": -45.0,
        "mechanism": -60.0,
    }.items()
}
"""By structure: how far its driven body turns in a move from rest to rest [rad]; arrays extend by it."""

AT_REST: Mapping[str, Mapping[str, Any]] = {"n-four-bar": {"speed": "0 m/s"}}
"""By structure: values of [structure] with which it starts at rest, if it does not by itself."""


LOADS: Mapping[str, type[Table]] = {"payload": PayloadTable, "panels": PanelsTable}

WIDE = 44  # Longer values have their comment on the line above
RUN = table_of(Options, until="50 ms", step="0.1 ms")  # The table of the options of a run

OPTIONAL: Mapping[type[Table], tuple[str, ...]] = {
    DriveTable: tuple(DriveTable.declared_keys()),
    ControlTable: tuple(ControlTable.declared_keys()),
    ClearanceTable: ("bearing_material", "lubrication"),
    RUN: ("step",),
    **{
        table: tuple(key for key, field in table.declared_keys().items() if field.default is None)
        for table in STRUCTURES.values()
    },
    **{
        part.table: tuple(key for key, field in part.table.declared_keys().items() if not field.required)
        for part in PARTS.values()
    },
}
"""Keys that are shown as comments unless given: they are alternatives of other keys, or have a meaning if absent."""

GAINS = """\
# Gains of a servo: with the inertia J about the driven body (scissordyn check prints it), the error of its angle decays with
# the natural frequency w and damping ratio z for proportional = J w^2 and derivative = 2 z J w; here z = 0.7, and w is six
# oscillations in the time of the move.
# The limit is half as much again as the ideal mechanism needs for the move."""


def template(kind: str, parts: Iterable[str] = (), changes: Iterable[str] = ()) -> str:
    """A case file with every key, its value and its meaning."""
    if kind not in STRUCTURES:
        raise InputError(
            f"structure '{kind}'{did_you_mean(kind, STRUCTURES)}", ", ".join(STRUCTURES), "scissordyn new scissor > case.toml"
        )
    starter, names, ordered = STARTERS[kind], list(parts), _Changes(changes)
    structure = ordered("structure", {**starter.get("structure", {}), **(AT_REST.get(kind, {}) if names else {})})
    further = fitted(_assembled(kind, structure), TURNS[kind], names, ordered) if names else {}
    drive = further.get("drive") if names else starter.get("drive")
    text = ["# A case for scissordyn. Numbers carry their units; names of laws and materials: scissordyn laws"]
    text.append(_section("[structure]", STRUCTURES[kind], structure))
    for name in PARTS:
        for number, values in enumerate(starter.get(name, [])):  # the first with every key, the others with those given
            table = [f"[[{name}]]", *toml_entries(values)]
            text.append("\n".join(table) if number else _section(table[0], PARTS[name].table, values))
    if drive is not None:
        text.append(_section("[drive]", DriveTable, drive if names else ordered("drive", drive)))
    if "control" in further:
        text.append(f"{GAINS}\n{_section('[[control]]', ControlTable, further['control'])}")
    text.append(_section("[[clearance]]", ClearanceTable, ordered("clearance", starter.get("clearance", {}))))
    if kind in ("mechanism", "slider-crank"):
        text.append(_section("[[guide_clearance]]", GuideClearanceTable, {}, out=True))
    text += [
        _section(f"[[{name}]]", PARTS[name].table, further.get(name, {}), out=name not in further)
        for name in ("weld", "track", "coupling", "coordinate_drive", *COMPONENT_SECTIONS, "component")
        if kind == "mechanism" or name in further
    ]
    text += [_section(f"[[{name}]]", table, further.get(name, {}), out=name not in further) for name, table in LOADS.items()]
    bent = {"start": "static"} if names and structure.get("bars") and _assembled(kind, structure).gravity else {}
    # a move from rest of bars that their weight bends begins in equilibrium
    run = ordered("run", {"samples": AUTO, **starter.get("run", {}), **further.get("run", {}), **bent})
    text.append(_section("[run]", RUN, run))
    ordered.check()
    if kind != "mechanism":
        text.append(
            f"# Springs, loads, motors, stops, latches that fit: scissordyn new {command(kind)} --with servo,latch\n"
            "# Further bodies, joints and guides: scissordyn new mechanism shows their tables."
        )
    written = "\n\n".join(text) + "\n"
    if ordered.any:  # what is changed is read as the user will read it
        case_of(tomllib.loads(written), {})
    return written


class _Changes:
    """What a user asks for beside the parts: values of sections."""

    def __init__(self, changes: Iterable[str]) -> None:
        self._asked: dict[str, list[str]] = {}
        for change in changes:
            self._asked.setdefault(change.split(".")[0].strip(), []).append(change)
        self._sections: list[str] = []
        self.any = bool(self._asked)

    def __call__(self, section: str, given: Given) -> Given:
        """The values of a section with those that are asked for."""
        self._sections.append(section)
        section_values: Given = changed({section: dict(given)}, self._asked.get(section, ()))[section]
        return section_values

    def check(self) -> None:
        """Raise `InputError` for a section that the file does not have."""
        for section, changes in self._asked.items():
            if section not in self._sections:
                near = did_you_mean(section, self._sections)
                raise InputError(f"--set {changes[0]!r} of a file without [{section}]{near}", ", ".join(self._sections))


def _assembled(kind: str, structure: Given) -> Mechanism:
    """The mechanism of the tables that a starter gives, without clearance."""
    parts = {name: values for name, values in STARTERS[kind].items() if name in PARTS}
    tables = {"structure": {"kind": kind, **structure}, **parts, "run": {"until": "1 s"}}
    mechanism = case_of(tables, {}).mechanism
    if structure.get("bars") is None:
        return mechanism
    # parts are fitted to rigid bars of the same names and masses, as tables refer to those
    unbent = {**tables, "structure": {"kind": kind, **{key: value for key, value in structure.items() if key != "bars"}}}
    bare = case_of(unbent, {}).mechanism
    return dataclasses.replace(bare, bodies=tuple(_as_heavy(body, rigid(mechanism).bodies) for body in bare.bodies))


def _as_heavy(bar: Body, parts: Iterable[Body]) -> Body:
    """A uniform bar with the mass of its parts."""
    mass = sum(part.mass for part in parts if part.name == bar.name or part.name.startswith(f"{bar.name}/"))
    inertia = None if bar.inertia is None else bar.inertia * mass / bar.mass
    return dataclasses.replace(bar, mass=mass, inertia=inertia)


def _section(heading: str, table: type[Table], given: Given, *, out: bool = False) -> str:
    """One table with a comment on every line; `out` makes all of it a comment."""
    name, keys = heading.strip("[]"), table.declared_keys()
    for key in given:
        if key not in keys:
            raise InputError(f"{name}: unknown key '{key}'{did_you_mean(key, keys)}", ", ".join(keys))
    meaning = PARTS[name].help if name in PARTS else CaseTable.declared_keys()[name].description
    rows = []
    for key in table.declared_keys():
        value = toml(given[key]) if key in given else table.declared_keys()[key].sample
        comment = out or (key not in given and key in OPTIONAL.get(table, ()))
        rows.append((f"{'# ' * comment}{key} = {value}", _note(table, key)))
    heading = f"# {heading}" if out else heading
    width = max(len(row) for row, _ in rows if len(row) <= WIDE)
    lines = [f"{row:{width}}  # {note}" if len(row) <= WIDE else f"# {note}\n{row}" for row, note in rows]
    return "\n".join((f"{heading:{width}}  # {meaning}", *lines))


def _note(table: type[Table], key: str) -> str:
    """Description of a key, with its bounds."""
    declared = table.declared_keys()[key]
    quantity = declared.quantity
    bounds = quantity.allowed.removeprefix("a finite number").strip() if quantity else ""
    choices = "" if key == "kind" else " or ".join(map(toml, declared.words))
    allowed = choices if choices and choices.split(" ")[0] not in declared.help else bounds
    # without a unit alone: the value beside it has one
    return declared.help + (f", {allowed}" if allowed and not allowed.startswith("[") else "")
