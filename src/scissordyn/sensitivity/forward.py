"""Simulate a run together with the derivatives of its results by up to eight parameters."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from scissordyn.errors import InputError, ScissordynError
from scissordyn.integrate import advance as loop
from scissordyn.integrate.integration import INTEGRAL, LARGEST, MONITORED_VALUES, STRUCK, WHEN
from scissordyn.integrate.tableau import EXPLICIT, ROSENBROCK
from scissordyn.mechanics.monitored import DRIVE_TORQUE, PRESSURE_VELOCITY, TRACK_DEVIATION
from scissordyn.mechanics.outputs import empty_record, sampled
from scissordyn.mechanics.sample import Record
from scissordyn.model.options import Options
from scissordyn.plan.plan import Plan
from scissordyn.record.ideal_path import IdealPath
from scissordyn.run.advance.driver import Driver
from scissordyn.run.advance.interrupt import check_interrupt
from scissordyn.run.trajectory import describe_stop, make_driver, model_failure
from scissordyn.sensitivity.gap import EVENT, FAR, NEAR, SINCE_EVENT, SLOPES
from scissordyn.sensitivity.hard_replay import HardWatched
from scissordyn.sensitivity.library import DERIVATIVES, Library, library_for
from scissordyn.sensitivity.part_error import PARTS_MAX, WEIGHT_FACTOR
from scissordyn.sensitivity.replay import ANOTHER_MODE, FULL, JUMP, NO_ROOT, UNFINISHED, Watched
from scissordyn.sensitivity.twin import VALUE, Twin

CHECK_STEPS = 100  # Number of repeated time steps between two checks for Ctrl-C, progress reports, and stored states

# Smallest number of steps in the history of delayed signals; more steps are stored than in the run if steps are divided
HISTORY_STEPS = 16_384

TOLERANCE_FACTORS = {EXPLICIT: 100.0, ROSENBROCK: 1000.0}
"""Largest relative error of derivatives in a step, as a multiple of the run's relative tolerance, by kind of method.

