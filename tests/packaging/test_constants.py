"""Constants of modules are bound once."""

import ast
from collections import Counter
from pathlib import Path

import scissordyn

ROOMS = Path(scissordyn.__file__).parents[1]


def bound(module: Path) -> Counter[str]:
    """How often each name is bound by a plain statement of a module: what a condition chooses is bound once."""
    found: Counter[str] = Counter()
    for statement in ast.parse(module.read_text(encoding="utf-8")).body:
        if isinstance(statement, ast.Assign):
            found.update(each.id for target in statement.targets for each in ast.walk(target) if isinstance(each, ast.Name))
        elif isinstance(statement, ast.AnnAssign) and isinstance(statement.target, ast.Name) and statement.value is not None:
            found[statement.target.id] += 1
    return found


def test_a_module_binds_each_constant_once() -> None:
    """Identity: a constant that is bound a second time changes, in silence, what functions above read."""
    modules = [path for room in ("scissordyn", "scissordyn_paper") for path in (ROOMS / room).rglob("*.py")]
    assert len(modules) > 500
    twice = {str(path): name for path in modules for name, times in bound(path).items() if times > 1 and name.isupper()}
    assert not twice
