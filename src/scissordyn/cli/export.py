"""``scissordyn export``: a saved run, or the mechanism of a case, for other programs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from scissordyn.cli.option import Changes, OwnCode
from scissordyn.cli.output import check_file

if TYPE_CHECKING:
    from scissordyn.model.mechanism import Mechanism


def export(
    source: Annotated[Path, typer.Argument(help="A saved run, or a case file.")],
    target: Annotated[
        Path,
        typer.Argument(
            help="Of a run: a name that ends in .csv, .parquet or .mat; with --forces in .csv, .json or .inp (CalculiX). "
            "Of a case: in .dxf (bars with holes), .csv (cut list), .xml (MJCF) or .fmu (FMI 3.0)."
        ),
    ],
    contacts: Annotated[bool, typer.Option("--contacts", help="One row for each contact in place of each instant.")] = False,
    forces: Annotated[bool, typer.Option("--forces", help="The forces of the pins on each bar.")] = False,
    envelope: Annotated[bool, typer.Option("--envelope", help="The extremes of these forces over time.")] = False,
    first: Annotated[str | None, typer.Option("--from", metavar="TIME", help="From this instant on, as in '10 ms'.")] = None,
    last: Annotated[str | None, typer.Option("--to", metavar="TIME", help="Up to this instant.")] = None,
    section: Annotated[str, typer.Option(help="Of beams in an .inp, as '20x30 mm'.", show_default=False)] = "",
    material: Annotated[str, typer.Option(help="Of these beams.")] = "steel",
    pin: Annotated[str | None, typer.Option(metavar="LENGTH", help="Radius of the pins of ideal joints, as '5 mm'.")] = None,
    width: Annotated[str | None, typer.Option(metavar="LENGTH", help="Width of the bars in a DXF.")] = None,
    sources: Annotated[bool, typer.Option("--sources", help="An FMU as C source alone, without a compiler.")] = False,
    change: Changes = None,
    allow_code: OwnCode = None,
) -> int:
    """Write a saved run as a table or its pin forces, or the mechanism of a case as a drawing, a model or an FMU."""
    from scissordyn.cli.saved import mechanism_of, read_run, seconds
    from scissordyn.cli.show import console
    from scissordyn.exchange.export import FORCES, MECHANISMS, check_ending
    from scissordyn.exchange.export import export as write
    from scissordyn.exchange.forces import missed_peaks
    from scissordyn.file.export import check_export
    from scissordyn.plot.window import window

    if source.suffix.lower() == ".toml":
        from scissordyn.config.file import read_case

        check_ending(target, MECHANISMS, "a mechanism", "bars.dxf")
        check_file(target, source, "bars.dxf")
        case = read_case(source, change or ())
        written = write(
            case,
            target,
            pin_radius=_length(pin, "--pin"),
            width=_length(width, "--width"),
            sources_only=sources,
        )
        for note in _notes(case.mechanism) if target.suffix.lower() == ".xml" else ():
            console().print(f"note: {note}", markup=False, highlight=False, soft_wrap=True)
        console().print(str(written), markup=False)
        return 0
    if forces or envelope:
        check_ending(target, FORCES, "forces", "forces.csv")
    else:
        check_export(target)
    check_file(target, source, "table.csv")
    begin, end = seconds(first, "--from"), seconds(last, "--to")
    run = read_run(source)
    known = mechanism_of(run, allow_code) if forces or envelope else None
    cut = window(run, begin, end)
    written = write(
        cut, target, contacts=contacts, forces=forces, envelope=envelope, mechanism=known, section=section, material=material
    )
    for note in missed_peaks(cut) if forces or envelope else ():
        console().print(f"note: {note}", markup=False, highlight=False, soft_wrap=True)
    console().print(str(written), markup=False)
    return 0


def _notes(mechanism: Mechanism) -> tuple[str, ...]:
    """What an MJCF file of a mechanism does not hold."""
    from scissordyn.exchange.mjcf_text import mjcf

    return mjcf(mechanism).notes


def _length(text: str | None, option: str) -> float | None:
    from scissordyn.config.quantity import read_quantity
    from scissordyn.errors import InputError
    from scissordyn.units import Quantity

    if text is None:
        return None
    try:
        return read_quantity(text, Quantity("m", above=0.0))
    except InputError as error:
        raise InputError(f"{option} {text!r}: {error.what}", "a length with its unit", f"{option} '5 mm'") from None
