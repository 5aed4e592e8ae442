"""Write a mechanism and its options as the text of a case file: TOML with units."""

from __future__ import annotations

import dataclasses
import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from scissordyn.casefile.case import Case, CaseTable
from scissordyn.casefile.code import Code, RecordedCode
from scissordyn.casefile.part import COMPONENT_SECTIONS, TRANSMISSIONS, ratio_unit
from scissordyn.casefile.quantity import exact_text
from scissordyn.casefile.table import Context, instance, toml_entries
from scissordyn.casefile.time_function import FUNCTION_QUANTITIES, powers, units_of
from scissordyn.components.place import GROUND, BodyPoint, Point
from scissordyn.components.time_function import (
    ConstantSpeed,
    Cycloidal,
    Harmonic,
    OverTime,
    Polynomial,
    Tabulated,
    TimeFunction,
    Trapezoidal,
)
from scissordyn.control.controller import Controller
from scissordyn.errors import InputError
from scissordyn.laws.catalogue import MATERIALS
from scissordyn.laws.material import Material
from scissordyn.laws.oil import OILS, Oil
from scissordyn.model.addition import without_backlash
from scissordyn.model.body import Body, bar_points, uniform_inertia
from scissordyn.model.coupling import Coordinate, Coupling, Distance, FurtherInput, Slide
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.options import Options
from scissordyn.model.record import first_difference, to_plain
from scissordyn.model.walk import Declared, declared, is_described, non_default_fields
from scissordyn.plugin.element import Part
from scissordyn.units import Pairs

FIRST_LINE = "# A case of scissordyn, written by write_case."
"""First line of a written case file; `write_case` overwrites only files with this line."""

RECORD_FIRST_LINE = "# A case of scissordyn, as it was computed."  # First line of the case file that is stored in a run

CONTROL_CHARACTER = re.compile(r"[\x00-\x1f\x7f]")  # pattern of a character that a TOML comment may not contain

SURROGATE = "[\ud800-\udfff]"  # pattern of half a surrogate pair, which UTF-8 cannot represent

NO_CODE = Code()  # user-defined classes of a case file's table that cannot contain any

Entries = dict[str, Any]  # keys and values of a table as in parsed TOML


def case_text(described: Mechanism | Case, run: Options | None = None, *, folder: Path | None = None) -> str:
    """Return the text of a case file that describes a mechanism exactly; reading the text gives an equal one, bit for bit.

    Each number has the unit in which it is shortest, for example mm, deg or rpm, if the text gives the same number to the last
    bit. Otherwise it has its SI unit and all digits.

    Parameters
    ----------
    described : Mechanism or Case
    run : Options, optional
        Options of the simulation; by default those of the case, or the defaults for 50 ms.
    folder : path, optional
        Folder of the file; names of files with user-defined code are relative to it.

    Returns
    -------
    str
        TOML.

    Raises
    ------
    InputError
        If a part cannot be written, for example a function that is not in a file.
    """
    mechanism = described.mechanism if isinstance(described, Case) else described
    if not isinstance(mechanism, Mechanism):
        raise InputError(
            f"cannot write a {type(mechanism).__name__} as a case", "a Mechanism or a Case", "write_case(arm, 'arm.toml')"
        )
    options = run or (described.run if isinstance(described, Case) else Options(until=0.05))
    wear = described.wear if isinstance(described, Case) else None
    worn = {} if wear is None else {"wear": _fields(wear, NO_CODE)}
    text = "\n".join([FIRST_LINE, *_lines(_tables(mechanism, Code(folder)) | _run(options) | worn), ""])
    if half := re.search(f'"([^"]*{SURROGATE}[^"]*)"', text):
        raise InputError(f"the name {half[1]!r} has half a surrogate pair", "text that UTF-8 can represent")
    _check(text, Case(mechanism, options, wear), {"folder": folder or Path()})
    return text


