"""Convert text with units to numbers in SI units, and back."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Iterable
from functools import cache
from tokenize import TokenError
from typing import TYPE_CHECKING, NamedTuple

from scissordyn.errors import InputError, did_you_mean
from scissordyn.units import Quantity

if TYPE_CHECKING:
    import pint


# Definitions of unit prefixes, in the notation of the library pint
PREFIX_DEFINITIONS = ("giga- = 1e9 = G-", "mega- = 1e6 = M-", "kilo- = 1e3 = k-", "centi- = 1e-2 = c-", "milli- = 1e-3 = m-")

# Definitions of further unit prefixes for pint
SMALL_PREFIX_DEFINITIONS = ("micro- = 1e-6 = µ- = μ- = u-", "nano- = 1e-9 = n-")
# Definitions of prefixes and units for pint. In pint's own list an angle is a pure number: "0.1 %" is an angle, and 1 Hz is
# 1 rad/s. Here an angle is a dimension, and 1 Hz is one revolution per second. This list also loads twenty times faster.
UNIT_DEFINITIONS = (
    "cycle = [cycle]",
    "meter = [length] = m = metre",
    "second = [time] = s",
    "kelvin = [temperature] = K",
    "gram = [mass] = g",
    "radian = [angle] = rad",
    "minute = 60 * second = min",
    "hour = 60 * minute = h",
    f"degree = {math.pi / 180.0!r} * radian = deg = °",
    f"turn = {2.0 * math.pi!r} * radian = _ = rev = revolution",
    "rpm = turn / minute",
    "hertz = turn / second = Hz",
    "newton = kilogram * meter / second**2 = N",
    "pascal = newton / meter**2 = Pa",
    "joule = newton * meter = J",
    "watt = joule / second = W",
    "bar = 1e5 * pascal",
    "tonne = 1e3 * kilogram = t",
    "inch = 0.0254 * meter = in = inches",
    "foot = 12 * inch = ft = feet",
    "pound = 0.45359237 * kilogram = lb",
    "pound_force = 4.4482216152605 * newton = lbf",
    "psi = pound_force / inch**2",
)
KNOWN_UNITS = (
    "m mm cm km um s ms us min h kg g t rad deg turn rpm Hz N kN Pa kPa MPa GPa J W in ft lb lbf psi bar K "
    "meter millimeter centimeter micrometer second millisecond minute kilogram gram radian degree newton pascal"
)
"""Units that error messages can suggest instead of a mistyped unit."""

# Units that are recognised in a product of units without blanks, such as kNm
JOINABLE_UNITS = frozenset((*KNOWN_UNITS.split(), "mN", "MN", "kJ", "kW"))

REVOLUTIONS_PER_MINUTE = re.compile(r"(?:1\s*/\s*min|min\s*(?:\^|\*\*)\s*-1)", re.IGNORECASE)
"""Pattern of the spellings of revolutions per minute in drawings and catalogues."""

USUAL_UNITS = {
    "m": ("m", "mm"),
    "s": ("s", "ms"),
    "m/s": ("m/s", "mm/s"),
    "rad": ("deg",),
    "rad/s": ("rpm",),
    "Pa": ("GPa", "MPa", "Pa"),
    "N": ("kN", "N"),
    "m/rad": ("m/rad", "mm/rad", "mm/turn"),
}
"""Units in which messages and case files show a number, largest first, by its SI unit."""

CELSIUS = ("degC", "°C")  # units of temperature whose zero is not 0 K

UNIT_FACTORS = {
    ("mm", "m"): 1e-3,
    ("cm", "m"): 1e-2,
    ("um", "m"): 1e-6,
    ("ms", "s"): 1e-3,
    ("us", "s"): 1e-6,
    ("min", "s"): 60.0,
    ("g", "kg"): 1e-3,
    ("t", "kg"): 1e3,
    ("deg", "rad"): math.pi / 180.0,
    ("turn", "rad"): 2.0 * math.pi,
    ("rpm", "rad/s"): math.pi / 30.0,
    ("deg/s", "rad/s"): math.pi / 180.0,
    ("Hz", "rad/s"): 2.0 * math.pi,
    ("mm/s", "m/s"): 1e-3,
    ("mm/rad", "m/rad"): 1e-3,
    ("mm/turn", "m/rad"): 1e-3 / (2.0 * math.pi),
    ("mm^2", "m^2"): 1e-6,
    ("mm^3/(N m)", "m^2/N"): 1e-9,
    ("kN", "N"): 1e3,
    ("kN/m", "N/m"): 1e3,
    ("N/mm", "N/m"): 1e3,
    ("kN m", "N m"): 1e3,
    ("MPa", "Pa"): 1e6,
    ("GPa", "Pa"): 1e9,
}
"""Conversion factors of common units, equal to pint's; they avoid the import of pint, which takes a tenth of a second."""

