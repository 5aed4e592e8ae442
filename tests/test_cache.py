"""Machine code on disk: found by later processes, forgotten when a law changes; and what kernels are handed."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np
import pytest
from numba import types

import scissordyn
from scissordyn.cache import folder as folders
from scissordyn.jit import Handle, kernel, opener

PACKAGE = Path(scissordyn.__file__).parent

ASK = """
import json
import numpy as np
from scissordyn.laws.elastic.liu import force as elastic_force
force = elastic_force(1e-5, 1e9, 5e-4)
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
    formula = "return scale * indentation * math.sqrt(indentation / "
    assert text.count(formula) == 1
    assert ask(copy, cache)[0] == pytest.approx(LIU, rel=1e-14)
    law.write_text(text.replace(formula, formula.replace("scale", "3.0 * scale")), encoding="utf-8")
    changed = ask(copy, cache)
    assert changed[0] == pytest.approx(3.0 * LIU, rel=1e-14)
    assert changed[1:] == (0, 1)
    law.write_text(text, encoding="utf-8")
    undone = ask(copy, cache)
    assert undone[0] == pytest.approx(LIU, rel=1e-14)
    assert undone[1:] == (1, 0)


def damage(cache: Path, content: Callable[[bytes], bytes]) -> int:
    """Change every file of machine code; returns how many there are."""
    files = list(cache.rglob("*.nbc"))
    for path in files:
        path.write_bytes(content(path.read_bytes()))
    return len(files)


def flipped(whole: bytes) -> bytes:
    """With one bit the other way round, in the middle."""
    middle = len(whole) // 2
    return whole[:middle] + bytes([whole[middle] ^ 1]) + whole[middle + 1 :]


