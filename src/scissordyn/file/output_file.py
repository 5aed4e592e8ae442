"""Files of results: written whole or not at all, and never in the place of a file that is something else."""

from __future__ import annotations

import contextlib
import csv
import errno
import hashlib
import io
import os
import secrets
import stat
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path

from scissordyn.errors import InputError, command

HDF_MAGIC = b"\x89HDF\r\n\x1a\n"

OURS = "scissordyn"  # What the title of a NetCDF file of this package begins with

BEGINNINGS = {
    ".png": (b"\x89PNG\r\n\x1a\n",),
    ".gif": (b"GIF87a", b"GIF89a"),
    ".svg": (b"<?xml", b"<svg"),
    ".pdf": (b"%PDF-",),
    ".html": (b"<!DOCTYPE html", b"<!doctype html"),
    ".mp4": (b"ftyp",),
    ".csv": (b"time [s]", b"contact_joint", b"case,point,sample,member,", b"body,joint,point,", b"bar,count,names,"),
    ".json": (b'{\n "$schema"', b'{"scissordyn": "pin forces"'),
    ".inp": (b"** Written by scissordyn",),
    ".dxf": (b"  0\nSECTION",),
    ".xml": (b'<mujoco model="mechanism"',),
    ".fmu": (b"PK\x03\x04",),
    ".mat": (b"MATLAB",),
    ".parquet": (b"PAR1",),
}
"""How pictures, films and exported tables begin, by ending; an MP4 after the four bytes of a length."""


EXPORTED = dict.fromkeys((".csv", ".tsv", ".txt", ".parquet", ".mat", ".xlsx", ".json"), "scissordyn export run.nc run.csv")
DRAWN = dict.fromkeys((".png", ".svg", ".pdf", ".jpg", ".jpeg"), "scissordyn plot run.nc -o figures")
FILMED = dict.fromkeys((".html", ".gif", ".mp4"), "scissordyn animate run.nc film.html")
OTHER_ENDINGS = {**EXPORTED, **DRAWN, **FILMED, ".toml": "", ".py": "", ".db": ""}
"""Endings of files that are no NetCDF, with what makes such a file of a saved run."""


def regular_size(path: str | os.PathLike[str]) -> int | None:
    """Size of a regular file [bytes]; None for anything else, such as a device, which may have no end."""
    status = os.stat(path)
    return status.st_size if stat.S_ISREG(status.st_mode) else None


def check_name(path: str | os.PathLike[str]) -> None:
    """Raise `InputError` for the name of a file of another kind: what is written is NetCDF, whatever its name."""
    ending = Path(path).suffix.lower()
    if ending in OTHER_ENDINGS:
        then = OTHER_ENDINGS[ending]
        allowed = "a name that ends in .nc" + (f"; then {then}" if then else "")
        raise InputError(f"'{path}' for what is written as NetCDF", allowed, command("-o", f"{Path(path).stem}.nc"))


def check_target(
    path: str | os.PathLike[str], *, sample: str = "-o run.nc", replace_broken: bool = False, beginning: bytes = b""
) -> None:
    """Raise `InputError` if a result would overwrite something that is not an earlier result of its kind."""
    try:
        size = regular_size(path)
    except FileNotFoundError:
        return
    except (OSError, ValueError) as error:
        raise InputError(f"cannot write '{path}': {_reason(error)}", "a place that can be written", sample) from None
    if size is None:
        what = "it is a folder" if os.path.isdir(path) else "it is not a regular file"
        raise InputError(f"cannot write '{path}': {what}", "the name of a file", sample)
    ending = Path(path).suffix.lower()
    if beginning:
        if size and not _begins(path, beginning):
            raise InputError(
                f"'{path}' exists and is no case file that scissordyn wrote, so that it is not overwritten",
                "a name that is not taken",
                sample,
            )
        return
    if size == 0 or (_is_picture(path, ending) if ending in BEGINNINGS else _is_ours(path, replace_broken)):
        return
    kind = f"no {ending.removeprefix('.').upper()} file" if ending in BEGINNINGS else "not a NetCDF file of scissordyn"
    raise InputError(f"'{path}' exists and is {kind}, so that it is not overwritten", "a name that is not taken", sample)


def _is_picture(path: str | os.PathLike[str], ending: str) -> bool:
    return any(_begins(path, beginning, 4 if ending == ".mp4" else 0) for beginning in BEGINNINGS[ending])


