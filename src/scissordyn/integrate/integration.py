"""Define the functions of a problem and the arrays of an integration: its state, its scratch, and its records."""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple, get_args

import numpy as np

from scissordyn.integrate.history import CHEBYSHEV_NODES
from scissordyn.integrate.tableau import Tableau, arrays_of
from scissordyn.kernel import F1, F2, F3, I1, I2, ArrayType, fields_of, opener

MONITORED_VALUES = 3  # Monitored values of a row: the largest value of the first is kept, and all are integrated
RESET_DATA = 3  # Number of values that a reset may write into the event log
SPARE_ROWS = 4  # Rows of `Work.monitored` for points inside a step: three equidistant ones, and one for the search of a maximum
HALVINGS_MAX = 12  # Largest number of bisections between two probes of a guard that may rise and fall in between

TIME, GUARD, MODE, DATA = range(4)
ENDED = DATA + RESET_DATA
"""Columns of the event log: instant, guard, new mode, data of the reset from `DATA` on, and the peak from `ENDED` on."""

LARGEST, WHEN, INTEGRAL = range(3)
STRUCK = INTEGRAL + MONITORED_VALUES
PEAK_COLUMNS = STRUCK + 2
"""Number of columns of `State.peak`: largest value, instant, integrals from `INTEGRAL` on, a second value and its instant.

The second value is the largest impact if the state jumps, otherwise the largest value of the guard's companion, another
monitored quantity that is logged with it.
"""

LIMIT, LAST_ABOVE, FIRST_WITHIN = range(3)  # Columns of `State.band`

LOG_COLUMNS = ENDED + PEAK_COLUMNS  # Number of columns of the event log

NO_EVENT, FALL, RISE = -1, 0, 1  # Kinds of events; a rise ends in mode 1, a fall in mode 0

ENDS, CROSSES, IGNORES = range(3)
"""Treatment of guards' roots: end the step there, cross them if the error allows, or ignore them until the end of the step."""

CLOCK = np.dtype(
    [
        ("time", "f8"),
        ("end", "f8"),
        ("step", "f8"),  # size to try next
        ("after_rise", "f8"),  # size of the last successful step after a rise of a guard, 0 before the first rise
        ("after_fall", "f8"),  # size of the last successful step after a fall of a guard
        ("previous_step", "f8"),  # size of the last step with even time
        ("previous_error", "f8"),  # error of the last step with even time
        ("reach", "f8"),  # longest trial step that should end on the fall of a guard
        ("longest", "f8"),  # longest step that the problem allows now
        ("first", "f8"),  # size of the first step
        ("fixed", "f8"),  # size of every step, 0 for error control
        ("integral", "f8"),  # relative tolerance of integrals, 0 if the motion shows their errors
        ("inertia", "f8"),  # scale of the integrals times the square of the end, [kg m^2] of energies
        ("last_event", "i8"),  # kind of event before the next step: `NO_EVENT`, `FALL` or `RISE`
        ("touching", "i8"),  # 1 if the method is explicit and a guard is in mode 1
        ("rejected", "i8"),  # 1 if the last trial was rejected
        # values available at the start of the next step: `step.NOTHING`, `step.OUTPUTS` or `step.EVERYTHING`
        ("prepared", "i8"),
        ("stalled", "i8"),  # trials and events without progress in time
        ("crosses", "i8"),  # treatment of guards' roots: `ENDS`, `CROSSES` or `IGNORES`
        ("monitors", "i8"),  # 1 if powers are integrated and values monitored
    ]
)
# Counters: accepted and rejected steps, evaluations of the rates and Jacobians, entries of the log and of the samples
COUNTS = np.dtype([(name, "i8") for name in ("steps", "rejected", "rates", "jacobians", "events", "samples", "recorded")])

ClockArray = Annotated[np.ndarray, ArrayType(CLOCK, 1)]
CountsArray = Annotated[np.ndarray, ArrayType(COUNTS, 1)]


