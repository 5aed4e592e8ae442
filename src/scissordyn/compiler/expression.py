"""Translate expressions of kernels to C."""

from __future__ import annotations

import ast
import math
from collections.abc import Callable, Mapping
from functools import reduce
from typing import Any

import numpy as np

from scissordyn.compiler.declaration import KEYWORDS, Declarations, member
from scissordyn.compiler.kind import (
    BOOL,
    DUAL,
    FLOAT,
    INT,
    Array,
    Called,
    Functions,
    Kind,
    Record,
    Scalar,
    Struct,
    TranslationError,
    Tuple,
    Value,
    converted,
    is_empty,
    item_of,
    joined,
)
from scissordyn.kernel import derivative, equals, value_of

# Functions of C's math.h with the same names in Python's math or in NumPy
_MATH_FUNCTIONS = (
    *("sqrt", "cbrt", "cos", "sin", "tan", "acos", "asin", "atan", "atan2", "cosh", "sinh", "tanh", "acosh", "asinh", "atanh"),
    *("exp", "exp2", "expm1", "log", "log2", "log10", "log1p", "pow", "hypot", "copysign", "fabs", "erf", "erfc", "fmod"),
)

RESERVED = frozenset(("floor", "ceil", "isnan", "isinf", "abs", "NAN", "INFINITY", "word", *KEYWORDS, *_MATH_FUNCTIONS))
"""Names that a variable in C must not have."""

_NUMPY = {
    "arccos": "acos", "arcsin": "asin", "arctan": "atan", "arctan2": "atan2", "arccosh": "acosh", "arcsinh": "asinh",
    "arctanh": "atanh", "power": "pow", "floor": "floor", "ceil": "ceil", "trunc": "trunc", "fmin": "fmin", "fmax": "fmax",
    "minimum": "least_number", "maximum": "largest_number", "sign": "sign", "degrees": "degrees", "radians": "radians",
}  # fmt: skip
MATH: Mapping[Any, str] = {
    **{getattr(module, name): name for name in _MATH_FUNCTIONS for module in (math, np) if hasattr(module, name)},
    **{getattr(np, name): c for name, c in _NUMPY.items()},
    math.degrees: "degrees",
    math.radians: "radians",
}
"""Names in C of functions of one or two numbers, by function in Python."""

CASTS: Mapping[Any, tuple[str, Scalar]] = {
    **dict.fromkeys((int, np.int64), ("((int64_t)({}))", INT)),
    **dict.fromkeys((float, np.float64), ("((double)({}))", FLOAT)),
    bool: ("(({}) != 0)", BOOL),
    math.floor: ("((int64_t)floor({}))", INT),
    math.ceil: ("((int64_t)ceil({}))", INT),
    **{
        getattr(module, name): (f"({name}({{}}) != 0)", BOOL)
        for name in ("isnan", "isinf", "isfinite")
        for module in (math, np)
    },
}
"""C text and result type of conversions and tests of a number, by function in Python."""

# Operators in C, by the nodes of Python's syntax tree
OPERATORS: Mapping[type, str] = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*"}
COMPARISONS: Mapping[type, str] = {
    ast.Eq: "==", ast.NotEq: "!=", ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Is: "==", ast.IsNot: "!=",
}  # fmt: skip


def plain(name: str) -> str:
    """Return the name of a variable in C."""
    return f"{name}_" if name in RESERVED else name


def field(pointer: str, name: str) -> str:
    """Return the C expression of a field behind a pointer."""
    return f"{pointer[1:]}.{member(name)}" if pointer.startswith("&") else f"{pointer}->{member(name)}"


class Scope:
    """Variables of a function, and the names of its module."""

    def __init__(self, names: Callable[[str], Any]) -> None:
        self.kinds: dict[str, Kind] = {}
        self.names = names
        self.changed = False

    def assign(self, name: str, kind: Kind) -> None:
        """Assign a value of some type to a variable."""
        new = joined(self.kinds.get(name), kind)
        if self.kinds.get(name) != new:
            self.kinds[name], self.changed = new, True