def _begins(path: str | os.PathLike[str], beginning: bytes, after: int = 0) -> bool:
    """Whether a file begins with some bytes, after so many others."""
    try:
        with open(path, "rb") as file:
            return file.read(after + len(beginning))[after:] == beginning
    except OSError:
        return False


def _is_ours(path: str | os.PathLike[str], replace_broken: bool) -> bool:
    try:
        with open(path, "rb") as file:
            if file.read(len(HDF_MAGIC)) != HDF_MAGIC:
                return False
    except OSError:
        return False
    from scissordyn.file.netcdf import NetcdfFile

    for _ in range(2):  # an interrupt inside the library comes out of it as any exception, as half a file does, but once only
        try:
            with NetcdfFile(path) as stored:
                return str(stored.attrs.get("title", "")).startswith(OURS)
        except Exception:
            continue
    return replace_broken


def csv_text(rows: Iterable[Iterable[object]]) -> str:
    """Rows as comma-separated values."""
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()


def write_file(path: str | os.PathLike[str], content: bytes | memoryview, *, sample: str = "-o run.nc") -> Path:
    """Write a file whole or not at all; raise `InputError` if that is not possible."""
    wanted = Path(path)
    try:
        put_file(wanted, content)
    except (OSError, ValueError) as error:
        raise InputError(
            f"cannot write '{wanted}': {_reason(error)}", "a file name in a folder that exists and can be written", sample
        ) from None
    return wanted


def put_file(path: str | os.PathLike[str], content: bytes | memoryview, *, new: bool = False) -> None:
    """Write a file whole or not at all, or raise an error of the operating system.

    The content is written to a hidden file in the same folder, which then gets the name. Hidden files of killed processes are
    removed first. With `new` a file that exists is not replaced: `FileExistsError`.
    """
    target = Path(os.path.realpath(path))
    remove_left_behind(target)
    with _part(target) as (part, handle):
        rest = memoryview(content).cast("B")
        while rest:
            rest = rest[os.write(handle, rest) :]
        os.fsync(handle)  # some file systems find out here that they are full
        if new:
            _link(part, target)
        else:
            os.replace(part, target)


def _link(part: Path, target: Path) -> None:
    """Give a file a second name, which must not be taken."""
    try:
        os.link(part, target)
    except FileExistsError:
        raise
    except OSError:  # a file system without links
        if target.exists():
            raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), str(target)) from None
        os.replace(part, target)


def remove_left_behind(path: str | os.PathLike[str]) -> None:
    """Remove unfinished files for a target whose writers were killed."""
    for left in _left_behind(Path(os.path.realpath(path))):
        left.unlink(missing_ok=True)


def _reason(error: Exception) -> str:
    return getattr(error, "strerror", None) or str(error)


def _prefix(target: Path) -> str:
    """Hidden, and not longer than a file name may be whatever the target's name is."""
    return f".{hashlib.sha256(os.fsencode(target.name)).hexdigest()[:16]}."


@contextlib.contextmanager
def _part(target: Path) -> Iterator[tuple[Path, int]]:
    """A new locked file beside the target; removed if it is still there at the end."""
    while True:
        part = target.parent / f"{_prefix(target)}{secrets.token_hex(4)}.part"
        # made with the permissions that the user's mask leaves, like any new file
        handle = os.open(part, os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_CLOEXEC", 0), 0o666)
        if hold(handle) and part.exists():
            break
        os.close(handle)  # another process took it for one that was left behind
    try:
        yield part, handle
    finally:
        part.unlink(missing_ok=True)
        os.close(handle)


def _left_behind(target: Path) -> Iterator[Path]:
    """Unfinished files for a target whose writers have ended."""
    for part in target.parent.glob(f"{_prefix(target)}*.part") if LOCKS else ():
        try:
            handle = os.open(part, os.O_WRONLY)
        except OSError:
            continue
        try:
            if hold(handle):
                yield part
        finally:
            os.close(handle)


LOCKS = sys.platform != "win32"  # Whether there are any. On Windows an open file cannot be deleted, which protects it as well


def hold(handle: int, *, shared: bool = False) -> bool:
    """Lock an open file until it is closed or the process ends; does not wait."""
    if sys.platform == "win32":
        return True
    import fcntl

    try:
        fcntl.flock(handle, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        return True
    return True
