"""``scissordyn compare``: two saved runs side by side, or a run and measured curves."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from scissordyn.cli.option import SavedRun
from scissordyn.cli.output import check_folder

if TYPE_CHECKING:
    import xarray as xr

MOST = 20
"""Differing entries of the configurations that are listed."""

MULTIPLE = 10.0
"""From this ratio on a change is written as a multiple."""


def compare(
    run: SavedRun,
    other: Annotated[Path, typer.Argument(help="Another one, or measured curves as CSV: 'time [s], angle of arm [deg]'.")],
    output: Annotated[Path | None, typer.Option("-o", "--output", metavar="DIR", help="Draw both into this folder.")] = None,
    form: Annotated[str, typer.Option("--format", metavar="FORMAT", help="png, svg or pdf.")] = "png",
) -> int:
    """Show how two saved runs differ, or how well a run agrees with measured curves."""
    from rich import box
    from rich.table import Table

    from scissordyn.cli.difference import differences
    from scissordyn.cli.saved import read_run
    from scissordyn.cli.show import console
    from scissordyn.plot.file import check_format, write
    from scissordyn.run.configuration import read_configuration
    from scissordyn.units import cell

    check_format(form)
    if output is not None:
        check_folder(output, "-o figures")
    if other.suffix.lower() == ".csv":
        from scissordyn.cli.agreement import compare_with_data

        return compare_with_data(read_run(run), other, output, form)
    first, second = read_run(run), read_run(other)
    to = console()
    names = (run.stem, other.stem) if run.stem != other.stem else (str(run), str(other))
    found = list(differences(read_configuration(first), read_configuration(second)))
    if not found:
        to.print("Both runs are of the same case.", markup=False)
    else:
        entries = Table(box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0))
        entries.add_column("entry", overflow="fold")
        for name, texts in zip(names, list(zip(*found, strict=True))[1:], strict=True):
            numbers = [len(text) for text in texts if text[:1].isdigit() or text[:1] == "-"]
            entries.add_column(name, justify="right", overflow="fold", min_width=max(numbers, default=1))
        for row in found[:MOST]:
            entries.add_row(*row)
        to.print(entries)
    if len(found) > MOST:
        to.print(f"... and {len(found) - MOST} more entries differ", markup=False)
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0))
    table.add_column("quantity", overflow="fold")
    for name in names:
        table.add_column(name, justify="right", no_wrap=True)
    table.add_column("change", justify="right", no_wrap=True)
    both = measures(first), measures(second)
    for name, (value, unit) in both[0].items():
        if name in both[1]:
            theirs = both[1][name][0]
            shown = (cell(each, unit) if unit else f"{each:g}" for each in (value, theirs))
            table.add_row(name, *shown, change(value, theirs))
    to.print(table)
    hard = [name for name, one in zip(names, (first, second), strict=True) if "peak_force_estimate" in one]
    if hard:
        to.print(
            f"Hard contact in {' and '.join(hard)}: largest forces are estimates, driving torques leave impacts out.",
            markup=False,
        )
    if output is not None:
        from scissordyn.plot.comparison import comparison

        output.mkdir(parents=True, exist_ok=True)
        figure = comparison(first, second, labels=names)[0].get_figure(root=True)
        assert figure is not None
        to.print(str(write(figure, output / f"comparison.{form}")), markup=False)
    return 0


def change(value: float, other: float) -> str:
    """The change from one number to another: in percent, or as a multiple where it is large."""
    if not value:
        return "0 %" if other == value else "-"
    ratio = other / value
    if ratio >= MULTIPLE:
        return f"{float(f'{ratio:.3g}'):g} times"
    return f"{100.0 * (other - value) / abs(value):+.3g} %"


SELDOM = ("motor_work", "load_work")
"""Shown only where there is any."""


def measures(run: xr.Dataset) -> dict[str, tuple[float, str]]:
    """Figures of a run with their units, by name."""
    import numpy as np

    from scissordyn.run.answer.joints import clearance_joints
    from scissordyn.run.answer.summary import joint_summaries

    largest = {joint.name: joint.largest for joint in joint_summaries(run)} if "contact_joint" in run else {}
    found: dict[str, tuple[float, str]] = {"end": (float(run.attrs["end"]), "s")}
    joint_of = run["contact_joint"].values.astype(str) if "contact_joint" in run else np.empty(0, str)
    for joint in clearance_joints(run):
        found[f"contacts at {joint}"] = (float((joint_of == joint).sum()), "")
        if math.isfinite(largest.get(joint, math.nan)):
            found[f"largest force at {joint}"] = (largest[joint], "N")
    if "peak_drive_torque" in run:
        found["largest driving torque"] = (float(np.max(np.abs(run["peak_drive_torque"].values))), "N m")
    if "peak_control_torque" in run:
        for name, size in zip(run["actuator"].values.astype(str), run["peak_control_torque"].values.tolist(), strict=True):
            found[f"largest torque of {name}"] = (abs(size), "N m")
    for variable, name, unit in (
        ("slider_position", "displacement at the end", "m"),
        ("drive_work", "work of the drive", "J"),
        ("motor_work", "work of motors and actuators", "J"),
        ("load_work", "work of forces and torques", "J"),
        ("dissipated_energy", "dissipated energy", "J"),
    ):
        if variable in run and math.isfinite(last := float(run[variable].values[-1])) and (last or variable not in SELDOM):
            found[name] = (last, unit)
    return found
