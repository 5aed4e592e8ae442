"""``scissordyn animate``: a film of a saved run."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from scissordyn.cli.option import BarQuantity, Magnified, OwnCode, SavedRun
from scissordyn.cli.output import check_file

LONGEST = 3600.0
"""Of a film [s]."""


def animate(
    run: SavedRun,
    film: Annotated[Path, typer.Argument(help="A name that ends in .html (a page with a player), .mp4 or .gif.")],
    joint: Annotated[list[str] | None, typer.Option(metavar="NAME", help="Magnify this clearance joint. Repeatable.")] = None,
    first: Annotated[str | None, typer.Option("--from", metavar="TIME", help="Begin at this instant, as in '10 ms'.")] = None,
    last: Annotated[str | None, typer.Option("--to", metavar="TIME", help="End at this instant.")] = None,
    lasting: Annotated[
        float, typer.Option("--seconds", metavar="SECONDS", help="Duration of the film.", min=0.1, max=LONGEST)
    ] = 6.0,
    magnify: Magnified = 1.0,
    bars: BarQuantity = None,
    allow_code: OwnCode = None,
) -> int:
    """Write a film of a saved run; nothing is computed anew."""
    from scissordyn.cli.saved import mechanism_of, read_run, seconds
    from scissordyn.cli.show import console
    from scissordyn.plot.animation import animate as write_film
    from scissordyn.plot.animation import check_film
    from scissordyn.plot.window import window

    check_film(film)
    check_file(film, run, "film.html")
    begin, end = seconds(first, "--from"), seconds(last, "--to")
    saved = read_run(run)
    mechanism = mechanism_of(saved, allow_code)
    shown = window(saved, begin, end)
    written = write_film(shown, mechanism, film, joints=joint, seconds=lasting, magnify=magnify, bars=bars)
    console().print(str(written), markup=False)
    return 0
