"""Declare and check units and bounds of dataclass fields and function arguments.

Inside the package every number is SI and every angle is in radians.
"""

from __future__ import annotations

import dataclasses
import functools
import inspect
import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from types import MappingProxyType, SimpleNamespace
from typing import Annotated, Any, Literal, ParamSpec, TypeVar, get_args, get_origin, get_type_hints

from scissordyn.annotation import MismatchError, accepted, in_words, is_number, members, plain_hint, shown, type_decides
from scissordyn.errors import InputError, did_you_mean
from scissordyn.lookup import describe_unexpected
from scissordyn.numeral import PREFIXES, numerals, prefix

RANGES: Mapping[str, tuple[float, float]] = {
    "1": (1e-12, 1e12),
    "m": (1e-12, 1e6),
    "s": (1e-12, 1e9),
    "kg": (1e-12, 1e9),
    "kg m^2": (1e-24, 1e15),
    "rad": (1e-12, 1e9),
    "rad/s": (1e-9, 1e7),
    "m/s": (1e-12, 1e5),
    "m/s^2": (1e-12, 1e6),
    "N": (1e-12, 1e12),
    "N m": (1e-12, 1e12),
}
"""Smallest positive and largest plausible number by unit, with a margin of orders of magnitude.

Numbers outside are rejected as mistakes, because their powers exceed the range of floats. Bounds that a field declares have
priority.
"""

ANY_RANGE = (1e-30, 1e30)  # smallest positive and largest plausible number in a unit that `RANGES` does not contain


@dataclass(frozen=True)
class State:
    """Internal state of a component, a controller, a damping law or a friction law.

    Parameters
    ----------
    name : str
        Name of the kernel argument.
    unit : str
        SI unit; "1" for a pure number.
    scale : float or callable, optional
        Typical size of the state, in its unit: the error of a step may be the tolerance times the scale. It may be a function
        of the part, for example ``lambda part: part.torque / part.stiffness``. If forces depend only on the difference between
        a state and a coordinate, the scale is the size of that difference. Friction laws with a kernel `start` may omit the
        scale; it is then the state of sliding at 1 m/s.
    """

    name: str
    unit: str
    scale: float | Callable[[Any], float] | None = None

    def size(self, part: Any) -> float:
        """Return the scale for one part.

        Raises
        ------
        InputError
            If the scale is not a finite number above zero.
        """
        scale = self.scale(part) if callable(self.scale) else self.scale
        if not is_number(scale) or not 0.0 < scale < math.inf:  # type: ignore[operator]
            raise InputError(
                f"'{part.name}': the scale of its state '{self.name}' is {shown(scale)}",
                f"a finite number above zero [{self.unit}]",
                f'State("{self.name}", "{self.unit}", scale=1e-3)',
            )
        return float(scale)  # type: ignore[arg-type]


def degrees(angle: float) -> float:
    """Convert an angle in degrees to radians [rad]."""
    return math.radians(_plain("degrees", angle))


def rpm(speed: float) -> float:
    """Convert a speed in revolutions per minute to an angular velocity [rad/s]."""
    return _plain("rpm", speed) * 2.0 * math.pi / 60.0


def _plain(function: str, value: Any) -> float:
    if not is_number(value) or not math.isfinite(value):
        number = LEADING_NUMBER.match(value) if isinstance(value, str) else None
        raise InputError(f"{function}({shown(value)})", "a finite number", f"{function}({number[0].strip() if number else 30})")
    return float(value)


LEADING_NUMBER = re.compile(r"\s*[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?")  # a number at the start of a text


@dataclass(frozen=True)
class Sample:
    """Example value for error messages; its text is Python code, and case-file errors write it with its unit."""

    key: str
    value: float  # in SI units
    unit: str  # SI unit

    def __str__(self) -> str:
        written = {"rad": f"degrees({math.degrees(self.value):.6g})", "rad/s": f"rpm({self.value * 30.0 / math.pi:.6g})"}
        return f"{self.key}={written.get(self.unit, f'{self.value:.6g}')}"


