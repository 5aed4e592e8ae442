"""Bifurcation diagrams: the asymptotic motion of a periodic run over a parameter."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import numpy as np
import xarray as xr

from scissordyn.errors import InputError, whole_number
from scissordyn.model.mechanism import Mechanism
from scissordyn.periodic.diagram import conclude, diagram_from, empty_diagram, enter_value, final_state
from scissordyn.periodic.follow import carried
from scissordyn.periodic.rows import PENDING, CycleCase, CycleRow, run_case
from scissordyn.periodic.stroboscope import drive_period
from scissordyn.run.advance.driver import Snapshot
from scissordyn.run.engine import ENGINES, Engine, EngineError, Outcome, outcomes
from scissordyn.run.options import Options, StartKind
from scissordyn.run.start.demand import CYCLE_TIME, check_cycles, check_memory, count_in_words, machine_memory
from scissordyn.run.store import save
from scissordyn.units import Meaning, checked

VALUE_BYTES = 5000  # Memory of a value beside its cycles: the mechanism that it makes
KEPT, KEPT_OF_JOINT = 8, 6  # Numbers of a cycle that is kept, and of each of its joints
SAVE_EVERY = 10.0  # Shortest time between two writes of the store [s]: the work that can be lost


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
    engine: Annotated[Engine, Meaning(ENGINES, "engine=2")] = None,
    store: str | os.PathLike[str] | None = None,
    progress: Callable[[int, int], None] | None = None,
    shown: tuple[str, float] | None = None,
) -> xr.Dataset:
    """The stroboscopic map of a periodically driven mechanism for many values of a parameter.

    Parameters
    ----------
    mechanism : Mechanism
    over : str or callable
        The varied parameter, a path such as "drive.speed", or a function from a value to a mechanism.
    values : sequence of float
        Of the parameter, in SI units, in the order of computation.
    cycles, keep : int
        Number of cycles for each value, and how many of the last are returned.
    period : float, optional
        Of the map [s]; that of each mechanism's drive if not given.
    phase : float
        Phase of the samples in the cycle, in [0, 1).
    follow : bool
        Start each value from the end of the one before, which follows a branch of solutions: one by one, here.
    start, rtol, atol, method, most_steps
        As for `cycle`.
    engine : Executor or int, optional
        Where the values are computed; a number is one of threads; one thread per processor if not given. The result does not
        depend on it.
    store : path, optional
        A NetCDF file with the results so far, updated during the computation. If it exists, only missing values are computed.
    progress : callable, optional
        Called after each value with the number done and the total.
    shown : (str, float), optional
        Unit in which warnings and pictures show the values, and one of it in SI: ``("rpm", math.pi / 30.0)``.

    Returns
    -------
    Dataset
        Dimensions value, cycle, joint, axis; the coordinate "value" has the parameter's unit. Per value: status ("complete",
        "failed", "interrupted", or "pending" after Ctrl-C), cause, warnings (one a line), completed_cycles, total_steps,
        total_events, seconds, processor_seconds. Numbers are NaN where a cycle was not reached, and only there. Attributes:
        status, cycles_per_second (of processor time), wall_seconds of this call, parameter, cycles, configuration, warnings
        (laws outside their range in the cycles kept, and singular positions that the drives lead through).

    Raises
    ------
    InputError
        For a parameter, value or option that cannot be used, or a store that belongs to another diagram.
    EngineError
        If the workers of a scheduler are lost; what is done is in the store.
    """
    began = time.perf_counter()
    numbers = _numbers(values)
    check_diagram(mechanism, len(numbers), cycles, keep)
    mechanisms = [mechanism.replace(over, value) if isinstance(over, str) else over(value) for value in numbers]
    options = Options(1.0 if period is None else period, start, 2, rtol, atol, method, most_steps)
    cases = _cases(mechanisms, options, period, cycles, keep, phase)
    target = None if store is None else Path(store)
    diagram = diagram_from(target, empty_diagram(mechanism, over, numbers, cases, follow, shown), mechanisms[0])
    todo = np.flatnonzero(np.isin(diagram["status"].values, (PENDING, "interrupted"))).tolist()
    results = _chain(cases, diagram, todo) if follow else outcomes(engine, run_case, [cases[at] for at in todo])
    interrupted = _compute(results, diagram, target, progress)
    conclude(diagram, interrupted, time.perf_counter() - began)
    if target is not None:
        save(diagram, target)
    return diagram


def check_diagram(mechanism: Mechanism, values: int, cycles: int, keep: int) -> None:
    """Raise `InputError` for numbers of cycles that cannot be, or a diagram that does not fit into memory."""
    whole_number("cycles", cycles)
    whole_number("keep", keep, 1, cycles)
    check_cycles(len(mechanism.contacts), cycles)
    needed = VALUE_BYTES + 8 * keep * (KEPT + KEPT_OF_JOINT * len(mechanism.contacts))
    check_memory(
        f"{count_in_words(values)} values with {count_in_words(keep)} cycles kept of each",
        values * needed,
        CYCLE_TIME * values * cycles,
        f"at most {machine_memory() // needed} values here",
        "--values 300, or a smaller --keep",
    )


def _cases(
    mechanisms: Sequence[Mechanism], options: Options, period: float | None, cycles: int, keep: int, phase: float
) -> list[CycleCase]:
    if len({tuple(joint.name for joint in mechanism.clearance_joints) for mechanism in mechanisms}) > 1:
        raise InputError("mechanisms with different clearance joints", "the same clearance joints for every value")
    options_of = [
        options if period is not None else replace(options, until=drive_period(mechanism)) for mechanism in mechanisms
    ]
    pairs = enumerate(zip(mechanisms, options_of, strict=True))
    return [
        CycleCase(at, mechanism, case_options, cycles, keep, phase, options.start) for at, (mechanism, case_options) in pairs
    ]


def _numbers(values: Sequence[float] | np.ndarray) -> list[float]:
    """The parameter's values."""
    numbers = [float(value) for value in values]
    if not numbers or not np.all(np.isfinite(numbers)):
        raise InputError("values that are empty or not finite", "one number or more")
    return numbers


def _compute(
    results: Iterator[Outcome[CycleCase, CycleRow]],
    diagram: xr.Dataset,
    target: Path | None,
    progress: Callable[[int, int], None] | None,
) -> bool:
    """Enter results as they come, and save them now and then; returns whether the user stopped it."""
    saved = time.perf_counter()
    try:
        for result in results:
            enter_value(diagram, result)
            if progress is not None:
                progress(int(np.sum(diagram["status"].values != PENDING)), diagram.sizes["value"])
            if target is not None and time.perf_counter() - saved > SAVE_EVERY:
                save(diagram, target)
                saved = time.perf_counter()
    except KeyboardInterrupt:
        return True
    except EngineError:
        if target is not None:
            save(diagram, target)
        raise
    return False


def _chain(cases: Sequence[CycleCase], diagram: xr.Dataset, todo: list[int]) -> Iterator[Outcome[CycleCase, CycleRow]]:
    """All values in order, each from the final state of the one before; from the initial start after a failure."""
    end: Snapshot | None = None
    for index in todo:
        case = cases[index]
        if index and end is None and diagram["status"].values[index - 1] == "complete":
            end = final_state(diagram, index - 1, cases[index - 1].mechanism)
        if index and end is not None:
            case = replace(case, start=carried(cases[index - 1].mechanism, end, case.mechanism))
        for result in outcomes(1, run_case, [case]):
            row = result.value
            end = row.end if row is not None and row.about["status"] == "complete" else None
            yield result
