"""Command ``compare``: compare two saved runs, or a run with measured curves."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from scissordyn.casefile.quantity import rounded_text
from scissordyn.cli.option import PictureFormat, SavedRun, read_run
from scissordyn.cli.output import ROWS_MAX, check_folder, print_table, say
from scissordyn.cli.parameter import Argument, Option
from scissordyn.units import cell

if TYPE_CHECKING:
    import xarray as xr


LAST_VALUES = {
    "position at the end": (("slider_position",), "m"),
    "work of drives, motors and actuators": (("drive_work", "motor_work"), "J"),
    "work of forces and torques": (("load_work",), "J"),
    "dissipated energy": (("dissipated_energy",), "J"),
}
"""Values at the end of both runs that `compare` prints: text, variables whose sum it is, and unit."""

SHOWN_IF_NONZERO = "work of forces and torques"  # text of the row in `LAST_VALUES` that is left out if it is zero


def compare(
    run: SavedRun,
    other: Annotated[Path, Argument(help="Another saved run, or measured curves as CSV: 'time [s], angle of arm [deg]'.")],
    output: Annotated[
        Path | None, Option("-o", "--output", "--plot", metavar="DIR", help="Draw pictures of both into this folder.")
    ] = None,
    form: PictureFormat = "png",
) -> int:
    from scissordyn.plot.file import check_format, write

    check_format(form)
    check_folder(output, "-o figures")
    first = read_run(run)
    if other.suffix.lower() == ".csv":
        from scissordyn.plot.fit import agreement_curves as draw_agreement

        name, compared = "agreement", _print_agreement(first, other)
        drawn = None if output is None else draw_agreement(compared)
    else:
        from scissordyn.plot.over_time import comparison

        second = read_run(other)
        labels = (run.stem, other.stem) if run.stem != other.stem else (str(run), str(other))
        _print_comparison(first, second, labels)
        name, drawn = "comparison", None if output is None else comparison(first, second, labels=labels)
    if output is not None and drawn is not None:
        output.mkdir(parents=True, exist_ok=True)
        say(write(drawn, output / f"{name}.{form}"))
    return 0


def _print_comparison(first: xr.Dataset, second: xr.Dataset, labels: tuple[str, str]) -> None:
    from scissordyn.casefile.configuration import read_configuration
    from scissordyn.file.run_check import check_names
    from scissordyn.record.sampling import check_whole

    described = [read_configuration(run) for run in (first, second)]
    for run, configuration in zip((first, second), described, strict=True):
        check_names(run, configuration.mechanism)
        check_whole(run, configuration.options, "comparison")
    entries = list(differences(described[0], described[1]))
    if entries:
        print_table([("entry", "text"), *((label, "numbers") for label in labels)], entries[:ROWS_MAX])
    else:
        say("Both runs are of the same case.")
    if len(entries) > ROWS_MAX:
        say(f"... and {len(entries) - ROWS_MAX} more entries differ")
    others, rows = measures(second), []
    for name, (value, unit) in measures(first).items():
        if name in others:
            sizes = value, others[name][0]
            rows.append([name, *(cell(size, unit) if unit else f"{size:g}" for size in sizes), change(*sizes)])
    print_table([("quantity", "text"), *((label, "number") for label in labels), ("change", "number")], rows)
    hard = [label for label, run in zip(labels, (first, second), strict=True) if "peak_force_estimate" in run]
    if hard:
        say(f"Hard contact in {' and '.join(hard)}: largest forces are estimates, driving torques leave impacts out.")


def _print_agreement(run: xr.Dataset, path: Path) -> xr.Dataset:
    """Print measures of agreement of a run with measured curves."""
    from scissordyn.analysis.agreement import agreement
    from scissordyn.config.fits import read_measured
    from scissordyn.file.export import time_columns

    compared = agreement(run, read_measured(path, {column.heading: column.unit for column in time_columns(run)}))
    time = compared["time"].values
    say(f"Compared at {time.size} instants from {time[0]:.6g} s to {time[-1]:.6g} s")
    if compared.attrs["left_out"]:
        say(f"{compared.attrs['left_out']} measured instants are outside the time of the run")
    for k, heading in enumerate(compared["column"].values.astype(str)):
        here = {str(name): values.item() for name, values in compared.isel(column=k).items() if not values.dims}
        unit = here["column_unit"]
        counts = ", ".join(f"{here[name]:.0f}" for name in ("events", "run_events", "matched_events"))
        rows = [
            ("root mean square error", cell(here["rmse"], unit)),
            ("root mean square error / measured range", f"{100.0 * here['nrmse']:.3g} %"),
            ("mean of run less measured", cell(here["bias"], unit)),
            ("correlation", cell(here["correlation"], "1")),
            ("explained variance", cell(here["explained"], "1")),
            (
                "largest value, run against measured",
                f"{100.0 * here['peak_error']:+.3g} %, {cell(here['peak_lag'], 's')} later",
            ),
            ("events measured, of the run, matched", counts),
            (
                "time of matched events, run less measured",
                f"{cell(here['event_lag'], 's')}, rms {cell(here['event_deviation'], 's')}",
            ),
        ]
        print_table({heading: "text", "agreement": "number"}, rows)
    return compared


def change(value: float, other: float, large: float = 10.0) -> str:
    """Return the change from one value to another: in percent, or as a factor if it is large.

    `large`: ratio of `other` to `value` from which the change is a factor.
    """
    if not value:
        return "0 %" if other == value else "-"
    ratio = other / value
    return f"{float(f'{ratio:.3g}'):g} times" if ratio >= large else f"{100.0 * (other - value) / abs(value):+.3g} %"


def measures(run: xr.Dataset) -> dict[str, tuple[float, str]]:
    """Return the compared results of a run by name, each with its unit; the only drive or actuator has no name."""
    from scissordyn.record.joint_force import clearance_joints, joint_summaries
    from scissordyn.record.summary import summary_of

    figures: dict[str, tuple[float, str]] = {"end": (float(run.attrs["end"]), "s")}
    summary = summary_of(run)
    figures |= {f"largest deviation of {point.name}": (point.deviation, "m") for point in summary.points}
    for answer in summary.actuators:
        quantity = "largest torque" if answer.unit == "N m" else "largest driving force"
        figures[quantity if len(summary.actuators) == 1 else f"{quantity} of {answer.name}"] = (answer.torque, answer.unit)
    figures = {name: (value, unit) for name, (value, unit) in figures.items() if math.isfinite(value)}
    for name, (variables, unit) in LAST_VALUES.items():
        lasts = [float(run[variable].values[-1]) for variable in variables if variable in run]
        if lasts and math.isfinite(last := sum(lasts)) and (last or name != SHOWN_IF_NONZERO):
            figures[name] = (last, unit)
    joints = {joint.name: joint for joint in joint_summaries(run)} if "contact_joint" in run else {}
    for name in clearance_joints(run):
        joint = joints.get(name)
        figures[f"contacts at {name}"] = (float(joint.contacts) if joint else 0.0, "")
        figures[f"fraction of time in contact at {name}"] = (joint.fraction if joint else 0.0, "1")
        if joint and math.isfinite(joint.largest):
            figures[f"largest force at {name}"] = (joint.largest, "N")
    return figures


def differences(first: Any, second: Any, place: str = "", unit: str = "") -> Iterator[tuple[str, str, str]]:
    """Yield parameter path and both values, as texts, for each entry in which two mechanisms or options differ."""
    both = [None if parts is None else list(parts) for parts in (_parts(first, unit), _parts(second, unit))]
    left, right = ({name: (value, of) for name, value, of in parts or ()} for parts in both)
    of_other_kind = type(first) is not type(second)
    if None in both or of_other_kind or (isinstance(first, tuple) and len(first) != len(second)):
        if first != second:
            yield place, *_texts(first, second, unit)
        return
    for name in dict.fromkeys((*left, *right)):
        (value, of), (other, _) = left.get(name, (None, "")), right.get(name, (None, ""))
        yield from differences(value, other, f"{place}.{name}" if place else name, of)


def _parts(value: Any, unit: str) -> Iterable[tuple[str, Any, str]] | None:
    """Return name, value and unit of each field or item of a value; None for a value without parts."""
    from scissordyn.casefile.configuration import Configuration
    from scissordyn.model.walk import declared

    if isinstance(value, Mapping):
        return ((str(key), part, unit) for key, part in value.items())
    if isinstance(value, tuple):
        return ((str(getattr(part, "name", None) or k), part, unit) for k, part in enumerate(value))
    kind = type(value)
    if not dataclasses.is_dataclass(kind):
        return None
    return (
        (name, getattr(value, name), field.quantity.unit if field.quantity is not None else "")
        for name, field in declared(kind).items()
        if (kind, name) != (Configuration, "text")
    )


def _texts(first: Any, second: Any, unit: str) -> tuple[str, str]:
    """Return two values as texts with enough digits to distinguish them."""
    for digits in (6, 12, 17):
        texts = _short(first, unit, digits), _short(second, unit, digits)
        if texts[0] != texts[1]:
            break
    return texts


def _short(value: Any, unit: str, digits: int) -> str:
    if isinstance(value, float) and unit and digits < 17:
        number, _, named = rounded_text(float(f"{value:.{digits}g}"), unit).partition(" ")
        return f"{float(number):.{digits}g} {named}".rstrip()
    if isinstance(value, float):
        return f"{value:.{digits}g} {unit if unit != '1' else ''}".rstrip()
    if isinstance(value, tuple | Mapping):
        return "1 entry" if len(value) == 1 else f"{len(value)} entries"
    if dataclasses.is_dataclass(type(value)):
        return str(type(value).__name__)
    return "-" if value is None else str(value)
