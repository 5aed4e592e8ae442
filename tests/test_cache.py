"""Machine code on disk: found by later processes, forgotten when a law changes; and what kernels are handed."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np
import pytest
from numba import types

import scissordyn
from scissordyn.jit import Handle, kernel, opener

PACKAGE = Path(scissordyn.__file__).parent

ASK = """
import json
import numpy as np
from scissordyn.laws.dispatch import elastic_force
force = elastic_force(0, 1e-5, np.array([1e9, 5e-4]))
stats = elastic_force.stats
print(json.dumps([force, sum(stats.cache_hits.values()), sum(stats.cache_misses.values())]))
"""
"""Liu's force through the dispatch, a caller in another file, and whether its machine code came from disk."""

LIU = 1e9 * 1e-5 * (1e-5 / (2.0 * (5e-4 + 1e-5))) ** 0.5
"""The same by hand: p0 delta sqrt(delta / (2 (c + delta)))."""


def ask(packages: Path, cache: Path) -> tuple[float, int, int]:
    """Force, cache hits and cache misses of a fresh process that sees the package under `packages`."""
    environment = {**os.environ, "PYTHONPATH": str(packages), "SCISSORDYN_CACHE": str(cache), "PYTHONDONTWRITEBYTECODE": "1"}
    done = subprocess.run([sys.executable, "-c", ASK], env=environment, capture_output=True, text=True, check=True)
    force, hits, misses = done.stdout.strip("[]\n").split(",")
    return float(force), int(hits), int(misses)


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    """A folder with a copy of the package that may be edited."""
    packages = tmp_path / "packages"
    shutil.copytree(PACKAGE, packages / PACKAGE.name, ignore=shutil.ignore_patterns("__pycache__"))
    return packages


def kept(cache: Path) -> dict[str, int]:
    """Files of machine code and when they were written."""
    return {str(path.relative_to(cache)): path.stat().st_mtime_ns for path in cache.rglob("*.nb?")}


def test_second_process_compiles_nothing(copy: Path, tmp_path: Path) -> None:
    """Identity: the second process finds the first one's machine code, writes none, and gets the same bits."""
    cache = tmp_path / "cache"
    first = ask(copy, cache)
    files = kept(cache)
    second = ask(copy, cache)
    assert first[1:] == (0, 1)
    assert second[1:] == (1, 0)
    assert first[0] == second[0] == pytest.approx(LIU, rel=1e-14)
    assert files
    assert kept(cache) == files


def test_edited_law_is_compiled_into_its_callers(copy: Path, tmp_path: Path) -> None:
    """Closed form: after an edit of a law, its caller in an unedited file gives the new force, and the old one when undone."""
    cache, law = tmp_path / "cache", copy / "scissordyn" / "laws" / "elastic" / "liu.py"
    text = law.read_text(encoding="utf-8")
    formula = "return p[0] * delta * math.sqrt("
    assert text.count(formula) == 1
    assert ask(copy, cache)[0] == pytest.approx(LIU, rel=1e-14)
    law.write_text(text.replace(formula, "return 3.0 * p[0] * delta * math.sqrt("), encoding="utf-8")
    changed = ask(copy, cache)
    assert changed[0] == pytest.approx(3.0 * LIU, rel=1e-14)
    assert changed[1:] == (0, 1)
    law.write_text(text, encoding="utf-8")
    undone = ask(copy, cache)
    assert undone[0] == pytest.approx(LIU, rel=1e-14)
    assert undone[1:] == (1, 0)


def test_old_generations_are_deleted(copy: Path, tmp_path: Path) -> None:
    """Limit: only the machine code of the latest few editions of the kernels is stored."""
    from scissordyn.jit import KEPT_GENERATIONS

    cache, law = tmp_path / "cache", copy / "scissordyn" / "laws" / "elastic" / "liu.py"
    environment = {**os.environ, "PYTHONPATH": str(copy), "SCISSORDYN_CACHE": str(cache)}
    for edition in range(KEPT_GENERATIONS + 2):
        with law.open("a", encoding="utf-8") as file:
            file.write(f"# {edition}\n")
        subprocess.run([sys.executable, "-c", "import scissordyn.jit"], env=environment, check=True)
    assert len(list((cache / "kernels").iterdir())) == KEPT_GENERATIONS


class Described(NamedTuple):
    """One field of every kind that the package's tuples have."""

    number: int
    vector: Annotated[np.ndarray, types.float64[::1]]
    matrix: Annotated[np.ndarray, types.float64[:, ::1]]
    integers: Annotated[np.ndarray, types.int64[::1]]
    table: Annotated[np.ndarray, types.int64[:, ::1]]
    empty: Annotated[np.ndarray, types.float64[:, ::1]]
    last: int


_open = opener(Described)


@kernel()
def describe(address, sizes, values):
    """Read every field through the address, and write into the arrays."""
    D = _open(address)
    sizes[0], sizes[1], sizes[2] = D.number, D.vector.size, D.matrix.shape[0]
    sizes[3], sizes[4], sizes[5] = D.matrix.shape[1], D.integers.size, D.table.shape[0]
    sizes[6], sizes[7], sizes[8], sizes[9] = D.table.shape[1], D.empty.shape[0], D.empty.shape[1], D.last
    values[0], values[1], values[2], values[3] = D.vector[2], D.matrix[1, 2], D.integers[1], D.table[2, 0]
    D.vector[0] = 7.5
    D.matrix[0, 1] = -2.5
    D.integers[0] = 11
    D.table[1, 1] = 13


def test_handle_opens_to_every_kind_of_field() -> None:
    """Identity: kernels read shapes and elements of all fields through the address, and what they write is seen outside."""
    content = Described(
        number=-(2**40),
        vector=np.array([1.0, 2.0, 3.0]),
        matrix=np.arange(6.0).reshape(2, 3),
        integers=np.array([4, 5], np.int64),
        table=np.arange(6, dtype=np.int64).reshape(3, 2),
        empty=np.zeros((0, 4)),
        last=99,
    )
    handle = Handle(content)
    sizes, values = np.zeros(10, np.int64), np.zeros(4)
    describe(handle.address, sizes, values)
    assert sizes.tolist() == [-(2**40), 3, 2, 3, 2, 3, 2, 0, 4, 99]
    assert values.tolist() == [3.0, 5.0, 5.0, 4.0]
    assert content.vector.tolist() == [7.5, 2.0, 3.0]
    assert content.matrix.tolist() == [[0.0, -2.5, 2.0], [3.0, 4.0, 5.0]]
    assert content.integers.tolist() == [11, 5]
    assert content.table.tolist() == [[0, 1], [2, 13], [4, 5]]
