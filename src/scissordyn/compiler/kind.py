"""Define the types of values in kernels, and how C writes them."""

from __future__ import annotations

import ast
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, get_args, get_origin

import numpy as np

from scissordyn.errors import InputError
from scissordyn.kernel import ArrayType, fields_of


class TranslationError(InputError):
    """Error for a kernel that uses unsupported Python."""

    placed = False

    def at(self, node: ast.AST, place: str) -> TranslationError:
        """Return the error with the node's file and line added, unless it has them already."""
        if self.placed:
            return self
        error = type(self)(f"{place.format(getattr(node, 'lineno', '?'))}: {self.what}", self.expected)
        error.placed = True
        return error


class SourceError(TranslationError):
    """Error for a kernel without source text, such as a function typed at a prompt."""


# Each type has its name in C (`c`) and a letter or word (`letter`) for the names of functions.


@dataclass(frozen=True)
class Scalar:
    """Type of a number."""

    c: str
    letter: str
    rank: int  # Arithmetic of two numbers has the type of higher rank


# Types of numbers: name in C, letter in the names of functions, rank
VOID = Scalar("void", "v", -1)
BOOL = Scalar("int", "b", 0)
INT = Scalar("int64_t", "i", 1)
FLOAT = Scalar("double", "f", 2)
DUAL = Scalar("dual", "d", 3)  # Dual number: a value with its derivatives, see dual.c


@dataclass(frozen=True)
class Record:
    """Type of an entry of a structured array; its expressions are pointers."""

    c: str
    fields: tuple[tuple[str, Scalar], ...]

    @property
    def letter(self) -> str:
        return self.c


@dataclass(frozen=True)
class Array:
    """Type of an array of numbers or records: a pointer, the shape, and in two dimensions the row stride."""

    element: Scalar | Record
    dimensions: int

    @property
    def letter(self) -> str:
        return f"{self.element.letter.upper() if isinstance(self.element, Scalar) else self.element.c}{self.dimensions}"

    @property
    def c(self) -> str:
        return f"{self.letter}_array"


@dataclass(frozen=True)
class Tuple:
    """Type of a tuple of values."""

    items: tuple[Kind, ...]

    @property
    def letter(self) -> str:
        return "t" + "".join(item.letter for item in self.items)

    @property
    def alike(self) -> bool:
        """True if all items have one type, so that the tuple can have a variable index."""
        return len({item.letter for item in self.items}) == 1

    @property
    def c(self) -> str:
        return f"tuple_{len(self.items)}{self.items[0].letter}" if self.alike else f"tuple_{self.letter[1:]}"

    def literal(self, items: Iterable[str]) -> str:
        """Return the C expression of a tuple of this type with the given items, which are C expressions; "" if it is empty."""
        inner = ", ".join(items)
        return f"({self.c}){{{{{inner}}}}}" if self.alike else f"({self.c}){{{inner}}}" if self.items else ""


class Struct:
    """Type of a named tuple of arrays; its expressions are pointers."""

    def __init__(self, name: str, fields: Mapping[str, Kind]) -> None:
        self.letter = self.c = name
        self.fields = dict(fields)


@dataclass(frozen=True)
class Called:
    """Type of a function passed as an argument; C has no such argument, because the callee is translated for this function."""

    function: Any
    c = ""

    @property
    def letter(self) -> str:
        return f"{getattr(self.function, '__module__', '')}.{getattr(self.function, '__qualname__', self.function)}"


@dataclass(frozen=True)
class Functions:
    """Type of a named tuple of functions; C has no such argument either."""

    named: Any
    c = ""

    @property
    def letter(self) -> str:
        return f"functions_{id(self.named)}"


Kind = Scalar | Record | Array | Tuple | Struct | Called | Functions


def is_empty(kind: Kind) -> bool:
    """Return whether values of a type are not passed in C: functions, modules and empty tuples."""
    return isinstance(kind, Called | Functions) or (isinstance(kind, Tuple) and not kind.items)


def has_derivatives(kind: Kind) -> bool:
    """Return whether values of a type are dual numbers, or tuples with dual numbers."""
    return kind == DUAL or (isinstance(kind, Tuple) and any(map(has_derivatives, kind.items)))


@dataclass(frozen=True)
class Value:
    """Expression in C with its type, and its value if it is a constant."""

    c: str
    kind: Kind
    constant: Any = None


NUMBERS = {"f": FLOAT, "i": INT, "b": BOOL}  # Types of array entries by the kind of their NumPy dtype
SCALARS = {int: INT, float: FLOAT, bool: BOOL, type(None): VOID}  # Types of numbers by their Python type


