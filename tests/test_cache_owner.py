"""Machine code on disk that somebody else could have written: never executed."""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from scissordyn.cache.kernel import HEAD
from scissordyn.cache.private import folder_fault
from test_cache import ASK, LIU, PACKAGE

NOBODY = 65534

ROOT = hasattr(os, "geteuid") and os.geteuid() == 0

pytestmark = pytest.mark.skipif(not hasattr(os, "geteuid"), reason="needs rights of files as Unix has them")

root = pytest.mark.skipif(not ROOT, reason="only root can make files of another user")


def ask(cache: Path) -> tuple[list[float], str]:
    """Force, cache hits and cache misses of a fresh process, and what it says on stderr."""
    own = {"PYTHONPATH": str(PACKAGE.parent), "SCISSORDYN_CACHE": str(cache), "PYTHONDONTWRITEBYTECODE": "1"}
    done = subprocess.run(
        [sys.executable, "-c", ASK], env={**os.environ, **own}, capture_output=True, text=True, check=True, timeout=300
    )
    return [float(one) for one in done.stdout.strip("[]\n").split(",")], done.stderr


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A cache of this user's own, as a process leaves it."""
    cache = tmp_path_factory.mktemp("whole") / "cache"
    ask(cache)
    return cache


@pytest.fixture
def planted(whole: Path, tmp_path: Path) -> tuple[Path, Path]:
    """A cache whose files of machine code make a file when they are read, and that file."""
    cache, mark = tmp_path / "place" / "cache", tmp_path / "executed"
    cache.parent.mkdir(mode=0o755)
    shutil.copytree(whole, cache)
    packed = f"cos\nsystem\n(S'touch {mark}'\ntR.".encode()
    for file in cache.rglob("*.nbc"):
        file.write_bytes(HEAD + hashlib.sha256(packed).digest() + packed)
    return cache, mark


def generation(cache: Path) -> Path:
    """The folder of the machine code."""
    (found,) = (cache / "kernels").iterdir()
    return found


def files(cache: Path) -> list[Path]:
    """The files of machine code."""
    return list(cache.rglob("*.nbc"))


def given_away(*paths: Path) -> None:
    """Files and folders become another user's."""
    for path in paths:
        os.chown(path, NOBODY, NOBODY, follow_symlinks=False)


def reached_by_a_link(cache: Path) -> None:
    """The cache is a link of another user's, in a folder where everybody may make some."""
    moved = cache.parent.parent / "moved"
    cache.rename(moved)
    cache.symlink_to(moved)
    cache.parent.chmod(0o1777)
    given_away(cache)


CASES: dict[str, tuple[Callable[[Path], object], str]] = {
    "a folder for all": (lambda cache: cache.chmod(0o777), "is not used: '{cache}' can be written by others"),
    "its folder, for all": (lambda cache: cache.parent.chmod(0o777), "is not used: '{parent}' can be written by others"),
    "a folder for a group": (lambda cache: generation(cache).chmod(0o775), "can be written by others; type: chmod go-w"),
    "a sticky folder": (lambda cache: generation(cache).chmod(0o1777), "can be written by others; type: chmod go-w"),
    "files for all": (
        lambda cache: [one.chmod(0o666) for one in files(cache)],
        ".nbc' can be written by others; it is not used",
    ),
    "files for a group": (
        lambda cache: [one.chmod(0o660) for one in files(cache)],
        ".nbc' can be written by others; it is not",
    ),
}

OTHERS: dict[str, tuple[Callable[[Path], object], str]] = {
    "everything": (lambda cache: given_away(cache, *cache.rglob("*")), "is not used: '{cache}' belongs to user "),
    "its folder": (lambda cache: given_away(cache.parent), "is not used: '{parent}' belongs to user "),
    "the folder of kernels": (lambda cache: given_away(cache / "kernels"), "is not used: '{cache}/kernels' belongs to user "),
    "the generation": (lambda cache: given_away(generation(cache)), "' belongs to user "),
    "files": (lambda cache: given_away(*files(cache)), ".nbc' belongs to user "),
    "a link": (reached_by_a_link, "is not used: '{cache}' belongs to user "),
}


