"""Public names and completion; imports of programs; constants are bound once."""

import ast
import importlib
import importlib.util
import json
import rlcompleter
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest

import scissordyn as sd

ROOT = Path(__file__).parents[2]  # Root folder of the repository
# Python files outside the package
PROGRAMS = sorted(file for folder in ("benchmarks", "validation", "docs", "examples") for file in (ROOT / folder).rglob("*.py"))

# Program that prints public names before their first use
FRESH = "import json, scissordyn as sd; print(json.dumps([dir(sd), dir(sd.plot)]))"


def test_shown_names():
    """Contract: `dir` and completion show the public names only, before and after modules are loaded."""
    done = subprocess.run([sys.executable, "-c", FRESH], capture_output=True, text=True, check=True)
    for module in ("scissordyn.studies.compute.execute", "scissordyn.run.engine", "scissordyn.plot.joint"):
        importlib.import_module(module)
    completer, completed = rlcompleter.Completer({"sd": sd}), []
    while (name := completer.complete("sd.", len(completed))) is not None:
        completed.append(name.removeprefix("sd.").partition("(")[0])
    assert [dir(sd), dir(sd.plot)] == json.loads(done.stdout) == [sorted(["__version__", *sd.__all__]), sorted(sd.plot.__all__)]
    assert sorted(completed) == sorted(sd.__all__)
    assert sd.Processes.__module__ == "scissordyn.run.engine"
    assert callable(sd.study)
    assert list(sd.__all__) == sorted(sd.__all__, key=lambda name: (not name.isupper(), not name[0].isupper(), name))
    for name in sd.__all__:
        assert getattr(sd, name) is not None


def test_the_two_tables_of_public_names_agree():
    """Contract: type checkers read the same public names as the package imports."""
    stub = ast.parse((ROOT / "src/scissordyn/__init__.pyi").read_text(encoding="utf-8"))
    imports = [node for node in stub.body if isinstance(node, ast.ImportFrom) and node.module]
    read = {name.name: str(node.module).removeprefix("scissordyn.") for node in imports for name in node.names}
    assert {name: module for name, module in read.items() if name != "plot"} == sd.MODULE_OF


@pytest.mark.parametrize("program", PROGRAMS, ids=lambda file: str(file.relative_to(ROOT)))
def test_imports_of_programs(program):
    """Contract: programs that no test runs import only names that the package has."""
    for node in ast.walk(ast.parse(program.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and str(node.module).startswith("scissordyn"):
            module = importlib.import_module(str(node.module))
            for name in (alias.name for alias in node.names):
                assert hasattr(module, name) or importlib.util.find_spec(f"{node.module}.{name}"), f"{node.module}.{name}"


def bound(module):
    """Return the number of plain assignments to each name of a module."""
    found = Counter()
    for statement in ast.parse(module.read_text(encoding="utf-8")).body:
        if isinstance(statement, ast.Assign):
            found.update(each.id for target in statement.targets for each in ast.walk(target) if isinstance(each, ast.Name))
        elif isinstance(statement, ast.AnnAssign) and isinstance(statement.target, ast.Name) and statement.value is not None:
            found[statement.target.id] += 1
    return found


def test_module_binds_each_constant_once():
    """Contract: no constant is assigned twice, as functions above the second assignment would read another value."""
    modules = [path for room in ("scissordyn", "scissordyn_paper") for path in (ROOT / "src" / room).rglob("*.py")]
    assert len(modules) > 400
    twice = {str(path): name for path in modules for name, times in bound(path).items() if times > 1 and name.isupper()}
    assert not twice


def test_files_of_tests_with_one_name_are_found(tmp_path):
    """Contract: `make check` names two files of tests that pytest would take for one; packages keep names apart."""
    spec = importlib.util.spec_from_file_location("plain", ROOT / "tests" / "plain.py")
    assert spec
    assert spec.loader
    plain = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(plain)
    folder = tmp_path / "tests"
    for name in (
        "run/test_wear.py",
        "laws/test_wear.py",
        "plot/__init__.py",
        "plot/test_wear.py",
        "run/conftest.py",
        "laws/conftest.py",
    ):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).touch()
    (found,) = plain.repeated_names(folder)
    assert found.startswith("tests/laws/test_wear.py, tests/run/test_wear.py: ")
    (folder / "laws" / "__init__.py").touch()
    assert plain.repeated_names(folder) == []
