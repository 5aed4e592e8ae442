"""``scissordyn fit``: numbers of a case from measured curves."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from scissordyn.cli.option import AsJson, CaseFile, Changes, Quiet
from scissordyn.cli.output import check_file, check_folder, check_run
from scissordyn.cli.status import DONE, UNFINISHED
from scissordyn.errors import InputError, printable

if TYPE_CHECKING:
    import xarray as xr

    from scissordyn.config.case import Case


def fit(
    case: CaseFile,
    data: Annotated[
        list[Path] | None,
        typer.Option(metavar="FILE", help="Measured curves: CSV that begins with 'time [s], angle of arm [deg]'. Repeatable."),
    ] = None,
    free: Annotated[
        list[str] | None,
        typer.Option(
            metavar="ADDRESS[=RANGE]",
            help="A number to fit, and its range or 'normal(MEAN, DEVIATION) UNIT' of another measurement. Repeatable.",
        ),
    ] = None,
    segment: Annotated[
        str | None,
        typer.Option(metavar="TIME", help="Duration of parts with a start of their own; 'whole' for one start for each file."),
    ] = None,
    jump: Annotated[
        float | None,
        typer.Option(metavar="FRACTION", help="Standard deviation of jumps between segments, of the range of the motion."),
    ] = None,
    deviation: Annotated[
        list[str] | None,
        typer.Option(metavar="COLUMN=VALUE", help="Standard deviation of a measured quantity, with its unit. Repeatable."),
    ] = None,
    held_out: Annotated[
        list[Path] | None, typer.Option(metavar="FILE", help="Measured curves that are predicted, not fitted. Repeatable.")
    ] = None,
    output: Annotated[Path | None, typer.Option("-o", "--output", help="Save the fit to this NetCDF file.")] = None,
    case_output: Annotated[
        Path | None, typer.Option("--write", metavar="FILE", help="Write the case with the fitted numbers to this file.")
    ] = None,
    plot: Annotated[Path | None, typer.Option(help="Draw curves, residuals and correlations into this folder.")] = None,
    change: Changes = None,
    quiet: Quiet = False,
    as_json: AsJson = False,
) -> int:
    """Fit numbers of a case to measured curves; say how well they are known, and which the data cannot distinguish."""
    if not data or not free:
        raise InputError("a fit", "--data and --free", "--data decay.csv --free 'arm.inertia' --free 'pivot.damping'")
    if output is not None:
        check_run(output, case, "-o fit.nc")
    if case_output is not None:
        check_file(case_output, case, "--write fitted.toml")
    if plot is not None:
        check_folder(plot, "--plot figures")
    from scissordyn.config.file import read_case, write_case
    from scissordyn.config.fits import fit as compute

    described = read_case(case, list(change or []))
    found = compute(
        described,
        data,
        addressed(free),
        segment=duration(segment),
        deviations=_deviations(described, deviation or []),
        jump=jump,
        progress=None if quiet or as_json or not sys.stderr.isatty() else lambda line: print(line, file=sys.stderr),
    )
    held = _predicted(found, held_out, segment) if held_out else None
    if output is not None:
        from scissordyn.run.store import save

        save(found, output)
    if case_output is not None:
        write_case(_fitted(found), case_output, run=described.run)
    if as_json:
        print(json.dumps(_record(found, held)))
    elif not quiet:
        _show(found, held)
    for path in _pictures(found, plot) if plot is not None else []:
        if not quiet and not as_json:
            print(path)
    if found.attrs["status"] != "complete":
        print(f"scissordyn: {printable(found.attrs['cause'])}", file=sys.stderr)
        return UNFINISHED
    return DONE


def addressed(given: list[str]) -> dict[str, str | None]:
    """Ranges by address, of ``ADDRESS`` or ``ADDRESS=RANGE``."""
    found: dict[str, str | None] = {}
    for each in given:
        address, _, text = each.partition("=")
        if not address.strip() or address.strip() in found:
            raise InputError(f"--free {each!r}", "each address once", "--free 'arm.inertia'")
        found[address.strip()] = text.strip() or None
    return found


def duration(text: str | None) -> float | None:
    """The duration of a segment [s]."""
    from scissordyn.config.quantity import read_quantity
    from scissordyn.units import Quantity

    if text is None:
        return None
    return float("inf") if text == "whole" else read_quantity(text, Quantity("s", above=0.0), "--segment '1 s'")


def _deviations(described: Case, given: list[str]) -> dict[str, float] | None:
    from scissordyn.config.quantity import read_quantity
    from scissordyn.errors import did_you_mean
    from scissordyn.identification.fit import known_headings
    from scissordyn.units import Quantity

    known, found = known_headings(described.mechanism, described.run) if given else {}, dict[str, float]()
    for each in given:
        heading, equals, text = each.rpartition("=")
        if not equals or heading.strip() not in known:
            raise InputError(
                f"--deviation {each!r}{did_you_mean(heading.strip(), known)}", "a measured column, = and a value with its unit"
            )
        unit = known[heading.strip()]
        value = float(text) if unit == "1" else text
        found[heading.strip()] = read_quantity(value, Quantity(unit, above=0.0), f"--deviation '{heading.strip()}=1 {unit}'")
    return found or None


def _fitted(found: xr.Dataset):  # type: ignore[no-untyped-def]
    from scissordyn.run.configuration import read_configuration

    return read_configuration(found).build_mechanism()


def _predicted(found: xr.Dataset, files: list[Path], segment: str | None) -> xr.Dataset:
    from scissordyn.config.measured import read_measured
    from scissordyn.identification.fit import known_headings
    from scissordyn.identification.prediction import prediction
    from scissordyn.run.configuration import read_configuration

    options = read_configuration(found).options
    assert options is not None
    mechanism = _fitted(found)
    known = known_headings(mechanism, options)
    return prediction(mechanism, options, [read_measured(path, known) for path in files], segment=duration(segment))


def _show(found: xr.Dataset, held: xr.Dataset | None) -> None:
    import numpy as np
    from rich import box
    from rich.table import Table

    from scissordyn.cli.show import console
    from scissordyn.units import cell

    to = console()
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0))
    for name in ("number", "start", "fitted", "95 % interval", "unit"):
        table.add_column(name, justify="left" if name in ("number", "unit") else "right", overflow="fold")
    for k, address in enumerate(found["parameter"].values.astype(str)):
        start, value, low, high = (float(found[name].values[k]) for name in ("start_value", "value", "low", "high"))
        known = np.isfinite(found["standard_error"].values[k])
        interval = f"{low:.5g} .. {high:.5g}" if known else "not determined"
        table.add_row(address, f"{start:.5g}", f"{value:.6g}", interval, str(found["unit"].values[k]))
    to.print(table)
    errors = Table(box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0))
    for name in ("measured", "rms of residuals", *(() if held is None else ("rms of prediction",))):
        errors.add_column(name, justify="left" if name == "measured" else "right")
    for k, heading in enumerate(found["column"].values.astype(str)):
        unit = str(found["column_unit"].values[k])
        sizes = [float(found["rms"].values[k])] + ([] if held is None else [float(held["rms"].values[k])])
        errors.add_row(heading, *(cell(size, unit) for size in sizes))
    to.print(errors)
    counted = json.loads(found.attrs["statistics"])
    to.print(f"{counted['runs']} runs in {counted['seconds']:.1f} s", markup=False)
    for line in json.loads(found.attrs["warnings"]):
        to.print(f"Warning: {line}", markup=False)


def _record(found: xr.Dataset, held: xr.Dataset | None) -> dict[str, object]:
    """The fit for other programs, in SI."""
    import math

    def number(value: float) -> float | None:
        return value if math.isfinite(value) else None

    names = ("start_value", "value", "standard_error", "low", "high")
    numbers = {
        str(address): {**{name: number(float(found[name].values[k])) for name in names}, "unit": str(found["unit"].values[k])}
        for k, address in enumerate(found["parameter"].values)
    }
    columns = found["column"].values.astype(str).tolist()
    record: dict[str, object] = {
        "status": found.attrs["status"],
        "numbers": numbers,
        "rms": dict(zip(columns, found["rms"].values.tolist(), strict=True)),
        "warnings": json.loads(found.attrs["warnings"]),
        **json.loads(found.attrs["statistics"]),
    }
    return record if held is None else record | {"prediction_rms": dict(zip(columns, held["rms"].values.tolist(), strict=True))}


def _pictures(found: xr.Dataset, folder: Path) -> list[Path]:
    from scissordyn.plot.file import write
    from scissordyn.plot.fit import fit_correlation, fit_curves

    folder.mkdir(parents=True, exist_ok=True)
    written = []
    for name, axes in (("fit", fit_curves(found)), ("correlation", fit_correlation(found))):
        figure = axes[0].get_figure(root=True)
        assert figure is not None
        written.append(write(figure, folder / f"{name}.png"))
    return written