def test_damaged_machine_code_is_compiled_anew(tmp_path: Path) -> None:
    """Identity: a file that is cut off, empty, of other content or with a wrong bit is replaced, and the force is the same."""
    cache = tmp_path / "cache"
    whole = ask(PACKAGE.parent, cache)
    for content in (lambda whole: whole[: len(whole) // 2], lambda _: b"", lambda _: b"\x80\x04K\x01.", flipped):
        assert damage(cache, content) == len(kept(cache)) > 0
        anew = ask(PACKAGE.parent, cache)
        assert anew == (whole[0], 0, 1)
        assert ask(PACKAGE.parent, cache) == (whole[0], 1, 0)


LIMITED = "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (2000, 2000))\n"
"""No file may grow beyond 2 kB, as on a full disk."""


@pytest.mark.parametrize(("place", "limit"), [("/proc/cache", ""), ("taken/cache", ""), ("cache", LIMITED)])
def test_a_cache_that_cannot_be_written(tmp_path: Path, place: str, limit: str) -> None:
    """Identity: the run goes on, says so once, writes nothing beside the sources and leaves nothing in the temporary folder."""
    beside, temporary = set(PACKAGE.rglob("*.nb?")), tmp_path / "temporary"
    (tmp_path / "taken").write_text("")
    temporary.mkdir()
    own = {"SCISSORDYN_CACHE": str(tmp_path / place), "TMPDIR": str(temporary), "PYTHONDONTWRITEBYTECODE": "1"}
    command = [sys.executable, "-c", limit + ASK]
    done = subprocess.run(command, env={**os.environ, **own}, capture_output=True, text=True, check=True)
    assert float(done.stdout.strip("[]\n").split(",")[0]) == pytest.approx(LIU, rel=1e-14)
    assert done.stderr.count("scissordyn: the kernel cache") == done.stderr.count("\n") == 1
    assert set(PACKAGE.rglob("*.nb?")) == beside
    assert list(temporary.iterdir()) == []


FORCE = """
import numpy as np
from scissordyn.laws.elastic.liu import force as elastic_force

def force(k):
    value = elastic_force(1e-5, 1e9, 5e-4)
    return value, sum(elastic_force.stats.cache_hits.values())
"""

SHARED = """
from force import force
from scissordyn.study.processes import Processes

if __name__ == "__main__":
    force(0)
    with Processes(2) as engine:
        for result in engine.each(force, [1, 2, 3]):
            print(*result.value)
"""


def test_workers_share_a_temporary_cache(tmp_path: Path) -> None:
    """Identity: where the cache cannot be written, workers load what their parent compiled, and say nothing themselves."""
    (tmp_path / "taken").write_text("")
    (tmp_path / "force.py").write_text(FORCE)
    (tmp_path / "script.py").write_text(SHARED)
    environment = {**os.environ, "SCISSORDYN_CACHE": str(tmp_path / "taken"), "TMPDIR": str(tmp_path)}
    command = [sys.executable, str(tmp_path / "script.py")]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True, timeout=200)
    rows = [line.split() for line in done.stdout.splitlines()]
    assert [hits for _, hits in rows] == ["1", "1", "1"]
    assert len({force for force, _ in rows}) == 1
    assert done.stderr.count("\n") == 1


def test_importing_deletes_nothing(tmp_path: Path) -> None:
    """Identity: folders of other checkouts and of earlier editions stay when the package is imported and used."""
    root = tmp_path / "kernels"
    for number in range(12):
        (root / f"{number:016x}-{number:08x}").mkdir(parents=True)
    ask(PACKAGE.parent, tmp_path)
    assert len(list(root.iterdir())) == 13


HOLD = """
import sys, os
from scissordyn.lock import hold
handle = os.open(sys.argv[1], os.O_RDWR | os.O_CREAT)
assert hold(handle, shared=True)
print("held", flush=True)
sys.stdin.read()
"""


def test_cleaning_is_asked_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """Identity: `scissordyn cache --clean` deletes what is ours or orphaned, old and not in use, and nothing else."""
    from scissordyn.cli.main import status_of

    monkeypatch.setenv("SCISSORDYN_CACHE", str(tmp_path))
    root, ours = tmp_path / "kernels", folders.place_digest()
    current = f"{folders.source_digest(PACKAGE)}-{ours}"
    places = {
        current: PACKAGE,
        f"{1:016x}-{ours}": PACKAGE,
        f"{2:016x}-{ours}": PACKAGE,  # in use
        f"{3:016x}-{3:08x}": tmp_path,  # a package that is there
        f"{4:016x}-{4:08x}": tmp_path / "gone",
        "notes": None,
    }
    for name, package in places.items():
        (root / name).mkdir(parents=True)
        (root / name / "kernel.nbc").write_bytes(bytes(1000))
        if package is not None:
            (root / name / folders.OWNER).write_text(str(package))
    command = [sys.executable, "-c", HOLD, str(root / f"{2:016x}-{ours}" / folders.LOCK)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as user:
        assert user.stdout is not None
        assert user.stdout.readline() == "held\n"
        assert status_of(["cache"]) == 0
        shown = capsys.readouterr().out
        assert str(root) in shown
        assert [shown.count(words) for words in ("of this version", ", old", ", in use", "0.0 MB")] == [1, 2, 1, 5]
        assert {path.name for path in root.iterdir()} == set(places)
        assert status_of(["cache", "--clean"]) == 0
        assert {path.name for path in root.iterdir()} == {current, f"{2:016x}-{ours}", f"{3:016x}-{3:08x}", "notes"}
        assert user.stdin is not None
        user.stdin.close()
    assert status_of(["cache", "--clean"]) == 0
    assert {path.name for path in root.iterdir()} == {current, f"{3:016x}-{3:08x}", "notes"}


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


def content() -> Described:
    """Something in every field."""
    return Described(
        number=-(2**40),
        vector=np.array([1.0, 2.0, 3.0]),
        matrix=np.arange(6.0).reshape(2, 3),
        integers=np.array([4, 5], np.int64),
        table=np.arange(6, dtype=np.int64).reshape(3, 2),
        empty=np.zeros((0, 4)),
        last=99,
    )


class Whole(NamedTuple):
    """A tuple with such a part."""

    part: Described


FROZEN = np.zeros(3)
FROZEN.flags.writeable = False


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("vector", np.zeros(3, np.int32)),
        ("vector", np.zeros(3, np.float32)),
        ("vector", np.zeros((3, 1))),
        ("vector", np.zeros(6)[::2]),
        ("vector", FROZEN),
        ("vector", [1.0, 2.0, 3.0]),
        ("matrix", np.zeros((3, 2)).T),
        ("integers", np.zeros(2)),
        ("integers", np.zeros(2, np.int32)),
        ("number", 1.0),
        ("number", np.zeros(1, np.int64)),
    ],
)
def test_handles_refuse_other_types(field: str, value: object) -> None:
    """Identity: kernels would read another type as garbage; it is refused when the handle is made and when it is exchanged."""
    with pytest.raises(TypeError, match=rf"Described\.{field}: "):
        Handle(content()._replace(**{field: value}))
    handle = Handle(Whole(content()))
    before = handle.content
    with pytest.raises(TypeError, match=rf"Described\.{field}: "):
        handle.exchange("part", **{field: value})
    assert handle.content is before


def test_handle_opens_to_every_kind_of_field() -> None:
    """Identity: kernels read shapes and elements of all fields through the address, and what they write is seen outside."""
    given = content()
    handle = Handle(given)
    sizes, values = np.zeros(10, np.int64), np.zeros(4)
    describe(handle.address, sizes, values)
    assert sizes.tolist() == [-(2**40), 3, 2, 3, 2, 3, 2, 0, 4, 99]
    assert values.tolist() == [3.0, 5.0, 5.0, 4.0]
    assert given.vector.tolist() == [7.5, 2.0, 3.0]
    assert given.matrix.tolist() == [[0.0, -2.5, 2.0], [3.0, 4.0, 5.0]]
    assert given.integers.tolist() == [11, 5]
    assert given.table.tolist() == [[0, 1], [2, 13], [4, 5]]
