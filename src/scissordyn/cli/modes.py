"""``scissordyn modes``: natural frequencies of a case at its start, drives locked."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from scissordyn.cli.option import CaseFile, Changes

__all__ = ["modes"]


def modes(
    case: CaseFile,
    output: Annotated[Path | None, typer.Option("-o", "--output", metavar="FILE", help="Save the shapes: .nc.")] = None,
    count: Annotated[int, typer.Option(help="Number of modes, from the lowest.", min=1)] = 10,
    position: Annotated[
        str, typer.Option(help="static: bent by the loads, in equilibrium; concentric: as assembled, bars unbent.")
    ] = "static",
    change: Changes = None,
) -> int:
    """Natural frequencies and mode shapes at the start, drives locked, clearance joints ideal."""
    from scissordyn.cli.show import console
    from scissordyn.config.file import read_case
    from scissordyn.errors import InputError
    from scissordyn.run.modes import modes as compute
    from scissordyn.run.store import save

    if position not in ("static", "concentric"):
        raise InputError(f"--position {position}", "static, concentric", "--position static")
    found = compute(read_case(case, change or []).mechanism, count=count, position=position)  # type: ignore[arg-type]
    to = console()
    frequencies, angular, shapes = (found[name].values for name in ("frequency", "angular_frequency", "shape"))
    for k, frequency in enumerate(frequencies.tolist()):
        moves = found["body"].values[int(((shapes[k] ** 2).sum(axis=-1)).argmax())]
        text = f"{frequency:12.6g} Hz" if frequency >= 0.0 else f"unstable, grows with {-angular[k]:.6g} 1/s"
        to.print(f"mode {k + 1:3d}  {text}   moves '{moves}' most", markup=False)
    if output is not None:
        save(found, output)
        to.print(str(output), markup=False)
    return 0
