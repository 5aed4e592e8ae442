"""Commands ``plot``, ``animate``, ``export`` and ``cite`` for saved runs, and export of mechanisms to other programs."""

from __future__ import annotations

import warnings
from functools import partial
from pathlib import Path
from typing import Annotated, Any

from scissordyn.cli.option import (
    BarQuantity,
    Changes,
    Magnified,
    OwnCode,
    PictureFormat,
    SavedRun,
    mechanism_of,
    read_option,
    read_run,
)
from scissordyn.cli.output import check_file, check_folder, check_movie, say
from scissordyn.cli.parameter import Argument, Option
from scissordyn.errors import InputError

Begin = Annotated[str | None, Option("--from", metavar="TIME", help="Start of the time span, such as '10 ms'.")]
End = Annotated[str | None, Option("--to", metavar="TIME", help="End of the time span.")]


def plot(
    run: SavedRun,
    output: Annotated[Path, Option("-o", "--output", metavar="DIR", help="Folder of the pictures.")],
    only: Annotated[
        str | None,
        Option(metavar="KINDS", help="Draw only these: response, force, torque, orbit, film, energy, structure, bending."),
    ] = None,
    joint: Annotated[list[str] | None, Option(metavar="NAME", help="Draw only this clearance joint. Repeatable.")] = None,
    first: Begin = None,
    last: End = None,
    form: PictureFormat = "png",
    look: Annotated[
        str,
        Option(
            "--style",
            metavar="STYLE",
            help="Style of the pictures: screen, slides, or single-column or double-column of a journal.",
        ),
    ] = "screen",
    magnify: Magnified = 1.0,
    bars: BarQuantity = None,
    envelope: Annotated[
        bool, Option("--envelope", help="In bending pictures: largest values over the run at each place.")
    ] = False,
    allow_code: OwnCode = None,
) -> int:
    from scissordyn.plot.file import check_format
    from scissordyn.plot.report import check_kinds, draw_all
    from scissordyn.plot.series import select_window
    from scissordyn.plot.style import style

    check_format(form)
    kinds = None if only is None else [kind.strip() for kind in only.split(",") if kind.strip()]
    check_kinds(kinds)
    check_folder(output, "-o figures")
    begin, end = read_option(first, "--from"), read_option(last, "--to")
    saved = read_run(run)
    mechanism = None
    if kinds is None or {"structure", "bending"} & set(kinds):
        try:
            mechanism = mechanism_of(saved, allow_code)
        except InputError as error:
            if kinds is not None:
                raise
            say(f"Without the picture of the structure: {error.what}.")
    with style(look):
        part = select_window(saved, begin, end)
        options: dict[str, Any] = {"only": kinds, "joints": joint, "magnify": magnify, "bars": bars, "envelope": envelope}
        say(*draw_all(part, None, output, mechanism, form, **options))
    return 0


def animate(
    run: SavedRun,
    film: Annotated[Path, Argument(help="File to write: .html (page with a player), .mp4 or .gif.")],
    joint: Annotated[list[str] | None, Option(metavar="NAME", help="Magnify this clearance joint. Repeatable.")] = None,
    first: Begin = None,
    last: End = None,
    lasting: Annotated[float, Option("--seconds", metavar="SECONDS", help="Duration of the film.", min=0.1, max=3600.0)] = 6.0,
    magnify: Magnified = 1.0,
    bars: BarQuantity = None,
    allow_code: OwnCode = None,
) -> int:
    from scissordyn.plot.animation import animate as write_film
    from scissordyn.plot.series import select_window

    check_movie(film, run, "film.html")
    begin, end = read_option(first, "--from"), read_option(last, "--to")
    saved = read_run(run)
    mechanism = mechanism_of(saved, allow_code)
    part = select_window(saved, begin, end)
    say(write_film(part, mechanism, film, joints=joint, seconds=lasting, magnify=magnify, bars=bars))
    return 0


def export(
    source: Annotated[Path, Argument(help="A saved run, or a case file.")],
    target: Annotated[
        Path,
        Argument(
            help="File to write. Run: .csv, .parquet or .mat; with --forces: .csv, .json or .inp (CalculiX). "
            "Case: .dxf (bars with holes), .csv (cut list), .xml (MJCF) or .fmu (FMI 3.0)."
        ),
    ],
    contacts: Annotated[bool, Option("--contacts", help="One row for each contact instead of each instant.")] = False,
    forces: Annotated[bool, Option("--forces", help="Export the forces of the pins on each bar.")] = False,
    envelope: Annotated[bool, Option("--envelope", help="Export the largest pin forces over time and their ranges.")] = False,
    first: Begin = None,
    last: End = None,
    section: Annotated[str, Option(help="Section of the beams in an .inp file, such as '20x30 mm'.")] = "",
    material: Annotated[str, Option(help="Material of the beams in an .inp file.")] = "steel",
    pin: Annotated[str | None, Option(metavar="LENGTH", help="Radius of the pins of ideal joints, such as '5 mm'.")] = None,
    width: Annotated[str | None, Option(metavar="LENGTH", help="Width of the bars in a .dxf file.")] = None,
    sources: Annotated[bool, Option("--sources", help="Write an .fmu file with C source only; no compiler is needed.")] = False,
    change: Changes = None,
    allow_code: OwnCode = None,
) -> int:
    from scissordyn.exchange.export import FORCE_ENDINGS, MECHANISM_ENDINGS, check_ending
    from scissordyn.exchange.export import export as write
    from scissordyn.file.export import check_export
    from scissordyn.plot.series import select_window

    if source.suffix.lower() == ".toml":
        from scissordyn.config.file import read_case

        check_ending(target, MECHANISM_ENDINGS, "a mechanism", "bars.dxf")
        check_file(target, source, "bars.dxf")
        case = read_case(source, change or ())
        radius, broad = read_option(pin, "--pin", "m"), read_option(width, "--width", "m")
        make = partial(write, case, target, pin_radius=radius, width=broad, sources_only=sources)
    else:
        loads = forces or envelope
        if loads:
            check_ending(target, FORCE_ENDINGS, "forces", "forces.csv")
        else:
            check_export(target)
        check_file(target, source, "table.csv")
        begin, end = read_option(first, "--from"), read_option(last, "--to")
        run = read_run(source)
        mechanism = mechanism_of(run, allow_code) if loads else None
        part = select_window(run, begin, end)
        selection: dict[str, Any] = {"contacts": contacts, "forces": forces, "envelope": envelope}
        make = partial(write, part, target, **selection, mechanism=mechanism, section=section, material=material)
    with warnings.catch_warnings(record=True) as notes:
        warnings.simplefilter("ignore")  # those of libraries
        warnings.simplefilter("always", UserWarning)
        written = make()
    say(*(f"note: {note.message}" for note in notes), soft_wrap=True)
    say(written)
    return 0


def cite(
    run: SavedRun,
    output: Annotated[
        Path | None, Option("-o", "--output", metavar="FILE", help="Write BibTeX to a file such as references.bib.")
    ] = None,
    bibtex: Annotated[bool, Option("--bibtex", help="Print BibTeX instead of text.")] = False,
) -> int:
    from scissordyn.file.output_file import write_file
    from scissordyn.record.citations import citations

    sample = "-o references.bib"
    check_file(output, run, sample)
    works = citations(read_run(run))
    if output is not None:
        say(write_file(output, works.bibtex.encode(), sample=sample))
    else:
        print(works.bibtex if bibtex else works)
    return 0
