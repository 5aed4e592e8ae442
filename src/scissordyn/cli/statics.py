"""``scissordyn statics``: forces of a case along the stroke of its drives, without inertia."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Option

from scissordyn.cli.option import CaseFile, Changes
from scissordyn.cli.output import check_file, check_picture
from scissordyn.cli.read import typed
from scissordyn.cli.terminal import say
from scissordyn.errors import InputError
from scissordyn.units import short

if TYPE_CHECKING:
    import xarray as xr


def statics(
    case: CaseFile,
    output: Annotated[
        Path | None, Option("-o", "--output", metavar="FILE", help="Save everything, .nc, or the table of forces, .csv.")
    ] = None,
    points: Annotated[int, Option(help="Number of positions.", min=2, max=100_000)] = 201,
    until: Annotated[str | None, Option(metavar="TIME", help="End of the stroke; that of the run if not given.")] = None,
    friction: Annotated[str, Option(help="none; forward: of a slow motion as the drives move; backward: against it.")] = "none",
    plot: Annotated[Path | None, Option(metavar="FILE", help="Draw the forces: .svg or .png.")] = None,
    over: Annotated[
        str, Option(help="What they are drawn over: time, input, or a coordinate of a tracked point, as table.x.")
    ] = "input",
    change: Changes = None,
) -> int:
    from scissordyn.config.file import read_case
    from scissordyn.run.answer.statics import statics as compute

    if output is not None:
        if output.suffix.lower() not in (".nc", ".csv"):
            raise InputError(f"-o {output}", "a name that ends in .nc or .csv", "-o statics.csv")
        check_file(output, case, "statics.nc")
    check_picture(plot, case, "statics.png")
    if friction not in ("none", "forward", "backward"):
        raise InputError(f"--friction {friction}", "none, forward, backward", "--friction forward")
    read = read_case(case, change or [])
    last = typed(until, "--until")
    solved = compute(read.mechanism, until=read.run.until if last is None else last, points=points, friction=friction)  # type: ignore[arg-type]
    drawn = None
    if plot is not None:
        from scissordyn.plot.stroke import statics as draw

        drawn = draw(solved, over=over)
    say(*_table(solved), *_bars(solved), highlight=False, soft_wrap=True)
    say(*(f"Warning: {warning}." for warning in json.loads(solved.attrs["warnings"])))
    if plot is not None and drawn is not None:
        from scissordyn.plot.file import write

        say(write(drawn, plot))
    if output is not None:
        say(_save(solved, output))
    return 0


def _table(solved: xr.Dataset) -> list[str]:
    """A line for each force: its least and its largest value, and what the first drive holds there."""
    import numpy as np

    from scissordyn.plot.scale import engineering

    names = solved["quantity"].values.tolist()
    width = max(map(len, names), default=8)
    factor, unit = (180.0 / math.pi, "deg") if str(solved["prescribed_unit"].values[0]) == "rad" else (1e3, "mm")
    time, stroke = solved["time"].values, factor * solved["input"].values[:, 0]
    lines = [f"{'':{width}}  {'least':>12} {'at':>13}  {'largest':>12} {'at':>13}"]
    for k, name in enumerate(names):
        ends = [float(solved[end].values[k]) for end in ("least", "largest")]
        if not all(map(math.isfinite, ends)):
            lines.append(f"{name:{width}}  not determined")
            continue
        scale = engineering(str(solved["quantity_unit"].values[k]), ends)
        cells = [f"{scale.text(end)} {scale.unit}" for end in ends]
        at = [f"{np.interp(solved[f'{end}_time'].values[k], time, stroke):.5g} {unit}" for end in ("least", "largest")]
        lines.append(f"{name:{width}}  {cells[0]:>12} {at[0]:>13}  {cells[1]:>12} {at[1]:>13}")
    return lines


def _bars(solved: xr.Dataset) -> list[str]:
    """A line for each bar that bends."""
    lines = []
    for bar in solved["bar"].values.tolist() if "bar" in solved else ():
        sizes = [
            f"{name.replace('_', ' ')} {short(abs(float(solved[f'bar_largest_{name}'].sel(bar=bar))), unit)}"
            for name, unit in (("axial_force", "N"), ("bending_moment", "N m"), ("stress", "Pa"), ("deflection", "m"))
        ]
        lines.append(f"bar {bar}: largest {', '.join(sizes)}")
    return lines


def _save(solved: xr.Dataset, path: Path) -> Path:
    """Write everything, or the table of forces."""
    if path.suffix.lower() == ".nc":
        from scissordyn.run.store import save

        return save(solved, path)
    import numpy as np

    from scissordyn.file.output_file import csv_text, write_file

    head = ["time [s]"]
    for kind, unit in (("prescribed", "prescribed_unit"), ("quantity", "quantity_unit")):
        head += [f"{name} [{of}]" for name, of in zip(solved[kind].values, solved[unit].values, strict=True)]
    rows = np.column_stack([solved["time"].values, solved["input"].values, solved["quantity_value"].values])
    return write_file(path, csv_text([head, *rows.tolist()]).encode(), sample="-o statics.csv")
