"""``scissordyn export``: a saved run for other programs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from scissordyn.cli.option import SavedRun
from scissordyn.cli.output import check_file

__all__ = ["export"]


def export(
    run: SavedRun,
    table: Annotated[Path, typer.Argument(help="A name that ends in .csv, .parquet or .mat.")],
    contacts: Annotated[bool, typer.Option("--contacts", help="One row for each contact in place of each instant.")] = False,
    first: Annotated[str | None, typer.Option("--from", metavar="TIME", help="From this instant on, as in '10 ms'.")] = None,
    last: Annotated[str | None, typer.Option("--to", metavar="TIME", help="Up to this instant.")] = None,
) -> int:
    """Write a saved run as a table over time in SI units, or all its arrays as a MATLAB file."""
    from scissordyn.cli.saved import read_run, seconds
    from scissordyn.cli.show import console
    from scissordyn.file.export import check_export
    from scissordyn.file.export import export as write_table
    from scissordyn.plot.window import window

    check_export(table)
    check_file(table, run, "table.csv")
    begin, end = seconds(first, "--from"), seconds(last, "--to")
    console().print(str(write_table(window(read_run(run), begin, end), table, contacts=contacts)), markup=False)
    return 0