def kind_of(value: Any, name: str = "", types: dict[Any, Any] | None = None) -> Kind:
    """Return the type of a Python value; `types` collects the types of records and named tuples."""
    types = {} if types is None else types
    if isinstance(value, bool | np.bool_):
        return BOOL
    if isinstance(value, int | np.integer):
        return INT
    if isinstance(value, float | np.floating):
        return FLOAT
    if isinstance(value, np.ndarray):
        return Array(_element(value.dtype, name, types), value.ndim)
    if hasattr(value, "_asdict"):
        return kind_of_hint(type(value), name, types)
    if isinstance(value, tuple):
        return Tuple(tuple(kind_of(part, name, types) for part in value))
    raise TranslationError(f"unsupported {type(value).__name__} in a kernel", "numbers, arrays and tuples of them")


def kind_of_hint(hint: Any, name: str, types: dict[Any, Any], number: Scalar = FLOAT) -> Kind:
    """Return the type that an annotation declares, with `number` instead of floats; `types` and `name` as in `kind_of`."""
    if hint in SCALARS:
        return number if hint is float else SCALARS[hint]
    if get_origin(hint) is Annotated:
        declared_type: ArrayType = get_args(hint)[1]
        return Array(_element(declared_type.dtype, name, types, number), declared_type.dimensions)
    if get_origin(hint) is tuple:
        return Tuple(tuple(kind_of_hint(part, name, types, number) for part in get_args(hint)))
    if hasattr(hint, "_fields"):
        if hint not in types:
            types[hint] = Struct(hint.__name__, {key: kind_of_hint(part, key, types, number) for key, part in fields_of(hint)})
        struct: Struct = types[hint]
        return struct
    raise TranslationError(
        f"'{name}' of a kernel has the unsupported type {hint!r}", "int, float, F1, F2, F3, I1, I2 or a named tuple of these"
    )


def _element(dtype: np.dtype, name: str, types: dict[Any, Any], number: Scalar = FLOAT) -> Scalar | Record:
    """Return the type of the entries of an array with a NumPy dtype, with `number` instead of floats.

    A new record type is named after `name` and added to `types`.
    """
    kinds = {**NUMBERS, "f": number}
    if dtype.names is None:
        return kinds[dtype.kind]
    fields = tuple((field, kinds[dtype[field].kind]) for field in dtype.names)
    if fields not in types:
        taken = [kind.c for kind in types.values()]
        named = f"{name}_record" if f"{name}_record" not in taken else f"{name}_record_{len(taken)}"
        types[fields] = Record(named, fields)
    record: Record = types[fields]
    return record


def joined(first: Kind | None, second: Kind) -> Kind:
    """Return the type of a variable to which values of two types are assigned."""
    if first is None or first == second:
        return second
    if isinstance(first, Scalar) and isinstance(second, Scalar):
        return first if first.rank >= second.rank else second
    if isinstance(first, Tuple) and isinstance(second, Tuple) and len(first.items) == len(second.items):
        return Tuple(tuple(joined(a, b) for a, b in zip(first.items, second.items, strict=True)))
    raise TranslationError(
        f"a variable in a kernel has values of the types {first.letter} and {second.letter}", "values of one type"
    )


def converted(value: Value, kind: Kind) -> Value:
    """Return a number, or the numbers of a tuple, with derivatives if the wanted type has them."""
    if kind == value.kind or not (kind == DUAL or (isinstance(kind, Tuple) and DUAL in kind.items)):
        return value
    if not isinstance(kind, Tuple) or not isinstance(value.kind, Tuple):
        return Value(f"as_dual({value.c})", DUAL)
    old = Value("kept_0", value.kind)
    items = (converted(Value(item_of(old, k), value.kind.items[k]), item).c for k, item in enumerate(kind.items))
    return Value(f"({{ {value.kind.c} kept_0 = {value.c}; {kind.literal(items)}; }})", kind)


def item_of(base: Value, at: int) -> str:
    """Return the C expression of a tuple's item."""
    assert isinstance(base.kind, Tuple)
    return f"{base.c}.v[{at}]" if base.kind.alike else f"{base.c}.e{at}"


def written(number: Any) -> str:
    """Return a number as a C literal."""
    if isinstance(number, bool | np.bool_):
        return str(int(number))
    if isinstance(number, int | np.integer):
        return f"{int(number)}LL" if abs(int(number)) > 2**31 - 1 else str(int(number))
    value = float(number)
    if value != value:
        return "NAN"
    if value in (float("inf"), float("-inf")):
        return "INFINITY" if value > 0 else "-INFINITY"
    return repr(value)


def declared(kind: Kind) -> str:
    """Return the type of a variable or argument as C declares it."""
    return f"{kind.c} *" if isinstance(kind, Record | Struct) else f"{kind.c} "