def record_text(mechanism: Mechanism, options: Options | None = None, further: Mapping[str, Any] | None = None) -> str:
    """Return the text of the case file that a run stores; it may name user-defined classes that no file defines."""
    code = RecordedCode()
    lines = [RECORD_FIRST_LINE, *_lines(_tables(mechanism, code))]
    if mechanism.clearances_closed and mechanism.couplings:  # one of them may follow from joints that are ideal now
        lines += _lines({"ideal": {"clearances_closed": True}})
    if code.noted:
        lines += _lines({"code": code.noted})
        lines += [f"# {CONTROL_CHARACTER.sub('?', line)}" for source in code.sources for line in source.splitlines()]
    lines += _lines(({} if options is None else _run(options)) | ({} if further is None else {"diagram": further}))
    return re.sub(SURROGATE, lambda half: f"\\\\u{ord(half[0]):04x}", "\n".join([*lines, ""]))


def _lines(tree: Mapping[str, Any]) -> Iterator[str]:
    for section, tables in tree.items():
        many = isinstance(tables, list)
        for table in tables if many else [tables]:
            yield from ("", f"[[{section}]]" if many else f"[{section}]", *toml_entries(table))


def _run(options: Options) -> Entries:
    return {"run": {"until": _quantity((options.until,), "s")} | _fields(options, NO_CODE)}


def _tables(mechanism: Mechanism, code: Code) -> Entries:
    """Return all tables except [run], in the order of a case file."""
    fields, structure = declared(Mechanism), {"kind": "mechanism"}
    mechanism, backlashes = without_backlash(mechanism)
    for name in ("gravity", "gravity_direction", "input_body", "output_body", "source"):
        value = getattr(mechanism, name)
        if value not in (None, ""):
            structure[name] = _value(value, fields[name], Mechanism, code)
    parts = {
        "ground": [{"name": name, "position": _quantity(place, "m")} for name, place in mechanism.ground],
        "body": [_body(body, code) for body in mechanism.bodies],
        "joint": [_fields(dataclasses.replace(joint, clearance=None), code) for joint in mechanism.joints],
        "guide": [_fields(dataclasses.replace(guide, clearance=None), code) for guide in mechanism.guides],
        "weld": [_fields(weld, code) for weld in mechanism.welds],
        "track": [_fields(track, code) for track in mechanism.tracks],
        "rod": [_fields(rod, code) for rod in mechanism.rods],
        "latch": [_fields(latch, code) for latch in mechanism.latches],
        "coupling": [_coupling(part, backlashes, code) for part in mechanism.couplings],
        "coordinate_drive": [
            _fields(drive, code) | {"motion": _time_function(drive.motion, drive.coordinate.unit)}
            for drive in mechanism.coordinate_drives
        ],
    }
    loose = [(joint.name, joint.clearance) for joint in mechanism.joints if joint.clearance is not None]
    names = [joint.name for joint in mechanism.joints]
    if len(loose) == len(names) > 1 and "all" not in names and len({repr(clearance) for _, clearance in loose}) == 1:
        loose = [("all", loose[0][1])]
    channels = [(guide.name, guide.clearance) for guide in mechanism.guides if guide.clearance is not None]
    return {
        "structure": structure,
        **parts,
        **_components(mechanism, code),
        "clearance": [{"joint": name, **_fields(gap, code)} for name, gap in loose],
        "guide_clearance": [{"guide": name, **_fields(gap, code)} for name, gap in channels],
        "drive": [{"body": drive.body, **_time_function(drive.motion, "rad")} for drive in mechanism.drives],
    }


def _components(mechanism: Mechanism, code: Code) -> Entries:
    """Return the tables of the components in order: by kind as long as that keeps their order, then as [[component]]."""
    components: tuple[Any, ...] = mechanism.components
    listed: dict[str, list[Entries]] = {section: [] for section in COMPONENT_SECTIONS if section not in ("rod", "latch")}
    order, others, last = list(listed), list[Entries](), 0
    for part in components:
        section, ours = part.declaration.section, type(part).__module__.startswith("scissordyn.")
        entries = _fields(part, code)
        if ours and not others and section in order[last:]:
            listed[section].append(entries)
            last = order.index(section)
        else:
            others.append({"type": section if ours else code.of_class(part, f"component '{part.name}'"), **entries})
    return {**listed, "component": others}


