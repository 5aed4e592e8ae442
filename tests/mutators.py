"""Changes of a source file that a test has to notice: a number, a sign, a term, a bound, a comparison."""

import ast
import random
from dataclasses import dataclass
from pathlib import Path

__all__ = ["KINDS", "Change", "Mutator", "changed", "changes_of", "drawn"]

FACTOR = 1.01  # Factor by which numbers are multiplied
INPUTS = {
    *("length", "rate", "angle", "speed", "travel", "x", "y", "cosine", "sine", "x_rate", "y_rate", "cosine_rate", "sine_rate"),
    *("mode", "approach_speed", "factor", "depth", "twist", "table", "first", "count", "straight", "negative", "positive"),
    *("t", "q", "z", "dz", "p", "follows"),
    *("indentation", "elastic", "approach", "relaxed_force", "slip_speed", "normal_force", "bristle_deflection", "v", "delta"),
    *(
        "first_deflection",
        "second_deflection",
        "dwell_time",
        "error",
        "reference_speed",
        "time",
        "delayed",
        "recorded",
        "torque",
    ),
    *("integral_torque", "filtered_rate", "command", "described", "pointer", "low", "high"),
}
"""Names of kernel arguments that are not parameters: coordinates, rates, states, rows, counts and switches."""

KERNELS = "force", "energy", "steady", "start", "settled", "limit", "torque", "gap", "switch", "guide_force", "_work"
"""Names, or parts of names, of functions that are kernels."""

EDGES = {ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt}  # Comparisons that differ only for equal values
# Comparisons with the opposite result
OPPOSITES = {ast.Lt: ast.GtE, ast.LtE: ast.Gt, ast.Gt: ast.LtE, ast.GtE: ast.Lt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq}
# Functions that choose the other end of a range
BOUNDS = {"max": "min", "min": "max", "maximum": "minimum", "minimum": "maximum"}

KINDS = {
    "plus": "a + b becomes a - b, or the other way round",
    "dropped": "a + b becomes a; a - b becomes a",
    "sign": "-a becomes a",
    "bound": "max becomes min, or the other way round",
    "edge": "< becomes <=, > becomes >=, or the other way round",
    "opposite": "a comparison becomes its opposite",
    "factor": "a * b becomes a / b, or the other way round",
    "both": "and becomes or, or the other way round",
}
"""Kinds of changes of an expression, by name."""


@dataclass(frozen=True)
class Change:
    """Change of one expression of a source file."""

    file: str  # Path of the file in the package
    line: int
    function: str  # Name of the function with the expression
    kind: str  # One of `KINDS`
    index: int  # Index of the expression among those of its kind in the file
    text: str  # Expression before the change


