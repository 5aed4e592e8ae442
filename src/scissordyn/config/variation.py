"""Read the variation of a parameter in a study: a range, levels or a distribution of numbers, or a list of names."""

from __future__ import annotations

import itertools
import math
import re
import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from scissordyn.casefile.quantity import LEADING_NUMBER, USUAL_UNITS, read_quantity, unit_factor
from scissordyn.casefile.table import toml
from scissordyn.casefile.text import read_text
from scissordyn.config.file import read_case
from scissordyn.errors import InputError, did_you_mean
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.options import Options
from scissordyn.model.parameter_path import changed
from scissordyn.studies.ask.design import Factor
from scissordyn.studies.ask.distribution import (
    Distribution,
    Empirical,
    Interval,
    Levels,
    Names,
    Variation,
    argument_names,
    within_tolerance,
)
from scissordyn.studies.ask.iso_286 import read_fit
from scissordyn.units import Quantity

VARY_EXAMPLE = "--vary A.clearance='0.05..0.4 mm'"  # correct option, which error texts show

# Correct values of a varied parameter, which error texts show
VARIATION_EXAMPLES = (
    "'0.05..0.4 mm', '0.05..0.4 mm, 20 values, log', '50, 100, 200 N m', 'norm(loc=0.1, scale=0.02) mm', '0.3 mm +- 20 %'"
)

# Pattern of an ISO fit of hole and shaft, for example "H7/g6 at 10 mm, norm"
FIT_PATTERN = re.compile(r"\s*([A-Za-z]+\d+\s*/\s*[A-Za-z]+\d+)\s+at\s+([^,]+?)\s*(?:,\s*(\w+)\s*)?")
FIT_EXAMPLE = "'H7/g6 at 10 mm'"  # correct fit, which error texts show

TOLERANCE_SIGNS = ("+-", "±", "+/-")  # spellings of the sign before a tolerance
# Correct tolerances, which error texts show
TOLERANCE_EXAMPLES = "'0.3 mm +- 0.02 mm', '0.3 mm +- 20 %', '+- 20 %' of a number that is chosen"
PERCENT_ALLOWED = ", or %", TOLERANCE_EXAMPLES  # end of an error text about the unit of a tolerance, and correct tolerances
TOLERANCE_SHAPES = ("uniform", "norm", "triang")
"""Shapes of the distribution within a tolerance; a normal distribution has its limits at three standard deviations."""

EACH_PATTERN = re.compile(r"(.*?)\s*,\s*each\s*", re.DOTALL)  # pattern of a variation that ends in ", each"

# Pattern of a parameter's probability distribution with its arguments and unit
DISTRIBUTION_CALL = re.compile(r"\s*([a-z_0-9]+)\s*\((.*)\)\s*(.*)", re.DOTALL)
DIGITS_MAX = 18  # [digits] longest integer in "20 values"; Python reads at most 4300 digits
HYPHEN_RANGE = re.compile(r"\s*(\d+\.?\d*|\.\d+)\s*-\s*(?=[\d.])")  # pattern of a range with "-" instead of ".."

RANGE_OPTION = re.compile(r"(\d+)\s+values|(log)")  # pattern of an option of a range: "20 values" or "log"


def unit_of(text: str) -> str:
    text = split_each(text)[0]
    if (sign := _sign(text)) is not None:
        nominal, rest = text.split(sign, 1)
        tolerance = number_and_unit(rest.split(",")[0])[1]
        nominal_unit = number_and_unit(nominal)[1] if nominal.strip() else ""
        return nominal_unit or (tolerance if tolerance != "%" or not nominal.strip() else "")
    if (fit := FIT_PATTERN.fullmatch(text)) is not None:
        return number_and_unit(fit[2])[1]
    called = DISTRIBUTION_CALL.fullmatch(text)
    if called:
        return called[3].strip()
    last = text.split("..", 1)[1].split(",")[0] if ".." in text else text.split(",")[-1]
    return number_and_unit(last)[1]


