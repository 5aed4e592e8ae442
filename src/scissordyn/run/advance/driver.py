"""Driver: the object that advances a mechanism, with model, parameters, state, workspace and method."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from scissordyn.errors import InputError
from scissordyn.integrate import advance as loop
from scissordyn.integrate.history import make_history
from scissordyn.integrate.integration import (
    ENDS,
    LOG_COLUMNS,
    STATE_TYPES,
    Integration,
    Samples,
    State,
    StepRecord,
    make_record,
    make_samples,
    make_state,
    make_work,
    reset_state,
)
from scissordyn.integrate.method import tableau
from scissordyn.kernel import Handle, Template
from scissordyn.mechanics import functions
from scissordyn.mechanics.monitored import BALANCED, TRACK_DEVIATION, entries_read
from scissordyn.mechanics.system import Parameters, System
from scissordyn.mechanics.worn_contact import LOAD_DIRECTIONS
from scissordyn.plan.plan import Plan
from scissordyn.record.trajectory import BAND, LOG, PEAK, by_name
from scissordyn.run.advance.system import Stepping
from scissordyn.run.advance.tolerance import Tolerances

FIRST_STEPS = 200  # number of time steps in the first call of the compiled loop; `loop.next_slice` gives that of later calls


@dataclass(frozen=True)
class Snapshot:
    """Complete copy of an integrator's state, from which the run continues bit for bit."""

    arrays: dict[str, np.ndarray]  # by the names of `integration.State`

    @property
    def time(self) -> float:
        return float(self.arrays["clock"]["time"][0])

    @property
    def y(self) -> np.ndarray:
        """Free coordinates, their rates and internal states, shape (ny,)."""
        return self.arrays["y"]

    @property
    def mode(self) -> np.ndarray:
        """Modes of the guards, 1 for an active guard, shape (guards,)."""
        return self.arrays["mode"]

    def changed(self, **arrays: np.ndarray) -> Snapshot:
        return Snapshot({name: np.array(arrays.get(name, part)) for name, part in self.arrays.items()})

    def plain(self) -> dict[str, np.ndarray]:
        """Return the state as arrays of floats for storage; every value is kept bit for bit."""
        return {
            name: part if part.dtype.names is None else np.array([float(part[field][0]) for field in part.dtype.names])
            for name, part in self.arrays.items()
        }

    @classmethod
    def from_plain(cls, arrays: Mapping[str, np.ndarray]) -> Snapshot:
        """Return the state from the arrays that `plain` has returned, for example from a file."""
        state: dict[str, np.ndarray] = {}
        for name, kind in STATE_TYPES.items():
            if name not in arrays:
                raise InputError(f"the saved state has no '{name}'", "a state that this version of scissordyn wrote")
            part = np.asarray(arrays[name])
            if kind.names is None:
                state[name] = np.ascontiguousarray(part, kind)
                continue
            if part.shape != (len(kind.names),):
                raise InputError(f"'{name}' of the saved state has the shape {part.shape}", f"the shape ({len(kind.names)},)")
            state[name] = np.zeros(1, kind)
            for field, number in zip(kind.names, part.tolist(), strict=True):
                state[name][field] = number
        return cls(state)


@dataclass(frozen=True)
class Choice:
    """Integration method of a driver, and the reason for its choice."""

    method: str
    reason: str
    step: float = 0.0  # [s] step of time stepping; 0 for other methods
    # longest step [s] if the fastest body rotates at 1 rad/s (proportional to the power -4/3 of this speed), and largest
    # rotation in a step [rad]; infinite if the user gave the step
    turn: tuple[float, float] = (math.inf, math.inf)
    fixed: float = 0.0  # [s] size of every step of another method; 0 if the error control chooses it


