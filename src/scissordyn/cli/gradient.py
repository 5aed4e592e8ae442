"""Command ``gradient``: derivatives of measures of a run by parameters of the case."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from scissordyn.cli.option import AsJson, CaseFile, Changes, read_option
from scissordyn.cli.output import DONE, check_picture, check_run, print_json, print_table, say
from scissordyn.cli.parameter import Option
from scissordyn.errors import InputError
from scissordyn.units import counted, short

if TYPE_CHECKING:
    import xarray as xr

OPTIONS_EXAMPLE = "--of 'A.peak_force' --by 'A.clearance'"  # Correct options of `gradient`, which error texts show

# Warning if the case of a gradient has a step size
STEP_WARNING = "the step of the case is not used: values and derivatives are those of a run with error control"


def gradient(
    case: CaseFile,
    of: Annotated[
        list[str] | None, Option("--of", metavar="MEASURE", help="A measure, as in a requirement: 'A.peak_force'. Repeatable.")
    ] = None,
    by: Annotated[
        list[str] | None,
        Option(
            "--by",
            metavar="PARAMETER",
            help="A parameter, such as 'A.clearance'; by default all that affect the run. Repeatable.",
        ),
    ] = None,
    until: Annotated[str | None, Option(metavar="TIME", help="End of the run; by default that of the case.")] = None,
    output: Annotated[
        Path | None, Option("-o", "--output", metavar="FILE", help="Save the derivatives to this NetCDF file.")
    ] = None,
    plot: Annotated[
        Path | None, Option(metavar="FILE", help="Draw a bar chart of elasticities to this .svg or .png file.")
    ] = None,
    change: Changes = None,
    as_json: AsJson = False,
) -> int:
    from scissordyn.config.file import read_case
    from scissordyn.sensitivity.gradient import exact_options, ignores_step
    from scissordyn.sensitivity.gradient import gradient as compute

    if not of:
        raise InputError("a gradient without a measure", "--of and a measure", OPTIONS_EXAMPLE)
    check_run(output, case, "-o gradient.nc")
    check_picture(plot, case, "gradient.png")
    read, last = read_case(case, change or []), read_option(until, "--until")
    exact, has_ignored_step = exact_options(read.run), ignores_step(read.mechanism, read.run)
    derivatives = compute(
        read.mechanism,
        of=of,
        by=by or None,
        until=read.run.until if last is None else last,
        start=read.run.start,
        rtol=exact.rtol,
        atol=exact.atol,
        method=exact.method,
        most_steps=exact.most_steps,
        step=None if has_ignored_step else read.run.step,
    )
    if has_ignored_step:
        warnings = [*json.loads(derivatives.attrs["warnings"]), STEP_WARNING]
        derivatives.attrs["warnings"] = json.dumps(warnings)
    if as_json:
        print_json(_record(derivatives))
    else:
        _show(derivatives)
    if output is not None:
        from scissordyn.record.store import save

        say(save(derivatives, output))
    if plot is not None:
        from scissordyn.plot.file import write
        from scissordyn.plot.gradient import elasticities

        say(write(elasticities(derivatives), plot))
    return DONE


def _show(derivatives: xr.Dataset) -> None:
    """Print a table for each measure, with the parameters in the order of their elasticity."""
    for name in derivatives["measure"].values.tolist():
        here = derivatives.sel(measure=name)
        say(f"{name} = {short(float(here['value']), str(here['unit'].values))}")
        order = abs(here["elasticity"]).fillna(0.0).argsort().values[::-1]
        rows = []
        for k in order.tolist():
            row = here.isel(parameter=k)
            rows.append(
                (
                    str(row["parameter"].values),
                    _value_text(float(row["parameter_value"]), str(row["parameter_unit"].values)),
                    _number(float(row["derivative"]), 6),
                    _number(float(row["elasticity"]), 4),
                    short(float(row["valid_until"]), "s") if str(row["limit"].values) else "",
                )
            )
        heads = {"parameter": "text", "value": "numbers", "derivative (SI)": "numbers", "% per %": "numbers", "until": "text"}
        print_table(heads, rows)
    statistics = json.loads(derivatives.attrs["statistics"])
    say(f"{counted(int(statistics['runs']), 'run')} in {statistics['seconds']:.1f} s")
    left_out = json.loads(derivatives.attrs["left_out"])
    if left_out:
        say(f"{len(left_out)} parameters do not act or cannot change alone")
    say(*(f"Warning: {line}" for line in json.loads(derivatives.attrs["warnings"])))


def _value_text(value: float, unit: str) -> str:
    """Return the value of a parameter with its unit; angles are in degrees."""
    if unit == "rad":
        return f"{math.degrees(value):.4g} deg"
    return f"{value:.4g}" if unit == "1" else short(value, unit)


def _number(value: float, digits: int) -> str:
    """Return a number as text; a dash if the derivative does not exist."""
    return f"{value:.{digits}g}" if math.isfinite(value) else "-"


def _record(derivatives: xr.Dataset) -> dict[str, object]:
    """Return the derivatives as a dictionary for JSON, in SI units."""
    names = [str(name) for name in derivatives["parameter"].values]
    measures = {}
    for name in derivatives["measure"].values.tolist():
        here = derivatives.sel(measure=name)
        measures[str(name)] = {
            "value": float(here["value"]),
            "unit": str(here["unit"].values),
            "derivative": dict(zip(names, here["derivative"].values.tolist(), strict=True)),
            "elasticity": dict(zip(names, here["elasticity"].values.tolist(), strict=True)),
        }
    until = dict(zip(names, derivatives["valid_until"].values.tolist(), strict=True))
    return {"measures": measures, "valid_until": until, "warnings": json.loads(derivatives.attrs["warnings"])}
