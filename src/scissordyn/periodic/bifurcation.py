"""Bifurcation diagrams: the asymptotic motion of a periodic run over a parameter."""

from __future__ import annotations

import hashlib
import json
import os
import time
from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import xarray as xr

from scissordyn.casefile.configuration import read_configuration, write_configuration
from scissordyn.errors import InputError, whole_number
from scissordyn.file.provenance import provenance
from scissordyn.kinematics.assembly import Start, basis_at_start, natural_state
from scissordyn.kinematics.branching import drive_warnings
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.options import Options, StartKind
from scissordyn.model.parameter_path import number
from scissordyn.model.record import to_plain
from scissordyn.periodic.cycles import recorded_names
from scissordyn.periodic.rows import CycleCase, CycleRow, empty_rows, run_case, store_cycles
from scissordyn.periodic.stroboscope import make_consistent, start_state
from scissordyn.plan.plan import plan
from scissordyn.plan.system import make_system
from scissordyn.record.store import load, save
from scissordyn.run.advance.driver import Snapshot
from scissordyn.run.engine import ENGINES, Engine, EngineError, Outcome, outcomes
from scissordyn.run.rows import PENDING
from scissordyn.run.stops import drive_period
from scissordyn.studies.answer.grouped import grouped_lines
from scissordyn.units import Meaning, checked

SAVE_SECONDS = 10.0  # [s] shortest time between two writes of the store; a crash loses at most this much work


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
    atol: float | None = None,
    method: str = "auto",
    most_steps: int = 1_000_000,
    engine: Annotated[Engine, Meaning(ENGINES, "engine=2")] = None,
    store: str | os.PathLike[str] | None = None,
    progress: Callable[[int, int], None] | None = None,
    shown: tuple[str, float] | None = None,
) -> xr.Dataset:
    """Compute the stroboscopic map of a periodically driven mechanism for many values of a parameter.

    Parameters
    ----------
    mechanism : Mechanism
    over : str or callable
        The varied parameter, a path such as "drive.speed", or a function from a value to a mechanism.
    values : sequence of float
        Values of the parameter in SI units, in the order of computation.
    cycles, keep : int
        Number of cycles for each value, and number of last cycles that are returned.
    period : float, optional
        Period of the map [s]; by default the period of each mechanism's drive.
    phase : float
        Phase of the samples in the cycle, in [0, 1).
    follow : bool
        Start each value from the end of the previous value. This follows a branch of solutions; the values are computed one by
        one in this process.
    start, rtol, atol, method, most_steps
        As for `cycle`.
    engine : Executor or int, optional
        Engine that computes the values; an int is a number of threads; by default one thread per processor. The result does not
        depend on the engine.
    store : path, optional
        NetCDF file with the finished results, updated during the computation. If the file exists, only missing values are
        computed.
    progress : callable, optional
        Called after each value with the number of finished values and the total.
    shown : (str, float), optional
        Unit in which warnings and pictures show the values, and its size in SI units: ``("rpm", math.pi / 30.0)``.

    Returns
    -------
    Dataset
        Dimensions value, cycle, joint, axis; the coordinate "value" has the parameter's unit. Per value and cycle: the state
        once a period (eccentricity, slider_position, slider_velocity, ...), and peak_force and works of the cycle. Per value:
        status ("complete", "failed", "interrupted", or "pending" after Ctrl-C), cause, warnings (one a line), completed_cycles,
        total_steps, total_events, seconds, processor_seconds. Numbers are NaN only where a cycle was not reached. Attributes:
        status, cycles_per_second (of processor time), wall_seconds of this call, parameter, cycles, configuration, warnings.
        The warnings are laws outside their range in the cycles kept, and singular positions that the drives lead through.

    Raises
    ------
    InputError
        If a parameter, value or option cannot be used, or the store belongs to another diagram.
    EngineError
        If the workers of a scheduler are lost; finished values are in the store.
    """
    began = time.perf_counter()
    numbers = [float(value) for value in values]
    if not numbers or not np.all(np.isfinite(numbers)):
        raise InputError("values that are empty or not finite", "one finite number or more")
    check_diagram(len(numbers), cycles, keep)
    mechanisms = [mechanism.replace(over, value) if isinstance(over, str) else over(value) for value in numbers]
    options = Options(1.0 if period is None else period, start, 2, rtol, atol, method, most_steps)
    cases = _cases(mechanisms, options, period, cycles, keep, phase)
    target = None if store is None else Path(store)
    diagram = load_diagram(target, empty_diagram(mechanism, over, numbers, cases, follow, shown), mechanisms[0])
    todo = np.flatnonzero(np.isin(diagram["status"].values, (PENDING, "interrupted"))).tolist()
    results = _follow_values(cases, diagram, todo) if follow else outcomes(engine, run_case, [cases[at] for at in todo])
    interrupted = _compute(results, diagram, target, progress)
    store_summary(diagram, interrupted, time.perf_counter() - began)
    if target is not None:
        save(diagram, target)
    return diagram