class _Changer(ast.NodeTransformer):
    """Counter of the expressions of each kind that can be changed, which also changes one of them."""

    def __init__(self, kind: str = "", index: int = -1) -> None:
        self.kind, self.index, self.function = kind, index, ""
        self.found: list[tuple[int, str, str, int, str]] = []
        self.count = dict.fromkeys(KINDS, 0)

    def _wanted(self, kind: str, node: ast.AST) -> bool:
        at, self.count[kind] = self.count[kind], self.count[kind] + 1
        self.found.append((node.lineno, self.function, kind, at, ast.unparse(node)))  # type: ignore[attr-defined]
        return kind == self.kind and at == self.index

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.AST:
        """Visit the body of a function, unless it is __post_init__, whose checks are tested by error messages."""
        if node.name == "__post_init__":
            return node
        outer, self.function = self.function, node.name
        node.body = [self.visit(part) for part in node.body]
        self.function = outer
        return node

    def visit_AnnAssign(self, node: ast.AnnAssign) -> ast.AST:
        """Visit the value of an annotated variable, not its annotation, where | is no operation on numbers."""
        node.value = node.value and self.visit(node.value)
        return node

    def visit_Raise(self, node: ast.Raise) -> ast.AST:
        """Leave a `raise` statement unchanged, because its message does not affect the mechanics."""
        return node

    def visit_JoinedStr(self, node: ast.JoinedStr) -> ast.AST:
        """Leave a formatted text unchanged."""
        return node

    def visit_BinOp(self, node: ast.BinOp) -> ast.AST:
        texts = [part for part in ast.walk(node) if isinstance(part, ast.JoinedStr | ast.List | ast.Tuple)]
        texts += [part for part in ast.walk(node) if isinstance(part, ast.Constant) and isinstance(part.value, str)]
        if not texts and isinstance(node.op, ast.Add | ast.Sub):
            if self._wanted("plus", node):
                node.op = ast.Sub() if isinstance(node.op, ast.Add) else ast.Add()
            if self._wanted("dropped", node):
                return node.left
        if not texts and isinstance(node.op, ast.Mult | ast.Div) and self._wanted("factor", node):
            node.op = ast.Div() if isinstance(node.op, ast.Mult) else ast.Mult()
        return self.generic_visit(node)

    def visit_AugAssign(self, node: ast.AugAssign) -> ast.AST:
        """Exchange += and -=, except for a list that is extended and for a counter."""
        if isinstance(node.op, ast.Add | ast.Sub) and not isinstance(node.value, ast.List | ast.Tuple | ast.ListComp):
            counts = isinstance(node.value, ast.Constant) and isinstance(node.value.value, int)
            if not counts and self._wanted("plus", node):
                node.op = ast.Sub() if isinstance(node.op, ast.Add) else ast.Add()
        return self.generic_visit(node)

    def visit_UnaryOp(self, node: ast.UnaryOp) -> ast.AST:
        """Remove a minus sign, except that of a literal integer such as -1, which is an index or means "none"."""
        literal = isinstance(node.operand, ast.Constant) and isinstance(node.operand.value, int)
        if isinstance(node.op, ast.USub) and not literal and self._wanted("sign", node):
            return node.operand
        return self.generic_visit(node)

    def visit_Call(self, node: ast.Call) -> ast.AST:
        name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
        if name in BOUNDS and self._wanted("bound", node):
            if isinstance(node.func, ast.Attribute):
                node.func.attr = BOUNDS[name]
            else:
                node.func = ast.Name(BOUNDS[name], ast.Load())
        return self.generic_visit(node)

    def visit_Compare(self, node: ast.Compare) -> ast.AST:
        """Add or remove the equality of a comparison of sizes, or replace a comparison by its opposite."""
        kind = type(node.ops[0])
        if len(node.ops) == 1 and kind in EDGES and self._wanted("edge", node):
            node.ops = [EDGES[kind]()]
        elif len(node.ops) == 1 and kind in OPPOSITES and self._wanted("opposite", node):
            node.ops = [OPPOSITES[kind]()]
        return self.generic_visit(node)

    def visit_BoolOp(self, node: ast.BoolOp) -> ast.AST:
        """Exchange `and` and `or`."""
        if self._wanted("both", node):
            node.op = ast.Or() if isinstance(node.op, ast.And) else ast.And()
        return self.generic_visit(node)


def changes_of(root: Path, file: str) -> list[Change]:
    changer = _Changer()
    changer.visit(ast.parse((root / file).read_text()))
    return [Change(file, line, function, kind, index, text) for line, function, kind, index, text in changer.found]


def changed(root: Path, change: Change) -> str:
    tree = _Changer(change.kind, change.index).visit(ast.parse((root / change.file).read_text()))
    return ast.unparse(ast.fix_missing_locations(tree))


def drawn(root: Path, counts: dict[str, int], seed: int) -> list[Change]:
    """Return random changes, none twice, as many of each subpackage as `counts` says; each kind is equally probable."""
    random_ = random.Random(seed)
    chosen: list[Change] = []
    for subpackage, count in counts.items():
        files = sorted(str(path.relative_to(root)) for path in (root / subpackage).glob("*.py"))
        pools = {kind: [] for kind in KINDS}  # type: dict[str, list[Change]]
        for change in (change for file in files for change in changes_of(root, file)):
            pools[change.kind].append(change)
        for _ in range(count):
            kind = random_.choice(sorted(kind for kind, pool in pools.items() if pool))
            chosen.append(pools[kind].pop(random_.randrange(len(pools[kind]))))
    return chosen


