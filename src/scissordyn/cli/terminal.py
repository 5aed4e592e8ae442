"""What commands print: lines and tables, of which names of the user's are shown as they are."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from rich import box
from rich.console import Console
from rich.table import Table
from rich.text import Text

from scissordyn.errors import printable

WIDTH = 100  # Columns of the output without a terminal


class TextConsole(Console):
    """A console on which every text is shown as it is: names from files are no markup, no emoji and no escape codes."""

    def on_broken_pipe(self) -> None:
        """Leave the error of a pipe that its reader has closed to whoever runs the command; rich would end the process."""
        raise

    def render_str(self, text: str, **look: Any) -> Text:
        """The text, line by line, with its control characters made visible."""
        lines = "\n".join(map(printable, text.split("\n")))
        return super().render_str(lines, **{**look, "emoji": False, "markup": False})


def console() -> Console:
    """Console on stdout, not narrower than the tables for a file or a pipe."""
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
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0), title=title, title_justify="left")
    for head, look in columns.items():
        table.add_column(head, **LOOKS[look])
    for row in rows:
        table.add_row(*row)
    console().print(table)
