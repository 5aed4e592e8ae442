"""A problem as named functions, and the arrays of an integration: what goes on, what is scratch, what is recorded."""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple, get_type_hints

import numpy as np

from scissordyn.integrate.history import NODES
from scissordyn.integrate.tableau import Tableau
from scissordyn.kernel import F1, F2, F3, I1, I2, ArrayType, opener

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
    """All that the integrator needs to go on; `mode`, `memory`, `reference` and the history are the problem's own arrays.

    A row of `monitored` is a guard or, behind the guards, a quantity that is monitored throughout.
    """

    clock: C1  # (1,)
    counts: N1  # (1,)
    y: F1
    mode: I1  # (guards,) 0: waits for the guard's rise through zero, 1: for its fall
    memory: F1  # (guards,) a number that goes with the mode
    reference: F1  # angles counted so far
    total: F1  # (quadratures,)
    monitored: F2  # (rows, MONITORED) at the present instant
    peak: F2  # (rows, PEAK_COLUMNS) since the last rise
    band: F2  # (rows - guards, 3)
    history: F2  # (steps, 2 + signals * coefficients), see `history`
    history_length: I1  # (1,)


STATE_TYPES: dict[str, np.dtype] = {
    name: kind.__metadata__[0].dtype for name, kind in get_type_hints(State, include_extras=True).items()
}
"""The table of what a state is: saving, restoring, comparing and checkpoints go over it."""


class Work(NamedTuple):
    """Error weights and scratch."""

    atol: F1  # (ny,) weight of an error = atol + rtol * root mean square of its group
    rtol: F1
    rounding: F1  # (ny,) and not less than rounding/h: what rounding of other components moves it by in a step
    group: I1  # boundaries of the groups
    precision: F1  # (guards,) a root is located when the guard is this small
    crossable: I1  # (guards,) 1 where a step may go across the guard's roots, under error control
    new: F1
    inside: F1
    saved: F1
    stages: F2
    estimate: F2  # (2, ny) estimates of the error
    dense: F2
    slope: F1
    slope_t: F1
    value: F1  # (guards,)
    rate: F1
    start_value: F1  # (guards,) at the start of the step
    start_rate: F1
    left_value: F1
    left_rate: F1
    right_value: F1
    right_rate: F1
    end_value: F1
    end_rate: F1
    ends: F2  # (HALVINGS + 1, 4) places still to be searched for a crossing, with value, rate and the error of a cubic
    saved_mode: I1
    trial_mode: I1
    trial_memory: F1
    crossing_guard: I1  # (crossings,) guards that are crossed inside a step, in order
    crossing_place: F1  # where
    crossing_count: I1  # (1,)
    rise_guard: I1  # (crossings,) guards that rise inside a step which goes across that
    rise_place: F1
    rise_data: F2  # (crossings, RESET_DATA)
    rise_count: I1  # (1,)
    power: F2  # (stages or nodes + 1, quadratures)
    power_at_start: F1
    gain: F2  # (p, quadratures): dense output of the integrals of an explicit step
    monitored: F3  # (points, rows, MONITORED): at the stages, or at the start, the nodes and the end; then `SPARE_ROWS`
    reads_start: I1  # (rows+1,) entries of y that a guard or a monitored row depends on; none listed: on all
    reads: I1
    companion: I1  # (guards,) the monitored row whose largest value goes with that of a guard, -1 for none
    delays: F1  # (delays,) steps end on their multiples
    signals: F2  # (nodes, signals)
    accepted: F1  # (3,) whether `accept` changed the state, the longest step from there, the fastest rotation [1/s]
    scaling: I1  # (1,) how time runs inside the present step: see `step_scaling`
    has_dense: I1  # (1,) whether the dense output of the present step is there


class Samples(NamedTuple):
    """What is written at given instants."""

    time: F1
    state: F2
    total: F2
    mode: I2
    memory: F2
    reference: F2


class StepRecord(NamedTuple):
    """Samples at ends of steps, after which events follow, and at what is located inside steps; no rows: not wanted."""

    time: F1
    state: F2
    total: F2
    mode: I2
    memory: F2
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


