"""Read study files, and the texts of ranges, requirements and measures in them and on the command line."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any

from scissordyn.analysis.motor import MotorCurve
from scissordyn.casefile.quantity import read_quantity, unit_factor
from scissordyn.casefile.table import (
    About,
    Context,
    Shape,
    Table,
    dataclass_reader,
    instance,
    reader,
    table_of,
    table_reader,
    toml,
)
from scissordyn.casefile.text import read_text
from scissordyn.config.file import in_file, is_case, parse_toml, read_case
from scissordyn.config.variation import (
    FILE_TABLES,
    NAMES_EXAMPLE,
    VARIATION_EXAMPLES,
    MechanismReader,
    is_deviation,
    make_names,
    number_and_unit,
    number_of_file,
    read_deviation,
    read_listed,
    read_variation,
    reader_by_change,
    scale_of,
    split_each,
    unit_like,
    unit_of,
    variants_of,
)
from scissordyn.errors import InputError, command
from scissordyn.lifetime.response import LIFE, LIFE_UNIT, WearLife
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.options import Options
from scissordyn.model.parameter_path import EACH_EXAMPLE, number, single
from scissordyn.model.wear import Wear
from scissordyn.run.response import LOAD_KINDS, Response, check_part, read_response
from scissordyn.studies.ask.description import Accurate, OwnMeasure, Study
from scissordyn.studies.ask.design import Design, Factor, Sampling
from scissordyn.studies.ask.distribution import Names, Variation
from scissordyn.studies.ask.requirement import LOAD_MEASURES, SHORTFALL, Goal, Optimisation, Requirement, read_goal
from scissordyn.units import Quantity

OWN_MEASURE = re.compile(r"\s*([^\s\[\]]+)\s*(?:\[([^\[\]]*)\])?\s*(?:\bof\s+(\S+))?\s*")
"""Text of a user-defined measure before its equals sign: name, unit in brackets, and argument of the function."""


MOTOR_MEASURE = "motor_fraction"  # name of the measure that a study with a motor curve adds

OWN_MEASURE_EXAMPLE = "'late [N] = mine.py:late'"  # correct user-defined measure, which error texts show

COMPARISON = re.compile(r"\s*([^<>=]+?)\s*(<=|>=|<|>)\s*([^<>=]+?)\s*")  # pattern of a requirement: response, comparison, bound


TEXT_LIST_SCHEMA = {"type": "array", "items": {"type": "string"}}  # JSON schema of a list of texts


@reader(lambda: TEXT_LIST_SCHEMA)
def _read_texts(given: Any, context: Context) -> list[str]:
    if not isinstance(given, list) or not all(isinstance(text, str) for text in given):
        raise InputError("not a list of texts", "a list of texts", toml([given]) if isinstance(given, str) else "")
    return given


# Type, reader and help text of the key `goals` of the table [optimise]
_GOALS_KEY = Annotated[list[str], _read_texts, About("measures to minimise or maximise", examples=[["minimise peak_force"]])]
SEARCH_TABLE = table_of(Optimisation, (("goals", _GOALS_KEY),))  # table [optimise]
_read_search = table_reader(lambda: SEARCH_TABLE, vars)


NAMES_SCHEMA = {"type": "array", "items": {"type": ["string", "number", "boolean"]}, "minItems": 1}  # schema of a list of names


def _parameter_table_schema(deeper: int = 6) -> Shape:
    """Return the JSON Schema of a table whose keys are parameter paths and whose values are texts or lists of names.

    TOML reads an unquoted parameter path as nested tables; `deeper` is the number of levels that are allowed.
    """
    over = {"values": {"type": "string"}, "each": {"type": "boolean"}}
    weighed = {"values": NAMES_SCHEMA, "probabilities": {"type": "array", "items": {"type": "number"}}}
    tables = [
        {"type": "object", "properties": keys, "required": ["values"], "additionalProperties": False}
        for keys in (over, weighed)
    ]
    inner = [{"type": "string"}, NAMES_SCHEMA, *tables]
    inner += [_parameter_table_schema(deeper - 1)] if deeper else []
    return {"type": "object", "additionalProperties": {"anyOf": inner}}


@reader(_parameter_table_schema)
def _read_parameter_table(given: Any, context: Context) -> dict[str, str | Variation]:
    """Read a table whose keys are parameter paths; an unquoted path, which TOML reads as nested tables, is joined again."""
    if not isinstance(given, Mapping):
        raise InputError("not a table of parameters", f"texts such as {VARIATION_EXAMPLES}", '"A.clearance" = "0.05..0.4 mm"')
    varied = dict(_flatten(given))
    for parameter, value in varied.items():
        if not isinstance(value, str | Names):
            raise InputError(
                f"'{parameter}' = {toml(value)}", f"text such as {VARIATION_EXAMPLES}, or a list of names", NAMES_EXAMPLE
            )
    return varied


MOTOR_POINT_EXAMPLE = "'0 rpm, 60 N m'"  # correct point of a motor curve, which error texts show

# unit, bounds and help text of the speed in a point of a motor curve
MOTOR_SPEED_QUANTITY = Quantity("rad/s", minimum=0.0, help="speed of a motor")

# unit, bounds and help text of the torque in a point of a motor curve
MOTOR_TORQUE_QUANTITY = Quantity("N m", minimum=0.0, help="torque of a motor")


def read_motor(points: Sequence[str], of: str = "", ratio: float = 1.0) -> MotorCurve:
    """Return a motor curve from texts with units, "speed, torque"."""
    pairs = []
    for text in points:
        speed, comma, torque = text.partition(",")
        if not comma:
            raise InputError(f"point '{text}' of a motor", "a speed, a comma and a torque", MOTOR_POINT_EXAMPLE)
        try:
            pairs.append(
                (read_quantity(speed.strip(), MOTOR_SPEED_QUANTITY), read_quantity(torque.strip(), MOTOR_TORQUE_QUANTITY))
            )
        except InputError as error:
            raise InputError(f"point '{text}' of a motor: {error.what}", error.expected, MOTOR_POINT_EXAMPLE) from None
    return MotorCurve(tuple(pair[0] for pair in pairs), tuple(pair[1] for pair in pairs), of, ratio)


@reader(lambda: TEXT_LIST_SCHEMA)
def _read_points(given: Any, context: Context) -> list[str]:
    try:
        texts: list[str] = _read_texts.read(given, context)
        return texts
    except InputError as error:
        raise InputError(
            error.what, "points: a list of texts; of: a name; ratio: a number", f"points = [{MOTOR_POINT_EXAMPLE}]"
        ) from None


MotorTable = table_of(
    read_motor,
    (
        ("points", Annotated[list[str], _read_points, About(examples=[[MOTOR_POINT_EXAMPLE.strip("'")]])]),
        ("of", Annotated[str, About("a drive, an actuator or a motor")]),
        ("ratio", Annotated[float, About("speed of the motor divided by that of its body")]),
    ),
)
"""Table [motor] of a study file."""

_read_motor = table_reader(lambda: MotorTable)


class ScreenTable(Table):
    """Table [screen]: cheap runs of a study, which accurate runs verify."""

    set: Annotated[Sequence[str], _read_texts, About("changes that make runs cheap", examples=[["run.rtol=1e-3"]])]
    verify: Annotated[int, About("number of points to verify: the first of the design, or the best of a search")] = (
        Accurate.points
    )


class StudyText(Table):
    """Content of a study file, or the same values given in Python."""

    case: Annotated[str, About("the case file that is varied", examples=["case.toml"])]
    set: Annotated[Sequence[str], _read_texts, About("changes of the case")] = ()
    vary: Annotated[Mapping[str, Any], _read_parameter_table, About("numbers and names to vary, by parameter")] = (
        MappingProxyType({})
    )
    uncertain: Annotated[Mapping[str, Any], _read_parameter_table, About("uncertain numbers, by parameter")] = MappingProxyType(
        {}
    )
    measures: Annotated[Sequence[str | OwnMeasure], _read_texts, About("measures that are stored for each run")] = ()
    require: Annotated[Sequence[str | Requirement], _read_texts, About("requirements that a design must meet")] = ()
    design: Annotated[Design, dataclass_reader(Design), About("choice of the points")] = Design()
    sampling: Annotated[Sampling, dataclass_reader(Sampling), About("samples of the uncertain numbers")] = Sampling()
    members: Annotated[int, About("runs of each sample that differ by round-off")] = 1
    gradients: Annotated[bool, About("compute exact derivatives of the responses: trends and maps need fewer points")] = False
    motor: Annotated[Any, _read_motor, About("curve of a motor that must be sufficient")] = None
    optimise: Annotated[Any, _read_search, About("search for the best point")] = MappingProxyType({})
    screen: Annotated[Any, ScreenTable.reader(), About("cheap runs; some of them are verified with the case")] = None


def read_study(path: Path) -> StudyText:
    """Read the study that a TOML file describes."""
    text = read_text(path, "a study file in TOML")
    tree = parse_toml(text, path)
    if is_case(tree):
        allowed = "a study file, which names a case and what varies"
        raise InputError(f"'{path}' is a case file", allowed, command("scissordyn", "run", path))
    with in_file(path, text, tree):
        table = instance(StudyText, tree, {"folder": path.parent})
    if table.optimise and not table.optimise["goals"]:
        raise InputError(f"{path}, [optimise]: goals = []", "a list of goals", 'goals = ["minimise peak_force"]')
    table.case, table.measures = (
        str(path.parent / table.case),
        [
            "=".join((_split_measure(measure)[0], f"{path.parent / _split_measure(measure)[1]}")) if "=" in measure else measure
            for measure in map(str, table.measures)
        ],
    )
    return table


def _flatten(tree: Mapping[str, Any], before: str = "") -> Iterable[tuple[str, Any]]:
    """Yield the parameter paths and values of a table; keys of nested tables, into which TOML splits a path, are joined."""
    for key, value in tree.items():
        if isinstance(value, dict) and "values" in value and set(value) <= {"values", "each", "probabilities"}:
            yield f"{before}{key}", _read_values(value, f"'{before}{key}' = {toml(value)}")
        elif isinstance(value, dict):
            yield from _flatten(value, f"{before}{key}.")
        else:
            yield f"{before}{key}", make_names(value) if isinstance(value, list) else value


def _read_values(table: Mapping[str, Any], said: str) -> str | Names:
    """Read a table with the key `values`: a text and `each`, or a list of names and their `probabilities`.

    `said` begins the error messages.
    """
    values, apart = table["values"], table.get("each", False)
    if isinstance(values, list) and "each" not in table:
        return make_names(values, table.get("probabilities", ()))
    if not isinstance(apart, bool) or not isinstance(values, str) or "probabilities" in table:
        raise InputError(
            said, "values = a text, and each = true or false; or values = a list of names, and probabilities", EACH_EXAMPLE
        )
    return f"{values}, each" if apart else values


def _split_measure(measure: str) -> tuple[str, str]:
    """Split the text of a user-defined measure at the equals sign into name and function."""
    name, _, reference = measure.partition("=")
    return name, reference.strip()


@dataclass(frozen=True)
class BaseCase:
    """Base case of a study: mechanism, options of the runs, and function `read` from chosen names to a mechanism.

    Names are values such as materials; `read` is None if no factor has names.
    """

    mechanism: Mechanism
    options: Options
    read: MechanismReader | None = None
    wear: Wear = field(default_factory=Wear)


def study_of(text: StudyText) -> Study:
    screen: Any = text.screen
    if screen is None:
        return make_study(_read_given(text), text)
    return make_study(_read_given(text), text, _read_given(text, screen.set), screen.verify)


def _read_given(text: StudyText, changes: Sequence[str] = ()) -> BaseCase:
    """Read the base case of a study file, with further changes."""
    every, file = [*text.set, *changes], Path(text.case)
    case = read_case(file, every)
    return BaseCase(case.mechanism, Options(**case.run.keywords), reader_by_change(file, every, case.run), case.wear or Wear())


def make_study(base: BaseCase, text: StudyText, cheap: BaseCase | None = None, verify: int = Accurate.points) -> Study:
    """Build a study of the base case; with `cheap`, its runs explore and `verify` points are run again with the base case."""
    simulated = cheap or base
    mechanism = simulated.mechanism
    names = [name for name in text.measures if isinstance(name, str) and "=" not in name and name != LIFE]
    wanted = [Response(measure, part) for part, measure, _ in map(read_response, names)]
    for response in wanted:
        check_part(mechanism, response)
    others = (measure for measure in text.measures if measure not in (*names, LIFE))
    functions = [make_measure(*_split_measure(measure)) if isinstance(measure, str) else measure for measure in others]
    functions += [OwnMeasure(MOTOR_MEASURE, text.motor)] if text.motor is not None else []
    units = {measure.name: measure.units for measure in functions} | {LIFE: LIFE_UNIT}
    requirements = [read_requirement(bound, units) if isinstance(bound, str) else bound for bound in text.require]
    goals = tuple(read_goal(goal, units, tuple(text.vary)) for goal in text.optimise.get("goals", ()))
    needed = [bound.measure for bound in requirements] + [goal.measure for goal in goals if goal.measure not in text.vary]
    needed += [SHORTFALL[name][0] for name in needed if name in SHORTFALL]
    if LIFE in (*needed, *text.measures):
        functions.append(_life_measure(simulated, requirements, goals))
    measures = [*(response.measure for response in wanted), *(name for name in needed if name not in units)]
    factors, uncertain = (factors_of(mechanism, part, Path(text.case).parent) for part in (text.vary, text.uncertain))
    search = Optimisation(**{**text.optimise, "goals": goals}).over([factor.variation for factor in factors]) if goals else None
    study = Study(
        mechanism=mechanism,
        options=simulated.options,
        factors=factors,
        design=text.design if search is None else search.design(1, len(factors)),
        measures=tuple(dict.fromkeys(measures)) or ("peak_force", "peak_drive_torque"),
        own_measures=tuple(functions),
        uncertain=uncertain,
        sampling=text.sampling,
        members=text.members,
        gradients=text.gradients,
        requirements=tuple(requirements),
        optimisation=search,
        responses=tuple(dict.fromkeys(response for response in wanted if response.part)),
        variants=variants_of((*factors, *uncertain), simulated.read),
    )
    if cheap is None:
        return study
    return replace(
        study, accurate=Accurate(base.mechanism, base.options, verify, variants_of(study.variant_factors, base.read))
    )


def _life_measure(base: BaseCase, requirements: Sequence[Requirement], goals: Sequence[Goal]) -> OwnMeasure:
    """Return the measure that computes lives; raise `InputError` for a goal, which needs lives beyond the computed cycles."""
    if any(goal.measure == LIFE for goal in goals):
        what = f"'{LIFE}' as a goal: lives beyond {base.wear.cycles} cycles are not known"
        raise InputError(what, "a requirement", f"'{LIFE} > 5000 cycles'")
    life = WearLife(base.wear)
    life.check(base.mechanism, [(bound.label, bound.bound) for bound in requirements if bound.measure == LIFE])
    return OwnMeasure(LIFE, life, units=LIFE_UNIT)


def factors_of(mechanism: Mechanism, given: Mapping[str, str | Variation], folder: Path) -> tuple[Factor, ...]:
    """Return the factors of a study, from texts or variations by parameter path; a factor keeps the user's unit."""
    factors = []
    for parameter, values in given.items():
        text = _read_levels(mechanism, parameter, values)
        if isinstance(text, Names):
            factors.append(Factor(parameter, text))
            continue
        if parameter.partition(".")[0] in FILE_TABLES:
            factors.append(number_of_file(parameter, text, folder))
            continue
        quantity = number(mechanism, parameter).quantity
        assert quantity is not None
        if not isinstance(text, str):
            factors.append(Factor(parameter, text))
            continue
        plain, apart = split_each(text)
        deviates = is_deviation(plain)
        variation, relative = (
            read_deviation(plain, quantity, parameter=parameter)
            if deviates
            else (read_variation(plain, quantity, parameter=parameter, folder=folder), False)
        )
        unit = unit_of(plain)
        scale = 0.01 if relative else unit_factor(unit, quantity.unit) if unit else 1.0
        of = parameter if deviates else ""
        places = single(mechanism, parameter) if apart else [parameter]
        factors.extend(Factor(place, variation, unit, scale, of, relative) for place in places)
    return tuple(factors)


