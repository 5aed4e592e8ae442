"""Arguments and options that several commands have."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

CaseFile = Annotated[Path, typer.Argument(help="A case file.")]
SavedRun = Annotated[Path, typer.Argument(help="A saved run.")]
Changes = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="Change a value of the case, as in drive.speed='250 rpm'. Repeatable."),
]
OwnCode = Annotated[
    list[Path] | None,
    typer.Option(metavar="FILE", help="A Python file of yours that the saved run used and may execute again. Repeatable."),
]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print one line of JSON, in SI units, in place of text.")]
BlockSize = Annotated[int | None, typer.Option(help="Cases of a block of a new store.", min=1)]
Magnified = Annotated[
    float, typer.Option(metavar="FACTOR", help="Magnify the deflections of bars that bend.", min=1e-3, max=1e6)
]
BarQuantity = Annotated[
    str | None,
    typer.Option(
        "--bars", metavar="QUANTITY", help="On bars that bend: stress, utilisation, 'bending moment' or 'axial force'."
    ),
]
