"""``scissordyn plot``: pictures of a saved run."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from scissordyn.cli.option import BarQuantity, Magnified, OwnCode, SavedRun
from scissordyn.cli.output import check_folder
from scissordyn.errors import InputError


def plot(
    run: SavedRun,
    output: Annotated[Path, typer.Option("-o", "--output", metavar="DIR", help="Draw into this folder.")],
    only: Annotated[
        str | None,
        typer.Option(metavar="KINDS", help="Some pictures: response, force, torque, orbit, film, energy, structure, bending."),
    ] = None,
    joint: Annotated[list[str] | None, typer.Option(metavar="NAME", help="Draw this clearance joint. Repeatable.")] = None,
    first: Annotated[
        str | None, typer.Option("--from", metavar="TIME", help="Draw from this instant on, as in '10 ms'.")
    ] = None,
    last: Annotated[str | None, typer.Option("--to", metavar="TIME", help="Draw up to this instant.")] = None,
    form: Annotated[str, typer.Option("--format", metavar="FORMAT", help="png, svg or pdf.")] = "png",
    look: Annotated[
        str, typer.Option("--style", metavar="STYLE", help="screen, single-column, double-column (of a journal) or slides.")
    ] = "screen",
    magnify: Magnified = 1.0,
    bars: BarQuantity = None,
    envelope: Annotated[bool, typer.Option("--envelope", help="Bending: the largest values of the run at each place.")] = False,
    allow_code: OwnCode = None,
) -> int:
    """Draw a saved run; nothing is computed anew."""
    from scissordyn.cli.saved import mechanism_of, read_run, seconds
    from scissordyn.cli.show import console
    from scissordyn.plot.file import check_format
    from scissordyn.plot.publication import style
    from scissordyn.plot.report import check_kinds, draw_all
    from scissordyn.plot.window import window

    check_format(form)
    kinds = None if only is None else [kind.strip() for kind in only.split(",") if kind.strip()]
    check_kinds(kinds)
    check_folder(output, "-o figures")
    begin, end = seconds(first, "--from"), seconds(last, "--to")
    saved = read_run(run)
    to = console()
    mechanism = None
    if kinds is None or {"structure", "bending"} & set(kinds):
        try:
            mechanism = mechanism_of(saved, allow_code)
        except InputError as error:
            if kinds is not None:
                raise
            to.print(f"Without the picture of the structure: {error.what}.", markup=False)
    with style(look):
        shown, named = window(saved, begin, end), {"only": kinds, "joints": joint}
        drawn = draw_all(shown, None, output, mechanism, form, **named, magnify=magnify, bars=bars, envelope=envelope)
    for path in drawn:
        to.print(str(path), markup=False)
    return 0