SI_UNITS = (
    *("m", "m/s", "m/s^2", "rad", "rad/s", "s", "1/s", "1/m", "s/m", "kg", "kg m^2", "kg/m^3"),
    *("N", "N m", "N/m", "N s", "N s/m", "N m/s", "N m/rad", "N m s/rad", "N m/(rad s)", "Pa", "K", "1/K"),
)
"""SI units of all values in case files."""

UNIT_FACTORS |= dict.fromkeys(zip(SI_UNITS, SI_UNITS, strict=True), 1.0)

# Pattern of a number in a list of numbers, with the comma or blank after it
NUMBER = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?|[+-]?(?:nan|inf)\b)\s*,?\s*")
LEADING_NUMBER = re.compile(f"{NUMBER.pattern}(.*)", re.DOTALL)  # Pattern of a text that begins with a number
UNIT_TEXT = re.compile(r"[\w°²³·*/^()\s-]*")  # Pattern of a text that contains only characters of units
UNLIKELY_UNIT_PATTERN = re.compile("(giga|mega)(radian|degree|turn|meter|second)")
"""Pattern of units such as gigaradian, which pint reads from "Grad" (German for degree): most likely a mistake."""

UNLIKELY_POWER_PATTERN = re.compile(r"(?:\^|\*\*)[^a-zA-Z]*?(?:\d\d|\^|\*\*)")
"""Pattern of exponents that no unit has; pint would never finish evaluating 9^9^9^9."""


@cache
def _registry() -> pint.UnitRegistry[float]:
    import pint

    registry: pint.UnitRegistry[float] = pint.UnitRegistry(None)
    for definition in (*PREFIX_DEFINITIONS, *SMALL_PREFIX_DEFINITIONS, *UNIT_DEFINITIONS):
        registry.define(definition)
    return registry


@cache
def unit_factor(unit: str, target: str) -> float:
    """Return the conversion factor from `unit` to `target`; raise `InputError` for an unknown unit or another dimension."""
    if (unit, target) in UNIT_FACTORS:
        return UNIT_FACTORS[unit, target]
    if not UNIT_TEXT.fullmatch(unit) or UNLIKELY_POWER_PATTERN.search(unit):
        raise InputError(f"'{unit}' is not a unit")
    import pint

    registry = _registry()
    try:
        parsed = registry.parse_units(unit)
        factor = float(registry.convert(1.0, parsed, registry.parse_units(target)))
    except pint.UndefinedUnitError as error:
        unknown = str(error).split("'")[1]  # all versions of pint quote the name of the unit
        apart = _spaced(unknown, unit, target)
        fitting = [name for name in (*KNOWN_UNITS.split(), "N m") if _fits(unit.replace(unknown, name), target)]
        near = f" (did you mean '{apart}'?)" if apart else did_you_mean(unknown, fitting)
        raise InputError(f"unknown unit '{unknown}'{near}") from None
    except pint.DimensionalityError:
        likely = " (did you mean 'rpm'?)" if target == "rad/s" and REVOLUTIONS_PER_MINUTE.fullmatch(unit) else ""
        raise InputError(f"wrong dimension: '{unit}' is not a unit of [{target}]{likely}") from None
    except (
        pint.PintError,
        ArithmeticError,
        AssertionError,
        ValueError,
        TypeError,
        TokenError,
    ):  # pint raises many kinds of errors; since Python 3.12 the tokenizer raises one for unbalanced brackets
        raise InputError(f"'{unit}' is not a unit") from None
    if large := UNLIKELY_UNIT_PATTERN.search(str(parsed)):
        likely, others = {"meter": ("mm", "m, mm, km"), "second": ("ms", "s, ms")}.get(large[2], ("deg", "deg, rad, turn"))
        raise InputError(f"unit '{unit}' is a {parsed} (did you mean '{likely}'?)", others)
    return factor


