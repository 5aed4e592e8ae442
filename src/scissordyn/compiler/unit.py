"""Assemble a file of C: requested functions and all functions they call, once for each combination of argument types."""

from __future__ import annotations

import ast
import builtins
import inspect
import linecache
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cache
from importlib.resources import files
from types import CodeType
from typing import Any

from scissordyn.compiler.declaration import Declarations
from scissordyn.compiler.function import Body
from scissordyn.compiler.kind import (
    FLOAT,
    VOID,
    Array,
    Kind,
    Scalar,
    SourceError,
    Struct,
    TranslationError,
    Tuple,
    Value,
    converted,
    declared,
    is_empty,
    item_of,
    kind_of_hint,
)
from scissordyn.compiler.recipe import ANSWER, SIGNATURE, Recipe
from scissordyn.kernel import Entry, Opener, call_at


class _Translated:
    """Name and body of a translated function, and the macro before its declaration."""

    def __init__(self, name: str, body: Body, macro: str) -> None:
        self.name, self.body, self.macro = name, body, macro

    @property
    def head(self) -> str:
        """Declaration in C."""
        return self.macro + self.body.head(self.name)

    @property
    def text(self) -> str:
        """Definition in C."""
        return self.macro + self.body.text(self.name)


class Unit(Declarations):
    """Functions of one C file, with what they declare."""

    def __init__(
        self, types: dict[Any, Any] | None = None, *, table: bool = False, derivatives: int = 0, doubles: Iterable[type] = ()
    ) -> None:
        super().__init__(types, derivatives=derivatives, doubles=doubles)
        self.table = table
        self.translated: dict[Any, _Translated] = {}
        self.names: dict[str, int] = {}
        self.kernels: dict[Recipe, int] = {}
        self.entries: list[str] = []
        self.files: set[str] = set()

    def call(self, function: Any, arguments: list[Value], named: Mapping[str, Value]) -> Value:
        """Return a call of a Python function, translated for the types of its arguments."""
        if isinstance(function, Opener):
            return self._opened(function, arguments[0])
        if function is call_at:
            return self._at_address(arguments)
        plainly = python_of(function)
        if not inspect.isfunction(plainly):
            raise TranslationError(f"unsupported call of {function!r} in a kernel", "Python functions of numbers")
        signature = inspect.signature(plainly)
        try:
            bound = signature.bind(*arguments, **named)
        except TypeError as error:
            raise TranslationError(f"invalid call of '{plainly.__name__}' in a kernel: {error}", str(signature)) from None
        handed = []
        for key, parameter in signature.parameters.items():
            if parameter.kind is inspect.Parameter.VAR_POSITIONAL:
                handed.append(self.together(list(bound.arguments.get(key, ()))))
            else:
                handed.append(bound.arguments.get(key) or self.constant(parameter.default, key))
        callee = self.function(plainly, tuple(value.kind for value in handed))
        wanted = callee.body.given.values()
        texts = [converted(value, kind).c for value, kind in zip(handed, wanted, strict=True) if not is_empty(kind)]
        assert callee.body.result is not None
        return Value(f"{callee.name}({', '.join(texts)})", callee.body.result)

    def function(self, function: Callable[..., Any], kinds: tuple[Kind, ...], name: str = "") -> _Translated:
        """Translate a function for arguments of the given types, and optionally set its name."""
        function = python_of(function)
        key = (function, tuple(kind.letter for kind in kinds))
        if key not in self.translated:
            for kind in kinds:
                self.use(kind)
            self.files.add(function.__code__.co_filename)
            body = Body(self, self.call, _definition(function), kinds, _names_of(function), function.__code__.co_filename)
            body.translate()
            if not name:
                word = re.sub(r"\W", "_", function.__name__)
                number = self.names[word] = self.names.get(word, 0) + 1
                name = f"k_{word}" + (f"_{number}" if number > 1 else "")
            self.translated[key] = _Translated(name, body, getattr(function, "prefix", ""))
        return self.translated[key]

    def _at_address(self, arguments: list[Value]) -> Value:
        pointers = []
        for argument in arguments[1:]:
            if isinstance(argument.kind, Tuple) and argument.kind.items:
                argument = converted(argument, Tuple((self.number,) * len(argument.kind.items)))
                self.use(argument.kind)
            if isinstance(argument.kind, Array):
                pointers.append(f"{argument.c}.p")
            elif isinstance(argument.kind, Tuple) and not argument.kind.items:
                pointers.append("0")
            else:
                pointers.append(f"{argument.c}.v")
        function = f"KERNELS[{arguments[0].c}]" if self.table else f"((kernel_pointer)(intptr_t)({arguments[0].c}))"
        return Value(f"{function}({', '.join(pointers)})", self.number)

    def _opened(self, opener: Opener, address: Value) -> Value:
        """Return a tuple from its address, or the tuple itself."""
        if isinstance(address.kind, Struct):
            return address
        struct = kind_of_hint(opener.described, "", self.types, self.number)
        self.use(struct)
        return Value(f"(({struct.c} *)(intptr_t)({address.c}))", struct)

    def entry(self, entry: Entry) -> None:
        """Export an entry: arrays are passed as address and shape, named tuples as address."""
        *hints, (_, returned) = entry.hints.items()
        kinds = {name: kind_of_hint(hint, name, self.types, self.number) for name, hint in hints}
        translated = self.function(entry.python, tuple(kinds.values()))
        declarations, handed = [], []
        for name, kind in kinds.items():
            if isinstance(kind, Array):
                counts = [f"{name}_n{k}" for k in range(kind.dimensions)] + ([f"{name}_s"] if kind.dimensions == 2 else [])
                declarations += [f"{kind.element.c} *{name}_p", *(f"int64_t {count}" for count in counts)]
                handed.append(f"({kind.c}){{{', '.join([f'{name}_p', *counts])}}}")
            else:
                declarations.append(f"{declared(kind)}{name}_")
                handed.append(f"{name}_")
        result = kind_of_hint(returned, "return", self.types, self.number)
        assert translated.body.result is not None
        answer = converted(Value(f"{translated.name}({', '.join(handed)})", translated.body.result), result)
        call = f"{'' if result == VOID else 'return '}{answer.c};"
        c = {"int": "bool"}.get(result.c, result.c)
        self.entries.append(f"EXPORT {c} {entry.symbol}({', '.join(declarations)}) {{ {call} }}")

    def kernel(self, recipe: Recipe) -> int:
        """Return the index of a kernel that is called by its address; the first has index 1."""
        return self.kernels.setdefault(recipe, len(self.kernels) + 1)

    def text(self) -> str:
        """Return the complete C file: types, tables, declarations and functions."""
        names = [f"kernel_{number}" if self.table else recipe.symbol for recipe, number in self.kernels.items()]
        number, signature = self.number.c, SIGNATURE.replace("double", self.number.c)
        head = f"{'static' if self.table else 'EXPORT'} {number}"
        heads = [f"{head} {name}({signature})" for name in names]
        bodies = [self._kernel_text(recipe, f"{text} {{") for recipe, text in zip(self.kernels, heads, strict=True)]
        pointers = f"static const kernel_pointer KERNELS[{len(names) + 1}] = {{{', '.join(['0', *names])}}};\n"
        return "\n".join(
            (
                "#include <math.h>\n#include <stdbool.h>\n#include <stdint.h>\n",
                _text("arithmetic.c"),
                *([f"#define DERIVATIVES {self.derivatives}\n", _text("dual.c")] if self.derivatives else []),
                f"typedef {number} (*kernel_pointer)({signature});",
                *self.type_texts(),
                *self.table_texts(),
                *(f"{function.head};" for function in self.translated.values()),
                *(f"{text};" for text in heads),
                pointers if self.table else "",
                *(f"{function.text}\n" for function in self.translated.values()),
                *bodies,
                *self.entries,
                "",
            )
        )

    def _kernel_text(self, recipe: Recipe, head: str) -> str:
        """Return the function behind a kernel pointer, which passes its inputs on and stores the results."""
        number, row = self.number, Array(self.number, 1)
        arguments = [
            Value(f"({row.c}){{p, 0}}", row) if text == "p" else Value(text, number if "[" in text else FLOAT)
            for text in recipe.handed
        ]
        self.use(row)
        call = self.call(recipe.function, arguments, {})
        unused = "    (void)q; (void)v; (void)z; (void)x; (void)p; (void)out;"
        if call.kind == VOID:
            raise TranslationError(f"'{recipe.function.__name__}' returns nothing", "numbers")
        if isinstance(call.kind, Scalar):
            target = recipe.targets[0]
            value, nothing = converted(call, number).c, converted(Value("0.0", FLOAT), number).c
            put = f"    return {value};" if target == ANSWER else f"    {target} = {value};\n    return {nothing};"
            return "\n".join((head, unused, put, "}\n"))
        assert isinstance(call.kind, Tuple)
        whole = Value("found", call.kind)
        items = [converted(Value(item_of(whole, k), kind), number).c for k, kind in enumerate(call.kind.items)]
        puts = [
            f"    {target} = {item};" for target, item in zip(recipe.targets, items, strict=True) if target not in (ANSWER, "_")
        ]
        answer = items[recipe.targets.index(ANSWER)] if ANSWER in recipe.targets else converted(Value("0.0", FLOAT), number).c
        return "\n".join((head, unused, f"    {call.kind.c} found = {call.c};", *puts, f"    return {answer};", "}\n"))


