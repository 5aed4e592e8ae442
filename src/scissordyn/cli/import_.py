"""``scissordyn import``: a linkage that was drawn elsewhere, as a case file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from scissordyn.cli.option import Quiet

SAMPLE = "-o case.toml"


def import_drawing(
    source: Annotated[str, typer.Argument(help="A link of PMKS+, or a file that ends in .dxf, .xml (MJCF) or .urdf.")],
    case: Annotated[Path, typer.Option("--output", "-o", help="The case file to write.")],
    unit: Annotated[str, typer.Option(help="Unit of length of a DXF that names none, as mm.", show_default=False)] = "",
    linear_density: Annotated[
        str, typer.Option(metavar="QUANTITY", help="Mass per length of bars whose mass the drawing does not say.")
    ] = "1 kg/m",
    tolerance: Annotated[
        str,
        typer.Option(metavar="LENGTH", help="Ends of a DXF nearer than this are one pin.", show_default="1e-6 of the drawing"),
    ] = "",
    until: Annotated[str, typer.Option(metavar="TIME", help="How long the case runs.")] = "1 s",
    quiet: Quiet = False,
) -> int:
    """Write a case file of a linkage that was drawn elsewhere, and say what was not understood."""
    from scissordyn.cli.saved import seconds
    from scissordyn.cli.show import console
    from scissordyn.config.case_text import BEGINNING
    from scissordyn.config.file import write_case
    from scissordyn.config.quantity import read_quantity
    from scissordyn.exchange.read import read_drawing
    from scissordyn.file.output_file import check_target
    from scissordyn.run.options import Options
    from scissordyn.units import Quantity

    check_target(case, sample=SAMPLE, beginning=BEGINNING.encode())
    density = read_quantity(linear_density, Quantity("kg/m", above=0.0))
    near = read_quantity(tolerance, Quantity("m", above=0.0)) if tolerance else None
    end = seconds(until, "--until") or 0.0
    found = read_drawing(source, unit=unit, linear_density=density, tolerance=near)
    written = write_case(found.mechanism, case, run=Options(until=end))
    if not quiet:
        out = console()
        for note in found.notes:
            out.print(f"note: {note}", markup=False, highlight=False, soft_wrap=True)
        out.print(str(written), markup=False)
    return 0