def _coupling(part: Coupling, backlashes: Mapping[str, Mapping[str, float]], code: Code) -> Entries:
    entries = _fields(part, code) | {"ratio": _quantity((part.ratio,), ratio_unit(part.output, part.input))}
    if part.further:
        units = [ratio_unit(part.output, more.coordinate) for more in part.further]
        ratios = [_quantity((more.ratio,), unit) for more, unit in zip(part.further, units, strict=True)]
        entries["further"] = [
            {**_coordinate(more.coordinate, code), "ratio": ratio} for more, ratio in zip(part.further, ratios, strict=True)
        ]
    entries |= {} if part.offset is None else {"offset": _quantity((part.offset,), part.output.unit)}
    if (transmission := entries.pop("transmission", None)) is not None:
        entries[next(name for name, kind in TRANSMISSIONS.items() if isinstance(part.transmission, kind))] = transmission
    if part.name in backlashes:
        (_, angle), *others = backlashes[part.name].items()
        entries["backlash"] = {"angle": _quantity((angle,), "rad"), **dict(others)}
    return entries


def _coordinate(part: Coordinate, code: Code) -> Entries:
    if isinstance(part, Distance):
        return {"distance": [_body_point(part.start, code), _body_point(part.end, code)]}
    if isinstance(part, Slide):
        entries = {"slide": _body_point(part.point, code), "direction": _quantity((part.direction,), "rad")}
    else:
        entries = {"angle": part.body}
    return entries if part.base == GROUND else entries | {"base": part.base}


def _body(body: Body, code: Code) -> Entries:
    """Return the table of a body; a straight bar has the key `length` if that describes exactly the same body."""
    entries = _fields(body, code)
    if body.inertia is None or "end" not in body.points:
        return entries
    length, shown, straight = body.points["end"][0], dict(entries), bar_points(body.points["end"][0])
    points = {name: place for name, place in body.points.items() if name not in straight}
    # compare texts, because -0.0 and 0.0 are equal but have different bits
    if not length > 0.0 or repr((body.centre, dict(body.points))) != repr((straight["middle"], straight | points)):
        return entries
    del shown["inertia"], shown["points"]
    shown.pop("centre", None)
    more = {"length": _quantity((length,), "m")}
    more |= {} if repr(body.inertia) == repr(uniform_inertia(length, body.mass)) else {"inertia": entries["inertia"]}
    more |= {"points": _points(points, code)} if points else {}
    return {"name": shown.pop("name"), "mass": shown.pop("mass"), **more, **shown}


def _fields(described: Any, code: Code) -> Entries:
    """Return the fields of a dataclass as keys of a table; fields with default values or None are left out."""
    return {
        field.name: _value(value, field, type(described), code)
        for field, value in non_default_fields(described)
        if value is not None
    }


def _value(value: Any, field: Declared, kind: type, code: Code) -> Any:
    unit = "1" if field.quantity is None else field.quantity.unit
    pairs = next((extra for extra in field.extras if isinstance(extra, Pairs)), None)
    if field.hint == str | Point and isinstance(value, str) and "," in value:
        if code.recorded:
            return [value]
        raise InputError(f"{kind.__name__.lower()} of the point '{value}'", "names without a comma")
    if isinstance(value, bool | str):
        return value
    if pairs is not None:
        columns = zip(pairs.names, zip(*value, strict=True), pairs.units, strict=True)
        return {name: _quantity(column, unit) for name, column, unit in columns}
    if isinstance(value, TimeFunction):
        return _time_function(value, next((extra.unit for extra in field.extras if isinstance(extra, OverTime)), "1"))
    if field.hint == Mapping[str, float]:
        return {name: _quantity((number,), unit) for name, number in value.items()}
    if isinstance(value, Mapping):
        return _points(value, code)
    if isinstance(value, Part):
        return _named(value, "name" if isinstance(value, Controller) else "law", code)
    if isinstance(value, Coordinate):
        return _coordinate(value, code)
    if is_described(value):
        listed = {Material: MATERIALS, Oil: OILS}.get(type(value), {})
        by_name = getattr(value, "name", "")
        return by_name if by_name in listed and repr(listed[by_name]) == repr(value) else _fields(value, code)
    if field.hint in (BodyPoint, BodyPoint | None):
        return _body_point(value, code)
    if field.hint == tuple[str, ...]:
        return value
    if field.hint == tuple[float, ...]:
        return _quantity(value, unit)
    if field.hint == tuple[FurtherInput, ...]:
        return []  # `_coupling` writes them, with the units of their ratios
    if field.hint == tuple[Point, ...]:
        return [_quantity(place, "m") for place in value]
    if isinstance(value, tuple) and len(value) == 2:
        return _quantity(value, "m" if field.quantity is None else unit)
    if isinstance(value, int | float):
        return _quantity((value,), unit)
    raise InputError(f"{field.name} = {value!r:.60} in a {kind.__name__}", "a value that a case file can represent")


