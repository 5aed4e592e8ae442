"""Write output files completely or not at all, and without overwriting files of another kind."""

from __future__ import annotations

import contextlib
import csv
import errno
import hashlib
import io
import os
import stat
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path

from scissordyn.errors import InputError, command

HDF_MAGIC = b"\x89HDF\r\n\x1a\n"  # first bytes of an HDF5 file

TITLE_START = "scissordyn"  # first word of the title attribute of every NetCDF file that this package writes

FIRST_BYTES = {
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
"""First bytes of pictures, films and exported tables, by ending; in an MP4 file they follow the four bytes of a length."""


# Command that exports a saved run, by the ending of the exported file
EXPORT_COMMANDS = dict.fromkeys(
    (".csv", ".tsv", ".txt", ".parquet", ".mat", ".xlsx", ".json"), "scissordyn export run.nc run.csv"
)
# Command that draws the pictures of a saved run, by the ending of a picture file
PICTURE_COMMANDS = dict.fromkeys((".png", ".svg", ".pdf", ".jpg", ".jpeg"), "scissordyn plot run.nc -o figures")
# Command that makes a film of a saved run, by the ending of a film file
FILM_COMMANDS = dict.fromkeys((".html", ".gif", ".mp4"), "scissordyn animate run.nc film.html")
OTHER_ENDINGS = {**EXPORT_COMMANDS, **PICTURE_COMMANDS, **FILM_COMMANDS, ".toml": "", ".py": "", ".db": ""}
"""File name endings of other formats than NetCDF, each with the command that makes the file from a saved run, or ""."""


def regular_size(path: str | os.PathLike[str]) -> int | None:
    """Return the size of a regular file [bytes]; None for a folder, device or pipe, whose content may be endless."""
    status = os.stat(path)
    return status.st_size if stat.S_ISREG(status.st_mode) else None


def check_name(path: str | os.PathLike[str]) -> None:
    """Raise `InputError` if a name for a NetCDF file has the ending of another kind of file."""
    ending = Path(path).suffix.lower()
    if ending in OTHER_ENDINGS:
        then = OTHER_ENDINGS[ending]
        allowed = "a name that ends in .nc" + (f"; then {then}" if then else "")
        raise InputError(f"'{path}': the output is a NetCDF file", allowed, command("-o", f"{Path(path).stem}.nc"))


def check_target(
    path: str | os.PathLike[str], *, sample: str = "-o run.nc", replace_broken: bool = False, beginning: bytes = b""
) -> None:
    """Raise `InputError` if a result would overwrite a file that is not an earlier result of the same kind."""
    try:
        size = regular_size(path)
    except FileNotFoundError:
        return
    except (OSError, ValueError) as error:
        raise InputError(f"cannot write '{path}': {_reason(error)}", "a path that can be written", sample) from None
    if size is None:
        what = "it is a folder" if os.path.isdir(path) else "it is not a regular file"
        raise InputError(f"cannot write '{path}': {what}", "the name of a regular or new file", sample)
    ending = Path(path).suffix.lower()
    if beginning:
        if size and not _starts_with(path, beginning):
            raise InputError(
                f"'{path}' exists and is not a case file of scissordyn; it is not overwritten", "the name of a new file", sample
            )
        return
    if size == 0 or (_is_picture(path, ending) if ending in FIRST_BYTES else _is_result(path, replace_broken)):
        return
    kind = f"not a {ending.removeprefix('.').upper()} file" if ending in FIRST_BYTES else "not a NetCDF file of scissordyn"
    raise InputError(f"'{path}' exists and is {kind}; it is not overwritten", "the name of a new file", sample)


def _is_picture(path: str | os.PathLike[str], ending: str) -> bool:
    return any(_starts_with(path, beginning, 4 if ending == ".mp4" else 0) for beginning in FIRST_BYTES[ending])


def _starts_with(path: str | os.PathLike[str], beginning: bytes, after: int = 0) -> bool:
    """Return True if a file has the bytes `beginning` after its first `after` bytes."""
    try:
        with open(path, "rb") as file:
            return file.read(after + len(beginning))[after:] == beginning
    except OSError:
        return False


def _is_result(path: str | os.PathLike[str], replace_broken: bool) -> bool:
    try:
        with open(path, "rb") as file:
            if file.read(len(HDF_MAGIC)) != HDF_MAGIC:
                return False
    except OSError:
        return False
    from scissordyn.file.netcdf import NetcdfFile

    for _ in range(2):  # an interrupt inside the library raises any exception, as a damaged file does, but not a second time
        try:
            with NetcdfFile(path) as stored:
                return str(stored.attrs.get("title", "")).startswith(TITLE_START)
        except Exception:
            continue
    return replace_broken


def csv_text(rows: Iterable[Iterable[object]]) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()


def write_file(path: str | os.PathLike[str], content: bytes | memoryview, *, sample: str = "-o run.nc") -> Path:
    """Write a file completely or not at all; raise `InputError` if it cannot be written."""
    wanted = Path(path)
    try:
        put_file(wanted, content)
    except (OSError, ValueError) as error:
        raise InputError(
            f"cannot write '{wanted}': {_reason(error)}", "a file name in a folder that exists and can be written", sample
        ) from None
    return wanted


def put_file(path: str | os.PathLike[str], content: bytes | memoryview, *, new: bool = False) -> None:
    """Write a file completely or not at all; raise `OSError` if it cannot be written.

    The content is written to a hidden file in the same folder, which is then renamed. Hidden files of killed processes are
    removed first. With `new`, an existing file raises `FileExistsError`.
    """
    target = Path(os.path.realpath(path))
    remove_unfinished(target)
    with _open_part(target) as (part, handle):
        rest = memoryview(content).cast("B")
        while rest:
            rest = rest[os.write(handle, rest) :]
        os.fsync(handle)  # some file systems only report here that they are full
        if new:
            _link(part, target)
        else:
            os.replace(part, target)


def _link(part: Path, target: Path) -> None:
    """Give a file a second name; raise `FileExistsError` if the name is taken."""
    try:
        os.link(part, target)
    except FileExistsError:
        raise
    except OSError:  # the file system has no links
        if target.exists():
            raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), str(target)) from None
        os.replace(part, target)