def read_variation(text: str, quantity: Quantity, *, parameter: str = "", folder: Path | None = None) -> Variation:
    """Read the variation of a numeric parameter from a text; `folder` is that of named data files."""
    try:
        return _read_variation(text, quantity, folder or Path())
    except InputError as error:
        sample = error.example or VARY_EXAMPLE
        if error.what == "missing unit":
            sample = f"'{text.strip()} {USUAL_UNITS.get(quantity.unit, (quantity.unit,))[-1]}'"
        elif (hyphen := HYPHEN_RANGE.match(text)) is not None:
            sample = f"'{hyphen[1]}..{text[hyphen.end() :].strip()}'"
        raise InputError(f"'{parameter}' over '{text}': {error.what}", error.expected or VARIATION_EXAMPLES, sample) from None


def split_each(text: str) -> tuple[str, bool]:
    """Split off a final ", each" from the text of a variation; return the rest, and True if it was present."""
    match = EACH_PATTERN.fullmatch(text)
    return (match[1], True) if match is not None else (text, False)


def is_deviation(text: str) -> bool:
    """Return True if a text is a tolerance without a nominal value, such as "+- 20 %"."""
    return text.strip().startswith(TOLERANCE_SIGNS)


def read_deviation(text: str, quantity: Quantity, *, parameter: str = "") -> tuple[Variation, bool]:
    """Read a tolerance without a nominal value; return the distribution of the deviation, and True if it is relative."""
    try:
        size, unit, shape = _read_tolerance(text.strip().removeprefix(str(_sign(text))))
        width = size / 100.0 if unit == "%" else size * scale_of(unit, quantity.unit, *PERCENT_ALLOWED)
        return within_tolerance(shape, 0.0, width), unit == "%"
    except InputError as error:
        what = f"tolerance of '{parameter}', '{text}': {error.what}"
        raise InputError(what, error.expected or TOLERANCE_EXAMPLES, error.example) from None


def _sign(text: str) -> str | None:
    return next((sign for sign in TOLERANCE_SIGNS if sign in text), None)


def _read_tolerance(text: str) -> tuple[float, str, str]:
    """Return size, unit and shape of a tolerance from the text after its sign."""
    first, *others = (part.strip() for part in text.split(","))
    value, unit = number_and_unit(first)
    shape = ", ".join(others) or TOLERANCE_SHAPES[0]
    _check_shape(shape, "a tolerance", TOLERANCE_SHAPES)
    if not 0.0 < float(value) < math.inf:
        raise InputError(f"a tolerance of {value} {unit}".rstrip(), "a number > 0", TOLERANCE_EXAMPLES)
    return float(value), unit, shape


def scale_of(unit: str, si: str, or_else: str = "", sample: str = "") -> float:
    """Return the factor from a unit to the SI unit; raise `InputError` for a missing unit or another dimension."""
    if si == "1":
        if unit:
            raise InputError(f"unit '{unit}' for a pure number", f"a plain number{or_else}")
        return 1.0
    allowed = f"a number and its unit [{si}]{or_else}"
    if not unit:
        raise InputError("missing unit", allowed, sample)
    try:
        return unit_factor(unit, si)
    except InputError as error:
        raise InputError(error.what, error.expected or allowed, error.example or sample) from None


def _check_shape(shape: str, after: str, allowed: Sequence[str]) -> None:
    """Raise `InputError` unless a word after a tolerance or fit is one of the allowed shapes."""
    if shape in allowed:
        return
    sample = FIT_EXAMPLE if after == "a fit" else TOLERANCE_EXAMPLES
    raise InputError(f"'{shape}' after {after}{did_you_mean(shape, allowed)}", ", ".join(allowed), sample)


