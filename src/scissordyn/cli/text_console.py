"""Console that prints texts literally."""

from __future__ import annotations

from typing import Any

from rich.console import Console
from rich.text import Text

from scissordyn.errors import printable


class TextConsole(Console):
    """Console that prints names from files literally: no markup, emoji or escape codes."""

    def on_broken_pipe(self) -> None:
        """Raise the error of a closed pipe again; rich would end the process."""
        raise

    def render_str(self, text: str, **look: Any) -> Text:
        """Return the text with visible codes instead of control characters, except line ends."""
        lines = "\n".join(map(printable, text.split("\n")))
        return super().render_str(lines, **{**look, "emoji": False, "markup": False})
