"""Templates: case files with a comment on every key, generated from the table classes."""

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
)
from scissordyn.casefile.table import Table, table_of, toml, toml_entries
from scissordyn.casefile.time_function import DriveTable
from scissordyn.config.file import LAW_KEYS, apply_changes, make_case
from scissordyn.config.fitted import LOAD_TABLES, Given, fit_parts
from scissordyn.errors import InputError, command, did_you_mean
from scissordyn.laws.catalogue import law
from scissordyn.model.body import Body
from scissordyn.model.commanded import rigid
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.options import AUTO, Options

TEMPLATE_VALUES: Mapping[str, Mapping[str, Any]] = {
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
"""Values of the tables in a template, by kind of structure and table; parts such as [[body]] have a list of tables."""

DEPLOYMENT_TURNS: Mapping[str, float] = {
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
"""Rotation of the driven body from rest to rest [rad], by kind of structure; its sign extends an array."""

REST_VALUES: Mapping[str, Mapping[str, Any]] = {"n-four-bar": {"speed": "0 m/s"}}
"""Values of [structure] with which a structure starts at rest, for structures that do not by default."""


RUN_TABLE = table_of(Options, until="50 ms", atol=1e-8, step="0.1 ms")  # table [run] with the values that a template shows

OPTIONAL_KEYS: Mapping[type[Table], tuple[str, ...]] = {
    DriveTable: tuple(DriveTable.declared_keys()),
    ControlTable: tuple(ControlTable.declared_keys()),
    ClearanceTable: ("bearing_material", "lubrication", "wear", "bush", "contour", "journal_wear", "journal_contour"),
    RUN_TABLE: ("atol", "step"),
    **{
        table: tuple(key for key, field in table.declared_keys().items() if field.default is None)
        for table in STRUCTURES.values()
    },
    **{
        part.table: tuple(key for key, field in part.table.declared_keys().items() if not field.required)
        for part in PARTS.values()
    },
}
"""Keys that a template shows as comments, by table: alternatives to other keys, and keys whose absence has a meaning."""

# Comment in a template above its table [[control]]
SERVO_GAINS_COMMENT = """\
# Gains of a servo: with the inertia J about the driven body (scissordyn check prints it), the error of its angle decays with
# the natural frequency w and damping ratio z for proportional = J w^2 and derivative = 2 z J w; here z = 0.7, and w is six
# oscillations in the time of the move.
# The limit is half as much again as the ideal mechanism needs for the move."""


def template(kind: str, parts: Iterable[str] = (), changes: Iterable[str] = ()) -> str:
    """Return the text of a template: a case file with every key, its value and a comment on its meaning."""
    if kind not in STRUCTURES:
        raise InputError(
            f"unknown kind of structure '{kind}'{did_you_mean(kind, STRUCTURES)}",
            ", ".join(STRUCTURES),
            "scissordyn new scissor > case.toml",
        )
    starter, names, ordered = TEMPLATE_VALUES[kind], list(parts), _Changes(changes)
    structure = ordered("structure", {**starter.get("structure", {}), **(REST_VALUES.get(kind, {}) if names else {})})
    further = fit_parts(mechanism := _assemble(kind, structure), _turn(kind, mechanism), names, ordered) if names else {}
    drive = further.get("drive") if names else starter.get("drive")
    text = ["# A case for scissordyn. Numbers carry their units; names of laws and materials: scissordyn laws"]
    text.append(_section("[structure]", STRUCTURES[kind], structure))
    for name in PARTS:
        # the first table shows every key, the others only the given keys
        for number, values in enumerate(starter.get(name, [])):
            table = [f"[[{name}]]", *toml_entries(values)]
            text.append("\n".join(table) if number else _section(table[0], PARTS[name].table, values))
    if drive is not None:
        text.append(_section("[drive]", DriveTable, drive if names else ordered("drive", drive)))
    if "control" in further:
        text.append(f"{SERVO_GAINS_COMMENT}\n{_section('[[control]]', ControlTable, further['control'])}")
    text.append(_section("[[clearance]]", ClearanceTable, _clearance(ordered, starter.get("clearance", {}))))
    if kind in ("mechanism", "slider-crank"):
        text.append(_section("[[guide_clearance]]", GuideClearanceTable, {}, commented_out=True))
    text += [
        _section(f"[[{name}]]", PARTS[name].table, further.get(name, {}), commented_out=name not in further)
        for name in ("weld", "track", "coupling", "coordinate_drive", *COMPONENT_SECTIONS, "component")
        if kind == "mechanism" or name in further
    ]
    text += [
        _section(f"[[{name}]]", table, further.get(name, {}), commented_out=name not in further)
        for name, table in LOAD_TABLES.items()
    ]
    bent = {"start": "static"} if names and structure.get("bars") and _assemble(kind, structure).gravity else {}
    # flexible bars start in static equilibrium
    run = ordered("run", {"samples": AUTO, **starter.get("run", {}), **further.get("run", {}), **bent})
    text.append(_section("[run]", RUN_TABLE, run))
    ordered.check()
    if kind != "mechanism":
        text.append(
            f"# Springs, loads, motors, stops, latches that fit: scissordyn new {command(kind)} --with servo,latch\n"
            "# Further bodies, joints and guides: scissordyn new mechanism shows their tables."
        )
    written = "\n\n".join(text) + "\n"
    if ordered.any:  # check that the changed file can be read
        make_case(tomllib.loads(written), {})
    return written


def _turn(kind: str, mechanism: Mechanism) -> float:
    """Return the rotation of the driven body [rad]; a scissor array stops before it is straight."""
    turn, start = DEPLOYMENT_TURNS[kind], mechanism.body(mechanism.input_body).placed_angle
    return -math.copysign(min(-turn, 0.75 * abs(start)), start) if kind == "scissor" and start else turn


def _clearance(ordered: _Changes, given: Given) -> Given:
    """Return the values of [[clearance]] with the user's changes; None for a restitution that the damping law does not have."""
    shown = {key: tomllib.loads(f"law = {ClearanceTable.declared_keys()[key].sample}")["law"] for key in LAW_KEYS}
    values = dict(ordered("clearance", {**shown, **given}))
    damping = values["damping"].get("law", "") if isinstance(values["damping"], Mapping) else values["damping"]
    parameters = {field.name for field in dataclasses.fields(law("damping", damping))}
    if "restitution" not in parameters and "restitution" not in values:
        values["restitution"] = None
    return values


class _Changes:
    """Values of a template that the user changed with ``--set``, by table."""

    def __init__(self, changes: Iterable[str]) -> None:
        self._asked: dict[str, list[str]] = {}
        for change in changes:
            self._asked.setdefault(change.split(".")[0].strip(), []).append(change)
        self._sections: list[str] = []
        self.any = bool(self._asked)

    def __call__(self, section: str, given: Given) -> Given:
        """Return the values of a table with the user's changes."""
        self._sections.append(section)
        section_values: Given = apply_changes({section: dict(given)}, self._asked.get(section, ()))[section]
        return section_values

    def check(self) -> None:
        """Raise `InputError` for a change in a table that the template does not have."""
        for section, changes in self._asked.items():
            if section not in self._sections:
                near = did_you_mean(section, self._sections)
                raise InputError(f"--set {changes[0]!r}: the file has no [{section}]{near}", ", ".join(self._sections))


def _assemble(kind: str, structure: Given) -> Mechanism:
    """Return the mechanism of a template without clearance and additional parts; `structure` has the keys of [structure]."""
    parts = {name: values for name, values in TEMPLATE_VALUES[kind].items() if name in PARTS}
    tables = {"structure": {"kind": kind, **structure}, **parts, "run": {"until": "1 s"}}
    mechanism = make_case(tables, {}).mechanism
    if structure.get("bars") is None:
        return mechanism
    # additional parts are fitted to rigid bars with the same names and masses, because tables refer to these names
    unbent = {**tables, "structure": {"kind": kind, **{key: value for key, value in structure.items() if key != "bars"}}}
    bare = make_case(unbent, {}).mechanism
    return dataclasses.replace(bare, bodies=tuple(_with_mass_of(body, rigid(mechanism).bodies) for body in bare.bodies))


def _with_mass_of(bar: Body, parts: Iterable[Body]) -> Body:
    """Return a straight uniform bar with the total mass of `parts`."""
    mass = sum(part.mass for part in parts if part.name == bar.name or part.name.startswith(f"{bar.name}/"))
    inertia = None if bar.inertia is None else bar.inertia * mass / bar.mass
    return dataclasses.replace(bar, mass=mass, inertia=inertia)


def _section(heading: str, table: type[Table], given: Given, *, commented_out: bool = False, columns: int = 44) -> str:
    """Return the text of a table with a comment on every key; with `commented_out`, each line is a comment.

    A key whose value is None is a comment too. `columns`: [characters] longer lines have their comment in the line above.
    """
    name, keys = heading.strip("[]"), table.declared_keys()
    for key in given:
        if key not in keys:
            raise InputError(f"{name}: unknown key '{key}'{did_you_mean(key, keys)}", ", ".join(keys))
    meaning = PARTS[name].help if name in PARTS else CaseTable.declared_keys()[name].description
    rows = []
    for key in table.declared_keys():
        value = table.declared_keys()[key].sample if given.get(key) is None else toml(given[key])
        left_out = given[key] is None if key in given else key in OPTIONAL_KEYS.get(table, ())
        comment = commented_out or left_out
        rows.append((f"{'# ' * comment}{key} = {value}", _note(table, key)))
    heading = f"# {heading}" if commented_out else heading
    width = max(len(row) for row, _ in rows if len(row) <= columns)
    lines = [f"{row:{width}}  # {note}" if len(row) <= columns else f"# {note}\n{row}" for row, note in rows]
    return "\n".join((f"{heading:{width}}  # {meaning}", *lines))


def _note(table: type[Table], key: str) -> str:
    """Return the comment on a key: its description and its bounds."""
    declared = table.declared_keys()[key]
    quantity = declared.quantity
    bounds = quantity.bounds if quantity else ""
    choices = "" if key == "kind" else " or ".join(map(toml, declared.words))
    allowed = choices if choices and choices.split(" ")[0] not in declared.help else bounds
    # skip bounds that only name the unit, because the value shows the unit
    return declared.help + (f", {allowed}" if allowed and not allowed.startswith("[") else "")