def _fits(unit: str, target: str) -> bool:
    """Return whether a text is a unit of the dimension of `target`."""
    import pint

    if not UNIT_TEXT.fullmatch(unit):
        return False
    registry = _registry()
    try:
        return bool(registry.parse_units(unit).dimensionality == registry.parse_units(target).dimensionality)
    except (pint.PintError, ArithmeticError, AssertionError, ValueError, TypeError):
        return False


def _spaced(unknown: str, unit: str, target: str) -> str:
    """Split an unknown word such as "kNm" into known units with blanks; return "" unless it then has the target's dimension."""
    places = range(1, len(unknown))
    splits = [[k] for k in places] + [[k, j] for k in places for j in range(k + 1, len(unknown))]
    for split in splits:
        ends = [0, *split, len(unknown)]
        likely = unit.replace(unknown, " ".join(unknown[a:b] for a, b in itertools.pairwise(ends)))
        if all(part in JOINABLE_UNITS for part in likely.split() if part.isalpha()):
            try:
                unit_factor(likely, target)
            except InputError:
                continue
            return likely
    return ""


def unit_typed(text: str) -> str:
    """Return the unit after the number at the start of a text; "" without a unit."""
    match = LEADING_NUMBER.fullmatch(text)
    return match[2].strip() if match is not None else ""


INTEGER_MAX = 2**1023  # Largest integer in a case file; much larger ones exceed the range of floats


def _with_unit(number: float, quantity: Quantity, sample: str) -> str:
    """Return a number with the allowed unit that brings it closest to the example `sample`, to correct a missing unit."""
    match = LEADING_NUMBER.fullmatch(sample)
    likely = float(match[1]) * unit_factor(match[2], quantity.unit) if match and match[2] else 0.0
    units = [quantity.unit] if likely else []
    units += [match[2]] if match and match[2] else USUAL_UNITS.get(quantity.unit, [quantity.unit])
    fitting = [unit for unit in units if quantity.admits(number * unit_factor(unit, quantity.unit))]
    if not fitting:
        return sample or example(quantity)
    if likely and number:
        fitting.sort(key=lambda unit: abs(math.log(abs(number * unit_factor(unit, quantity.unit) / likely))))
    return f"{number:.12g} {fitting[0]}"


def read_quantity(value: object, quantity: Quantity, sample: str = "") -> float:
    """Return the value of a quantity in SI units, from a number or a text such as "3 mm"; raise `InputError` if it is wrong."""
    wanted = quantity.expected if quantity.unit == "1" else f"{quantity.expected}, as text with its unit"
    if isinstance(value, bool) or not isinstance(value, str | int | float):
        raise InputError("not a number", wanted, sample)
    if isinstance(value, int) and not -INTEGER_MAX < value < INTEGER_MAX:
        raise InputError("out of bounds", wanted, sample)
    if quantity.unit == "1":
        if isinstance(value, str):
            raise InputError("text instead of a plain number", wanted, sample)
        number: float = value  # an integer stays an int
    elif isinstance(value, str):
        match = LEADING_NUMBER.fullmatch(value)
        if match is None:
            raise InputError("not a number with a unit", wanted, sample)
        if re.match(r"\s*[+-]?\d+,\d", value):
            raise InputError("a decimal comma", "a decimal point", value.strip().replace(",", ".", 1))
        if not match[2]:
            raise InputError("missing unit", wanted, _with_unit(float(match[1]), quantity, sample))
        if quantity.unit == "K" and match[2].strip() in CELSIUS:
            if quantity.admits(-1.0):
                raise InputError("a temperature in degC instead of a temperature difference", wanted, f"{match[1]} K")
            number = float(match[1]) + 273.15
        else:
            number = _scaled([match[1]], match[2].strip(), quantity.unit, wanted, sample)[0]
    else:
        raise InputError("missing unit", wanted, _with_unit(value, quantity, sample))
    if not quantity.admits(number):
        raise InputError("out of bounds", wanted, sample)
    return number