def _read_nominal(text: str, sign: str, quantity: Quantity) -> Variation:
    """Return the distribution of a nominal value with a tolerance, such as "0.3 mm +- 20 %"."""
    nominal, rest = text.split(sign, 1)
    size, unit, shape = _read_tolerance(rest)
    value, nominal_unit = number_and_unit(nominal)
    if unit == "%":
        middle = _read_number(nominal, "", quantity)
        return within_tolerance(shape, middle, abs(middle) * size / 100.0)
    middle = _read_number(value, nominal_unit or unit, quantity)
    return within_tolerance(shape, middle, size * scale_of(unit or nominal_unit, quantity.unit, *PERCENT_ALLOWED))


def _read_fit(fit: str, size: str, shape: str | None, quantity: Quantity) -> Variation:
    """Return the distribution of the radial clearance for an ISO fit of hole and shaft with a nominal diameter `size`."""
    if quantity.unit != "m":
        raise InputError(f"a fit of hole and shaft for a number in [{quantity.unit}]", "a fit for a clearance", FIT_EXAMPLE)
    _check_shape(shape or TOLERANCE_SHAPES[0], "a fit", TOLERANCE_SHAPES[:2])
    value, unit = number_and_unit(size)
    if not unit:
        raise InputError("missing unit of the diameter", "a diameter with its unit", FIT_EXAMPLE)
    smallest = 2.0 * (quantity.minimum or 0.0)  # twice, so that no quantile is below the bound by round-off
    return read_fit(fit, float(value) * unit_factor(unit, "m")).clearance(shape or TOLERANCE_SHAPES[0], smallest)


def _read_variation(text: str, quantity: Quantity, folder: Path) -> Variation:
    fit = FIT_PATTERN.fullmatch(text)
    if fit:
        return _read_fit(fit[1], fit[2], fit[3], quantity)
    sign = _sign(text)
    if sign is not None:
        if is_deviation(text):
            raise InputError("a tolerance without a nominal value", "a number before it", TOLERANCE_EXAMPLES)
        return _read_nominal(text, sign, quantity)
    called = DISTRIBUTION_CALL.fullmatch(text)
    if called:
        return _read_distribution(called[1], called[2], called[3], quantity, folder)
    if ".." in text:
        low, rest = text.split("..", 1)
        last, *options = (part.strip() for part in rest.split(","))
        chosen: dict[str, Any] = {}
        for option in options:
            match = RANGE_OPTION.fullmatch(option)
            if match is None:
                raise InputError(
                    f"unknown option '{option}' of a range", "a number of values, or log", "'0.05..0.4 mm, 20 values, log'"
                )
            if len(match[1] or "") > DIGITS_MAX:
                raise InputError(f"a number of values of {len(match[1])} digits", "a few values", "'0.05..0.4 mm, 20 values'")
            chosen |= {"count": int(match[1])} if match[1] else {"logarithmic": True}
        value, unit = number_and_unit(last)
        ends = _read_number(low, unit, quantity), _read_number(value, unit, quantity)
        if ends[0] >= ends[1]:
            turned = f"'{value}..{low.strip()} {unit}'" if ends[0] > ends[1] else f"'{value} {unit}' for one value"
            raise InputError("the range is empty", "the smaller number first", turned)
        return Interval(*ends, **chosen)
    *others, last = text.split(",")
    value, unit = number_and_unit(last)
    return Levels(tuple(_read_number(number, unit, quantity) for number in (*others, value)))


def number_and_unit(text: str) -> tuple[str, str]:
    """Split a text into the number at its start and the unit after it."""
    match = LEADING_NUMBER.fullmatch(text)
    if match is None:
        raise InputError(f"'{text.strip()}' is not a number", VARIATION_EXAMPLES)
    return match[1], match[2].strip()


def _read_number(text: str, unit: str, quantity: Quantity) -> float:
    """Return a number in SI units; raise `InputError` if it is outside the bounds of its quantity."""
    value, own_unit = number_and_unit(text)
    unit = own_unit or unit
    if quantity.unit == "1":
        if unit:
            raise InputError(f"unit '{unit}' for a pure number", quantity.expected)
        return float(read_quantity(float(value), quantity))
    return float(read_quantity(f"{value} {unit}".strip(), quantity))


