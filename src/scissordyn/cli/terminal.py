"""What commands print: lines and tables, of which names of the user's are shown as they are."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:  # the help of a command loads no libraries
    from rich.console import Console

WIDTH = 100  # Columns of the output without a terminal


def console() -> Console:
    """Console on stdout, not narrower than the tables for a file or a pipe."""
    from scissordyn.cli.text_console import TextConsole

    plain = TextConsole(highlight=False, soft_wrap=False)
    return plain if plain.is_terminal else TextConsole(highlight=False, width=WIDTH)


def say(*lines: object, **look: Any) -> None:
    """Print lines as they are, on a terminal broken between words."""
    to = console()
    for line in lines:
        to.print(str(line), **look)


LOOKS: dict[str, dict[str, Any]] = {
    "name": {"no_wrap": True},  # which is copied
    "text": {"overflow": "fold"},
    "number": {"justify": "right", "no_wrap": True},
    "numbers": {"justify": "right", "overflow": "fold"},
}


def print_table(columns: Mapping[str, str], rows: Iterable[Sequence[str]], title: str | None = None) -> None:
    """Print a table with columns of `LOOKS`, by their heads."""
    from rich import box
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0), title=title, title_justify="left")
    for head, look in columns.items():
        table.add_column(head, **LOOKS[look])
    for row in rows:
        table.add_row(*row)
    console().print(table)