Call = Callable[[Any, list[Value], Mapping[str, Value]], Value]


class Expressions:
    """Translator of expressions within a scope; `call` returns a call of a Python function, which it translates."""

    def __init__(self, declarations: Declarations, call: Call, scope: Scope) -> None:
        self.declarations, self.call, self.scope = declarations, call, scope

    def value(self, node: ast.expr) -> Value:
        """Return an expression in C with its type."""
        method = getattr(self, f"_{type(node).__name__.lower()}", None)
        if method is None:
            raise TranslationError(f"{type(node).__name__} in a kernel: {ast.unparse(node)}", "numbers, arrays and arithmetic")
        result: Value = method(node)
        return result

    def text(self, node: ast.expr) -> str:
        """Return an expression in C without its type."""
        return self.value(node).c

    def _constant(self, node: ast.Constant) -> Value:
        return self.declarations.constant(node.value, "a constant")

    def _name(self, node: ast.Name) -> Value:
        if node.id in self.scope.kinds:
            kind = self.scope.kinds[node.id]
            return Value("" if is_empty(kind) else plain(node.id), kind)
        return self.declarations.constant(self.scope.names(node.id), node.id)

    def _attribute(self, node: ast.Attribute) -> Value:
        if isinstance(node.value, ast.Name) and node.value.id not in self.scope.kinds:
            module = self.scope.names(node.value.id)
            return self.declarations.constant(getattr(module, node.attr), node.attr)
        base = self.value(node.value)
        if isinstance(base.kind, Functions):
            return Value("", Called(getattr(base.kind.named, node.attr)))
        if isinstance(base.kind, Record):
            return Value(field(base.c, node.attr), dict(base.kind.fields)[node.attr])
        if isinstance(base.kind, Struct):
            kind = base.kind.fields[node.attr]
            inner = field(base.c, node.attr)
            return Value(f"&{inner}" if isinstance(kind, Struct) else inner, kind)
        if isinstance(base.kind, Array) and node.attr == "size":
            return Value(" * ".join(f"{base.c}.n{k}" for k in range(base.kind.dimensions)), INT)
        raise TranslationError(f"unsupported '.{node.attr}' of a {base.kind.letter} in a kernel", "fields, size and shape")

    def _subscript(self, node: ast.Subscript) -> Value:
        if isinstance(node.value, ast.Attribute) and node.value.attr == "shape":
            base, index = self.value(node.value.value), node.slice
            if isinstance(index, ast.Constant) and isinstance(index.value, int):
                return Value(f"{base.c}.n{index.value:d}", INT)
        base = self.value(node.value)
        if isinstance(base.kind, Tuple):
            return self._item(base, node.slice)
        if not isinstance(base.kind, Array):
            raise TranslationError(f"a {base.kind.letter} in a kernel cannot be indexed", "arrays and tuples")
        indices = list(node.slice.elts) if isinstance(node.slice, ast.Tuple) else [node.slice]
        return self.indexed(base, indices)

    def _item(self, base: Value, index: ast.expr) -> Value:
        assert isinstance(base.kind, Tuple)
        place = self.value(index)
        if isinstance(place.constant, int):
            at = place.constant % len(base.kind.items)
            return Value(item_of(base, at), base.kind.items[at])
        if not base.kind.alike:
            raise TranslationError("a tuple of different types in a kernel cannot have a variable index", "an array")
        return Value(f"{base.c}.v[{place.c}]", base.kind.items[0])

    def indexed(self, base: Value, indices: list[ast.expr]) -> Value:
        """Return an entry, a row or a part of an array."""
        kind = base.kind
        assert isinstance(kind, Array)
        simple = [None if isinstance(index, ast.Slice) else self.place(base, k, index) for k, index in enumerate(indices)]
        if len(indices) == kind.dimensions and all(simple):
            at = place_of(base, [str(index) for index in simple])
            entry = f"{base.c}.p[{at}]"
            return Value(f"&{entry}" if isinstance(kind.element, Record) else entry, kind.element)
        if len(indices) < kind.dimensions and all(simple):
            return self._rows(base, [str(index) for index in simple])
        ranges = [self.bounds(base, k, index) for k, index in enumerate(indices)]
        if kind.dimensions == 1:
            low, high = ranges[0]
            return Value(f"({kind.c}){{{base.c}.p + {low}, {high} - {low}}}", kind)
        if kind.dimensions == 2 and simple == [None, None]:
            (low, high), (first, last) = ranges
            start = f"{base.c}.p + {low} * {base.c}.s + {first}"
            return Value(f"({kind.c}){{{start}, {high} - {low}, {last} - {first}, {base.c}.s}}", kind)
        if kind.dimensions == 2 and simple[0] is not None:
            low, high = ranges[1]
            row = Array(kind.element, 1)
            return Value(f"({row.c}){{{base.c}.p + ({simple[0]}) * {base.c}.s + {low}, {high} - {low}}}", row)
        raise TranslationError("a column of an array cannot be a value in a kernel", "a row")

    def _rows(self, base: Value, at: list[str]) -> Value:
        assert isinstance(base.kind, Array)
        a, dimensions = base.c, base.kind.dimensions
        row = Array(base.kind.element, dimensions - len(at))
        if dimensions == 2:
            return Value(f"({row.c}){{{a}.p + ({at[0]}) * {a}.s, {a}.n1}}", row)
        if len(at) == 1:
            return Value(f"({row.c}){{{a}.p + ({at[0]}) * {a}.n1 * {a}.n2, {a}.n1, {a}.n2, {a}.n2}}", row)
        return Value(f"({row.c}){{{a}.p + (({at[0]}) * {a}.n1 + {at[1]}) * {a}.n2, {a}.n2}}", row)

    def place(self, base: Value, axis: int, index: ast.expr) -> str:
        """Return an index in C; a negative constant counts from the end."""
        index_value = self.value(index)
        if isinstance(index_value.constant, int) and index_value.constant < 0:
            return f"{base.c}.n{axis} - {-index_value.constant}"
        return index_value.c

    def bounds(self, base: Value, axis: int, index: ast.expr) -> tuple[str, str]:
        """Return the first index of a slice and the index after its last; a single index counts as a slice."""
        if not isinstance(index, ast.Slice):
            at = f"({self.place(base, axis, index)})"
            return at, f"({at} + 1)"
        if index.step is not None:
            raise TranslationError("a slice in a kernel has a step", "a slice without a step")
        low = "0" if index.lower is None else f"({self.place(base, axis, index.lower)})"
        return low, f"{base.c}.n{axis}" if index.upper is None else f"({self.place(base, axis, index.upper)})"

    def _tuple(self, node: ast.Tuple) -> Value:
        parts = [self.value(element) for element in node.elts]
        return self.declarations.together(parts)

    def _unaryop(self, node: ast.UnaryOp) -> Value:
        inner = self.value(node.operand)
        if isinstance(node.op, ast.Not):
            return Value(f"!({inner.c})", BOOL)
        if not isinstance(node.op, ast.USub):
            return inner
        if inner.kind == DUAL:
            return Value(f"negative_dual({inner.c})", DUAL)
        kind = INT if inner.kind == BOOL else inner.kind
        return Value(
            f"-({inner.c})" if inner.constant is None else f"-{inner.c}",
            kind,
            None if inner.constant is None else -inner.constant,
        )

    def _binop(self, node: ast.BinOp) -> Value:
        left, right = self.value(node.left), self.value(node.right)
        return self.arithmetic(node.op, left, right)

    def arithmetic(self, operator: ast.operator, left: Value, right: Value) -> Value:
        """Return the result of an arithmetic operation on two numbers."""
        if not isinstance(left.kind, Scalar) or not isinstance(right.kind, Scalar):
            raise TranslationError("arithmetic of arrays is not supported in a kernel", "arithmetic of numbers")
        kind = joined(joined(left.kind, right.kind), INT)
        if kind == DUAL and type(operator) in DUAL_OPERATIONS:
            return _dual_operation(operator, left, right)
        a, b = left.c, right.c
        if type(operator) in OPERATORS:
            return Value(f"({a} {OPERATORS[type(operator)]} {b})", kind)
        if isinstance(operator, ast.Div):
            divisor = b if right.kind == FLOAT else f"(double)({b})"
            return Value(f"({a} / {divisor})", FLOAT)
        if isinstance(operator, ast.Pow):
            if isinstance(right.constant, int) and 0 <= right.constant <= 8 and kind == FLOAT:
                return Value(f"whole_power({a}, {b})", FLOAT)
            return Value(f"pow({a}, {b})", FLOAT)
        suffix = "floats" if kind == FLOAT else "whole"
        names = {ast.FloorDiv: "floor_division", ast.Mod: "remainder"}
        if type(operator) not in names:
            raise TranslationError(f"unsupported operator {type(operator).__name__} in a kernel", "+, -, *, /, //, % and **")
        return Value(f"{names[type(operator)]}_{suffix}({a}, {b})", kind)

    def _compare(self, node: ast.Compare) -> Value:
        parts, left = [], self.value(node.left)
        for operator, operand in zip(node.ops, node.comparators, strict=True):
            if type(operator) not in COMPARISONS:
                members = (
                    [self.value(member) for member in operand.elts]
                    if isinstance(operand, ast.Tuple)
                    else self._members(operand)
                )
                alternatives = " || ".join(f"{_real(left)} == {_real(member)}" for member in members)
                parts.append(f"({alternatives})" if isinstance(operator, ast.In) else f"!({alternatives})")
                continue
            right = self.value(operand)
            parts.append(f"{_real(left)} {COMPARISONS[type(operator)]} {_real(right)}")
            left = right
        return Value(f"({' && '.join(parts)})" if len(parts) > 1 else f"({parts[0]})", BOOL)

    def _members(self, node: ast.expr) -> list[Value]:
        value = self.value(node)
        if not isinstance(value.constant, tuple):
            raise TranslationError("'in' in a kernel requires a tuple of constants", "a tuple of constants")
        return [self.declarations.constant(member, "a constant") for member in value.constant]

    def _boolop(self, node: ast.BoolOp) -> Value:
        joint = " && " if isinstance(node.op, ast.And) else " || "
        return Value("(" + joint.join(self.text(operand) for operand in node.values) + ")", BOOL)

    def _ifexp(self, node: ast.IfExp) -> Value:
        test, chosen, otherwise = self.value(node.test), self.value(node.body), self.value(node.orelse)
        kind = joined(chosen.kind, otherwise.kind)
        self.declarations.use(kind)
        chosen, otherwise = converted(chosen, kind), converted(otherwise, kind)
        if isinstance(kind, Tuple) and chosen.kind != otherwise.kind:
            raise TranslationError("a conditional expression in a kernel has tuples of different types", "tuples of one type")
        return Value(f"({test.c} ? {chosen.c} : {otherwise.c})", kind)

    def _call(self, node: ast.Call) -> Value:
        if isinstance(node.func, ast.Name) and node.func.id not in self.scope.kinds:
            function = self.scope.names(node.func.id)
        elif (
            isinstance(node.func, ast.Attribute)
            and isinstance(node.func.value, ast.Name)
            and node.func.value.id not in self.scope.kinds
        ):
            function = getattr(self.scope.names(node.func.value.id), node.func.attr)
        else:
            called = self.value(node.func)
            if not isinstance(called.kind, Called):
                raise TranslationError(f"{ast.unparse(node.func)} in a kernel cannot be called", "a function")
            function = called.kind.function
        if function is float and isinstance(node.args[0], ast.Constant):
            return self.declarations.constant(float(node.args[0].value), "a constant")  # type: ignore[arg-type]
        arguments = [self.value(argument) for argument in node.args]
        named = {argument.arg: self.value(argument.value) for argument in node.keywords if argument.arg}
        return self._built_in(function, arguments) or self.call(function, arguments, named)

    def _built_in(self, function: Any, arguments: list[Value]) -> Value | None:
        """Return a call of a built-in or library function; None for other functions.

        Functions with an integer or boolean result use values without derivatives.
        """
        first, kinds = arguments[0], [argument.kind for argument in arguments]
        if function in CASTS:
            text, kind = CASTS[function]
            constant = int(first.constant) if kind == INT and isinstance(first.constant, int) else None
            return first if kinds == [DUAL] and kind == FLOAT else Value(text.format(_real(first)), kind, constant)
        if function is equals:
            value = arguments[1].c
            return Value(f"equals({first.c}, {value})" if first.kind == DUAL else f"({first.c} == {value})", BOOL)
        if function is value_of:
            return Value(_real(first), FLOAT) if first.kind == DUAL else first
        if function is derivative:
            place = f"({arguments[1].c})"
            return Value(f"{first.c}.d[{place} / PACKED][{place} % PACKED]" if first.kind == DUAL else "0.0", FLOAT)
        dual = DUAL in kinds
        if function is np.where:
            test, yes, no = first, *(converted(argument, DUAL) if dual else argument for argument in arguments[1:])
            return Value(f"({test.c} ? {yes.c} : {no.c})", joined(yes.kind, no.kind))
        texts = [converted(argument, DUAL).c if dual else argument.c for argument in arguments]
        number: Kind = DUAL if dual else FLOAT
        if function in (min, max):
            number = reduce(joined, kinds)
            name = f"{EXTREMES[function]}_{'whole' if number not in (FLOAT, DUAL) else 'float_dual' if dual else 'float'}"
            return Value(reduce(lambda before, text: f"{name}({before}, {text})", texts), number)
        suffix = "_dual" if dual else ""
        if function is np.clip:
            x, low, high = texts
            return Value(f"least_number{suffix}(largest_number{suffix}({x}, {low}), {high})", number)
        if function is abs and kinds[0] in (BOOL, INT):
            return Value(f"whole_size({texts[0]})", INT)
        called = "fabs" if function is abs else MATH.get(function)
        return Value(f"{called}{suffix}({', '.join(texts)})", number) if called else None


