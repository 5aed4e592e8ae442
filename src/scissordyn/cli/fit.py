"""Command ``fit``: fit parameters of a case to measured curves."""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from scissordyn.casefile.quantity import read_quantity
from scissordyn.cli.option import AsJson, CaseFile, Changes, Quiet, split_values
from scissordyn.cli.output import DONE, UNFINISHED, check_file, check_folder, check_run, print_json, print_table, say
from scissordyn.cli.parameter import Option
from scissordyn.errors import InputError, did_you_mean, printable
from scissordyn.units import Quantity, cell, counted

if TYPE_CHECKING:
    import xarray as xr

    from scissordyn.casefile.case import Case
    from scissordyn.model.mechanism import Mechanism


def fit(
    case: CaseFile,
    data: Annotated[
        list[Path] | None,
        Option(metavar="FILE", help="Measured curves: CSV with a heading such as 'time [s], angle of arm [deg]'. Repeatable."),
    ] = None,
    free: Annotated[
        list[str] | None,
        Option(
            metavar="PARAMETER[=RANGE]",
            help="Parameter to fit, with its range or another measurement 'norm(loc=MEAN, scale=DEVIATION) UNIT'. Repeatable.",
        ),
    ] = None,
    segment: Annotated[
        str | None,
        Option(metavar="TIME", help="Duration of segments whose starts are estimated; 'whole' for one segment per file."),
    ] = None,
    jump: Annotated[
        float | None,
        Option(
            metavar="FRACTION", help="Standard deviation of jumps between segments, as a fraction of the range of the motion."
        ),
    ] = None,
    starts: Annotated[
        int,
        Option(help="Number of points tried in the ranges; the search starts from the best. 50 or more for impacts.", min=1),
    ] = 1,
    deviation: Annotated[
        list[str] | None,
        Option(metavar="COLUMN=VALUE", help="Standard deviation of a measured quantity, with its unit. Repeatable."),
    ] = None,
    held_out: Annotated[
        list[Path] | None, Option(metavar="FILE", help="Measured curves that are predicted, not fitted. Repeatable.")
    ] = None,
    output: Annotated[Path | None, Option("-o", "--output", help="Save the fit to this NetCDF file.")] = None,
    case_output: Annotated[
        Path | None, Option("--write", metavar="FILE", help="Write the case with the fitted values to this file.")
    ] = None,
    plot: Annotated[Path | None, Option(help="Draw curves, residuals and correlations into this folder.")] = None,
    change: Changes = None,
    quiet: Quiet = False,
    as_json: AsJson = False,
) -> int:
    from scissordyn.casefile.configuration import read_configuration
    from scissordyn.config.file import read_case, write_case
    from scissordyn.config.fits import fit as compute

    if not data or not free:
        raise InputError(
            "a fit without --data or --free",
            "--data and --free",
            "--data decay.csv --free 'arm.inertia' --free 'pivot.damping'",
        )
    check_run(output, case, "-o fit.nc")
    check_file(case_output, case, "--write fitted.toml")
    check_folder(plot, "--plot figures")
    read, silent = read_case(case, list(change or [])), quiet or as_json
    fitted = compute(
        read,
        data,
        ranges_by_parameter(read.mechanism, free),
        segment=_segment(segment),
        deviations=_deviations(read, deviation or []),
        jump=jump,
        starts=starts,
        progress=None if silent or not sys.stderr.isatty() else lambda line: print(line, file=sys.stderr),
    )
    predicted = _predicted(fitted, held_out, segment) if held_out else None
    if output is not None:
        from scissordyn.record.store import save

        save(fitted, output)
    if case_output is not None:
        write_case(read_configuration(fitted).build_mechanism(), case_output, run=read.run)
    if as_json:
        print_json(_record(fitted, predicted))
    elif not quiet:
        _show(fitted, predicted)
    pictures = [] if plot is None else _draw(fitted, plot)
    if pictures and not silent:
        print(*pictures, sep="\n")
    if fitted.attrs["status"] != "complete":
        print(f"scissordyn: {printable(fitted.attrs['cause'])}", file=sys.stderr)
        return UNFINISHED
    return DONE


def _draw(fitted: xr.Dataset, folder: Path) -> list[Path]:
    from scissordyn.plot.file import write
    from scissordyn.plot.fit import fit_correlation, fit_curves

    folder.mkdir(parents=True, exist_ok=True)
    pictures = {"fit": fit_curves(fitted), "correlation": fit_correlation(fitted)}
    return [write(axes, folder / f"{name}.png") for name, axes in pictures.items()]


