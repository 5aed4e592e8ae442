"""``scissordyn statics``: forces of a case along the stroke of its drives, without inertia."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from scissordyn.cli.option import CaseFile, Changes
from scissordyn.cli.output import check_file
from scissordyn.errors import InputError

if TYPE_CHECKING:
    import xarray as xr


def statics(
    case: CaseFile,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="FILE", help="Save everything, .nc, or the table of forces, .csv.")
    ] = None,
    points: Annotated[int, typer.Option(help="Number of positions.", min=2, max=100_000)] = 201,
    until: Annotated[str | None, typer.Option(metavar="TIME", help="End of the stroke; that of the run if not given.")] = None,
    plot: Annotated[Path | None, typer.Option(metavar="FILE", help="Draw the forces: .svg or .png.")] = None,
    over: Annotated[
        str, typer.Option(help="What they are drawn over: time, input, or a coordinate of a tracked point, as table.x.")
    ] = "input",
    change: Changes = None,
) -> int:
    """Forces in pins, guides, drives, rods, springs and bars over the stroke, without inertia."""
    from scissordyn.cli.saved import seconds
    from scissordyn.cli.show import console
    from scissordyn.config.file import read_case
    from scissordyn.run.answer.statics import statics as compute

    if output is not None:
        if output.suffix.lower() not in (".nc", ".csv"):
            raise InputError(f"-o {output}", "a name that ends in .nc or .csv", "-o statics.csv")
        check_file(output, case, "statics.nc")
    if plot is not None:
        from scissordyn.plot.file import check_format

        check_format(plot.suffix.lower().removeprefix("."))
        check_file(plot, case, "statics.png")
    read = read_case(case, change or [])
    last = seconds(until, "--until")
    found = compute(read.mechanism, until=read.run.until if last is None else last, points=points)
    to, written, figure = console(), [], None
    if plot is not None:
        from scissordyn.plot.file import write
        from scissordyn.plot.statics import statics as draw

        figure = draw(found, over=over)[0].get_figure(root=True)
    for line in _table(found) + _bars(found):
        to.print(line, markup=False, highlight=False, soft_wrap=True)
    for warning in json.loads(found.attrs["warnings"]):
        to.print(f"Warning: {warning}.", markup=False)
    if plot is not None:
        assert figure is not None
        written.append(write(figure, plot))
    if output is not None:
        written.append(_saved(found, output))
    for path in written:
        to.print(str(path), markup=False)
    return 0


def _table(found: xr.Dataset) -> list[str]:
    """A line for each force: its least and its largest value, and what the first drive holds there."""
    import numpy as np

    from scissordyn.plot.scale import engineering

    names = found["quantity"].values.tolist()
    width = max(map(len, names), default=8)
    turns = str(found["prescribed_unit"].values[0]) == "rad"
    time, held = found["time"].values, found["input"].values[:, 0] * (180.0 / np.pi if turns else 1e3)
    unit = "deg" if turns else "mm"
    lines = [f"{'':{width}}  {'least':>12} {'at':>13}  {'largest':>12} {'at':>13}"]
    for k, name in enumerate(names):
        ends = [float(found[end].values[k]) for end in ("least", "largest")]
        if not np.isfinite(ends).all():
            lines.append(f"{name:{width}}  not determined")
            continue
        scale = engineering(str(found["quantity_unit"].values[k]), ends)
        cells = [f"{scale.text(end)} {scale.unit}" for end in ends]
        at = [f"{np.interp(found[f'{end}_time'].values[k], time, held):.5g} {unit}" for end in ("least", "largest")]
        lines.append(f"{name:{width}}  {cells[0]:>12} {at[0]:>13}  {cells[1]:>12} {at[1]:>13}")
    return lines


def _bars(found: xr.Dataset) -> list[str]:
    """A line for each bar that bends."""
    from scissordyn.units import short

    if "bar" not in found:
        return []
    lines = []
    for bar in found["bar"].values.tolist():
        sizes = [
            f"{name.replace('_', ' ')} {short(abs(float(found[f'bar_largest_{name}'].sel(bar=bar))), unit)}"
            for name, unit in (("axial_force", "N"), ("bending_moment", "N m"), ("stress", "Pa"), ("deflection", "m"))
        ]
        lines.append(f"bar {bar}: largest {', '.join(sizes)}")
    return lines


def _saved(found: xr.Dataset, path: Path) -> Path:
    """Write everything, or the table of forces."""
    if path.suffix.lower() == ".nc":
        from scissordyn.run.store import save

        return save(found, path)
    import csv
    import io

    import numpy as np

    from scissordyn.file.output_file import write_file

    head = ["time [s]"]
    for kind, unit in (("prescribed", "prescribed_unit"), ("quantity", "quantity_unit")):
        head += [f"{name} [{of}]" for name, of in zip(found[kind].values, found[unit].values, strict=True)]
    rows = np.column_stack([found["time"].values, found["input"].values, found["force"].values])
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows([head, *rows.tolist()])
    return write_file(path, text.getvalue().encode(), sample="-o statics.csv")