def check_diagram(values: int, cycles: int, keep: int) -> None:
    """Raise `InputError` if the numbers of values and cycles are invalid."""
    whole_number("cycles", cycles)
    whole_number("keep", keep, 1, cycles)
    whole_number("cycles kept of all values", values * keep)


def _cases(
    mechanisms: Sequence[Mechanism], options: Options, period: float | None, cycles: int, keep: int, phase: float
) -> list[CycleCase]:
    if len({tuple(joint.name for joint in mechanism.clearance_joints) for mechanism in mechanisms}) > 1:
        raise InputError("mechanisms with different clearance joints", "the same clearance joints for every value")
    periods = [drive_period(mechanism) if period is None else period for mechanism in mechanisms]
    return [
        CycleCase(at, mechanism, replace(options, until=lasting), cycles, keep, phase)
        for at, (mechanism, lasting) in enumerate(zip(mechanisms, periods, strict=True))
    ]


def _compute(
    results: Iterator[Outcome[CycleCase, CycleRow]],
    diagram: xr.Dataset,
    target: Path | None,
    progress: Callable[[int, int], None] | None,
) -> bool:
    """Store results in the diagram as they finish and save it regularly; return True if the user interrupted."""
    saved = time.perf_counter()
    try:
        for result in results:
            store_value(diagram, result)
            if progress is not None:
                progress(int(np.sum(diagram["status"].values != PENDING)), diagram.sizes["value"])
            if target is not None and time.perf_counter() - saved > SAVE_SECONDS:
                save(diagram, target)
                saved = time.perf_counter()
    except KeyboardInterrupt:
        return True
    except EngineError:
        if target is not None:
            save(diagram, target)
        raise
    return False


def _follow_values(cases: Sequence[CycleCase], diagram: xr.Dataset, todo: list[int]) -> Iterator[Outcome[CycleCase, CycleRow]]:
    """Compute all values in order, each from the final state of the previous one, or from the initial start after a failure."""
    end: Snapshot | None = None
    for index in todo:
        case = cases[index]
        if index and end is None and diagram["status"].values[index - 1] == "complete":
            end = final_state(diagram, index - 1, cases[index - 1].mechanism)
        if index and end is not None:
            case = replace(case, start=transfer_state(cases[index - 1].mechanism, end, case.mechanism))
        for result in outcomes(1, run_case, [case]):
            row = result.value
            end = row.end if row is not None and row.values["status"] == "complete" else None
            yield result


def transfer_state(before: Mechanism, state: Snapshot, after: Mechanism) -> Snapshot:
    """Convert a state of one mechanism to a start of another, with the same positions and velocities of the bodies.

    Both are at the same phase of their drives; time restarts from zero.
    """
    if any(
        [part.name for part in getattr(before, parts)] != [part.name for part in getattr(after, parts)]
        for parts in ("bodies", "contacts")
    ):
        raise InputError(
            "follow = True: two values of the parameter give mechanisms with different bodies or clearance joints",
            "follow = False",
        )
    old, new = plan(before), plan(after)
    system = make_system(new)
    n = old.coordinates.free
    position, velocity = natural_state(old, make_system(old).content, Start(state.y[:n], state.y[n : 2 * n]))
    b, rate = basis_at_start(system.content)
    internal = state.y[2 * n :]
    if internal.size != int(system.content.model.state_start[-1]):
        raise InputError(
            "follow = True: two values of the parameter give mechanisms with different internal states", "follow = False"
        )
    full = np.concatenate([new.coordinates.nearest(b, position), new.coordinates.nearest(rate, velocity), internal])
    begin = start_state(after)
    kept = {name: state.arrays[name] for name in ("memory", "mass", "reference")}
    moved = begin.changed(y=full, mode=state.mode, **kept)
    return make_consistent(system, moved)


class OtherDiagramError(InputError):
    """Error of a store that holds another diagram, or a diagram computed with other sources or libraries."""


def empty_diagram(
    mechanism: Mechanism,
    over: str | Callable[[float], Mechanism],
    numbers: list[float],
    cases: Sequence[CycleCase],
    follow: bool,
    shown: tuple[str, float] | None = None,
) -> xr.Dataset:
    """Return a diagram with a pending row for each value of the parameter."""
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
    periods = np.array([case.options.until for case in cases])
    along = {"value": ("value", np.array(numbers), about), "period": ("value", periods, {"units": "s", "long_name": "period"})}
    return empty_rows(cases, "value", along).assign_attrs(
        title="scissordyn bifurcation",
        status=PENDING,
        parameter=name,
        phase=first.phase,
        cycles=first.cycles,
        versions=json.dumps({name: value for name, value in made_with.items() if name != "sources"}),
        warnings=json.dumps(_warnings(cases, [_value_in_words(name, value, about) for value in numbers])),
        configuration=write_configuration(mechanism, diagram=diagram),
    )


