"""The one object that advances a mechanism: a model, the parameters of a case, a state, a workspace and a method."""

from __future__ import annotations

import time as clocks
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from scissordyn.errors import InputError
from scissordyn.integrate import advance as loop
from scissordyn.integrate.history import make_history
from scissordyn.integrate.integration import (
    ENDS,
    LOG_COLUMNS,
    Integration,
    Samples,
    State,
    make_record,
    make_samples,
    make_state,
    make_work,
    reset_state,
)
from scissordyn.integrate.tableau import tableau
from scissordyn.kernel import Handle
from scissordyn.mechanics import functions
from scissordyn.mechanics.monitored import POWERS, TRACK_DEVIATION, companions, entries_read, monitored_rows
from scissordyn.mechanics.system import Parameters, System
from scissordyn.mechanics.workspace import initial_state, make_workspace
from scissordyn.plan.plan import Plan
from scissordyn.run.advance.change_point import step_across
from scissordyn.run.advance.interrupt import look
from scissordyn.run.advance.log import BAND, LOG, PEAK, by_name
from scissordyn.run.advance.loop import advance_systems
from scissordyn.run.advance.slice import FIRST, next_slice
from scissordyn.run.advance.snapshot import Snapshot
from scissordyn.run.start.tolerance import Tolerances

if TYPE_CHECKING:
    from scissordyn.run.advance.stepping import Stepping
    from scissordyn.run.start.method import Choice

SLICE = 20_000
"""Most steps between two looks at the keyboard and the progress bar; the steps themselves do not depend on it."""

LOG_ROWS = 256
RECORD_ROWS = 1024


def advance_together(drivers: Sequence[Driver], until: float, most_steps: int) -> list[int]:
    """Go on until a time with some drivers, in one call of the loop."""
    for driver in drivers:
        driver.state.clock["end"] = until
    found = [0] * len(drivers)
    for stepped in (False, True):
        places = [k for k, driver in enumerate(drivers) if (driver.stepping is not None) is stepped]
        if places:
            for k, status in zip(places, _advance([drivers[k] for k in places], most_steps), strict=True):
                found[k] = status
    return found


def _advance(drivers: Sequence[Driver], most_steps: int) -> list[int]:
    """The same for drivers of one loop."""
    steppings = [driver.stepping for driver in drivers if driver.stepping is not None]
    if steppings:
        from scissordyn.run.advance.stepping import advance_stepping  # compiles its loop

        return advance_stepping(drivers, steppings, most_steps)
    statuses = np.zeros(len(drivers), np.int64)
    systems = np.array([driver.system.address for driver in drivers], np.int64)
    integrations = np.array([driver.integration.address for driver in drivers], np.int64)
    advance_systems(systems, integrations, most_steps, statuses)
    finished: list[int] = statuses.tolist()
    return finished


def make_system(plan: Plan) -> Handle:
    """A system at rest with everything open, for one thread."""
    model, numbers = plan.model, plan.numbers()
    state, work = initial_state(model, plan.angles), make_workspace(model, numbers)
    return Handle(System(model, numbers, state, work, plan.friction_workspace()))