@dataclass(frozen=True)
class Quantity:
    """Unit, bounds and help text of an annotated number.

    Used as ``Annotated[float, Quantity("m", above=0.0, help="radial clearance")]``.

    Parameters
    ----------
    unit : str
        SI unit as shown to the user; "1" for a pure number.
    above, below : float, optional
        Open bounds.
    minimum, maximum : float, optional
        Closed bounds. If no bound is given, and for ``above=0.0``, the bound is that of `RANGES` for the unit.
    help : str
        Description of the number in one line.
    tied : str
        Parameter to change instead of this number, if the number also occurs elsewhere and cannot change alone.
    zero : str
        What zero means, if it is not the limit of small numbers.
    """

    unit: str
    above: float | None = None
    below: float | None = None
    minimum: float | None = None
    maximum: float | None = None
    help: str = ""
    tied: str = ""
    zero: str = ""

    def __post_init__(self) -> None:
        if not isinstance(self.unit, str):
            raise InputError(f"Quantity({shown(self.unit)})", "a unit as text", 'Quantity("m")')
        smallest, largest = RANGES.get(self.unit, ANY_RANGE)
        if self.above == 0.0 and self.minimum is None:
            object.__setattr__(self, "above", None)
            object.__setattr__(self, "minimum", smallest)
        if self.above is None and self.minimum is None:
            object.__setattr__(self, "minimum", -largest)
        if self.below is None and self.maximum is None:
            object.__setattr__(self, "maximum", largest)

    @property
    def bounds(self) -> str:
        """Text of bounds and unit, for example ``from 0 to 1``, or ``> 0 and <= 1 [m]``."""
        low = f"> {self.above:g}" if self.above is not None else f">= {self.minimum:g}"
        high = f"< {self.below:g}" if self.below is not None else f"<= {self.maximum:g}"
        closed = self.above is None and self.below is None
        text = f"from {self.minimum:g} to {self.maximum:g}" if closed else f"{low} and {high}"
        return text if self.unit == "1" else f"{text} [{self.unit}]"

    @property
    def expected(self) -> str:
        """Text of the expected numbers for error messages, for example ``a number from 0 to 1``."""
        return f"a number {self.bounds}"

    def admits(self, value: float) -> bool:
        """Return True if `value` is a finite number within the bounds."""
        try:
            number = float(value)
        except OverflowError:
            return False
        return (
            math.isfinite(number)
            and (self.above is None or value > self.above)
            and (self.below is None or value < self.below)
            and (self.minimum is None or value >= self.minimum)
            and (self.maximum is None or value <= self.maximum)
        )


@dataclass(frozen=True)
class Pairs:
    """Meaning of an annotated tuple of pairs: ``Annotated[tuple[Point, ...], Pairs(("angles", "moments"), ("rad", "N m"))]``.

    Parameters
    ----------
    names : (str, str)
        Names of the first and of the second numbers.
    units : (str, str)
        SI units.
    help : str
        One-line description of the pairs.
    """

    names: tuple[str, str]
    units: tuple[str, str]
    help: str = ""


@cache
def quantities(described: type) -> dict[str, Quantity]:
    """Return the quantities that the annotated fields of a dataclass declare, by field name."""
    return {name: extra for name, hint in hints_of(described).items() for extra in extras(hint) if isinstance(extra, Quantity)}


@dataclass(frozen=True)
class Meaning:
    """Meaning of a value that is not a number: ``Annotated[Friction, Meaning("a friction law", "LuGre(kinetic=0.1)")]``."""

    help: str  # one line
    example: str = ""  # a value as Python


def help_of(hint: Any) -> str:
    """Return the one-line description of a value from its annotation; "" if there is none."""
    return next((extra.help for extra in extras(hint) if getattr(extra, "help", "")), "")


