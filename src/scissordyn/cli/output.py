"""Output of commands, exit statuses, checks before the computation that results can be written, and progress."""

from __future__ import annotations

import json
import math
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scissordyn.errors import InputError

if TYPE_CHECKING:  # the help of a command loads no libraries
    from rich.console import Console

DONE, BUG, BAD_INPUT, UNFINISHED, INTERRUPTED = 0, 1, 2, 3, 130
"""Exit statuses: 3 if a run failed, whose results up to the failure are kept; 128 + SIGINT as in shells."""

STATUSES = {"complete": DONE, "interrupted": INTERRUPTED, "failed": UNFINISHED}

PICTURES = (".png", ".svg", ".pdf", ".jpg", ".jpeg")

ROWS_MAX = 20  # [rows] of a list: joints, contacts, or entries that differ
PLAIN_COLUMNS = 100  # [letters] width of the output without a terminal

LOOKS: dict[str, dict[str, Any]] = {
    "name": {"no_wrap": True},  # which is copied
    "text": {"overflow": "fold"},
    "number": {"justify": "right", "no_wrap": True},
    "numbers": {"justify": "right", "overflow": "fold"},
    "long name": {"overflow": "fold"},
}
NAME_LETTERS_MIN = 10  # [letters] smallest width of a column of names; longer names are broken

DESCRIPTION = "{task.description}"  # A column of a progress bar


def check_file(path: Path | None, case: Path, sample: str) -> None:
    """Raise `InputError` if the given file cannot be written, or if writing would replace another file."""
    from scissordyn.file.output_file import check_target

    if path is None:
        return
    if path.exists() and case.exists() and path.samefile(case):
        raise InputError(f"cannot write '{path}': it is the case file", "another name", sample)
    check_target(path, sample=sample)
    _try(path, path.parent, sample)


def check_run(path: Path | None, case: Path, sample: str) -> None:
    """Raise `InputError` unless a run or diagram, a NetCDF file, can be written to a file of this name."""
    from scissordyn.file.output_file import check_name

    check_file(path, case, sample)
    if path is not None:
        check_name(path)


def check_picture(path: Path | None, case: Path, sample: str) -> None:
    """Raise `InputError` unless a picture can be written to a file of this name."""
    if path is not None:
        from scissordyn.plot.file import check_format

        check_format(path.suffix.lower().removeprefix("."))
        check_file(path, case, sample)


def check_movie(path: Path | None, case: Path, sample: str) -> None:
    """Raise `InputError` unless a film can be written to a file of this name."""
    if path is not None:
        from scissordyn.plot.animation import check_film

        check_film(path)
        check_file(path, case, sample)


def check_store_name(name: str) -> None:
    """Raise `InputError` for a new store with the name of a file of another kind."""
    from scissordyn.file.output_file import OTHER_ENDINGS

    if Path(name).suffix.lower() in {".nc", *OTHER_ENDINGS} - {".db"}:
        raise InputError(f"'{name}' for the store of a study", "a name that ends in .db", "-o study.db")


def check_folder(folder: Path | None, sample: str) -> None:
    """Raise `InputError` if the given folder cannot be written, or if its name is that of a picture."""
    if folder is None:
        return
    if folder.suffix.lower() in PICTURES and not folder.is_dir():
        raise InputError(f"'{folder}' for a folder of pictures", "a folder", sample)
    existing = next(ancestor for ancestor in (folder, *folder.absolute().parents) if ancestor.exists())
    if not existing.is_dir():
        raise InputError(f"cannot write into '{folder}': '{existing}' is a file", "a folder", sample)
    _try(folder, existing, sample)


def _try(target: Path, folder: Path, sample: str) -> None:
    try:
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise InputError(f"cannot write '{target}': {error.strerror}", "a path that can be written", sample) from None


def console() -> Console:
    """Return a console on stdout; for a file or a pipe it is as wide as the tables."""
    from scissordyn.cli.text_console import TextConsole

    plain = TextConsole(highlight=False, soft_wrap=False)
    return plain if plain.is_terminal else TextConsole(highlight=False, width=PLAIN_COLUMNS)


def say(*lines: object, **look: Any) -> None:
    """Print lines as they are, on a terminal broken between words."""
    to = console()
    for line in lines:
        to.print(str(line), **look)


def print_table(
    columns: Mapping[str, str] | Sequence[tuple[str, str]],
    rows: Iterable[Sequence[str]],
    title: str | None = None,
    *,
    spare: Sequence[str] = (),
    to: Console | None = None,
) -> list[str]:
    """Print a table with columns of `LOOKS`, by their heads, or with heads of which several may be the same.

    Numbers of a column are never cut: where there is no room columns that are spare are left out first, in their order, then
    long names are broken. Returns the first lines of the heads of those left out.
    """
    from rich import box
    from rich.table import Table

    to, cells, least = to or console(), [*rows], dict[int, int]()
    heads, looks = zip(*(columns.items() if isinstance(columns, Mapping) else columns), strict=True)
    for k, texts in enumerate(zip(heads, *cells, strict=True)):
        width = max(len(line) for text in texts for line in text.split("\n"))
        if looks[k] in ("number", "long name"):
            least[k] = width if looks[k] == "number" else min(width, NAME_LETTERS_MIN)
    kept = [*range(len(heads))]
    for unwanted in spare:
        if sum(width + 1 for k, width in least.items() if k in kept) <= to.width - 2:
            break
        kept.remove(heads.index(unwanted))
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0), title=title, title_justify="left")
    for k in kept:
        table.add_column(heads[k], **LOOKS[looks[k]], min_width=least.get(k))
    for row in cells:
        table.add_row(*(row[k] for k in kept))
    to.print(table)
    return [head.split("\n")[0] for k, head in enumerate(heads) if k not in kept]


def print_json(record: dict[str, Any]) -> None:
    """Print plain data as one line of JSON; numbers that are not finite are null, letters beyond ASCII their codes."""
    print(json.dumps(_finite(record), allow_nan=False))


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: _finite(part) for name, part in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(part) for part in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


@contextmanager
def bars(*columns: str) -> Iterator[Callable[..., None] | None]:
    """Return a function that updates named bars on stderr, as rich's `Progress.update`; None without a terminal."""
    if not sys.stderr.isatty():
        yield None
        return
    from rich import progress
    from rich.console import Console

    shown = [progress.TextColumn(column, markup=False) if "{" in column else getattr(progress, column)() for column in columns]
    with progress.Progress(*shown, console=Console(stderr=True), transient=True) as drawn:
        tasks: dict[str, progress.TaskID] = {}

        def update(name: str, **changes: Any) -> None:
            if name not in tasks:
                tasks[name] = drawn.add_task(name, total=None)
            drawn.update(tasks[name], **changes)

        yield update


@contextmanager
def progress_bar(until: float) -> Iterator[Callable[[float], None] | None]:
    """Return a function of the simulated time that updates a bar on stderr; None without a terminal."""
    percent = "{task.percentage:3.0f} % of " + f"{until * 1e3:g} ms"
    with bars(DESCRIPTION, "BarColumn", percent, "TimeRemainingColumn") as update:
        if update is None:
            yield None
        else:
            update("preparing ", total=until)
            yield lambda time: update("preparing ", completed=time, description="simulating")
