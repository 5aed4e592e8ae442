"""Bifurcation diagrams: the asymptotic motion of a periodic run over a parameter."""

from __future__ import annotations

import hashlib
import json
import os
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import numpy as np
import xarray as xr

from scissordyn.errors import InputError
from scissordyn.model.address import number
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.record import to_plain
from scissordyn.simulation.branching import drive_warnings
from scissordyn.simulation.configuration import read_configuration, write_configuration
from scissordyn.simulation.cycles import DESCRIBED, per_cycle, recorded
from scissordyn.simulation.options import Options, StartKind
from scissordyn.simulation.provenance import provenance
from scissordyn.simulation.snapshot import Snapshot
from scissordyn.simulation.store import load, save
from scissordyn.simulation.stroboscope import drive_period, run_cycles, start_state
from scissordyn.study.engine import Engine, EngineError, Outcome, Threads, error_text
from scissordyn.study.follow import carried
from scissordyn.units import Meaning, checked

__all__ = ["OtherDiagramError", "bifurcation"]

TITLE = "scissordyn bifurcation"

PENDING = "pending"
"""Status of a value that has not been computed yet."""

SAVE_EVERY = 10.0
"""Shortest time between two writes of the store [s]: the work that can be lost."""


@dataclass(frozen=True)
class DiagramCase:
    """One value of the parameter, with all inputs of a worker.

    Parameters
    ----------
    at : int
        Its place among the values.
    mechanism : Mechanism
    options : Options
        `until` is the period.
    cycles, keep : int
    phase : float
    start : {"concentric", "in-contact", "static"} or Snapshot
    """

    at: int
    mechanism: Mechanism
    options: Options
    cycles: int
    keep: int
    phase: float
    start: StartKind | Snapshot


@dataclass(frozen=True)
class DiagramRow:
    """The result of one value.

    Parameters
    ----------
    values : dict of ndarray
        The last cycles, by the names of `simulation.cycles.DESCRIBED`; shorter where the run failed.
    done : int
        Whole cycles.
    end : Snapshot
    status, cause : str
    steps, events : int
    seconds, processor_seconds : float
        Of this value, by the clock and of the processor.
    """

    values: dict[str, np.ndarray]
    done: int
    end: Snapshot
    status: str
    cause: str
    steps: int
    events: int
    seconds: float
    processor_seconds: float


class OtherDiagramError(InputError):
    """A store holds anything but this diagram, made by these sources and libraries."""


