"""``scissordyn run``: simulate a case, show and save the result."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from scissordyn.cli.output import check_file, check_folder
from scissordyn.cli.status import DONE, INTERRUPTED, UNFINISHED
from scissordyn.errors import InputError

if TYPE_CHECKING:
    import xarray as xr

    from scissordyn.model.mechanism import Mechanism

__all__ = ["run"]

HDF_MAGIC = b"\x89HDF"


def run(
    case: Annotated[Path, typer.Argument(help="A case file, or a saved run to run again.")],
    output: Annotated[Path | None, typer.Option("-o", "--output", help="Save the run to this NetCDF file.")] = None,
    change: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="Change a value of the case, as in drive.speed='250 rpm'. Repeatable."),
    ] = None,
    plot: Annotated[Path | None, typer.Option(help="Draw the run, beside the ideal mechanism, into this folder.")] = None,
    film: Annotated[
        Path | None, typer.Option("--animate", help="Write a film of the run: a name that ends in .gif, .mp4 or .html.")
    ] = None,
    trust: Annotated[bool, typer.Option("--trust", help="Run twice and report the time until which both runs agree.")] = False,
    samples: Annotated[int | None, typer.Option(help="Recorded instants.")] = None,
    events: Annotated[int, typer.Option(help="Number of contacts to show.", min=0)] = 20,
) -> int:
    """Simulate a case and show its contacts."""
    if output is not None:
        check_file(output, case, "-o run.nc")
    if plot is not None:
        check_folder(plot, "--plot figures")
    if film is not None:
        from scissordyn.plot.animation import check_film

        check_film(film)
        check_file(film, case, "--animate film.html")
    changes = list(change or [])
    changes += ["run.trust=true"] if trust else []
    changes += [] if samples is None else [f"run.samples={samples}"]
    result = _again(case, changes) if _is_saved(case) else _from_case(case, changes)
    try:
        if output is not None:
            from scissordyn.simulation.store import save

            save(result, output)
    finally:  # the results are shown even if the file cannot be written
        _show(result, events)
    status = result.attrs["status"]
    if output is not None:
        print(f"Saved to {output}" + ("" if status == "complete" else f", marked {status}"))
    if plot is not None and result.sizes["time"] > 1 and status != "interrupted":
        _draw(result, plot)
    if film is not None and result.sizes["time"] > 1 and status != "interrupted":
        from scissordyn.plot.animation import animate

        print(animate(result, _mechanism(result), film))
    if status != "complete":
        print(f"scissordyn: {result.attrs['cause']}", file=sys.stderr)
    return {"complete": DONE, "interrupted": INTERRUPTED}.get(status, UNFINISHED)


def _is_saved(path: Path) -> bool:
    """Whether a path is a saved run, possibly truncated, rather than a case file."""
    if path.suffix == ".nc":
        return True
    try:
        with path.open("rb") as file:
            return file.read(len(HDF_MAGIC)) == HDF_MAGIC
    except OSError:
        return False  # the reader of case files raises the error


def _from_case(path: Path, changes: list[str]) -> xr.Dataset:
    from scissordyn.cli.progress import progress_bar
    from scissordyn.config.file import read_case
    from scissordyn.simulation.run import simulate

    case = read_case(path, changes)
    with progress_bar(case.run.until) as progress:
        return simulate(case.mechanism, **case.run.keywords, progress=progress)


def _again(path: Path, changes: list[str]) -> xr.Dataset:
    from scissordyn.cli.progress import progress_bar
    from scissordyn.simulation.run import replay
    from scissordyn.simulation.store import load

    if changes:
        raise InputError(f"'{changes[0]}' for a saved run", "a saved run as it was, or changes to a case file")
    if not path.is_file():
        raise InputError(f"cannot read '{path}': no such file", "a case file or a saved run")
    saved = load(path)
    until = float(json.loads(saved.attrs["configuration"])["options"]["until"])
    with progress_bar(until) as progress:
        return replay(saved, progress=progress)


def _show(result: xr.Dataset, rows: int) -> None:
    from scissordyn.cli.show import console, show_events, show_summary

    to = console()
    show_events(result, rows, to)
    show_summary(result, to)


def _mechanism(result: xr.Dataset) -> Mechanism:
    """The mechanism of the run."""
    from scissordyn.model.record import from_plain

    mechanism: Mechanism = from_plain(json.loads(result.attrs["configuration"])["mechanism"])
    return mechanism


def _draw(result: xr.Dataset, folder: Path) -> None:
    from scissordyn.plot.report import draw_all
    from scissordyn.simulation.run import simulate

    mechanism = _mechanism(result)
    ideal = simulate(mechanism.ideal(), until=float(result["time"][-1]), samples=result.sizes["time"])
    for path in draw_all(result, ideal, folder, mechanism):
        print(path)