class Driver:
    """Arrays of a mechanism that the time loop advances; a batch reuses one driver for several cases."""

    def __init__(
        self, plan: Plan, system: Handle, size: int, method: Choice, tolerances: Tolerances, *, loads: bool = False
    ) -> None:
        """Allocate the arrays for a state of `size` entries; `begin` starts a case.

        `loads` integrates the loads on worn bearings by angle (`worn_contact.add_loads`).
        """
        self.plan, self.system, self.method = plan, system, method.method
        self.stepping = Stepping(plan) if method.step > 0.0 else None
        self.slice_steps, self._most = FIRST_STEPS, np.inf
        content: System = system.content
        signals = content.state.initial_history.size
        if signals:
            system.exchange("state", history=make_history(signals))
        blocks = int(content.parameters.contact["loads"].sum()) if loads else 0
        key = f"driver {method.method} {size} {blocks} {tolerances.delays}"
        mechanism = {f"State.{name}": getattr(system.content.state, name) for name in SHARED_STATE}
        make = partial(_integration, plan, system, size, method, tolerances, blocks)
        template = plan.template(key, lambda: Template(make(), {"Integration.method", *mechanism}))
        self.integration = Handle(make()) if template is None else template.copy(mechanism)

    def begin(
        self,
        plan: Plan,
        y: np.ndarray,
        method: Choice,
        tolerances: Tolerances,
        crosses: int = ENDS,
        initial_events: Sequence[Sequence[float]] = (),
    ) -> None:
        """Begin to integrate a case of the same model and method from the state y; with delays, only one case can begin.

        The parameters of the case must already be in the system. `crosses` is `ENDS`, `CROSSES` or `IGNORES`. `initial_events`
        are the rows of the event log for events at the start.
        """
        self.plan, content = plan, self.integration.content
        state, work = content.state, content.work
        if self.system.content.state.initial_history.size:
            fill_history(self.system, y)
        if self.stepping is not None:
            self.stepping.begin(plan, method.step, method.turn, located=crosses == ENDS)
        work.atol[:], work.rtol[:], work.rounding[:] = tolerances.weights(content.method.kind)
        work.precision[:], work.crossable[:] = tolerances.precision, tolerances.crossable
        work.has_dense[0] = work.scaling[0] = work.crossing_count[0] = work.rise_count[0] = 0
        reset_state(state, y, crosses=crosses, fixed=method.fixed, integral=tolerances.integral, inertia=tolerances.inertia)
        self.band["limit"] = self._limits()
        while len(initial_events) > len(self.integration.content.log):
            self.grow(loop.LOG_FULL)
        for row, event in enumerate(initial_events):
            self.integration.content.log[row] = event
        state.counts["events"] = len(initial_events)
        # the start is accepted like the end of a step
        functions.activate(self.system.address)
        self.change_points: list[tuple[float, float]] = []
        self.system.content.work.near[:] = 0.0, 1.0, np.inf, -np.inf
        functions.accept(0.0, state.y, self.system.address, work.accepted)
        state.clock["longest"] = work.accepted[1]

    @property
    def addresses(self) -> tuple[int, int, int, int]:
        """Addresses of the system, hard contacts and touching contacts (both 0 without hard contacts), and integration."""
        stepping = self.stepping
        hard, touching = (0, 0) if stepping is None else (stepping.hard.address, stepping.touching.address)
        return self.system.address, hard, touching, self.integration.address

    @property
    def state(self) -> State:
        """The integrator's state; its arrays are live."""
        state: State = self.integration.content.state
        return state

    @property
    def time(self) -> float:
        return float(self.state.clock["time"][0])

    @property
    def log(self) -> np.ndarray:
        """Events so far, with the columns of `LOG`; a view."""
        return by_name(self._events, LOG)

    @property
    def _events(self) -> np.ndarray:
        return np.asarray(self.integration.content.log[: int(self.state.counts["events"][0])])

    @property
    def peak(self) -> np.ndarray:
        """Largest values so far, with the columns of `PEAK`; a view."""
        return by_name(self.state.peak, PEAK)

    @property
    def band(self) -> np.ndarray:
        """Values near their limits so far, with the columns of `BAND`; a view."""
        return by_name(self.state.band, BAND)

    @property
    def samples(self) -> Samples:
        written: Samples = self.integration.content.samples
        reached = int(self.state.counts["samples"][0])
        return Samples(*(part[:reached] for part in written))

    @property
    def recorded(self) -> StepRecord:
        """Recorded ends of steps and located instants inside steps so far."""
        steps: StepRecord = self.integration.content.steps
        count = int(self.state.counts["recorded"][0])
        return steps._replace(**{name: part[:count] for name, part in _rows_of(steps)})

    def rows(self, kind: int) -> np.ndarray:
        """Return the row indices of the quantities of one kind, in arrays of guards followed by monitored quantities."""
        return self.plan.monitored_rows(kind)

    def _limits(self) -> np.ndarray:
        """Return the limit of each monitored quantity: the tolerance of a tracked point, or infinity."""
        model, tracks = self.system.content.model, self.plan.mechanism.tracks
        limits = np.full(model.monitor.shape[0], np.inf)
        if tracks:
            tolerances = [np.inf if track.tolerance is None else track.tolerance for track in tracks]
            limits[self.rows(TRACK_DEVIATION) - model.guard_component.size] = tolerances
        return limits

    def _exchange(self, **parts: Any) -> None:
        self.integration.replace(**parts)

    def sample_at(self, times: np.ndarray) -> None:
        self._exchange(samples=make_samples(np.array(times, float), self.state))
        self.state.counts["samples"] = 0

    def compare_with(self, table: np.ndarray, step: float) -> None:
        """Monitor the distance of tracked points from their ideal positions.

        `table` has the ideal motion at instants `step` [s] apart, shape (instants, 6 tracks).
        """
        self.system.exchange("parameters", ideal=table, ideal_step=np.array([step]))

    def record_steps(self, *, inside: bool = False, most: float = np.inf) -> None:
        """Record the ends of steps from now on, and with `inside` also events and largest values.

        When there are `most` rows, every second end of a step is dropped.
        """
        self._exchange(steps=make_record(1024, self.state, inside=inside))
        self.state.counts["recorded"], self._most = 0, most

    def monitor(self, on: bool) -> None:
        """Switch the integration of powers and the monitoring on or off; the motion does not depend on it."""
        clock = self.state.clock
        if bool(clock["monitors"][0]) != on:
            clock["monitors"], clock["prepared"] = int(on), 0

    def clear_record(self) -> None:
        """Delete events, totals and peaks so far, and the history that delayed feedback no longer needs.

        Peaks and integrals of a contact that is closed now start from zero.
        """
        self.state.counts["events"] = 0
        self.state.total[:] = self.state.peak[:] = 0.0
        self.peak["largest_time"] = self.time
        delays = self.integration.content.work.delays
        if delays.size:
            history, length = self.state.history, int(self.state.history_length[0])
            old = int(np.sum(history[:length, 0] + history[:length, 1] < self.time - 1.001 * float(np.max(delays))))
            history[: length - old] = history[old:length].copy()
            self.state.history_length[0] = length - old

    @property
    def steps_tried(self) -> int:
        """Number of steps so far, rejected ones included."""
        counts = self.state.counts
        return int(counts["steps"][0] + counts["rejected"][0])

    def grow(self, status: int) -> None:
        content = self.integration.content
        if status == loop.LOG_FULL:
            self._exchange(log=_longer(content.log))
        elif status == loop.RECORD_FULL:
            if len(content.steps.time) >= self._most and self._thin_out():
                return
            factor = 2 if len(content.steps.time) >= self._most else 4
            longer = {name: _longer(part, factor) for name, part in _rows_of(content.steps)}
            self._exchange(steps=content.steps._replace(**longer))
        else:
            history = _longer(content.state.history)
            self.system.exchange("state", history=history)
            self._exchange(state=content.state._replace(history=history))

    def _thin_out(self) -> bool:
        """Drop every second recorded end of a step without event or largest value; return True if enough rows are free then."""
        steps, log = self.integration.content.steps, self.log
        count = int(self.state.counts["recorded"][0])
        event_times = np.concatenate([log["time"], log["largest_time"], log["whole_time"], self.peak["largest_time"]])
        is_kept = np.isin(steps.time[:count], event_times)
        others = np.flatnonzero(~is_kept)
        is_kept[others[::2]] = True
        rows = np.flatnonzero(is_kept)
        if rows.size > 0.75 * len(steps.time):
            return False
        for _, part in _rows_of(steps):
            part[: rows.size] = part[rows]
        steps.every[0] *= 2
        self.state.counts["recorded"] = rows.size
        return True

    def snapshot(self) -> Snapshot:
        """Return a copy of the state."""
        arrays = {name: np.array(part) for name, part in self.state._asdict().items()}
        arrays["history"] = arrays["history"][: int(arrays["history_length"][0])]
        return Snapshot(arrays)

    def restore(self, snapshot: Snapshot) -> None:
        """Copy a snapshot into the driver; it must be of this mechanism, or of one that differs in parameters only."""
        self._put({f"state.{name}": part for name, part in snapshot.arrays.items()})
        self.state.clock["prepared"] = 0
        if self.stepping is not None:
            self.stepping.forget()
        functions.activate(self.system.address)

    def arrays(self) -> dict[str, np.ndarray]:
        """Return live arrays of everything that determines the further motion or has been recorded, by name."""
        content, state = self.integration.content, self.state
        parts = {"state": state, "work": content.work, "workspace": self.system.content.work}
        parts |= {"samples": self.samples, "steps": self.recorded}
        arrays = {f"{owner}.{name}": array for owner, part in parts.items() for name, array in part._asdict().items()}
        arrays["state.history"] = state.history[: int(state.history_length[0])]
        return arrays | ({} if self.stepping is None else self.stepping.arrays()) | {"log": self._events}

    def load_arrays(self, arrays: Mapping[str, np.ndarray]) -> None:
        """Restore the arrays that `arrays` returned; the driver must be made in the same way and continues bit for bit."""
        names = self.arrays().keys()
        if arrays.keys() != names:
            name = min(names ^ arrays.keys())
            raise InputError(
                f"the saved state has {'no' if name in names else 'an unknown'} '{name}'",
                "a state of the same mechanism, options and version",
            )
        self._put(arrays)

    def _put(self, arrays: Mapping[str, np.ndarray]) -> None:
        """Copy arrays into the driver, by the names of `arrays`; grow the stores that are too short."""
        for name, status in (("state.history", loop.HISTORY_FULL), ("steps.time", loop.RECORD_FULL), ("log", loop.LOG_FULL)):
            while len(arrays.get(name, ())) > len(self._store(name)) > 0:
                self.grow(status)
        for name, stored in arrays.items():
            place = self._store(name)
            if name == "state.history" or name.partition(".")[0] in ("samples", "steps", "log"):
                place = place[: len(stored)]
            if place.shape != stored.shape:
                raise InputError(
                    f"a state with shape {stored.shape} for '{name.rpartition('.')[2]}'",
                    f"the shape {place.shape}, a state of this mechanism",
                )
            place[...] = stored

    def _store(self, name: str) -> np.ndarray:
        """Return an array of the driver by its name in `arrays`, with the rows that are not used yet."""
        owner, _, part = name.partition(".")
        owners = {"workspace": self.system.content.work, "hard": self.stepping and self.stepping.content.state}
        source = owners.get(owner) or getattr(self.integration.content, owner)
        return np.asarray(getattr(source, part) if part else source)

    def bind(self, parameters: Parameters) -> None:
        """Replace the parameters of the model; the state stays the same."""
        self.system = Handle(self.system.content._replace(parameters=parameters))
        self.system.content.work.instant[:] = np.nan
        self.state.clock["prepared"] = 0


