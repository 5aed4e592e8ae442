"""The Dataset of a bifurcation diagram: empty, from a file, and filled value by value."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Hashable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from scissordyn.errors import InputError
from scissordyn.file.provenance import provenance
from scissordyn.kinematics.branching import drive_warnings
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.parameter_path import number
from scissordyn.model.record import to_plain
from scissordyn.periodic.cycles import recorded
from scissordyn.periodic.rows import PENDING, CycleCase, CycleRow, coordinates, enter, status_columns
from scissordyn.periodic.stroboscope import start_state
from scissordyn.plan.plan import plan
from scissordyn.run.advance.driver import Snapshot
from scissordyn.run.configuration import read_configuration, write_configuration
from scissordyn.run.engine import Outcome
from scissordyn.run.store import load
from scissordyn.study.answer.fact import grouped_lines

TITLE = "scissordyn bifurcation"


class OtherDiagramError(InputError):
    """A store holds anything but this diagram, made by these sources and libraries."""


def empty_diagram(
    mechanism: Mechanism,
    over: str | Callable[[float], Mechanism],
    numbers: list[float],
    cases: Sequence[CycleCase],
    follow: bool,
    shown: tuple[str, float] | None = None,
) -> xr.Dataset:
    """A diagram without results."""
    first = cases[0]
    if isinstance(over, str):
        quantity = number(mechanism, over).quantity
        assert quantity is not None
        units, long_name, name = quantity.unit, quantity.help or over, over
    else:
        units, long_name, name = "1", "parameter", getattr(over, "__name__", "function")
    about: dict[Hashable, Any] = {"units": units, "long_name": long_name}
    about |= {"shown_unit": shown[0], "shown_scale": shown[1]} if shown else {}
    identity = [
        {"mechanism": to_plain(case.mechanism), "options": to_plain(case.options), "phase": case.phase} for case in cases
    ]
    made_with = json.loads(provenance())
    diagram = {
        "over": name,
        "cycles": first.cycles,
        "keep": first.keep,
        "follow": follow,
        "cases": hashlib.sha256(json.dumps(identity).encode()).hexdigest(),
        **made_with,
    }
    return xr.Dataset(
        status_columns("value", len(cases)),
        coords={
            "value": ("value", np.array(numbers), about),
            **coordinates(first),
            "period": ("value", np.array([case.options.until for case in cases]), {"units": "s", "long_name": "period"}),
        },
        attrs={
            "title": TITLE,
            "status": PENDING,
            "parameter": name,
            "phase": first.phase,
            "cycles": first.cycles,
            "versions": json.dumps({name: value for name, value in made_with.items() if name != "sources"}),
            "warnings": json.dumps(_warnings(cases, [_said(name, value, about) for value in numbers])),
            "configuration": write_configuration(mechanism, diagram=diagram),
        },
    )


def _said(name: object, value: float, about: Mapping[Hashable, Any]) -> str:
    """A value of the parameter, for messages: in the unit in which it was asked for, or in SI."""
    unit, scale = about.get("shown_unit", about["units"]), about.get("shown_scale", 1.0)
    return f"{name} = {value / scale:g}" + ("" if unit == "1" else f" {unit}")


def _warnings(cases: Sequence[CycleCase], values: list[str]) -> list[str]:
    """Singular positions that the drives lead through; those of some values only with the first of these values."""
    first: dict[str, str] = {}
    count: dict[str, int] = {}
    grouped: dict[str, list[str]] = {}
    for case, value in zip(cases, values, strict=True):
        key = json.dumps([to_plain(case.mechanism.ideal()), case.options.until])
        if key not in grouped:
            grouped[key] = drive_warnings(plan(case.mechanism), case.options.until)
        for text in grouped[key]:
            first.setdefault(text, value)
            count[text] = count.get(text, 0) + 1
    return [text if count[text] == len(cases) else f"{value}: {text}" for text, value in first.items()]


def diagram_from(target: Path | None, blank: xr.Dataset, mechanism: Mechanism) -> xr.Dataset:
    """What a file already holds of a diagram; the diagram without results if there is no file."""
    if target is None or not target.exists():
        return blank
    try:
        stored = load(target)
        wanted, there = read_configuration(blank), read_configuration(stored)
    except InputError as error:
        raise OtherDiagramError(error.what, error.allowed, error.type_this) from None
    differs = [key for key, value in wanted.diagram.items() if there.diagram.get(key) != value]
    differs += ["mechanism"] if wanted.mechanism_text != there.mechanism_text else []
    differs += [
        str(name)
        for name, variable in blank.variables.items()
        if name not in stored.variables or stored.variables[name].shape != variable.shape
    ]
    if not differs and not np.array_equal(blank["value"].values, stored["value"].values):
        differs = ["values"]
    if not differs:
        states = {str(state) for state in stored["status"].values}
        begun = "complete" in states
        differs = [name for name in (*recorded(mechanism), "end") if begun and "value" not in _dims(stored, name)]
        differs += ["status"] if states - {PENDING, "complete", "failed", "interrupted"} else []
    if differs:
        raise OtherDiagramError(
            f"'{target}' holds another diagram (differs in {', '.join(differs)})",
            "the file of the same diagram, or a name that is not taken",
            "store='another.nc'",
        )
    stored["value"].attrs = blank["value"].attrs
    stored.attrs |= {name: value for name, value in blank.attrs.items() if name != "status"}
    for name in ("status", "cause", "warnings"):
        stored[name] = stored[name].astype(object)
    return stored


def _dims(stored: xr.Dataset, name: str) -> tuple[object, ...]:
    return stored[name].dims if name in stored else ()


def enter_value(diagram: xr.Dataset, outcome: Outcome[CycleCase, CycleRow]) -> None:
    """Write one value's results into the diagram, with the state at the end, from which it can be followed."""
    enter(diagram, "value", outcome)
    if outcome.value is None:
        return
    end = outcome.value.end
    packed = np.concatenate([end.y, end.mode, end.arrays["memory"], end.arrays["reference"]])
    if "end" not in diagram:
        about = {"long_name": "state, modes, approach speeds and angles at the end, each in its SI unit"}
        diagram["end"] = (("value", "entry"), np.full((diagram.sizes["value"], packed.size), np.nan), about)
    if packed.size == diagram.sizes["entry"]:  # a function may give mechanisms of different sizes
        diagram["end"].values[outcome.task.at] = packed