The values of Rosenbrock methods are less accurate at contacts, so that more accurate derivatives would not help.
"""


REPLAY_FAILURES = {
    ANOTHER_MODE: "the repetition of a step in dual numbers has other contacts",
    NO_ROOT: "a contact or stop closes a second time without opening in between",
    JUMP: "a controller begins to act abruptly after its delay; expected a ramp, for example ramp = 0.01",
    UNFINISHED: "the derivatives change too fast within a step",
    FULL: "a controller's delay is longer than the steps that fit into its history",
}
"""Reasons why a step cannot be repeated in dual numbers, by the status that `replay.follow` returns."""


def _replay_error(failure: int, time: float) -> ScissordynError:
    """Return the error for a step at `time` [s] that cannot be repeated in dual numbers, by the key in `REPLAY_FAILURES`."""
    text = f"no derivatives at t = {time:.9g} s: {REPLAY_FAILURES[failure]}"
    if failure != JUMP and time > 0.0:
        text += f"; expected a run that ends before this instant; for example until = {0.99 * time:.3g} s"
    return ScissordynError(text)


# Names of the fields of `Samples` whose derivatives are stored
SAMPLED_ARRAYS = ("state", "total", "memory", "mass", "reference")

POINTER_ARRAYS = ("force_kernel", "gap_kernel", "switch_kernel")  # Names of the arrays of the model with kernel pointers


@dataclass(frozen=True)
class Forward:
    """Finished run with the derivatives of its arrays; the last axis is that of the parameters, divided by their scales."""

    driver: Driver
    state: np.ndarray  # (ny, parameters)
    log: np.ndarray  # (events, columns, parameters)
    peak: np.ndarray  # (rows, columns, parameters)
    total: np.ndarray  # (powers, parameters)
    monitored: np.ndarray  # (rows, values, parameters)
    samples: Mapping[str, np.ndarray]  # (samples, sizes, parameters) by the names in `SAMPLED_ARRAYS`
    outputs: tuple[Record, Record]  # Outputs at the samples, and their derivatives
    misfit: float  # Largest relative difference between a step and its repetition
    parts: int  # Number of parts of steps that were rejected for the errors of derivatives
    quadrature: int  # Number of parts of steps that were halved for accurate derivatives of integrals
    rough: float  # Estimated relative error of the derivatives of powers' integrals; 0 if every part is accurate
    limits: np.ndarray  # (3, parameters) first instants at which a change adds or removes an event, or moves it too far [s]
    doubt: np.ndarray  # (parameters,) first instant at which a change may change the mode of a hard contact in an impact [s]
    passed: tuple[np.ndarray, np.ndarray]  # Times at most `CHECK_STEPS` steps apart [s], and the states there


class _Pass:
    """Driver of a run in doubles, and its repetition in dual numbers, up to eight parameters in one pass."""

    def __init__(
        self,
        plan: Plan,
        options: Options,
        seeds: Sequence[Mapping[str, np.ndarray]],
        times: np.ndarray,
        *,
        integrals: bool,
        ideal: IdealPath | None,
        change: float,
    ) -> None:
        self.driver, _, _ = make_driver(plan, options)
        self.change, self.doubt, self.limits = np.array([change]), np.full(len(seeds), np.inf), np.full((3, len(seeds)), np.inf)
        guards, clearance = self.driver.state.mode.size, self.driver.system.content.parameters.contact["clearance"]
        far = 0.1  # [clearances] displacement of a journal at an event up to which the gradient counts as valid
        self.gap, self.since = np.zeros((guards, SLOPES + len(seeds))), np.full((guards, len(seeds)), np.inf)
        self.unwatched, self.leeway = np.full(guards, -1), np.full(guards, np.inf)
        self.unwatched[plan.hard_places], self.leeway[: clearance.size] = 1, far * clearance
        work = self.driver.system.content.work
        self.speed = np.zeros((4, work.contact.size + work.coordinate_rates.size))
        if ideal is not None:
            self.driver.compare_with(ideal.table, ideal.step)
        self.driver.sample_at(times)
        self.driver.state.clock["end"] = options.until
        while self.driver.integration.content.work.delays.size and len(self.driver.state.history) < HISTORY_STEPS:
            self.driver.grow(loop.HISTORY_FULL)
        content = self.driver.system.content
        tables = any(name.startswith("model.") for seed in seeds for name in seed)
        pointers = {int(word) for name in POINTER_ARRAYS for word in getattr(content.model, name)}
        pointers |= {int(word) for word in content.parameters.controller}
        pointers |= {int(word) for key in content.parameters.law.dtype.names[:7] for word in content.parameters.law[key]}
        stepping = self.driver.stepping
        if stepping is not None:
            pointers |= {int(word) for key in ("law", "energy") for word in getattr(stepping.content.parameters, key)}
        self.kernels: Library = library_for(pointers, tables=tables, hard=stepping is not None)
        self.twin = Twin(self.kernels.doubles, self.kernels.pointers)
        self.system, self.maps = self.twin.address(content), self.twin.address(plan.maps)
        self.misfit, self.rows = np.zeros(1), self._rows(content)
        self.parameters, self.parts, self.divided = np.array([len(seeds)]), np.zeros(1, np.int64), np.ones(1, np.int64)
        relative = TOLERANCE_FACTORS[self.driver.integration.content.method.kind]
        self.tolerance = np.array([relative, WEIGHT_FACTOR]) * options.rtol
        self.integrals, self.quadrature = self._integrals(), np.zeros(1, np.int64)
        self.rough = np.zeros((self.driver.state.total.size, len(seeds)))
        self._bind()
        self.seed = np.zeros((1, DERIVATIVES + 1))
        self.seed[0, 0] = 1.0
        dual = self.twin.copy_of(self.driver.state.clock)
        dual["monitors"] = int(integrals or stepping is not None)
        self._put(seeds)
        self.passed = {self.driver.time: self.driver.state.y.copy()}
        self.kernels.follow_once(self.watching, self.integration, self.system, self.seed)
        self.start_gaps = self.gap[:, SLOPES:].copy()

    def _rows(self, content: Any) -> np.ndarray:
        """Return the indices of the monitored values whose maxima get derivatives: all values."""
        return np.arange(self.driver.state.peak.shape[0])

    def _integrals(self) -> np.ndarray:
        """Return 1 for the monitored values whose integrals measures use, shape (rows, values)."""
        driver = self.driver
        used = np.zeros((driver.state.peak.shape[0], MONITORED_VALUES), np.int64)
        used[: driver.system.content.parameters.contact.size] = 1
        used[driver.rows(PRESSURE_VELOCITY), 0] = 1
        used[[*driver.rows(DRIVE_TORQUE), *driver.rows(TRACK_DEVIATION)], 1] = 1
        return used

    def _bind(self) -> None:
        """Pass the addresses of the run's arrays to the compiled loop; repeat this after an array was replaced."""
        integration = self.driver.integration.content
        state = integration.state
        self.integration = self.twin.address(integration)
        self.watched = Watched(
            state.clock, state.counts, state.y, state.mode, state.memory, state.mass, state.reference,
            integration.work.scaling, integration.work.slope, state.peak, integration.log, self.rows, self.misfit,
            self.parameters, self.tolerance, self.parts, self.divided, self.integrals, self.quadrature, self.rough, self.change,
            self.gap, self.since, self.unwatched, self.speed, self.leeway, self.limits,
        )  # fmt: skip
        self.watching = self.twin.address(self.watched)
        if self.driver.stepping is not None:
            contacts, touching = self.driver.stepping.content, self.driver.stepping.touching.content
            duals = self.watching, self.twin.address(contacts), self.twin.address(touching)
            work, kept = contacts.work, contacts.state
            self.watching = self.twin.address(HardWatched(*duals, work.size, work.was, kept.mode, work.impact, self.doubt))
        self.run = np.array(self.driver.addresses, np.int64)

    def _put(self, seeds: Sequence[Mapping[str, np.ndarray]]) -> None:
        """Write derivatives at the start into the dual arrays; `seeds` has those of each array, by name, for each parameter."""
        content, state = self.driver.system.content, self.driver.state
        for k, seed in enumerate(seeds):
            for name, slope in seed.items():
                if name == "y":
                    self.twin.copy_of(state.y)[..., k] = slope
                elif name == "delays":
                    self.twin.copy_of(self.driver.integration.content.work.delays)[..., k] = slope
                elif name == "log":
                    self.twin.copy_of(self.driver.integration.content.log)[: len(slope), :, k] = slope
                else:
                    owner, *path = name.split(".")
                    array: Any = self.driver.plan.maps if owner == "maps" else getattr(content, owner, None)
                    if owner == "hard":
                        assert self.driver.stepping is not None
                        array = self.driver.stepping.content
                    while not isinstance(array, np.ndarray):
                        array = getattr(array, path.pop(0))
                    dual = self.twin.copy_of(array)
                    (dual[path[0]] if path else dual)[..., k] = slope

    def advance(self, until: float, most_steps: int, progress: Callable[[float], None] | None) -> str:
        """Advance to the end; return the reason why the run stopped before, or ""."""
        driver = self.driver
        while True:
            left = most_steps - driver.steps_tried
            if left <= 0:
                return f"{most_steps} steps are not enough"
            self._make_room()
            status = self.kernels.lockstep(
                self.run.ctypes.data,
                self.watching,
                self.integration,
                self.system,
                self.seed.ctypes.data,
                min(CHECK_STEPS, left),
            )
            self.passed[driver.time] = driver.state.y.copy()
            if status < 0:
                raise _replay_error(-status, driver.time)
            if status == loop.LOG_FULL:
                old = driver.integration.content.log
                driver.grow(status)
                self.twin.grow(old, driver.integration.content.log)
                self._bind()
            elif status == loop.HISTORY_FULL:
                self._lengthen_history()
            elif status == loop.CHANGE_POINT:
                return "derivatives across a singular position are not supported"
            elif status != loop.ADVANCING:
                return "" if status == loop.FINISHED else describe_stop(status, driver)
            check_interrupt()
            if progress is not None:
                progress(driver.time)

    def _limits(self) -> np.ndarray:
        """Return `Forward.limits`: guards that are close to zero at the end count too."""
        since = np.where(self.since == SINCE_EVENT, self.gap[:, EVENT, None], self.since)
        self.limits[NEAR] = np.minimum(self.limits[NEAR], np.min(since, axis=0, initial=np.inf))
        begun = self.driver.log["guard"][self.driver.log["time"] == 0.0].astype(int)
        moved = self.change[0] * np.abs(self.start_gaps[begun]) > self.leeway[begun, None]
        self.limits[FAR, np.any(moved, axis=0)] = 0.0
        return self.limits

    def _lengthen_history(self) -> None:
        old = self.driver.state.history
        self.driver.grow(loop.HISTORY_FULL)
        self.twin.grow(old, self.driver.state.history)
        self.system = self.twin.address(self.driver.system.content)
        self._bind()

    def _make_room(self) -> None:
        """Lengthen the history of delayed signals if outputs at samples will read it, before the repetition drops old steps."""
        state, content = self.driver.state, self.driver.integration.content
        if not content.work.delays.size or not content.samples.time.size:
            return
        if self.twin.copy_of(state.history)[0, 0, VALUE] > 0.0:
            raise ScissordynError(f"no derivatives over time: {REPLAY_FAILURES[UNFINISHED]}")
        while int(self.twin.copy_of(state.history_length)[0]) + CHECK_STEPS + 2 * PARTS_MAX > len(self.driver.state.history):
            self._lengthen_history()

    def outputs(self, count: int) -> tuple[Record, Record]:
        """Return the outputs at the samples, and their derivatives by the first `count` parameters."""
        content, samples = self.driver.system.content, sampled(self.driver.integration.content.samples)
        record = empty_record(self.driver.plan.maps, content, samples.time.size)
        dual = self.twin.address(samples), self.twin.address(record)
        self.twin.copy_of(samples.mode)[...] = samples.mode
        counted = np.zeros((content.model.rotation_start.size - 1, DERIVATIVES + 1))
        self.kernels.fill(dual[0], self.system, self.maps, dual[1], counted)
        copies = [self.twin.copy_of(array) for array in record]
        return Record(*(_part(copy, VALUE) for copy in copies)), Record(*(_part(copy, slice(count)) for copy in copies))

    def result(self, count: int, *, integrals: bool) -> Forward:
        """Return the run with its derivatives by the first `count` parameters."""
        if self.driver.stepping is None:
            self.kernels.end(self.integration, self.system)
        state, of = self.driver.state, self.twin.copy_of
        part = slice(count)
        log = of(self.driver.integration.content.log)[: int(state.counts["events"][0]), :, part].copy()
        peak, total = of(state.peak)[..., part].copy(), of(state.total)[..., part].copy()
        first = log.shape[1] - peak.shape[1]
        unknown = [WHEN, STRUCK + 1] + ([] if integrals else list(range(INTEGRAL, STRUCK)))
        peak[:, unknown], log[:, [first + column for column in unknown]] = np.nan, np.nan
        # the repetition has no derivative of these largest values
        peak[of(state.peak)[:, LARGEST, VALUE] != state.peak[:, LARGEST], LARGEST] = np.nan
        ended = self.driver.integration.content.log[: len(log)]
        log[of(self.driver.integration.content.log)[: len(log), first + LARGEST, VALUE] != ended[:, first + LARGEST], first] = (
            np.nan
        )
        size = np.abs(total) + np.abs(state.total)[:, None]
        rough = float(np.max(self.rough[self.rough > 0.0] / size[self.rough > 0.0], initial=0.0))
        if not integrals:
            total[:] = np.nan
        kept = self.driver.integration.content.samples
        samples = {name: of(getattr(kept, name))[..., part].copy() for name in SAMPLED_ARRAYS}
        return Forward(
            self.driver, of(state.y)[..., part].copy(), log, peak, total, of(state.monitored)[..., part].copy(), samples,
            self.outputs(count), float(self.misfit[0]), int(self.parts[0]), int(self.quadrature[0]), rough,
            self._limits(), self.doubt,
            (np.array(list(self.passed)), np.array(list(self.passed.values()))),
        )  # fmt: skip


