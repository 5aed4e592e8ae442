"""``scissordyn new``: a commented case file."""

from __future__ import annotations

from typing import Annotated

import typer

__all__ = ["new"]


def new(
    structure: Annotated[
        str, typer.Argument(help="scissor, polar, ring, mast, slider-crank, four-bar, n-four-bar, or mechanism.")
    ] = "scissor",
) -> int:
    """Print a commented case file: scissordyn new scissor > case.toml."""
    from scissordyn.config.template import template

    print(template(structure), end="")
    return 0
