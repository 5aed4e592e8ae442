"""A problem as named functions, and the arrays of an integration: what goes on, what is scratch, what is recorded."""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple, get_args

import numpy as np

from scissordyn.integrate.history import NODES
from scissordyn.integrate.tableau import Tableau, arrays_of
from scissordyn.kernel import F1, F2, F3, I1, I2, ArrayType, fields_of, opener

MONITORED = 3  # Monitored numbers of a row: the first one's largest value is wanted, all are integrated
RESET_DATA = 3  # Numbers that a reset may write into the event log
SPARE_ROWS = 4  # Rows of `Work.monitored` for points inside a step: three even ones, and one for the search of a maximum
HALVINGS = 12  # How often the distance between two probes is halved in search of a rise that is followed by a fall

TIME, GUARD, MODE, DATA = range(4)
ENDED = DATA + RESET_DATA
"""Columns of the event log: when, which guard, its new mode; from `DATA` on what the reset wrote, from `ENDED` on the peak."""

LARGEST, WHEN, INTEGRAL = range(3)
STRUCK = INTEGRAL + MONITORED
PEAK_COLUMNS = STRUCK + 2
"""Columns of `State.peak`: the largest value, when, the integrals from `INTEGRAL` on; then a second value and when: where the
state jumps the largest impact, else that of the guard's companion."""

LIMIT, LAST_ABOVE, FIRST_WITHIN = range(3)  # Columns of `State.band`

LOG_COLUMNS = ENDED + PEAK_COLUMNS

NO_EVENT, FALL, RISE = -1, 0, 1  # Kinds of events; a rise ends in mode 1, a fall in mode 0

ENDS, CROSSES, IGNORES = range(3)
"""What steps do at roots of guards: end there, go across as long as their error allows it, or ignore them, so that the modes
change at the end of the step."""

CLOCK = np.dtype(
    [
        ("time", "f8"),
        ("end", "f8"),
        ("step", "f8"),  # size to try next
        ("after_rise", "f8"),  # size that worked after the last rise of a guard, 0 before the first
        ("after_fall", "f8"),
        ("previous_step", "f8"),  # size and error of the last step, if its time ran evenly
        ("previous_error", "f8"),
        ("reach", "f8"),  # longest step that is tried to end on the fall of a guard
        ("longest", "f8"),  # longest step that the problem allows from here
        ("first", "f8"),  # size of the first step
        ("fixed", "f8"),  # size of every step, 0 if errors choose it
        ("last_event", "i8"),  # kind of event before the step to come: `NO_EVENT`, `FALL` or `RISE`
        ("touching", "i8"),  # whether an explicit method has a guard in mode 1
        ("rejected", "i8"),  # whether the last trial was rejected
        ("prepared", "i8"),  # what is known at the start of the step to come: `step.NOTHING` and so on
        ("stalled", "i8"),  # trials and events without progress in time
        ("crosses", "i8"),  # what steps do at roots of guards: `ENDS`, `CROSSES` or `IGNORES`
        ("monitors", "i8"),  # whether powers are integrated and numbers monitored
    ]
)
COUNTS = np.dtype([(name, "i8") for name in ("steps", "rejected", "rates", "jacobians", "events", "samples", "recorded")])

C1 = Annotated[np.ndarray, ArrayType(CLOCK, 1)]
N1 = Annotated[np.ndarray, ArrayType(COUNTS, 1)]


class Problem(NamedTuple):
    """The functions of a problem; `advance` says what each one does."""

    rate: Any
    linearise: Any
    factorize: Any
    solve: Any
    accept: Any
    guards: Any
    guard: Any
    reset: Any
    monitor: Any
    probe: Any
    record: Any


