"""``scissordyn new``: a commented case file."""

from __future__ import annotations

from typing import Annotated

import typer


def new(
    structure: Annotated[
        str, typer.Argument(help="scissor, polar, ring, mast, slider-crank, four-bar, n-four-bar, or mechanism.")
    ] = "scissor",
    further: Annotated[
        str,
        typer.Option(
            "--with",
            help="Further parts with values that fit the structure, as servo,tip,payload,panels,spring,latch.",
            show_default=False,
        ),
    ] = "",
    change: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="KEY=VALUE",
            help="A value of the file, as in structure.units=5; what else there is fits it. Repeatable.",
        ),
    ] = None,
) -> int:
    """Print a commented case file: scissordyn new scissor --with servo,tip > case.toml."""
    from scissordyn.config.template import template

    print(template(structure, [name.strip() for name in further.split(",") if name.strip()], change or []), end="")
    return 0
