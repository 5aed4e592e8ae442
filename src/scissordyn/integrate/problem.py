"""A problem as typed pointers, and the work arrays of the loop."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import int64, types, void
from numba.core.types.function_type import CompileResultWAP

from scissordyn.integrate.books import SPARE, WATCHED
from scissordyn.integrate.history import NODES
from scissordyn.integrate.tableau import Tableau

__all__ = ["Problem", "Samples", "Work", "make_problem", "make_samples", "make_work"]


class Problem(NamedTuple):
    """Typed pointers to the functions of a problem; `advance` says what each one does."""

    rate: Any
    linearise: Any
    factorize: Any
    solve: Any
    project: Any
    guards: Any
    reset: Any
    powers: Any
    record: Any


class Work(NamedTuple):
    """State, weights and work arrays of a run."""

    y: np.ndarray
    new: np.ndarray
    inside: np.ndarray
    stages: np.ndarray
    dense: np.ndarray
    slope: np.ndarray
    slope_t: np.ndarray
    atol: np.ndarray  # (ny,) weight of an error = atol + rtol * root mean square of its group
    rtol: np.ndarray
    rounding: np.ndarray  # (ny,) and not less than rounding/h: what rounding of other components moves it by in a step
    group: np.ndarray  # boundaries of the groups
    mode: np.ndarray  # (guards,) shared with the problem, whose resets change it
    memory: np.ndarray  # (guards,) likewise: one number that goes with a mode, sampled beside it
    precision: np.ndarray  # (guards,) a crossing is located when the guard is this small
    value: np.ndarray
    rate: np.ndarray
    left_rate: np.ndarray
    right_value: np.ndarray
    left_value: np.ndarray
    first_value: np.ndarray  # where the first crossing so far was found
    right_rate: np.ndarray
    power: np.ndarray  # (stages or nodes + 1, quadratures)
    power_at_start: np.ndarray  # (quadratures,)
    gain: np.ndarray  # (p, quadratures): dense output of the integrals of an explicit step
    total: np.ndarray  # (quadratures,)
    watched: np.ndarray  # (rows, guards, WATCHED): at the stages, or at the start, the nodes and the end; then work space
    peak: np.ndarray  # (guards, 2 + WATCHED): since the last rise the largest watched number, when, and the integrals
    history: np.ndarray  # (steps, 2 + signals * coefficients) shared with the problem: see `history`
    kept: np.ndarray  # (1,) steps in it, shared likewise
    delays: np.ndarray  # (delays,) steps end on their multiples
    signals: np.ndarray  # (nodes, signals)
    rejected: np.ndarray  # (1,)
    first: np.ndarray  # (1,) kind of event before the step to come, or -1
    pace: np.ndarray  # (1,) how time runs inside the present step: see `pace`
    touching: np.ndarray  # (1,) whether an explicit method is in a contact
    trend: np.ndarray  # (2,) size and error of the last step, if it was even
    reach: np.ndarray  # (1,) longest step that is tried to end on the end of a contact


class Samples(NamedTuple):
    """What is written at given instants."""

    time: np.ndarray
    state: np.ndarray
    total: np.ndarray
    mode: np.ndarray
    memory: np.ndarray


def make_problem(functions: dict[str, Any]) -> Problem:
    """Typed pointers to compiled functions.

    Parameters
    ----------
    functions : dict
        Compiled functions by the names of `Problem`'s fields.

    Returns
    -------
    Problem
    """
    t, vector, integer, system = types.float64, types.float64[::1], int64, int64
    signatures = {
        "rate": void(t, vector, system, vector),
        "linearise": void(t, vector, system, vector, vector),
        "factorize": integer(t, system),
        "solve": void(vector, system),
        "project": types.boolean(t, vector, system),
        "guards": void(t, vector, system, vector, vector),
        "reset": void(t, vector, integer, system, vector),
        "powers": void(t, vector, system, vector, types.float64[:, ::1]),
        "record": void(t, vector, system, vector),
    }
    return Problem(**{name: CompileResultWAP(functions[name].get_compile_result(sign)) for name, sign in signatures.items()})


def make_work(
    state: np.ndarray,
    tableau: Tableau,
    *,
    atol: np.ndarray,
    rtol: np.ndarray,
    group: np.ndarray,
    mode: np.ndarray,
    memory: np.ndarray,
    precision: np.ndarray,
    quadratures: int,
    history: np.ndarray | None = None,
    kept: np.ndarray | None = None,
    delays: tuple[float, ...] = (),
    rounding: np.ndarray | None = None,
) -> Work:
    """Work arrays for a start at `state`; a problem with delays brings a history and its count."""
    size, guards = state.size, mode.size
    past = np.zeros((0, 2)) if history is None else history
    return Work(
        y=state.copy(),
        new=np.zeros(size),
        inside=np.zeros(size),
        stages=np.zeros((tableau.nodes.size, size)),
        dense=np.zeros((tableau.pattern.size, size)),
        slope=np.zeros(size),
        slope_t=np.zeros(size),
        atol=atol,
        rtol=rtol,
        rounding=np.zeros(size) if rounding is None else rounding,
        group=group,
        mode=mode,
        memory=memory,
        precision=precision,
        value=np.zeros(guards),
        rate=np.zeros(guards),
        left_rate=np.zeros(guards),
        right_value=np.zeros(guards),
        left_value=np.zeros(guards),
        first_value=np.zeros(guards),
        right_rate=np.zeros(guards),
        power=np.zeros((max(tableau.gauss.size + 1, tableau.nodes.size), quadratures)),
        power_at_start=np.zeros(quadratures),
        gain=np.zeros((tableau.pattern.size, quadratures)),
        total=np.zeros(quadratures),
        watched=np.zeros((max(tableau.gauss.size + 2, tableau.nodes.size) + SPARE, guards, WATCHED)),
        peak=np.zeros((guards, 2 + WATCHED)),
        history=past,
        kept=np.zeros(1, np.int64) if kept is None else kept,
        delays=np.array(delays, float),
        signals=np.zeros((NODES.size, (past.shape[1] - 2) // NODES.size)),
        rejected=np.zeros(1, np.int64),
        first=np.full(1, -1, np.int64),
        pace=np.zeros(1, np.int64),
        touching=np.zeros(1, np.int64),
        trend=np.zeros(2),
        reach=np.full(1, np.inf),
    )


def make_samples(time: np.ndarray, work: Work) -> Samples:
    """Room for samples at increasing instants."""
    rows, guards = time.size, work.mode.size
    return Samples(
        time=time,
        state=np.full((rows, work.y.size), np.nan),
        total=np.full((rows, work.total.size), np.nan),
        mode=np.zeros((rows, guards), np.int64),
        memory=np.zeros((rows, guards)),
    )