def _text(file: str) -> str:
    return files("scissordyn.compiler").joinpath(file).read_text(encoding="utf-8")


def python_of(function: Any) -> Any:
    """Return the Python function that an entry wraps; other functions are returned unchanged."""
    return function.python if isinstance(function, Entry) else function


Function = ast.FunctionDef | ast.Lambda


@cache
def _functions(text: str) -> Mapping[tuple[int, str], list[tuple[Function, CodeType]]]:
    """Return the syntax trees and codes of all functions in a file, by first line and name."""
    nodes: dict[tuple[int, str], list[Function]] = {}
    codes: dict[tuple[int, str], list[CodeType]] = {}
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, Function):
            decorators = node.decorator_list if isinstance(node, ast.FunctionDef) else []
            first = min([node.lineno, *(decorator.lineno for decorator in decorators)])
            nodes.setdefault((first, getattr(node, "name", "<lambda>")), []).append(node)
    for code in _codes(compile(text, "<kernels>", "exec", dont_inherit=True)):
        codes.setdefault((code.co_firstlineno, code.co_name), []).append(code)
    for several in nodes.values():
        several.sort(key=lambda node: node.col_offset)
    return {key: list(zip(several, codes[key], strict=True)) for key, several in nodes.items()}


def _codes(code: CodeType) -> Iterator[CodeType]:
    """Yield a code and the codes inside it, in the order of the text."""
    yield code
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _codes(constant)


