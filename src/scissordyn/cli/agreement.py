"""``scissordyn compare run.nc measured.csv``: a run against measured curves."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import xarray as xr


def compare_with_data(run: xr.Dataset, path: Path, output: Path | None, form: str) -> int:
    """Print measures of agreement, and draw both curves and their differences."""
    from scissordyn.analysis.agreement import agreement
    from scissordyn.cli.show import console
    from scissordyn.config.measured import read_measured
    from scissordyn.file.export import time_columns

    record = read_measured(path, {column.heading: column.unit for column in time_columns(run)})
    found = agreement(run, record)
    to = console()
    time = found["time"].values
    to.print(f"Compared at {time.size} instants from {time[0]:.6g} s to {time[-1]:.6g} s", markup=False)
    if found.attrs["left_out"]:
        to.print(f"{found.attrs['left_out']} measured instants are outside the time of the run", markup=False)
    for k, heading in enumerate(found["column"].values.astype(str)):
        _show(heading, found.isel(column=k))
    if output is not None:
        from scissordyn.plot.agreement import agreement_curves
        from scissordyn.plot.file import write

        output.mkdir(parents=True, exist_ok=True)
        figure = agreement_curves(found)[0].get_figure(root=True)
        assert figure is not None
        to.print(str(write(figure, output / f"agreement.{form}")), markup=False)
    return 0


def _show(heading: str, one: xr.Dataset) -> None:
    """One quantity as a table of its measures."""
    from rich import box
    from rich.table import Table

    from scissordyn.cli.show import console
    from scissordyn.units import cell

    unit = str(one["column_unit"].values)

    def number(name: str) -> float:
        return float(one[name].values)

    def sized(name: str, in_unit: str) -> str:
        return cell(number(name), in_unit)

    counts = ", ".join(f"{number(name):.0f}" for name in ("events", "run_events", "matched_events"))
    rows = [
        ("root mean square error", sized("rmse", unit)),
        ("the same over the measured range", f"{100.0 * number('nrmse'):.3g} %"),
        ("mean of run less measured", sized("bias", unit)),
        ("correlation", sized("correlation", "1")),
        ("explained variance", sized("explained", "1")),
        ("largest value, run against measured", f"{100.0 * number('peak_error'):+.3g} %, {sized('peak_lag', 's')} later"),
        ("events measured, of the run, matched", counts),
        ("time of matched events, run less measured", f"{sized('event_lag', 's')}, rms {sized('event_deviation', 's')}"),
    ]
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0))
    table.add_column(heading, overflow="fold")
    table.add_column("agreement", justify="right", no_wrap=True)
    for row in rows:
        table.add_row(*row)
    console().print(table)
