"""Run the time loop on a problem, for all tests of the integrators."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from tests.build import loop_of

from scissordyn.integrate import advance as loop
from scissordyn.integrate.history import make_history
from scissordyn.integrate.integration import (
    LOG_COLUMNS,
    Integration,
    Samples,
    State,
    make_record,
    make_samples,
    make_state,
    make_work,
)
from scissordyn.integrate.integration import Problem as Functions
from scissordyn.integrate.method import tableau
from scissordyn.kernel import Handle


class Followed(NamedTuple):
    """Results of a run."""

    status: int
    out: Samples
    log: np.ndarray
    ends: np.ndarray  # Of the steps
    reached: np.ndarray  # The states there
    state: State
    numbers: Any  # Of the problem


def follow(
    kernels: Mapping[str, Any],
    numbers: Any,
    name: str,
    start: tuple[float, ...],
    until: float,
    *,
    quadratures: int,
    rows: int,
    band: np.ndarray | None,
    rtol: float = 1e-10,
    atol: float = 1e-10,
    samples: int | np.ndarray = 2,
    step: float = math.inf,
    first: float = 0.0,
    crosses: bool = False,
    crossable: bool = True,
    monitors: bool = True,
    signals: int = 0,
    delays: tuple[float, ...] = (),
    history: int = 400,
    precision: float = 1e-13,
    group: tuple[int, ...] = (),
    log_rows: int = 400,
    record_rows: int = 20000,
    most_steps: int = 100000,
    pieces: int = 1,
) -> Followed:
    """Integrate a problem with its kernels by the time loop; return the results."""
    handle, method, n, count = Handle(numbers), tableau(name), len(start), numbers.mode.size
    state = make_state(
        np.array(start),
        mode=numbers.mode,
        memory=np.zeros(count),
        mass=np.zeros(count),
        reference=np.zeros(0),
        quadratures=quadratures,
        monitors=rows,
        band=band,
        history=make_history(signals, history if signals else 0),
        history_length=np.zeros(1, np.int64),
    )
    work = make_work(
        state,
        method,
        atol=np.full(n, atol),
        rtol=np.full(n, rtol),
        group=np.array(group or (0, n), np.int64),
        precision=np.full(count, precision),
        crossable=np.full(count, int(crossable), np.int64),
        delays=delays,
    )
    state.clock["end"], state.clock["longest"], state.clock["crosses"] = until, step, int(crosses)
    state.clock["monitors"] = int(monitors)
    if first:
        state.clock["first"] = state.clock["step"] = first
    out = make_samples(np.linspace(0.0, until, samples) if isinstance(samples, int) else samples, state)
    log, steps = np.zeros((log_rows, LOG_COLUMNS)), make_record(record_rows, state)
    whole, status = Handle(Integration(method, state, work, out, steps, log)), np.array([loop.ADVANCING])
    advance = loop_of({part: kernels[part] for part in Functions._fields})
    for _ in range(pieces):
        advance(np.array([handle.address]), np.array([whole.address]), most_steps, status)
        if status[0] != loop.ADVANCING:
            break
    events, ends = slice(state.counts["events"][0]), slice(state.counts["recorded"][0])
    return Followed(int(status[0]), out, log[events], steps.time[ends], steps.state[ends], state, numbers)