class Problem(NamedTuple):
    """Functions of a problem, as described in `advance`."""

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
    """Complete state of an integration.

    The arrays `mode`, `memory`, `mass`, `reference`, `history` and `history_length` belong to the problem, which shares them.
    Annotations give the sizes of arrays that are created here. A row of `monitored` is a guard or, after the guards, a
    quantity that is always monitored.
    """

    clock: Annotated[ClockArray, 1]
    counts: Annotated[CountsArray, 1]
    y: Annotated[F1, "y"]
    mode: I1  # (guards,) 0: the guard's value must rise through zero, 1: it must fall
    memory: F1  # (guards,) value that belongs to the mode
    mass: F1  # (guards,) second value that belongs to the mode
    reference: F1  # angles including full turns
    total: Annotated[F1, "quadratures"]
    monitored: Annotated[F2, "rows", MONITORED_VALUES]  # at the present instant
    peak: Annotated[F2, "rows", PEAK_COLUMNS]  # since the last rise
    band: Annotated[F2, "monitors", 3]
    history: Annotated[F2, 0, 2]  # (steps, 2 + signals * coefficients), see `history`
    history_length: Annotated[I1, 1]


STATE_TYPES: dict[str, np.dtype] = {name: get_args(kind)[1].dtype for name, kind in fields_of(State)}
"""Types of the state's arrays; saving, restoring, comparing and checkpoints use this table."""


class Work(NamedTuple):
    """Error weights and scratch arrays."""

    atol: F1  # (ny,) weight of an error = atol + rtol * root mean square of its group + rounding / h
    rtol: F1
    rounding: Annotated[F1, "y"]  # change of y in a step by round-off of other components, times h
    group: I1  # boundaries of the groups
    precision: F1  # (guards,) magnitude below which a guard is at its root
    crossable: I1  # (guards,) 1 if a step may cross the guard's roots under error control
    new: Annotated[F1, "y"]
    inside: Annotated[F1, "y"]
    saved: Annotated[F1, "y"]
    stages: Annotated[F2, "stages", "y"]
    estimate: Annotated[F2, 2, "y"]  # error estimates
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
    # intervals still to be searched for a crossing: theta at their ends, value, rate and the cubic's error
    ends: Annotated[F2, HALVINGS_MAX + 1, 4]
    saved_mode: Annotated[I1, "guards"]
    trial_mode: Annotated[I1, "guards"]
    trial_memory: Annotated[F1, "guards"]
    trial_mass: Annotated[F1, "guards"]
    crossing_guard: Annotated[I1, "crossings"]  # guards crossed inside the step, in order
    crossing_place: Annotated[F1, "crossings"]  # theta of these crossings
    crossing_count: Annotated[I1, 1]
    rise_guard: Annotated[I1, "crossings"]  # guards that rise inside a step that crosses their roots
    rise_place: Annotated[F1, "crossings"]
    rise_data: Annotated[F2, "crossings", RESET_DATA]
    rise_count: Annotated[I1, 1]
    power: Annotated[F2, "evaluations", "quadratures"]  # at the stages (explicit), or at the nodes and the end
    power_at_start: Annotated[F1, "quadratures"]
    gain: Annotated[F2, "terms", "quadratures"]  # dense output of the integrals of an explicit step
    # (explicit) stages, or start, nodes and end; then `SPARE_ROWS`
    monitored: Annotated[F3, "points", "rows", MONITORED_VALUES]
    reads_start: I1  # (rows+1,) ranges in `reads`; an empty range means all entries of y
    reads: I1  # entries of y that a guard or a monitored row depends on
    companion: I1  # (guards,) monitored row whose largest value is logged with the guard's, -1 for none
    delays: F1  # (delays,) steps end on their multiples
    signals: Annotated[F2, CHEBYSHEV_NODES.size, "signals"]
    # output of `accept`: whether the state changed, the longest next step [s], the fastest rotation [1/s]
    accepted: Annotated[F1, 3]
    scaling: Annotated[I1, 1]  # kind of time inside the present step, see `step.fraction`
    has_dense: Annotated[I1, 1]  # 1 if the dense output of the present step is complete


