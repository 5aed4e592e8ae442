"""Wear of bearings over many cycles: simulate a cycle, wear the bearings by its loads for some cycles, repeat."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Callable, Iterator, Mapping
from types import MappingProxyType
from typing import Annotated, Any, NamedTuple

import numpy as np
import xarray as xr

from scissordyn.casefile.configuration import write_configuration
from scissordyn.errors import InputError, ScissordynError
from scissordyn.lifetime.error import depth_errors, mean_error
from scissordyn.lifetime.life import add_lives, repetition, without_repetitions
from scissordyn.lifetime.loads import CycleRunner, Loads, with_coefficients, worn_joints
from scissordyn.lifetime.step import Bearing, Worn
from scissordyn.model.mechanism import Mechanism
from scissordyn.model.options import EndTime, Options, StartKind
from scissordyn.model.wear import Coefficients, CycleKind, Wear
from scissordyn.run.stops import drive_period
from scissordyn.units import Meaning, checked, quantities

TITLE = "scissordyn wear"


STEPS_MIN = 8
"""Smallest number of wear steps in a life.

Nine states widen the interval by less than a fifth, because the scatter of so few is not well known.
"""

NO_LOADS = Loads(*np.zeros((4, 0)))  # placeholder for the loads of a state whose cycle is not simulated yet


class State(NamedTuple):
    """Contours of the bearings after a number of cycles, and the loads of a cycle simulated with them."""

    cycle: int
    step: int  # number of cycles since the previous state
    depths: np.ndarray  # (joints, angles) [m]
    loads: Loads
    rates: np.ndarray  # (members, joints, angles) depth that each simulated cycle wears [m]
    correction: np.ndarray  # (joints, angles) depths minus those of constant loads over each step [m]


@checked
def wear(
    mechanism: Mechanism,
    *,
    until: EndTime,
    cycles: Annotated[int, quantities(Wear)["cycles"]] = Wear.cycles,
    cycle: CycleKind = "auto",
    settle: Annotated[int, quantities(Wear)["settle"]] = Wear.settle,
    members: Annotated[int, quantities(Wear)["members"]] = Wear.members,
    change: Annotated[float, quantities(Wear)["change"]] = Wear.change,
    angles: Annotated[int, quantities(Wear)["angles"]] = Wear.angles,
    most_clearance: Annotated[float | None, quantities(Wear)["most_clearance"]] = None,
    coefficients: Coefficients = MappingProxyType({}),
    start: StartKind = "concentric",
    rtol: float = 1e-6,
    atol: float = 1e-6,
    method: str = "auto",
    most_steps: int = Options.most_steps,
    earlier: Annotated[
        xr.Dataset | None, Meaning("an unfinished result of the same wear computation, which is continued")
    ] = None,
    each: Annotated[Callable[[xr.Dataset], None] | None, Meaning("called with the current result after each step")] = None,
    progress: Callable[[int, int], None] | None = None,
) -> xr.Dataset:
    r"""Wear the bearings of a mechanism over many cycles by Archard's law.

    Some cycles are simulated, and the loads on each bearing are collected by angle. Under these loads the bearing wears for n
    cycles, until its contour has changed by a fraction of the clearance; then cycles are simulated again with the worn
    bearing.

    .. math:: \frac{\mathrm{d}V}{\mathrm{d}t} = k F_n |v_t|, \qquad \mathrm{d}h = k\, p\, |v_t|\, \mathrm{d}t

    The wear depth h follows the pressure p that the contact law has on the worn contour. The journal stays round.

    Parameters
    ----------
    mechanism : Mechanism
        Mechanism with a wear coefficient at one or several clearance joints, ``Clearance(wear=...)``.
    until : float
        End of the run that is a cycle [s]; not used where a cycle is a period of the drive.
    cycles : int
        Number of cycles.
    cycle : {"auto", "period", "run"}
        "period": a cycle is a period of the drive. "run": it is the whole run, for example a deployment and its return,
        which starts again in each cycle. "auto": the period if the drives have one.
    settle : int
        Periods at the start of each simulation that are not counted.
    members : int
        Number of averaged cycles: periods one after another, or runs from starts that differ by round-off. Their spread
        gives the interval of the life; one member gives no interval.
    change : float
        Largest change of a contour between two simulations, as a fraction of the clearance.
    angles : int
        Number of angles of a contour.
    most_clearance : float, optional
        Largest radial clearance [m] that a worn joint may have.
    coefficients : mapping of str to float
        Wear coefficients [m^2/N] by the materials 'journal/bearing', for clearance joints without their own.
    start, rtol, atol, method, most_steps
        As for `simulate`.
    earlier : Dataset, optional
        Result that was interrupted, or has fewer cycles. The result is that of one run, bit for bit.
    each : callable, optional
        Called after each simulated state with the current result.
    progress : callable, optional
        Called with the number of cycles and the total.

    Returns
    -------
    Dataset
        Along `state`, with the coordinate `cycle(state)`: `depth(state, joint, angle)`, `depth_largest`,
        `depth_error`, `worn_volume`, `worn_clearance` and `peak_force(state, joint)`, and
        `track_deviation(state, track)`. `life(requirement)` with `life_low` and `life_high` is the number of cycles
        until a requirement fails: tolerances of tracks, `most_clearance` and bushes; NaN if it does not. Attributes: status,
        cause, the simulated cycles and warnings.

    Raises
    ------
    InputError
        If no joint wears, or an option is wrong.
    """
    settings = Wear(cycles, cycle, settle, members, change, angles, most_clearance, dict(coefficients))
    options = Options(until, start, 2, rtol, atol, method, most_steps)
    return wear_out(mechanism, options, settings, earlier=earlier, each=each, progress=progress)


def wear_out(
    mechanism: Mechanism,
    options: Options,
    settings: Wear,
    *,
    earlier: xr.Dataset | None = None,
    each: Callable[[xr.Dataset], None] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> xr.Dataset:
    """Return the result of `wear` for options of a case file."""
    life = _Life(mechanism, options, settings)
    if earlier is not None:
        life.continue_from(earlier)
    try:
        for _ in life.steps():
            if progress is not None:
                progress(life.cycle, settings.cycles)
            if each is not None:
                each(life.dataset("interrupted", "interrupted"))
    except KeyboardInterrupt:
        return life.dataset("interrupted", "interrupted")
    except ScissordynError as error:
        if not life.states:
            raise
        return life.dataset("failed", f"stopped after {life.cycle} cycles: {error}")
    return life.dataset("failed" if life.cause else "complete", life.cause)


class _Life:
    """Wear computation: states of the bearings over the cycles, and the next state to simulate."""

    def __init__(self, mechanism: Mechanism, options: Options, settings: Wear) -> None:
        mechanism, self.warnings = with_coefficients(mechanism, settings.coefficients)
        self.mechanism, self.options, self.settings = mechanism, options, settings
        self.names = worn_joints(mechanism)
        period = _period(mechanism, settings)
        self.runner = CycleRunner(mechanism, options, settings, self.names, period)
        self.bearings = [Bearing(mechanism.joint(name), settings.angles) for name in self.names]
        depths = np.stack([bearing.depths for bearing in self.bearings])
        self.next = State(0, 0, depths, NO_LOADS, np.zeros((settings.members, *depths.shape)), np.zeros(depths.shape))
        self.cause = ""
        self.states: list[State] = []

    @property
    def cycle(self) -> int:
        """Number of cycles of the last simulated state."""
        return self.states[-1].cycle if self.states else 0

    def steps(self) -> Iterator[None]:
        """Simulate a cycle and wear the bearings, alternately, until all cycles are done; yield after each simulation."""
        while True:
            if not self.states or self.states[-1].cycle < self.next.cycle:
                self._simulate()
                yield
            if self.next.cycle >= self.settings.cycles or self.cause:
                return
            last, left = self.states[-1], self.settings.cycles - self.states[-1].cycle
            n, worn = self._chosen_step(last, left)
            self.next = last._replace(cycle=last.cycle + n, step=n, depths=self._depths(worn))

    def _simulate(self) -> None:
        """Simulate cycles with the contours at the end of a step, and repeat the step with the mean loads of both its ends.

        This is Heun's method; the loads at the end stay those of the first contours, with an error of second order.
        """
        state = self.next
        loads = self.runner.loads(state.depths)
        rates = [
            [bearing.rate(state.depths[j], loads.member(m), j) for j, bearing in enumerate(self.bearings)]
            for m in range(self.settings.members)
        ]
        state = state._replace(loads=loads, rates=np.array(rates))
        if self.states:
            last = self.states[-1]
            both = Loads.joined((last.loads, loads))
            worn = self._worn(last.depths, both, state.step)
            corrected = self._depths(worn)
            state = state._replace(depths=corrected, correction=last.correction + corrected - state.depths)
        self.states.append(state)
        self.warnings = without_repetitions([*self.warnings, *loads.warnings])
        for name, bearing, depth in zip(self.names, self.bearings, state.depths.max(axis=-1).tolist(), strict=True):
            if bearing.bush is not None and depth >= bearing.bush and not self.cause:
                self.cause = f"joint '{name}' has worn through its bush of {1e3 * bearing.bush:g} mm by cycle {state.cycle}"

    def _worn(self, depths: np.ndarray, loads: Loads, cycles: int) -> list[Worn]:
        """Return the bearings after some cycles with given loads, from contours of shape (joints, angles) [m]."""
        return [bearing.worn(depths[j], loads, j, cycles) for j, bearing in enumerate(self.bearings)]

    def _chosen_step(self, last: State, left: int, growth: float = 4.0, trials: int = 12) -> tuple[int, list[Worn]]:
        """Return the number of cycles of the next step, at most `left`, and the bearings after it.

        `growth`: largest ratio of the cycle counts of two successive wear steps.

        `trials`: largest number of reductions of a wear step that changes the contour too much.
        """
        limit, most = self.settings.change, min(left, math.ceil(self.settings.cycles / STEPS_MIN))
        n = min(most, max(1, int(growth * last.step))) if last.step else self._first_step(last, most)
        for _ in range(trials):
            worn = self._worn(last.depths, last.loads, n)
            changes = [part.deepened / bearing.clearance for part, bearing in zip(worn, self.bearings, strict=True)]
            largest = math.inf if any(part.depths is None for part in worn) else max(changes)
            if largest <= limit or n == 1:
                break
            n = max(1, int(n * min(0.9 * limit / largest, 0.9)))
        if largest > limit:
            worst = self.names[int(np.argmax(changes))]
            text = f"a single cycle changes the contour of joint '{worst}' by more than {limit:g} of its clearance"
            self.warnings += [text] if text not in self.warnings else []
        return n, worn

    def _depths(self, worn: list[Worn]) -> np.ndarray:
        """Return the contours after a step, shape (joints, angles); raise `ScissordynError` if one has worn too much."""
        for name, part in zip(self.names, worn, strict=True):
            if part.depths is None:
                raise ScissordynError(
                    f"a single cycle wears joint '{name}' by far more than its elastic indentation; "
                    "check its coefficient of wear"
                )
        return np.stack([part.depths for part in worn if part.depths is not None])

    def _first_step(self, last: State, most: int) -> int:
        """Return the cycle count of the first step, extrapolated from the depth that a single cycle wears."""
        worn = [part.deepened for part in self._worn(last.depths, last.loads, 1)]
        largest = max(depth / bearing.clearance for depth, bearing in zip(worn, self.bearings, strict=True))
        return most if largest == 0.0 else max(1, min(most, int(2.0 * self.settings.change / largest)))

    def continue_from(self, earlier: xr.Dataset) -> None:
        """Load the states of an earlier result of the same wear computation, so that it continues from its last state."""
        self._check_same(earlier)
        said = repetition(earlier)
        self.warnings = [text for text in json.loads(earlier.attrs["warnings"]) if text not in said]
        for k in range(earlier.sizes["state"]):
            row = earlier.isel(state=k)
            depths, rates, correction = (row[name].values.copy() for name in ("depth", "member_rate", "depth_correction"))
            loads = Loads.from_row(row, self.warnings)
            self.states.append(State(int(row["cycle"]), int(row["step"]), depths, loads, rates, correction))
        self.next = self.states[-1]

    def _check_same(self, earlier: xr.Dataset) -> None:
        """Raise `InputError` if an earlier result belongs to another wear computation."""
        if earlier.attrs.get("title") != TITLE:
            raise InputError(f"earlier is a '{earlier.attrs.get('title')}'", "a result of wear()", "load('life.nc')")
        settings = json.loads(earlier.attrs["settings"]) | {"cycles": self.settings.cycles}
        if earlier.attrs["configuration"] != self._configuration() or settings != self._settings():
            raise InputError(
                "the earlier result has another case or other options", "the same case with at least as many cycles"
            )
        reached = int(earlier["cycle"].values[-1])
        if reached > self.settings.cycles:
            raise InputError(f"the earlier result has {reached} cycles already", f"at least {reached} cycles")

    def _configuration(self) -> str:
        return write_configuration(self.mechanism, self.options)

    def _settings(self) -> dict[str, Any]:
        return dataclasses.asdict(self.settings)

    def dataset(self, status: str, cause: str) -> xr.Dataset:
        """Return the result so far."""
        states, tracks = self.states, [track.name for track in self.mechanism.tracks]
        variables: dict[str, Any] = {
            name: (dims, values, {"units": units, "long_name": text})
            for name, (dims, values, units, text) in self._columns().items()
        }
        variables |= Loads.columns([state.loads for state in states])
        run = xr.Dataset(
            variables,
            coords={
                "cycle": ("state", np.array([state.cycle for state in states]), {"units": "1", "long_name": "cycle"}),
                "joint": ("joint", np.array(self.names, dtype=object)),
                "track": ("track", np.array(tracks, dtype=object)),
                "angle": (
                    "angle",
                    2.0 * np.pi * np.arange(self.settings.angles) / self.settings.angles,
                    {"units": "rad", "long_name": "angle in the frame of the bearing's body"},
                ),
            },
            attrs={
                "title": TITLE,
                "status": status,
                "cause": cause,
                "cycles": self.settings.cycles,
                "simulated_cycles": len(states) * self.runner.cycles_each,
                "cycle_time": self.runner.cycle_time,
                "settings": json.dumps(self._settings()),
                "configuration": self._configuration(),
            },
        )
        run.attrs["warnings"] = json.dumps([*self.warnings, *repetition(run)])
        return add_lives(run, self.mechanism, self.settings)

    def _columns(self) -> Mapping[str, tuple[tuple[str, ...], Any, str, str]]:
        """Return dimensions, values, unit and meaning of the result's variables, by name."""
        states = self.states
        depths = np.array([state.depths for state in states])
        clearance = np.array([bearing.clearance for bearing in self.bearings])
        area = np.array([bearing.area for bearing in self.bearings])
        largest = depths.max(axis=-1)
        loads = [state.loads for state in states]
        rates, corrections = np.array([state.rates for state in states]), np.array([state.correction for state in states])
        found = depth_errors(
            np.array([state.cycle for state in states]), depths, rates, np.array([part.energy for part in loads]), corrections
        )
        deviation = np.array([part.deviation for part in loads])
        return {
            "depth": (("state", "joint", "angle"), depths, "m", "depth of the worn bearing, by angle in the frame of its body"),
            "depth_largest": (("state", "joint"), largest, "m", "largest depth of the worn bearing"),
            "depth_error": (
                ("state", "joint"),
                found.error,
                "m",
                "half the 95 % interval of the largest depth",
            ),
            "worn_volume": (("state", "joint"), depths.sum(axis=-1) * area, "m^3", "worn volume"),
            "worn_clearance": (("state", "joint"), clearance + largest, "m", "largest radial clearance of the worn joint"),
            "peak_force": (
                ("state", "joint"),
                np.array([part.peak.mean(axis=0) for part in loads]),
                "N",
                "largest force of the joint in a cycle, mean over the members",
            ),
            "track_deviation": (
                ("state", "track"),
                deviation.mean(axis=1),
                "m",
                "largest deviation of the tracked point in a cycle, mean over the members",
            ),
            "track_deviation_error": (
                ("state", "track"),
                np.stack([mean_error(deviation[..., k]) for k in range(deviation.shape[2])], axis=-1)
                if deviation.shape[2]
                else np.zeros((len(states), 0)),
                "m",
                "half the 95 % interval of the mean largest deviation of the tracked point",
            ),
            "cycle_scatter": (
                ("joint",),
                found.scatter,
                "1",
                "relative standard deviation of the wear of single cycles, at the deepest angle",
            ),
            "cycle_drift": (
                ("joint",),
                found.drift,
                "1",
                "relative change of the wear from the first averaged cycle to the last; 0 if it may be chance",
            ),
            "member_rate": (("state", "member", "joint", "angle"), rates, "m", "depth that each simulated cycle wears"),
            "depth_correction": (
                ("state", "joint", "angle"),
                corrections,
                "m",
                "depth minus that of loads that are constant over each step",
            ),
            "step": (("state",), np.array([state.step for state in states]), "1", "cycles since the last state"),
            "clearance": (("joint",), clearance, "m", "radial clearance of the round bearing"),
            "bearing_radius": (("joint",), np.array([bearing.radius for bearing in self.bearings]), "m", "bearing radius"),
        }


def _period(mechanism: Mechanism, settings: Wear) -> float | None:
    """Return the period of the drive [s] if a cycle is a period; None if a cycle is a whole run."""
    if settings.cycle == "run":
        return None
    try:
        return drive_period(mechanism)
    except InputError:
        if settings.cycle == "period":
            raise
        return None
