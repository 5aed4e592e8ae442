"""A file of C: the functions that are asked for, and all that they call, each once for the types of its arguments."""

from __future__ import annotations

import ast
import builtins
import inspect
from collections.abc import Callable, Iterable, Mapping
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from scissordyn.exchange.translate.function import Body
from scissordyn.exchange.translate.kind import (
    FLOAT,
    INT,
    Array,
    Called,
    Kind,
    Problem,
    Record,
    Scalar,
    Struct,
    TranslationError,
    Tuple,
    Value,
    kind_of,
    written,
)
from scissordyn.plugin.address import ANSWER, Recipe, call_at, plain_kernel

__all__ = ["Unit"]


class _Made:
    """A translated function."""

    def __init__(self, name: str, body: Body) -> None:
        self.name, self.body = name, body


class Unit:
    """The functions of a file.

    Parameters
    ----------
    openers : sequence of callable
        Functions that open an address: in C the address is the pointer itself.
    problem : mapping of str to callable
        The functions of a problem, by name.
    known : dict, optional
        Types of records and named tuples, see `kind_of`.
    """

    whole = INT

    def __init__(
        self, *, openers: tuple[Any, ...] = (), problem: Mapping[str, Any] = {}, known: dict[Any, Any] | None = None
    ) -> None:
        self.openers, self.problem = openers, problem
        self.known: dict[Any, Any] = {} if known is None else known
        self.tuples: dict[str, Tuple] = {}
        self.arrays: dict[str, Array] = {}
        self.tables: dict[int, tuple[str, np.ndarray]] = {}
        self.made: dict[Any, _Made] = {}
        self.names: dict[str, int] = {}
        self.kernels: dict[Recipe, int] = {}

    def use(self, kind: Kind) -> None:
        """Declare a type of tuple or array in the file."""
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
        """A value that a module gives a name to."""
        if callable(value) or inspect.ismodule(value):
            return Value("", Called(value))
        if isinstance(value, tuple) and not hasattr(value, "_asdict"):
            parts = [self.constant(part, name) for part in value]
            kind = Tuple(tuple(part.kind for part in parts))
            self.use(kind)
            inner = ", ".join(part.c for part in parts)
            braces = f"{{{{{inner}}}}}" if parts and kind.alike else f"{{{inner}}}"
            return Value(f"({kind.c}){braces}" if parts else "", kind, value)
        if isinstance(value, np.ndarray):
            return self._table(value, name)
        if value is None or isinstance(value, str):
            raise TranslationError(f"{value!r} in a kernel", "numbers and arrays")
        return Value(written(value), kind_of(value), value)

    def _table(self, value: np.ndarray, name: str) -> Value:
        kind = kind_of(value)
        assert isinstance(kind, Array)
        self.use(kind)
        label, _ = self.tables.setdefault(id(value), (f"table_{len(self.tables)}_{name.lower()}", np.ascontiguousarray(value)))
        return Value(label, kind)

    def call(self, function: Any, arguments: list[Value], named: Mapping[str, Value]) -> Value:
        """A call of a function of Python, translated for the types of its arguments."""
        if function in self.openers:
            return arguments[0]
        if function is call_at:
            return self._at_address(arguments)
        plainly = plain_kernel(function)
        if not inspect.isfunction(plainly):
            raise TranslationError(f"a call of {function!r} in a kernel", "functions of numbers in Python")
        signature = inspect.signature(plainly)
        try:
            bound = signature.bind(*arguments, **named)
        except TypeError as error:
            raise TranslationError(f"a call of '{plainly.__name__}' in a kernel: {error}", str(signature)) from None
        handed = [
            bound.arguments.get(key) or self.constant(parameter.default, key) for key, parameter in signature.parameters.items()
        ]
        made = self.function(plainly, tuple(value.kind for value in handed))
        texts = [value.c for value in handed if not isinstance(value.kind, Called | Problem)]
        assert made.body.result is not None
        return Value(f"{made.name}({', '.join(texts)})", made.body.result)

    def function(self, function: Callable[..., Any], kinds: tuple[Kind, ...], name: str = "") -> _Made:
        """A function, translated for arguments of these types, under a name if that is given."""
        function = plain_kernel(function)
        key = (function, tuple(kind.letter for kind in kinds))
        if key not in self.made:
            for kind in kinds:
                self.use(kind)
            body = Body(self, _definition(function), kinds, _names_of(function))
            body.translate()
            if not name:
                number = self.names[function.__name__] = self.names.get(function.__name__, 0) + 1
                name = f"k_{function.__name__}" + (f"_{number}" if number > 1 else "")
            self.made[key] = _Made(name, body)
        return self.made[key]

    def _at_address(self, arguments: list[Value]) -> Value:
        pointers = []
        for each in arguments[1:]:
            if isinstance(each.kind, Array):
                pointers.append(f"{each.c}.p")
            elif isinstance(each.kind, Tuple) and not each.kind.items:
                pointers.append("0")
            else:
                pointers.append(f"{each.c}.v")
        return Value(f"KERNELS[{arguments[0].c}]({', '.join(pointers)})", FLOAT)

    def kernel(self, recipe: Recipe) -> int:
        """The number of a kernel that is called by its address, from one on."""
        return self.kernels.setdefault(recipe, len(self.kernels) + 1)

    def text(self) -> str:
        """All of it: types, tables, declarations and functions."""
        bodies = [self._kernel_text(recipe, number) for recipe, number in self.kernels.items()]
        count = len(self.kernels)
        pointers = ", ".join(["0", *(f"kernel_{number}" for number in self.kernels.values())])
        signature = "double *q, double *v, double *z, double *x, double *p, double *out"
        return "\n".join(
            (
                "#include <math.h>\n#include <stdint.h>\n",
                files("scissordyn.exchange.translate").joinpath("arithmetic.c").read_text(encoding="utf-8"),
                *self._types(),
                *self._tables(),
                *(f"{made.body.head(made.name)};" for made in self.made.values()),
                *(f"static double kernel_{number}({signature});" for number in self.kernels.values()),
                f"static double (*const KERNELS[{count + 1}])({signature}) = {{{pointers}}};\n",
                *(made.body.text(made.name) + "\n" for made in self.made.values()),
                *bodies,
            )
        )

    def _kernel_text(self, recipe: Recipe, number: int) -> str:
        """The function at an address: it hands its inputs on, and stores the results."""
        arguments = [
            Value("(F1_array){p, 0}", Array(FLOAT, 1)) if text == "p" else Value(text, FLOAT) for text in recipe.handed
        ]
        self.use(Array(FLOAT, 1))
        found = self.call(recipe.function, arguments, {})
        head = f"static double kernel_{number}(double *q, double *v, double *z, double *x, double *p, double *out) {{"
        unused = "    (void)q; (void)v; (void)z; (void)x; (void)p; (void)out;"
        if isinstance(found.kind, Scalar):
            target = recipe.targets[0]
            put = f"    return {found.c};" if target == ANSWER else f"    {target} = {found.c};\n    return 0.0;"
            return "\n".join((head, unused, put, "}\n"))
        assert isinstance(found.kind, Tuple)
        items = [f"found.v[{k}]" if found.kind.alike else f"found.e{k}" for k in range(len(found.kind.items))]
        puts = [
            f"    {target} = {item};" for target, item in zip(recipe.targets, items, strict=True) if target not in (ANSWER, "_")
        ]
        answer = items[recipe.targets.index(ANSWER)] if ANSWER in recipe.targets else "0.0"
        return "\n".join((head, unused, f"    {found.kind.c} found = {found.c};", *puts, f"    return {answer};", "}\n"))

    def _types(self) -> list[str]:
        records = [kind for kind in self.known.values() if isinstance(kind, Record)]
        texts = [_struct(record.name, record.fields) for record in records]
        for name, array in self.arrays.items():
            counts = [(f"n{k}", INT) for k in range(array.dimensions)] + ([("s", INT)] if array.dimensions == 2 else [])
            fields = " ".join(f"{kind.c} {count};" for count, kind in counts)
            texts.append(f"typedef struct {{ {array.element.c} *p; {fields} }} {name};")
        for name, kind in self.tuples.items():
            if kind.alike:
                texts.append(f"typedef struct {{ {kind.items[0].c} v[{len(kind.items)}]; }} {name};")
            else:
                texts.append(_struct(name, [(f"e{k}", item) for k, item in enumerate(kind.items)]))
        structs = [kind for kind in self.known.values() if isinstance(kind, Struct)]  # inner ones before those that have them
        return texts + [_struct(struct.name, list(struct.fields.items())) for struct in structs]

    def _tables(self) -> list[str]:
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
    return f"typedef struct {{ {' '.join(f'{kind.c} {field};' for field, kind in fields)} }} {name};"


@cache
def _definitions(file: str) -> Mapping[int, ast.FunctionDef]:
    """The functions of a file by the line of their first decorator, or their own."""
    tree = ast.parse(Path(file).read_text(encoding="utf-8"))
    found = [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]
    return {min([node.lineno, *(each.lineno for each in node.decorator_list)]): node for node in found}


def _definition(function: Callable[..., Any]) -> ast.FunctionDef:
    code = function.__code__
    try:
        found = _definitions(code.co_filename).get(code.co_firstlineno)
    except (OSError, SyntaxError, UnicodeError):
        found = None
    if found is None or found.name != function.__name__:
        raise TranslationError(f"the source of '{function.__name__}' is not there", "a function in a file")
    return found


def _names_of(function: Callable[..., Any]) -> Callable[[str], Any]:
    """What a function's module, and what is around it, mean by a name."""
    around = inspect.getclosurevars(function)

    def meaning(name: str) -> Any:
        for names in (around.nonlocals, function.__globals__, vars(builtins)):
            if name in names:
                return names[name]
        raise TranslationError(f"'{name}' in '{function.__name__}' has no value", "a variable that is given a value first")

    return meaning