def _definition(function: Callable[..., Any]) -> ast.FunctionDef:
    """Return the syntax tree of a function as loaded; a lambda becomes the equivalent function."""
    code, name = function.__code__, function.__name__
    linecache.checkcache(code.co_filename)
    text = "".join(linecache.getlines(code.co_filename))
    try:
        several = _functions(text).get((code.co_firstlineno, code.co_name), [])
    except SyntaxError:
        several = []
    for node, compiled in several:
        if (compiled.co_code, compiled.co_names) == (code.co_code, code.co_names) and _numbers(compiled) == _numbers(code):
            if isinstance(node, ast.FunctionDef):
                return node
            body: list[ast.stmt] = [ast.copy_location(ast.Return(node.body), node)]
            return ast.FunctionDef("lambda_", node.args, body, [], None, lineno=node.lineno)
    reason = "has changed since it was loaded" if text else "is not available"
    raise SourceError(f"the source of '{name}' in '{code.co_filename}' {reason}", "a function in an unchanged file")


def _numbers(code: CodeType) -> list[Any]:
    return [constant for constant in code.co_consts if not isinstance(constant, CodeType)]


def _names_of(function: Callable[..., Any]) -> Callable[[str], Any]:
    """Return a lookup of the names in a function's closure, module and builtins."""
    around = inspect.getclosurevars(function)

    def meaning(name: str) -> Any:
        for names in (around.nonlocals, function.__globals__, vars(builtins)):
            if name in names:
                return names[name]
        raise TranslationError(f"'{name}' in '{function.__name__}' has no value", "a variable that is assigned before its use")

    return meaning