def ranges_by_parameter(mechanism: Mechanism, free: list[str]) -> dict[str, str | None]:
    """Read ranges by parameter from ``PARAMETER`` or ``PARAMETER=RANGE``."""
    from scissordyn.model.parameter_path import find

    ranges: dict[str, str | None] = {}
    for text in free:
        path, values = text.strip(), ""
        if "=" in text:
            try:
                find(mechanism, path)  # a parameter without a range, whose name contains an equals sign
            except InputError:
                path, _, values = split_values(text)
        if not path:
            raise InputError(f"--free {text!r}: no parameter before the equals sign", "PARAMETER=RANGE", "--free 'arm.inertia'")
        if path in ranges:
            raise InputError(f"--free {text!r}: the parameter is given twice", "each parameter once", "--free 'arm.inertia'")
        ranges[path] = values.strip() or None
    return ranges


def _segment(text: str | None) -> float | None:
    """Read the duration of a segment [s]."""
    if text is None:
        return None
    return math.inf if text == "whole" else read_quantity(text, Quantity("s", above=0.0), "--segment '1 s'")


def _deviations(read: Case, texts: list[str]) -> dict[str, float] | None:
    from scissordyn.identification.fit import units_by_heading

    units, deviations = units_by_heading(read.mechanism, read.run) if texts else {}, dict[str, float]()
    for text in texts:
        heading, equals, value = text.rpartition("=")
        heading = heading.strip()
        if not equals or heading not in units:
            near = did_you_mean(heading, units)
            raise InputError(f"--deviation {text!r}{near}", "a measured column, = and a value with its unit")
        quantity, sample = Quantity(units[heading], above=0.0), f"--deviation '{heading}=1 {units[heading]}'"
        deviations[heading] = read_quantity(float(value) if quantity.unit == "1" else value, quantity, sample)
    return deviations or None


def _predicted(fitted: xr.Dataset, files: list[Path], segment: str | None) -> xr.Dataset:
    from scissordyn.casefile.configuration import read_configuration
    from scissordyn.config.fits import read_measured
    from scissordyn.identification.fit import units_by_heading
    from scissordyn.identification.prediction import prediction

    configuration = read_configuration(fitted)
    mechanism, options = configuration.build_mechanism(), configuration.options
    assert options is not None
    units = units_by_heading(mechanism, options)
    return prediction(mechanism, options, [read_measured(path, units) for path in files], segment=_segment(segment))


def _show(fitted: xr.Dataset, predicted: xr.Dataset | None) -> None:
    rows = []
    for name, of in _numbers(fitted).items():
        interval = f"{of['low']:.5g} .. {of['high']:.5g}" if math.isfinite(of["standard_error"]) else "not determined"
        rows.append((name, f"{of['start_value']:.5g}", f"{of['value']:.6g}", interval, of["unit"]))
    numbers = dict.fromkeys(("start", "fitted", "95 % interval"), "numbers")
    print_table({"parameter": "text", **numbers, "unit": "text"}, rows)
    curves = {"rms of residuals": fitted} | ({} if predicted is None else {"rms of prediction": predicted})
    headings = zip(fitted["column"].values.astype(str), fitted["column_unit"].values.astype(str), strict=True)
    rows = [
        (name, *(cell(float(part["rms"].values[k]), unit) for part in curves.values()))
        for k, (name, unit) in enumerate(headings)
    ]
    print_table({"measured": "text", **dict.fromkeys(curves, "number")}, rows)
    statistics = json.loads(fitted.attrs["statistics"])
    say(f"{counted(int(statistics['runs']), 'run')} in {statistics['seconds']:.1f} s")
    say(*(f"Warning: {line}" for line in json.loads(fitted.attrs["warnings"])))


def _numbers(fitted: xr.Dataset) -> Any:
    """Return start value, value, error, interval and unit of each fitted parameter, in SI units, by its path."""
    names = ["start_value", "value", "standard_error", "low", "high", "unit"]
    return fitted[names].to_dataframe()[names].to_dict("index")


def _record(fitted: xr.Dataset, predicted: xr.Dataset | None) -> dict[str, object]:
    """Return the fit as a dictionary for JSON, in SI units."""
    rms = {"rms": fitted} | ({} if predicted is None else {"prediction_rms": predicted})
    return {
        "status": fitted.attrs["status"],
        "numbers": _numbers(fitted),
        "warnings": json.loads(fitted.attrs["warnings"]),
        **json.loads(fitted.attrs["statistics"]),
        **{name: part["rms"].to_series().to_dict() for name, part in rms.items()},
    }
