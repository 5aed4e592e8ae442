"""``scissordyn cite``: who describes what a run has used."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from scissordyn.cli.option import SavedRun


def cite(
    run: SavedRun,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="FILE", help="Write BibTeX, as references.bib, in place of text.")
    ] = None,
    bibtex: Annotated[bool, typer.Option("--bibtex", help="Print BibTeX in place of text.")] = False,
) -> int:
    """List the publications of the mechanism, the laws and the methods that a saved run has used."""
    from scissordyn.cli.output import check_file
    from scissordyn.cli.saved import read_run
    from scissordyn.cli.show import console
    from scissordyn.file.output_file import write_file
    from scissordyn.run.answer.citations import citations

    sample = "-o references.bib"
    if output is not None:
        check_file(output, run, sample)
    found = citations(read_run(run))
    if output is not None:
        console().print(str(write_file(output, found.bibtex.encode(), sample=sample)), markup=False)
    else:
        print(found.bibtex if bibtex else found)
    return 0
