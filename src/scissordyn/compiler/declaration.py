"""Declarations of a file of C: its types, tuples, arrays and tables of numbers."""

from __future__ import annotations

import inspect
from collections.abc import Iterable
from typing import Any

import numpy as np

from scissordyn.compiler.kind import (
    DUAL,
    FLOAT,
    INT,
    Array,
    Called,
    Functions,
    Kind,
    Record,
    Struct,
    TranslationError,
    Tuple,
    Value,
    converted,
    kind_of,
    kind_of_hint,
    written,
)

_C_WORDS = """
auto break case char const continue default do double else enum extern float for goto if inline int long register restrict
return short signed sizeof static struct switch typedef union unsigned void volatile while
"""
KEYWORDS = frozenset(_C_WORDS.split())  # Words of C that no compiled name may be


def member(name: str) -> str:
    """Return the name of a field in C."""
    return f"{name}_" if name in KEYWORDS else name


class Declarations:
    """Types and tables that the functions of a C file use.

    With `derivatives`, floats are dual numbers with that many derivatives, rounded up to an even number; those in the named
    tuples `doubles` have none.
    """

    whole = INT

    def __init__(self, types: dict[Any, Any] | None = None, *, derivatives: int = 0, doubles: Iterable[type] = ()) -> None:
        self.derivatives = derivatives + derivatives % 2  # pairs, see dual.c
        self.number = DUAL if derivatives else FLOAT
        self.types: dict[Any, Any] = {} if types is None else types
        for described in doubles:
            kind_of_hint(described, "", self.types)
        self.tuples: dict[str, Tuple] = {}
        self.arrays: dict[str, Array] = {}
        self.tables: dict[int, tuple[str, np.ndarray]] = {}

    def use(self, kind: Kind) -> None:
        """Declare a tuple or array type in the file."""
        if isinstance(kind, Tuple) and kind.items:
            for item in kind.items:
                self.use(item)
            self.tuples.setdefault(kind.c, kind)
        elif isinstance(kind, Array):
            self.arrays.setdefault(kind.c, kind)
        elif isinstance(kind, Struct):
            for inner in kind.fields.values():
                self.use(inner)

    def constant(self, value: Any, name: str) -> Value:
        """Return the value of a module-level name."""
        if callable(value) or inspect.ismodule(value):
            return Value("", Called(value))
        if hasattr(value, "_asdict") and all(map(callable, value)):
            return Value("", Functions(value))
        if isinstance(value, tuple) and not hasattr(value, "_asdict"):
            parts = [self.constant(part, name) for part in value]
            kind = Tuple(tuple(part.kind for part in parts))
            self.use(kind)
            return Value(kind.literal(part.c for part in parts), kind, value)
        if isinstance(value, np.ndarray):
            return self._table(value, name)
        if value is None or isinstance(value, str):
            raise TranslationError(f"unsupported value {value!r} in a kernel", "numbers and arrays")
        return Value(written(value), kind_of(value), value)

    def together(self, parts: list[Value]) -> Value:
        """Return some values as a tuple."""
        if any(part.kind == DUAL for part in parts):
            parts = [converted(part, DUAL if part.kind == FLOAT else part.kind) for part in parts]
        kind = Tuple(tuple(part.kind for part in parts))
        self.use(kind)
        constant = tuple(part.constant for part in parts) if all(part.constant is not None for part in parts) else None
        return Value(kind.literal(part.c for part in parts), kind, constant)

    def _table(self, value: np.ndarray, name: str) -> Value:
        kind = kind_of(value)
        assert isinstance(kind, Array)
        self.use(kind)
        label, _ = self.tables.setdefault(id(value), (f"table_{len(self.tables)}_{name.lower()}", np.ascontiguousarray(value)))
        return Value(label, kind)

    def type_texts(self) -> list[str]:
        """Return the types in C, each after those that it contains."""
        records = [kind for kind in self.types.values() if isinstance(kind, Record)]
        texts = [_struct(record.c, record.fields) for record in records]
        for name, array in self.arrays.items():
            counts = [(f"n{k}", INT) for k in range(array.dimensions)] + ([("s", INT)] if array.dimensions == 2 else [])
            fields = " ".join(f"{kind.c} {count};" for count, kind in counts)
            texts.append(f"typedef struct {{ {array.element.c} *p; {fields} }} {name};")
        for name, kind in self.tuples.items():
            if kind.alike:
                texts.append(f"typedef struct {{ {kind.items[0].c} v[{len(kind.items)}]; }} {name};")
            else:
                texts.append(_struct(name, [(f"e{k}", item) for k, item in enumerate(kind.items)]))
        # a struct comes after the structs that it contains
        structs = [kind for kind in self.types.values() if isinstance(kind, Struct)]
        return texts + [_struct(struct.c, list(struct.fields.items())) for struct in structs]

    def table_texts(self) -> list[str]:
        """Return the tables of numbers in C."""
        texts = []
        for name, table in self.tables.values():
            kind = kind_of(table)
            assert isinstance(kind, Array)
            numbers = ", ".join(written(number) for number in table.ravel().tolist())
            shape = ", ".join(map(str, table.shape)) + (f", {table.shape[1]}" if table.ndim == 2 else "")
            texts.append(f"static {kind.element.c} {name}_numbers[] = {{{numbers}}};")
            texts.append(f"static {kind.c} {name} = {{{name}_numbers, {shape}}};")
        return texts


def _struct(name: str, fields: Iterable[tuple[str, Kind]]) -> str:
    return f"typedef struct {{ {' '.join(f'{kind.c} {member(field)};' for field, kind in fields)} }} {name};"
