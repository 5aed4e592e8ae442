"""Output of commands: exit statuses, tables, progress bars, and checks that results can be written before they are computed."""

from __future__ import annotations

import json
import math
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scissordyn.errors import InputError, printable

if TYPE_CHECKING:  # so that the help of a command does not load libraries
    from rich.console import Console

DONE, BUG, BAD_INPUT, UNFINISHED, INTERRUPTED = 0, 1, 2, 3, 130
"""Exit statuses of all commands. 3: a run failed, but its results until then are kept. 130: 128 + SIGINT, as in shells."""

# exit status of a command, by status of its run
EXIT_STATUSES = {"complete": DONE, "interrupted": INTERRUPTED, "failed": UNFINISHED}

PICTURE_ENDINGS = (".png", ".svg", ".pdf", ".jpg", ".jpeg")  # File name endings of picture formats

ROWS_MAX = 20  # Largest number of rows in a printed table of joints, contacts or differences
PLAIN_COLUMNS = 100  # [characters] width of printed tables if the output is not a terminal

# Styles of columns of tables, as arguments of rich's `add_column`
COLUMN_STYLES: dict[str, dict[str, Any]] = {
    "name": {"no_wrap": True},  # so that it can be copied
    "text": {"overflow": "fold"},
    "number": {"justify": "right", "no_wrap": True},
    "numbers": {"justify": "right", "overflow": "fold"},
    "long name": {"overflow": "fold"},
    "words": {"overflow": "fold"},  # at least as wide as its longest word
}

PROGRESS_TEXT = "{task.description}"  # Format of a progress bar's column with the text of its task


def check_file(path: Path | None, case: Path, sample: str) -> None:
    """Raise `InputError` if a file cannot be written, or is the case file or a file of another kind."""
    from scissordyn.file.output_file import check_target

    if path is None:
        return
    if path.exists() and case.exists() and path.samefile(case):
        raise InputError(f"cannot write '{path}': it is the case file", "another file name", sample)
    check_target(path, sample=sample)
    _check_writable(path, path.parent, sample)


def check_run(path: Path | None, case: Path, sample: str) -> None:
    """Raise `InputError` unless a run or diagram can be written to a NetCDF file of this name."""
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
    """Raise `InputError` if the name of a new store has the ending of another kind of file."""
    from scissordyn.file.output_file import OTHER_ENDINGS

    if Path(name).suffix.lower() in {".nc", *OTHER_ENDINGS} - {".db"}:
        raise InputError(f"wrong name '{name}' for the store of a study", "a name that ends in .db", "-o study.db")


def check_folder(folder: Path | None, sample: str) -> None:
    """Raise `InputError` if a folder cannot be written, or if its name has the ending of a picture."""
    if folder is None:
        return
    if folder.suffix.lower() in PICTURE_ENDINGS and not folder.is_dir():
        raise InputError(f"wrong name '{folder}' for a folder of pictures", "the name of a folder", sample)
    existing = next(ancestor for ancestor in (folder, *folder.absolute().parents) if ancestor.exists())
    if not existing.is_dir():
        raise InputError(f"cannot write into '{folder}': '{existing}' is a file", "the name of a folder", sample)
    _check_writable(folder, existing, sample)


def _check_writable(target: Path, folder: Path, sample: str) -> None:
    try:
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise InputError(f"cannot write '{target}': {error.strerror}", "a path that can be written", sample) from None


def console() -> Console:
    """Return a console for standard output; without a terminal it is wide enough for the tables."""
    from scissordyn.cli.text_console import TextConsole

    plain = TextConsole(highlight=False, soft_wrap=False)
    return plain if plain.is_terminal else TextConsole(highlight=False, width=PLAIN_COLUMNS)


def say(*lines: object, **look: Any) -> None:
    """Print lines of text; on a terminal they are wrapped between words."""
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
    name_letters: int = 10,
) -> list[str]:
    """Print a table; `columns` gives the heading and the style, a key of `COLUMN_STYLES`, of each column.

    Numbers are never truncated. If the table is too wide, the columns `spare` are left out in their order, then long names are
    wrapped. Return the first lines of the headings of the columns that are left out.

    `name_letters`: [characters] smallest width of a column of names; longer names are wrapped.
    """
    from rich import box
    from rich.table import Table

    to, cells, least = to or console(), [*rows], dict[int, int]()
    heads, looks = zip(*(columns.items() if isinstance(columns, Mapping) else columns), strict=True)
    for k, texts in enumerate(zip(heads, *cells, strict=True)):
        width = max(len(line) for text in texts for line in text.split("\n"))
        if looks[k] in ("number", "long name"):
            least[k] = width if looks[k] == "number" else min(width, name_letters)
        elif looks[k] == "words":
            least[k] = _longest_word(texts)
    shown = [*range(len(heads))]
    for unwanted in spare:
        if sum(width + 1 for k, width in least.items() if k in shown) <= to.width - 2:
            break
        shown.remove(heads.index(unwanted))
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0), title=title, title_justify="left")
    for k in shown:
        table.add_column(heads[k], **COLUMN_STYLES[looks[k]], min_width=least.get(k))
    for row in cells:
        table.add_row(*(row[k] for k in shown))
    to.print(table)
    return [head.split("\n")[0] for k, head in enumerate(heads) if k not in shown]


def print_words(head: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print a table whose words are not broken; print each row as a list of its cells if the table is too wide for that."""
    to = console()
    if sum(_longest_word(texts) + 1 for texts in zip(head, *rows, strict=True)) <= to.width - 2:
        print_table([(name, "words") for name in head], rows, to=to)
        return
    for first, *cells in rows:
        print(printable(f"{head[0]}: {first}"))
        for name, cell in zip(head[1:], cells, strict=True):
            if cell:
                print(printable(f"  {name}: {cell}"))


def _longest_word(texts: Iterable[str]) -> int:
    return max((len(word) for text in texts for word in text.split()), default=0)


def print_json(record: dict[str, Any]) -> None:
    """Print a dictionary as one line of ASCII JSON; infinite and NaN numbers become null."""
    print(json.dumps(_finite(record), allow_nan=False))


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: _finite(part) for name, part in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(part) for part in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


@contextmanager
def bars(*columns: str) -> Iterator[Callable[..., None] | None]:
    """Yield a function that updates named progress bars on stderr, like rich's `Progress.update`; None without a terminal."""
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
    """Yield a function of the simulated time that updates a progress bar on stderr; None without a terminal."""
    percent = "{task.percentage:3.0f} % of " + f"{until * 1e3:g} ms"
    with bars(PROGRESS_TEXT, "BarColumn", percent, "TimeRemainingColumn") as update:
        if update is None:
            yield None
        else:
            update("preparing ", total=until)
            yield lambda time: update("preparing ", completed=time, description="simulating")