class Samples(NamedTuple):
    """Samples at given instants."""

    time: Annotated[F1, "samples"]
    state: Annotated[F2, "samples", "y"]
    total: Annotated[F2, "samples", "quadratures"]
    mode: Annotated[I2, "samples", "guards"]
    memory: Annotated[F2, "samples", "guards"]
    mass: Annotated[F2, "samples", "guards"]
    reference: Annotated[F2, "samples", "angles"]


class StepRecord(NamedTuple):
    """States recorded at ends of steps, before the events there, and at located instants inside steps.

    The arrays have no rows if nothing is to be recorded.
    """

    time: F1
    state: F2
    total: F2
    mode: I2
    memory: F2
    mass: F2
    reference: F2
    end: I1  # (rows,) 1 for the end of a step
    every: I1  # (1,) one end of this number of steps is kept, in addition to events
    inside: I1  # (1,) 1 if events and largest values inside steps are kept


class Integration(NamedTuple):
    """All arrays that the loop uses; the loop gets the address of this tuple."""

    method: Tableau
    state: State
    work: Work
    samples: Samples
    steps: StepRecord
    log: F2


open_integration = opener(Integration)  # Kernel function from the address of an integration's handle to the integration


def make_state(y: np.ndarray, *, quadratures: int, monitors: int, band: np.ndarray | None = None, **own: np.ndarray) -> State:
    """Return the state of an integration at the start y and t = 0; `own` are the arrays of the problem."""
    sizes = {"y": y.size, "quadratures": quadratures, "monitors": monitors, "rows": own["mode"].size + monitors}
    state = State(**arrays_of(State, sizes, own))
    state.band[:, LIMIT] = np.inf if band is None else band
    reset_state(state, y)
    return state


def reset_state(
    state: State, y: np.ndarray, *, crosses: int = ENDS, fixed: float = 0.0, integral: float = 0.0, inertia: float = 0.0
) -> None:
    """Restart at the state y and t = 0; arrays of the problem stay as they are."""
    state.clock[:], state.counts[:] = 0, 0
    state.clock["last_event"], state.clock["reach"], state.clock["longest"] = NO_EVENT, np.inf, np.inf
    state.clock["crosses"], state.clock["fixed"], state.clock["monitors"] = crosses, fixed, 1
    state.clock["integral"], state.clock["inertia"] = integral, inertia
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
    """Return the scratch of an integration; `weights` are the error weights, and `companion` if guards have companions."""
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
        "signals": (state.history.shape[1] - 2) // CHEBYSHEV_NODES.size,
    }
    reads_start, listed = (np.zeros(rows + 1, np.int64), np.zeros(0, np.int64)) if reads is None else reads
    ready = {"companion": np.full(guards, -1), "reads_start": reads_start, "reads": listed, "delays": np.array(delays, float)}
    return Work(**arrays_of(Work, sizes, ready | weights))


def make_samples(time: np.ndarray, state: State) -> Samples:
    samples = _zero_samples(time, state)
    samples.state[:], samples.total[:] = np.nan, np.nan
    return samples


def _zero_samples(time: np.ndarray, state: State) -> Samples:
    sizes = {"samples": time.size, "y": state.y.size, "quadratures": state.total.size}
    sizes |= {"guards": state.mode.size, "angles": state.reference.size}
    return Samples(**arrays_of(Samples, sizes, {"time": time}))


def make_record(rows: int, state: State, *, inside: bool = False) -> StepRecord:
    """Return a record without steps; rows that are not written yet use no memory."""
    samples = _zero_samples(np.zeros(rows), state)
    return StepRecord(*samples, np.zeros(rows, np.int64), np.ones(1, np.int64), np.array([int(inside)]))