def _value_in_words(name: object, value: float, about: Mapping[Hashable, Any]) -> str:
    """Return a value of the parameter as text, in the unit of its attribute `shown_unit` or in SI units."""
    unit, scale = about.get("shown_unit", about["units"]), about.get("shown_scale", 1.0)
    return f"{name} = {value / scale:g}" + ("" if unit == "1" else f" {unit}")


def _warnings(cases: Sequence[CycleCase], values: list[str]) -> list[str]:
    """Return warnings about singular positions on the drives' paths; name the first value if only some have them."""
    of_motion: dict[str, list[str]] = {}
    warned: dict[str, list[str]] = {}
    for case, value in zip(cases, values, strict=True):
        motion = json.dumps([to_plain(case.mechanism.ideal()), case.options.until])
        if motion not in of_motion:
            of_motion[motion] = drive_warnings(plan(case.mechanism), case.options.until)
        for text in of_motion[motion]:
            warned.setdefault(text, []).append(value)
    return [text if len(of) == len(cases) else f"{of[0]}: {text}" for text, of in warned.items()]


def load_diagram(target: Path | None, blank: xr.Dataset, mechanism: Mechanism) -> xr.Dataset:
    """Return the diagram stored in a file, or `blank` if the file does not exist."""
    if target is None or not target.exists():
        return blank
    try:
        stored = load(target)
        wanted, there = read_configuration(blank), read_configuration(stored)
    except InputError as error:
        raise OtherDiagramError(error.what, error.expected, error.example) from None
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
        dims = {name: stored[name].dims if name in stored else () for name in (*recorded_names(mechanism), "end")}
        differs = [name for name, along in dims.items() if begun and "value" not in along]
        differs += ["status"] if states - {PENDING, "complete", "failed", "interrupted"} else []
    if differs:
        raise OtherDiagramError(
            f"'{target}' holds another diagram (differs in {', '.join(differs)})",
            "the file of the same diagram, or the name of a new file",
            "store='another.nc'",
        )
    stored["value"].attrs = blank["value"].attrs
    stored.attrs |= {name: value for name, value in blank.attrs.items() if name != "status"}
    for name in ("status", "cause", "warnings"):
        stored[name] = stored[name].astype(object)
    return stored


def store_value(diagram: xr.Dataset, outcome: Outcome[CycleCase, CycleRow]) -> None:
    """Store the results of one parameter value in the diagram, and its final state, from which the next value may start."""
    store_cycles(diagram, "value", outcome)
    if outcome.value is None:
        return
    end = outcome.value.end
    packed = np.concatenate([end.y, end.mode, *(end.arrays[name] for name in ("memory", "mass", "reference"))])
    if "end" not in diagram:
        about = {"long_name": "state, modes, approach speeds, effective masses and angles at the end, each in its SI unit"}
        diagram["end"] = (("value", "entry"), np.full((diagram.sizes["value"], packed.size), np.nan), about)
    if packed.size == diagram.sizes["entry"]:  # a user's function may return mechanisms of different sizes
        diagram["end"].values[outcome.task.at] = packed


def final_state(diagram: xr.Dataset, at: int, mechanism: Mechanism) -> Snapshot:
    """Return the final state of the parameter value with index `at`, as a start for the same mechanism."""
    begin, packed = start_state(mechanism), diagram["end"].values[at]
    guards, first = begin.mode.size, begin.y.size
    y, mode, memory, mass, reference = np.split(packed, first + guards * np.arange(4))
    return begin.changed(y=y, mode=mode.astype(np.int64), memory=memory, mass=mass, reference=reference)


def store_summary(diagram: xr.Dataset, interrupted: bool, seconds: float) -> None:
    """Store the status of the whole diagram, its warnings and its computing time."""
    status = diagram["status"].values
    worked = float(diagram["processor_seconds"].sum())
    failed = int(np.sum(status == "failed"))
    diagram.attrs |= {
        "status": "interrupted" if interrupted else ("failed" if failed == status.size else "complete"),
        "failed_values": failed,
        "cycles_per_second": float(diagram["completed_cycles"].sum()) / worked if worked > 0.0 else 0.0,
        "wall_seconds": seconds,
        "warnings": json.dumps([*json.loads(diagram.attrs["warnings"]), *_warnings_of_values(diagram)]),
    }


def _warnings_of_values(diagram: xr.Dataset) -> list[str]:
    """Return the warnings about single values; a repeated warning names the first value only."""
    values, warnings = diagram["value"].values, []
    for text, at in grouped_lines(diagram["warnings"].values).items():
        others = f", the first of {len(at)} values" if len(at) > 1 else ""
        warnings.append(f"{_value_in_words(diagram.attrs['parameter'], values[at[0]], diagram['value'].attrs)}{others}: {text}")
    return warnings