class Mutator(ast.NodeTransformer):
    """Counter of the numbers of a file, which also scales the number with the index `target`."""

    def __init__(self, target: int | None = None, named: bool = False):
        self.target, self.named, self.found, self.owner, self.function = target, named, [], "", ""
        self.parameters: set[str] = set()

    def number(self, node):
        """Count a number; return its node, scaled if it is the number with the index `target`."""
        self.found.append((node.lineno, self.owner, self.function, ast.unparse(node)))
        if len(self.found) - 1 != self.target:
            return node
        return ast.BinOp(ast.Constant(FACTOR), ast.Mult(), node)

    def visit_ClassDef(self, node):
        """Visit the body of a class, with its name in `owner`."""
        self.owner = node.name
        node.body = [self.visit(part) for part in node.body]
        self.owner = ""
        return node

    def visit_FunctionDef(self, node):
        """Visit the body of a function, unless it is __post_init__, which only checks."""
        if node.name == "__post_init__":
            return node
        outer, self.function = self.function, node.name
        if self.named and not self.owner and (node.name in KERNELS or node.decorator_list):
            self.parameters = {argument.arg for argument in node.args.args} - INPUTS
        node.body = [self.visit(part) for part in node.body]
        self.function, self.parameters = outer, set()
        return node

    def visit_Name(self, node):
        """Count a parameter that a kernel reads by name."""
        return self.number(node) if node.id in self.parameters and isinstance(node.ctx, ast.Load) else node

    def visit_AnnAssign(self, node):
        """Leave a field of a class unchanged, because it is only a declaration."""
        return node if self.owner else self.generic_visit(node)

    def visit_Raise(self, node):
        """Leave a `raise` statement unchanged, because its message does not affect the mechanics."""
        return node

    def visit_Call(self, node):
        if not isinstance(node.func, ast.Name) or not (self.named or node.func.id == "Quantity"):
            return self.generic_visit(node)
        if node.func.id not in ("Quantity", "component", "int"):
            plain = node.func.id in ("min", "max", "abs")
            node.args = [self.visit(part) if plain or not self.passed_on(part) else part for part in node.args]
        return node

    def visit_Attribute(self, node):
        """Count a number of a contact's record, which the mechanics read by its name."""
        record = ast.unparse(node.value) in ("p", "S.parameters.contact[j]")
        return self.number(node) if record and isinstance(node.ctx, ast.Load) else self.generic_visit(node)

    def passed_on(self, node) -> bool:
        """Return whether an argument is a parameter that another function of the file reads."""
        return isinstance(node, ast.Name) and node.id in self.parameters and self.function in KERNELS

    def visit_Compare(self, node):
        """Visit a comparison; one with zero keeps its parameters, because scaling does not change their sign."""
        sides = [node.left, *node.comparators]
        if any(isinstance(side, ast.Constant) and side.value == 0 for side in sides):
            sides = [side if is_parameter(side) or self.is_number(side) else self.visit(side) for side in sides]
            node.left, node.comparators = sides[0], sides[1:]
            return node
        return self.generic_visit(node)

    def is_number(self, node) -> bool:
        """Return whether `visit` counts this node as one number."""
        return isinstance(node, ast.Starred | ast.Constant) or (isinstance(node, ast.Name) and node.id in self.parameters)

    def visit_Return(self, node):
        rows = self.function in ("parameters", "row") or self.function.endswith("_numbers")
        if rows and isinstance(node.value, ast.Tuple):
            # a literal is one number, not two
            node.value.elts = [
                self.visit(part) if self.is_number(part) else self.number(self.visit(part)) for part in node.value.elts
            ]
            return node
        return self.generic_visit(node)

    def visit_BinOp(self, node):
        node = self.generic_visit(node)
        if isinstance(node.op, ast.Pow) and isinstance(node.right, ast.Constant) and isinstance(node.right.value, int):
            node.right = self.number(node.right)
        return node

    def visit_Constant(self, node):
        """Count a float unless it is zero."""
        return self.number(node) if isinstance(node.value, float) and node.value != 0.0 else node

    def visit_Subscript(self, node):
        """Count a parameter that a kernel reads from its row `p` or from a table."""
        of_table = self.named and isinstance(node.value, ast.Name) and node.value.id == "table"
        read = (is_parameter(node) or of_table) and isinstance(node.ctx, ast.Load)
        return self.number(node) if read else self.generic_visit(node)


def is_parameter(node) -> bool:
    """Return whether an expression is an entry of a kernel's array of parameters `p`, such as p[3]."""
    return isinstance(node, ast.Subscript) and isinstance(node.value, ast.Name) and node.value.id == "p"