def _default_text(default: Any, longest: int = 40) -> str:
    """Return the end of a parameter's line in a docstring; defaults of more characters than `longest` are not shown."""
    if default is inspect.Parameter.empty:
        return ""
    shown = f"{default:g}" if isinstance(default, float) else repr(default)
    return ", optional" if default in (None, "", ()) or len(shown) > longest or "<" in shown else f", default {shown}"


Described = TypeVar("Described", bound=Callable[..., Any])


def documented(described: Described, meanings: Mapping[str, str] = MappingProxyType({}), source: str = "") -> Described:
    """Add parameters, with units and meanings from their annotations, and a source to the docstring of a class or function."""
    text = inspect.cleandoc(described.__doc__ or "")
    hints, rows = hints_of(inspect.unwrap(described)), []
    for name, parameter in inspect.signature(described).parameters.items():
        if name == "self" or name.startswith("_"):
            continue
        about = extras(hints[name])
        units = next((extra.units for extra in about if isinstance(extra, Pairs)), ())
        unit = " and ".join(units) or next((extra.unit for extra in about if hasattr(extra, "unit")), "1")
        meaning = help_of(hints[name]) or meanings.get(name, "")
        rows.append(f"{name} : {in_words(hints[name])}{_default_text(parameter.default)}")
        rows += [f"    {meaning} [{unit}]".replace(" [1]", "")] if meaning or unit != "1" else []
    end = re.search(r"\n\n(?:Returns|Raises|References)\n-|\Z", text)
    sections = [text[: end.start()], "Parameters\n----------\n" + "\n".join(rows), text[end.start() :].strip()]  # type: ignore[union-attr]
    sections += ["References\n----------\n" + source.replace("; ", "\n")] if source else []
    described.__doc__ = "\n\n".join(filter(None, sections))
    return described


Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")


def checked(function: Callable[Arguments, Result]) -> Callable[Arguments, Result]:
    """Wrap a function so that its arguments are first compared with their annotations; a mismatch raises `InputError`."""
    signature, name = inspect.signature(function), getattr(function, "__name__", "")

    @functools.wraps(function)
    def compared(*given: Arguments.args, **named: Arguments.kwargs) -> Result:
        try:
            bound = signature.bind(*given, **named)
        except TypeError as error:
            raise TypeError(f"{name}() {describe_unexpected(signature, named) or error}") from None
        hints = hints_of(function)
        called = bound.arguments.get("name")
        owner = f"{name} '{called}'" if isinstance(called, str) and called else f"{name}()"
        for key, value in bound.arguments.items():
            parameter = signature.parameters[key]
            if key == "self" or parameter.kind is parameter.VAR_KEYWORD or value is parameter.default:
                continue
            if parameter.kind is parameter.VAR_POSITIONAL:
                bound.arguments[key] = tuple(_fitted(owner, key, item, hints[key]) for item in value)
            elif key in hints:
                bound.arguments[key] = _fitted(owner, key, value, hints[key])
        return function(*bound.args, **bound.kwargs)

    return compared


@cache
def hints_of(described: Any) -> Mapping[str, Any]:
    """Return the hints of a class's fields or a function's arguments; a result's type may exist for type checkers only."""
    if isinstance(described, type):
        return get_type_hints(described, include_extras=True)
    hints = {name: hint for name, hint in described.__annotations__.items() if name != "return"}
    resolved = dict[str, Any]()
    for name, hint in hints.items():
        annotated = SimpleNamespace(__annotations__={name: hint})
        try:
            resolved |= get_type_hints(annotated, described.__globals__, include_extras=True)
        except NameError:  # a type that only type checkers import: of other libraries Datasets are checked
            resolved |= _with_datasets(annotated, described.__globals__)
    return resolved


def _with_datasets(described: Any, names: Mapping[str, Any]) -> Mapping[str, Any]:
    import xarray as xr

    try:
        return get_type_hints(described, {**names, "xr": xr}, include_extras=True)
    except NameError:
        return dict.fromkeys(described.__annotations__, Any)