def _part(duals: np.ndarray, which: int | slice) -> np.ndarray:
    """Return values or derivatives of an array of dual numbers; a structured array keeps its fields."""
    if duals.dtype.names is None:
        return duals[..., which]
    parts = {name: duals[name][..., which] for name in duals.dtype.names}
    kinds = [(name, float, part.shape[duals.ndim :]) for name, part in parts.items()]
    copy = np.zeros(duals.shape, kinds)
    for name, part in parts.items():
        copy[name] = part
    return copy


def forward(
    plan: Plan,
    options: Options,
    seeds: Sequence[Mapping[str, np.ndarray]],
    *,
    times: np.ndarray | None = None,
    integrals: bool = False,
    ideal: IdealPath | None = None,
    change: float = 0.0,
    progress: Callable[[float], None] | None = None,
) -> Forward:
    """Simulate with derivatives by the parameters of `seeds` (`seed.derivatives`); raise `ScissordynError` if the run fails.

    Integrals of powers have derivatives only with `integrals`, outputs at the samples those by parameters with maps (`Start`).
    `change` is the relative change of a parameter for which `Forward.limits` and `Forward.doubt` are written.
    """
    if options.step is not None and not plan.hard_places:
        raise InputError("steps of a fixed size have no derivatives", "a run with error control, without 'step'")
    run = _Pass(plan, options, seeds, np.zeros(0) if times is None else times, integrals=integrals, ideal=ideal, change=change)
    cause = run.advance(options.until, options.most_steps, progress) or model_failure(run.driver)
    if cause:
        raise ScissordynError(f"stopped at t = {run.driver.time:.9g} s of {options.until:g} s: {cause}")
    return run.result(len(seeds), integrals=integrals)