def _read_distribution(name: str, inside: str, unit: str, quantity: Quantity, folder: Path) -> Variation:
    """Return a distribution of scipy.stats, whose location and scale have the unit after the bracket, or measured values."""
    if name == "table":
        return Empirical(tuple(_read_number(repr(value), unit, quantity) for value in _read_column(folder / inside.strip())))
    pairs = [part.partition("=") for part in inside.split(",") if part.strip()]
    numbers = [_read_plain(text if equals else key) for key, equals, text in pairs]
    if not all(equals for _, equals, _ in pairs):
        written = ", ".join(f"{key}={number:.6g}" for key, number in zip(argument_names(name), numbers, strict=False))
        allowed = "a distribution of scipy.stats and its arguments by name"
        raise InputError(f"'{name}' with arguments without names", allowed, f"'{name}({written}) {unit}".rstrip() + "'")
    arguments = {key.strip(): number for (key, _, _), number in zip(pairs, numbers, strict=True)}
    factor = scale_of(unit, quantity.unit)
    loc, scale = arguments.get("loc", 0.0), arguments.get("scale", 1.0)
    return Distribution(name, arguments | {"loc": loc * factor, "scale": scale * factor})


def _read_plain(text: str) -> float:
    value, unit = number_and_unit(text)
    if unit:
        raise InputError(f"'{text.strip()}' has a unit", "a plain number; the unit follows the closing bracket")
    return float(value)


def _read_column(path: Path) -> Sequence[float]:
    """Read a file with one number in each line; the first line may be a heading."""
    lines = [line.split(",")[0].strip() for line in read_text(path, "a file with one number in each line").splitlines()]
    lines = [line for line in lines if line]
    if lines and LEADING_NUMBER.fullmatch(lines[0]) is None:
        lines = lines[1:]
    try:
        return [float(line) for line in lines]
    except ValueError as error:
        raise InputError(f"'{path}': {error}", "one number in each line") from None


FILE_TABLES = ("structure", "bending", "panels", "payload", "joint_friction")
"""Tables of a case file that generate parts; their numbers are not parameters of the mechanism."""

TABLE_UNITS = ("m", "rad", "kg", "s", "N", "N m", "rad/s", "m/s", "m/s^2", "kg m^2", "kg/m", "K", "Pa", "N m^2", "N/m", "1/K")
"""SI units of the numbers in `FILE_TABLES`."""

NAMES_EXAMPLE = '"structure.bars.material" = ["steel", "aluminium"]'  # parameter with names as values, which error texts show

MechanismReader = Callable[[Mapping[str, str]], Mechanism]  # function(name by parameter path) that returns the mechanism


def make_names(given: Sequence[Any], probabilities: Sequence[Any] = ()) -> Names:
    """Return a variation over the entries of a list: texts, or other values as in a case file."""
    try:
        shares = tuple(map(float, probabilities))
    except (TypeError, ValueError):
        raise InputError(f"probabilities = {toml(list(probabilities))}", "numbers", "probabilities = [0.3, 0.7]") from None
    return Names(tuple(value if isinstance(value, str) else toml(value) for value in given), shares)


def read_listed(text: str) -> Names | None:
    """Return a variation over the names in brackets, as in ``[steel, aluminium]``; None for any other text."""
    inside = text.strip()
    if not (inside.startswith("[") and inside.endswith("]")):
        return None
    with suppress(ValueError):
        return make_names(tomllib.loads(f"names = {inside}")["names"])
    return make_names([name.strip() for name in inside[1:-1].split(",")])


def number_of_file(parameter: str, given: str | Variation, folder: Path) -> Factor:
    """Return the factor that varies a number in one of `FILE_TABLES`; a range must have a count of values, its levels."""
    unit = unit_of(given) if isinstance(given, str) else ""
    si = unit_like(unit, TABLE_UNITS) if unit else "1"
    if not si:
        raise InputError(
            f"'{parameter}' over '{given}': unknown dimension of '{unit}'", f"a unit of one of {', '.join(TABLE_UNITS)}"
        )
    variation = read_variation(given, Quantity(si), parameter=parameter, folder=folder) if isinstance(given, str) else given
    if not isinstance(variation, Levels | Interval):
        what = f"'{parameter}' over a distribution: each of its values gives another mechanism"
        raise InputError(what, "a list, or a range with a number of values", '"1..3 mm, 5 values"')
    levels = Levels(tuple(variation.levels().tolist()))
    return Factor(parameter, levels, unit, unit_factor(unit, si) if unit else 1.0, si=si)