@cache
def extras(hint: Any) -> tuple[Any, ...]:
    """Return the metadata of an annotation, or of the members of a union."""
    return tuple(extra for layer in (hint, *get_args(hint)) if get_origin(layer) is Annotated for extra in get_args(layer)[1:])


@cache
def _quantity(hint: Any) -> Quantity | None:
    return next((extra for extra in extras(hint) if isinstance(extra, Quantity)), None)


def check_quantities(instance: Any, named: str = "") -> None:
    """Raise `InputError` for the first field of a dataclass instance that does not fit its annotation.

    Numbers of other libraries are converted to Python numbers, and lists to tuples. `named` is the name of the instance in the
    error.
    """
    described: type = type(instance)
    for declared in _declared(described):
        value = getattr(instance, declared.name)
        if declared.admits(value):
            continue
        fitting = _fitted(named or described.__name__, declared.name, value, declared.hint, declared.field)
        if fitting is not value:
            object.__setattr__(instance, declared.name, fitting)
        else:
            declared.fits(value)


@dataclasses.dataclass(slots=True)
class _Declared:
    """Field of a dataclass with a cache of types and values that fit its annotation, because the full check is slow."""

    name: str
    quantity: Quantity | None
    hint: Any
    field: Any
    decided: bool  # True if the type of a value is sufficient to check it
    types: set[type] = dataclasses.field(default_factory=set)
    last: Any = dataclasses.field(default_factory=object)  # last immutable value that fits

    def admits(self, value: Any) -> bool:
        """Return True if the cache contains that a value fits unchanged."""
        if self.quantity is not None and type(value) is float:
            return self.quantity.admits(value)
        return type(value) in self.types or value is self.last

    def fits(self, value: Any) -> None:
        """Add a value that fits unchanged to the cache: its type if that is sufficient, otherwise the value itself."""
        if self.decided:
            self.types.add(type(value))
        elif value is None or type(value) in (tuple, str, int):
            self.last = value


@cache
def _declared(described: type) -> tuple[_Declared, ...]:
    """Return the fields of a dataclass that its constructor accepts, with the quantities of numbers."""
    fields, hints = [field for field in dataclasses.fields(described) if field.init], hints_of(described)
    parts = []
    for field in fields:
        hint = hints[field.name]
        quantity = _quantity(hint)
        kept = quantity if plain_hint(hint) in (float, float | None) else None
        parts.append(_Declared(field.name, kept, hint, field, quantity is None and type_decides(hint)))
    return tuple(parts)


def _fitted(owner: str, name: str, value: Any, hint: Any, field: Any = None) -> Any:
    """Return a value converted to the Python types of its annotation; raise `InputError` if it does not fit."""
    quantity = _quantity(hint)
    try:
        fitting = accepted(value, plain_hint(hint))  # hashes of annotations are slow
    except MismatchError:
        if quantity is not None:
            raise _out_of_bounds(owner, name, value, hint, quantity) from None
        near = did_you_mean(value, get_args(plain_hint(hint))) if get_origin(plain_hint(hint)) is Literal else ""
        example = _example(name, value, hint, field)
        raise InputError(f"{owner}: {name} = {shown(value)}{near}", _allowed(hint), example) from None
    if quantity is None or fitting is None or isinstance(fitting, str):  # a text that is allowed as an alternative to a number
        return fitting
    numbers = tuple(fitting.values()) if isinstance(fitting, Mapping) else fitting if isinstance(fitting, tuple) else (fitting,)
    if not all(quantity.admits(number) for number in numbers):
        raise _out_of_bounds(owner, name, value, hint, quantity)
    return fitting


def _allowed(hint: Any) -> str:
    """Return the text of the allowed values of an annotation; for a protocol, its description."""
    meaning = next((extra.help for extra in extras(hint) if isinstance(extra, Meaning)), "")
    kinds = (plain_hint(hint), *get_args(plain_hint(hint)))
    named = any(getattr(kind, "_is_protocol", False) or hasattr(kind, "slot") for kind in kinds)
    return meaning if meaning and named else in_words(hint)