def _named(described: Any, key: str, code: Code) -> Any:
    """Return the table of a law or a controller, or its name alone if all parameters have their defaults."""
    entries, ours = _fields(described, code), type(described).__module__.startswith("scissordyn.")
    name = described.name if ours else code.of_class(described, described.slot.title)
    return {key: name, **entries} if entries else name


def _time_function(function: TimeFunction, unit: str) -> Entries:
    """Return the table of a time function: its kind as the only key, and values with units."""
    match function:
        case ConstantSpeed(speed):
            if unit == "m":
                raise InputError(
                    "ConstantSpeed as time function of a distance", "another time function", "Polynomial((0.5, 0.1))"
                )
            return {"speed": _quantity((speed,), powers(unit)[1])}
        case Harmonic() | Cycloidal() | Trapezoidal():
            kind: Any = type(function)
            values = {name: (getattr(function, name), of) for name, of in units_of(kind, unit).items()}
            entries = {name: _quantity((value,), of) for name, (value, of) in values.items() if value or name != "begin"}
            return {kind.__name__.lower(): entries}
        case Polynomial(coefficients):
            return {"polynomial": [_quantity((number,), of) for number, of in zip(coefficients, powers(unit), strict=False)]}
        case Tabulated(times, values):
            column = list(values) if unit == "1" else _quantity(values, unit)
            return {"table": {"time": _quantity(times, "s"), FUNCTION_QUANTITIES[unit].name: column}}


def _points(points: Mapping[str, Point], code: Code) -> Entries:
    for name in points:
        if "." in name and not code.recorded:
            raise InputError(f"the point name '{name}' has a dot", "a name without a dot, which separates body and point")
    return {name: _quantity(place, "m") for name, place in points.items()}


def _body_point(place: BodyPoint, code: Code) -> str | BodyPoint:
    body, point = place
    if "." in point and code.recorded:
        return place
    if "." in point:
        raise InputError(f"the point name '{point}' has a dot", "a name without a dot, which separates body and point")
    return f"{body}.{point}"


def _quantity(values: Sequence[float], unit: str) -> Any:
    """Return a number without a unit, or a text of numbers with their unit."""
    return values[0] if unit == "1" else exact_text(values, unit)


def _check(text: str, case: Case, context: Context) -> None:
    """Raise `InputError` unless the text describes the case exactly."""
    read = instance(CaseTable, tomllib.loads(text), context).case()
    for there, here in ((read.mechanism, case.mechanism), (read.run, case.run), (read.wear, case.wear)):
        reread, written = _comparable(to_plain(there)), _comparable(to_plain(here))
        if reread != written:
            place, wrong, wanted = first_difference(reread, written)
            raise InputError(
                f"a case file cannot represent this mechanism: {place} = {str(wanted)[:60]} would be read as {str(wrong)[:60]}",
                "values that the tables of a case file can represent",
            )


def _comparable(plain: Any) -> Any:
    """Convert plain data for comparison: numbers become the texts of floats, file names become absolute."""
    if isinstance(plain, dict):
        return {key: _comparable(value) for key, value in plain.items()}
    if isinstance(plain, list):
        return [_comparable(value) for value in plain]
    if isinstance(plain, int | float) and not isinstance(plain, bool):
        return repr(float(plain))
    if isinstance(plain, str) and ".py:" in plain:
        file, _, name = plain.rpartition(":")
        return f"{Path(file).expanduser().resolve()}:{name}"
    return plain