@pytest.mark.parametrize(
    ("change", "says"),
    [pytest.param(*case, id=name) for name, case in CASES.items()]
    + [pytest.param(*case, id=f"another user's {name}", marks=root) for name, case in OTHERS.items()],
)
def test_what_others_can_write_is_not_executed(planted: tuple[Path, Path], change: Callable[[Path], object], says: str) -> None:
    """Identity: code planted where another user could have put it is not executed; the force is right and one line says why."""
    cache, mark = planted
    change(cache)
    (force, hits, misses), error = ask(cache)
    assert not mark.exists()
    assert (force, hits, misses) == (pytest.approx(LIU, rel=1e-14), 0, 1)
    assert says.format(cache=cache, parent=cache.parent) in error
    assert error.count("\n") == 1


def test_the_planted_code_would_be_executed(planted: tuple[Path, Path]) -> None:
    """Limit: in a cache that nobody else can write to the same files are read, so that the other tests can fail."""
    cache, mark = planted
    ask(cache)
    assert mark.exists()


def test_a_sticky_folder_above_is_safe(whole: Path, tmp_path: Path) -> None:
    """Identity: in a folder as /tmp is, where all may write and none may replace what is another's, a cache is used."""
    place = tmp_path / "sticky"
    place.mkdir()
    place.chmod(0o1777)
    shutil.copytree(whole, place / "cache")
    (force, hits, _), error = ask(place / "cache")
    assert (force, hits, error) == (pytest.approx(LIU, rel=1e-14), 1, "")


def test_folders_are_made_for_one_user(tmp_path: Path) -> None:
    """Identity: whatever rights new folders have by default, those of the cache are this user's alone, and it is used."""
    before = os.umask(0)
    try:
        ask(tmp_path / "new" / "cache")
    finally:
        os.umask(before)
    made = [path for path in (tmp_path / "new").rglob("*") if path.suffix in ("", ".nbc") and path.name != "package"]
    assert len(made) >= 4
    assert {path.stat().st_mode & 0o077 for path in (tmp_path / "new", *made)} == {0}
    assert ask(tmp_path / "new" / "cache")[0][1] == 1.0


@root
def test_links_are_followed_as_the_system_does(tmp_path: Path) -> None:
    """Identity: own links, also relative ones and those with '..', are allowed; a folder that they lead through counts."""
    target, other = tmp_path / "a" / "target", tmp_path / "other"
    for folder in (target, other / "mine"):
        folder.mkdir(parents=True)
    (tmp_path / "relative").symlink_to("a/target")
    (tmp_path / "absolute").symlink_to(target)
    (tmp_path / "upwards").symlink_to("a/target/../../a/target")
    (tmp_path / "through").symlink_to("other/mine/../../a/target")
    for name in ("relative", "absolute", "upwards", "through"):
        assert folder_fault(tmp_path / name) == ""
    given_away(other)
    assert "belongs to user" in folder_fault(tmp_path / "through")
    assert folder_fault(tmp_path / "upwards") == ""
    (tmp_path / "endless").symlink_to("endless")
    assert "without end" in folder_fault(tmp_path / "endless")


@root
def test_the_command_names_the_reason(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Identity: `scissordyn cache` shows why a cache is not used, and deletes nothing in it."""
    from scissordyn.cli.main import status_of

    (tmp_path / "kernels" / f"{1:016x}-{1:08x}").mkdir(parents=True)
    given_away(tmp_path / "kernels")
    monkeypatch.setenv("SCISSORDYN_CACHE", str(tmp_path))
    assert status_of(["cache"]) == 0
    assert f"They are not used: '{tmp_path}/kernels' belongs to user" in capsys.readouterr().out
    assert status_of(["cache", "--clean"]) == 2
    assert len(list((tmp_path / "kernels").iterdir())) == 1