def unit_like(unit: str, among: Iterable[str]) -> str:
    """Return the first unit of `among` with the dimension of `unit`; "" if there is none."""
    for si in among:
        with suppress(InputError):
            unit_factor(unit, si)
            return si
    return ""


def variants_of(factors: Sequence[Factor], read: MechanismReader | None) -> tuple[Mechanism, ...]:
    """Return a mechanism for each combination of names and of levels in `FILE_TABLES`; the last factor varies fastest.

    Without factors of these kinds the result is empty.
    """
    apart = [factor for factor in factors if factor.texts]
    if not apart:
        return ()
    if read is None:
        what = f"'{apart[0].path}': the mechanism has no case file"
        raise InputError(what, "a case file, or the value of each name", "{'A.friction': {'lugre': sd.LuGre(kinetic=0.1)}}")
    count = math.prod(len(factor.texts) for factor in apart)
    most = 64  # limits the work: each mechanism is read, stored, and simulated in its own batch
    if count > most:
        what = f"{count} combinations of {' and '.join(factor.path for factor in apart)}"
        raise InputError(what, f"at most {most}; fewer names or levels, or several studies", '"1..3 mm, 5 values"')
    return tuple(
        read(dict(zip((factor.path for factor in apart), texts, strict=True)))
        for texts in itertools.product(*(factor.texts for factor in apart))
    )


def reader_by_change(
    case: Path, changes: Sequence[str], options: Options, values: Mapping[str, Mapping[str, Any]] | None = None
) -> MechanismReader:
    """Return a function that reads a case file with chosen names, which are set like ``--set`` changes."""
    values = values or {}

    def read(names: Mapping[str, str]) -> Mechanism:
        which = ", ".join(f"'{parameter}' = '{name}'" for parameter, name in names.items())
        ordered = sorted(
            names, key=lambda parameter: parameter.count(".")
        )  # a parent key is set before the keys below it, such as a section before its wall thickness
        written = [f"{parameter}={names[parameter]}" for parameter in ordered if parameter not in values]
        try:
            case_read = read_case(case, [*changes, *written])
        except InputError as error:
            raise InputError(f"{which}: {error.what}", error.expected, error.example) from None
        if case_read.run != options:
            raise InputError(
                f"{which}: the names change the options of the runs", "names that change only the mechanism", NAMES_EXAMPLE
            )
        return reader_by_object(case_read.mechanism, values)(
            {parameter: name for parameter, name in names.items() if parameter in values}
        )

    return read


def reader_by_object(mechanism: Mechanism, values_of: Mapping[str, Mapping[str, Any]]) -> MechanismReader:
    """Return a function that returns a mechanism with chosen names; `values_of` has the object for each name, by parameter.

    If the object is a mechanism, it replaces the mechanism; otherwise it is the new value of the parameter.
    """

    def read(names: Mapping[str, str]) -> Mechanism:
        unknown = next((parameter for parameter in names if parameter not in values_of), None)
        if unknown is not None:
            sample = f"{{'{unknown}': {{'{names[unknown]}': ...}}}}"
            raise InputError(
                f"'{unknown}' = '{names[unknown]}': the mechanism has no case file", "the value of the name", sample
            )
        values = {parameter: values_of[parameter][name] for parameter, name in names.items()}
        mechanism_read = next((value for value in values.values() if isinstance(value, Mechanism)), mechanism)
        for parameter, value in values.items():
            mechanism_read = mechanism_read if isinstance(value, Mechanism) else changed(mechanism_read, parameter, value)
        return mechanism_read

    return read
