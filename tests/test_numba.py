"""Which parts of numba beyond its public interface the package stands on: each is named here, and in the version that runs."""

from __future__ import annotations

import ast
import importlib
import tomllib
from importlib.metadata import version
from pathlib import Path

import numba
from packaging.specifiers import SpecifierSet

import scissordyn

PACKAGE = Path(scissordyn.__file__).parent
PROJECT = PACKAGE.parents[1] / "pyproject.toml"
PUBLIC = {"numba", "numba.extending", "numba.types", "llvmlite"}

INTERNALS = {
    "numba.core.caching": {"CompileResultCacheImpl", "FunctionCache"},
    "numba.core.ccallback": {"CFunc"},
    "numba.core.codegen": {"JITCodeLibrary"},
    "numba.core.compiler": {"CompilerBase", "DefaultPassBuilder"},
    "numba.core.compiler_machinery": {"AnalysisPass", "PassManager", "register_pass"},
    "numba.core.dispatcher": {"Dispatcher"},
    "numba.core.registry": {"cpu_target"},
    "numba.core.serialize": {"dumps"},
    "numba.core.sigutils": {"normalize_signature"},
    "numba.core.typed_passes": {"NativeLowering"},
    "numba.core.types.function_type": {"CompileResultWAP"},
    "numba.core.typing.templates": {"AttributeTemplate"},
    "numba.np.numpy_support": {"as_dtype"},
    "numba.core": {"cgutils"},
    "numba.experimental.function_type": set(),
    "llvmlite.binding": {"parse_assembly", "address_of_symbol"},
}
"""Modules and the names that are imported from them, or asked of them."""

PRIVATE = {
    ("numba.core.codegen", "JITCodeLibrary"): {
        "_ensure_finalized",
        "_get_module_for_linking",
        "_raise_if_finalized",
    },
    ("numba.core.caching", "FunctionCache"): {"_index_key"},
}
"""Methods with an underscore that are called."""

FIELDS = {"_final_module", "_finalized", "_linking_libraries", "_reload_init", "_cache", "_lock"}
"""Fields of numba's objects, with an underscore, that are read."""

OWN = {"_make", "_replace", "_fields", "_field_defaults", "_asdict", "_exit"}
"""Public in spite of the underscore: named tuples, `os._exit`."""


def _trees() -> list[ast.Module]:
    """The files that name numba or llvmlite."""
    texts = [file.read_text() for file in PACKAGE.rglob("*.py")]
    return [ast.parse(text) for text in texts if "numba" in text or "llvmlite" in text]


def test_every_internal_of_numba_is_listed() -> None:
    """What is imported from numba's inner modules is exactly what is listed; what is listed is there."""
    found: dict[str, set[str]] = {}
    for tree in _trees():
        for node in ast.walk(tree):
            if isinstance(node, ast.ImportFrom) and node.module and node.module.split(".")[0] in ("numba", "llvmlite"):
                if node.module not in PUBLIC:
                    found.setdefault(node.module, set()).update(name.name for name in node.names)
            elif isinstance(node, ast.Import):
                for name in node.names:
                    if name.name.split(".")[0] in ("numba", "llvmlite") and name.name not in PUBLIC:
                        found.setdefault(name.name, set())
    listed = {module: names if module != "llvmlite.binding" else set() for module, names in INTERNALS.items()}
    assert found == listed
    for module, names in INTERNALS.items():
        there = importlib.import_module(module)
        assert all(hasattr(there, name) for name in names), module
    for (module, owner), names in PRIVATE.items():
        kind = getattr(importlib.import_module(module), owner)
        assert all(callable(getattr(kind, name)) for name in names), owner


def test_every_private_field_of_numba_is_listed() -> None:
    """A field with an underscore that no class of these files has is numba's, and is listed."""
    from_outside = set().union(*PRIVATE.values()) | FIELDS
    defined, asked = set(OWN), set()
    for tree in _trees():
        for node in ast.walk(tree):
            if isinstance(node, ast.FunctionDef | ast.ClassDef):
                defined.add(node.name)
            elif isinstance(node, ast.AnnAssign | ast.Assign):
                targets = [node.target] if isinstance(node, ast.AnnAssign) else node.targets
                defined |= {one.attr for one in targets if isinstance(one, ast.Attribute)}
                defined |= {one.id for one in targets if isinstance(one, ast.Name)}
            elif isinstance(node, ast.Attribute) and node.attr.startswith("_") and not node.attr.startswith("__"):
                asked.add(node.attr)
    assert asked - defined <= from_outside
    assert from_outside <= asked


def test_the_bounds_on_numba_enclose_the_version_that_is_tested() -> None:
    """A later version may have other internals: it is allowed when the tests have passed with it."""
    named = tomllib.loads(PROJECT.read_text())["project"]["dependencies"]
    bound = SpecifierSet(next(line for line in named if line.startswith("numba")).removeprefix("numba"))
    assert version("numba") == numba.__version__
    assert numba.__version__ in bound
    assert {one.operator for one in bound} == {">=", "<"}
