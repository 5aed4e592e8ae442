"""Print a run: summary, table of contacts and warnings, or JSON data."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from scissordyn.cli.output import ROWS_MAX, console, print_table
from scissordyn.components.catalogue import COMPONENTS
from scissordyn.model.mechanism import Mechanism
from scissordyn.numeral import PREFIXES, numerals, prefix
from scissordyn.record.joint_force import JointSummary, estimate_in_words, joint_summaries, kinds_left_out, parts_of_oiled
from scissordyn.record.results import Run
from scissordyn.record.summary import summary_of
from scissordyn.record.warn import EXPLANATION_PREFIX, largest_energy_change, warning_lines, warnings_of
from scissordyn.units import counted, short
from scissordyn.warning import NAMES_MAX

CONTACT_COLUMNS = (
    ("start", "contact_start", "s", 1.0),
    ("approach", "approach_speed", "m/s", 1.0),
    ("angle of n", "contact_angle", "deg", 180.0 / math.pi),
    ("impulse", "impulse", "N s", 1.0),
    ("peak force", "peak_force", "N", 1.0),
    ("to peak", "peak_time", "s", 1.0),
    ("duration", "contact_duration", "s", 1.0),
    ("rebound", "rebound_speed", "m/s", 1.0),
)
"""Columns of the printed table of contacts: heading, variable, unit, and factor from the SI unit."""

SPARE_COLUMNS = ("to peak", "angle of n", "rebound", "approach", "duration")
"""Columns of the table of contacts that a narrow terminal leaves out, in this order."""


def column(values: np.ndarray, unit: str, digits: int = 5) -> tuple[str, list[str]]:
    """Return the unit of a column with a suitable prefix, and the values as texts in that unit."""
    finite = np.abs(values[np.isfinite(values)])
    largest = float(finite.max()) if finite.size else 0.0
    power = prefix(largest) if unit.isalpha() and unit != "deg" else 0
    return PREFIXES[power] + unit, numerals((values / 10.0**power).tolist(), digits)


def show_run(run: Run, rows: int, mechanism: Mechanism | None = None, to: Console | None = None) -> None:
    """Print the summary of a run, a table of its first `rows` contacts, statistics and warnings."""
    to = to or console()
    for line in summary_of(run).lines:
        to.print(line)
    if rows > 0 and run.sizes["contact"]:
        _show_contacts(run, rows, to)
    _show_summary(run, mechanism, to)


def _show_contacts(run: Run, rows: int, to: Console) -> None:
    contacts, left_out = run.sizes["contact"], kinds_left_out(run)
    joints = run["contact_joint"].values[:rows].tolist()
    columns = {"contact": list(map(str, range(1, len(joints) + 1))), "joint": joints}
    for title, name, unit, factor in CONTACT_COLUMNS:
        if name not in left_out:
            unit, texts = column(run[name].values[:rows] * factor, unit)
            columns[f"{title}\n[{unit}]"] = texts
    spare = [head for title in SPARE_COLUMNS for head in columns if head.startswith(f"{title}\n")]
    left = print_table(_looks(columns), zip(*columns.values(), strict=True), spare=spare, to=to)
    if left:
        to.print(f"Left out at this width: {', '.join(left)}.")
    if contacts > rows:
        to.print(f"... and {counted(contacts - rows, 'more contact')} (--events {contacts} shows all)\n")


def _looks(columns: Iterable[str]) -> dict[str, str]:
    return {head: "long name" if head == "joint" else "number" for head in columns}


def _locked_and_stopped(run: Run) -> list[str]:
    """Return sentences about latches that locked and end stops that were hit."""
    if "event_kind" not in run:
        return []
    locked: list[str] = []
    reached: dict[str, list[float]] = {}
    events = (run[f"event_{column}"].values.tolist() for column in ("name", "kind", "time", "loss"))
    for name, kind, when, loss in zip(*events, strict=True):
        if kind == "locked":
            locked.append(f"Latch {name} locked at {short(when, 's')}, with a loss of {short(loss, 'J')}.")
        elif kind == "reached":
            reached.setdefault(name, []).append(when)
    kinds = {
        name: kind.declaration.label
        for section, kind in COMPONENTS.items()
        if "gap" in kind.declaration.kernels and section in run
        for name in run[section].values.astype(str).tolist()
    }
    named = ((f"{kinds.get(name, 'end stop').capitalize()} {name}", times) for name, times in reached.items())
    return locked + [
        f"{name} was reached {counted(len(times), 'time')}, first at {short(times[0], 's')}." for name, times in named
    ]


def _show_joints(joints: Sequence[JointSummary], to: Console) -> None:
    """Print a table of joints with their contacts, ordered by largest force."""
    ordered = sorted(joints, key=lambda joint: (math.isnan(joint.largest), -joint.largest))[:ROWS_MAX]
    force, largest = column(np.array([joint.largest for joint in ordered]), "N")
    time, when = column(np.array([joint.when for joint in ordered]), "s")
    columns = {
        "contacts": [str(joint.contacts) for joint in ordered],
        "joint": [joint.name for joint in ordered],
        "in contact\n[%]": numerals((100.0 * joint.fraction for joint in ordered), 3),
        f"largest force\n[{force}]": largest,
        f"at\n[{time}]": when,
    }
    print_table(_looks(columns), zip(*columns.values(), strict=True), to=to)
    if len(joints) > ROWS_MAX:
        to.print(f"... and {counted(len(joints) - ROWS_MAX, 'more joint')} with smaller forces\n")


def _largest(joint: JointSummary) -> str:
    if math.isnan(joint.largest):
        return "no largest force, as contact is hard"
    estimated = f", {estimate_in_words(joint.largest, joint.least)}" if joint.estimated else ""
    parts = parts_of_oiled(joint.metal, joint.film)
    return f"largest force {short(joint.largest, 'N')} at {short(joint.when, 's')}{parts}{estimated}"


def _show_summary(run: Run, mechanism: Mechanism | None, to: Console) -> None:
    """Print a paragraph about the run, then its warnings: similar ones in one line, with explanations."""
    attributes = run.attrs
    statistics = json.loads(attributes["statistics"])
    end = float(attributes["end"])
    parts = [
        f"{short(end, 's')} simulated in {short(statistics['seconds'], 's')}: {statistics['steps']} steps of "
        f"{statistics['method']}, {statistics['rejected']} rejected."
    ]
    joints = joint_summaries(run)
    if len(joints) > NAMES_MAX:
        _show_joints(joints, to)
    else:
        parts += [
            f"Joint {joint.name}: {counted(joint.contacts)}, in contact {100.0 * joint.fraction:.3g} % of the time, "
            f"{_largest(joint)}."
            for joint in joints
        ]
    parts += _locked_and_stopped(run)
    if run.sizes["time"]:
        residual = float(np.abs(run["energy_residual"].values).max())
        turned_over = largest_energy_change(run)
        closes = short(residual, "J")
        relative = f", {residual / turned_over:.1e} of the converted energy" if turned_over > 0.0 and closes != "0 J" else ""
        parts.append(f"The energy balance closes to {closes}{relative}.")
    to.print(" ".join(parts))
    for text in warning_texts(run, mechanism):
        to.print(text)


def warning_texts(run: Run, mechanism: Mechanism | None = None) -> list[str]:
    """Return the lines that show the warnings of a run, or of a wear result."""
    lines = warning_lines(warnings_of(run), mechanism)
    return [f"  {line}" if line.startswith(EXPLANATION_PREFIX) else f"Warning: {line}" for line in lines]


def warning_record(run: Run) -> dict[str, Any]:
    """Return the warnings of a run, or of a wear result, for JSON."""
    return {
        "warnings": json.loads(run.attrs["warnings"]),
        "warnings_in_short": warning_lines(warnings_of(run)),
        "warning_data": [item.data for item in warnings_of(run)],
    }


def run_record(run: Run, files: Sequence[Path | str] = ()) -> dict[str, Any]:
    """Return the results of a run as a dictionary for JSON, in SI units."""
    return {
        "status": run.attrs["status"],
        "cause": run.attrs["cause"],
        "end": float(run.attrs["end"]),
        "statistics": json.loads(run.attrs["statistics"]),
        "summary": summary_of(run).plain(),
        "joints": [joint.plain() for joint in joint_summaries(run)],
        "energy_residual": float(np.abs(run["energy_residual"].values).max()) if run.sizes["time"] else None,
        "trusted_until": float(run.attrs.get("trusted_until", math.nan)),
        **warning_record(run),
        "files": [str(path) for path in files],
    }