class State(NamedTuple):
    """All that the integrator needs to go on.

    `mode`, `memory`, `mass`, `reference` and the history are the problem's own arrays.

    Annotations name the sizes of arrays that are made here. A row of `monitored` is a guard or, behind the guards, a quantity
    that is monitored throughout.
    """

    clock: Annotated[C1, 1]
    counts: Annotated[N1, 1]
    y: Annotated[F1, "y"]
    mode: I1  # (guards,) 0: waits for the guard's rise through zero, 1: for its fall
    memory: F1  # (guards,) a number that goes with the mode
    mass: F1  # (guards,) another one
    reference: F1  # angles counted so far
    total: Annotated[F1, "quadratures"]
    monitored: Annotated[F2, "rows", MONITORED]  # at the present instant
    peak: Annotated[F2, "rows", PEAK_COLUMNS]  # since the last rise
    band: Annotated[F2, "monitors", 3]
    history: Annotated[F2, 0, 2]  # (steps, 2 + signals * coefficients), see `history`
    history_length: Annotated[I1, 1]


STATE_TYPES: dict[str, np.dtype] = {name: get_args(kind)[1].dtype for name, kind in fields_of(State)}
"""The table of what a state is: saving, restoring, comparing and checkpoints go over it."""


class Work(NamedTuple):
    """Error weights and scratch."""

    atol: F1  # (ny,) weight of an error = atol + rtol * root mean square of its group
    rtol: F1
    rounding: Annotated[F1, "y"]  # and not less than rounding/h: what rounding of other components moves it by in a step
    group: I1  # boundaries of the groups
    precision: F1  # (guards,) a root is located when the guard is this small
    crossable: I1  # (guards,) 1 where a step may go across the guard's roots, under error control
    new: Annotated[F1, "y"]
    inside: Annotated[F1, "y"]
    saved: Annotated[F1, "y"]
    stages: Annotated[F2, "stages", "y"]
    estimate: Annotated[F2, 2, "y"]  # estimates of the error
    dense: Annotated[F2, "terms", "y"]
    slope: Annotated[F1, "y"]
    slope_t: Annotated[F1, "y"]
    value: Annotated[F1, "guards"]
    rate: Annotated[F1, "guards"]
    start_value: Annotated[F1, "guards"]  # at the start of the step
    start_rate: Annotated[F1, "guards"]
    left_value: Annotated[F1, "guards"]
    left_rate: Annotated[F1, "guards"]
    right_value: Annotated[F1, "guards"]
    right_rate: Annotated[F1, "guards"]
    end_value: Annotated[F1, "guards"]
    end_rate: Annotated[F1, "guards"]
    ends: Annotated[F2, HALVINGS + 1, 4]  # places still to be searched for a crossing: value, rate and the error of a cubic
    saved_mode: Annotated[I1, "guards"]
    trial_mode: Annotated[I1, "guards"]
    trial_memory: Annotated[F1, "guards"]
    trial_mass: Annotated[F1, "guards"]
    crossing_guard: Annotated[I1, "crossings"]  # guards that are crossed inside a step, in order
    crossing_place: Annotated[F1, "crossings"]  # where
    crossing_count: Annotated[I1, 1]
    rise_guard: Annotated[I1, "crossings"]  # guards that rise inside a step which goes across that
    rise_place: Annotated[F1, "crossings"]
    rise_data: Annotated[F2, "crossings", RESET_DATA]
    rise_count: Annotated[I1, 1]
    power: Annotated[F2, "evaluations", "quadratures"]  # at the stages, or at the nodes and the end
    power_at_start: Annotated[F1, "quadratures"]
    gain: Annotated[F2, "terms", "quadratures"]  # dense output of the integrals of an explicit step
    # at the stages, or at the start, the nodes and the end; then `SPARE_ROWS`
    monitored: Annotated[F3, "points", "rows", MONITORED]
    reads_start: I1  # (rows+1,) entries of y that a guard or a monitored row depends on; none listed: on all
    reads: I1
    companion: I1  # (guards,) the monitored row whose largest value goes with that of a guard, -1 for none
    delays: F1  # (delays,) steps end on their multiples
    signals: Annotated[F2, NODES.size, "signals"]
    accepted: Annotated[F1, 3]  # whether `accept` changed the state, the longest step from there, the fastest rotation [1/s]
    scaling: Annotated[I1, 1]  # how time runs inside the present step: see `step.fraction`
    has_dense: Annotated[I1, 1]  # whether the dense output of the present step is there