def remove_unfinished(path: str | os.PathLike[str]) -> None:
    """Remove temporary files of a target whose writing processes were killed."""
    for left in _find_unfinished(Path(os.path.realpath(path))):
        left.unlink(missing_ok=True)


def _reason(error: Exception) -> str:
    return getattr(error, "strerror", None) or str(error)


def _prefix(target: Path) -> str:
    """Return the first characters of the name of a target's temporary files; a digest keeps them short."""
    return f".{hashlib.sha256(os.fsencode(target.name)).hexdigest()[:16]}."


@contextlib.contextmanager
def _open_part(target: Path) -> Iterator[tuple[Path, int]]:
    """Yield a new locked temporary file in the target's folder and its handle; remove the file at the end, unless renamed."""
    while True:
        part = target.parent / f"{_prefix(target)}{os.urandom(4).hex()}.part"
        # the permissions are those of any new file, as the user's mask leaves them
        handle = os.open(part, os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_CLOEXEC", 0), 0o666)
        if lock_file(handle) and part.exists():
            break
        os.close(handle)  # another process removed the file before it was locked
    try:
        yield part, handle
    finally:
        part.unlink(missing_ok=True)
        os.close(handle)


def _find_unfinished(target: Path) -> Iterator[Path]:
    """Yield temporary files of a target whose writing processes have ended."""
    for part in target.parent.glob(f"{_prefix(target)}*.part") if CAN_LOCK else ():
        try:
            handle = os.open(part, os.O_WRONLY)
        except OSError:
            continue
        try:
            if lock_file(handle):
                yield part
        finally:
            os.close(handle)


# True on systems with file locks; Windows needs no lock, because it does not delete open files
CAN_LOCK = sys.platform != "win32"


def lock_file(handle: int, *, shared: bool = False) -> bool:
    """Lock an open file until it is closed or the process ends; return False immediately if another process has locked it."""
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