def final_state(diagram: xr.Dataset, at: int, mechanism: Mechanism) -> Snapshot:
    """The state at the end of a value, from what is stored of it."""
    begin, packed = start_state(mechanism), diagram["end"].values[at]
    guards, first = begin.mode.size, begin.y.size
    y, mode, memory, reference = np.split(packed, [first, first + guards, first + 2 * guards])
    return begin.changed(y=y, mode=mode.astype(np.int64), memory=memory, reference=reference)


def conclude(diagram: xr.Dataset, interrupted: bool, seconds: float) -> None:
    """Enter the status of the whole, its warnings, and how long it took."""
    status = diagram["status"].values
    worked = float(diagram["processor_seconds"].sum())
    failed = int(np.sum(status == "failed"))
    diagram.attrs |= {
        "status": "interrupted" if interrupted else ("failed" if failed == status.size else "complete"),
        "failed_values": failed,
        "cycles_per_second": float(diagram["completed_cycles"].sum()) / worked if worked > 0.0 else 0.0,
        "wall_seconds": seconds,
        "warnings": json.dumps([*json.loads(diagram.attrs["warnings"]), *_of_values(diagram)]),
    }


def _of_values(diagram: xr.Dataset) -> list[str]:
    """The warnings about single values, each once with the first value that has it."""
    values, warnings = diagram["value"].values, []
    for text, at in grouped_lines(diagram["warnings"].values).items():
        others = f", the first of {len(at)} values" if len(at) > 1 else ""
        warnings.append(f"{_said(diagram.attrs['parameter'], values[at[0]], diagram['value'].attrs)}{others}: {text}")
    return warnings
