"""``scissordyn bifurcation``: the asymptotic motion under a periodic drive over a parameter."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from scissordyn.cli.option import Changes
from scissordyn.cli.output import check_file, check_run
from scissordyn.cli.progress import DESCRIPTION, bar
from scissordyn.cli.status import DONE, INTERRUPTED, UNFINISHED
from scissordyn.cli.where import QueueFile, Scheduler, ThreadCount, Where, WorkerCount
from scissordyn.errors import InputError, command, did_you_mean, printable

if TYPE_CHECKING:
    import xarray as xr


def bifurcation(
    case: Annotated[Path, typer.Argument(help="A case file with a periodic drive.")],
    over: Annotated[str, typer.Option(help="The varied parameter, as in A.clearance or drive.angular_frequency.")],
    first: Annotated[str, typer.Option("--from", metavar="VALUE", help="First value, with its unit.")],
    last: Annotated[str, typer.Option("--to", metavar="VALUE", help="Last value, with its unit.")],
    points: Annotated[
        int, typer.Option("--points", "--values", metavar="N", help="Number of values of the parameter.", min=2)
    ] = 300,
    cycles: Annotated[int, typer.Option(help="Periods of the drive to run for each value.", min=1)] = 200,
    keep: Annotated[int | None, typer.Option(help="Number of last periods to keep; half if not given.", min=1)] = None,
    follow: Annotated[bool, typer.Option("--follow", help="Start each value where the one before ended.")] = False,
    tolerance: Annotated[float, typer.Option(help="Relative tolerance.", min=1e-14, max=1e-2)] = 1e-6,
    threads: ThreadCount = None,
    workers: WorkerCount = None,
    scheduler: Scheduler = None,
    cluster: QueueFile = None,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Save the diagram to this NetCDF file, and continue it.")
    ] = None,
    change: Changes = None,
    plot: Annotated[Path | None, typer.Option(help="Draw the diagram into this file.")] = None,
    variable: Annotated[str, typer.Option(help="The variable to draw.")] = "",
) -> int:
    """Compute a bifurcation diagram: the state once per period of the drive, for many values of a parameter."""
    if output is not None:
        check_run(output, case, "-o diagram.nc")
    if plot is not None:
        from scissordyn.plot.file import check_format

        check_format(plot.suffix.lower().removeprefix("."))
        check_file(plot, case, "--plot diagram.png")

    import numpy as np

    from scissordyn.config.file import read_case
    from scissordyn.config.quantity import unit_factor, unit_typed
    from scissordyn.model.address import number
    from scissordyn.periodic.bifurcation import bifurcation as compute
    from scissordyn.periodic.bifurcation import check_diagram
    from scissordyn.periodic.cycles import recorded

    described = read_case(case, list(change or []))
    quantity = number(described.mechanism, over).quantity
    assert quantity is not None
    known = recorded(described.mechanism)
    if variable and variable not in known:
        raise InputError(
            f"--variable '{variable}'{did_you_mean(variable, known)}", ", ".join(known), command("--variable", known[0])
        )
    keep = max(1, cycles // 2) if keep is None else keep
    check_diagram(described.mechanism, points, cycles, keep)
    ends = _number(first, quantity, "--from"), _number(last, quantity, "--to")
    unit = unit_typed(last) or unit_typed(first)
    columns = (DESCRIPTION, "BarColumn", "MofNCompleteColumn", "TimeRemainingColumn")
    shown = bar(*columns, described="values", total=points)
    with Where(threads, workers, scheduler, cluster).engine() as engine, shown as update:
        diagram = compute(
            described.mechanism,
            over=over,
            values=np.linspace(*ends, points),
            cycles=cycles,
            keep=keep,
            follow=follow,
            start=described.run.start,
            rtol=tolerance,
            atol=tolerance,
            method=described.run.method,
            engine=engine,
            store=output,
            progress=None if update is None else lambda done, _: update(completed=done),
            shown=(unit, unit_factor(unit, quantity.unit)) if unit else None,
        )
    return _show(diagram, output, plot, variable)


def _number(text: str, quantity: object, option: str) -> float:
    from scissordyn.config.quantity import example, read_quantity
    from scissordyn.units import Quantity

    assert isinstance(quantity, Quantity)
    value: str | float = text
    if quantity.unit == "1":
        try:
            value = float(text)
        except ValueError:
            raise InputError(f"{option} '{text}': not a number", quantity.allowed, f"{option} {example(quantity)}") from None
    try:
        return read_quantity(value, quantity, f"{option} '{example(quantity)}'")
    except InputError as error:
        raise InputError(f"{option} '{text}': {error.what}", error.allowed, error.type_this) from None


def _show(diagram: xr.Dataset, output: Path | None, plot: Path | None, variable: str) -> int:
    states = diagram["status"].values.tolist()
    done, total = int(diagram["completed_cycles"].sum()), len(states)
    print(
        f"{states.count('complete')} of {total} values of {printable(diagram.attrs['parameter'])} complete, {done} cycles, "
        f"{diagram.attrs['wall_seconds']:.1f} s; {diagram.attrs['cycles_per_second']:.0f} cycles per second and processor"
    )
    for warning in json.loads(diagram.attrs["warnings"]):
        print(f"Warning: {printable(warning)}")
    if output is not None:
        print(f"Saved to {output}" + ("" if states.count("complete") == total else f", marked {diagram.attrs['status']}"))
    if diagram.attrs["status"] == "interrupted":
        print(
            "scissordyn: interrupted; the same command continues from the file" if output else "scissordyn: interrupted",
            file=sys.stderr,
        )
        return INTERRUPTED
    if plot is not None and "complete" in states:
        from scissordyn.plot.file import write
        from scissordyn.plot.regularity import bifurcation as draw

        figure = draw(diagram, variable=variable)[0].get_figure(root=True)
        assert figure is not None
        print(write(figure, plot))
    failed = [index for index, state in enumerate(states) if state == "failed"]
    if failed:
        from scissordyn.plot.scale import scale_of

        cause = diagram["cause"].values[failed[0]]
        value = scale_of(diagram["value"]).said(float(diagram["value"][failed[0]]), 6)
        print(
            f"scissordyn: {len(failed)} of {total} values failed; the first, {value}: {printable(cause)}",
            file=sys.stderr,
        )
        return UNFINISHED
    return DONE