SHARED_STATE = ("mode", "memory", "mass", "reference", "history", "history_length")
"""Names of the arrays of `integration.State` that belong to the mechanism, not to the integration method."""


def _integration(plan: Plan, system: Handle, size: int, method: Choice, tolerances: Tolerances, blocks: int) -> Integration:
    """Return new arrays of a driver; `blocks` is the number of loads on worn bearings."""
    content: System = system.content
    model = content.model
    state = make_state(
        np.zeros(size),
        quadratures=BALANCED + LOAD_DIRECTIONS * blocks,
        monitors=model.monitor.shape[0],
        **{name: getattr(content.state, name) for name in SHARED_STATE},
    )
    coefficients = tableau("dopri5" if method.step > 0.0 else method.method)  # time stepping needs few stages
    absolute, relative, rounding = tolerances.weights(coefficients.kind)
    work = make_work(
        state,
        coefficients,
        atol=absolute,
        rtol=relative,
        rounding=rounding,
        group=tolerances.group,
        precision=tolerances.precision,
        crossable=tolerances.crossable,
        reads=entries_read(model, len(plan.contacts)),
        companion=plan.companions,
        delays=tolerances.delays,
    )
    log = np.zeros((256 + 4 * model.guard_component.size, LOG_COLUMNS))
    samples, record = make_samples(np.zeros(0), state), make_record(0, state)
    return Integration(coefficients, state, work, samples, record, log)


def _longer(rows: np.ndarray, factor: int = 2) -> np.ndarray:
    """Return an array with `factor` times as many rows; rows that are not written yet use no memory."""
    longer = np.zeros((factor * len(rows), *rows.shape[1:]), rows.dtype)
    longer[: len(rows)] = rows
    return longer


def _rows_of(steps: StepRecord) -> list[tuple[str, np.ndarray]]:
    return [(name, getattr(steps, name)) for name in (*Samples._fields, "end")]


def fill_history(system: Handle, y: np.ndarray) -> None:
    """Fill the history of delayed signals before the start with the constant S that satisfies S = y + R S.

    The right side is linear in S; its values at S = 0 and S = 1 determine the solution.
    """
    past = system.content.state.initial_history
    answers = np.zeros((2, past.size))
    for value, answer in enumerate(answers):
        past[:] = float(value)
        functions.record(0.0, y, system.address, answer)
    past[:] = answers[0] / (1.0 - (answers[1] - answers[0]))


def count_steps(state: State) -> dict[str, int]:
    counts = state.counts[0]
    return {name: int(counts[name]) for name in ("steps", "rejected", "rates", "jacobians", "events")}
