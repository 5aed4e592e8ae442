"""Translate functions of kernels to C."""

from __future__ import annotations

import ast
import math
from typing import Any

from scissordyn.compiler.declaration import Declarations
from scissordyn.compiler.expression import Call, Expressions, Scope, place_of, plain
from scissordyn.compiler.kind import (
    DUAL,
    VOID,
    Array,
    Kind,
    Record,
    Scalar,
    TranslationError,
    Tuple,
    Value,
    converted,
    declared,
    has_derivatives,
    is_empty,
    item_of,
    joined,
)


class Body:
    """Statements of one function, for arguments of given types."""

    def __init__(
        self,
        declarations: Declarations,
        call: Call,
        definition: ast.FunctionDef,
        kinds: tuple[Kind, ...],
        names: Any,
        file: str = "",
    ) -> None:
        self.declarations, self.definition = declarations, definition
        self.place = f"{file or 'kernel'}:{{}}: {definition.name}"
        arguments = definition.args
        self.arguments = [argument.arg for argument in (*arguments.args, *([arguments.vararg] if arguments.vararg else []))]
        self.scope = Scope(names)
        self.scope.kinds = dict(zip(self.arguments, kinds, strict=True))
        self.given = dict(self.scope.kinds)
        self.expressions = Expressions(declarations, call, self.scope)
        self.result: Kind | None = None
        self.lines: list[str] = []
        self.depth = 1
        self.temporaries = 0

    def translate(self) -> None:
        """Translate the statements repeatedly until the types of the variables settle."""
        for _ in range(8):  # until the types of all variables settle
            self.scope.changed, self.lines, self.temporaries = False, [], 0
            result = self.result
            self._all(self.definition.body)
            if not self.scope.changed and result == self.result:
                break
        else:
            raise TranslationError(f"the types of variables in '{self.definition.name}' do not settle", "one type each")
        self.result = VOID if self.result is None else self.result
        # an argument without derivatives to which a value with derivatives is assigned
        self.given.update((key, DUAL) for key in self.given if self.scope.kinds[key] == DUAL)

    def text(self, name: str) -> str:
        """Return the function in C."""
        head = self.head(name)
        local = {key: kind for key, kind in self.scope.kinds.items() if key not in self.given}
        changed = [key for key, kind in self.given.items() if self.scope.kinds[key] != kind]
        if changed:
            raise TranslationError(f"argument '{changed[0]}' of '{self.definition.name}' changes its type", "another variable")
        declarations = [
            f"    {declared(kind)}{plain(key)} = {'{0}' if kind == DUAL or isinstance(kind, Tuple | Array) else '0'};"
            for key, kind in local.items()
            if not is_empty(kind)
        ]
        return "\n".join((f"{head} {{", *declarations, *self.lines, "}"))

    def head(self, name: str) -> str:
        """Return the declaration of the function in C."""
        assert self.result is not None
        handed = [f"{declared(kind)}{plain(key)}" for key, kind in self.given.items() if not is_empty(kind)]
        passes_duals = any(has_derivatives(kind) for kind in (self.result, *self.given.values()))
        # a call copies dual numbers through the memory, which takes as long as some operations with them
        head = "static inline" if passes_duals else "static"
        return f"{head} {declared(self.result)}{name}({', '.join(handed) or 'void'})"

    def _line(self, text: str) -> None:
        self.lines.append("    " * self.depth + text)

    def _all(self, statements: list[ast.stmt]) -> None:
        for statement in statements:
            method = getattr(self, f"_{type(statement).__name__.lower()}", None)
            try:
                if method is None:
                    raise TranslationError(
                        f"unsupported statement '{type(statement).__name__.lower()}'", "assignments, if, for, while and return"
                    )
                method(statement)
            except TranslationError as error:
                raise error.at(statement, self.place) from None

    def _inside(self, statements: list[ast.stmt]) -> None:
        self.depth += 1
        self._all(statements)
        self.depth -= 1

    def _expr(self, node: ast.Expr) -> None:
        if not isinstance(node.value, ast.Constant):
            self._line(f"{self.expressions.text(node.value)};")

    def _pass(self, _: ast.Pass) -> None:
        self._line(";")

    def _break(self, _: ast.Break) -> None:
        self._line("break;")

    def _continue(self, _: ast.Continue) -> None:
        self._line("continue;")

    def _return(self, node: ast.Return) -> None:
        if node.value is None:
            self._line("return;")
            return
        result = self.expressions.value(node.value)
        self.result = joined(self.result, result.kind)
        result = converted(result, self.result)
        if isinstance(self.result, Tuple):
            self.declarations.use(self.result)
            if result.kind != self.result:
                result = self._converted(result, self.result)
        self._line(f"return {result.c};")

    def _converted(self, value: Value, kind: Tuple) -> Value:
        """Convert the numbers of a tuple to other types."""
        assert isinstance(value.kind, Tuple)
        kept, old = self._kept(value), value.kind.items
        return Value(
            kind.literal(converted(Value(item_of(kept, k), old[k]), item).c for k, item in enumerate(kind.items)), kind
        )

    def _raise(self, node: ast.Raise) -> None:
        """Translate an error to a NaN result."""
        self._return(ast.copy_location(ast.Return(ast.copy_location(ast.Constant(math.nan), node)), node))

    def _if(self, node: ast.If) -> None:
        self._line(f"if ({self.expressions.text(node.test)}) {{")
        self._inside(node.body)
        while len(node.orelse) == 1 and isinstance(node.orelse[0], ast.If):
            node = node.orelse[0]
            self._line(f"}} else if ({self.expressions.text(node.test)}) {{")
            self._inside(node.body)
        if node.orelse:
            self._line("} else {")
            self._inside(node.orelse)
        self._line("}")

    def _while(self, node: ast.While) -> None:
        self._line(f"while ({self.expressions.text(node.test)}) {{")
        self._inside(node.body)
        self._line("}")

    def _for(self, node: ast.For) -> None:
        """Translate a loop over a range; its bounds are computed once, and its variable keeps its last value."""
        ranged = node.iter
        if not (isinstance(ranged, ast.Call) and isinstance(ranged.func, ast.Name) and ranged.func.id == "range"):
            raise TranslationError(
                f"unsupported loop over {ast.unparse(ranged)} in '{self.definition.name}'", "a loop over a range"
            )
        if node.orelse or not isinstance(node.target, ast.Name):
            raise TranslationError(
                f"a loop in '{self.definition.name}' has 'else' or several variables", "a loop with one variable"
            )
        bounds = [self.expressions.value(bound) for bound in ranged.args]
        first = "0" if len(bounds) == 1 else bounds[0].c
        last = bounds[0].c if len(bounds) == 1 else bounds[1].c
        step = bounds[2].constant if len(bounds) == 3 else 1
        if not isinstance(step, int) or step == 0:
            raise TranslationError(f"a range in '{self.definition.name}' has a variable step", "an integer constant")
        number = self._number()
        name, compared = f"loop_{number}", "<" if step > 0 else ">"
        self._line(
            f"for (int64_t {name} = {first}, end_{number} = {last}; {name} {compared} end_{number}; {name} += {step}) {{"
        )
        if node.target.id != "_":
            self.scope.assign(node.target.id, self.declarations.whole)
            self.lines.append("    " * (self.depth + 1) + f"{plain(node.target.id)} = {name};")
        self._inside(node.body)
        self._line("}")

    def _number(self) -> int:
        self.temporaries += 1
        return self.temporaries

    def _annassign(self, node: ast.AnnAssign) -> None:
        if node.value is not None:
            self._put(node.target, self.expressions.value(node.value))

    def _assign(self, node: ast.Assign) -> None:
        if len(node.targets) == 1 and isinstance(node.targets[0], ast.Tuple) and isinstance(node.value, ast.Tuple):
            targets, values = node.targets[0].elts, node.value.elts
            assigned = [self.expressions.value(item) for item in values]
            kept = [item if self._is_fixed(item) else self._kept(item) for item in assigned]
            for target, value in zip(targets, kept, strict=True):
                self._put(target, value)
            return
        result = self.expressions.value(node.value)
        if len(node.targets) > 1 and not self._is_fixed(result):
            result = self._kept(result)
        for target in node.targets:
            self._put(target, result)

    def _is_fixed(self, value: Value) -> bool:
        return value.constant is not None or is_empty(value.kind)

    def _kept(self, value: Value) -> Value:
        """Store a value in a temporary variable, so that later statements do not change it."""
        name = f"kept_{self._number()}"
        self._line(f"{declared(value.kind)}{name} = {value.c};")
        return Value(name, value.kind)

    def _put(self, target: ast.expr, value: Value) -> None:
        """Assign a value to a variable, an entry or several of them."""
        if isinstance(target, ast.Tuple):
            if not isinstance(value.kind, Tuple) or len(value.kind.items) != len(target.elts):
                raise TranslationError(
                    f"cannot unpack into {ast.unparse(target)} in '{self.definition.name}'", "as many values as names"
                )
            kept = self._kept(value)
            for k, part in enumerate(target.elts):
                self._put(part, Value(item_of(kept, k), value.kind.items[k]))
        elif isinstance(target, ast.Name):
            if target.id == "_":
                self._line(f"(void)({value.c});")
                return
            self.scope.assign(target.id, value.kind)
            kind = self.scope.kinds[target.id]
            if isinstance(kind, Tuple) and kind != value.kind:
                self.declarations.use(kind)
                value = self._converted(value, kind)
            if not is_empty(value.kind):
                self._line(f"{plain(target.id)} = {converted(value, kind).c};")
        elif isinstance(target, ast.Attribute):
            self._store(self.expressions.value(target), value)
        elif isinstance(target, ast.Subscript):
            self._put_entry(target, value)
        else:
            raise TranslationError(
                f"cannot assign to {ast.unparse(target)} in '{self.definition.name}'", "a variable or an entry"
            )

    def _put_entry(self, target: ast.Subscript, value: Value) -> None:
        base = self.expressions.value(target.value)
        indices = list(target.slice.elts) if isinstance(target.slice, ast.Tuple) else [target.slice]
        if not isinstance(base.kind, Array):
            raise TranslationError(
                f"cannot assign to {ast.unparse(target)} in '{self.definition.name}'", "an entry of an array"
            )
        if not any(isinstance(index, ast.Slice) for index in indices) and len(indices) == base.kind.dimensions:
            entry = self.expressions.indexed(base, indices)
            if isinstance(entry.kind, Record):
                self._line(f"*({entry.c}) = *({value.c});")
            else:
                self._store(entry, value)
            return
        if not isinstance(value.kind, Scalar) or len(indices) != base.kind.dimensions:
            raise TranslationError(
                f"cannot assign to {ast.unparse(target)} in '{self.definition.name}'", "a number for all entries of a part"
            )
        places, loops = [], []
        for axis, index in enumerate(indices):
            low, high = self.expressions.bounds(base, axis, index)
            number = self._number()
            places.append(f"at_{number}")
            loops.append(f"for (int64_t at_{number} = {low}; at_{number} < {high}; at_{number}++) ")
        self._store(Value(f"{base.c}.p[{place_of(base, places)}]", base.kind.element), value, "".join(loops))

    def _store(self, place: Value, value: Value, loops: str = "") -> None:
        if value.kind == DUAL and place.kind != DUAL:
            raise TranslationError(f"{place.c} cannot hold a number with derivatives", "an entry with derivatives")
        self._line(f"{loops}{place.c} = {converted(value, place.kind).c};")

    def _augassign(self, node: ast.AugAssign) -> None:
        read = ast.copy_location(ast.parse(ast.unparse(node.target), mode="eval").body, node.target)
        result = self.expressions.arithmetic(node.op, self.expressions.value(read), self.expressions.value(node.value))
        self._put(node.target, result)