class Samples(NamedTuple):
    """What is written at given instants."""

    time: Annotated[F1, "samples"]
    state: Annotated[F2, "samples", "y"]
    total: Annotated[F2, "samples", "quadratures"]
    mode: Annotated[I2, "samples", "guards"]
    memory: Annotated[F2, "samples", "guards"]
    mass: Annotated[F2, "samples", "guards"]
    reference: Annotated[F2, "samples", "angles"]


class StepRecord(NamedTuple):
    """Samples at ends of steps, after which events follow, and at what is located inside steps; no rows: not wanted."""

    time: F1
    state: F2
    total: F2
    mode: I2
    memory: F2
    mass: F2
    reference: F2
    end: I1  # (rows,) whether it is the end of a step
    every: I1  # (1,) of so many steps one end is kept, besides those on events
    inside: I1  # (1,) whether events and largest values that are located inside steps are kept


class Integration(NamedTuple):
    """Everything that the loop works on; it is handed the address of this."""

    method: Tableau
    state: State
    work: Work
    samples: Samples
    steps: StepRecord
    log: F2


open_integration = opener(Integration)  # From the address of an integration's handle to the integration, inside kernels


def make_state(y: np.ndarray, *, quadratures: int, monitors: int, band: np.ndarray | None = None, **own: np.ndarray) -> State:
    """The state at the start y of an integration at t = 0; `own` are the arrays of the problem."""
    sizes = {"y": y.size, "quadratures": quadratures, "monitors": monitors, "rows": own["mode"].size + monitors}
    state = State(**arrays_of(State, sizes, own))
    state.band[:, LIMIT] = np.inf if band is None else band
    reset_state(state, y)
    return state


def reset_state(state: State, y: np.ndarray, *, crosses: int = ENDS, fixed: float = 0.0) -> None:
    """Begin anew at the start y at t = 0; what is the problem's own stays as it is."""
    state.clock[:], state.counts[:] = 0, 0
    state.clock["last_event"], state.clock["reach"], state.clock["longest"] = NO_EVENT, np.inf, np.inf
    state.clock["crosses"], state.clock["fixed"], state.clock["monitors"] = crosses, fixed, 1
    state.y[:] = y
    state.total[:], state.monitored[:], state.peak[:] = 0.0, 0.0, 0.0
    state.band[:, LAST_ABOVE:] = np.nan


def make_work(
    state: State,
    method: Tableau,
    *,
    reads: tuple[np.ndarray, np.ndarray] | None = None,
    delays: tuple[float, ...] = (),
    **weights: np.ndarray,
) -> Work:
    """Scratch for an integration; `weights` are those of errors, and `companion`, if guards have some."""
    guards, rows = state.mode.size, state.monitored.shape[0]
    sizes = {
        "y": state.y.size,
        "guards": guards,
        "crossings": 8 * guards,
        "quadratures": state.total.size,
        "rows": rows,
        "stages": method.nodes.size,
        "terms": method.pattern.size,
        "evaluations": max(method.gauss.size + 1, method.nodes.size),
        "points": max(method.gauss.size + 2, method.nodes.size) + SPARE_ROWS,
        "signals": (state.history.shape[1] - 2) // NODES.size,
    }
    reads_start, listed = (np.zeros(rows + 1, np.int64), np.zeros(0, np.int64)) if reads is None else reads
    ready = {"companion": np.full(guards, -1), "reads_start": reads_start, "reads": listed, "delays": np.array(delays, float)}
    return Work(**arrays_of(Work, sizes, ready | weights))


def make_samples(time: np.ndarray, state: State) -> Samples:
    sizes = {"samples": time.size, "y": state.y.size, "quadratures": state.total.size}
    sizes |= {"guards": state.mode.size, "angles": state.reference.size}
    samples = Samples(**arrays_of(Samples, sizes, {"time": time}))
    samples.state[:], samples.total[:] = np.nan, np.nan
    return samples


def make_record(rows: int, state: State, *, inside: bool = False) -> StepRecord:
    samples = make_samples(np.zeros(rows), state)
    return StepRecord(*samples, np.zeros(rows, np.int64), np.ones(1, np.int64), np.array([int(inside)]))