class Driver:
    """A mechanism on its way through time.

    Shapes: `y` (ny,).
    """

    def __init__(
        self,
        plan: Plan,
        system: Handle,
        y: np.ndarray,
        *,
        method: Choice,
        tolerances: Tolerances,
        crosses: int = ENDS,
        initial_events: tuple[list[float], ...] = (),
    ) -> None:
        self.plan, self.system, self.method = plan, system, method.method
        self.stepping: Stepping | None = None
        self._pace, self._rows = FIRST, dict[int, np.ndarray]()
        content: System = system.content
        state, model = content.state, content.model
        signals = state.initial_history.size
        if signals:
            system.exchange("state", history=make_history(signals))
            _fill_history(system, y)
            state = system.content.state
        integrated = make_state(
            y,
            mode=state.mode,
            memory=state.memory,
            reference=state.reference,
            quadratures=len(POWERS),
            monitors=model.monitor.shape[0],
            band=self._limits(),
            history=state.history,
            history_length=state.history_length,
        )
        integrated.clock["crosses"], integrated.clock["fixed"] = crosses, method.fixed
        coefficients = tableau(_stores(method))
        absolute, relative, rounding = tolerances.weights(coefficients.kind)
        work = make_work(
            integrated,
            coefficients,
            atol=absolute,
            rtol=relative,
            rounding=rounding,
            group=tolerances.group,
            precision=tolerances.precision,
            crossable=tolerances.crossable,
            reads=entries_read(model, len(plan.contacts)),
            companion=companions(model),
            delays=tolerances.delays,
        )
        log = np.zeros((LOG_ROWS + 4 * model.guard_component.size + len(initial_events), LOG_COLUMNS))
        samples, record = make_samples(np.zeros(0), integrated), make_record(0, integrated)
        self.integration = Handle(Integration(coefficients, integrated, work, samples, record, log))
        if method.step > 0.0:
            from scissordyn.run.advance.stepping import Stepping  # loads the kernels of hard contact

            self.stepping = Stepping(plan, method.step, method.turn, located=crosses == ENDS)
        self._begin(initial_events)

    def restart(
        self,
        plan: Plan,
        y: np.ndarray,
        tolerances: Tolerances,
        *,
        crosses: int = ENDS,
        initial_events: tuple[list[float], ...] = (),
        choice: Choice | None = None,
    ) -> None:
        """Begin another case of the same model without delays, whose numbers `put_numbers` has put in place.

        Shapes: `y` (ny,).
        """
        self.plan = plan
        if self.stepping is not None and choice is not None:
            self.stepping.restart(plan, choice.step, choice.turn)
        content = self.integration.content
        work = content.work
        work.atol[:], work.rtol[:], work.rounding[:] = tolerances.weights(content.method.kind)
        work.precision[:], work.crossable[:] = tolerances.precision, tolerances.crossable
        work.has_dense[0] = work.scaling[0] = work.crossing_count[0] = work.rise_count[0] = 0
        reset_state(content.state, y, crosses=crosses, fixed=0.0 if choice is None else choice.fixed)
        self.band["limit"] = self._limits()
        if len(initial_events) > content.log.shape[0]:
            self._exchange(log=np.zeros((2 * len(initial_events), LOG_COLUMNS)))
        self._begin(initial_events)

    def _begin(self, initial_events: tuple[list[float], ...]) -> None:
        """Log what happened at the start, and take the start over as if it were the end of a step."""
        content = self.integration.content
        state, accepted = content.state, content.work.accepted
        for row, event in enumerate(initial_events):
            content.log[row] = event
        state.counts["events"] = len(initial_events)
        functions.activate(self.system.address)
        self.change_points: list[tuple[float, float]] = []
        self.system.content.work.near[:] = 0.0, 1.0, np.inf, -np.inf
        functions.accept(0.0, state.y, self.system.address, accepted)
        state.clock["longest"] = accepted[1]

    @property
    def state(self) -> State:
        """The integrator's state: live arrays."""
        found: State = self.integration.content.state
        return found

    @property
    def time(self) -> float:
        """Time reached [s]."""
        return float(self.state.clock["time"][0])

    @property
    def log(self) -> np.ndarray:
        """The events so far, see `log.LOG`: a view."""
        return by_name(self._events, LOG)

    @property
    def _events(self) -> np.ndarray:
        return np.asarray(self.integration.content.log[: int(self.state.counts["events"][0])])

    @property
    def peak(self) -> np.ndarray:
        """The largest values so far, see `log.PEAK`: a view."""
        return by_name(self.state.peak, PEAK)

    @property
    def band(self) -> np.ndarray:
        """What is known of limits so far, see `log.BAND`: a view."""
        return by_name(self.state.band, BAND)

    @property
    def samples(self) -> Samples:
        """The samples written so far."""
        written: Samples = self.integration.content.samples
        reached = int(self.state.counts["samples"][0])
        return Samples(*(part[:reached] for part in written))

    @property
    def steps(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Time, state and modes at the end of each step so far, if they are recorded."""
        count = int(self.state.counts["recorded"][0])
        time, state, mode = self.integration.content.steps
        return time[:count], state[:count], mode[:count]

    def rows(self, kind: int) -> np.ndarray:
        """Rows, among those of guards and of what is monitored throughout, of one kind of quantity."""
        if kind not in self._rows:
            self._rows[kind] = monitored_rows(self.system.content.model, kind)
        return self._rows[kind]

    def _limits(self) -> np.ndarray:
        """A limit for each quantity that is monitored throughout: the tolerances of tracked points."""
        model, tracks = self.system.content.model, self.plan.tracks
        limits = np.full(model.monitor.shape[0], np.inf)
        if tracks:
            tolerances = [np.inf if track.tolerance is None else track.tolerance for track in tracks]
            limits[self.rows(TRACK_DEVIATION) - model.guard_component.size] = tolerances
        return limits

    def _exchange(self, **parts: Any) -> None:
        self.integration = Handle(self.integration.content._replace(**parts))

    def sample_at(self, times: np.ndarray) -> None:
        """Write samples at these instants from here on."""
        self._exchange(samples=make_samples(np.array(times, float), self.state))
        self.state.counts["samples"] = 0

    def compare_with(self, table: np.ndarray, step: float) -> None:
        """Monitor how far the tracked points are from those of the ideal mechanism.

        Shapes: `table` (nodes, 6 tracks).
        """
        self.system.exchange("parameters", ideal=table, ideal_step=np.array([step]))

    def record_steps(self) -> None:
        """Keep time and state at the end of each step from here on."""
        self._exchange(steps=make_record(RECORD_ROWS, self.state))
        self.state.counts["recorded"] = 0

    def monitor(self, on: bool) -> None:
        """Integrate powers and monitor numbers from here on, or leave both as they are; the motion does not depend on it."""
        clock = self.state.clock
        if bool(clock["monitors"][0]) != on:
            clock["monitors"], clock["prepared"] = int(on), 0

    def clear_log(self) -> None:
        """Forget the events so far, and what delayed feedback no longer looks back at."""
        self.state.counts["events"] = 0
        delays = self.integration.content.work.delays
        if delays.size:
            history, length = self.state.history, int(self.state.history_length[0])
            old = int(np.sum(history[:length, 0] + history[:length, 1] < self.time - 1.001 * float(np.max(delays))))
            history[: length - old] = history[old:length].copy()
            self.state.history_length[0] = length - old

    def advance(self, until: float, *, most_steps: int = 50_000_000, progress: Callable[[float], None] | None = None) -> int:
        """Go on until a time."""
        status, left = loop.ADVANCING, most_steps
        while status == loop.ADVANCING and left > 0:
            before, called = self.tried, clocks.perf_counter()
            if self.state.clock["longest"][0] < 0.0 and not step_across(self, until):
                return loop.STEP_TOO_SMALL
            status = advance_together([self], until, min(self._pace, left))[0]
            taken = self.tried - before
            left -= max(1, taken)
            if status == loop.ADVANCING:
                self._pace = next_slice(taken, clocks.perf_counter() - called, SLICE)
            if status == loop.CHANGE_POINT:
                status = loop.ADVANCING
            if status in _GROWING:
                self.grow(status)
                status = loop.ADVANCING
            look()
            if progress is not None:
                progress(self.time)
        return status

    @property
    def tried(self) -> int:
        """Steps so far, rejected ones included."""
        counts = self.state.counts
        return int(counts["steps"][0] + counts["rejected"][0])

    def grow(self, status: int) -> None:
        """Double the store that is full."""
        content = self.integration.content
        if status == loop.LOG_FULL:
            self._exchange(log=np.vstack([content.log, np.zeros_like(content.log)]))
        elif status == loop.RECORD_FULL:
            doubled = (np.concatenate([part, np.zeros_like(part)]) for part in content.steps)
            self._exchange(steps=type(content.steps)(*doubled))
        else:
            history = np.vstack([content.state.history, np.zeros_like(content.state.history)])
            self.system.exchange("state", history=history)
            self._exchange(state=content.state._replace(history=history))

    def snapshot(self) -> Snapshot:
        """The state, to be put back or stored."""
        arrays = {name: np.array(part) for name, part in self.state._asdict().items()}
        arrays["history"] = arrays["history"][: int(arrays["history_length"][0])]
        return Snapshot(arrays)

    def restore(self, snapshot: Snapshot) -> None:
        """Put a state back, of this mechanism or of one that differs in parameters only."""
        state, length = self.state, int(snapshot.arrays["history_length"][0])
        while length >= state.history.shape[0] > 0:
            self.grow(loop.HISTORY_FULL)
            state = self.state
        for name, part in state._asdict().items():
            stored = snapshot.arrays[name]
            if name == "history":
                part[:length] = stored
            elif part.shape == stored.shape:
                part[...] = stored
            else:
                raise InputError(f"a state with {stored.shape} numbers as '{name}'", f"{part.shape}, a state of this mechanism")
        state.clock["prepared"] = 0
        if self.stepping is not None:
            self.stepping.forget()
        functions.activate(self.system.address)

    def arrays(self) -> dict[str, np.ndarray]:
        """All arrays that the way onwards depends on, and what has been recorded so far, by name; live."""
        content, counts = self.integration.content, self.state.counts
        named = {"state": content.state, "work": content.work, "workspace": self.system.content.work}
        found = {f"{owner}.{name}": part for owner, parts in named.items() for name, part in parts._asdict().items()}
        found["state.history"] = found["state.history"][: int(self.state.history_length[0])]
        for owner, parts, rows in (("samples", content.samples, "samples"), ("steps", content.steps, "recorded")):
            found |= {f"{owner}.{name}": part[: int(counts[rows][0])] for name, part in parts._asdict().items()}
        hard = {} if self.stepping is None else self.stepping.arrays()
        return found | hard | {"log": self._events}

    def take_up(self, arrays: Mapping[str, np.ndarray]) -> None:
        """Put back what `arrays` gave for a driver made in the same way, which goes on from there bit for bit."""
        mine = self.arrays()
        if arrays.keys() != mine.keys():
            raise InputError(f"a state without '{min(mine.keys() ^ arrays.keys())}'", "a state of the same version")
        for name, status in (("state.history", loop.HISTORY_FULL), ("steps.time", loop.RECORD_FULL), ("log", loop.LOG_FULL)):
            while len(arrays[name]) > len(self._store(name)) > 0:
                self.grow(status)
        for name, part in self.arrays().items():
            owner = name.partition(".")[0]
            rows = arrays[name].shape[0] if owner in ("samples", "steps", "log") or name == "state.history" else None
            place = part if rows is None else self._store(name)[:rows]
            if place.shape != arrays[name].shape:
                raise InputError(f"a state with {arrays[name].shape} numbers as '{name}'", f"{place.shape}")
            place[...] = arrays[name]

    def _store(self, name: str) -> np.ndarray:
        """All rows of an array that is filled row by row."""
        owner, _, part = name.partition(".")
        found = getattr(self.integration.content, owner)
        return np.asarray(getattr(found, part) if part else found)

    def bind(self, parameters: Parameters) -> None:
        """Go on with other numbers of the same model."""
        self.system = Handle(self.system.content._replace(parameters=parameters))
        self.system.content.work.instant[:] = np.nan
        self.state.clock["prepared"] = 0


def _stores(method: Choice) -> str:
    """The method whose stores the loop uses; time stepping needs few."""
    return "dopri5" if method.step > 0.0 else method.method


_GROWING = (loop.LOG_FULL, loop.HISTORY_FULL, loop.RECORD_FULL)

UNFINISHED = (loop.ADVANCING, loop.CHANGE_POINT, *_GROWING)
"""Statuses after which a driver can be advanced further."""


def _fill_history(system: Handle, y: np.ndarray) -> None:
    """Before the start every recorded signal is constant: S = y + R S, found from the recorder's answer to S = 0 and S = 1."""
    past = system.content.state.initial_history
    answers = np.zeros((2, past.size))
    for value, answer in enumerate(answers):
        past[:] = float(value)
        functions.record(0.0, y, system.address, answer)
    past[:] = answers[0] / (1.0 - (answers[1] - answers[0]))


def counted(state: State) -> dict[str, int]:
    """The counters of the loop by name."""
    counts = state.counts[0]
    return {name: int(counts[name]) for name in ("steps", "rejected", "rates", "jacobians", "events")}