def read_numbers(text: object, unit: str) -> tuple[float, ...]:
    """Return numbers in SI units from text such as ``"0, 10, 20 ms"``, with one unit after the last number."""
    wanted, sample = f"finite numbers and, after the last, their unit [{unit}]", f"'0 0.1 0.2 {unit}'"
    content, numbers, at = text if isinstance(text, str) else "", list[str](), 0
    while match := NUMBER.match(content, at):
        numbers.append(match[1])
        at = match.end()
    if not numbers:
        raise InputError("a text without numbers", wanted, sample)
    values = _scaled(numbers, content[at:].strip(), unit, wanted, sample)
    if not all(map(math.isfinite, values)):
        raise InputError("a number that is not finite", wanted, sample)
    return values


def _scaled(numbers: list[str], unit: str, target: str, wanted: str, sample: str) -> tuple[float, ...]:
    if not unit:
        raise InputError("missing unit", wanted, f"{numbers[0]} {target}" if len(numbers) == 1 else sample)
    try:
        factor = 1.0 if unit == target else unit_factor(unit, target)
    except InputError as error:
        raise InputError(error.what, wanted, sample) from None
    return tuple(float(number) * factor for number in numbers)


def rounded_text(value: float, unit: str) -> str:
    """Return a value in SI units as text in a usual unit such as mm, rounded for messages and templates."""
    if unit == "1":
        return f"{value:.12g}"
    names = USUAL_UNITS.get(unit, (unit,))
    for name in names:
        scaled = value / unit_factor(name, unit)
        if abs(scaled) >= 1.0 or (value == 0.0):
            break
    return f"{scaled:.12g} {name}"


def si_value(text: str) -> float:
    """Return the value in SI units of a text that `exact_text` wrote."""
    number, unit = LEADING_NUMBER.fullmatch(text).groups()  # type: ignore[union-attr]
    target = next((target for target, names in USUAL_UNITS.items() if unit.strip() in names), None)
    return float(number) * (unit_factor(unit.strip(), target) if target else 1.0)


def exact_text(values: Iterable[float], unit: str, digits_max: int = 12) -> str:
    """Return numbers as text with a unit; reading the text gives the same numbers to the last bit.

    `digits_max`: numbers with more digits are written in SI units, others in a unit such as mm if that is shorter.
    """
    numbers = tuple(map(float, values))
    candidates = []
    for name in dict.fromkeys((*USUAL_UNITS.get(unit, ()), unit)):
        factor = 1.0 if name == unit else unit_factor(name, unit)
        digits = [_digits(number, factor) for number in numbers]
        longest = max(len(text or "") for text in digits)
        if None not in digits and (name == unit or unit not in USUAL_UNITS.get(unit, ()) or longest <= digits_max):
            candidates.append(f"{', '.join(map(str, digits))} {name}")
    return min(candidates, key=len)  # the SI unit, with factor 1, is always a candidate


def _digits(number: float, factor: float) -> str | None:
    """Return the shortest decimal text whose product with `factor` is `number` to the last bit; None if there is none."""
    scaled = number / factor
    for precision in (15, 16, 17):
        text = f"{scaled:.{precision}g}"
        if repr(float(text) * factor) == repr(number):
            return text
    return None


class NumbersText(NamedTuple):
    """Schema of a text with one or several numbers and a unit after the last one."""

    unit: str  # SI unit; multiples of it are allowed
    numbers: int | None = 1  # None for any number of values
    negative: bool = True  # True if negative values are allowed

    @property
    def name(self) -> str:
        """Name of the regular expression that checks the text."""
        slug = re.sub(r"[\^()]", "", self.unit.replace("/", "_per_").replace(" ", "_"))
        count = {None: "numbers", 1: "number"}.get(self.numbers, f"{self.numbers}_numbers")
        return f"{count}_{slug}" + ("" if self.negative else "_not_negative")


def example(quantity: Quantity) -> str:
    """Return an allowed value of a quantity as the text of a case file, for error messages."""
    low = next((bound for bound in (quantity.above, quantity.minimum) if bound is not None), 0.0)
    high = next((bound for bound in (quantity.below, quantity.maximum) if bound is not None), low + 2.0)
    candidates = (1.0, 0.5 * (low + high), low, high)
    admitted = next(value for value in candidates if quantity.admits(value))
    return rounded_text(admitted, quantity.unit)