def make_state(
    y: np.ndarray,
    *,
    mode: np.ndarray,
    memory: np.ndarray,
    reference: np.ndarray,
    quadratures: int,
    monitors: int,
    band: np.ndarray | None = None,
    history: np.ndarray | None = None,
    history_length: np.ndarray | None = None,
) -> State:
    """The state at the start y of an integration at t = 0."""
    rows = mode.size + monitors
    limits = np.zeros((monitors, 3))
    limits[:, LIMIT] = np.inf if band is None else band
    state = State(
        clock=np.zeros(1, CLOCK),
        counts=np.zeros(1, COUNTS),
        y=np.zeros(y.size),
        mode=mode,
        memory=memory,
        reference=reference,
        total=np.zeros(quadratures),
        monitored=np.zeros((rows, MONITORED)),
        peak=np.zeros((rows, PEAK_COLUMNS)),
        band=limits,
        history=np.zeros((0, 2)) if history is None else history,
        history_length=np.zeros(1, np.int64) if history_length is None else history_length,
    )
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
    atol: np.ndarray,
    rtol: np.ndarray,
    rounding: np.ndarray | None = None,
    group: np.ndarray,
    precision: np.ndarray,
    crossable: np.ndarray,
    reads: tuple[np.ndarray, np.ndarray] | None = None,
    companion: np.ndarray | None = None,
    delays: tuple[float, ...] = (),
) -> Work:
    """Scratch for an integration."""
    size, guards, quadratures = state.y.size, state.mode.size, state.total.size
    points = max(method.gauss.size + 2, method.nodes.size) + SPARE_ROWS
    numbers = np.zeros((10, guards))
    crossings = 8 * guards
    everything = np.zeros(state.monitored.shape[0] + 1, np.int64), np.zeros(0, np.int64)
    reads_start, listed = everything if reads is None else reads
    return Work(
        atol=atol,
        rtol=rtol,
        rounding=np.zeros(size) if rounding is None else rounding,
        group=group,
        precision=precision,
        crossable=crossable,
        new=np.zeros(size),
        inside=np.zeros(size),
        saved=np.zeros(size),
        stages=np.zeros((method.nodes.size, size)),
        estimate=np.zeros((2, size)),
        dense=np.zeros((method.pattern.size, size)),
        slope=np.zeros(size),
        slope_t=np.zeros(size),
        value=numbers[0],
        rate=numbers[1],
        left_value=numbers[2],
        left_rate=numbers[3],
        right_value=numbers[4],
        right_rate=numbers[5],
        end_value=numbers[6],
        end_rate=numbers[7],
        start_value=numbers[8],
        start_rate=numbers[9],
        ends=np.zeros((HALVINGS + 1, 4)),
        saved_mode=np.zeros(guards, np.int64),
        trial_mode=np.zeros(guards, np.int64),
        trial_memory=np.zeros(guards),
        crossing_guard=np.zeros(crossings, np.int64),
        crossing_place=np.zeros(crossings),
        crossing_count=np.zeros(1, np.int64),
        rise_guard=np.zeros(crossings, np.int64),
        rise_place=np.zeros(crossings),
        rise_data=np.zeros((crossings, RESET_DATA)),
        rise_count=np.zeros(1, np.int64),
        power=np.zeros((max(method.gauss.size + 1, method.nodes.size), quadratures)),
        power_at_start=np.zeros(quadratures),
        gain=np.zeros((method.pattern.size, quadratures)),
        monitored=np.zeros((points, state.monitored.shape[0], MONITORED)),
        reads_start=reads_start,
        reads=listed,
        companion=np.full(guards, -1) if companion is None else companion,
        delays=np.array(delays, float),
        signals=np.zeros((NODES.size, (state.history.shape[1] - 2) // NODES.size)),
        accepted=np.zeros(3),
        scaling=np.zeros(1, np.int64),
        has_dense=np.zeros(1, np.int64),
    )


def make_samples(time: np.ndarray, state: State) -> Samples:
    """Room for samples at increasing instants."""
    rows, guards = time.size, state.mode.size
    return Samples(
        time=time,
        state=np.full((rows, state.y.size), np.nan),
        total=np.full((rows, state.total.size), np.nan),
        mode=np.zeros((rows, guards), np.int64),
        memory=np.zeros((rows, guards)),
        reference=np.zeros((rows, state.reference.size)),
    )


def make_record(rows: int, state: State, *, inside: bool = False) -> StepRecord:
    """Room for so many rows."""
    samples = make_samples(np.zeros(rows), state)
    return StepRecord(*samples, np.zeros(rows, np.int64), np.ones(1, np.int64), np.array([int(inside)]))