def _read_levels(mechanism: Mechanism, parameter: str, given: str | Variation) -> str | Variation:
    """Return the variation of a parameter; a list in brackets means names, or levels if the parameter is a number."""
    names = read_listed(given) if isinstance(given, str) else given
    if not isinstance(names, Names):
        return given
    try:
        number(mechanism, parameter)
    except InputError:
        return names
    return ", ".join(names.values)


def make_measure(name: str, function: str | Callable[..., float]) -> OwnMeasure:
    """Return a user-defined measure from "NAME [UNIT]" and its function, or the function's reference "file.py:name"."""
    match, text = OWN_MEASURE.fullmatch(name), f"{name}={function}" if isinstance(function, str) else name
    if match is None:
        raise InputError(
            f"wrong form of measure '{text}'", "a name, a unit in brackets, and a function in a file", OWN_MEASURE_EXAMPLE
        )
    unit = (match[2] or "1").strip()
    if unit != "1":
        try:
            unit_factor(unit, unit)
        except InputError as error:
            raise InputError(f"measure '{text}': {error.what}", "a unit such as N, mm, N m", OWN_MEASURE_EXAMPLE) from None
    return OwnMeasure(match[1], function, of=match[3] or "dataset", units=unit)


def read_requirement(text: str, own: Mapping[str, str] | None = None) -> Requirement:
    """Return a requirement such as ``peak_force < 500 N`` or ``A.peak_force < 500 N``."""
    match = COMPARISON.fullmatch(text)
    if match is None:
        raise InputError(f"'{text}' is not a requirement", "a measure, a comparison and a bound", "'peak_force < 500 N'")
    try:
        part, measure, unit = read_response(match[1], own)
        value, unit_given = number_and_unit(match[3])
        if measure in LOAD_MEASURES:
            unit = unit_like(unit_given, LOAD_KINDS)
            if not unit:
                what = f"unit '{unit_given}' does not fit" if unit_given else "missing unit"
                raise InputError(
                    what, f"a number and its unit [{' or '.join(LOAD_KINDS)}]", f"{value} {next(iter(LOAD_KINDS))}"
                )
        factor = scale_of(unit_given, unit, sample=f"{match[1]} {match[2]} {value} {unit}")
    except InputError as error:
        raise InputError(f"requirement '{text}': {error.what}", error.expected, error.example) from None
    exerted = unit if measure in LOAD_MEASURES else ""
    return Requirement(measure, match[2], float(value) * factor, part, text.strip(), exerted)