@checked
def bifurcation(
    mechanism: Mechanism,
    *,
    over: str | Callable[[float], Mechanism],
    values: Sequence[float] | np.ndarray,
    cycles: int = 200,
    keep: int = 100,
    period: float | None = None,
    phase: float = 0.0,
    follow: bool = False,
    start: StartKind = "concentric",
    rtol: float = 1e-6,
    atol: float = 1e-6,
    method: str = "auto",
    most_steps: int = 1_000_000,
    engine: Annotated[Engine | None, Meaning("where the values are computed", "Threads(2)")] = None,
    store: str | os.PathLike[str] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> xr.Dataset:
    """The stroboscopic map of a periodically driven mechanism for many values of a parameter.

    Parameters
    ----------
    mechanism : Mechanism
    over : str or callable
        The varied parameter: "A.clearance", "A.friction.kinetic", "drive.speed", "drive.angular_frequency", "gravity"; see
        `model.address`. Or a function from a value to a mechanism.
    values : sequence of float
        Of the parameter, in SI units, in the order of computation.
    cycles, keep : int
        Number of cycles for each value, and how many of the last are returned.
    period : float, optional
        Of the map [s]; that of each mechanism's drive if not given.
    phase : float
        Phase of the samples in the cycle, in [0, 1).
    follow : bool
        Start each value from the end of the one before, which follows a branch of solutions in the order of the values. The
        values are then computed one by one, here. If false, each value has the start `start`.
    start : {"concentric", "in-contact", "static"}
    rtol, atol : float
    method : str
    most_steps : int
        Of a cycle.
    engine : Engine, optional
        Where the values are computed: threads of this process, one per processor, if not given. The result does not
        depend on it.
    store : path, optional
        A NetCDF file with the results so far, updated during the computation. If it exists, only missing values are computed.
    progress : callable, optional
        Called after each value with the number done and the total.

    Returns
    -------
    Dataset
        Dimensions value, cycle, joint, axis; the coordinate "value" has the parameter's unit. Per value: status
        ("complete", "failed", "interrupted", or "pending" after Ctrl-C), cause, completed_cycles, total_steps, total_events,
        seconds, processor_seconds. Numbers are NaN where a cycle was not reached, and only there. Attributes: status,
        cycles_per_second (of processor time), wall_seconds of this call, parameter, cycles, configuration, warnings (singular
        positions that the drives lead through).

    Raises
    ------
    InputError
        For a parameter, value or option that cannot be used, or a store that belongs to another diagram.
    EngineError
        If the workers of a scheduler are lost; what is done is in the store.
    """
    began = time.perf_counter()
    numbers = _numbers(values, cycles, keep)
    mechanisms = [mechanism.replace(over, value) if isinstance(over, str) else over(value) for value in numbers]
    options = Options(1.0 if period is None else period, start, 2, rtol, atol, method, most_steps)
    cases = _cases(mechanisms, options, period, cycles, keep, phase)
    target = None if store is None else Path(store)
    diagram = _blank(mechanism, over, numbers, cases, follow)
    if target is not None and target.exists():
        diagram = _taken_up(target, diagram, recorded(mechanisms[0]))
    todo = np.flatnonzero(np.isin(diagram["status"].values, (PENDING, "interrupted"))).tolist()
    spread = Threads() if engine is None else engine
    results = _chain(cases, diagram, todo) if follow else spread.each(_row, [cases[at] for at in todo])
    try:
        interrupted = _compute(results, cases, diagram, target, progress)
    except EngineError:
        if target is not None:
            save(diagram, target)
        raise
    _conclude(diagram, interrupted, time.perf_counter() - began)
    if target is not None:
        save(diagram, target)
    return diagram


def _cases(
    mechanisms: Sequence[Mechanism], options: Options, period: float | None, cycles: int, keep: int, phase: float
) -> list[DiagramCase]:
    """A case for each value."""
    if len({tuple(joint.name for joint in one.clearance_joints) for one in mechanisms}) > 1:
        raise InputError("mechanisms with different clearance joints", "the same clearance joints for every value")
    own = [options if period is not None else replace(options, until=drive_period(one)) for one in mechanisms]
    pairs = enumerate(zip(mechanisms, own, strict=True))
    return [DiagramCase(at, one, each, cycles, keep, phase, options.start) for at, (one, each) in pairs]


def _numbers(values: Sequence[float] | np.ndarray, cycles: int, keep: int) -> list[float]:
    """The parameter's values, checked together with the numbers of cycles."""
    numbers = [float(value) for value in values]
    if not numbers or not np.all(np.isfinite(numbers)):
        raise InputError("values that are empty or not finite", "one number or more")
    for name, count, most in (("cycles", cycles, None), ("keep", keep, cycles)):
        if isinstance(count, bool) or not isinstance(count, int) or count < 1 or (most is not None and count > most):
            raise InputError(f"{name} = {count!r}", "a whole number >= 1" + (f" and <= {most}" if most is not None else ""))
    return numbers


def _compute(
    results: Iterator[Outcome[DiagramCase, DiagramRow]],
    cases: Sequence[DiagramCase],
    diagram: xr.Dataset,
    target: Path | None,
    progress: Callable[[int, int], None] | None,
) -> bool:
    """Enter results as they come, and save them now and then; returns whether the user stopped it."""
    saved = time.perf_counter()
    try:
        for result in results:
            _enter(diagram, result)
            if progress is not None:
                progress(int(np.sum(diagram["status"].values != PENDING)), len(cases))
            if target is not None and time.perf_counter() - saved > SAVE_EVERY:
                save(diagram, target)
                saved = time.perf_counter()
    except KeyboardInterrupt:
        return True
    return False


def _row(case: DiagramCase) -> DiagramRow:
    """Compute one value."""
    began, worked = time.perf_counter(), time.thread_time()
    found = run_cycles(case.mechanism, case.options, cycles=case.cycles, phase=case.phase, start=case.start)
    if found.status == "interrupted":
        raise KeyboardInterrupt
    first = case.cycles - case.keep
    values = {name: values[first:] for name, values in per_cycle(case.mechanism, found).items()}
    return DiagramRow(
        values=values,
        done=found.samples.time.size,
        end=found.end,
        status=found.status,
        cause=found.cause,
        steps=int(found.statistics["steps"]),
        events=int(found.statistics["events"]),
        seconds=time.perf_counter() - began,
        processor_seconds=time.thread_time() - worked,
    )


def _chain(cases: Sequence[DiagramCase], diagram: xr.Dataset, todo: list[int]) -> Iterator[Outcome[DiagramCase, DiagramRow]]:
    """All values in order, each from the final state of the one before; from the initial start after a failure."""
    end: Snapshot | None = None
    for index in todo:
        case = cases[index]
        if index and end is None and diagram["status"].values[index - 1] == "complete":
            end = _unpacked(diagram, index - 1, cases[index - 1].mechanism)
        if index and end is not None:
            case = replace(case, start=carried(cases[index - 1].mechanism, end, case.mechanism))
        for result in Threads(1).each(_row, [case]):
            end = result.value.end if result.value is not None and result.value.status == "complete" else None
            yield result


def _blank(
    mechanism: Mechanism,
    over: str | Callable[[float], Mechanism],
    numbers: list[float],
    cases: Sequence[DiagramCase],
    follow: bool,
) -> xr.Dataset:
    """A diagram without results."""
    count, first = len(cases), cases[0]
    if isinstance(over, str):
        quantity = number(mechanism, over).quantity
        assert quantity is not None
        units, long_name, name = quantity.unit, quantity.help or over, over
    else:
        units, long_name, name = "1", "parameter", getattr(over, "__name__", "function")
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
    text = np.full(count, "", dtype=object)
    return xr.Dataset(
        {
            "status": ("value", np.full(count, PENDING, dtype=object), {"long_name": "status"}),
            "cause": ("value", text, {"long_name": "cause if it is not complete"}),
            "completed_cycles": ("value", np.zeros(count, np.int64), {"units": "1", "long_name": "whole cycles"}),
            "total_steps": ("value", np.zeros(count, np.int64), {"units": "1", "long_name": "integration steps"}),
            "total_events": ("value", np.zeros(count, np.int64), {"units": "1", "long_name": "contacts begun and ended"}),
            "seconds": ("value", np.zeros(count), {"units": "s", "long_name": "time taken"}),
            "processor_seconds": ("value", np.zeros(count), {"units": "s", "long_name": "time of the processor taken"}),
        },
        coords={
            "value": ("value", np.array(numbers), {"units": units, "long_name": long_name}),
            "cycle": ("cycle", np.arange(first.cycles - first.keep, first.cycles), {"long_name": "cycle"}),
            "joint": ("joint", np.array([joint.name for joint in first.mechanism.contacts], dtype=object)),
            "axis": ("axis", np.array(["x", "y"], dtype=object)),
            "period": ("value", np.array([case.options.until for case in cases]), {"units": "s", "long_name": "period"}),
        },
        attrs={
            "title": TITLE,
            "status": PENDING,
            "parameter": name,
            "phase": first.phase,
            "cycles": first.cycles,
            "versions": json.dumps({name: value for name, value in made_with.items() if name != "sources"}),
            "warnings": json.dumps(_warnings(cases, numbers, name)),
            "configuration": write_configuration(mechanism, diagram=diagram),
        },
    )


def _warnings(cases: Sequence[DiagramCase], numbers: list[float], name: str) -> list[str]:
    """Singular positions that the drives lead through; those of some values only with the first of these values."""
    first: dict[str, float] = {}
    count: dict[str, int] = {}
    known: dict[str, list[str]] = {}
    for case, value in zip(cases, numbers, strict=True):
        key = json.dumps([to_plain(case.mechanism.ideal()), case.options.until])
        if key not in known:
            known[key] = drive_warnings(case.mechanism, case.options.until)
        for text in known[key]:
            first.setdefault(text, value)
            count[text] = count.get(text, 0) + 1
    return [text if count[text] == len(cases) else f"{name} = {value:g}: {text}" for text, value in first.items()]


def _taken_up(target: Path, blank: xr.Dataset, recorded_names: tuple[str, ...]) -> xr.Dataset:
    """What a store already holds, if it is this diagram and whole."""
    try:
        stored = load(target)
        wanted, there = read_configuration(blank), read_configuration(stored)
    except InputError as error:
        raise OtherDiagramError(error.what, error.allowed, error.type_this) from None
    differs = [key for key, value in wanted.diagram.items() if there.diagram.get(key) != value]
    differs += ["mechanism"] if wanted.plain != there.plain else []
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
        differs = [name for name in (*recorded_names, "end") if begun and "value" not in _dims(stored, name)]
        differs += ["status"] if states - {PENDING, "complete", "failed", "interrupted"} else []
    if differs:
        raise OtherDiagramError(
            f"'{target}' holds another diagram (differs in {', '.join(differs)})",
            "the file of the same diagram, or a name that is not taken",
            "store='another.nc'",
        )
    stored.attrs |= {name: value for name, value in blank.attrs.items() if name != "status"}
    for name in ("status", "cause"):
        stored[name] = stored[name].astype(object)
    return stored


def _dims(stored: xr.Dataset, name: str) -> tuple[object, ...]:
    return stored[name].dims if name in stored else ()


def _enter(diagram: xr.Dataset, result: Outcome[DiagramCase, DiagramRow]) -> None:
    """Write one value's results into the diagram."""
    case, row = result.task, result.value
    at = case.at
    if row is None:
        assert result.error is not None
        diagram["status"].values[at], diagram["cause"].values[at] = "failed", error_text(result.error)
        return
    for name, values in row.values.items():
        if name not in diagram:
            dims, units, long_name = DESCRIBED[name]
            shape = (diagram.sizes["value"], case.keep, *values.shape[1:])
            about = {"units": units, "long_name": long_name}
            diagram[name] = (("value", *dims), np.full(shape, np.nan), about)
        diagram[name].values[at, : values.shape[0]] = values
    diagram["status"].values[at], diagram["cause"].values[at] = row.status, row.cause
    diagram["completed_cycles"].values[at] = row.done
    diagram["total_steps"].values[at], diagram["total_events"].values[at] = row.steps, row.events
    diagram["seconds"].values[at], diagram["processor_seconds"].values[at] = row.seconds, row.processor_seconds
    packed = np.concatenate([row.end.y, row.end.mode, row.end.arrays["memory"], row.end.arrays["reference"]])
    if "end" not in diagram:
        about = {"units": "SI", "long_name": "state, modes, approach speeds and angles at the end"}
        diagram["end"] = (("value", "entry"), np.full((diagram.sizes["value"], packed.size), np.nan), about)
    if packed.size == diagram.sizes["entry"]:  # a function may give mechanisms of different sizes
        diagram["end"].values[at] = packed


def _unpacked(diagram: xr.Dataset, at: int, mechanism: Mechanism) -> Snapshot:
    """The state at the end of a value, from what is stored of it."""
    begin, packed = start_state(mechanism), diagram["end"].values[at]
    guards, first = begin.mode.size, begin.y.size
    y, mode, memory, reference = np.split(packed, [first, first + guards, first + 2 * guards])
    return begin.changed(y=y, mode=mode.astype(np.int64), memory=memory, reference=reference)


def _conclude(diagram: xr.Dataset, interrupted: bool, seconds: float) -> None:
    status = diagram["status"].values
    worked = float(diagram["processor_seconds"].sum())
    failed = int(np.sum(status == "failed"))
    diagram.attrs |= {
        "status": "interrupted" if interrupted else ("failed" if failed == status.size else "complete"),
        "failed_values": failed,
        "cycles_per_second": float(diagram["completed_cycles"].sum()) / worked if worked > 0.0 else 0.0,
        "wall_seconds": seconds,
    }