EXTREMES: Mapping[Any, str] = {min: "least", max: "largest"}  # First word of the names of min and max in arithmetic.c

# Functions of dual.c by the nodes of Python's syntax tree
DUAL_OPERATIONS = {
    ast.Add: "add", ast.Sub: "subtract", ast.Mult: "multiply", ast.Div: "divide", ast.FloorDiv: "floor_division_dual",
    ast.Mod: "remainder_dual", ast.Pow: "pow_dual",
}  # fmt: skip


def _real(value: Value) -> str:
    """Return a number without its derivatives."""
    return f"{value.c}.v" if value.kind == DUAL else value.c


def _dual_operation(operator: ast.operator, left: Value, right: Value) -> Value:
    """Return arithmetic of two numbers, at least one of which has derivatives."""
    name = DUAL_OPERATIONS[type(operator)]
    if isinstance(operator, ast.Pow) and isinstance(right.constant, int) and 0 <= right.constant <= 8:
        return Value(f"whole_power_dual({left.c}, {right.c})", DUAL)
    if not name.endswith("dual"):
        name += "_" + "".join("d" if operand.kind == DUAL else "f" for operand in (left, right))
        return Value(f"{name}({left.c}, {right.c})", DUAL)
    return Value(f"{name}({converted(left, DUAL).c}, {converted(right, DUAL).c})", DUAL)


def place_of(base: Value, at: list[str]) -> str:
    """Return the C expression of the index of an entry in the memory of an array, for its indices `at`."""
    if len(at) == 1:
        return at[0]
    if len(at) == 2:
        return f"({at[0]}) * {base.c}.s + {at[1]}"
    return f"(({at[0]}) * {base.c}.n1 + {at[1]}) * {base.c}.n2 + {at[2]}"
