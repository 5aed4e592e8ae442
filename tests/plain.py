"""Check the first words of docstrings, names of test files and subjects of the last commits: python tests/plain.py."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]  # Root folder of the repository

# First words that a docstring may not have: prepositions
PREPOSITIONS = {"Of", "By", "With", "In", "On", "Between", "For", "From", "Beside", "To", "As", "At"}
PRONOUNS = {"Those", "That", "What", "Which", "Where", "How", "Whose", "When", "Whether", "Who"}
"""First words that a docstring may not have: pronouns and question words."""

SUBJECT_MAX = 72  # [characters] longest subject of a commit
COMMITS = 20  # Number of latest commits that are checked


def docstrings(path: Path) -> Iterator[tuple[int, str]]:
    """Yield line and text of each docstring of a file."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef) and ast.get_docstring(node):
            yield node.body[0].lineno, ast.get_docstring(node) or ""


def unclear_docstrings(folder: Path) -> list[str]:
    """Return places of docstrings that begin with a preposition or a pronoun."""
    return [
        f"{path.relative_to(ROOT)}:{line}: a docstring begins with '{text.split()[0]}'; begin with a verb or a noun"
        for path in sorted(folder.rglob("*.py"))
        for line, text in docstrings(path)
        if text.split()[0] in PREPOSITIONS | PRONOUNS
    ]


def repeated_names(folder: Path) -> list[str]:
    """Return the files of tests that pytest would import under one name; a name begins above the folders with `__init__`."""
    places: dict[tuple[str, ...], list[str]] = {}
    for path in sorted(folder.rglob("*.py")):
        if path.name not in ("conftest.py", "__init__.py"):
            first = next(above for above in path.parents if not (above / "__init__.py").exists())
            places.setdefault(path.relative_to(first).parts, []).append(str(path.relative_to(folder.parent)))
    return [
        f"{', '.join(paths)}: pytest imports them under one name; rename all but one"
        for paths in places.values()
        if len(paths) > 1
    ]


def long_subjects() -> list[str]:
    """Return the subjects of the last commits that are too long; none outside a repository."""
    listed = subprocess.run(
        ["git", "log", "--no-merges", f"-{COMMITS}", "--format=%h %s"], cwd=ROOT, capture_output=True, text=True, check=False
    )
    lines = listed.stdout.splitlines() if listed.returncode == 0 else []
    return [
        f"commit {name}: subject of {len(subject)} characters; at most {SUBJECT_MAX}"
        for name, _, subject in (line.partition(" ") for line in lines)
        if len(subject) > SUBJECT_MAX
    ]


if __name__ == "__main__":
    faults = [*unclear_docstrings(ROOT / "src"), *repeated_names(ROOT / "tests"), *long_subjects()]
    print("\n".join(faults) or "docstrings, names of tests and commit subjects are as CONTRIBUTING.md asks")
    sys.exit(bool(faults))