def _out_of_bounds(owner: str, name: str, value: Any, hint: Any, quantity: Quantity) -> InputError:
    plain = plain_hint(hint)
    expected = f"{'a whole number' if int in members(plain) else 'a number'} {quantity.bounds}"
    pairs = [kind for kind in members(plain) if get_origin(kind) is tuple]
    if pairs:
        expected = f"{'several' if ... in get_args(pairs[0]) else 'two'} numbers {quantity.bounds}"
    sample: Sample | str = ""
    if isinstance(value, str) and int not in members(plain):
        sample = _as_number(name, value, quantity)
    return InputError(f"{owner}: {name} = {shown(value)}", expected, sample)


def _as_number(name: str, text: str, quantity: Quantity) -> Sample | str:
    """Return the Python code that the user should write instead of a text with number and unit."""
    start = LEADING_NUMBER.match(text)
    number, unit = (float(start[0]), text[start.end() :].strip()) if start else (math.nan, "")
    factor = {"deg": math.radians(1.0), "rpm": math.pi / 30.0, "mm": 1e-3, "ms": 1e-3, quantity.unit: 1.0, "": 1.0}.get(unit)
    value = number * factor if factor is not None and math.isfinite(number) else math.nan
    return Sample(name, value, quantity.unit) if quantity.admits(value) else f"{name}=NUMBER"


def _example(name: str, value: Any, hint: Any, field: Any) -> str:
    """Return the Python code that the user should write instead of a value of a wrong type."""
    sample = next((extra.example for extra in extras(hint) if isinstance(extra, Meaning) and extra.example), "")
    if isinstance(value, type):
        try:
            accepted(value(), hint)
        except Exception:  # a class without default arguments is not an example
            pass
        else:
            return f"{name}={value.__name__}()"
    if not sample and isinstance(value, str) and plain_hint(hint) == tuple[str, str] and "." in value:
        body, _, point = value.rpartition(".")
        sample = f'("{body}", "{point}")'
    if not sample and field is not None and field.default_factory is not dataclasses.MISSING:
        sample = f"{field.default_factory.__name__}()" if isinstance(field.default_factory, type) else ""
    if not sample or "=" in sample.partition("(")[0]:
        return sample
    return f"{name}={sample}"


def counted(number: int, thing: str = "contact") -> str:
    """Return a count with its noun: "1 contact", "2 contacts", "3 bodies"."""
    return f"{number} {thing}" if number == 1 else f"{number} " + re.sub("([^aeiou])y$", r"\1ie", thing) + "s"


PREFIXED_UNITS = frozenset(("m", "s", "g", "N", "J", "W", "Pa", "Hz", "rad"))
"""Units that get a prefix, alone or as the first of a product or quotient; in mm^2 the prefix itself would be squared."""


def _prefixed(value: float, unit: str) -> tuple[float, str]:
    """Return a number and its unit with a prefix, where the unit can have one; masses below 1 kg are in grams."""
    if unit == "kg" and abs(value) < 1.0:
        value, unit = 1e3 * value, "g"
    first = unit.replace("/", " ").partition(" ")[0]
    power = prefix(abs(value)) if first in PREFIXED_UNITS and " or " not in unit else 0
    return value / 10.0**power, PREFIXES[power] + unit


def cell(value: float, unit: str) -> str:
    """Return a number with its unit as in a table, with trailing zeros."""
    scaled, shown = _prefixed(value, unit)
    (text,) = numerals([scaled])
    return text if unit == "1" or text == "-" else f"{text} {shown}"


def short(value: float, unit: str) -> str:
    """Return a number with a prefixed unit and four digits; values below 1e-15 of a unit with prefixes are shown as zero."""
    scaled, shown = _prefixed(value, unit)
    if abs(value) < 1e-3 * 10.0 ** min(PREFIXES) and (shown != unit or unit == "1" or not value):
        return f"0 {unit}"
    return f"{scaled:.4g} {shown}"
